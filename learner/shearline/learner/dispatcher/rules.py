"""What a run is judged by: the numbers the dispatcher keeps to."""

from __future__ import annotations

from dataclasses import dataclass

from shearline.protocol.messages import Purpose
from shearline.protocol.task import TaskSpec

#: Evaluators known at once; more are refused, so that no table grows without bound.
EVALUATORS_MAX = 4096

#: Attempts of one trial, whatever became of them; far above what the other bounds allow, and
#: there for evaluators that join and leave for ever.
ATTEMPTS_MAX = 64

#: Leases an attempt is given when the learner itself was away: its evaluators must first find
#: the way back (measured: reconnected within .4 s of the endpoint's return).
REJOIN_LEASES = 2.0

#: An evaluator unheard for so many leases is handed nothing: an idle one is heard every 1.5, and
#: those that die are missed by their liveliness long before. One that has just let an attempt lapse
#: is believed less.
SILENCE_LEASES = 3.5
SILENCE_LEASES_STRUCK = 1.5

#: Longest rest of an evaluator whose attempts keep lapsing [s].
REST_S_MAX = 60.0

#: A copy is worth handing out once an attempt is so many times older than the median.
SPECULATE_FACTOR = 2.0

#: Turnarounds the median is taken over, and how many it needs to mean anything.
TURNAROUNDS_MAX = 101
TURNAROUNDS_MIN = 5


@dataclass(frozen=True, slots=True)
class Rules:
    """Everything about a run that decides who gets what and when something counts as lost.

    Attributes:
        task: What is being learned; ``task.trial_s`` bounds one trial [s].
        episodes: Episodes of the run.
        trials: Trials of each episode.
        lease_s: An attempt not renewed for so long is given out again [s].
        speculative: Hand out one copy of a slow attempt when nothing is pending.
        quorum: Share of an episode's trials, (0, 1], that may close it after ``quorum_after_s``.
        quorum_after_s: How long an episode must have been open for that [s].
        losses_max: A trial whose attempts lapsed so often is lost.
        aborts_max: A trial aborted or rejected so often is lost.
        stop_grace_s: How long a stop waits for what runs [s].
        kinds: Kinds of evaluators that may take part; all if empty.
        confirm: Trials of the recommended tuple once the last episode has closed.
        confirm_on: Kind of evaluators that alone may run those, any if empty.
        confirm_region: Trials of tuples drawn from the recommended region, after those.
    """

    task: TaskSpec
    episodes: int
    trials: int
    lease_s: float = 2.0
    speculative: bool = True
    quorum: float = 1.0
    quorum_after_s: float = 60.0
    losses_max: int = 3
    aborts_max: int = 3
    stop_grace_s: float = 5.0
    kinds: tuple[str, ...] = ()
    confirm: int = 0
    confirm_on: str = ""
    confirm_region: int = 0

    def admits(self, purpose: Purpose, kind: str) -> bool:
        """Tell whether evaluators of a kind may run trials of a purpose."""
        return purpose is not Purpose.CONFIRMATION or self.confirm_on in {"", kind}

    def agenda(self, episode: int) -> tuple[Purpose, int] | None:
        """Return what an episode is for and how many trials it has; ``None`` behind the last."""
        if episode < self.episodes:
            return Purpose.LEARNING, self.trials
        after = episode - self.episodes
        confirming = self.confirming()
        return confirming[after] if after < len(confirming) else None

    def confirming(self) -> tuple[tuple[Purpose, int], ...]:
        """Return what follows the last episode of learning: what it is for, and its trials."""
        asked = ((Purpose.CONFIRMATION, self.confirm), (Purpose.REGION, self.confirm_region))
        return tuple((purpose, trials) for purpose, trials in asked if trials)
