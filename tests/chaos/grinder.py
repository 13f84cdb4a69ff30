"""Keeps a disk busy: writes a file in large pieces and waits for each to be on it.

Run as ``python grinder.py FOLDER``; goes on until it is ended.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from shearline.deploy.processes import die_with_parent

#: One piece, and how many of them before the file is begun anew [bytes, pieces].
PIECE_BYTES = 8 * 1024 * 1024
PIECES = 16


def main(folder: Path) -> None:
    """Write for ever."""
    piece = os.urandom(PIECE_BYTES)
    while True:
        with (folder / "grist").open("wb") as grist:
            for _ in range(PIECES):
                grist.write(piece)
                grist.flush()
                os.fsync(grist.fileno())


if __name__ == "__main__":
    die_with_parent()
    main(Path(sys.argv[1]))
