"""Lines and tables on the terminal, or in the file that stands for it."""

from rich.console import Console

from ..io.errors import printable
from ..report import Table

_WIDTH = 120  # of a file [characters]


def console(*, stderr: bool = False) -> Console:
    """Console without markup; a file gets a fixed width that fits the tables."""
    made = Console(stderr=stderr, markup=False, highlight=False, emoji=False)
    if not made.is_terminal:
        made.width = _WIDTH
    return made


def say_rows(block: Table) -> None:
    """Prints a table of two columns as lines under its title, which the terminal may break."""
    out, width = console(), max(len(label) for label, _ in block.rows)
    out.print(block.title, style="bold", soft_wrap=True)
    for label, text in block.rows:
        out.print(printable(f"  {label:<{width}}  {text}"), soft_wrap=True)


def say_columns(block: Table) -> None:
    """Prints a table in aligned columns, whose last one the terminal may break."""
    rows = [block.header, *block.rows]
    widths = [max(map(len, column)) for column in zip(*rows)]
    widths[-1] = 0
    say(*("  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths)) for row in rows))


def say(*lines: str) -> None:
    """Prints lines that the terminal may break."""
    for line in lines:
        console().print(printable(line), soft_wrap=True)


def warn(line: str) -> None:
    """Prints a warning on stderr."""
    console(stderr=True).print(f"jaxgear: warning: {printable(line)}", style="bold red", soft_wrap=True)
