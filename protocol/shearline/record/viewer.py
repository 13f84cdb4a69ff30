"""Starts the Rerun viewer as a quiet child: bound to this machine, analytics off.

The viewer reports usage to its makers unless its configuration says no, and it knows no
environment variable for that; so it is given a configuration folder of its own that says no. The
user's own configuration is neither read nor changed.
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

from shearline.protocol.errors import RecordError

#: What a viewer may take of the machine before it forgets the oldest data.
MEMORY_LIMIT = "50%"


@contextmanager
def quiet_environment() -> Iterator[dict[str, str]]:
    """Yield an environment in which the viewer neither sends nor keeps any statistics."""
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
        yield {**os.environ, "XDG_CONFIG_HOME": folder, "TELEMETRY_ENABLED": "false"}


@contextmanager
def viewer(arguments: Sequence[str]) -> Iterator[subprocess.Popen[bytes]]:
    """Run the viewer for as long as the block lasts; it is ended with it.

    Args:
        arguments: What its command line takes, e.g. the file to open.

    Raises:
        RecordError: If there is no viewer or no screen.
    """
    if not has_screen():
        raise RecordError(
            "there is no screen here: write the view to a file with --save view.rrd and open"
            " it where there is one (rerun view.rrd)"
        )
    command = [executable(), *arguments, "--bind", "127.0.0.1", "--hide-welcome-screen"]
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
