"""How kernels are compiled: entries, which Python calls, and the parts of which they are made; one cache folder."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeVar, cast

import numba
import numpy.typing as npt
import platformdirs

PACKAGE = Path(__file__).parents[1]
COMPILED = (
    "model/states.py",
    "kernels/*.py",
    "aiding/*.py",
    *(
        f"navigate/{name}.py"
        for name in ("deviations", "engine", "receiver", "silence", "slip", "state", "together", "update", "window")
    ),
    "simulation/flexible.py",
)


def _cache_folder() -> Path:
    # Numba's cache does not notice an edit in a callee of another file: a folder per state of such files does.
    digest = hashlib.sha256()
    for pattern in COMPILED:
        for source in sorted(PACKAGE.glob(pattern)):
            digest.update(source.read_bytes())
    root = os.environ.get("POLYINS_CACHE") or platformdirs.user_cache_dir("polyins")
    return Path(root) / "kernels" / digest.hexdigest()[:16]


CACHE_FOLDER = _cache_folder()
NUMBA: Any = numba.config

Array = npt.NDArray[Any]
"""An array as kernels take it: float64 unless said otherwise."""

F = TypeVar("F", bound=Callable[..., Any])


def _compiled(function: F, **options: Any) -> F:
    before = NUMBA.CACHE_DIR
    NUMBA.CACHE_DIR = str(CACHE_FOLDER)
    try:
        return cast(F, numba.njit(error_model="numpy", nogil=True, fastmath={"contract"}, **options)(function))
    finally:
        NUMBA.CACHE_DIR = before


def _parts() -> Any:
    """Return what compiles parts faster, or None where Numba is another than it was made for."""
    try:
        from polyins.kernels import parts

        parts.start_without_scipy()
    except (ImportError, AttributeError, TypeError):
        return None
    return parts


PARTS: Final = _parts()


def _part(function: F, *, scalar: bool = False, runtime: bool = False) -> F:
    if NUMBA.DISABLE_JIT:
        return function
    if PARTS is None:
        return _compiled(function)
    return cast(F, PARTS.Part(function, partial(_compiled, _nrt=runtime), scalar))


def entry(function: F) -> F:
    """Compile a kernel that Python calls, and all that it calls; cached on disk.

    Without Numba's runtime: nothing can allocate, and no view of an array costs an atomic count of references.
    """
    if PARTS is None:
        return _compiled(function, cache=True)
    return _compiled(function, cache=True, no_cfunc_wrapper=True, _nrt=False, pipeline_class=PARTS.EntryCompiler)


def compiled_for(function: F, *arguments: Any) -> F:
    """Return the code of an entry for arguments of these types. It checks none: others would be read wrongly.

    A call of the entry itself finds the types of its arguments anew: with many arrays that takes several microseconds.
    """
    if NUMBA.DISABLE_JIT:
        return function
    return cast(F, cast(Any, function).compile(tuple(map(numba.typeof, arguments))))


def kernel(function: F) -> F:
    """Make a function of arrays and numbers a part of entries, optimised by itself first: so its loops vectorize."""
    return _part(function)


def scalar_kernel(function: F) -> F:
    """Make a function without such loops a part of entries: half the time to compile."""
    return _part(function, scalar=True)


def blas_kernel(function: F) -> F:
    """Make a function that calls BLAS a part of entries, which Numba does only with its runtime."""
    return _part(function, runtime=True)


def formula(function: F) -> F:
    """Compile a formula that is inlined into each loop that uses it, so that the loop vectorizes."""
    return _compiled(function, inline="always") if PARTS is None else _compiled(function, inline="always", _nrt=False)
