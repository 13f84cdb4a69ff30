"""The run at rest: one MCAP of every message, trace and learner snapshot.

``open(run_dir)`` reads a run back; ``complete`` fills what a killed recorder missed;
``shearline.record.recorder`` is the process that writes, ``shearline.record.view`` the picture.
"""

from shearline.record.complete import complete
from shearline.record.reader import Run, Trace
from shearline.record.reader import open_run as open  # noqa: A004 - read as shearline.record.open
from shearline.record.table import Table

__all__ = ["Run", "Table", "Trace", "complete", "open"]
