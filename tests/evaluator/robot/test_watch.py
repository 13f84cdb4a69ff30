"""The eye on a port believes nothing that cannot be."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np
import pytest

from shearline.evaluator.robot.errors import Ending, MotionEnded
from shearline.evaluator.robot.port import Mode, Sample
from shearline.evaluator.robot.watch import STALL_S, ZEROS_MAX, Halted, Watch

TRUE = Sample(1.0, np.ones(3), np.ones(3), np.ones(3), np.ones(3), np.eye(4), np.ones(6), Mode.MOVE)


class Tape:
    """A port that says what it was told to, and the last for ever."""

    def __init__(self, samples: Iterable[Sample]) -> None:
        self._samples: Iterator[Sample] = iter(samples)
        self._last = TRUE

    def sample(self) -> Sample:
        self._last = next(self._samples, self._last)
        return self._last


def watch(samples: Iterable[Sample], halt: Callable[[], None] = lambda: None) -> Watch:
    """Watch a tape, with a clock on the wall that goes on by a tenth of a second a look."""
    wall = iter(np.arange(0.0, 1e6, 0.1))
    return Watch(Tape(samples), halt, lambda: float(next(wall)))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("lie", "ending"),
    [
        (TRUE._replace(q=np.full(3, np.nan)), Ending.INVALID),
        (TRUE._replace(o_f_ext=np.full(6, np.inf)), Ending.INVALID),
        (TRUE._replace(t_s=np.nan), Ending.INVALID),
        (TRUE._replace(o_t_ee=2.0 * np.eye(4)), Ending.INVALID),
        (TRUE._replace(t_s=0.5), Ending.INVALID),
        (TRUE._replace(mode=Mode.USER_STOPPED), Ending.USER_STOP),
        (TRUE._replace(mode=Mode.REFLEX), Ending.REFLEX),
        (TRUE._replace(errors=("self_collision",)), Ending.REFLEX),
    ],
)
def test_what_cannot_be_or_says_stop_ends_the_motion(lie: Sample, ending: Ending) -> None:
    watching = watch([TRUE, lie])
    watching.look()
    with pytest.raises(MotionEnded) as ended:
        watching.look()
    assert ended.value.ending is ending


def test_a_clock_that_stands_is_a_dead_link() -> None:
    with pytest.raises(MotionEnded, match=f"{STALL_S} s") as ended:
        watch([TRUE]).until(2.0)
    assert ended.value.ending is Ending.INVALID


def test_a_clock_that_runs_is_waited_for() -> None:
    samples = [TRUE._replace(t_s=1.0 + 0.001 * i) for i in range(100)]
    assert watch(samples).until(1.05).t_s == pytest.approx(1.05)


def test_nobody_looked_is_no_stall() -> None:
    watching = watch([TRUE])
    watching.look()
    for _ in range(10):
        watching.refresh()
        watching.look()


@pytest.mark.parametrize("dead", [{"o_f_ext": np.zeros(6)}, {"tau_ext": np.zeros(3)}])
def test_a_sensor_of_exact_zeros_is_dead(dead: dict[str, np.ndarray]) -> None:
    zero = TRUE._replace(**dead)  # type: ignore[arg-type]
    samples = [zero._replace(t_s=1.0 + 0.001 * i) for i in range(2 * ZEROS_MAX)]
    with pytest.raises(MotionEnded, match="exactly zero"):
        watch(samples).until(2.0)


def test_a_wish_to_halt_is_heard_at_every_look() -> None:
    def halt() -> None:
        raise Halted("the run was stopped")

    with pytest.raises(Halted):
        watch([TRUE], halt).until(0.0)
