"""How kernels are compiled: entries, which Python calls, and the parts of which they are made; one cache folder.

Numba would translate every function on its way into an entry, with all that it calls, and wrap it for Python and for C:
twice the time of what is done here, where only entries are translated.
"""

from __future__ import annotations

import hashlib
import importlib
import os
from collections.abc import Callable
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy.typing as npt
import platformdirs
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

PACKAGE = Path(__file__).parents[1]
COMPILED = (
    "model/states.py",
    "kernels/*.py",
    "aiding/*.py",
    *(f"navigate/{name}.py" for name in ("engine", "silence", "state", "update", "window")),
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


class _PartLibrary(JITCodeLibrary):
    """Code that waits to be linked into that of an entry; there is no machine code of it."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        self._finalized = True

    @property
    def codegen(self) -> Any:
        return self

    def set_env(self, name: str, env: Any) -> None:
        """Do nothing, since there is no machine code that could know of an environment."""


class _ScalarPartLibrary(_PartLibrary):
    """Code that is optimised where it is linked into, and nowhere before."""

    def _optimize_final_module(self) -> None:
        pass


class _PartCompiler(Compiler):
    library = _PartLibrary

    def __init__(self, typing_context: Any, target_context: Any, library: Any, *rest: Any) -> None:
        own = self.library(target_context.codegen(), "part")  # type: ignore[no-untyped-call]
        super().__init__(typing_context, target_context, own, *rest)  # type: ignore[no-untyped-call]


class _ScalarPartCompiler(_PartCompiler):
    library = _ScalarPartLibrary


class _ScalarPartType(numba.types.Dispatcher):
    """Numbers that are known beforehand, such as offsets, do not make a variant each."""

    def get_call_type(self, context: Any, args: Any, kws: Any) -> Any:
        unknown = tuple(numba.types.unliteral(arg) for arg in args)  # type: ignore[no-untyped-call]
        return super().get_call_type(context, unknown, kws)


numba.extending.register_model(_ScalarPartType)(numba.core.datamodel.models.OpaqueModel)


class _Part:
    """A kernel that other kernels call: compiled with them. A call from Python compiles it by itself."""

    def __init__(self, function: Callable[..., Any], compiler: type, kind: type, **options: Any) -> None:
        self.py_func = function
        self._options = options
        self._dispatcher = _compiled(
            function, pipeline_class=compiler, no_cpython_wrapper=True, no_cfunc_wrapper=True, **options
        )
        self._numba_type_ = kind(self._dispatcher)

    @cached_property
    def _alone(self) -> Callable[..., Any]:
        return _entry(self.py_func, **self._options)

    def __call__(self, *arguments: Any) -> Any:
        return self._alone(*arguments)


def _part(function: F, compiler: type = _PartCompiler, kind: type = numba.types.Dispatcher, **options: Any) -> F:
    return function if NUMBA.DISABLE_JIT else cast(F, _Part(function, compiler, kind, **options))


def _entry(function: F, **options: Any) -> F:
    return _compiled(function, cache=True, no_cfunc_wrapper=True, **options)


def entry(function: F) -> F:
    """Compile a kernel that Python calls, and all that it calls; cached on disk.

    Without Numba's runtime: nothing can allocate, and no view of an array costs an atomic count of references.
    """
    return _entry(function, _nrt=False)


def compiled_for(function: F, *arguments: Any) -> F:
    """Return the code of an entry for arguments of these types. It checks none: others would be read wrongly.

    A call of the entry itself finds the types of its arguments anew: with many arrays that takes several microseconds.
    """
    if NUMBA.DISABLE_JIT:
        return function
    return cast(F, cast(Any, function).compile(tuple(map(numba.typeof, arguments))))


def kernel(function: F) -> F:
    """Make a function of arrays and numbers a part of entries, optimised by itself first: so its loops vectorize."""
    return _part(function, _nrt=False)


def scalar_kernel(function: F) -> F:
    """Make a function without such loops a part of entries: half the time to compile."""
    return _part(function, _ScalarPartCompiler, _ScalarPartType, _nrt=False)


def blas_kernel(function: F) -> F:
    """Make a function that calls BLAS a part of entries, which Numba does only with its runtime."""
    return _part(function, _nrt=True)


def formula(function: F) -> F:
    """Compile a formula that is inlined into each loop that uses it, so that the loop vectorizes."""
    return _compiled(function, inline="always", _nrt=False)
