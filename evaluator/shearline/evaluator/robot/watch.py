"""The eye on a port: newest states, but only those that can be true.

A port may lie without raising: NaN, a clock that stands, a wrench of exact zeros. Everything above
looks at the robot through here, so that a lie ends the motion as a fault and never becomes a cost.
It sends nothing to the robot.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator

import numpy as np

from shearline.evaluator.robot.errors import Ending, MotionEnded
from shearline.evaluator.robot.frames import is_pose
from shearline.evaluator.robot.port import Mode, RobotPort, Sample

#: A clock that stands for so long by the wall is a dead link [s].
STALL_S = 0.25

#: Between two looks at a clock that has not moved on [s].
NAP_S = 2e-4

#: A real sensor is never exactly zero on all axes so often in a row.
ZEROS_MAX = 50

_ENDINGS = {Mode.USER_STOPPED: Ending.USER_STOP, Mode.REFLEX: Ending.REFLEX}


class Halted(Exception):  # noqa: N818 - somebody's wish, not a mistake
    """The trial is to end in order: the arm may still be moved out of the lock."""


class Watch:
    """Looks at a port.

    Args:
        port: Open.
        halt: Called at every look; raises :class:`Halted` if the motion is to end.
        wall_s: A clock of this computer [s].
        on_block: Called before every call of the port that may last.
    """

    def __init__(
        self,
        port: RobotPort,
        halt: Callable[[], None] = lambda: None,
        wall_s: Callable[[], float] = time.monotonic,
        on_block: Callable[[], None] = lambda: None,
    ) -> None:
        self._port = port
        self._halt = halt
        self._wall_s = wall_s
        self._on_block = on_block
        self._t_s = -np.inf
        self._fresh_s = wall_s()
        self._zeros = 0

    def look(self) -> Sample:
        """Return the newest sample.

        Raises:
            MotionEnded: If the robot says that it stopped, or says what cannot be.
        """
        sample = self._port.sample()
        self._check_mode(sample)
        self._check_values(sample)
        self._check_clock(sample)
        return sample

    def until(self, t_s: float) -> Sample:
        """Wait for a sample of the robot's time ``t_s`` [s] or later.

        Raises:
            MotionEnded: As :meth:`look`, also when the clock does not get there.
            Halted: If the motion is to end.
        """
        while True:
            self._halt()
            before_s = self._t_s
            sample = self.look()
            if sample.t_s >= t_s:
                return sample
            if sample.t_s == before_s:
                time.sleep(NAP_S)

    @contextlib.contextmanager
    def blocked(self) -> Iterator[None]:
        """Around a call of the port that may last: nobody looks meanwhile, and all is well."""
        self._on_block()
        try:
            yield
        finally:
            self.refresh()

    def refresh(self) -> None:
        """Forget how long ago the clock moved: nobody looked meanwhile."""
        self._fresh_s = self._wall_s()

    def _check_mode(self, sample: Sample) -> None:
        ending = _ENDINGS.get(sample.mode)
        if ending is not None or sample.errors:
            said = ", ".join(sample.errors) or "no error named"
            raise MotionEnded(ending or Ending.REFLEX, f"the robot is {sample.mode}: {said}")

    def _check_values(self, sample: Sample) -> None:
        numbers = (sample.q, sample.dq, sample.tau_j, sample.tau_ext, sample.o_f_ext)
        if not (np.isfinite(sample.t_s) and all(np.isfinite(values).all() for values in numbers)):
            raise MotionEnded(Ending.INVALID, "the robot says numbers that are not finite")
        if not is_pose(sample.o_t_ee):
            raise MotionEnded(Ending.INVALID, "the robot says a pose that is no pose")
        if sample.t_s != self._t_s:
            felt = sample.o_f_ext.any() and sample.tau_ext.any()
            self._zeros = 0 if felt else self._zeros + 1
        if self._zeros > ZEROS_MAX:
            raise MotionEnded(
                Ending.INVALID, f"the force sensor says exactly zero {self._zeros} times in a row"
            )

    def _check_clock(self, sample: Sample) -> None:
        now_s = self._wall_s()
        if sample.t_s < self._t_s:
            raise MotionEnded(
                Ending.INVALID, f"the robot's clock fell from {self._t_s:.3f} to {sample.t_s:.3f} s"
            )
        if sample.t_s > self._t_s:
            self._t_s, self._fresh_s = sample.t_s, now_s
        elif now_s - self._fresh_s > STALL_S:
            raise MotionEnded(
                Ending.INVALID, f"the robot's clock has stood at {sample.t_s:.3f} s for {STALL_S} s"
            )
