"""Starting a recorder, without loading anything of what it will need."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path


def spawn(connect: str, run: str, run_dir: Path) -> subprocess.Popen[str]:
    """Start a recorder as a child in its own session, so that Ctrl-C is not meant for it.

    Its ``recording`` line arrives on the child's ``stdout``; complaints go to our ``stderr``.
    """
    command = [sys.executable, "-m", "shearline.record.recorder", "--connect", connect]
    return subprocess.Popen(  # noqa: S603 - our own module, arguments are not interpreted
        [*command, "--run", run, "--out", str(run_dir)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
