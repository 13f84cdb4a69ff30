"""Who comes and goes: hellos, refusals, two processes with one name, byes."""

from __future__ import annotations

from typing import Any

import pytest
from simulation.lab import LEASE_S, TASK, Lab, published, said, sent

from shearline.learner.dispatcher import admission, roster
from shearline.learner.dispatcher.rules import SILENCE_LEASES
from shearline.protocol.messages import (
    Command,
    CommandKind,
    EvaluatorState,
    Refused,
    Trial,
    Welcome,
)
from shearline.protocol.task import digest


def test_a_welcome_says_the_rules_of_the_run() -> None:
    lab = Lab()
    (welcome,) = sent(lab.hello("a"), Welcome)
    assert welcome == Welcome(boot="boot-of-a", epoch=1, task=TASK, lease_s=LEASE_S)


def test_a_hello_said_again_is_answered_again_and_changes_nothing() -> None:
    lab = Lab()
    lab.hello("a", credits=1)
    lab.propose()
    out = lab.hello("a", credits=2)
    assert len(sent(out, Welcome)) == 1
    assert not sent(out, Trial)


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"version": 99}, "expected protocol version 1, got 99"),
        ({"task_digest": "0" * 16}, "expected task 'bench' with digest"),
    ],
)
def test_who_does_not_fit_is_refused_and_told_why(changes: dict[str, Any], why: str) -> None:
    lab = Lab()
    lab.propose()
    out = lab.hello("a", **changes)
    (refused,) = sent(out, Refused, "a")
    assert why in refused.why
    assert len(lab.dispatcher.desk.roster) == 0


@pytest.mark.parametrize(("kind", "welcome"), [("simulator", True), ("robot", False)])
def test_a_run_takes_only_the_kinds_it_was_configured_for(kind: str, *, welcome: bool) -> None:
    lab = Lab(kinds=("simulator", "function"))
    out = lab.hello("a", kind=kind)
    assert bool(sent(out, Welcome)) == welcome
    if not welcome:
        (refused,) = sent(out, Refused)
        assert "expected an evaluator of kind simulator or function, got 'robot'" in refused.why


def test_a_task_that_turns_out_another_once_it_is_warm_is_refused() -> None:
    lab = Lab()
    lab.hello("a", credits=0)
    lab.propose()
    (refused,) = sent(lab.hello("a", task_digest="0" * 16), Refused)
    assert "expected task" in refused.why
    lab.wait(1.0)
    assert lab.holds("a") == []


def test_an_engine_that_is_known_later_is_noted() -> None:
    lab = Lab()
    lab.hello("a", engine="")
    lab.hello("a", engine="mujoco", task_digest=digest(TASK))
    lab.hello("a", engine="")
    known = lab.dispatcher.desk.roster.get("a")
    assert known is not None
    assert known.engine == "mujoco"


def test_more_evaluators_than_any_run_has_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(roster, "EVALUATORS_MAX", 2)
    monkeypatch.setattr(admission, "EVALUATORS_MAX", 2)
    lab = Lab()
    lab.hello("a")
    lab.hello("b")
    (refused,) = sent(lab.hello("c"), Refused)
    assert "2 evaluators are here already" in refused.why
    lab.bye("a")
    assert sent(lab.hello("c"), Welcome)


def test_a_new_boot_after_the_network_missed_the_old_one_takes_over_at_once() -> None:
    lab = Lab()
    lab.hello("a", credits=1)
    lab.propose()
    lab.gone("a")
    assert lab.holds("a") == []
    assert sent(lab.hello("a", boot="second-boot"), Welcome)
    assert lab.holds("a") != []


def test_a_new_boot_waits_until_the_old_one_was_silent_for_a_lease() -> None:
    lab = Lab()
    lab.hello("a", credits=1)
    lab.propose()
    assert not sent(lab.hello("a", boot="second-boot"), Welcome)
    lab.wait(LEASE_S + 0.3)
    out = lab.hello("a", boot="second-boot")
    assert sent(out, Welcome)
    assert all(t.boot == "second-boot" for t in sent(out, Trial))


def test_what_an_older_boot_held_is_given_out_again_when_a_new_one_takes_its_name() -> None:
    lab = Lab(trials=1)
    lab.hello("a", boot="first-boot", credits=1)
    lab.propose()
    lab.wait(LEASE_S)
    lab.renew("a", *lab.dispatcher.book.held_by["a"], boot="first-boot")
    lab.boot()
    out = lab.hello("a", boot="second-boot", credits=1)
    assert "replaced" in said(out)
    assert [t.boot for t in sent(out, Trial)] == ["second-boot"]


