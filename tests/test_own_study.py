"""A study of another package: a command of its own with results, report, interruption and resumption."""

import contextlib
import importlib.metadata
import json
import os
import signal
import subprocess
import sys

import pytest
from commands import FIXED, assert_refused, call
from report_page import check_report

import jaxgear
from jaxgear import studies
from jaxgear.cli import main, run
from jaxgear.io import load_design
from jaxgear.studies import registry

pytestmark = pytest.mark.usefixtures("no_cache")

# what the other package holds
SOURCE = '''
"""How much of the torque the pair has for every tooth."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jaxgear.report import Figure, Table
from jaxgear.studies import AbstractStudy, AbstractStudyResult, NamedArrays

ASKED = []  # torques that were worked out


@dataclass(frozen=True)
class ShareResult(AbstractStudyResult):
    shares: dict[float, float]
    assumptions: ClassVar = ("Every tooth carries the same.",)

    def summary(self):
        return {"share_Nm": list(self.shares.values())}

    def tables(self):
        table = Table(("torque [N m]", "share [N m]"), title="shares of the torque")
        for torque, share in self.shares.items():
            table.add_row(f"{torque:g}", f"{share:.3f}")
        yield table

    def verdict(self):
        yield f"largest share: {max(self.shares.values()):.3f} N m"

    def failures(self):
        if max(self.shares.values()) > 10:
            yield "too much for a tooth"

    def write(self, folder):
        (folder / "shares.csv").write_text("share_Nm\\n" + "".join(f"{share}\\n" for share in self.shares.values()))

    def figures(self):
        from jaxgear import plot

        with plot.figure.report_axes(None) as axes:
            axes.plot(list(self.shares), list(self.shares.values()))
        yield Figure("shares", "Shares of the torque.", axes)


@dataclass(frozen=True)
class ShareStudy(AbstractStudy[ShareResult]):
    """Share the torque among the teeth of the pinion.

    Keeps every share.

    Attributes:
        none.
    """

    name: ClassVar = "share"
    coarse: ClassVar = "one torque"

    def work_out(self, checkpoints, stages):
        torques = [self.design.torque] if self.quick else [10.0, 20.0, self.design.torque]
        kept, shares = checkpoints.of(NamedArrays(), len(torques)), {}
        for number, torque in enumerate(torques):
            stages.begin(f"sharing {torque:g} N m")
            stages.count(number, len(torques))

            def share():
                ASKED.append(torque)
                return {"share": np.asarray(torque / self.design.pair().pinion.teeth)}

            shares[torque] = float(kept((torque, self.design.text), share)["share"])
        return ShareResult(shares)
'''


@pytest.fixture
def package(tmp_path, monkeypatch):
    """The module of the other package, which is not installed: the look-up finds it all the same."""
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "shares_of_torque.py").write_text(SOURCE)
    monkeypatch.syspath_prepend(tmp_path / "site")
    entry = importlib.metadata.EntryPoint("share", "shares_of_torque:ShareStudy", "jaxgear.studies")
    known = importlib.metadata.entry_points
    monkeypatch.setattr(
        importlib.metadata, "entry_points", lambda *, group: [*known(group=group), *[entry] * (group == entry.group)]
    )
    yield lambda: importlib.import_module("shares_of_torque")
    sys.modules.pop("shares_of_torque", None)


