"""The Python snippets of a page of Markdown, run as its readers do."""

import re
from pathlib import Path

import jax


def snippets(page: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)


def run(page: Path):
    """Runs the snippets of a page one after the other; yields their names after each."""
    names: dict = {}
    # what readers run has JAX's own rules of promotion
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        for number, snippet in enumerate(snippets(page), 1):
            exec(compile(snippet, f"{page.name}, snippet {number}", "exec"), names)
            yield names
