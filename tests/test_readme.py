"""The README keeps its promises: its snippets run and its commands are the ones that CI runs."""

import re
from pathlib import Path

import pytest
from snippets import run

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_snippets_run_as_printed(tmp_path, monkeypatch, clean_figures, capsys, optimized):
    """The first is the script; the others go on from it."""
    monkeypatch.chdir(tmp_path)
    rest = run(ROOT / "README.md")
    names = next(rest)
    assert capsys.readouterr().out.count(", converged") == 3
    assert names["best"].ppte < 0.25 * float(names["jg"].peak_to_peak(names["unmodified"].transmission_error))
    assert [*rest]


def test_both_commands_stand_in_it():
    assert (
        "python -m venv .venv && .venv/bin/pip install . && .venv/bin/jaxgear optimize examples/spur_19_48.toml"
        in README
    )
    assert "python -m venv .venv && .venv/bin/pip install -e '.[test]' && .venv/bin/pytest" in README


def test_files_it_names_exist():
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        if not target.startswith("http"):
            assert (ROOT / target).exists(), target
