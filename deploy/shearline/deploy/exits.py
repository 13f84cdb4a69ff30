"""Exit codes, and which error ends in which: bad input is one sentence, never a traceback."""

from __future__ import annotations

import enum
import os
import sys

from shearline.protocol.errors import ConfigError, LinkError, ShearlineError, SpaceError


class Exit(enum.IntEnum):
    """What a command's exit code means; scripts rely on it."""

    OK = 0
    USAGE = 2
    NOT_CONNECTED = 3
    RUN_FAILED = 4
    INTERRUPTED = 130


def code_of(error: BaseException) -> Exit:
    """Return the exit code that an error raised on purpose ends in."""
    match error:
        case KeyboardInterrupt():
            return Exit.INTERRUPTED
        case LinkError():
            return Exit.NOT_CONNECTED
        case ConfigError() | SpaceError():
            return Exit.USAGE
    return Exit.RUN_FAILED


def complain(error: BaseException) -> Exit:
    """Print an expected error as one sentence on standard error and return its exit code.

    Raises:
        BaseException: ``error`` itself, when it is a programming error: those stay loud.
    """
    code = code_of(error)
    if isinstance(error, KeyboardInterrupt):
        print("shearline: interrupted", file=sys.stderr)
    elif isinstance(error, BrokenPipeError):
        # The reader of a pipe left; what it wanted it has. Python would complain again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    elif isinstance(error, ShearlineError | OSError):
        print(f"shearline: {error}", file=sys.stderr)
    else:
        raise error
    return code
