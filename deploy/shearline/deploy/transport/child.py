"""The children of the transport benchmark: started, asked for figures, never left behind."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any, Self

from shearline.deploy.processes import PARENT_VARIABLE
from shearline.protocol.errors import ShearlineError

#: Longest time one measurement may take before it counts as broken [s].
PATIENCE_S = 120.0

_CLOCK_HZ = os.sysconf("SC_CLK_TCK")


class BenchFailed(ShearlineError):  # noqa: N818 - an end, not a mistake of the caller
    """A measurement did not come to its end; the message says which."""


def measured(module: str, *arguments: object) -> dict[str, Any]:
    """Run one measurement in a fresh process and return what it reports.

    Raises:
        BenchFailed: If it reports nothing.
    """
    command = _command(module, arguments)
    with subprocess.Popen(  # noqa: S603 - our own interpreter with our own modules
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=_environment()
    ) as process:
        try:
            said, complaints = process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            said, complaints = process.communicate()
    lines = said.decode().strip().splitlines()
    if process.returncode != 0 or not lines:
        last = complaints.decode(errors="replace").strip().splitlines()[-1:]
        raise BenchFailed(f"{' '.join(command[2:])} failed: {' '.join(last) or 'it hangs'}")
    figures: dict[str, Any] = json.loads(lines[-1])
    return figures


def report(figures: Mapping[str, object]) -> None:
    """Print what :func:`measured` returns."""
    print(json.dumps(figures), flush=True)


class Children:
    """Processes that live as long as the block."""

    def __init__(self) -> None:
        self.processes: list[subprocess.Popen[bytes]] = []

    def start(
        self, module: str, *arguments: object, log: Path | None = None
    ) -> subprocess.Popen[bytes]:
        """Start a module of this package; its standard error goes to ``log``."""
        with (log or Path(os.devnull)).open("ab") as errors:
            process = subprocess.Popen(  # noqa: S603 - as above
                _command(module, arguments),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                env=_environment(),
            )
        self.processes.append(process)
        return process

    def say(self, line: str) -> None:
        """Write a line to each child's standard input."""
        for process in self.processes:
            pipe: IO[bytes] | None = process.stdin
            assert pipe is not None
            pipe.write(f"{line}\n".encode())
            pipe.flush()

    def hear(self) -> None:
        """Wait for one line from each."""
        for process in self.processes:
            assert process.stdout is not None
            process.stdout.readline()

    def cpu_s(self) -> float:
        """Return the processor time of all children so far [s]."""
        return sum(_cpu_s(process.pid) for process in self.processes)

    def memory_bytes(self) -> int:
        """Return the resident memory of all children [bytes]."""
        return sum(_memory_bytes(process.pid) for process in self.processes)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for process in self.processes:
            process.kill()
        for process in self.processes:
            process.communicate()  # reaps it and closes its pipes


def statistics(times_s: Sequence[float]) -> dict[str, float]:
    """Return ``p50_s`` and ``p99_s`` of round trips [s]."""
    ordered = sorted(times_s)
    return {"p50_s": ordered[len(ordered) // 2], "p99_s": ordered[int(0.99 * len(ordered))]}


def _command(module: str, arguments: Sequence[object]) -> list[str]:
    return [sys.executable, "-m", f"shearline.deploy.transport.{module}", *map(str, arguments)]


def _environment() -> dict[str, str]:
    return {**os.environ, PARENT_VARIABLE: str(os.getpid())}


def _cpu_s(pid: int) -> float:
    # proc(5): behind the name in brackets, utime and stime are the 12th and 13th field.
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _CLOCK_HZ


def _memory_bytes(pid: int) -> int:
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")