def test_the_second_of_two_living_processes_with_one_name_is_refused() -> None:
    lab = Lab()
    lab.hello("a", credits=1)
    lab.propose()
    out = []
    for _ in range(12):
        out += lab.hello("a", boot="second-boot")
        lab.wait(0.25, "a")
    (refused, *_) = sent(out, Refused)
    assert refused.boot == "second-boot"
    assert "give this one a name of its own" in refused.why
    assert lab.holds("a") == [0]


def test_a_boot_that_was_replaced_is_told_so_when_it_speaks_again() -> None:
    lab = Lab()
    lab.hello("a")
    lab.wait(2 * LEASE_S)
    lab.hello("a", boot="second-boot")
    (refused,) = sent(lab.credit("a"), Refused)
    assert refused.boot == "boot-of-a"


def test_credits_of_a_boot_that_still_waits_or_of_a_stranger_are_ignored() -> None:
    lab = Lab()
    lab.hello("a")
    lab.hello("a", boot="second-boot")
    assert lab.credit("a", boot="second-boot") == []
    assert lab.credit("b") == []


def test_an_evaluator_that_leaves_gives_back_what_it_holds_without_blame() -> None:
    lab = Lab(trials=2)
    lab.hello("a")
    lab.propose()
    lab.bye("a")
    assert lab.holds("a") == []
    assert [row.losses for row in lab.dispatcher.book.rows(0)] == [0, 0]
    lab.hello("b")
    assert sorted(lab.holds("b")) == [0, 1]


def test_a_boot_that_left_does_not_come_back() -> None:
    lab = Lab()
    lab.hello("a")
    lab.bye("a")
    lab.bye("a")
    assert lab.hello("a") == []
    assert lab.credit("a") == []
    assert sent(lab.hello("a", boot="second-boot"), Welcome)


def test_the_bye_of_another_boot_gives_nothing_back() -> None:
    lab = Lab()
    lab.hello("a")
    lab.propose()
    lab.bye("a", boot="other-boot")
    lab.gone("a", boot="other-boot")
    assert len(lab.holds("a")) == 2


def test_an_evaluator_that_was_gone_and_is_heard_again_is_handed_more() -> None:
    lab = Lab(trials=8)
    lab.hello("a", credits=1)
    lab.propose()
    lab.gone("a")
    lab.wait(0.25)
    assert lab.holds("a") == []
    lab.credit("a", 1)
    assert len(lab.holds("a")) == 1


def test_an_evaluator_that_is_silent_is_handed_nothing_until_it_is_heard() -> None:
    lab = Lab()
    lab.hello("a")
    lab.wait((SILENCE_LEASES + 0.1) * LEASE_S)
    lab.propose()
    assert lab.holds("a") == []
    lab.renew("a")
    assert len(lab.holds("a")) == 2


def test_commands_are_repeated_to_whoever_may_have_missed_them() -> None:
    lab = Lab()
    lab.hello("a")
    assert not sent(lab.credit("a"), Command)
    lab.command(CommandKind.HOLD)
    assert [c.kind for c in sent(lab.credit("a"), Command)] == [CommandKind.HOLD]
    assert [c.kind for c in sent(lab.renew("a"), Command)] == [CommandKind.HOLD]
    assert sent(lab.hello("b"), Welcome)[0].held
    lab.command(CommandKind.RESUME)
    for name in "ab":
        assert [c.kind for c in sent(lab.credit(name), Command)] == [CommandKind.RESUME]


def test_observers_hear_of_every_change_of_an_evaluator_and_of_nothing_else() -> None:
    lab = Lab(trials=2, episodes=1)
    lab.hello("a", credits=1)
    lab.propose()
    lab.wait(LEASE_S + 0.3)
    lab.wait(2 * LEASE_S)
    lab.result("a", lab.given("a")[0].token)
    lab.finish("a")
    lab.bye("a")
    states = [s.state for s in published(lab.out, EvaluatorState)]
    assert states == ["idle", "busy", "resting", "silent", "busy", "idle", "left"]


def test_a_run_that_is_ending_takes_nobody_new_and_blames_nobody() -> None:
    lab = Lab()
    lab.hello("a")
    lab.propose()
    lab.command(CommandKind.STOP)
    (refused,) = sent(lab.hello("b"), Refused)
    assert refused.ended
    assert [c.kind for c in sent(lab.hello("a"), Command)] == [CommandKind.STOP]
