"""What commands do to be ready soon, and the benchmark that counts it."""

import os

from benchmarks.latency import Wait, exceeded
from jaxgear.cli.devices import compile_quickly


def test_commands_compile_quickly_unless_the_user_has_said_how(monkeypatch):
    monkeypatch.setenv("XLA_FLAGS", "--xla_cpu_enable_fast_math=false")
    compile_quickly()
    flags = os.environ["XLA_FLAGS"].split()
    assert flags[0] == "--xla_cpu_enable_fast_math=false"
    assert "--xla_backend_optimization_level=0" in flags
    monkeypatch.setenv("XLA_FLAGS", "--xla_backend_optimization_level=2")
    compile_quickly()
    assert os.environ["XLA_FLAGS"] == "--xla_backend_optimization_level=2"


def test_a_version_of_xla_that_was_not_tried_gets_no_flags(monkeypatch):
    """One that does not know a flag ends the process."""
    monkeypatch.setenv("XLA_FLAGS", "")
    monkeypatch.setattr("jaxgear.cli.devices.version", lambda _: "9.9.9")
    compile_quickly()
    assert os.environ["XLA_FLAGS"] == ""


def test_one_more_program_or_a_long_wait_is_too_much():
    bounds = {"cold": {"programs": 3, "wall": 2.0}}
    assert exceeded("solve", {"cold": Wait(5.9, 1.0, 9, 3, {})}, bounds) == []
    (line,) = exceeded("solve", {"cold": Wait(1.0, 1.0, 9, 4, {})}, bounds)
    assert "4 programs, at most 3" in line
    (line,) = exceeded("solve", {"cold": Wait(6.1, 1.0, 9, 3, {})}, bounds)
    assert "6.1 s" in line
