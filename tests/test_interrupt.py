"""Ctrl-C at any moment: it always ends the command, without a traceback, and what is said of the files is true."""

import os
import random
import re
import signal
import subprocess
import sys
import time

import pytest
from commands import FIXED, call

from jaxgear.cli import interrupt, launcher, terminal
from jaxgear.io import folder
from jaxgear.io.folder import result_folder
from jaxgear.studies import AbstractStudyResult
from jaxgear.studies.analysis import ComparisonRun

pytestmark = pytest.mark.usefixtures("no_cache")

NOTHING = "jaxgear: interrupted, nothing was written\n"
DYNAMICS = """
[dynamics]
mesh_frequencies = [500.0, 1000.0]
damping_ratio = 0.05
"""
# raises the signal when a module is asked for
AT_IMPORT = """
import os, runpy, signal, sys
class Finder:
    def find_spec(self, name, *_):
        if name == {moment!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
sys.argv = ["jaxgear", "analyze", "gear.toml"]
runpy.run_path({launcher!r}, run_name="__main__")
"""


@pytest.fixture
def gear(tmp_path):
    (tmp_path / "gear.toml").write_text(FIXED)
    return tmp_path / "gear.toml"


def environment():
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


@pytest.mark.parametrize("moment", ["jaxgear", "numpy", "equinox", "jaxgear.cli.app"])
def test_during_the_imports(gear, moment):
    code = AT_IMPORT.format(moment=moment, launcher=launcher.__file__)
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=gear.parent, env=environment(), capture_output=True, text=True
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", NOTHING)
    assert [path.name for path in gear.parent.iterdir()] == ["gear.toml"]


class Lost:
    """Has Ctrl-C pressed where Python cannot raise."""

    def __del__(self):
        signal.raise_signal(signal.SIGINT)


def test_where_python_loses_it(capfd):
    with pytest.raises(KeyboardInterrupt), interrupt.listening():
        kept = Lost()
        del kept
        for _ in range(1000):
            time.sleep(0.001)
    assert capfd.readouterr().err == ""


class Nothing(AbstractStudyResult):
    """What a study has found that was kept from its work."""

    def summary(self):
        return {}


@pytest.mark.parametrize("made_of_it", [None, RuntimeError("INTERNAL: KeyboardInterrupt"), TypeError("?")])
def test_what_a_library_makes_of_it_does_not_matter(gear, tmp_path, monkeypatch, made_of_it):
    def evaluate(*_):
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            if made_of_it is not None:
                raise made_of_it from None

    monkeypatch.setattr(ComparisonRun, "prepare", lambda self, **_: None)
    monkeypatch.setattr(ComparisonRun, "evaluate", evaluate)
    monkeypatch.setattr(ComparisonRun, "result", lambda *_: Nothing())
    result = call("analyze", gear, "-o", tmp_path / "out")
    assert (result.code, result.err) == (130, NOTHING)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("late", ["replace", "say"])
def test_results_that_are_there_are_not_denied(gear, tmp_path, monkeypatch, late):
    def press(*arguments):
        if late == "replace" or any("results in" in line for line in arguments):  # not while the verdict is printed
            signal.raise_signal(signal.SIGINT)
        return original(*arguments)

    monkeypatch.setattr(ComparisonRun, "prepare", lambda self, **_: None)
    monkeypatch.setattr(ComparisonRun, "evaluate", lambda *_: None)
    monkeypatch.setattr(ComparisonRun, "result", lambda *_: Nothing())
    module, name = (folder, "_replace") if late == "replace" else (terminal, "say")
    original = getattr(module, name)
    monkeypatch.setattr(module, name, press)
    result = call("analyze", gear, "-o", tmp_path / "out", "--no-figures")
    told = f"jaxgear: writing the results\njaxgear: interrupted, the results are in {tmp_path / 'out'}{os.sep}\n"
    assert (result.code, result.err) == (130, told)
    assert (tmp_path / "out" / "summary.json").exists()


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="other systems have no SIGINT for one process")
def test_at_any_moment(gear):
    moments = random.Random(3)
    for _ in range(4):
        for path in (gear.parent / "out").glob("*"):
            path.unlink()
        command = [sys.executable, launcher.__file__, "analyze", "gear.toml", "-o", "out", "--no-figures"]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        process = subprocess.Popen(command, cwd=gear.parent, env=environment(), **pipes)
        time.sleep(moments.uniform(0.2, 12.0))
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=120)
        there = (gear.parent / "out" / "summary.json").exists()
        assert "Traceback" not in err and process.returncode == (130 if "interrupted" in err else 0), err
        assert there == (NOTHING not in err), err
        assert {path.name for path in gear.parent.iterdir()} <= {"gear.toml", "out"}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_leaves_no_folder_behind(gear, tmp_path, monkeypatch, number):
    monkeypatch.setattr(ComparisonRun, "prepare", lambda self, **_: signal.raise_signal(number))
    before = signal.getsignal(signal.SIGTERM)
    result = call("analyze", gear, "-o", tmp_path / "out")
    assert (result.code, result.err) == (130, NOTHING)
    assert [path.name for path in tmp_path.iterdir()] == ["gear.toml"]
    assert signal.getsignal(signal.SIGTERM) == before
    assert not interrupt.state.requested  # it would end the next command of the same program


@pytest.mark.skipif(os.name != "posix", reason="other systems cannot be asked whether a process runs")
def test_what_a_killed_process_left_is_removed_by_the_next_of_the_same_name(tmp_path):
    """Its own folders alone, and no earlier result that was being replaced while there is no other."""
    make = "import os, signal, sys; from pathlib import Path; from jaxgear.io.folder import result_folder as f\n"
    kill = "with f(Path('out')) as made: (made / 'half').touch(); os.kill(os.getpid(), signal.SIGKILL)"
    subprocess.run([sys.executable, "-c", make + kill], cwd=tmp_path, env=environment(), check=False)
    (left,) = tmp_path.iterdir()
    assert left.name.startswith(".out.") and left.name.endswith(".tmp")
    earlier = tmp_path / f"{left.name}.earlier"
    alive = tmp_path / re.sub(r"-\d+\.", f"-{os.getpid()}.", left.name)
    others = [earlier, alive, tmp_path / ".out.tmp", tmp_path / left.name.replace(".out.", ".other.")]
    for path in others:
        path.mkdir()
    with result_folder(tmp_path / "out"):
        assert not left.exists() and all(path.exists() for path in others)
    with result_folder(tmp_path / "out"):
        assert not earlier.exists()


def test_kept_runs_are_told_of_before_the_first_result(tmp_path, monkeypatch):
    kept = tmp_path / ".out.runs"
    kept.mkdir()
    (kept / "0123").touch()
    (tmp_path / "gear.toml").write_text(FIXED + DYNAMICS)
    monkeypatch.setattr("jaxgear.studies.dynamics.compared", lambda *_, **__: signal.raise_signal(signal.SIGINT))
    result = call("dynamics", tmp_path / "gear.toml", "-o", tmp_path / "out", "--quick")
    line = f"jaxgear: interrupted, 1 runs are stored in {kept}{os.sep}, resume with the same command\n"
    assert result.code == 130 and result.err.endswith(line)
