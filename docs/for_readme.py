"""What the README takes from reports, at the end of `make results`: the numbers of its table, and a picture of two."""

import re

import reports
from views.tables import number

from hardwall.sim.pictures.rates import draw_beside_errors
from hardwall.sim.pictures.style import save

README, PICTURE = reports.TREE / "README.md", reports.PICTURES / "rate-buys.png"
ROW = re.compile(r"^\| `([\w-]+)` ([\w-]+) \|([^|]*)\|[^|]*\|[^|]*\|", re.MULTILINE)
RATES = 10e3, 1e6
"""The sample rates of the two columns, in Hz."""
FILLED = "accuracy"
"""The report of the table."""
DRAWN = "rate-errors", "rate-stiffness"
"""The reports of the picture."""


def filled(text: str) -> str:
    """Return the README with the numbers of the report in its table.

    Raises:
        KeyError: if the report has no such estimator.
    """
    rows = reports.kept(FILLED).report["rows"]
    found = {(row["estimator"], row["output"], row["sample_hz"]): row["rms_mm_s"] for row in rows}

    def row(match: re.Match) -> str:
        name, output, what = match.groups()
        errors = " | ".join(number(found[name, output, rate]) for rate in RATES)
        return f"| `{name}` {output} |{what}| {errors} |"

    return ROW.sub(row, text)


if __name__ == "__main__":
    README.write_text(filled(README.read_text(encoding="utf-8")), encoding="utf-8")
    save(draw_beside_errors(*(reports.kept(name).report for name in DRAWN)), PICTURE)
