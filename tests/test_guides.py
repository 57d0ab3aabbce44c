"""Guides keep their promises: every snippet runs, in the order of its page."""

import gc
import io
import re
from pathlib import Path

import matplotlib
import pytest
from snippets import run

import jaxgear as jg

matplotlib.use("Agg")

ROOT = Path(__file__).parents[1]
GUIDES = ROOT / "examples" / "guides"
PAGES = [page for page in sorted(GUIDES.glob("*.md")) if "```python" in page.read_text("utf-8")]


@pytest.fixture
def searches_stay(monkeypatch):
    """Searches end on the mesh of the page, not on one of 512 positions, as those of the README do in its test."""
    monkeypatch.setitem(jg.minimize.__kwdefaults__, "positions", None)


@pytest.mark.slow
@pytest.mark.usefixtures("room", "searches_stay", "clean_figures")
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_snippet_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert [*run(page)]
    assert not _left_open(tmp_path)


def _left_open(folder: Path) -> list[str]:
    """Its files that something still holds open: their warning would come in whichever test collects them."""
    files = [each for each in gc.get_objects() if isinstance(each, io.FileIO) and not each.closed]
    names = [each.name for each in files if isinstance(each.name, str)]
    return [name for name in names if Path(name).resolve().is_relative_to(folder.resolve())]


def test_code_of_the_guides_is_marked_as_what_it_is():
    """An indented Python snippet would not be run."""
    for page in (ROOT / "README.md", *GUIDES.glob("*.md")):
        outside = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
        assert not re.search(r"^    .*\b(import jax|jg\.|def \w+\()", outside, flags=re.MULTILINE), page.name


def test_links_of_the_guides_lead_to_files_that_are_there():
    for page in GUIDES.glob("*.md"):
        targets = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
        missing = [name for name in targets if "://" not in name and not (GUIDES / name).exists()]
        assert not missing, page.name
