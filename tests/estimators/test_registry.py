"""The lists of estimators of hardware and model have the same names, and no other name is known."""

import pytest

from hardwall.hdl.estimators import registry as hardware
from hardwall.model.estimators import registry


def test_both_sides_have_the_same_names():
    assert list(hardware.ESTIMATORS) == list(registry.ESTIMATORS)


def test_every_design_has_one_name():
    assert [registry.design_of(name).name for name in registry.ESTIMATORS] == list(registry.ESTIMATORS)


@pytest.mark.parametrize("name", ["", "Levant", "hardwall", 3])
def test_an_unknown_name_is_refused(name):
    with pytest.raises(ValueError, match=f"^estimator must be one of {', '.join(registry.ESTIMATORS)}, not {name!r}$"):
        registry.design_of(name)
