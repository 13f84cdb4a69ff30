"""What made a result: versions of the software, and a digest of the learner's own source."""

from __future__ import annotations

import hashlib
import importlib.util
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from shearline.learner.registry import EXTRAS, LEARNERS, resolve

#: What a learner's proposals may depend on, beside Python.
PACKAGES = ("shearline", "numpy", "scipy", "scikit-learn", "cma")
#: The package that modules of a single file stand in.
SHELF = "shearline.learner"


def versions() -> dict[str, str]:
    """Return the version of Python and of each package that is installed."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def code_of(learner: str) -> str:
    """Return 12 hexadecimal digits of a learner's source: its file, or its package's files.

    What it shares with other learners is covered by Shearline's version alone.

    Raises:
        UnknownLearnerError: If there is no such learner.
    """
    module = {**LEARNERS, **EXTRAS}[resolve(learner)].partition(":")[0]
    package = module.rpartition(".")[0]
    spec = importlib.util.find_spec(module if package == SHELF else package)
    assert spec is not None
    assert spec.origin is not None
    origin = Path(spec.origin)
    files = [origin] if package == SHELF else sorted(origin.parent.glob("*.py"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:12]
