"""What was asked for: TOML there and back, and sentences about what is wrong."""

from __future__ import annotations

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner.run.config import RunConfig, difference, from_toml, to_toml
from shearline.learner.run.seeds import trial_seed
from shearline.protocol.errors import ConfigError, SpaceError
from shearline.protocol.task import TaskSpec, digest

TASK = TaskSpec(
    name="keylock",
    space={"push": ("N", 0.1, 20.0), "k_rot": ("N m/rad", 5.0, 200.0)},
    options={"level": "limit", "wiggle": True, "gain": 0.3},
)
CONFIG = RunConfig(task=TASK)


@given(
    low=st.floats(-1e6, 1e6),
    width=st.floats(1e-3, 1e6),
    lease_s=st.floats(0.1, 3600.0),
    seed=st.integers(0, 2**63 - 1),
    unit=st.text(max_size=8).filter(lambda s: s.isprintable()),
)
def test_toml_reads_back_to_the_same_value_and_digest(
    low: float, width: float, lease_s: float, seed: int, unit: str
) -> None:
    task = TaskSpec(name="t", space={"x": (unit, low, low + width)}, options={"a": low})
    config = RunConfig(task=task, seed=seed, lease_s=lease_s, kinds=("function", "robot"))
    again = from_toml(to_toml(config))
    assert again == config
    assert digest(again.task) == digest(task)


def test_a_learners_switches_are_kept_as_they_were_said() -> None:
    switches = {"svm_c": 1e3, "labels": "previous", "tuples": [[0.5, 5.0], [1.0, 200.0]]}
    config = RunConfig(task=TASK, switches=switches)
    assert from_toml(to_toml(config)) == config


def test_the_order_of_parameters_is_kept() -> None:
    assert list(from_toml(to_toml(CONFIG)).task.space) == ["push", "k_rot"]
    assert CONFIG.space.names == ("push", "k_rot")


def test_a_task_may_be_named_where_someone_knows_it() -> None:
    text = 'task = "keylock"\nlearner = "psp"\nepisodes = 3\ntrials = 7\nseed = 5\n'
    config = from_toml(text, lambda name: msgspec.structs.replace(TASK, name=name))
    assert (config.task, config.episodes, config.trials, config.seed) == (TASK, 3, 7, 5)
    with pytest.raises(ConfigError, match="expected the task spelled out"):
        from_toml(text)


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("episodes = 0", r"Expected `int` >= 1 - at `\$.episodes`"),
        ("trials = 1.5", r"at `\$.trials`"),
        ("quorum = 2.0", r"at `\$.quorum`"),
        ("lease_s = nan", r"at `\$.lease_s`"),
        ("epsiodes = 3", "epsiodes"),
        ("seed = -1", r"at `\$.seed`"),
        ('kinds = ["simulater"]', r"at `\$.kinds"),
        ("episodes = ", "expected TOML"),
    ],
)
def test_what_is_wrong_is_named(line: str, why: str) -> None:
    text = f'{line}\n[task]\nname = "t"\n[task.space]\nx = ["", 0.0, 1.0]\n'
    with pytest.raises(ConfigError, match=why):
        from_toml(text)


def test_a_task_is_needed_and_its_space_checked() -> None:
    with pytest.raises(ConfigError, match="task"):
        from_toml("episodes = 3\n")
    with pytest.raises(SpaceError, match="low < high"):
        from_toml('[task]\nname = "t"\n[task.space]\nx = ["", 1.0, 0.0]\n')


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"seed": 1}, "its seed is 0, not 1"),
        ({"learner": "lhs"}, "its learner is 'psp-ranked', not 'lhs'"),
        ({"trials": 3}, "its trials is 20, not 3"),
        ({"switches": {"svm_c": 1e3}}, "its learner has other switches (none)"),
        ({"task": TaskSpec(name="keylock", space={"x": ("", 0.0, 1.0)})}, "its task is 'keylock'"),
        ({"lease_s": 9.0, "record": False, "speculative": False}, ""),
    ],
)
def test_what_makes_it_another_run_is_named(changes: dict[str, object], named: str) -> None:
    other = difference(msgspec.structs.replace(CONFIG, **changes), CONFIG)
    assert other.startswith(named)
    assert bool(other) == bool(named)


def test_the_rules_are_those_of_the_configuration() -> None:
    rules = RunConfig(task=TASK, losses_max=7, quorum=0.5, kinds=("robot",)).rules()
    assert (rules.task, rules.losses_max, rules.quorum) == (TASK, 7, 0.5)
    assert rules.kinds == ("robot",)


@given(seed=st.integers(0, 2**63 - 1), trial=st.integers(0, 10**9))
def test_a_trials_seed_is_its_own_and_fits_64_bits(seed: int, trial: int) -> None:
    found = trial_seed(seed, trial)
    assert 0 <= found < 2**63
    assert found == trial_seed(seed, trial)
    assert len({found, trial_seed(seed, trial + 1), trial_seed(seed + 1, trial)}) == 3
