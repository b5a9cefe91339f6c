"""The error for invalid input, and the one line that is printed of any error."""


def one_line(message: str) -> str:
    """Return a message with its line breaks and other characters that do not print escaped, as in a name of a file."""
    return "".join(letter if letter.isprintable() else letter.encode("unicode_escape").decode() for letter in message)


class BadInput(Exception):
    """Invalid input: one line that says what is wrong with it, and what is accepted."""
