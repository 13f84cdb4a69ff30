"""A TCP relay between an evaluator and its learner, in a process of its own: bad weather by order.

It passes bytes and knows nothing of what they mean. Orders come as lines on standard input, each
answered by ``ok`` on standard output once it is in force:

    delay S       every byte arrives S seconds later, in order
    freeze        nothing arrives any more, nobody is told (a pulled cable)
    hush up|down  nothing arrives in that direction: half-open
    thaw          everything held back goes on, and new bytes too
    reset         connections end with a TCP reset; new ones are welcome
    cut           connections end, and so does every new one at once
    mend          new connections are welcome again

Run as ``python relay.py LISTEN_PORT TARGET_PORT``; both on 127.0.0.1.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import struct
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

from shearline.deploy.processes import PARENT_VARIABLE, Child, die_with_parent
from shearline.protocol.endpoints import free_endpoint

#: Bytes taken at once, and such chunks held back before the sender is made to wait.
CHUNK_BYTES = 65_536
CHUNKS_MAX = 256

UP, DOWN = "up", "down"


def port_of(endpoint: str) -> int:
    """Return the port of an endpoint such as ``tcp/127.0.0.1:7447``."""
    return int(endpoint.rsplit(":", 1)[1])


class Relay:
    """The relay process, as its tests command it.

    Args:
        name: For people.
        target: Endpoint it relays to, on this machine.
        log: Where its standard error goes.

    Attributes:
        endpoint: Where it listens.
    """

    def __init__(self, name: str, target: str, log: Path) -> None:
        self.endpoint = free_endpoint()
        ports = [str(port_of(self.endpoint)), str(port_of(target))]
        with log.open("ab") as complaints:
            process = subprocess.Popen(
                [sys.executable, __file__, *ports],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=complaints,
                env=os.environ | {PARENT_VARIABLE: str(os.getpid())},
            )
        self.child = Child(name, process, log)
        self._expect("ready")

    def order(self, words: str) -> None:
        """Have an order obeyed; on return it is in force."""
        pipe = self.child.process.stdin
        assert pipe is not None
        pipe.write(f"{words}\n".encode())
        pipe.flush()
        self._expect("ok")

    def close(self) -> None:
        """End the process."""
        self.child.process.kill()
        self.child.process.communicate()

    def _expect(self, word: str) -> None:
        pipe = self.child.process.stdout
        assert pipe is not None
        said = pipe.readline().decode().strip()
        assert said == word, f"relay: expected {word!r}, got {said!r}: {self.child.last_words()}"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


# -- the process itself ---------------------------------------------------------------------------


@dataclass
class Weather:
    """What befalls all connections alike."""

    delay_s: float = 0.0
    is_cut: bool = False
    passes: dict[str, asyncio.Event] = field(default_factory=dict)
    writers: set[asyncio.StreamWriter] = field(default_factory=set)

    def __post_init__(self) -> None:
        for direction in (UP, DOWN):
            self.passes[direction] = asyncio.Event()
        self.thaw()

    def hush(self, *directions: str) -> None:
        for direction in directions:
            self.passes[direction].clear()

    def thaw(self) -> None:
        for event in self.passes.values():
            event.set()

    def end_all(self, *, reset: bool) -> None:
        for writer in self.writers:
            if reset:
                line: socket.socket = writer.get_extra_info("socket")
                line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            writer.transport.abort()
        self.writers.clear()

    def cut(self) -> None:
        self.is_cut = True
        self.end_all(reset=False)

    def mend(self) -> None:
        self.is_cut = False

    def slow(self, delay_s: float) -> None:
        self.delay_s = delay_s

    def obey(self, order: str) -> None:
        """Carry one order out.

        Raises:
            ValueError: If there is no such order.
        """
        word, _, rest = order.partition(" ")
        orders: dict[str, Callable[[], None]] = {
            "delay": lambda: self.slow(float(rest)),
            "freeze": lambda: self.hush(UP, DOWN),
            "hush": lambda: self.hush(rest),
            "thaw": self.thaw,
            "reset": lambda: self.end_all(reset=True),
            "cut": self.cut,
            "mend": self.mend,
        }
        if word not in orders or (word == "hush" and rest not in self.passes):
            raise ValueError(f"no such order: {order}")
        orders[word]()


async def pump(
    weather: Weather, direction: str, source: asyncio.StreamReader, sink: asyncio.StreamWriter
) -> None:
    """Pass bytes in one direction until they end."""
    loop = asyncio.get_running_loop()
    held: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue(CHUNKS_MAX)

    async def take() -> None:
        chunk = b"-"
        while chunk:
            chunk = await source.read(CHUNK_BYTES)
            await held.put((loop.time() + weather.delay_s, chunk))

    async def give() -> None:
        while True:
            due_s, chunk = await held.get()
            await asyncio.sleep(max(0.0, due_s - loop.time()))
            await weather.passes[direction].wait()
            if not chunk:
                return
            sink.write(chunk)
            await sink.drain()

    async with asyncio.TaskGroup() as tasks:
        tasks.create_task(take())
        tasks.create_task(give())


async def relay_one(
    weather: Weather, target: int, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
) -> None:
    """Relay one connection until both its directions have ended."""
    if weather.is_cut:
        writer.transport.abort()
        return
    try:
        far_reader, far_writer = await asyncio.open_connection("127.0.0.1", target)
    except OSError:
        writer.transport.abort()
        return
    ends = {writer, far_writer}
    weather.writers |= ends

    async def one_way(
        direction: str, source: asyncio.StreamReader, sink: asyncio.StreamWriter
    ) -> None:
        with contextlib.suppress(Exception):
            await pump(weather, direction, source, sink)
        for end in ends:  # one side gone is all gone: a session of Zenoh is never half closed
            end.close()

    await asyncio.gather(one_way(UP, reader, far_writer), one_way(DOWN, far_reader, writer))
    weather.writers -= ends


def say(word: str) -> None:
    """Answer whoever gives the orders."""
    sys.stdout.write(f"{word}\n")
    sys.stdout.flush()


async def main(listen: int, target: int) -> None:
    """Relay and obey until standard input ends."""
    weather = Weather()

    async def welcome(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await relay_one(weather, target, reader, writer)

    await asyncio.start_server(welcome, "127.0.0.1", listen)
    orders = asyncio.StreamReader()
    await asyncio.get_running_loop().connect_read_pipe(
        lambda: asyncio.StreamReaderProtocol(orders), sys.stdin
    )
    say("ready")
    while order := (await orders.readline()).decode().strip():
        weather.obey(order)
        say("ok")


if __name__ == "__main__":
    die_with_parent()
    asyncio.run(main(int(sys.argv[1]), int(sys.argv[2])))
