"""How kernels are compiled: one decorator, one cache folder."""

from __future__ import annotations

import hashlib
import importlib
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy.typing as npt
import platformdirs

PACKAGE = Path(__file__).parents[1]
COMPILED = ("kernels/*.py", "aiding/*.py", "engine.py")


def _cache_folder() -> Path:
    # Numba's cache does not notice an edit in a callee of another file: a folder per state of the sources does.
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


def _start_without_scipy() -> None:
    """Keep Numba's start from importing scipy.linalg, which takes as long as importing NumPy.

    It only asks whether BLAS is there; compiled functions that call BLAS import it themselves.
    """
    with suppress(ImportError, AttributeError):
        from numba.np import linalg

        ask = linalg.ensure_blas
        linalg.ensure_blas = lambda *_, **__: None
        try:
            importlib.import_module("numba.np.arraymath")
        finally:
            linalg.ensure_blas = ask


_start_without_scipy()


def _compiled(function: F, **options: Any) -> F:
    before = NUMBA.CACHE_DIR
    NUMBA.CACHE_DIR = str(CACHE_FOLDER)
    try:
        return cast(F, numba.njit(error_model="numpy", nogil=True, fastmath={"contract"}, **options)(function))
    finally:
        NUMBA.CACHE_DIR = before


def kernel(function: F) -> F:
    """Compile a function of arrays and numbers, cached on disk.

    Without Numba's runtime: nothing can allocate, and no view of an array costs an atomic count of references.
    """
    return _compiled(function, cache=True, _nrt=False)


def blas_kernel(function: F) -> F:
    """Compile a function that calls BLAS, which Numba does only with its runtime."""
    return _compiled(function, cache=True, _nrt=True)


def formula(function: F) -> F:
    """Compile a formula that is inlined into each loop that uses it, so that the loop vectorizes."""
    return _compiled(function, inline="always", _nrt=False)
