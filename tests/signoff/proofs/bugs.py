"""Bugs that are put into a copy of a block's code, so that its proof is seen to fail."""

import inspect
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass


@dataclass(frozen=True)
class Bug:
    """A change of the text of one function of the hardware.

    Attributes:
        function: the function, mostly the `elaborate` of a block.
        right: a part of its source, which occurs once.
        wrong: what stands in its place.
        sooner: other changes: no bugs, but it shows sooner with them.
    """

    function: Callable
    right: str
    wrong: str
    sooner: tuple["Bug", ...] = ()

    def __str__(self) -> str:
        return f"{self.wrong or 'nothing'} for {self.right}"

    @contextmanager
    def seeded(self) -> Iterator[None]:
        """Let the functions have the changes inside the context; their sources are not touched.

        Raises:
            ValueError: if a source does not have a part exactly once.
        """
        sources: dict[Callable, str] = {}
        for each in (self, *self.sooner):
            function, right = each.function, each.right
            source = sources.setdefault(function, textwrap.dedent(inspect.getsource(function)))
            if source.count(right) != 1:
                raise ValueError(f"{function.__qualname__} must have {right!r} once, not {source.count(right)}")
            sources[function] = source.replace(right, each.wrong)
        before = {function: function.__code__ for function in sources}
        try:
            for function, source in sources.items():
                function.__code__ = _code(source, before[function])
            yield
        finally:
            for function, code in before.items():
                function.__code__ = code


def _code(source: str, before):
    """Return the code of a function's source, with the closure, the name and the lines of the code that it replaces."""
    # In a class `super()` compiles as in a method, and variables of the closure are those of the function around it.
    cells = [name for name in before.co_freevars if name != "__class__"]
    around = f"def around({', '.join(cells)}):\n    class Owner:\n{textwrap.indent(source, ' ' * 8)}"
    names = {}
    exec(compile("\n" * (before.co_firstlineno - 3) + around, before.co_filename, "exec"), names)
    (code,) = _named(names["around"].__code__, before.co_name)
    return code


def _named(code, name: str) -> list:
    """Return the codes of a name inside a code."""
    inner = [each for each in code.co_consts if inspect.iscode(each)]
    return [each for each in inner if each.co_name == name] or [found for each in inner for found in _named(each, name)]
