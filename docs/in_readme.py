"""The numbers of the README's table, which `make results` takes from a report: `python docs/in_readme.py`."""

import re

import reports
import views

README = reports.TREE / "README.md"
ROW = re.compile(r"^\| `([\w-]+)` ([\w-]+) \|([^|]*)\|[^|]*\|[^|]*\|", re.MULTILINE)
RATES = 10e3, 1e6
"""The sample rates of the two columns, in Hz."""


def filled(text: str) -> str:
    """Return the README with the numbers of the report in its table.

    Raises:
        KeyError: if the report has no such estimator.
    """
    report = reports.kept("accuracy")
    rows = report.report["rows"] if report else []
    found = {(row["estimator"], row["output"], row["sample_hz"]): row["rms_mm_s"] for row in rows}

    def row(match: re.Match) -> str:
        name, output, what = match.groups()
        errors = " | ".join(views.number(found[name, output, rate]) for rate in RATES)
        return f"| `{name}` {output} |{what}| {errors} |"

    return ROW.sub(row, text)


if __name__ == "__main__":
    README.write_text(filled(README.read_text(encoding="utf-8")), encoding="utf-8")
