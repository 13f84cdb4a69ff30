"""Compiled functions: one decorator, and a cache that notices when any of their sources change.

numba caches machine code by the file of the outermost function alone: an edit in a function that
it calls from another file would go unnoticed. So the cache folder's name carries a digest of every
source file that is compiled. ``NUMBA_CACHE_DIR`` is respected as the parent of that folder;
otherwise it lies in the user's cache folder, or, where that cannot be written, in the temporary
folder.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from llvmlite import ir  # type: ignore[import-untyped] # ships no types
from numba import types
from numba.extending import intrinsic

import shearline

Function = TypeVar("Function", bound=Callable[..., Any])

#: Folders below the ``shearline`` namespace whose sources are compiled.
_COMPILED = ("sims", "evaluator/skill")


def compiled(function: Function) -> Function:
    """Compile ``function`` to machine code on first use, and keep it for the next process."""
    machine: Function = numba.njit(cache=True, error_model="numpy", forceinline=True)(function)
    return machine


@intrinsic
def call_with_two_addresses(
    _typing: Any, _function: Any, _first: Any, _second: Any
) -> tuple[Any, Any]:
    """Call the C function ``void f(void*, void*)`` at an integer address.

    The address comes in as an argument: a function that captures it as a constant would be good
    for one process only and could not be cached.
    """

    def emit(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        word = ir.IntType(64)
        kind = ir.FunctionType(ir.VoidType(), [word, word])
        function = builder.inttoptr(arguments[0], kind.as_pointer())
        builder.call(function, [arguments[1], arguments[2]])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64), emit


def source_digest() -> str:
    """Return 12 hexadecimal digits that change with any source that is compiled."""
    digest = hashlib.sha256(numba.__version__.encode())
    for folder in _COMPILED:
        for root in shearline.__path__:
            for path in sorted(Path(root, folder).glob("*.py")):
                digest.update(path.name.encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _cache_folder() -> str:
    name = f"shearline-{source_digest()}"
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    parents = [home, Path(tempfile.gettempdir(), f"shearline-{os.getuid()}")]
    if numba.config.CACHE_DIR:
        parents.insert(0, Path(numba.config.CACHE_DIR))
    for parent in parents:
        folder = parent / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return str(folder)
    return str(numba.config.CACHE_DIR)


numba.config.CACHE_DIR = _cache_folder()
