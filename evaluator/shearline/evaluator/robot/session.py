"""A running contact of a Franka, from its first reference to its end."""

from __future__ import annotations

from typing import Protocol

from shearline.evaluator.robot.client import Client
from shearline.evaluator.robot.errors import Ending, MotionEnded
from shearline.evaluator.robot.port import Array, Clip


class Latching(Protocol):
    """The port of a session."""

    def is_current(self, session: Session) -> bool:
        """Tell whether a session is that of the last contact."""
        ...

    def may_aim(self, pose: Array) -> bool:
        """Tell whether a pose may be aimed at."""
        ...

    def ended(self) -> MotionEnded | None:
        """Wait for the end of the motion, and return why, if not by our own wish."""
        ...


class Session:
    """A running contact of a Franka; a :class:`~shearline.evaluator.robot.port.ContactSession`.

    Args:
        port: Whose contact it is.
        client: Runs it.
        clip: What it clips with.

    Attributes:
        over: Whether the end of the motion has been seen.
    """

    def __init__(self, port: Latching, client: Client, clip: Clip) -> None:
        self._port = port
        self._client = client
        self.clip = clip
        self.over = False

    def ref(self, o_t_ee: Array) -> None:
        """Set the reference."""
        if not self._port.is_current(self):
            raise MotionEnded(Ending.STOPPED, "another contact has begun")
        if self.over or not self._client.running():
            self._raise()
        if not self._port.may_aim(o_t_ee):  # a brake that was not heard may still be under way
            self._client.finish()
            self._raise()
        self._client.aim(o_t_ee)

    def gains(self, stiffness: Array, damping: Array) -> None:
        """Change the gains."""
        if not self._port.is_current(self):
            raise MotionEnded(Ending.STOPPED, "another contact has begun")
        if self.over or not self._client.running():
            self._raise()
        self._client.tune(stiffness, damping)

    def end(self) -> None:
        """Come to rest and leave the motion."""
        if self.over or not self._port.is_current(self):
            return
        if not self._client.running():
            self._raise()
        try:
            self._client.finish()
            how = self._port.ended()
        finally:
            self.over = True
        if how is not None:
            raise how

    def _raise(self) -> None:
        try:
            how = self._port.ended()
        finally:
            self.over = True
        raise how or MotionEnded(Ending.STOPPED, "the contact is over")
