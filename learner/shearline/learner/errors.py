"""The learner's errors: one class per mistake, each message says what to do."""

from __future__ import annotations

from shearline.protocol.errors import ConfigError, ShearlineError


class LearnerError(ShearlineError, ValueError):
    """A learner was asked or told something its contract does not allow."""


class UnknownLearnerError(LearnerError, ConfigError):
    """No learner has that name."""


class SwitchError(LearnerError, ConfigError):
    """A learner has no such switch, or the switch no such value."""
