"""Hands what was drawn to a viewer, and tells whether the viewer takes it.

The viewer's library keeps whatever a viewer has not taken, without end. So whoever draws asks here
before drawing more: a viewer that has been stopped costs no more memory than what was on its way.
What is drawn is not known here.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import rerun as rr

#: How long a viewer may take nothing before that is said [s].
PATIENCE_S = 2.0
#: How long it is then given at each further try [s].
AGAIN_S = 0.1
STUCK = "shearline: the viewer takes nothing: drawing goes on once it does"


class Drain:
    """The way to one viewer, or into a file, which always takes everything.

    Args:
        stream: What is drawn on; owned by the caller.
        patience_s: How long to wait before a viewer counts as stuck [s].
    """

    def __init__(self, stream: rr.RecordingStream, *, patience_s: float = PATIENCE_S) -> None:
        self._stream = stream
        self._patience_s = patience_s
        self._stuck = False
        self._said = False

    def taken(self) -> bool:
        """Hand over what was drawn; tell whether it was taken before patience ran out.

        Of a viewer that is gone nothing is kept either, so there is nothing to wait for.
        """
        wait_s = AGAIN_S if self._stuck else self._patience_s
        began_s = time.monotonic()
        try:
            self._stream.flush(timeout_sec=wait_s)
        except RuntimeError:  # the library has no other for being late, or for nobody there
            self._stuck = time.monotonic() - began_s >= wait_s
            if self._stuck and not self._said:
                self._said = True
                print(STUCK, file=sys.stderr, flush=True)  # noqa: T201 - to whoever looks
        else:
            self._stuck = False
        return not self._stuck

    def wait(self, closed: Callable[[], bool]) -> bool:
        """Wait until all is taken or ``closed`` says that there is nobody; tell which."""
        while not closed():
            if self.taken():
                return True
        return False
