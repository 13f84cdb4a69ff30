"""One robot in a process of its own: ``python -m emulator 10 127.0.0.21``; see orders.py."""

from __future__ import annotations

import sys

from emulator.orders import Pipe
from emulator.robot import Robot
from emulator.server import Server
from emulator.wire import PROTOCOLS
from emulator.world import World

from shearline.deploy.processes import die_with_parent


def main() -> None:
    """Serve until standard input ends or the parent dies."""
    die_with_parent()
    version, address = sys.argv[1:]
    server = Server(Robot(PROTOCOLS[int(version)], World()), address)
    server.orders = Pipe()
    print("ready", flush=True)  # noqa: T201 - the answer to having been started
    server.serve()


if __name__ == "__main__":
    main()
