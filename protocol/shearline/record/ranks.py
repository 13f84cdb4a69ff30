"""Trials in order: by cost for the eye that compares, by a word for the hand that looks one up.

Outcomes in, numbers out; where they are shown is not known here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from shearline.protocol.errors import RecordError
from shearline.protocol.messages import Counted, OutcomeKind


def ranks(outcomes: Sequence[Counted]) -> dict[int, int]:
    """Return the place of each trial: successes by cost, then failures by cost, then the lost."""
    return {outcome.trial: place for place, outcome in enumerate(sorted(outcomes, key=_order))}


def choose(outcomes: Sequence[Counted], word: str) -> int:
    """Return the number of the trial that a word means.

    Args:
        outcomes: Of one run.
        word: A number; ``best`` and ``worst`` success by cost; ``failure``, the cheapest one; or
            the name of a failure (``torque``, ``time``, ...), the first of them.

    Raises:
        RecordError: If there is no such trial.
    """
    ordered = sorted(outcomes, key=_order)
    won = [outcome.trial for outcome in ordered if outcome.kind is OutcomeKind.SUCCESS]
    lost = [outcome for outcome in ordered if outcome.kind is not OutcomeKind.SUCCESS]
    if word.isdecimal():
        found = [outcome.trial for outcome in outcomes if outcome.trial == int(word)]
    elif word in {"best", "worst"}:
        found = won[:: 1 if word == "best" else -1]
    elif word == "failure":
        found = [outcome.trial for outcome in lost]
    else:
        found = sorted(outcome.trial for outcome in lost if outcome.why == word)
    if found:
        return found[0]
    whys = sorted({outcome.why for outcome in lost if outcome.why.isidentifier()})
    last = max((outcome.trial for outcome in outcomes), default=-1)
    words = ", ".join(["best", "worst", "failure", *whys])
    raise RecordError(f"no trial {word!r} in this run: expected a number up to {last}, or {words}")


def _order(outcome: Counted) -> tuple[int, float, int]:
    kind = {OutcomeKind.SUCCESS: 0, None: 2}.get(outcome.kind, 1)
    cost = outcome.cost if outcome.kind is not None else math.inf
    return kind, cost, outcome.trial
