"""The report: one HTML page with the pictures people tune by, made from the record alone.

``write(run_dir)`` writes it beside the run; ``report`` and ``compare`` return pages as text. The
pictures stand in modules by noun; none of them knows the page, and none keeps state.
"""

from shearline.record.report.compare import compare
from shearline.record.report.page import report
from shearline.record.report.write import write

__all__ = ["compare", "report", "write"]
