"""The prose of a page: its sentences, without code, tables, headings and links' addresses; and what style forbids."""

import re

NOT_PROSE = re.compile(
    r"^```.*?^```$|^:::.*?^:::$|^\|.*?$|^#+ .*?$|^%.*?$|^!\[.*?$|^\{\..*?\}$|<!--.*?-->|^\(\S+\)=$|\$\$.*?\$\$",
    re.MULTILINE | re.DOTALL,
)
CODE = re.compile(r"(\{\w+\})?`[^`]*`")
NUMBER = re.compile(r"(?<![\w.])\d[\d ]*(?:[.,]\d+)?(?:e[+-]?\d+)?")
END = re.compile(r"(?<=[.!?:])[\"')*]*\s+(?=[A-Z`\"(*\[])|\n\s*\n|\n(?=\s*(?:[-*]|\d+\.) )")
BANNED = {
    "a chain of pronouns": re.compile(
        r"\b(of which|for which|that of|those of|that which|one of these of|the former|the latter|what is of)\b", re.I
    ),
    "a comparison with 'for'": re.compile(r"\d[\d.,]*(?: ?[\w/²]+)? for \d"),
    "history": re.compile(r"\b(until now|used to be|before this|not any more|no longer|formerly)\b", re.I),
}
"""Forms that a reader has to read twice, and what belongs into the changelog."""


def sentences(text: str) -> list[str]:
    """Return the sentences of a page in Markdown; code in them is one word, and a link its text."""
    prose = NOT_PROSE.sub("\n\n", text)
    prose = CODE.sub("code", prose)
    prose = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", prose)
    found = (" ".join(each.split()).lstrip("-*> ").strip() for each in END.split(prose))
    return [each for each in found if re.search(r"[A-Za-z]{2}", each)]


def words(text: str) -> list[str]:
    """Return the words of a sentence."""
    return re.findall(r"[\w'/-]*[A-Za-z0-9][\w'/-]*", text)


def numbers(sentence: str) -> list[str]:
    """Return the numbers of a sentence."""
    return NUMBER.findall(sentence)


def faults(sentence: str) -> list[str]:
    """Return what style forbids in a sentence."""
    return [name for name, pattern in BANNED.items() if pattern.search(sentence)]
