"""Run a recorded trial again: to look at it, to prove it, or to ask what if.

:func:`again` runs one :class:`Case`, :func:`verify` holds what comes out against what is on record,
:mod:`shearline.evaluator.replay.film` makes a film of it. Who reads the record is no concern here.
"""

from shearline.evaluator.replay.again import Replayed, again
from shearline.evaluator.replay.case import Case
from shearline.evaluator.replay.change import Change, change_of
from shearline.evaluator.replay.verify import Verification, check_ended, judge, verify

__all__ = [
    "Case",
    "Change",
    "Replayed",
    "Verification",
    "again",
    "change_of",
    "check_ended",
    "judge",
    "verify",
]
