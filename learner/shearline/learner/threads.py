"""One thread for linear algebra while a model is fitted.

Sums over many threads depend on how many there are; proposals may not. At the sizes of a run one
thread is also the fastest.
"""

from __future__ import annotations

import functools
import importlib
from contextlib import AbstractContextManager
from typing import Any


@functools.cache
def load(*libraries: str) -> Any:
    """Load the modules that a fit needs, unless they are; return who controls their threads.

    Args:
        libraries: Names of modules; they can take a second to load, and a learner that does
            without one should not wait for it.
    """
    for library in libraries:
        importlib.import_module(library)
    # It ships no type information.
    from threadpoolctl import (  # type: ignore[import-untyped]  # noqa: PLC0415
        ThreadpoolController,
    )

    # It knows the libraries that are loaded when it is made, and no later ones.
    return ThreadpoolController()


def fitting(*libraries: str) -> AbstractContextManager[object]:
    """Return a context in which BLAS and OpenMP libraries use one thread.

    Args:
        libraries: Modules that the fit needs, loaded here; numpy is always one of them.
    """
    context: AbstractContextManager[object] = load(*libraries).limit(limits=1)
    return context
