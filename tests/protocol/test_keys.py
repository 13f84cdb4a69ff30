"""Keys: names that cannot escape their chunk, and an address that is the inverse of a key."""

import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.protocol.errors import ConfigError, ProtocolError
from shearline.protocol.keys import ANY_LEARNER, Address, Keys, check_name, parse, topic
from shearline.protocol.messages import (
    Ack,
    Bye,
    Command,
    CommandKind,
    Credit,
    EvaluatorState,
    Message,
    Refused,
    Verdict,
)

zenoh = pytest.importorskip("zenoh")

PLAIN = string.ascii_letters + string.digits
names = st.text(PLAIN + "_-.", min_size=1, max_size=64).filter(lambda name: name[0] in PLAIN)
KEYS = Keys("keylock-1")
CREDIT = Credit(boot="boot-0001", seq=1, credits=2)
ACK = Ack(boot="boot-0001", token="token-01", verdict=Verdict.LATE)
HOLD = Command(kind=CommandKind.HOLD)


@given(names, names, st.integers(0, 2**62))
def test_an_address_is_the_inverse_of_a_key(run: str, evaluator: str, epoch: int) -> None:
    keys = Keys(run)
    state = EvaluatorState(evaluator="lab", state="ready")
    for key, address in (
        (keys.up(evaluator, CREDIT), Address(run, "credit", evaluator)),
        (keys.down(evaluator, ACK), Address(run, "ack", evaluator)),
        (keys.down(evaluator, HOLD), Address(run, "cmd", evaluator)),
        (keys.all_cmd(), Address(run, "all/cmd")),
        (keys.op_cmd(), Address(run, "op/cmd")),
        (keys.obs(state), Address(run, "obs/evaluator")),
        (keys.obs(state, evaluator), Address(run, "obs/evaluator", evaluator)),
        (keys.live_evaluator(evaluator, "b00t"), Address(run, "live/ev", evaluator, "b00t")),
        (keys.live_learner(epoch), Address(run, "live/learner", life=str(epoch))),
    ):
        assert parse(key) == address
        zenoh.KeyExpr(key)  # raises if Zenoh would not take it


@pytest.mark.parametrize("message", [CREDIT, Bye(boot="boot-0001")])
def test_what_an_evaluator_says_is_heard_by_the_learner_only(message: Message) -> None:
    key = zenoh.KeyExpr(KEYS.up("lab", message))
    assert zenoh.KeyExpr(KEYS.from_evaluators()).includes(key)
    assert not zenoh.KeyExpr(KEYS.to_evaluator("lab2")).includes(key)
    assert not zenoh.KeyExpr(KEYS.observed()).includes(key)


@pytest.mark.parametrize("message", [ACK, HOLD, Refused(boot="boot-0001", why="")])
def test_what_is_said_to_one_evaluator_is_not_heard_by_another(message: Message) -> None:
    key = zenoh.KeyExpr(KEYS.down("lab", message))
    assert zenoh.KeyExpr(KEYS.to_evaluator("lab")).includes(key)
    assert not zenoh.KeyExpr(KEYS.to_evaluator("lab2")).includes(key)


def test_a_waking_is_heard_where_its_thread_waits_and_is_no_message() -> None:
    for pattern, key in (
        (KEYS.from_evaluators(), KEYS.wake()),
        (KEYS.to_evaluator("lab"), KEYS.wake("lab")),
    ):
        assert zenoh.KeyExpr(pattern).includes(zenoh.KeyExpr(key))
        with pytest.raises(ProtocolError):
            parse(key)


def test_the_learner_of_any_run_is_found_and_nothing_else() -> None:
    pattern = zenoh.KeyExpr(ANY_LEARNER)
    assert pattern.includes(zenoh.KeyExpr(KEYS.live_learner(3)))
    assert zenoh.KeyExpr(KEYS.live_learners()).includes(zenoh.KeyExpr(KEYS.live_learner(3)))
    assert not pattern.includes(zenoh.KeyExpr(KEYS.live_evaluator("lab", "b00t")))
    assert zenoh.KeyExpr(KEYS.live_evaluators()).includes(
        zenoh.KeyExpr(KEYS.live_evaluator("lab", "b00t"))
    )


def test_no_wildcard_reaches_into_the_protocol_without_spelling_its_version() -> None:
    for pattern in ("**", "shearline/**", "*/*/keylock-1/all/cmd"):
        assert not zenoh.KeyExpr(pattern).intersects(zenoh.KeyExpr(KEYS.all_cmd()))


@pytest.mark.parametrize(
    "name", ["", "*", "a*", "$*", "a/b", "@v1", "a#b", "a?b", "a\n", "ä", "-a", ".a", "a" * 65]
)
def test_a_name_that_could_leave_its_chunk_is_refused(name: str) -> None:
    with pytest.raises(ConfigError, match="choose another"):
        Keys(name)
    with pytest.raises(ConfigError, match="evaluator name"):
        check_name(name, "evaluator name")


@pytest.mark.parametrize(
    "key",
    [
        "",
        "shearline/@v1",
        "shearline/@v2/run/all/cmd",
        "x/shearline/@v1/run/all/cmd",
        "shearline/@v1/run/ev/*/result",
        "shearline/@v1/**",
        "shearline/@v1/run/ev/lab/unheard",
        "shearline/@v1/run/ev/lab",
        "shearline/@v1/run/ev//result",
        "shearline/@v1/run/live/learner/x",
        "shearline/@v1/run/live/learner/" + "9" * 80,
        "shearline/@v1/run/obs",
    ],
)
def test_a_foreign_key_is_a_protocol_error(key: str) -> None:
    with pytest.raises(ProtocolError, match="expected a key"):
        parse(key)


def test_a_message_does_not_travel_against_its_direction() -> None:
    with pytest.raises(ValueError, match="does not travel"):
        KEYS.up("lab", ACK)
    with pytest.raises(ValueError, match="does not travel"):
        KEYS.down("lab", CREDIT)
    assert topic(HOLD, ("cmd",)) == "cmd"
