"""The benchmark that counts how soon commands are ready."""

from benchmarks.latency import Wait, exceeded


def test_one_more_program_or_a_long_wait_is_too_much():
    bounds = {"cold": {"programs": 3, "wall": 2.0}}
    assert exceeded("solve", {"cold": Wait(11.9, 1.0, 9, 3, {})}, bounds) == []
    (line,) = exceeded("solve", {"cold": Wait(1.0, 1.0, 9, 4, {})}, bounds)
    assert "4 programs, at most 3" in line
    (line,) = exceeded("solve", {"cold": Wait(12.1, 1.0, 9, 3, {})}, bounds)
    assert "12.1 s" in line
