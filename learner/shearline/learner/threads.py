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


def fitting(library: str, *others: str) -> AbstractContextManager[object]:
    """Return a context in which BLAS and OpenMP libraries use one thread.

    Args:
        library: A module that the fit needs. It is loaded here: what is loaded within the context
            would use as many threads as it likes.
        others: More of them; numpy is always one.
    """
    context: AbstractContextManager[object] = load(library, *others).limit(limits=1)
    return context
