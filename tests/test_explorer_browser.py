"""The page in a real browser: what is dragged is what is computed, saved and read again."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from commands import FREE

import jaxgear as jg
from jaxgear.io import load_design

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium: apt-get install chromium")
playwright = pytest.importorskip("playwright.sync_api")

TOKEN = "of-a-test-that-knows-it"
DESIGN = FREE.replace("length = 5.0", 'length = "run_out"', 1)
DESIGN = DESIGN.replace("[variables]", '[variables]\nrun_out = { low = 1.0, high = 5.5, unit = "mm", value = 4.0 }')
READY = 300_000  # ms


class Server:
    """The command `explore` in a process of its own."""

    def __init__(self, path: Path, port: int = 0) -> None:
        environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
            "XDG_CACHE_HOME": str(path.parent / "cache"),  # the next start finds its programs there
        }
        command = [sys.executable, "-m", "jaxgear", "explore", path.name, "--no-browser", "--token", TOKEN]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        self.process = subprocess.Popen([*command, "--port", str(port)], cwd=path.parent, env=environment, **pipes)
        self.link = self.process.stdout.readline().strip()
        self.port = int(re.search(r":(\d+)/", self.link)[1])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        with self.process:
            self.process.kill()

    def end(self, number=signal.SIGKILL) -> tuple[int, str]:
        """Return code and errors."""
        self.process.send_signal(number)
        _, errors = self.process.communicate(timeout=30)
        return self.process.returncode, errors

    @property
    def memory(self) -> float:
        """Resident memory [MB]."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s+(\d+)", status)[1]) / 1024


@pytest.fixture
def path(tmp_path):
    (tmp_path / "pair.toml").write_text(DESIGN)
    return tmp_path / "pair.toml"


@pytest.fixture
def browser():
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


def opened(browser, link, **size):
    """The page, ready, and the errors of its scripts."""
    shown = browser.new_page(viewport=size or {"width": 1280, "height": 720})
    errors = []
    shown.on("pageerror", lambda error: errors.append(str(error)))
    shown.on("console", lambda message: message.type == "error" and errors.append(message.text))
    shown.goto(link)
    at_rest(shown)
    return shown, errors


def at_rest(shown):
    shown.wait_for_selector("body[data-grid=rest]:not(.moving)", timeout=READY)


def value(shown, quantity):
    return float(shown.locator(f"[data-quantity={quantity}]").get_attribute("data-value"))


def states(shown):
    return shown.evaluate("() => window.jaxgear.values")


def drag(shown, locator, by):
    box = locator.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    shown.mouse.move(x, y)
    shown.mouse.down()
    shown.mouse.move(x + by[0], y + by[1], steps=6)
    shown.mouse.up()


