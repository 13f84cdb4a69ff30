"""Orders to a robot, one a line on standard input, each answered by a line of JSON when in force.

place [SEED]          the arm at the start, the lock where that trial has it, nothing wrong with
                      the robot, nobody connected, and all counters at zero
pace lockstep [SPEED] see :mod:`emulator.server`
pace wall
patience S            how long lockstep waits for an answer before the client counts as gone
press | release       the stop button
startle               a reflex, as after a collision
desk                  errors are cleared in the robot's own interface
lose N                the next N states do not arrive
drop                  the TCP connection ends
freeze | thaw         the robot's clock stands, states go on arriving
nan | sane            positions, pose and wrench are no numbers
zero | wrench         the wrench reads exactly zero
bias FX FY FZ         the wrench is wrong by so much [N]
grip FRICTION         the lock holds what it has, with such a coefficient of friction
mode other|guiding|idle   e.g. brakes locked, led by hand
recovery S            how long a recovery takes
version N             what the robot says that it speaks
report                nothing but the answer
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from typing import Any

from emulator.server import Orders, Server
from emulator.wire import Mode


class Pipe(Orders):
    """Orders on standard input; its end is the end of the process."""

    def fileno(self) -> int:
        return 0

    def obey(self, server: Server) -> None:
        # The buffer would hide a second line from select, so lines are taken byte by byte.
        line = b""
        while not line.endswith(b"\n"):
            byte = os.read(0, 1)
            if not byte:
                sys.exit(0)
            line += byte
        word, *values = line.decode().split()
        _ORDERS[word](server, *values)
        sys.stdout.write(json.dumps(report(server)) + "\n")
        sys.stdout.flush()


def report(server: Server) -> dict[str, Any]:
    """Return what has happened to the arm since it was placed."""
    robot, world = server.robot, server.robot.world
    return {
        "t_s": robot.time_ms / 1000.0,
        "client": server.connected,
        "mode": robot.mode.name.lower(),
        "moves": len(robot.ended) + (robot.motion is not None),
        "ended": [
            {"how": how, "began_s": began / 1000.0, "ended_s": ended / 1000.0}
            for how, began, ended in robot.ended
        ],
        "answered": robot.answered,
        "lost": robot.lost,
        "noticed_s": server.noticed_s,
        "travel_m": world.travel_m,
        "force_n": world.force_n,
        "peak_n": world.peak_n,
        "tip_m": world.now.tip.tolist(),
        "depth_m": float(world.now.in_lock[2]),
    }


def _place(server: Server, seed: str | None = None) -> None:
    server.disconnect()
    server.mend()
    server.robot.place(None if seed is None else int(seed))


def _pace(server: Server, pace: str, speed: str = "2") -> None:
    server.lockstep, server.speed = pace == "lockstep", float(speed)


def _patience(server: Server, seconds: str) -> None:
    server.patience_s = float(seconds)


def _lose(server: Server, states: str) -> None:
    server.lose = int(states)


def _version(server: Server, version: str) -> None:
    server.version = int(version)


def _mode(server: Server, mode: str) -> None:
    server.robot.mode = Mode[mode.upper()]


def _recovery(server: Server, seconds: str) -> None:
    server.robot.recovery_ms = round(1000.0 * float(seconds))


def _grip(server: Server, friction: str) -> None:
    server.robot.world.grip(float(friction))


def _bias(server: Server, *force: str) -> None:
    server.robot.lies.bias[:3] = [float(part) for part in force]


def _lie(name: str, *, value: bool) -> Callable[[Server], None]:
    return lambda server: setattr(server.robot.lies, name, value)


_ORDERS: dict[str, Callable[..., None]] = {
    "place": _place,
    "pace": _pace,
    "patience": _patience,
    "press": Server.press,
    "release": lambda server: server.robot.release(),
    "startle": Server.startle,
    "desk": lambda server: server.robot.recover(),
    "lose": _lose,
    "drop": Server.disconnect,
    "freeze": _lie("frozen", value=True),
    "thaw": _lie("frozen", value=False),
    "nan": _lie("nan", value=True),
    "sane": _lie("nan", value=False),
    "zero": _lie("zero_wrench", value=True),
    "wrench": _lie("zero_wrench", value=False),
    "bias": _bias,
    "grip": _grip,
    "mode": _mode,
    "recovery": _recovery,
    "version": _version,
    "report": lambda _: None,
}
