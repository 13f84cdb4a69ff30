"""Tasks by name: the user's function, what it may return, and what a wrong name is told."""

import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.evaluator import task as exported
from shearline.evaluator.base import TrialAborted
from shearline.evaluator.builtin import BowlTask, builtin_names, builtin_spec, builtin_task
from shearline.evaluator.local import run_trial
from shearline.evaluator.tasks import FunctionTask, load_task, outcome_of, task
from shearline.protocol.errors import ConfigError, SpaceError
from shearline.protocol.messages import OutcomeKind
from shearline.protocol.task import digest

SPACE = {"x": ("m", -5.0, 5.0), "y": ("m", -5.0, 5.0)}

FILE = """
    from shearline.evaluator import task
    import neighbour

    @task(space={"x": ("m", -5.0, 5.0), "y": ("m", -5.0, 5.0)}, trial_s=2.0, options={"k": 1.0})
    def bowl(theta, rng):
        return theta["x"] ** 2 + theta["y"] ** 2, True, {"draw": rng.random(), "n": neighbour.N}

    def plain(theta, rng):
        return 0.0, True

    NOT_EVEN_A_FUNCTION = 3
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "my_bowl.py").write_text(textwrap.dedent(FILE))
    (tmp_path / "neighbour.py").write_text("N = 3\n")
    package = tmp_path / "my_lab"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "tasks.py").write_text(textwrap.dedent(FILE))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.path", ["", *__import__("sys").path])
    monkeypatch.setattr("sys.modules", dict(__import__("sys").modules))
    return tmp_path


def _nothing() -> None:
    return


# -- the decorator -------------------------------------------------------------------------------


@task(space=SPACE, options={"level": "easy"})
def cone(theta: dict[str, float], rng: np.random.Generator) -> tuple[float, bool]:
    """A function that stays what it was."""
    return abs(theta["x"]) + rng.random(), theta["y"] > 0.0


def test_a_declared_function_stays_callable() -> None:
    cost, success = cone({"x": 1.0, "y": 1.0}, np.random.default_rng(0))
    assert cost > 1.0
    assert success
    assert cone.__doc__ == "A function that stays what it was."


def test_the_decorator_is_exported_where_the_readme_says() -> None:
    assert exported is task


def test_a_function_is_run_with_names_and_a_generator_of_the_trials_seed() -> None:
    run = FunctionTask(cone, "lab:cone").run
    outcome = run(np.array([2.0, 1.0]), 7, _nothing)
    assert outcome.cost == 2.0 + np.random.default_rng(7).random()
    assert outcome.success
    assert run(np.array([2.0, 1.0]), 7, _nothing) == outcome
    assert run(np.array([2.0, 1.0]), 8, _nothing) != outcome


def test_a_functions_fingerprint_names_python_the_function_and_its_source(folder: Path) -> None:
    before = load_task("my_bowl:bowl").engine
    assert before.startswith("python 3.")
    assert " function my_bowl:bowl " in before
    source = folder / "my_bowl.py"
    source.write_text(source.read_text() + "\n# changed\n")
    after = load_task("my_bowl:bowl").engine
    assert before.split()[:-1] == after.split()[:-1]
    assert before != after


def test_a_functions_source_may_be_unknown() -> None:
    names: dict[str, Any] = {}
    exec("def f(theta, rng): return 0.0, True", names)
    assert FunctionTask(task(space=SPACE)(names["f"]), "f").engine.endswith(" unknown")


@pytest.mark.parametrize("trial_s", [0.0, -1.0, float("nan"), float("inf"), 1e6])
def test_a_trial_must_have_an_end(trial_s: float) -> None:
    with pytest.raises(ConfigError, match="trial_s"):
        task(space=SPACE, trial_s=trial_s)


def test_a_malformed_space_is_refused_where_it_is_written() -> None:
    with pytest.raises(SpaceError, match="low < high"):
        task(space={"x": ("m", 1.0, 1.0)})


# -- what it returns -----------------------------------------------------------------------------


@given(
    st.floats(allow_nan=False, allow_infinity=False) | st.integers(-(2**50), 2**50),
    st.booleans(),
    st.dictionaries(st.text(max_size=5), st.floats(allow_nan=False), max_size=3),
)
def test_cost_success_and_numbers_are_taken_as_they_are(
    cost: float,
    success: bool,  # noqa: FBT001 - drawn
    extras: dict[str, float],
) -> None:
    for returned in ((cost, success, extras), [np.float64(cost), np.bool_(success), extras]):
        outcome = outcome_of(returned)
        assert (outcome.cost, outcome.success, outcome.extras) == (cost, success, extras)
    assert outcome_of((cost, success)).extras == {}


@pytest.mark.parametrize(
    ("returned", "expected"),
    [
        (None, "expected (cost, success)"),
        (1.0, "expected (cost, success)"),
        ((1.0,), "expected (cost, success)"),
        ((1.0, True, {}, 4), "expected (cost, success)"),
        ("ab", "expected (cost, success)"),
        (("1", True), "finite number as cost"),
        ((True, True), "finite number as cost"),
        ((float("nan"), True), "finite number as cost"),
        ((float("inf"), False), "finite number as cost"),
        ((None, False), "finite number as cost"),
        ((1.0, 1), "True or False"),
        ((1.0, "yes"), "True or False"),
        ((1.0, True, 3.0), "dict of numbers"),
        ((1.0, True, {"a": "b"}), "dict of numbers"),
        ((1.0, True, {1: 2.0}), "dict of numbers"),
        ("x" * 1000, "got 'xxx"),
    ],
)
def test_anything_else_is_an_abort_that_says_what_was_expected(
    returned: object, expected: str
) -> None:
    with pytest.raises(TrialAborted) as caught:
        outcome_of(returned)
    assert expected in str(caught.value)
    assert len(str(caught.value)) < 200


@pytest.mark.parametrize(
    ("fault", "why"),
    [
        (ValueError("no such angle"), "ValueError: no such angle"),
        (SystemExit(3), "SystemExit: 3"),
        (TrialAborted("the tool broke"), "the tool broke"),
        (RecursionError(), "RecursionError: "),
    ],
)
def test_an_exception_is_an_aborted_trial_with_its_message(fault: BaseException, why: str) -> None:
    @task(space=SPACE)
    def broken(theta: dict[str, float], rng: np.random.Generator) -> None:
        del theta, rng
        raise fault

    verdict = run_trial(FunctionTask(broken, "lab:broken"), [0.0, 0.0], 1)
    assert (verdict.kind, verdict.why) == (OutcomeKind.ABORTED, why)


# -- by name -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "called"),
    [
        ("my_bowl:bowl", "my_bowl:bowl"),
        ("my_bowl.py:bowl", "my_bowl:bowl"),
        ("./my_bowl.py:bowl", "my_bowl:bowl"),
        ("my_lab/tasks.py:bowl", "tasks:bowl"),
        ("my_lab.tasks:bowl", "my_lab.tasks:bowl"),
    ],
)
@pytest.mark.usefixtures("folder")
def test_a_function_is_found_in_a_file_or_a_module(name: str, called: str) -> None:
    loaded = load_task(name)
    assert loaded.spec.name == called
    assert loaded.spec.trial_s == 2.0
    assert loaded.spec.options == {"k": 1.0}
    loaded.warm()
    outcome = loaded.run(np.array([1.0, 2.0]), 3, _nothing)
    assert (outcome.cost, outcome.success) == (5.0, True)
    assert outcome.extras == {"draw": np.random.default_rng(3).random(), "n": 3.0}


@pytest.mark.usefixtures("folder")
def test_learner_and_evaluator_mean_the_same_task_however_they_spell_its_file() -> None:
    assert digest(load_task("my_bowl:bowl").spec) == digest(load_task("./my_bowl.py:bowl").spec)


def test_a_file_with_the_name_of_a_module_in_use_does_not_replace_it(folder: Path) -> None:
    import json  # noqa: PLC0415 - the module in use

    (folder / "json.py").write_text(textwrap.dedent(FILE))
    assert load_task("json:bowl").spec.name == "json:bowl"
    assert json.loads("[1]") == [1]
    assert __import__("sys").modules["json"] is json


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("nothing", "no task 'nothing': expected one of keylock"),
        ("nothing:at_all", "no file nothing.py in"),
        ("my_lab.nothing:bowl", "no file my_lab.nothing.py in"),
        ("my_bowl:nothing", "expected one of my_bowl:bowl"),
        ("my_bowl:NOT_EVEN_A_FUNCTION", "no function"),
        ("my_bowl:plain", "put @task(space={...}) above it"),
        ("my_bowl:", "no function ''"),
        ("broken:f", "broken.py line 2 is not Python"),
        ("lonely:f", "lonely cannot be imported: No module named 'not_there_at_all'"),
        ("raises:f", "raises cannot be imported: ZeroDivisionError: division by zero"),
        ("leaves:f", "leaves cannot be imported: SystemExit: 5"),
    ],
)
def test_what_cannot_be_loaded_is_said_in_one_sentence(
    folder: Path, name: str, expected: str
) -> None:
    (folder / "broken.py").write_text("x = 1\ndef f(:\n")
    (folder / "lonely.py").write_text("import not_there_at_all\n")
    (folder / "raises.py").write_text("1 / 0\n")
    (folder / "leaves.py").write_text("raise SystemExit(5)\n")
    with pytest.raises(ConfigError) as caught:
        load_task(name)
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


# -- built-ins -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [*builtin_names()[:-1], "sleep", "sleep-5"])
def test_a_built_in_bears_its_name_and_says_what_it_is_about_without_being_loaded(
    name: str,
) -> None:
    spec = builtin_spec(name)
    assert spec.name.startswith(name)
    assert digest(spec) == digest(builtin_task(spec.name).spec)


def test_a_name_with_a_colon_is_never_a_built_in() -> None:
    with pytest.raises(ConfigError, match="no task 'os:system'"):
        builtin_task("os:system")


@pytest.mark.parametrize("name", ["sphere", "rastrigin", "sleep-1"])
def test_a_cheap_built_in_runs_and_repeats(name: str) -> None:
    loaded = load_task(name)
    loaded.warm()
    low = [bounds[1] for bounds in loaded.spec.space.values()]
    first = run_trial(loaded, low, 1)
    assert first.cost == run_trial(loaded, low, 1).cost
    assert first.cost > 0.0
    assert loaded.engine


def test_the_bowl_beats_while_it_sleeps_and_lets_a_beat_stop_it() -> None:
    beats = []

    def beat() -> None:
        beats.append(1)
        if len(beats) == 2:
            raise TrialAborted("enough")

    verdict = run_trial(BowlTask(60_000), [0.0, 0.0], 1, beat)
    assert (verdict.kind, verdict.why) == (OutcomeKind.ABORTED, "enough")


def test_the_bowl_succeeds_within_three_metres() -> None:
    assert run_trial(BowlTask(0), [3.0, 0.0], 1).kind is OutcomeKind.SUCCESS
    failure = run_trial(BowlTask(0), [3.0, 0.1], 1)
    assert (failure.kind, failure.why) == (OutcomeKind.FAILURE, "far")
