"""Calls of a C function by its address, from compiled code and from plain Python alike.

Numba can call a ctypes function only as a global. This ties the compiled code to one address and keeps it out of the
disk cache. An address as an argument has neither drawback.
"""

import ctypes

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

ARGUMENTS = 5
_FUNCTION = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_int64] * ARGUMENTS)


def call(address, a, b, c, d, e):
    """Return the result of the C function `int64_t f(int64_t, ... five in all)` at `address`."""
    return _FUNCTION(int(address))(int(a), int(b), int(c), int(d), int(e))


@intrinsic
def _call(typing_context, address, a, b, c, d, e):
    def generate(context, builder, signature, arguments):
        word = ir.IntType(64)
        function = builder.inttoptr(arguments[0], ir.FunctionType(word, [word] * ARGUMENTS).as_pointer())
        return builder.call(function, arguments[1:])

    return types.int64(*[types.int64] * (ARGUMENTS + 1)), generate


@overload(call)
def _compiled_call(address, a, b, c, d, e):
    def body(address, a, b, c, d, e):
        return _call(address, a, b, c, d, e)

    return body
