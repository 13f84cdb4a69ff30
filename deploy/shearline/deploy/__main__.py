"""The ``shearline`` command, also as ``python -m shearline.deploy``.

Until there is something to end in order, Ctrl-C just ends the process: an import that is
interrupted would print a traceback.
"""

import signal


def main() -> int:
    """Run the command line and return its exit code."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from shearline.deploy.cli import main as command  # noqa: PLC0415 - after the line above

    signal.signal(signal.SIGINT, signal.default_int_handler)
    return command()


if __name__ == "__main__":
    raise SystemExit(main())
