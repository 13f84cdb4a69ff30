"""The arm's process: port, machine and terminal, and no network.

Started by the worker's process with two pipes and this terminal's input; ``python -m
shearline.evaluator.robot.process JSON``. It outlives the death of whoever started it for as long
as it takes to bring the key out, and ends by itself.
"""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import sys
import threading
import time
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, Literal

import msgspec

from shearline.evaluator.robot import pipe
from shearline.evaluator.robot.arm import Arm
from shearline.evaluator.robot.bounds import Bounds, read_bounds
from shearline.evaluator.robot.errors import RobotRefused
from shearline.evaluator.robot.load import load_port
from shearline.evaluator.robot.local import calibrate, dry_run, hover
from shearline.evaluator.robot.peer import Gone, Peer
from shearline.evaluator.robot.port import RobotPort
from shearline.evaluator.robot.results import Task
from shearline.evaluator.robot.store import Calibration, Store
from shearline.evaluator.robot.terminal import NOTICE, Terminal
from shearline.protocol.errors import ConfigError, LinkError, ShearlineError

log = logging.getLogger(__name__)

Mode = Literal["trials", "dry-run", "hover", "calibrate"]


class Orders(msgspec.Struct, frozen=True, kw_only=True):
    """What a person at this machine typed, for the arm's process.

    Attributes:
        robot: ``"franka"``, ``"panda"`` or ``"module:Class"``.
        address: Of the robot, or ``""``.
        bounds: Path of the lab's file.
        task: Level of the key-in-lock.
        mode: Take trials, or one of the local rehearsals.
        step: Ask before every trial.
        read: File descriptor to read from, -1 without a worker.
        write: File descriptor to write to.
    """

    robot: str
    bounds: str
    address: str = ""
    task: str = "keylock"
    mode: Mode = "trials"
    step: bool = False
    read: int = -1
    write: int = -1


def folder_of(bounds: Path) -> Path:
    """Return the robot's folder: beside the bounds file, and named like it."""
    return bounds.with_suffix(".state")


class Outbox:
    """Says things to the worker from a thread of its own: a worker that is frozen holds up nobody.

    Args:
        end: The arm's end of the pipe, or ``None`` without a worker.
        arm: Its signs of life are passed on.
    """

    def __init__(self, end: pipe.Pipe | None) -> None:
        self._end = end
        self._queue: SimpleQueue[pipe.Say] = SimpleQueue()
        self.arm: Arm | None = None
        self._done = threading.Event()
        if end is not None:
            threading.Thread(target=self._run, args=(end,), daemon=True, name="outbox").start()

    def put(self, message: pipe.Say) -> None:
        """Say this when its turn comes."""
        if self._end is not None:
            self._queue.put(message)

    def wait(self, timeout_s: float) -> None:
        """Wait until the last word is out."""
        if self._end is not None:
            self._done.wait(timeout_s)

    def _run(self, end: pipe.Pipe) -> None:
        try:
            while True:
                try:
                    message = self._queue.get(timeout=pipe.PULSE_S)
                except Empty:
                    if self.arm is None or time.monotonic() < self.arm.alive_until_s:
                        end.send(pipe.Pulse())
                    continue
                end.send(message)
                if isinstance(message, pipe.Over):
                    break
        except OSError:
            pass
        self._done.set()


def listen(end: pipe.Pipe, inbox: SimpleQueue[Any], peer: Peer) -> None:
    """Pass on what the worker says; what cannot wait for its turn is noted at once."""
    try:
        while True:
            data = end.receive()
            assert data is not None
            message = msgspec.msgpack.decode(data, type=pipe.ToArm)
            peer.heard_s = time.monotonic()
            match message:
                case pipe.Look(linked=linked, held=held):
                    peer.linked, peer.held = linked, held
                    continue
                case pipe.Stop(token=token, why=why):
                    peer.halts[token] = why
                    continue
                case pipe.Leave(why=why):
                    peer.leaving = why
                case _:
                    pass
            inbox.put(message)
    except (EOFError, OSError, msgspec.MsgspecError):
        peer.linked = False
        inbox.put(Gone())


