"""The run at a glance, as a value."""

from __future__ import annotations

from dataclasses import dataclass

from shearline.learner.dispatcher.core import Dispatcher
from shearline.protocol.messages import Status

#: Episodes a status looks back on; keeps it far below what one message may hold.
HISTORY_MAX = 1000


@dataclass(frozen=True, slots=True)
class Vitals:
    """What only the shell around a dispatcher can measure; see :class:`Status` for the fields."""

    rate_hz: float = 0.0
    step_ms_max: float = 0.0
    step_ms_p99: float = 0.0
    step_cpu_ms_max: float = 0.0
    step_cpu_ms_p99: float = 0.0
    malformed: int = 0
    dropped: int = 0


def status(dispatcher: Dispatcher, *, run: str, learner: str, vitals: Vitals) -> Status:
    """Return where the run stands.

    Args:
        dispatcher: Whose run it is.
        run: The run's name.
        learner: The learner's name.
        vitals: What its shell measured.
    """
    desk, book = dispatcher.desk, dispatcher.book
    trials = len(book.episodes[-1]) if book.episodes else 0
    return Status(
        run=run,
        task=desk.rules.task.name,
        learner=learner,
        epoch=book.epoch,
        state=desk.state,
        episode=max(len(book.episodes) - 1, 0),
        episodes=desk.rules.episodes,
        trials_per_episode=desk.rules.trials,
        confirming=sum(trials for _, trials in desk.rules.confirming()),
        pending=len(book.pending),
        leased=book.unsettled - len(book.pending),
        done=trials - book.unsettled,
        counted=book.tally.counted,
        lost=book.tally.lost,
        late=book.tally.late,
        duplicates=book.tally.surplus + desk.resends,
        aborted=book.tally.aborted,
        rejected=book.tally.rejected,
        rate_hz=vitals.rate_hz,
        step_ms_max=vitals.step_ms_max,
        step_ms_p99=vitals.step_ms_p99,
        step_cpu_ms_max=vitals.step_cpu_ms_max,
        step_cpu_ms_p99=vitals.step_cpu_ms_p99,
        malformed=vitals.malformed,
        dropped=vitals.dropped,
        evaluators=[desk.describe(evaluator) for evaluator in desk.roster],
        history=book.closed[-HISTORY_MAX:],
        at_s=desk.now_s,
    )
