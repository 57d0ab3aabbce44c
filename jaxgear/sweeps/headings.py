"""Headings of CSV files that spreadsheets show and do not calculate.

A text that begins like a formula gets an apostrophe in front, which spreadsheets take for "this is text"; who reads the
file again leaves it out.
"""

_FORMULA = ("=", "+", "-", "@", "\t", "\r")
_TEXT = "'"


def as_text(heading: str) -> str:
    """A heading that no spreadsheet takes for a formula."""
    return f"{_TEXT}{heading}" if heading.startswith(_FORMULA) else heading


def from_text(heading: str) -> str:
    """What `as_text` was given."""
    plain = heading.removeprefix(_TEXT)
    return plain if plain.startswith(_FORMULA) else heading
