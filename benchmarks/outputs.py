"""Results of every example design file, to compare two states of the code: `python -m benchmarks.outputs`.

`run FOLDER` runs each command on each file of examples/ that suits it, in its quick form, into FOLDER/FILE-COMMAND/.
`compare OLD NEW` compares two such folders and ends with exit code 1 when a number, a text or a file differs.
"""

import argparse
import csv
import json
import math
import os
import re
import subprocess
import sys
import time
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet as parquet

EXAMPLES = Path(__file__).parent.parent / "examples"
# Names of OLD by their names in NEW, in keys, columns and file names. A name matches between two non-word characters.
RENAMES: dict[str, str] = {}
TOLERANCE = 1e-9  # relative
FLOOR = 1e-12  # absolute: rounding errors in place of zeros
_UNLIKE = re.compile(r"\b(versions|time_s|seconds|command)\b")  # keys
_PASSING = re.compile(r"\d s\b|computing time|^file = \"/|\bversion\b|applicationVersion|jaxgear \d")  # lines of text
_COMPARED = (".json", ".csv", ".parquet", ".toml", ".rexs", ".txt")
_NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")

# By command: the tables of a design file of which one suits it, True where all variables need values, further words.
COMMANDS: dict[str, tuple[tuple[str, ...], bool, tuple[str, ...]]] = {
    "analyze": ((), True, ("--no-figures",)),
    "optimize": (("variables", "optimize"), False, ("--quick", "--no-figures")),
    "sweep": (("sweep",), False, ("--quick", "--no-figures")),
    "dynamics": (("dynamics",), False, ("--quick", "--no-figures")),
    "export": ((), True, ("--quick", "--no-figures")),
    "layout": (("layout",), False, ("--quick", "--no-figures")),
    "revolution": (("teeth",), False, ("--quick", "--no-figures")),
    "wear": (("wear",), False, ("--quick", "--no-figures")),
    "identify": (("variables",), False, ("--quick", "--no-figures", "--noise", "0.1")),
    "convert": ((), True, ()),
}


def runs() -> Iterator[tuple[Path, str]]:
    """Each design file with each command that suits it."""
    for file in sorted(EXAMPLES.glob("*.toml")):
        tables = tomllib.loads(file.read_text(encoding="utf-8"))
        for command, (needed, _, _) in COMMANDS.items():
            suits = not needed or any(name in tables for name in needed)
            if suits and (command != "identify" or measured(file).exists()):
                yield file, command


def measured(file: Path) -> Path:
    """Measured transmission error beside spur_Z1_Z2.toml; a missing file for other design files."""
    return file.with_name(file.name.replace("spur", "identify")).with_suffix(".csv")


def with_values(text: str) -> str:
    """A design file whose variables have the middle of their range as value."""

    def middle(match: re.Match[str]) -> str:
        low, high = float(match[2]), float(match[3])
        return f"{match[1]}, value = {(low + high) / 2}"

    return re.sub(r"(^\w+ = \{ low = ([-\d.]+), high = ([-\d.]+))", middle, text, flags=re.MULTILINE)


def run(folder: Path, words: list[str], limit: float) -> int:
    """Run all commands whose folder name contains one of the words; returns the number of failed ones."""
    chosen = [(file, command, folder / f"{file.stem}-{command}") for file, command in runs()]
    chosen = [one for one in chosen if not words or any(word in one[2].name for word in words)]
    failed = []
    for number, (file, command, target) in enumerate(chosen, 1):
        began = time.perf_counter()
        problem = _run(file, command, target, limit)
        failed += [f"{target.name}: {problem}"] if problem else []
        took = f"{time.perf_counter() - began:.0f} s"
        print(f"{number}/{len(chosen)} {target.name}: {took} {problem}", flush=True)
    print(*[f"failed: {one}" for one in failed], sep="\n")
    return len(failed)


def _run(file: Path, command: str, target: Path, limit: float) -> str:
    """Run one command in a process of its own; returns its error, "" for none."""
    if target.exists():
        return "the folder exists, left as it is"
    target.mkdir(parents=True)
    _, valued, further = COMMANDS[command]
    if valued:
        text = with_values(file.read_text(encoding="utf-8")).replace('file = "', f'file = "{EXAMPLES}/')
        file = target / file.name
        file.write_text(text, encoding="utf-8")
    lines = [[command, str(file), "--output", str(target / "results"), *further]]
    if command == "identify":
        lines[0].insert(2, str(measured(file)))
    if command == "convert":
        rexs = target / "pair.rexs"
        lines = [["convert", str(file), str(rexs)], ["convert", str(rexs), str(target / "pair.toml")]]
    for line in lines:
        try:
            done = subprocess.run(
                [sys.executable, "-m", "jaxgear", *line], capture_output=True, text=True, timeout=limit, check=False
            )
        except subprocess.TimeoutExpired:
            return f"takes more than {limit:g} s"
        error = (done.stderr.strip().splitlines() or [""])[-1] if done.returncode == 2 else ""
        said = {"code": done.returncode, "error": error.replace(str(target), "").replace(str(EXAMPLES), "")}
        (target / f"end_of_{line[0]}.json").write_text(json.dumps(said), encoding="utf-8")
        with (target / "terminal.txt").open("a", encoding="utf-8") as terminal:
            terminal.write(done.stdout.replace(str(target), "").replace(str(EXAMPLES), ""))
        if error:
            return error
    return ""


