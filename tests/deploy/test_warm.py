"""``--warm-start``: from another run's record or journal, on the same parameters, and resumable."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import pytest

from shearline.deploy.cli import main
from shearline.deploy.exits import Exit
from shearline.deploy.warm import prior_of
from shearline.evaluator.builtin import builtin_spec
from shearline.learner.run.config import RunConfig, checked, difference, from_toml, to_toml
from shearline.protocol.errors import ConfigError

SPEC = builtin_spec("sleep-0")
SMALL = ["--episodes", "2", "--trials", "6", "--evaluators", "1", "--json"]


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "other"
    asked = ["up", "--task", "sleep-0", "--learner", "random", "--no-record", "--confirm", "3"]
    assert main([*asked, *SMALL, "--out", str(folder)]) == Exit.OK
    return folder


@pytest.mark.slow
def test_a_run_starts_from_the_trials_another_learned_from_and_remembers_them(
    other: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told = prior_of(other, SPEC, "psp")
    assert len(told.theta) == len(told.cost) == len(told.success) == 12  # no confirmation
    warm = ["up", "--task", "sleep-1", "--learner", "psp", "--no-record", *SMALL]
    folder = tmp_path / "warm"
    assert main([*warm, "--warm-start", str(other), "--out", str(folder)]) == Exit.OK
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["counted"] == 12
    kept = from_toml((folder / "run.toml").read_text())
    assert kept.warm_start == msgspec.structs.replace(told, run="other", task="sleep-0")


@pytest.mark.slow
def test_a_start_that_makes_no_sense_is_one_sentence(
    other: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cases = {
        ("sphere", "psp"): "other learned sleep-0 with x in [-5, 5] m: a run starts from another",
        ("sleep-0", "lhs"): "lhs cannot start from another run: choose one of cmaes",
    }
    for (task, learner), why in cases.items():
        asked = ["up", "--task", task, "--learner", learner, "--warm-start", str(other)]
        assert main([*asked, "--out", str(tmp_path / task)]) == Exit.USAGE
        said = capsys.readouterr().err
        assert why in said
        assert said.count("\n") == 1


def test_where_there_is_no_run_there_is_nothing_to_start_from(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["learner", "--task", "sleep-0", "--warm-start", str(tmp_path / "none")]
    assert main([*asked, "--out", str(tmp_path / "new")]) != Exit.OK
    assert "none" in capsys.readouterr().err


def test_a_learner_that_cannot_is_refused_before_anything_is_read() -> None:
    with pytest.raises(ConfigError, match="lhs cannot start"):
        prior_of(Path("nowhere"), SPEC, "lhs")


@pytest.mark.parametrize(
    ("theta", "cost", "why"),
    [
        ([[0.1, 0.2]], [], "got 1 tuples, 0 costs, 1 successes"),
        ([[0.1]], [1.0], "tuples of 2 values"),
    ],
)
def test_a_start_that_was_written_by_hand_must_add_up(
    theta: list[list[float]], cost: list[float], why: str
) -> None:
    start = {"run": "other", "theta": theta, "cost": cost, "success": [True]}
    with pytest.raises(ConfigError, match=why):
        checked({"task": msgspec.to_builtins(SPEC), "warm_start": start})


def test_a_start_is_part_of_a_run_and_survives_its_file() -> None:
    from shearline.learner.prior import Prior  # noqa: PLC0415

    cold = RunConfig(task=SPEC)
    start = Prior(run="other", task="sleep-0", theta=[[0.1, 0.2]], cost=[3.0], success=[True])
    warm = msgspec.structs.replace(cold, warm_start=start)
    assert from_toml(to_toml(warm)) == warm
    assert "warm_start" not in to_toml(cold)
    assert difference(warm, warm) == ""
    assert difference(cold, warm) == "it starts from other, or from other trials of it"
