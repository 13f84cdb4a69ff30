"""Reads that may block for ever, done where nobody waits for them for ever."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

Value = TypeVar("Value")


class Reader(Generic[Value]):
    """Calls one function, again and again, in a daemon thread of its own.

    Args:
        read: What to call; its exceptions are raised by :meth:`get`.
    """

    def __init__(self, read: Callable[[], Value]) -> None:
        self._read = read
        self._wanted, self._done = threading.Semaphore(0), threading.Event()
        self._value: Value | None = None
        self._error: Exception | None = None
        self.busy = False
        threading.Thread(target=self._run, daemon=True, name="robot-read").start()

    def get(self, patience_s: float) -> Value | None:
        """Return a value read after this call began, or ``None`` if none came in time.

        A read that came too late for an earlier call is waited for, and its value is returned.
        """
        if not self.busy:
            self.busy = True
            self._done.clear()
            self._wanted.release()
        if not self._done.wait(patience_s):
            return None
        self.busy = False
        if self._error is not None:
            raise self._error
        return self._value

    def _run(self) -> None:
        while True:
            self._wanted.acquire()
            self._value = self._error = None
            try:
                self._value = self._read()
            except Exception as error:  # noqa: BLE001 - it is raised where it is waited for
                self._error = error
            self._done.set()
