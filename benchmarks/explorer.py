"""The page of `jaxgear explore` in a browser: time from a movement of a slider to the drawn curves.

    python -m benchmarks.explorer [--movements 200]

It needs Chromium, and playwright of the extra `test`. A movement is an event of the first slider; its time ends when
the browser has painted the answer. The time to "ready" is that of a new process with an empty cache, beside `analyze`.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright

EXAMPLES = Path(__file__).parents[1] / "examples"
TOKEN = "of-the-benchmark-that-knows-it"
# of the files: 11 coupled slices; values of the variables, so that `analyze` takes them
CASES = {
    "spur": (EXAMPLES / "spur_19_48.toml", ""),
    "helical, 11 slices": (EXAMPLES / "helical_19_48.toml", "\n[resolution]\nslices = 11\n"),
}
MOVE = """async (count) => {
    const page = window.jaxgear, slider = document.querySelector(".slider input[type=range]");
    page.timings.length = 0;
    for (let i = 0; i < count; i++) {
        const at = 0.35 + 0.3 * i / count;
        slider.value = Number(slider.min) + at * (slider.max - slider.min);
        const answered = page.timings.length;
        slider.dispatchEvent(new Event("input", { bubbles: true }));
        while (page.timings.length === answered) await new Promise((done) => setTimeout(done, 5));
    }
    return page.timings;
}"""


def text_of(source: Path, further: str) -> str:
    """Design file with a value for every variable."""
    valued = re.sub(r"\{ low = ([-\d.]+), high = ([-\d.]+)", _valued, source.read_text(encoding="utf-8"))
    return valued + further


def _valued(found: re.Match[str]) -> str:
    return f"{found[0]}, value = {0.5 * (float(found[1]) + float(found[2]))}"


def measured(name: str, folder: Path, movements: int) -> None:
    """Print the times of one design file."""
    path = folder / "pair.toml"
    path.write_text(text_of(*CASES[name]), encoding="utf-8")

    def started(*arguments: str, cache: str) -> subprocess.Popen[str]:
        environment = {**os.environ, "XDG_CACHE_HOME": str(folder / cache)}
        command = [sys.executable, "-m", "jaxgear", *arguments]
        return subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True)

    began = time.perf_counter()
    with started("analyze", "pair.toml", cache="analyze") as process:
        process.communicate()
    analyzed = time.perf_counter() - began
    began = time.perf_counter()
    with started("explore", "pair.toml", "--no-browser", "--token", TOKEN, cache="explore") as server:
        assert server.stdout is not None
        link = server.stdout.readline().strip()
        with sync_playwright() as playwright:
            chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
            browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
            page = browser.new_page(viewport={"width": 1280, "height": 720})
            page.goto(link)
            page.wait_for_selector("body[data-grid]", timeout=600_000)
            ready = time.perf_counter() - began
            page.wait_for_selector("body[data-grid=rest]", timeout=600_000)
            page.evaluate(MOVE, 20)
            times = page.evaluate(MOVE, movements)
            browser.close()
        server.kill()
    median, most = np.quantile(times, [0.5, 0.95])
    print(f"{name:20} {median:6.0f} ms median, {most:6.0f} ms for 95 % of {movements} movements; ", end="")
    print(f"ready after {ready:.1f} s, analyze {analyzed:.1f} s", flush=True)


def main() -> None:
    """Measure all cases."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--movements", type=int, default=200)
    options = parser.parse_args()
    for name in CASES:
        with tempfile.TemporaryDirectory() as folder:
            measured(name, Path(folder), options.movements)


if __name__ == "__main__":
    main()
