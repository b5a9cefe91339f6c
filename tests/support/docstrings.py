"""The prose of docstrings: their sentences, without code, equations, tables and the names of arguments."""

import ast
import inspect
import re
from collections.abc import Iterator
from pathlib import Path

from .prose import CODE

END = re.compile(r"(?<=[.!?;:])(?<!e\.g\.)(?<!i\.e\.)[\"')*]*\s+")
"""The end of a sentence or of a part of it; the next one may begin with a symbol in lower case."""
HEAD = re.compile(r"[A-Z][\w ]*:\n|[A-Z][^\n]*\n-+\n")
"""The head of a section: `Args:`, or underlined."""
ITEM = re.compile(r"\s*(?:[-*] |\d+\. |[`*\w.]+(?:, [`*\w.]+)*(?: \([^)]*\))?: )")
"""What is before the text of an item of a section: its mark, or its names."""


def of(path: Path) -> Iterator[str]:
    """Yield the docstrings of a source, also those below assignments."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        body = getattr(node, "body", None)
        for statement in body if isinstance(body, list) else ():
            value = getattr(statement, "value", None)
            if isinstance(statement, ast.Expr) and isinstance(value, ast.Constant) and isinstance(value.value, str):
                yield inspect.cleandoc(value.value)


def sentences(docstring: str) -> list[str]:
    """Return the sentences of a docstring, in parts at semicolons and colons; code in them is one word."""
    found = []
    for paragraph in re.split(r"\n\s*\n", docstring):
        head = HEAD.match(paragraph)
        lines = paragraph[head.end() if head else 0 :].splitlines()
        if not head and all(line.startswith("  ") for line in lines):
            continue
        text = ""
        for line in lines:
            if head and "-\n" in head[0] and not line.startswith(" "):
                text += "\n"
            elif head or re.match(r"\s*(?:[-*]|\d+\.) ", line):
                text += ITEM.sub("\n", line, count=1) if ITEM.match(line) else f" {line.strip()}"
            else:
                text += f" {line.strip()}"
        found += [part for item in text.split("\n") for part in END.split(CODE.sub("code", item).strip())]
    return [each for each in found if re.search(r"[A-Za-z]{2}", each)]
