"""Every learner we ship keeps the contract that we publish, as a user's would have to."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec

import pytest

from shearline.learner import (
    Learner,
    LearnerError,
    Space,
    SwitchError,
    UnknownLearnerError,
    create,
)
from shearline.learner.registry import EXTRAS, LEARNERS
from shearline.learner.testing import LearnerContract
from shearline.protocol.errors import ConfigError


class Shipped(LearnerContract):
    name: str

    def make(self, space: Space, episode_length: int, seed: int) -> Learner:
        return create(self.name, space, episode_length, seed)


class TestPSP(Shipped):
    name = "psp"


class TestPSPPaper(Shipped):
    name = "psp-paper"


class TestPSPRanked(Shipped):
    name = "psp-ranked"


class TestHiREPS(Shipped):
    name = "hireps"


class TestCMAES(Shipped):
    name = "cmaes"


class TestGA(Shipped):
    name = "ga"


class TestPSO(Shipped):
    name = "pso"


class TestRandom(Shipped):
    name = "random"


class TestLatinHypercube(Shipped):
    name = "lhs"


@pytest.mark.skipif(find_spec("optuna") is None, reason="needs the extra 'tpe'")
class TestTPE(Shipped):
    name = "tpe"


def test_every_name_is_held_to_the_contract() -> None:
    assert {held.name for held in Shipped.__subclasses__()} == {*LEARNERS, *EXTRAS}


@pytest.mark.parametrize("name", LEARNERS)
def test_a_snapshot_says_whose_it_is(name: str) -> None:
    assert create(name, Space.unit(2)).snapshot()["learner"] == name


def test_an_unknown_name_is_refused_with_the_known_ones() -> None:
    with pytest.raises(UnknownLearnerError, match="psp, psp-paper, "):
        create("pps", Space.unit(2))


def test_an_unknown_name_is_a_mistake_of_the_one_who_asks() -> None:
    assert issubclass(UnknownLearnerError, ConfigError)
    assert issubclass(SwitchError, ConfigError)


@pytest.mark.parametrize("name", LEARNERS)
def test_an_unknown_switch_is_refused(name: str) -> None:
    with pytest.raises(SwitchError, match="sharpness"):
        create(name, Space.unit(2), sharpness=3)


@pytest.mark.parametrize(("episode_length", "seed"), [(0, 0), (-1, 0), (20, -1)])
def test_senseless_episodes_and_seeds_are_refused(episode_length: int, seed: int) -> None:
    with pytest.raises(LearnerError):
        create("psp", Space.unit(2), episode_length, seed)


def test_importing_and_asking_for_a_first_episode_loads_no_learning_library() -> None:
    code = (
        "import sys; from shearline.learner import create, Space;"
        "create('psp', Space.unit(3)).ask(20);"
        "sys.exit(any(m.split('.')[0] in ('sklearn', 'scipy') for m in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
