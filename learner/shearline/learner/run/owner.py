"""The owner: the one thread that decides, writes and answers.

In each step it takes what waits in the inbox, lets the dispatcher decide, writes the journal
entries of the whole step in one go, and only then lets anyone know. It never waits for a peer.
"""

from __future__ import annotations

import gc
import logging
import time
from collections import Counter, deque
from collections.abc import Callable

from shearline.learner.base import Recommendation
from shearline.learner.dispatcher import Dispatcher, status
from shearline.learner.dispatcher.entries import Entry, EpisodeDone, LearnerBooted, TrialsProposed
from shearline.learner.dispatcher.events import Begin, Event, Tick
from shearline.learner.dispatcher.instructions import (
    Ask,
    Broadcast,
    Ending,
    EndRun,
    Instruction,
    Journal,
    Publish,
    Say,
    Send,
)
from shearline.learner.dispatcher.states import RunState
from shearline.learner.dispatcher.status import Vitals
from shearline.learner.run.config import RunConfig
from shearline.learner.run.effort import Effort
from shearline.learner.run.fitter import Fitter, Modelled, Recommended
from shearline.learner.run.inbox import Inbox
from shearline.learner.run.incoming import Incoming
from shearline.learner.run.journal import Journal as JournalFile
from shearline.learner.run.outgoing import Outgoing, together
from shearline.learner.run.pulse import Pulse
from shearline.learner.run.signals import Hurry
from shearline.protocol.intake import Arrival, Presence
from shearline.protocol.messages import Snapshot, Status

STATUS_EVERY_S = 0.5

#: No step may cost more processor time, whatever evaluators do; one that does is logged [s].
STEP_CPU_S_MAX = 0.05

#: Once a step has cost so much it decides about nothing further, and once so much, it lets
#: observers wait for the next one [s].
STEP_DECIDES_S = 0.01
STEP_TELLS_S = 0.02

#: Observers are told so much in any step, so that what they wait for does not grow.
TELLS_MIN = 64

#: Objects made between two of Python's looks for rubbish. Nearly all that the owner makes is kept
#: to the end of the run, and each look goes through it: at every 700, 10 % of a busy owner; at
#: every 10 000, about a millisecond now and then.
COLLECT_EVERY = 10_000

#: How long the end waits for evaluators to leave, and for the learner's last word [s].
LINGER_S = 2.0
RECOMMEND_S = 120.0

#: Entries worth waiting for the disk: rare, and dear to lose even to a power cut.
_DEAR = (LearnerBooted, TrialsProposed, EpisodeDone)

_log = logging.getLogger("shearline.learner")


