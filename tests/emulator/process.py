"""A robot's process, as its tests command it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Self

from shearline.deploy.processes import PARENT_VARIABLE, Child

TESTS = Path(__file__).parents[1]


def free_address() -> str:
    """Return a loopback address where no other robot of this machine listens.

    The port is fixed, so every robot has an address of its own: two bytes of the process, one
    that counts.
    """
    global _count  # noqa: PLW0603 - addresses differ for the life of this process
    _count += 1
    pid = os.getpid() % 62_000
    return f"127.{10 + pid // 250}.{1 + pid % 250}.{_count % 250 + 1}"


_count = 0


class Emulator:
    """One robot in a process of its own; dies with this one.

    Args:
        version: 5 for a Panda, 10 for an FR3.
        log: Where its standard error goes.

    Attributes:
        address: Where it listens.
    """

    def __init__(self, version: int, log: Path) -> None:
        self.address = free_address()
        path = os.pathsep.join([str(TESTS), *filter(None, [os.environ.get("PYTHONPATH")])])
        with log.open("ab") as complaints:
            process = subprocess.Popen(
                [sys.executable, "-m", "emulator", str(version), self.address],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=complaints,
                env=os.environ | {PARENT_VARIABLE: str(os.getpid()), "PYTHONPATH": path},
            )
        self.child = Child("emulator", process, log)
        assert self._line() == "ready", self.child.last_words()

    def order(self, words: str) -> dict[str, Any]:
        """Have an order obeyed, and return the report after it."""
        pipe = self.child.process.stdin
        assert pipe is not None
        pipe.write(f"{words}\n".encode())
        pipe.flush()
        said: dict[str, Any] = json.loads(self._line())
        return said

    def report(self) -> dict[str, Any]:
        """Return what has happened since the arm was placed."""
        return self.order("report")

    def until(self, key: str, value: Any, patience_s: float = 20.0) -> dict[str, Any]:
        """Wait until a report says so."""
        deadline = time.monotonic() + patience_s
        while (said := self.report())[key] != value:
            assert time.monotonic() < deadline, f"{key} never became {value!r}: {said}"
            time.sleep(0.002)
        return said

    def close(self) -> None:
        """End the process."""
        self.child.process.kill()
        self.child.process.communicate()

    def _line(self) -> str:
        pipe = self.child.process.stdout
        assert pipe is not None
        line = pipe.readline().decode().strip()
        assert line, self.child.last_words()
        return line

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
