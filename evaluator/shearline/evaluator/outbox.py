"""Results on their way: sent again until the learner has them, and remembered a little longer.

Which messages came and who may speak is the mailbox's business; this knows results and time.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass, field

from shearline.protocol.messages import Result

#: What is not answered is sent again after this long, then ever more slowly [s].
RESEND_S_MIN = 0.25
RESEND_S_MAX = 1.0

#: Results remembered after they were acknowledged: their trials may come once more.
ANSWERED_MAX = 4


@dataclass(slots=True)
class _Unacked:
    """A result that the learner may not have, and when it is sent."""

    result: Result
    due_s: float
    delay_s: float = RESEND_S_MIN


@dataclass(slots=True)
class Outbox:
    """All results of one boot that the learner may not have, and the last few that it has."""

    unacked: dict[str, _Unacked] = field(default_factory=dict)
    answered: OrderedDict[str, Result] = field(default_factory=OrderedDict)

    def put(self, result: Result, now_s: float) -> None:
        """Have a result sent, from now on until it is acknowledged."""
        self.answered.pop(result.token, None)
        self.unacked[result.token] = _Unacked(result, now_s)

    def again(self, token: str, now_s: float) -> bool:
        """Have the result of a trial that came again sent at once; tell whether there is one."""
        if token in self.answered:
            self.put(self.answered[token], now_s)
        elif token in self.unacked:
            self.unacked[token].due_s = now_s
        else:
            return False
        return True

    def all_again(self, now_s: float) -> None:
        """Have everything sent anew: whoever listens now may have heard nothing."""
        for unacked in self.unacked.values():
            unacked.due_s, unacked.delay_s = now_s, RESEND_S_MIN

    def acked(self, token: str) -> bool:
        """Note that the learner has a result; tell whether that was news."""
        unacked = self.unacked.pop(token, None)
        if unacked is None:
            return False
        self.answered[token] = unacked.result
        while len(self.answered) > ANSWERED_MAX:
            self.answered.popitem(last=False)
        return True

    def due(self, now_s: float) -> Iterator[Result]:
        """Yield the results that are to be sent now."""
        for unacked in self.unacked.values():
            if now_s >= unacked.due_s:
                unacked.due_s = now_s + unacked.delay_s
                unacked.delay_s = min(2 * unacked.delay_s, RESEND_S_MAX)
                yield unacked.result

    def next_s(self) -> float:
        """Return when the next result is due [s]; infinity if none is on its way."""
        return min((unacked.due_s for unacked in self.unacked.values()), default=float("inf"))
