"""The names that keep their meaning are those that are recorded: none is missing, and a new one is recorded too."""

import re

from test_layout import ROOT

from support.promised import FILE, PYTHON, names


def test_no_promised_name_is_missing_and_every_name_is_recorded():
    recorded = FILE.read_text(encoding="utf-8").splitlines()
    now = names()
    again = "PYTHONPATH=tests .venv/bin/python -m support.promised"
    assert sorted({*recorded} - {*now}) == [], "names that *Limits* promises are gone"
    assert sorted({*now} - {*recorded}) == [], f"new names are recorded by: {again}"


def test_the_page_promises_the_names_of_python():
    page = (ROOT / "docs/reference/limits.md").read_text(encoding="utf-8")
    (listed,) = re.findall(r"^- for Python: (.*?);$", page, re.M | re.S)
    assert {f"hardwall.{module}.{name}" for module, name in PYTHON} | {"hardwall.testing"} == set(
        re.findall(r"`(hardwall\.[\w.]+)`", listed)
    )


def test_what_a_page_gives_a_caller_of_python_is_promised():
    """The reference of the Verilog names a function for those who join it to Python."""
    page = (ROOT / "docs/reference/hardware.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`(hardwall\.sim\.[\w.]+)\(", page))
    assert named == {"hardwall.sim.scene.spec"}
    assert named <= {f"hardwall.{module}.{name}" for module, name in PYTHON}
