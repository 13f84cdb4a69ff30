"""Starts the Rerun viewer as a quiet child: bound to this machine, and never calling out.

The viewer reports usage to its makers unless its configuration says no, and asks for newer
versions of itself at every start; it knows no environment variable against either. So it is given
a configuration folder of its own that says no, and a proxy that is not there, through which it
reaches nothing. The user's own configuration is neither read nor changed.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.errors import RecordError

#: Nobody listens on the discard port: whatever asks this proxy is refused at once.
NOWHERE = "http://127.0.0.1:9"
#: What a viewer may take of the machine before it forgets the oldest data.
MEMORY_LIMIT = "50%"
#: How long a viewer may take until it listens [s]; most of it is the system reading its program.
START_S = 30.0
LOOK_S = 0.05


@contextmanager
def quiet_environment() -> Iterator[dict[str, str]]:
    """Yield an environment in which the viewer keeps no statistics and reaches no network."""
    with tempfile.TemporaryDirectory(prefix="shearline-view-") as folder:
        home = Path(folder) / "rerun"
        home.mkdir()
        path = home / "analytics.json"
        off = {
            "analytics_enabled": False,
            "analytics_id": "none",
            "metadata": {},
            "config_file_path": str(path),
            "data_dir_path": str(home / "data"),
        }
        path.write_text(json.dumps(off), encoding="utf-8")
        yield {
            "RUST_LOG": "error",  # only what matters to whoever opened it
            **os.environ,
            "XDG_CONFIG_HOME": folder,
            "TELEMETRY_ENABLED": "false",
            **dict.fromkeys(("HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY"), NOWHERE),
            **dict.fromkeys(("http_proxy", "https_proxy", "all_proxy"), NOWHERE),
            "NO_PROXY": "127.0.0.1,localhost",
            "no_proxy": "127.0.0.1,localhost",
        }


@contextmanager
def viewer(arguments: Sequence[str], port: int | None = None) -> Iterator[subprocess.Popen[bytes]]:
    """Run a viewer of our own for as long as the block lasts; it is ended with it.

    The block begins once it listens, or has ended: what is sent to nobody is lost.

    Args:
        arguments: What its command line takes, e.g. the file to open.
        port: Where it listens on this machine; ``None`` takes a free one, so that a viewer that
            is already open is left alone.

    Raises:
        RecordError: If there is no viewer or no screen, or it never listens.
    """
    if not has_screen():
        raise RecordError(
            "there is no screen here: write the view to a file with --save view.rrd and open"
            " it where there is one (rerun view.rrd)"
        )
    port = port or free_port()
    command = [*arguments, "--hide-welcome-screen", "--memory-limit", MEMORY_LIMIT]
    with started(command, port) as child:
        yield child


@contextmanager
def started(arguments: Sequence[str], port: int) -> Iterator[subprocess.Popen[bytes]]:
    """Run the viewer's program on a port for as long as the block lasts, window or not.

    The command on the path starts the viewer proper as a child of its own. So both have a session
    to themselves, and all of it is ended, also what has been stopped.

    Raises:
        RecordError: If there is no viewer, or it never listens.
    """
    where = ["--bind", "127.0.0.1", "--port", str(port)]
    with quiet_environment() as environment:
        child = subprocess.Popen(  # noqa: S603 - the viewer we depend on, our own arguments
            [executable(), *arguments, *where], env=environment, start_new_session=True
        )
        try:
            _wait_until_listening(child, port)
            yield child
        finally:
            with contextlib.suppress(ProcessLookupError):  # its window was closed
                os.killpg(child.pid, signal.SIGKILL)
            child.wait()


def _wait_until_listening(child: subprocess.Popen[bytes], port: int) -> None:
    until_s = time.monotonic() + START_S
    while not _listens(port):
        with contextlib.suppress(subprocess.TimeoutExpired):
            child.wait(LOOK_S)
            return
        if time.monotonic() > until_s:
            raise RecordError(
                f"the viewer did not listen within {START_S:.0f} s: write the view to a file with"
                " --save view.rrd and open it later"
            )


def _listens(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def check_ended_well(child: subprocess.Popen[bytes]) -> None:
    """Wait for the viewer to be closed.

    Raises:
        RecordError: If it could not open its window.
    """
    if child.wait() != 0:
        raise RecordError(
            "the viewer could not open a window (its own words stand above): write the view to a"
            " file with --save view.rrd and open it where there is a screen"
        )


def free_port() -> int:
    """Return a port of this machine that was free a moment ago."""
    return int(free_endpoint().rsplit(":", 1)[1])


def executable() -> str:
    """Return the viewer that was installed beside this Python, else the one on the path.

    Raises:
        RecordError: If there is none.
    """
    beside = Path(sys.executable).with_name("rerun")
    found = str(beside) if beside.is_file() else shutil.which("rerun")
    if found is None:
        raise RecordError("the viewer is missing: install it with pip install 'shearline[record]'")
    return found


def has_screen() -> bool:
    """Tell whether a window could be opened here."""
    return sys.platform == "darwin" or bool(
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    )
