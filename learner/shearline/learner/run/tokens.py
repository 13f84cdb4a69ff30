"""Tokens of attempts: unguessable, and drawn from the system many at a time.

Each call of the system costs as much as to read a message, and every trial needs a token.
"""

from __future__ import annotations

import os
from collections.abc import Iterator

#: 128 random bits: nobody guesses the token of an attempt that was not given to them.
TOKEN_BYTES = 16

#: Tokens drawn at once.
BATCH = 64


def tokens() -> Iterator[str]:
    """Yield tokens of 32 hexadecimal digits without end."""
    while True:
        drawn = os.urandom(BATCH * TOKEN_BYTES).hex()
        width = 2 * TOKEN_BYTES
        for at in range(0, len(drawn), width):
            yield drawn[at : at + width]