def run(orders: Orders) -> pipe.Over:
    """Do what was ordered and return how it ended; expected errors are one sentence."""
    end = pipe.Pipe(orders.read, orders.write) if orders.read >= 0 else None
    outbox = Outbox(end)
    try:
        over = _run(orders, end, outbox)
    except ConfigError as fault:
        over = pipe.Over(code=2, why=str(fault))
    except LinkError as fault:
        over = pipe.Over(code=3, why=str(fault))
    except ShearlineError as fault:
        over = pipe.Over(code=4, why=str(fault))
    except Exception as fault:  # the worker must hear of it, whatever it is
        log.exception("the arm's process failed")
        over = pipe.Over(code=4, why=f"the arm's process failed: {fault!r}")
    outbox.put(over)
    outbox.wait(2.0)
    return over


def _run(orders: Orders, end: pipe.Pipe | None, outbox: Outbox) -> pipe.Over:
    path = Path(orders.bounds)
    bounds = read_bounds(path)
    port = load_port(orders.robot, orders.address)
    if len(bounds.guard.tau_ext_nm) != port.joints:
        raise ConfigError(
            f"{path}: guard.tau_ext_nm has {len(bounds.guard.tau_ext_nm)} numbers but the robot has"
            f" {port.joints} joints: give one for each"
        )
    store = Store(folder_of(path))
    try:
        found = None if orders.mode == "calibrate" else _calibrated(store, bounds)
        port.open(bounds.port_tool())
        try:
            return _with_port(orders, port, bounds, store, found, end, outbox)
        finally:
            port.close()
    finally:
        store.close()


def _calibrated(store: Store, bounds: Bounds) -> Calibration:
    found = store.calibration()
    if found is None:
        raise RobotRefused(
            f"nobody has shown where the lock is: no calibration in {store.folder};"
            " run this command with --calibrate first"
        )
    if (found.tool, found.seated_m) != (bounds.tool, bounds.lock.seated_m):
        raise RobotRefused(
            "the lock was shown with another tool or lock.seated_m than the bounds file has now:"
            " run this command with --calibrate again, or restore the file"
        )
    return found


def _with_port(
    orders: Orders,
    port: RobotPort,
    bounds: Bounds,
    store: Store,
    found: Calibration | None,
    end: pipe.Pipe | None,
    outbox: Outbox,
) -> pipe.Over:
    inbox: SimpleQueue[Any] = SimpleQueue()
    terminal = Terminal(inbox, port.stop)
    terminal.forget()
    terminal.say(f"{port.engine}, bounds {bounds.hash}, folder {store.folder}")
    if found is None:
        terminal.start()
        return calibrate(port, bounds, store, terminal, inbox)
    if orders.mode == "dry-run":
        return dry_run(port, bounds, store, terminal, found.pose())
    terminal.say(NOTICE)
    arm = Arm(
        port=port,
        bounds=bounds,
        store=store,
        task=Task(orders.task),
        terminal=terminal,
        say=outbox.put,
        o_t_lock=found.pose(),
        step=orders.step,
    )
    outbox.arm = arm
    if orders.mode == "hover":
        terminal.start()
        return hover(port, bounds, Task(orders.task), terminal, inbox, found.pose())
    if end is not None:
        threading.Thread(target=listen, args=(end, inbox, arm.peer), daemon=True).start()
    _leave_on_signals(inbox, arm.peer)
    return arm.serve()


def _leave_on_signals(inbox: SimpleQueue[Any], peer: Peer) -> None:
    """Ctrl-C is the worker's to hear; other requests to end bring the key out first."""

    def leave(number: int, _frame: object) -> None:
        peer.leaving = f"ended by {signal.Signals(number).name}"
        inbox.put(pipe.Leave(why=peer.leaving))

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, leave)


def main(arguments: list[str] | None = None) -> int:
    """Run the arm's process and return its exit code."""
    text = (sys.argv[1:] if arguments is None else arguments)[0]
    orders = msgspec.json.decode(text, type=Orders)
    over = run(orders)
    if orders.read < 0:
        sys.stderr.write(f"shearline: {over.why}\n")
    return over.code


if __name__ == "__main__":
    code = main()
    with contextlib.suppress(OSError, ValueError):
        sys.stdout.flush()
    # A terminal thread that waits for a line, or a library's own threads, must not keep us here.
    os._exit(code)
