"""What can go wrong between the skill and an arm, one class per kind of answer to it.

Every message is one sentence for the operator: what was expected, what came, what to do.
"""

from __future__ import annotations

import enum

from shearline.protocol.errors import ConfigError, LinkError, ShearlineError


class Ending(enum.StrEnum):
    """Why a motion ended other than by its own completion."""

    TIME = "time"  # Contact.t_max_s, or the reference's own time-out: the port's watchdog
    GUARD = "guard"  # something left the guard
    STOPPED = "stopped"  # somebody called stop()
    USER_STOP = "user stop"  # the operator's stop button, or the emergency stop
    REFLEX = "reflex"  # the robot's own reaction: collision, limits, discontinuity
    LINK = "link"  # the connection to the robot is lost
    INVALID = "invalid"  # the robot says what cannot be: NaN, a clock that stands, a dead sensor


class RobotError(ShearlineError):
    """Base of everything that an arm, or what speaks for it, cannot do."""


class RobotRefused(RobotError):  # noqa: N818 - a refusal is an answer, nothing has moved
    """The robot cannot be used as it is: version, mode, brakes, joints; nothing has moved."""


class RobotUnreachable(LinkError, RobotError):  # noqa: N818 - as above
    """Nobody answers where the robot was said to be; nothing has moved."""


class BoundsError(ConfigError, RobotError):
    """The lab's bounds file is malformed, inconsistent or too wide; nothing has moved."""


class MotionEnded(RobotError):  # noqa: N818 - it is how most contacts end
    """A motion is over before its own completion, and the arm stands or is stopping.

    Args:
        ending: Why.
        what: One sentence, with the port's own words.
    """

    def __init__(self, ending: Ending, what: str) -> None:
        super().__init__(what)
        self.ending = ending
