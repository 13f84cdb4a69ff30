"""One law for the switches of all learners; psp's own are tested beside it."""

from __future__ import annotations

from dataclasses import fields

import pytest

from shearline.learner import Space, SwitchError, create
from shearline.learner.cmaes import CMAESConfig
from shearline.learner.ga import GAConfig
from shearline.learner.hireps import HiREPSConfig
from shearline.learner.pso import PSOConfig
from shearline.learner.switches import having, plain

CONFIGS = {"hireps": HiREPSConfig, "cmaes": CMAESConfig, "ga": GAConfig, "pso": PSOConfig}


@pytest.mark.parametrize("name", CONFIGS)
def test_every_switch_is_documented(name: str) -> None:
    for field in fields(CONFIGS[name]):
        assert f" {field.name}: " in (CONFIGS[name].__doc__ or "")


@pytest.mark.parametrize("name", CONFIGS)
def test_words_stand_for_members_and_a_snapshot_has_the_words(name: str) -> None:
    changed = having(CONFIGS[name](), name, {"failures": "ordered"})
    assert plain(changed)["failures"] == "ordered"
    said = create(name, Space.unit(2), failures="ordered").snapshot()["config"]
    assert said == plain(changed)


@pytest.mark.parametrize("name", CONFIGS)
def test_a_switch_takes_only_its_own_words(name: str) -> None:
    with pytest.raises(SwitchError, match=f"{name}'s switch 'failures' takes one of alike"):
        create(name, Space.unit(2), failures="forgiven")


@pytest.mark.parametrize(
    ("name", "switch", "value"),
    [
        ("hireps", "options", 0),
        ("hireps", "information_loss", 0.0),
        ("hireps", "entropy", 1.1),
        ("hireps", "history", -1),
        ("hireps", "spread", 0.0),
        ("hireps", "shrinkage", -0.1),
        ("hireps", "memory", -1.0),
        ("hireps", "spread_min", 0.0),
        ("cmaes", "start", 1.5),
        ("cmaes", "spread", 0.0),
        ("ga", "tournament", 0),
        ("ga", "mutation_variance", -1.0),
        ("ga", "mutation_chance", 2.0),
        ("ga", "survivors", -1),
        ("pso", "inertia", -1.0),
        ("pso", "own", -1.0),
        ("pso", "swarm", -1.0),
        ("pso", "speed", -1.0),
    ],
)
def test_a_number_out_of_range_is_refused(name: str, switch: str, value: object) -> None:
    with pytest.raises(SwitchError, match=f"{name}'s switch '{switch}' takes"):
        create(name, Space.unit(2), 20, 0, **{switch: value})
