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
    assert {f"hardwall.{module}.{name}" for module, name in PYTHON} == set(
        re.findall(r"`(hardwall\.(?:hdl|model)[\w.]+)`", page)
    )
