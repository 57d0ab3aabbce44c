"""Hook of mkdocs: makes the report that the guides link to, by the command that they name.

The variable JAXGEAR_REPORT names a report.html that is there already, and spares the calculation.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from mkdocs.structure.files import File

DESIGN = "spur_19_48.toml"


def on_files(files, config):
    """Adds the report to the files of the site."""
    report = os.environ.get("JAXGEAR_REPORT")
    held = Path(report).read_text("utf-8") if report else calculated()
    files.append(File.generated(config, Path(DESIGN).with_suffix(".html").name, content=held))
    return files


def on_page_markdown(markdown, page, **_):
    """Links the report from the page that names it, where it is: in the site."""
    name = Path(DESIGN).with_suffix(".html").name
    return markdown.replace(f"`{name}`", f"[{name}]({name})") if page.file.src_uri == "reports.md" else markdown


def calculated() -> str:
    """The report of the command, which runs where the example lies."""
    examples = Path(__file__).parent
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder, "results")
        command = ("optimize", f"examples/{DESIGN}", "--report", "--output", str(results))
        subprocess.run([sys.executable, "-m", "jaxgear", *command], check=True, cwd=examples.parent)
        return (results / "report.html").read_text("utf-8")
