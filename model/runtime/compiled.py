"""How kernels are compiled: one plain Python source for a single step, a long record, many lanes and the closed loop.

`compiled` is `numba.njit` with a disk cache that follows the *content* of the whole project. So an edit of a callee in
another file never leaves the old arithmetic in place: see `kernel_cache`. The cache leans on the inside of Numba: with
a version that it was not tested with, kernels are compiled by every process, and one line says so. With
`NUMBA_DISABLE_JIT=1` the same functions run as ordinary Python.

`by_type` is the one place where a kernel picks its variant: a function with several bodies, chosen by the type of its
first argument, at compile time inside compiled code. A variant that a run does not use is not in its machine code.
"""

import functools
from collections.abc import Callable
from typing import Any, Protocol, TypeVar, cast

import numba
from numba.core import config, types
from numba.core.typing.templates import AbstractTemplate, infer_global

from . import provenance
from .build_folder import warn_once
from .extras import need

need(None)

CACHED = (0, 60), (0, 68)
"""The first and the last version of Numba with which compiled code is kept: `make matrix` runs both."""
Kernel = TypeVar("Kernel", bound=Callable)


class ByType(Protocol):
    """A function of several bodies, chosen by the class of its first argument."""

    def __call__(self, first: Any, *rest: Any) -> Any: ...

    def register(self, kind: type) -> Callable[[Kernel], Kernel]:
        """Return a decorator that makes a function the body for `kind`."""


def _jit(function: Kernel, folder: str, **options: Any) -> Any:
    """Return `function` compiled with Numba, kept on disk: see `kernel_cache`.

    Python code of other threads runs beside a kernel.
    """
    kernel = numba.njit(error_model="numpy", nogil=True, **options)(function)
    if not cast(Any, config).DISABLE_JIT and _is_cached():
        from .kernel_cache import KernelCache  # noqa: PLC0415  (another Numba need not have what this imports)

        kernel._cache = KernelCache(function, folder)
    return kernel


def _is_cached() -> bool:
    """Return whether compiled code is kept with this version of Numba; otherwise a warning says that it is not."""
    first, last = CACHED
    version = numba.version_info.short
    if first <= version <= last:
        return True
    span = f"{first[0]}.{first[1]} to {last[0]}.{last[1]}"
    warn_once("numba", f"compiled code is kept with Numba {span}, not with {numba.__version__}: each run compiles anew")
    return False


def _kernel(function: Kernel, into_caller: bool) -> Kernel:
    """Return `function` as Python calls it, and as compiled code does.

    The wrapper that converts Python objects is a third of the compiler's work, and a call from compiled code does not
    need it: a second compilation, without the wrapper, serves such calls. Its inlining is always stated: otherwise
    Numba takes it from whichever caller is compiled first.
    """
    kernel = _jit(function, "called", forceinline=False)
    if not cast(Any, config).DISABLE_JIT:
        folder = "into_caller" if into_caller else "apart"
        inner = _jit(function, folder, forceinline=into_caller, no_cpython_wrapper=True, no_cfunc_wrapper=True)
        kernel.get_call_template, kernel.get_overload = inner.get_call_template, inner.get_overload
    return cast(Kernel, kernel)


def compiled(function: Kernel) -> Kernel:
    """Compile `function` with Numba, cached on disk by the content of the project's sources."""
    return _kernel(function, into_caller=False)


def inlined(function: Kernel) -> Kernel:
    """Compile `function` as `compiled` does, and put it into its callers: for what nearly every sample of a loop runs.

    A state of many fields is copied at each call; within one function it stays in registers.
    """
    return _kernel(function, into_caller=True)


def by_type(declaration: Callable) -> ByType:
    """Return a function that calls the variant registered for the class of its first argument.

    `declaration` gives the name and the docstring; its body is never run. Variants are added with
    `@name.register(ClassOfFirstArgument)`, above `@compiled`.

    Raises:
        TypeError: if a call's first argument is of a class that has no variant.
    """
    variants: dict[type, Callable] = {}

    @functools.wraps(declaration)
    def call(first, *rest):
        variant = variants.get(type(first))
        if variant is None:
            raise TypeError(f"{declaration.__name__} has no variant for {type(first).__name__}")
        return variant(first, *rest)

    class Choice(AbstractTemplate):
        """The type of `call` in compiled code: a call of it is a direct call of the variant."""

        key = call

        def generic(self, args: tuple, kws: dict) -> Any:
            kind = getattr(args[0], "instance_class", None) if args and not kws else None
            variant = variants.get(kind) if kind else None
            if variant is None:
                return None
            self._variant = types.Dispatcher(cast(Any, variant))
            return self._variant.get_call_type(self.context, args, kws)

        def get_impl_key(self, sig: Any) -> Any:
            return self._variant.get_impl_key(sig)

    infer_global(call, types.Function(Choice))

    def register(kind: type) -> Callable:
        # The names of compiled functions contain the names of their arguments' classes, without the module: two
        # classes of the same name with the same fields would run each other's code.
        kind.__name__ = f"{kind.__module__}.{kind.__qualname__}"

        def add(variant: Callable) -> Callable:
            provenance.chooses(kind, variant)
            variants[kind] = variant
            return variant

        return add

    call.register = register  # type: ignore[attr-defined]
    return cast(ByType, call)
