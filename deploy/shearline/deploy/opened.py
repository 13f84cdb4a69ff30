"""A run at rest: from its record or, where it was run without one, from its journal."""

from __future__ import annotations

from pathlib import Path

from shearline.deploy.lead import outcomes
from shearline.learner.run.folder import JOURNAL
from shearline.protocol.errors import RecordError
from shearline.protocol.messages import Counted
from shearline.record.head import config_of
from shearline.record.parts import parts
from shearline.record.reader import Run, open_run


def opened(run_dir: Path) -> Run:
    """Open the record of a run, or what its journal says where it was run without one.

    Raises:
        RecordError: If there is neither.
    """
    run = open_run(run_dir)
    if not parts(run.run_dir):
        if not (run.run_dir / JOURNAL).is_file():
            raise RecordError(
                f"expected a run in {run_dir}, found neither a record nor a journal: check the path"
            )
        run.config = config_of(run.run_dir.resolve().name, run.run_dir)
        counted = [said for said in outcomes(run.run_dir) if isinstance(said, Counted)]
        run.outcomes = sorted(counted, key=lambda outcome: outcome.trial)
    return run
