"""Parts of entries that are translated with them only: Numba by its private ways, which halves the time to compile.

Numba would translate every function on its way into an entry, with all that it calls, and wrap it for Python and for C.
Nothing else depends on what is here: where Numba has changed, `jit` compiles by its public interface alone.
"""

from __future__ import annotations

import gc
import importlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cached_property
from typing import Any

import numba
from numba.core import typed_passes, untyped_passes
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase
from numba.core.compiler_machinery import PassManager
from numba.core.types import Function


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


@contextmanager
def _looked_up_once() -> Iterator[None]:
    """Look up once which of the many templates of an operator takes operands of given types, not wherever it stands."""
    operators: Any = Function
    look_up = operators.get_call_type

    def recalled(operator: Any, context: Any, args: Any, kws: Any) -> Any:
        if kws or (operator, context, args) not in _FOUND:
            signature = look_up(operator, context, args, kws)
            # what is compiled for a call depends on more than its types
            if kws or operator.get_impl_key(signature) is not operator.typing_key:
                return signature
            _FOUND[operator, context, args] = signature
        return _FOUND[operator, context, args]

    operators.get_call_type = recalled
    try:
        yield
    finally:
        operators.get_call_type = look_up


_FOUND: dict[Any, Any] = {}


@contextmanager
def _without_collection() -> Iterator[None]:
    """Look for no garbage: almost all that Numba makes it keeps, and to look through all of it takes long."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


PASSES = (
    untyped_passes.TranslateByteCode,
    untyped_passes.FixupArgs,
    untyped_passes.IRProcessing,
    untyped_passes.RewriteSemanticConstants,
    untyped_passes.DeadBranchPrune,
    untyped_passes.GenericRewrites,
    untyped_passes.InlineInlinables,
    untyped_passes.DeadBranchPrune,
    untyped_passes.ReconstructSSA,
    untyped_passes.DeadBranchPrune,
    typed_passes.NopythonTypeInference,
    typed_passes.PreLowerStripPhis,
    typed_passes.IRLegalization,
    typed_passes.AnnotateTypes,
    typed_passes.NativeLowering,
    typed_passes.NoPythonBackend,
)
"""those of Numba's that kernels need: they have no closures, no exceptions and no expressions of arrays"""


class _Library(JITCodeLibrary):
    """Code that counts no references, of which Numba would optimise all twice."""

    def _optimize_final_module(self) -> None:
        passes, builder = self._codegen._module_pass_manager()  # type: ignore[no-untyped-call]
        passes.run(self._final_module, builder)


class _PartLibrary(_Library):
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


class _Compiler(CompilerBase):
    library: Any

    def __init__(self, typing_context: Any, target_context: Any, _: Any, *rest: Any) -> None:
        own = self.library(target_context.codegen(), "kernel")
        super().__init__(typing_context, target_context, own, *rest)  # type: ignore[no-untyped-call]

    def define_pipelines(self) -> list[PassManager]:
        manager: Any = PassManager("kernel")  # type: ignore[no-untyped-call]
        for one in PASSES:
            manager.add_pass(one, one.__name__)
        manager.finalize()
        return [manager]


class EntryCompiler(_Compiler):
    """Compiles an entry and with it all of its parts."""

    library = _Library

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.library.enable_object_caching()

    def compile_extra(self, func: Any) -> Any:
        """Compile a function."""
        with _looked_up_once(), _without_collection():
            return super().compile_extra(func)  # type: ignore[no-untyped-call]


class _PartCompiler(_Compiler):
    library = _PartLibrary


class _ScalarPartCompiler(_Compiler):
    library = _ScalarPartLibrary


class _PartType(numba.types.Dispatcher):
    """Numbers that are known beforehand, such as offsets, do not make a variant each."""

    def get_call_type(self, context: Any, args: Any, kws: Any) -> Any:
        unknown = tuple(numba.types.unliteral(arg) for arg in args)  # type: ignore[no-untyped-call]
        return super().get_call_type(context, unknown, kws)


numba.extending.register_model(_PartType)(numba.core.datamodel.models.OpaqueModel)


class Part:
    """A kernel that other kernels call: compiled with them. A call from Python compiles it by itself."""

    def __init__(self, function: Callable[..., Any], compile_: Callable[..., Any], scalar: bool) -> None:
        """`compile_`: `numba.njit` with the options of all kernels; `scalar`: it has no loops that vectorize."""
        self.py_func = function
        self._compile = compile_
        compiler = _ScalarPartCompiler if scalar else _PartCompiler
        # its type knows it by a weak reference only
        self._dispatcher = compile_(function, pipeline_class=compiler, no_cpython_wrapper=True, no_cfunc_wrapper=True)
        self._numba_type_ = _PartType(self._dispatcher)

    @cached_property
    def _alone(self) -> Callable[..., Any]:
        alone: Callable[..., Any] = self._compile(
            self.py_func, cache=True, no_cfunc_wrapper=True, pipeline_class=EntryCompiler
        )
        return alone

    def __call__(self, *arguments: Any) -> Any:
        """Run the kernel by itself."""
        return self._alone(*arguments)
