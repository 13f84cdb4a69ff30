"""A client that does all the harm it can without tokens that were not given to it.

It floods, sends garbage on every key, speaks in others' names with tokens it guessed, and on its
own key with tokens it overheard. Every result it makes up costs :data:`FORGED_COST`, so that one
that counts is seen in the journal. Run as ``python rogue.py ENDPOINT RUN MODE``; goes on until it
is ended. MODE is ``flood``, ``garbage``, ``forge`` or ``all``.
"""

from __future__ import annotations

import itertools
import os
import random
import secrets
import sys
from collections.abc import Iterator
from queue import Empty, SimpleQueue

from shearline.deploy.processes import die_with_parent
from shearline.protocol.codec import decode, encode
from shearline.protocol.intake import Arrival
from shearline.protocol.keys import UP_TOPICS, Keys
from shearline.protocol.link import open_client
from shearline.protocol.messages import (
    VERSION,
    Bye,
    Credit,
    Hello,
    Message,
    OutcomeKind,
    Renew,
    Result,
    Trial,
)

FORGED_COST = -1e9

#: Beyond what a control message may hold, and beyond what the transport admits [bytes].
OVERSIZED_BYTES = 200_000
ENORMOUS_BYTES = 20_000_000

_SIDES = ("hello", "credit", "renew", "result", "bye", "trial", "ack", "cmd", "x", "x/y")

Said = tuple[str, bytes]


def result(token: str, boot: str, trial: int = 0) -> Result:
    """Return a result that is too good to be true."""
    return Result(
        boot=boot, token=token, trial=trial, kind=OutcomeKind.SUCCESS, cost=FORGED_COST, seed=0
    )


def boots() -> str:
    """Return a boot that is nobody's."""
    return secrets.token_hex(8)


def flood(keys: Keys, _: list[str], dice: random.Random) -> Iterator[Said]:
    """Hellos and heartbeats in our own name and in a few that nobody has, without end."""
    boot = boots()
    for seq in itertools.count():
        name = dice.choice(["rogue", f"nobody-{dice.randrange(10)}"])
        hello = Hello(
            boot=boot, version=VERSION + 1, task_digest="", kind="robot", engine="", credits=1
        )
        for message in (
            hello,
            Credit(boot=boot, seq=seq, credits=1024),
            Renew(boot=boot, tokens=[secrets.token_hex(16) for _ in range(64)]),
            Bye(boot=boot),
        ):
            yield keys.up(name, message), encode(message)


def garbage(keys: Keys, names: list[str], dice: random.Random) -> Iterator[Said]:
    """What is no message, on every key there is, the evaluators' and the operator's among them."""
    wholes = [
        encode(result("0" * 32, "0" * 16)),
        encode(Credit(boot="0" * 16, seq=1, credits=1)),
        b"\x82\xa4type\xa7command\xa4kind\xa4xxxx",
        b"\x82\xa4type\xa7command\xa4kind\xc0",
        b"\x81" * 5000,
        b"\x91" * 50_000,
        b"",
    ]
    for count in itertools.count():
        whole = bytearray(dice.choice(wholes))
        for _ in range(dice.randrange(1, 4)):
            if whole:
                whole[dice.randrange(len(whole))] = dice.randrange(256)
        payload = dice.choice([bytes(whole), dice.randbytes(dice.randrange(200))])
        if count % 500 == 499:
            payload = dice.randbytes(OVERSIZED_BYTES)
        if count % 20_000 == 19_999:
            payload = bytes(ENORMOUS_BYTES)
        ours = [f"ev/{name}/{side}" for name in [*names, "rogue"] for side in _SIDES]
        yield f"{keys.root}/{dice.choice([*ours, 'op/cmd', 'all/cmd', 'obs/status'])}", payload


def forge(keys: Keys, names: list[str], dice: random.Random) -> Iterator[Said]:
    """Results, renewals and trials with tokens and boots that were guessed, in others' names."""
    for trial in itertools.count():
        name = dice.choice([*names, "rogue"])
        guessed = result(secrets.token_hex(16), boots(), trial % 1000)
        yield keys.up(name, guessed), encode(guessed)
        renew = Renew(boot=boots(), tokens=[guessed.token])
        yield keys.up(name, renew), encode(renew)
        bye = Bye(boot=boots())
        yield keys.up(name, bye), encode(bye)
        order: Message = Trial(
            boot=boots(), epoch=99, trial=trial % 1000, episode=0, attempt=1,
            token=secrets.token_hex(16), theta=[0.0, 0.0], seed=0, lease_s=1.0, deadline_s=1.0,
        )  # fmt: skip
        yield keys.down(name, order), encode(order)


def overheard(keys: Keys, heard: SimpleQueue[Arrival]) -> Iterator[Said]:
    """Results on our own key, and with our own boot, for trials given to others."""
    while True:
        try:
            trial = decode(heard.get_nowait().payload, Trial)
        except Empty:
            return
        except ValueError:
            continue
        stolen = result(trial.token, trial.boot, trial.trial)
        for message in (stolen, Renew(boot=trial.boot, tokens=[trial.token])):
            yield keys.up("rogue", message), encode(message)


MODES = {
    "flood": (flood,),
    "garbage": (garbage,),
    "forge": (forge,),
    "all": (flood, garbage, forge),
}


def main(endpoint: str, run: str, mode: str, names: list[str]) -> None:
    """Do harm for ever."""
    os.nice(19)  # It stands for another machine: its messages compete with the run, its CPU not.
    keys, dice = Keys(run), random.Random(0)
    heard: SimpleQueue[Arrival] = SimpleQueue()
    with open_client(endpoint, None) as link:
        link.subscribe(f"{keys.root}/ev/*/trial", heard)
        for said in zip(*(make(keys, names, dice) for make in MODES[mode]), strict=True):
            for key, payload in (*said, *overheard(keys, heard)):
                link.publish(key, payload)


if __name__ == "__main__":
    die_with_parent()
    assert set(UP_TOPICS) <= set(_SIDES)
    main(sys.argv[1], sys.argv[2], sys.argv[3], sys.argv[4:])
