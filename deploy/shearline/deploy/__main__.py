"""The ``shearline`` command, also as ``python -m shearline.deploy``.

Until there is something to end in order, Ctrl-C just ends the process: an import that is
interrupted would print a traceback. And once everything has ended in order, a process that had a
session is not taken apart by the interpreter: one in thirty learners died of it, with its run
complete, because a thread of Zenoh's was still on its way back into Python.
"""

import os
import signal
import sys
from typing import NoReturn


def main() -> NoReturn:
    """Run the command line and end with its exit code."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from shearline.deploy.cli import main as command  # noqa: PLC0415 - after the line above

    signal.signal(signal.SIGINT, signal.default_int_handler)
    code = command()  # which flushes, too
    if "zenoh" in sys.modules:
        os._exit(code)
    raise SystemExit(code)


if __name__ == "__main__":
    main()