def compare(old: Path, new: Path) -> int:
    """Print the differences of two folders of results; returns their number."""
    differences = 0
    folders = sorted(path.name for path in old.iterdir() if list(path.glob("end_of_*")))
    for name in folders:
        before = {_renamed(key): value for key, value in _values(old / name)}
        after = dict(_values(new / name))
        for key in {**before, **after}:
            if _UNLIKE.search(key):
                continue
            one, other = before.get(key, "missing"), after.get(key, "missing")
            if not _alike(one, other):
                differences += 1
                print(f"{name}/{key}: {_shown(one)} -> {_shown(other)}")
    print(f"{len(folders)} folders, {differences} differences")
    return differences


def _values(folder: Path) -> Iterator[tuple[str, Any]]:
    """Numbers and texts of all files of a folder by file and key."""
    for path in sorted(folder.rglob("*")):
        if path.suffix in _COMPARED and not any(part.startswith(".") for part in path.relative_to(folder).parts):
            name = re.sub(r"-[0-9a-f]{16}(?=\.parquet)", "", str(path.relative_to(folder)))  # a digest of the code too
            yield from ((f"{name}: {key}", value) for key, value in _of_file(path))


def _of_file(path: Path) -> Iterator[tuple[str, Any]]:
    if path.suffix == ".parquet":
        yield from _flat(parquet.read_table(path).to_pydict())
        return
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".json":
        yield from _flat(json.loads(text))
    elif path.suffix == ".csv":
        lines = text.splitlines()
        yield from ((f"comment {number}", line) for number, line in enumerate(lines) if line.startswith("#"))
        titles, *rows = list(csv.reader(line for line in lines if not line.startswith("#"))) or [[]]
        for number, row in enumerate(rows, 1):
            yield from ((f"{title}[{number}]", cell) for title, cell in zip(titles, row, strict=False))
    else:
        seen: Counter[str] = Counter()  # a line is known by its words, so that further lines do not shift the others
        for line in (" ".join(line.split()) for line in text.splitlines()):
            if not _PASSING.search(line):
                words = _NUMBER.sub("#", line)
                seen[words] += 1
                yield f"{words} [{seen[words]}]", line


def _flat(data: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else None
    if items is None:
        yield key, data
        return
    for name, value in items:
        yield from _flat(value, f"{key}.{name}" if key else str(name))


def _renamed(key: str) -> str:
    for old, new in RENAMES.items():
        key = re.sub(rf"(?<!\w){re.escape(old)}(?!\w)", new, key)
    return key


def _alike(one: Any, other: Any) -> bool:
    """True if two values agree to the tolerance, texts number by number."""
    if isinstance(one, str) and isinstance(other, str):
        numbers = _NUMBER.findall(one), _NUMBER.findall(other)
        same = _NUMBER.sub("#", one) == _NUMBER.sub("#", other)
        return same and all(map(_alike, map(float, numbers[0]), map(float, numbers[1])))
    if isinstance(one, int | float) and isinstance(other, int | float):
        if not (math.isfinite(one) and math.isfinite(other)):
            return str(one) == str(other)
        return math.isclose(one, other, rel_tol=TOLERANCE, abs_tol=FLOOR)
    return bool(one == other)


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 100 else f"{text[:97]}..."


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.outputs", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    running = commands.add_parser("run")
    running.add_argument("folder", type=Path)
    running.add_argument("words", nargs="*", help="run those whose folder name contains one of the words")
    running.add_argument("--limit", type=float, default=90.0, help="seconds that a command may take")
    comparing = commands.add_parser("compare")
    comparing.add_argument("old", type=Path)
    comparing.add_argument("new", type=Path)
    given = parser.parse_args()
    if given.command == "compare":
        return int(compare(given.old, given.new) > 0)
    os.environ.setdefault("MPLBACKEND", "Agg")
    return int(run(given.folder.absolute(), given.words, given.limit) > 0)


if __name__ == "__main__":
    sys.exit(main())
