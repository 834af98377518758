"""Parts of entries that are translated with them only: Numba by its private ways, which halves the time to compile.

Numba would translate every function on its way into an entry, with all that it calls, and wrap it for Python and for C.
Nothing else depends on what is here: where Numba has changed, `jit` compiles by its public interface alone.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from contextlib import suppress
from functools import cached_property
from typing import Any

import numba
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


def start_without_scipy() -> None:
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


class Part:
    """A kernel that other kernels call: compiled with them. A call from Python compiles it by itself."""

    def __init__(self, function: Callable[..., Any], compile_: Callable[..., Any], scalar: bool) -> None:
        """`compile_`: `numba.njit` with the options of all kernels; `scalar`: it has no loops that vectorize."""
        self.py_func = function
        self._compile = compile_
        compiler, kind = (_ScalarPartCompiler, _ScalarPartType) if scalar else (_PartCompiler, numba.types.Dispatcher)
        # its type knows it by a weak reference only
        self._dispatcher = compile_(function, pipeline_class=compiler, no_cpython_wrapper=True, no_cfunc_wrapper=True)
        self._numba_type_ = kind(self._dispatcher)

    @cached_property
    def _alone(self) -> Callable[..., Any]:
        alone: Callable[..., Any] = self._compile(self.py_func, cache=True, no_cfunc_wrapper=True)
        return alone

    def __call__(self, *arguments: Any) -> Any:
        """Run the kernel by itself."""
        return self._alone(*arguments)