def until(shown, script):
    """Wait for a condition of the page without evaluating texts in it, which its policy forbids."""
    for _ in range(READY // 100):
        if shown.evaluate(f"() => Boolean({script})"):
            return
        shown.wait_for_timeout(100)
    raise AssertionError(script)


def ppte_of(path, values):
    """PPTE by `solve` on the grid of the page at rest [um]."""
    fine = path.parent / "fine" / path.name
    fine.parent.mkdir(exist_ok=True)
    fine.write_text(path.read_text().replace("positions = 16", "positions = 512"))
    design = load_design(fine)
    pinion, wheel = design.design({name: values[name] for name in design.bounds})
    cycle = jg.solve(design.mesh(), values["torque"], pinion=pinion, wheel=wheel)
    return float(jg.peak_to_peak(cycle.transmission_error))


@pytest.mark.slow
def test_dragged_optimized_saved_and_read_again(path, browser):
    with Server(path) as server:
        shown, errors = opened(browser, server.link)
        assert value(shown, "ppte") == pytest.approx(ppte_of(path, states(shown)), abs=1e-6)
        before = states(shown)
        # a slider, with the keyboard; then both points of the relief, with the mouse
        shown.locator("[data-slider=height] input[type=range]").focus()
        for _ in range(5):
            shown.keyboard.press("ArrowRight")
        at_rest(shown)
        drag(shown, shown.locator("[data-chart=pinion] [data-id=tip]"), (0, -30))
        at_rest(shown)
        drag(shown, shown.locator("[data-chart=pinion] [data-id=start]"), (-15, 0))
        at_rest(shown)
        values = states(shown)
        assert values["height"] < before["height"] and values["run_out"] > before["run_out"] + 0.1
        assert value(shown, "ppte") == pytest.approx(ppte_of(path, values), abs=1e-6)
        shown.click("#undo")
        assert states(shown)["run_out"] == before["run_out"]
        shown.click("#redo")
        assert states(shown) == values
        at_rest(shown)
        shown.click("#pin")
        pinned = value(shown, "ppte")
        shown.click("#optimize")
        until(shown, "window.jaxgear.optima")
        at_rest(shown)
        best = value(shown, "ppte")
        assert best < pinned and best == pytest.approx(ppte_of(path, states(shown)), abs=1e-6)
        delta = shown.locator("[data-quantity=ppte] .delta").inner_text()
        assert float(delta.replace("\N{MINUS SIGN}", "-")) == pytest.approx(best - pinned, abs=6e-4)
        # the link restores the state in a second window
        again, more = opened(browser, f"{server.link}#{shown.url.partition('#')[2]}", width=900, height=1100)
        assert value(again, "ppte") == pytest.approx(best, abs=1e-6)
        shown.fill("#name", "quiet")
        shown.click("#save")
        shown.wait_for_selector("text=written: quiet.toml, quiet.csv")
        saved = load_design(path.with_name("quiet.toml"))
        assert ppte_of(path.with_name("quiet.toml"), {**saved.values, "torque": saved.torque}) == pytest.approx(
            best, abs=1e-6
        )
        assert (errors, more) == ([], [])
        code, said = server.end(signal.SIGINT)
        assert code == 130 and said.endswith("jaxgear: interrupted, the page is closed, saved files are complete\n")
        # the page says so, and goes on when the server is there again
        shown.wait_for_selector("text=The server has ended or cannot be reached; trying again.")
    with Server(path, server.port):
        until(shown, "document.getElementById('message').hidden && !window.jaxgear.waiting")
        shown.locator("[data-slider=height] input[type=range]").focus()
        shown.keyboard.press("ArrowRight")
        at_rest(shown)
        assert value(shown, "ppte") == pytest.approx(ppte_of(path, states(shown)), abs=1e-6)


@pytest.mark.slow
def test_ten_thousand_movements_leave_memory_and_the_last_one_shown(path, browser):
    with Server(path) as server:
        shown, errors = opened(browser, server.link)
        move = """(count) => new Promise((done) => {
            const sliders = [...document.querySelectorAll('.slider input[type=range]')];
            let left = count;
            const next = () => {
                const slider = sliders[Math.floor(Math.random() * sliders.length)];
                slider.value = Number(slider.min) + Math.random() * (slider.max - slider.min);
                slider.dispatchEvent(new Event('input', { bubbles: true }));
                if (--left) setTimeout(next, 4); else done();
            };
            next();
        })"""
        shown.evaluate(move, 1000)
        at_rest(shown)
        held = server.memory, shown.evaluate("() => performance.memory.usedJSHeapSize") / 2**20
        shown.evaluate(move, 9000)
        at_rest(shown)
        after = server.memory, shown.evaluate("() => performance.memory.usedJSHeapSize") / 2**20
        assert after[0] < 1.05 * held[0] + 20 and after[1] < held[1] + 60
        time.sleep(1.0)
        assert value(shown, "ppte") == pytest.approx(ppte_of(path, states(shown)), abs=1e-6)
        number = shown.locator("[data-slider=height] input[type=number]").input_value()
        assert float(number) == pytest.approx(states(shown)["height"], rel=1e-4) and errors == []
