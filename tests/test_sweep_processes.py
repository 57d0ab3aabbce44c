"""Sweeps as processes: killed at any moment, on any devices, and shared, they have the same rows to the last bit."""

import contextlib
import os
import random
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import jax
import numpy as np
import pytest

import jaxgear as jg

pytestmark = pytest.mark.slow

SCRIPT = Path(__file__).with_name("sweep_process.py")
PARTS = 40


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    """All processes keep their compiled programs in the folder of the tests: only the first of a kind compiles."""
    added = {
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
        "JAX_COMPILATION_CACHE_DIR": str(jax.config.jax_compilation_cache_dir or tmp_path_factory.mktemp("compiled")),
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
        "JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES": "-1",
    }
    kept = {name: value for name, value in os.environ.items() if name not in ("XLA_FLAGS", "JAX_NUM_CPU_DEVICES")}
    return {**kept, **added}


@contextlib.contextmanager
def started(environment, *arguments):
    """A process that does not outlive the block."""
    command = [sys.executable, str(SCRIPT), *map(str, arguments)]
    process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def finish(process):
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    assert out == ""


@pytest.fixture(scope="module")
def complete(environment, tmp_path_factory):
    """The table of an uninterrupted sweep on four devices; the others have two, and that must not matter."""
    folder = tmp_path_factory.mktemp("complete") / "out"
    with started(environment, folder, 4) as process:
        finish(process)
    return jg.open_sweep(folder)


def assert_same(table, complete):
    assert table.names == complete.names and len(complete) == 4000 and complete.failures() == 0
    for name in complete.names:
        np.testing.assert_array_equal(table.column(name), complete.column(name), err_msg=name)


def test_killed_again_and_again_on_other_devices_it_has_the_rows_of_an_uninterrupted_one(
    environment, complete, tmp_path
):
    folder, moments = tmp_path / "out", random.Random(0)
    for wanted in (1, 12, 25):
        with started(environment, folder, 2) as process:
            while len(list(folder.glob("part-*.parquet"))) < wanted and process.poll() is None:
                time.sleep(0.001)
            time.sleep(moments.uniform(0, 0.02))
            process.send_signal(signal.SIGKILL)
            process.wait()
    there = len(list(folder.glob("part-*.parquet")))
    assert 25 <= there < PARTS, "the processes were killed too late to test anything"
    (folder / ".part-0000039-0f.parquet.1234.tmp").write_bytes(b"PAR1")  # what a kill in the middle of writing leaves
    with started(environment, folder, 2) as process:
        finish(process)
    assert_same(jg.open_sweep(folder), complete)
    assert not list(folder.glob("*.tmp")) and not list(folder.glob(".*"))


def test_two_processes_share_the_parts(environment, complete, tmp_path):
    with socket.socket() as free:
        free.bind(("localhost", 0))
        coordinator = f"localhost:{free.getsockname()[1]}"
    folder = tmp_path / "out"
    with started(environment, folder, 2, coordinator, 2, 0) as first:
        with started(environment, folder, 2, coordinator, 2, 1) as second:
            finish(first)
            finish(second)
    assert_same(jg.open_sweep(folder), complete)
