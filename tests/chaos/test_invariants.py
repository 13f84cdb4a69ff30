"""The checker of journals is itself checked: it refuses each planted bug, and nothing sound."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from chaos.invariants import Audit, BrokenError, expect_founded, expect_kept
from msgspec.structs import replace

from shearline.learner.dispatcher.entries import (
    AnyEntry,
    AttemptIssued,
    AttemptLapsed,
    AttemptReturned,
    AttemptRevived,
    EpisodeDone,
    LapseReason,
    LearnerBooted,
    ResultTaken,
    RunEnded,
    RunOpened,
    RunRuled,
    TrialLost,
    TrialsProposed,
)
from shearline.learner.dispatcher.events import Planned
from shearline.protocol.messages import (
    Ack,
    CommandKind,
    EpisodeClosed,
    OutcomeKind,
    Result,
    Trial,
    Verdict,
)

BOOT = "boot-of-all"
Journal = list[AnyEntry]


def issued(trial: int, attempt: int, token: str, evaluator: str, *, copy: bool = False) -> AnyEntry:
    return AttemptIssued(
        at_s=0.0, trial=trial, attempt=attempt, token=token, evaluator=evaluator, boot=BOOT,
        copy=copy,
    )  # fmt: skip


def taken(
    trial: int,
    token: str,
    evaluator: str,
    verdict: Verdict = Verdict.COUNTED,
    kind: OutcomeKind = OutcomeKind.SUCCESS,
) -> AnyEntry:
    result = Result(boot=BOOT, token=token, trial=trial, kind=kind, cost=1.0, seed=0)
    return ResultTaken(at_s=0.0, evaluator=evaluator, verdict=verdict, result=result)


def proposed(episode: int, *trials: int) -> AnyEntry:
    plans = [Planned(trial, [0.0], 0) for trial in trials]
    return TrialsProposed(at_s=0.0, episode=episode, trials=plans)


def closed(episode: int, trials: int) -> AnyEntry:
    summary = EpisodeClosed(
        episode=episode, trials=trials, successes=trials, success_rate=1.0, mean_cost=1.0,
        best_cost=1.0, at_s=0.0,
    )  # fmt: skip
    return EpisodeDone(at_s=0.0, summary=summary)


def sound() -> Journal:
    """Two trials: one copied and aborted once, one lapsed, come back and counted at a restart."""
    lapse = LapseReason.LEASE
    return [
        RunOpened(at_s=0.0, run="r", config=""),
        LearnerBooted(at_s=0.0, epoch=1),
        proposed(0, 0, 1),
        issued(0, 1, "token-a1", "ann"),
        issued(1, 1, "token-b1", "bob"),
        issued(0, 2, "token-a2", "bob", copy=True),
        taken(0, "token-a2", "bob", Verdict.NOTED, OutcomeKind.ABORTED),
        AttemptLapsed(at_s=0.0, token="token-b1", reason=lapse),
        AttemptRevived(at_s=0.0, token="token-b1"),
        AttemptReturned(at_s=0.0, token="token-b1"),
        RunRuled(at_s=0.0, kind=CommandKind.HOLD),
        LearnerBooted(at_s=0.0, epoch=2),
        RunRuled(at_s=0.0, kind=CommandKind.RESUME),
        issued(1, 2, "token-b2", "ann"),
        taken(0, "token-a1", "ann"),
        taken(1, "token-b1", "bob"),
        taken(1, "token-b2", "ann", Verdict.DUPLICATE),
        closed(0, 2),
        RunEnded(at_s=0.0, ok=True, why=""),
    ]


BUGS: dict[str, Callable[[Journal], object]] = {
    "counted twice": lambda j: j.insert(16, taken(1, "token-b2", "ann")),
    "a result taken twice": lambda j: j.insert(15, j[14]),
    "a result of somebody else's attempt": lambda j: j.__setitem__(14, taken(0, "token-a1", "bob")),
    "a guessed token": lambda j: j.__setitem__(14, taken(0, "token-x1", "ann")),
    "an abort as an outcome": lambda j: j.__setitem__(
        6, taken(0, "token-a2", "bob", Verdict.COUNTED, OutcomeKind.ABORTED)
    ),
    "an outcome thrown away": lambda j: j.__setitem__(
        14, taken(0, "token-a1", "ann", Verdict.DUPLICATE)
    ),
    "late and counted confused": lambda j: j.__setitem__(
        14, taken(0, "token-a1", "ann", Verdict.LATE)
    ),
    "three live attempts": lambda j: j.insert(6, issued(0, 3, "token-a3", "cat", copy=True)),
    "two on one evaluator": lambda j: j.__setitem__(5, issued(0, 2, "token-a2", "ann", copy=True)),
    "a copy that is not said to be one": lambda j: j.__setitem__(
        5, issued(0, 2, "token-a2", "bob")
    ),
    "a token used twice": lambda j: j.__setitem__(13, issued(1, 2, "token-b1", "ann")),
    "handed out while held": lambda j: j.pop(12),
    "an epoch used twice": lambda j: j.__setitem__(11, LearnerBooted(at_s=0.0, epoch=1)),
    "work before the epoch is on record": lambda j: j.pop(1),
    "handed out after its outcome": lambda j: j.insert(15, issued(0, 3, "token-a3", "ann")),
    "lost with an outcome": lambda j: j.insert(17, TrialLost(at_s=0.0, trial=0, why="")),
    "closed over an open trial": lambda j: j.insert(15, closed(0, 1)),
    "an episode miscounted": lambda j: j.__setitem__(17, closed(0, 1)),
    "the next episode before this one closed": lambda j: j.insert(14, proposed(1, 2)),
    "a gap in the trials": lambda j: j.__setitem__(2, proposed(0, 0, 2)),
    "given up twice": lambda j: j.insert(10, j[9]),
    "back without having lapsed": lambda j: j.pop(7),
    "work after the end": lambda j: j.append(proposed(1, 2)),
    "taken up after the end": lambda j: j.append(LearnerBooted(at_s=0.0, epoch=3)),
    "no head": lambda j: j.pop(0),
    "an attempt that was never handed out": lambda j: j.pop(3),
}


def test_a_sound_journal_is_accepted_and_its_outcomes_are_read() -> None:
    audit = Audit(sound(), whole=True)
    assert sorted(audit.counted) == [0, 1]
    assert audit.epochs == 2


@pytest.mark.parametrize("bug", BUGS)
def test_a_planted_bug_is_found(bug: str) -> None:
    journal = sound()
    BUGS[bug](journal)
    with pytest.raises(BrokenError):
        Audit(journal)


def test_a_run_that_is_not_over_is_sound_but_not_whole() -> None:
    journal = sound()[:15]
    Audit(journal)
    with pytest.raises(BrokenError, match="no outcome of"):
        Audit(journal, whole=True)


def test_a_trial_may_be_lost_and_its_result_come_late() -> None:
    journal = sound()[:10]
    journal += [
        TrialLost(at_s=0.0, trial=1, why=""),
        taken(1, "token-b1", "bob", Verdict.LATE),
        taken(0, "token-a1", "ann"),
        closed(0, 2),
    ]
    assert sorted(Audit(journal).counted) == [0, 1]


def test_only_a_quorum_lets_an_episode_close_over_an_open_trial() -> None:
    journal = [*sound()[:15], closed(0, 1)]
    Audit(journal, quorum=True)
    with pytest.raises(BrokenError):
        Audit(journal)


def test_a_robots_trial_is_never_copied() -> None:
    with pytest.raises(BrokenError, match="copy on a robot"):
        Audit(sound(), robots=frozenset({"bob"}))


def test_a_journal_may_grow_and_not_change() -> None:
    before = sound()[:8]
    expect_kept(before, sound())
    changed = sound()
    issue = changed[3]
    assert isinstance(issue, AttemptIssued)
    changed[3] = replace(issue, evaluator="eve")
    with pytest.raises(BrokenError):
        expect_kept(before, changed)


def test_what_evaluators_were_told_must_stand_on_record() -> None:
    def ack(token: str, verdict: Verdict) -> Ack:
        return Ack(boot=BOOT, token=token, verdict=verdict)

    def trial(token: str) -> Trial:
        return Trial(
            boot=BOOT, epoch=1, trial=0, episode=0, attempt=1, token=token, theta=[0.0], seed=0,
            lease_s=1.0, deadline_s=1.0,
        )  # fmt: skip

    expect_founded(
        sound(),
        [
            trial("token-a1"),
            ack("token-a1", Verdict.COUNTED),
            ack("token-a1", Verdict.DUPLICATE),
            ack("token-zz", Verdict.UNKNOWN),
        ],
    )
    for unfounded in (
        trial("token-zz"),
        ack("token-zz", Verdict.COUNTED),
        ack("token-zz", Verdict.DUPLICATE),
        ack("token-b2", Verdict.COUNTED),
    ):
        with pytest.raises(BrokenError):
            expect_founded(sound(), [unfounded])
