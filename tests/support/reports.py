"""The reports that commands print as JSON, held to the schema that is installed with them."""

import json
from importlib.resources import files
from typing import Any, NoReturn

from jsonschema import Draft202012Validator

SCHEMA = json.loads(files("hardwall.cli").joinpath("reports.schema.json").read_text(encoding="utf-8"))


def check(command: str, report: Any) -> None:
    """Assert that a report is an object that the schema of its command describes, and that JSON can hold it."""
    text = json.dumps(report, allow_nan=False)
    schema = {"$ref": f"#/$defs/{command}", "$defs": SCHEMA["$defs"]}
    errors = sorted(Draft202012Validator(schema).iter_errors(json.loads(text)), key=lambda error: list(error.path))
    assert not errors, "\n".join(f"{command}: {error.json_path}: {error.message[:300]}" for error in errors)


LINES = ("watch",)
"""The commands that print an object a line."""


def check_text(command: str, text: str) -> None:
    """Assert that a text is one JSON object, without NaN or infinity, that the schema of its command describes.

    Of a command in `LINES` every line is one.
    """

    def refuse(constant: str) -> NoReturn:
        raise AssertionError(f"{command}: {constant} is not JSON")

    for each in text.splitlines() if command in LINES else [text]:
        check(command, json.loads(each, parse_constant=refuse))
