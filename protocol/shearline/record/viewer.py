"""Starts the Rerun viewer as a quiet child: bound to this machine, and never calling out.

The viewer reports usage to its makers unless its configuration says no, and asks for newer
versions of itself at every start; it knows no environment variable against either. So it is given
a configuration folder of its own that says no, and a proxy that is not there, through which it
reaches nothing. The user's own configuration is neither read nor changed.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.errors import RecordError

#: Nobody listens on the discard port: whatever asks this proxy is refused at once.
NOWHERE = "http://127.0.0.1:9"
#: What a viewer may take of the machine before it forgets the oldest data.
MEMORY_LIMIT = "50%"


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

    Args:
        arguments: What its command line takes, e.g. the file to open.
        port: Where it listens on this machine; ``None`` takes a free one, so that a viewer that
            is already open is left alone.

    Raises:
        RecordError: If there is no viewer or no screen.
    """
    if not has_screen():
        raise RecordError(
            "there is no screen here: write the view to a file with --save view.rrd and open"
            " it where there is one (rerun view.rrd)"
        )
    where = ["--bind", "127.0.0.1", "--port", str(port or free_port())]
    command = [executable(), *arguments, *where, "--hide-welcome-screen"]
    with quiet_environment() as environment:
        child = subprocess.Popen(  # noqa: S603 - the viewer we depend on, our own arguments
            [*command, "--memory-limit", MEMORY_LIMIT], env=environment
        )
        try:
            yield child
        finally:
            if child.poll() is None:
                child.terminate()
            child.wait()


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
