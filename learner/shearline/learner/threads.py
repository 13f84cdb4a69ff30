"""One thread for linear algebra while a model is fitted.

Sums over many threads depend on how many there are; proposals may not. At the sizes of a run one
thread is also the fastest.
"""

from __future__ import annotations

import functools
from contextlib import AbstractContextManager
from typing import Any


@functools.cache
def _controller() -> Any:
    # The controller knows the libraries that are loaded when it is made: load the users first.
    import sklearn.mixture  # noqa: PLC0415 - heavy, at the first fit
    import sklearn.svm  # noqa: F401, PLC0415

    # It ships no type information.
    from threadpoolctl import (  # type: ignore[import-untyped]  # noqa: PLC0415
        ThreadpoolController,
    )

    return ThreadpoolController()


def load() -> None:
    """Load the libraries of fits, which takes a second, unless they are."""
    _controller()


def fitting() -> AbstractContextManager[object]:
    """Return a context in which BLAS and OpenMP libraries use one thread."""
    context: AbstractContextManager[object] = _controller().limit(limits=1)
    return context
