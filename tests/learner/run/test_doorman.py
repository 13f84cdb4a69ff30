"""Goal: in a crowd nobody takes an evaluator's place in the queue. Method: forge what a rogue can.

A desk with one welcomed evaluator that holds trials; messages are encoded as they would come.
"""

from __future__ import annotations

import secrets
import string

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from simulation.lab import Lab

from shearline.learner.run.doorman import (
    INTRODUCTION_BYTES_MAX,
    KEY_CHARS_MAX,
    LOOKUPS_MAX,
    Doorman,
    is_oversized,
)
from shearline.protocol.codec import CONTROL_BYTES_MAX, encode
from shearline.protocol.intake import Arrival, Presence
from shearline.protocol.keys import Keys
from shearline.protocol.messages import (
    VERSION,
    Bye,
    Command,
    CommandKind,
    Credit,
    Hello,
    Message,
    OutcomeKind,
    Renew,
    Result,
)

KEYS = Keys("r")
BOOT = "0123456789abcdef"
GUESSED = "f" * 32


class HexLab(Lab):
    """A lab whose tokens look like those of a run."""

    def _token(self) -> str:
        return secrets.token_hex(16)


class House:
    """A desk at which evaluator ``a`` holds two trials, and its doorman."""

    def __init__(self) -> None:
        self.lab = HexLab()
        self.lab.propose()
        self.lab.hello("a", BOOT)
        self.tokens = list(self.lab.dispatcher.book.held_by["a"])
        self.doorman = Doorman(self.lab.dispatcher.desk)

    def knows(self, name: str, message: Message) -> bool:
        """Tell whether a message on an evaluator's key is let in."""
        return self.doorman.knows(Arrival(KEYS.up(name, message), encode(message)))


def result(token: str, boot: str = BOOT, digest: str = "") -> Result:
    return Result(
        boot=boot, token=token, trial=0, kind=OutcomeKind.SUCCESS, cost=1.0, seed=0, digest=digest
    )


def hello(name: str = "x") -> Hello:
    return Hello(
        boot="b" * 16, version=VERSION, task_digest="", kind="robot", engine=name, credits=1
    )


def test_an_evaluator_is_known_by_its_boot_and_its_attempts_by_their_tokens() -> None:
    house = House()
    assert len(house.tokens) == 2
    for token in house.tokens:
        assert house.knows("a", result(token))
        assert house.knows("a", result(token, digest="d" * 64))
    assert house.knows("a", Renew(boot="c" * 32, tokens=[GUESSED, house.tokens[1]]))
    assert house.knows("a", Credit(boot=BOOT, seq=1, credits=1))
    assert house.knows("a", Bye(boot=BOOT))


def test_what_another_wrote_first_in_its_map_is_known_too() -> None:
    house = House()
    fields = msgspec.msgpack.decode(encode(result(house.tokens[0], digest="d" * 64)))
    backwards = msgspec.msgpack.encode(dict(reversed(fields.items())))
    assert house.doorman.knows(Arrival(KEYS.up("a", result(GUESSED)), backwards))


def test_the_result_of_an_attempt_given_up_long_ago_is_known() -> None:
    house = House()
    house.lab.gone("a", BOOT)
    assert house.knows("a", result(house.tokens[0]))


@pytest.mark.parametrize("name", ["a", "rogue"])
def test_who_guesses_tokens_or_boots_is_nobody(name: str) -> None:
    house = House()
    for message in (
        result(GUESSED),
        Renew(boot=BOOT, tokens=[GUESSED] * 1024),
        Renew(boot=BOOT, tokens=[]),
        Credit(boot="c" * 16, seq=1, credits=1),
        Bye(boot="c" * 16),
    ):
        assert not house.knows(name, message)


def test_a_token_overheard_is_worth_nothing_on_another_key() -> None:
    house = House()
    assert not house.knows("rogue", result(house.tokens[0]))
    assert not house.knows("rogue", Renew(boot=BOOT, tokens=house.tokens))
    assert not house.knows("rogue", Credit(boot=BOOT, seq=1, credits=1))


def test_a_token_is_not_sought_for_ever() -> None:
    house = House()
    last, late = [GUESSED] * (LOOKUPS_MAX - 1), [GUESSED] * LOOKUPS_MAX
    assert house.knows("a", Renew(boot=BOOT, tokens=[*last, house.tokens[0]]))
    assert not house.knows("a", Renew(boot=BOOT, tokens=[*late, house.tokens[0]]))


def test_anyone_may_introduce_itself_in_a_few_words() -> None:
    house = House()
    assert house.knows("stranger", hello("e" * 200))
    key = KEYS.up("stranger", hello())
    assert not house.doorman.knows(Arrival(key, bytes(INTRODUCTION_BYTES_MAX + 1)))


@pytest.mark.parametrize("kind", CommandKind)
def test_an_order_is_one_of_the_few_words_of_the_operator(kind: CommandKind) -> None:
    house = House()
    order = encode(Command(kind=kind, why="y" * 200))
    assert house.doorman.knows(Arrival(KEYS.op_cmd(), order))
    assert not house.doorman.knows(Arrival(KEYS.op_cmd(), b"\x82\xa4type\xa7command\xa4kind\xc0"))
    assert not house.doorman.knows(Arrival(f"{KEYS.root}/ev/a/cmd", order))


@given(st.text(string.printable, max_size=40), st.binary(max_size=200))
def test_whatever_comes_on_whatever_key_the_doorman_answers(key: str, payload: bytes) -> None:
    assert House().doorman.knows(Arrival(key, payload)) is (key.rpartition("/")[2] == "hello")


def test_only_the_end_of_a_life_that_is_here_or_holds_something_matters() -> None:
    house = House()

    def minds(name: str, boot: str, *, alive: bool = False) -> bool:
        return house.doorman.minds(Presence(KEYS.live_evaluator(name, boot), alive=alive))

    assert minds("a", BOOT)
    assert minds("a", "c" * 16)  # a boot of an earlier epoch may hold what the book says it does
    assert not minds("a", BOOT, alive=True)
    assert not minds("rogue", BOOT)
    assert not minds("a" * KEY_CHARS_MAX, BOOT)
    house.lab.gone("a", BOOT)
    assert minds("a", BOOT)
    assert not minds("a", "c" * 16)


def test_what_no_message_can_be_is_too_large() -> None:
    assert not is_oversized(Arrival("k" * KEY_CHARS_MAX, bytes(CONTROL_BYTES_MAX)))
    assert is_oversized(Arrival("k" * (KEY_CHARS_MAX + 1), b""))
    assert is_oversized(Arrival("k", bytes(CONTROL_BYTES_MAX + 1)))
