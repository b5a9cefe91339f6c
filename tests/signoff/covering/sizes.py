"""The sizes in which a block's own tests simulate it: taken from its tests, without a simulation."""

from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from amaranth.lib import wiring


@dataclass(frozen=True)
class Size:
    """A component as a test simulates it.

    Attributes:
        test: the file of the test, with the cocotb tests that the simulator runs.
        make: makes the component.
        parameters: the arguments of `make`, which the simulator's side reads, too.
    """

    test: Path
    make: Callable[..., wiring.Component] = field(repr=False)
    parameters: dict[str, Any]

    @property
    def name(self) -> str:
        return ", ".join(f"{name} {value}" for name, value in self.parameters.items())

    def component(self) -> wiring.Component:
        return self.make(**self.parameters)


class Taker:
    """A plugin of pytest in whose run `simulate` only notes what it is called with.

    Attributes:
        sizes: what was noted.
    """

    def __init__(self):
        self.sizes: list[Size] = []

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Generator[None, object, object]:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(item.module, "simulate", self._note)
            return (yield)

    def _note(self, test_file: str, make: Callable[..., wiring.Component], **parameters: Any) -> None:
        self.sizes.append(Size(Path(test_file), make, parameters))


def sizes_of(test: Path) -> list[Size]:
    """Return the sizes that the tests in a file simulate, in the order of the tests.

    Raises:
        RuntimeError: if pytest cannot run them.
    """
    taker = Taker()
    ended = pytest.main(["-q", "-n", "0", "--no-header", "--no-summary", "-m", "rtl", str(test)], plugins=[taker])
    if ended or not taker.sizes:
        raise RuntimeError(f"{test.name} does not tell what it simulates: pytest ended with {ended}")
    return taker.sizes