class Owner:
    """Leads one epoch of a run.

    Args:
        config: The run's.
        run: The run's name.
        dispatcher: Decides.
        journal: Where its entries go.
        fitter: The learner behind it.
        outgoing: Where its messages go.
        inbox: Where everything comes from.
        on_status: Called with each status.

    Attributes:
        recommendation: The learner's last word.
        ending: How the run ended, and
        why: why, if not by completing.
        tick_s: How often it has to be woken at least [s].
    """

    def __init__(
        self,
        config: RunConfig,
        run: str,
        dispatcher: Dispatcher,
        journal: JournalFile,
        fitter: Fitter,
        outgoing: Outgoing,
        inbox: Inbox,
        on_status: Callable[[Status], None] | None = None,
    ) -> None:
        self.config = config
        self.name = run
        self.dispatcher = dispatcher
        self.recommendation: Recommendation | None = None
        self.ending = Ending.STOPPED
        self.why = "interrupted twice: start it again to resume"
        self._journal = journal
        self._fitter = fitter
        self._outgoing = outgoing
        self._inbox = inbox
        self._on_status = on_status
        self._incoming = Incoming()
        self._pulse = Pulse()
        self._left: list[object] = []
        self._news: deque[Instruction] = deque()
        self.tick_s = min(config.lease_s / 8, 0.1)
        # Reads like the epoch, but neither jumps nor goes back while the process lives.
        self._zero_s = time.time() - time.monotonic()
        self._next_tick_s = self._next_status_s = 0.0
        self._end_by_s: float | None = None
        self._has_last_word = False

    def begin(self) -> int:
        """Take the run over; return the epoch, which is on disk by then."""
        gc.set_threshold(COLLECT_EVERY)
        self._fitter.start(self.dispatcher.book)
        self._carry_out(self.dispatcher.handle(Begin(), self._now_s()))
        return self.dispatcher.book.epoch

    def run(self) -> None:
        """Lead the run until it has ended and everyone knows, or cannot be helped.

        Raises:
            RecordError: If the journal cannot be written; nothing unwritten was told to anyone.
        """
        while not self._is_over():
            effort = Effort()
            items = self._left or self._inbox.take()
            began_s, self._left = time.perf_counter(), []
            out: list[Instruction] = []
            for number, item in enumerate(items, start=1):
                if isinstance(item, Hurry):
                    return
                event = self._event(item)
                if event is not None:
                    out += self.dispatcher.handle(event, self._now_s())
                if effort.exceeds(STEP_DECIDES_S):
                    self._left = items[number:]
                    break
            if self._now_s() >= self._next_tick_s:
                # Who is woken just before the time need not wait for the next waking.
                self._next_tick_s = self._now_s() + 0.9 * self.tick_s
                out += self.dispatcher.handle(Tick(), self._now_s())
                self.dispatcher.desk.is_observed = self._outgoing.is_observed()
            self._carry_out(out)
            self._tell(effort)
            if self._now_s() >= self._next_status_s:
                self._show()
            cpu_s = effort.cpu_s()
            self._pulse.step(time.perf_counter() - began_s, cpu_s)
            if cpu_s > STEP_CPU_S_MAX:
                kinds = Counter(type(item).__name__ for item in items)
                _log.warning("a step took %.0f ms of processor time: %s", 1e3 * cpu_s, dict(kinds))
        self._tell()
        self._show()
        vitals = self.vitals()
        _log.info(
            "steps: p99 %.2f ms, longest %.2f ms; of processor time: p99 %.2f ms, longest %.2f ms;"
            " malformed %d, dropped %d",
            vitals.step_ms_p99,
            vitals.step_ms_max,
            vitals.step_cpu_ms_p99,
            vitals.step_cpu_ms_max,
            vitals.malformed,
            vitals.dropped,
        )

    def vitals(self) -> Vitals:
        """Return how the owner itself does."""
        pulse = self._pulse
        return Vitals(
            rate_hz=pulse.rate_hz(self.dispatcher.book.tally.counted, self._now_s()),
            step_ms_max=1e3 * pulse.wall.longest_s,
            step_ms_p99=1e3 * pulse.wall.percentile_s(0.99),
            step_cpu_ms_max=1e3 * pulse.cpu.longest_s,
            step_cpu_ms_p99=1e3 * pulse.cpu.percentile_s(0.99),
            malformed=self._incoming.malformed,
            dropped=self._inbox.dropped,
        )

    # -- in ---------------------------------------------------------------------------------

    def _now_s(self) -> float:
        return self._zero_s + time.monotonic()

    def _event(self, item: object) -> Event | None:
        if isinstance(item, Arrival):  # what comes with every trial first
            self._outgoing.copy(item.key, item.payload, self._now_s(), sent=False)
            return self._incoming.event(item)
        if isinstance(item, Presence):
            return self._incoming.event(item)
        if isinstance(item, Event):
            return item
        if isinstance(item, Modelled):
            self._outgoing.publish(
                Snapshot(
                    episode=item.episode,
                    learner=self.config.learner,
                    model=item.model,
                    at_s=self._now_s(),
                )
            )
        if isinstance(item, Recommended):
            self.recommendation, self._has_last_word = item.recommendation, True
        return None

    # -- out --------------------------------------------------------------------------------

    def _carry_out(self, out: list[Instruction]) -> None:
        entries: list[Entry] = []
        sends: list[Send] = []
        others: list[Instruction] = []
        for instruction in out:
            match instruction:
                case Journal(entry):
                    entries.append(entry)
                case Send():
                    sends.append(instruction)
                case _:
                    others.append(instruction)
        if entries:
            self._journal.append(entries, sync=any(isinstance(e, _DEAR) for e in entries))
        # Evaluators wait for what is said to them; observers and the log do not.
        for send in together(sends):
            self._outgoing.send(send.evaluator, send.message, self._now_s())
        for instruction in others:
            if isinstance(instruction, Publish | Say):
                self._news.append(instruction)
            else:
                self._effect(instruction)

    def _tell(self, effort: Effort | None = None) -> None:
        """Let observers and the log know, in order; no further once the step has cost enough."""
        told = 0
        while self._news and (
            told < TELLS_MIN or effort is None or not effort.exceeds(STEP_TELLS_S)
        ):
            self._effect(self._news.popleft())
            told += 1

    def _effect(self, instruction: Instruction) -> None:
        match instruction:
            case Publish(message):
                self._outgoing.publish(message)
            case Broadcast(message):
                self._outgoing.broadcast(message, self._now_s())
            case Say(stimulus, text):
                _log.info("[%d.%d] %s", self.dispatcher.book.epoch, stimulus, text)
            case Ask():
                self._fitter.ask(instruction)
                self._next_status_s = 0.0
                # All that is known by now is kept to the end. Looking it through for rubbish, as
                # Python does again and again, took 100 ms once there were 100 000 trials.
                gc.collect(1)
                gc.freeze()
            case EndRun(ending, why, tells):
                self.ending, self.why = ending, why
                self._end_by_s = self._now_s() + LINGER_S
                self._fitter.finish(tells)

    def _show(self) -> None:
        """Let everyone know how the run stands, if there is anyone."""
        self._next_status_s = self._now_s() + STATUS_EVERY_S
        vitals = self.vitals()
        if self._on_status is None and not self.dispatcher.desk.is_observed:
            return
        shown = status(self.dispatcher, run=self.name, learner=self.config.learner, vitals=vitals)
        self._outgoing.publish(shown)
        if self._on_status is not None:
            self._on_status(shown)

    def _is_over(self) -> bool:
        """Tell whether the run has ended, the learner had its word, and the evaluators left."""
        if self._end_by_s is None or self.dispatcher.state is not RunState.ENDED:
            return False
        late_s = self._now_s() - self._end_by_s
        roster = self.dispatcher.desk.roster
        alone = all(e.left or e.gone for e in roster)
        return (alone or late_s > 0.0) and (self._has_last_word or late_s > RECOMMEND_S)
