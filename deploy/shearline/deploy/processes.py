"""Child processes of one command: spawned, named, logged, and never left behind.

Children run in sessions of their own, so that a Ctrl-C at the terminal reaches only the parent,
which then ends them in order. Should the parent die without that, the kernel ends them.
"""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

#: prctl(2): the signal this process gets when its parent dies.
PR_SET_PDEATHSIG = 1
#: Set for children so that they tie their life to ours.
PARENT_VARIABLE = "SHEARLINE_PARENT"


def die_with_parent() -> None:
    """Ask the kernel to end this process when the one that spawned it dies, if it was spawned.

    Called first thing by every command, so that even ``kill -9`` of a launcher leaves no orphan.
    """
    parent = os.environ.pop(PARENT_VARIABLE, None)
    if parent is None:
        return
    ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != int(parent):  # it died before we asked
        sys.exit(0)


@dataclass(frozen=True, slots=True)
class Child:
    """One process of ours, what people call it, and where it writes what it has to say."""

    name: str
    process: subprocess.Popen[bytes]
    log: Path

    @property
    def returncode(self) -> int | None:
        """Exit code, negative for a signal, ``None`` while it runs."""
        return self.process.poll()

    def last_words(self) -> str:
        """Return the last line of its log, or ``""``."""
        try:
            lines = self.log.read_text(errors="replace").strip().splitlines()
        except OSError:
            return ""
        return lines[-1] if lines else ""


def spawn(name: str, arguments: Sequence[str], log: Path) -> Child:
    """Start ``python ARGUMENTS`` as a child whose output is appended to ``log``."""
    environment = os.environ | {PARENT_VARIABLE: str(os.getpid()), "PYTHONUNBUFFERED": "1"}
    with log.open("ab") as output:
        process = subprocess.Popen(  # noqa: S603 - our own interpreter with our own modules
            [sys.executable, *arguments],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            start_new_session=True,
            env=environment,
        )
    return Child(name=name, process=process, log=log)


def spawn_command(name: str, arguments: Sequence[str], log: Path) -> Child:
    """Start another ``shearline`` command as a child."""
    return spawn(name, ["-m", "shearline.deploy", *arguments], log)


def end(children: Iterable[Child], *, patience_s: float = 4.0) -> None:
    """Ask children to end, wait, and kill those that did not within ``patience_s``."""
    alive = [child for child in children if child.returncode is None]
    for child in alive:
        child.process.terminate()
    wait(alive, patience_s=patience_s)
    for child in alive:
        if child.returncode is None:
            child.process.kill()
            # A stopped process dies of SIGKILL too; reap it so that no zombie stays.
            child.process.wait()


def wait(children: Iterable[Child], *, patience_s: float) -> bool:
    """Wait until all children ended or ``patience_s`` is over; tell whether all did."""
    until_s = time.monotonic() + patience_s
    for child in children:
        try:
            child.process.wait(timeout=max(0.0, until_s - time.monotonic()))
        except subprocess.TimeoutExpired:
            return False
    return True
