"""Results on their way: none is lost before the learner has it, none is sent for ever."""

from __future__ import annotations

from collections.abc import Callable

from hypothesis import given
from hypothesis import strategies as st

from shearline.evaluator.outbox import ANSWERED_MAX, RESEND_S_MAX, RESEND_S_MIN, Outbox
from shearline.protocol.messages import OutcomeKind, Result

TOKENS = st.sampled_from([f"token-{i}" for i in range(8)])


def result(token: str) -> Result:
    return Result(
        boot="boot",
        token=token,
        trial=int(token[-1]),
        kind=OutcomeKind.SUCCESS,
        cost=0.5,
        seed=1,
        engine="engine",
        wall_s=0.1,
    )


def sent(box: Outbox, now_s: float) -> set[str]:
    return {one.token for one in box.due(now_s)}


STEPS: dict[str, Callable[[Outbox, str, float], object]] = {
    "put": lambda box, token, now_s: box.put(result(token), now_s),
    "again": lambda box, token, now_s: box.again(token, now_s),
    "acked": lambda box, token, _: box.acked(token),
    "all again": lambda box, _, now_s: box.all_again(now_s),
    "due": lambda box, _, now_s: list(box.due(now_s)),
}


@given(st.lists(st.tuples(st.sampled_from(sorted(STEPS)), TOKENS, st.floats(0.0, 0.5))))
def test_what_is_not_acknowledged_is_sent_within_a_second_and_nothing_else_is(
    steps: list[tuple[str, str, float]],
) -> None:
    box, now_s = Outbox(), 0.0
    for name, token, passed_s in steps:
        now_s += passed_s
        STEPS[name](box, token, now_s)
        assert len(box.answered) <= ANSWERED_MAX
        assert not box.answered.keys() & box.unacked.keys()
    owed = set(box.unacked)
    assert box.next_s() <= now_s + RESEND_S_MAX or not owed
    assert sent(box, now_s + RESEND_S_MAX) == owed
    for token in owed:
        assert box.acked(token)
    assert not sent(box, now_s + 9.0)
    assert box.next_s() == float("inf")


def test_a_result_just_sent_waits_before_it_is_sent_again() -> None:
    box = Outbox()
    box.put(result("token-1"), 0.0)
    assert sent(box, 0.0) == {"token-1"}
    assert not sent(box, 0.9 * RESEND_S_MIN)
    box.all_again(0.9 * RESEND_S_MIN)
    assert sent(box, 0.9 * RESEND_S_MIN) == {"token-1"}


def test_a_trial_that_comes_again_has_its_result_sent_again_while_it_is_remembered() -> None:
    box = Outbox()
    for i in range(ANSWERED_MAX + 1):
        box.put(result(f"token-{i}"), 0.0)
        assert box.acked(f"token-{i}")
        assert not box.acked(f"token-{i}"), "no news"
    assert box.again(f"token-{ANSWERED_MAX}", 1.0)
    assert sent(box, 1.0) == {f"token-{ANSWERED_MAX}"}
    assert not box.again("token-0", 1.0), "long forgotten"