def test_it_is_a_command_with_results_and_report(file, tmp_path, package):
    path, folder = file(FIXED + "[tolerance]\nquality_class = 7\n"), tmp_path / "out"
    for _ in range(2):  # the second run replaces what the first has written
        done = call("share", path, "-o", folder, "--report")
        assert done.code == 0, done.err
        assert {entry.name for entry in folder.iterdir()} == {
            "summary.json",
            "report.html",
            "shares.csv",
            "shares.png",
        }
    found = json.loads((folder / "summary.json").read_text())
    assert found["share_Nm"] == pytest.approx([10 / 19, 20 / 19, 50 / 19]) and found["title"] == "a [small] pair"
    assert found["quick"] is False and found["geometry"]["pinion"]["teeth"] == 19 and "jaxgear" in found["versions"]
    assert found["left_out"].startswith("[tolerance] is not part of this analysis")
    lines = done.out.splitlines()
    order = ["shares of the torque", "largest share: 2.632 N m", f"results in {folder}{os.sep}"]
    places = [next(number for number, line in enumerate(lines) if word in line) for word in order]
    assert places == sorted(places) and "[tolerance] is not part" in done.err
    assert "jaxgear: sharing 20 N m\n" in done.err and not list(tmp_path.glob(".out*"))
    page = check_report(folder, path, "share", path, "-o", folder, "--report")
    assert ["50", "2.632"] in page.rows
    assert found["contents"] == ["report.html", "shares.csv", "shares.png", "summary.json"]
    assert "Figure 1. Shares of the torque." in (folder / "report.html").read_text("utf-8")
    (folder / "notes.txt").touch()
    assert_refused(call("share", path, "-o", folder), "holds other files than results of jaxgear (notes.txt)")
    assert "Every tooth carries the same." in (folder / "report.html").read_text("utf-8")


def test_the_verdict_is_printed_before_figures_are_drawn(file, tmp_path, package, monkeypatch):
    shown = []
    monkeypatch.setattr(run, "save_figures", lambda *_: shown.append(sys.stdout.getvalue()) or {})
    done = call("share", file(FIXED), "-o", tmp_path / "out")
    assert done.code == 0 and "largest share: 2.632 N m" in shown[0] and "results in" not in shown[0]


def test_who_reads_no_verdict_has_the_files(file, tmp_path, package):
    """`jaxgear share pair.toml | head -1`"""
    reader, writer = os.pipe()
    os.close(reader)
    with open(writer, "w") as stream, contextlib.redirect_stdout(stream), pytest.raises(SystemExit) as ended:
        main(["share", str(file(FIXED)), "-o", str(tmp_path / "out"), "--no-figures"])
    assert ended.value.code == 0 and (tmp_path / "out" / "shares.csv").exists()


class Pressed(list):
    """Has Ctrl-C pressed while the second torque is worked out."""

    def append(self, torque):
        super().append(torque)
        if len(self) == 2:
            signal.raise_signal(signal.SIGINT)


def test_it_goes_on_after_an_interruption(file, tmp_path, package, monkeypatch):
    module, path, folder, kept = package(), file(FIXED), tmp_path / "out", tmp_path / ".out.runs"
    monkeypatch.setattr(module, "ASKED", Pressed())
    done = call("share", path, "-o", folder, "--no-figures")
    told = f"jaxgear: interrupted, 1 of 3 runs are stored in {kept}{os.sep}, resume with the same command\n"
    assert done.code == 130 and done.err.endswith(told) and not folder.exists()
    monkeypatch.setattr(module, "ASKED", [])
    done = call("share", path, "-o", folder, "--no-figures")
    assert done.code == 0 and module.ASKED == [20.0, 50.0] and not kept.exists()
    assert json.loads((folder / "summary.json").read_text())["share_Nm"][0] == pytest.approx(10 / 19)


def test_without_its_package_it_is_no_command(file):
    assert_refused(call("share", file(FIXED)), "No such command 'share'")


def test_a_library_and_a_command_share_what_is_kept(file, tmp_path, package):
    module, path, folder = package(), file(FIXED), tmp_path / "out"
    study = module.ShareStudy.of(load_design(path))
    stopped = studies.Checkpoints(tmp_path / ".out.runs")

    def stop(progress):
        if progress.stage == "sharing 50 N m":
            raise InterruptedError

    with pytest.raises(InterruptedError):
        study.run(checkpoints=stopped, callback=stop)
    assert module.ASKED == [10.0, 20.0] and stopped.count() == 2
    done = call("share", path, "-o", folder, "--no-figures")
    assert done.code == 0 and module.ASKED == [10.0, 20.0, 50.0]
    assert not (tmp_path / ".out.runs").exists()
    told = []
    result = study.run(callback=told.append)
    assert len(module.ASKED) == 6 and told[0] == studies.Progress("sharing 10 N m")
    assert told[-1] == studies.Progress("sharing 50 N m", 2, 3)
    assert list(result.failures()) == [] and result.findings() is None


def test_a_quick_run_and_a_failure_are_told(file, tmp_path, package):
    path = file(FIXED.replace("torque = 50.0", "torque = 380.0").replace("[30.0, 60.0]", "[30.0, 400.0]"))
    done = call("share", path, "-o", tmp_path / "out", "--quick", "--no-figures")
    assert done.code == 1 and "jaxgear: warning: too much for a tooth" in done.err
    assert "quick run, one torque: a preview, do not use for design" in done.out
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["share_Nm"] == pytest.approx([20.0])


def test_help_knows_it_without_importing_it(package):
    assert "Share the torque among the teeth of the pinion." in call("--help").out
    of_command = call("share", "--help").out
    assert "Keeps every share." in of_command and "Attributes" not in of_command and "--report" in of_command
    assert "shares_of_torque" not in sys.modules


def test_what_cannot_be_a_study_is_one_line(file, tmp_path, package, monkeypatch):
    for value, told in (
        ("no_such_package:Study", "study no_such_package:Study: cannot be imported: No module named"),
        ("shares_of_torque:Nothing", "study shares_of_torque:Nothing: cannot be imported"),
        ("shares_of_torque:ShareResult", "study shares_of_torque:ShareResult: must be a subclass of jaxgear.studies."),
    ):
        entry = importlib.metadata.EntryPoint("share", value, "jaxgear.studies")
        monkeypatch.setattr(importlib.metadata, "entry_points", lambda *, group, entry=entry: [entry])
        done = call("share", file(FIXED), "-o", tmp_path / "out")
        assert done.code == 2 and told in done.err and done.err.count("\n") == 1
        assert call("share", "--help").code == 0


def test_every_study_of_the_package_is_a_command_of_its_name():
    for name, place in registry.OWN.items():
        study = registry.load(place)
        assert study.name == name and registry.help_of(place)
    assert set(registry.OWN) >= {"dynamics", "wear"}


def test_other_packages_are_looked_for_only_where_a_name_is_unknown():
    script = (
        "import sys\n"
        "from importlib import metadata\n"
        "def refused(**_): raise AssertionError\n"
        "metadata.entry_points = refused\n"
        "from jaxgear.cli import main\n"
        "main(['wear', '--help'])\n"
    )
    path = os.path.dirname(os.path.dirname(jaxgear.__file__))
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path}
    )
    assert done.returncode == 0 and "Wear the flanks" in done.stdout, done.stderr


def test_a_library_prints_nothing_and_writes_where_it_is_asked(file, tmp_path, capsys, monkeypatch):
    """The studies of the commands are studies like any other."""
    monkeypatch.setattr("jaxgear.studies.evaluation._TORQUES", 5)
    study, stages = studies.AnalysisStudy.of(load_design(file(FIXED))), []
    result = study.run(callback=lambda progress: stages.append(progress.stage))
    assert stages == ["preparing the mesh", "solving the unmodified design", "solving the modified design"]
    data, figures = studies.write_results(tmp_path / "new" / "results", study, result, figures=False)
    assert sorted(path.name for path in (tmp_path / "new" / "results").iterdir()) == ["flanks.csv", "summary.json"]
    assert list(data["designs"]) == list(result.evaluations) == ["unmodified", "modified"] and figures == []
    assert capsys.readouterr() == ("", "") and list(result.failures()) == []
