"""Programs that are kept: found again by what they are made of, never mistaken for another, never an obstacle."""

import json
import os
import pickle
import subprocess
import sys
import threading
import time
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, SLIDING, gear_pair

import jaxgear as jg
from jaxgear.cli import jax_setup
from jaxgear.contact import begin_contact
from jaxgear.contact import mesh as mesh_module
from jaxgear.numerics import programs
from jaxgear.numerics.durable import forget_the_oldest
from jaxgear.numerics.programs import ProgramStore, begin, keep, program


class Shelf(dict):
    """Keeps programs in memory."""

    read = dict.get
    write = dict.__setitem__


@pytest.fixture
def shelf():
    """A shelf that this process uses."""
    found = Shelf()
    keep(ProgramStore(found))
    yield found
    keep(None)


@pytest.fixture
def traced(monkeypatch):
    """Names of the functions that were traced for a store."""
    names, lowered = [], programs._lowered

    def counted(function, arguments):
        names.append(function.__name__)
        return lowered(function, arguments)

    monkeypatch.setattr(programs, "_lowered", counted)
    return names


@program
def scaled(values, how: str, factor=1.0):
    """A function with an array, a name, a number that is no array, and a result of arrays and other things."""
    return {"values": values * (2.0 if how == "twice" else 3.0) * factor, "how": how, "none": None}


def test_gives_what_the_function_gives(shelf):
    for values in (jnp.arange(3.0), np.arange(3.0), jnp.arange(3.0, dtype=jnp.float32)):
        found = scaled(values, "twice")
        assert found["how"] == "twice" and found["none"] is None
        assert found["values"].dtype == values.dtype
        np.testing.assert_array_equal(found["values"], 2.0 * np.asarray(values))


def test_tells_apart_what_differs_in_anything_but_numbers(shelf, traced):
    for _ in range(2):
        scaled(jnp.ones(3), "twice")
        scaled(jnp.zeros(3), "twice")  # other numbers
        assert scaled(jnp.ones(3), "thrice")["values"][0] == 3.0
        assert scaled(jnp.ones(3), "twice", 2)["values"][0] == scaled(jnp.ones(3), "twice", 2.0)["values"][0] == 4.0
        scaled(jnp.ones((3, 1)), "twice")
    assert traced == ["scaled"] * 5  # 2 and 2.0 are equal, but not the same


def test_leaves_transformations_to_jax(shelf, traced):
    def twice(x):
        return scaled(x, "twice")["values"]

    x = jnp.arange(3.0)
    np.testing.assert_array_equal(jax.jit(twice)(x), 2 * x)
    np.testing.assert_array_equal(jax.vmap(twice)(x), 2 * x)
    np.testing.assert_array_equal(jax.jacfwd(twice)(x), 2 * np.eye(3))
    # known numbers within a trace of something else
    np.testing.assert_array_equal(jax.jit(lambda y: y + twice(jnp.ones(3)))(x), x + 2)
    assert traced == []


def test_keys_of_random_numbers_are_left_to_jax(shelf, traced):
    @program
    def drawn(key, count: int):
        return jax.random.normal(key, (count,))

    key = jax.random.key(3)
    np.testing.assert_array_equal(drawn(key, 4), jax.random.normal(key, (4,)))
    assert traced == []


def test_without_a_store_nothing_is_begun():
    assert begin(scaled, jnp.ones(3), "twice") is None


def test_what_is_begun_is_what_is_called(shelf, traced):
    shapes = begin(scaled, jax.ShapeDtypeStruct((3,), "float64"), "twice")
    assert shapes["values"].shape == (3,) and shapes["how"] == "twice"
    np.testing.assert_array_equal(scaled(jnp.ones(3), "twice")["values"], 2 * np.ones(3))
    assert traced == ["scaled"]


def test_errors_are_those_of_the_function(shelf):
    @program
    def refuse(x):
        raise ValueError("no")

    with pytest.raises(ValueError, match="^no"):
        refuse(jnp.ones(2))


def test_finer_meshes_and_other_compliances_compile_what_is_new_alone(shelf, traced, monkeypatch):
    pair, fine = gear_pair(), replace(LINE, positions=128)
    jg.prepare(pair, resolution=replace(LINE, positions=64))
    begun = len(traced)
    made = jg.prepare(pair, resolution=fine)
    assert traced[begun:] == ["_joined"]
    begun = len(traced)
    jg.prepare(pair, compliance=replace(jg.default_compliance(), edge_softening=False), resolution=fine)
    # another kind of contact law is joined otherwise
    assert traced[begun:] == ["_for_gears", "_arrays_of", "_joined"]
    monkeypatch.setattr(mesh_module, "_AT_ONCE", 128)  # all positions in one run of the programs
    whole = jg.prepare(pair, resolution=fine)
    for one, other in zip(jax.tree.leaves(made), jax.tree.leaves(whole), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12)


CONTACT = "_arrays_of", "slid_material", "_solve_removed"


def test_a_contact_compiles_what_it_has_not_begun_and_what_its_programs_read(shelf, traced):
    pair, compliance, relief = gear_pair(), jg.default_compliance(), jg.TipRelief(5.0, 3.0)
    begin_contact(pair, compliance, LINE, LINE)
    before = [name for name in traced if name in ("_arrays_of", "_solve_removed")]
    jg.solve(jg.prepare(pair, compliance=compliance, resolution=LINE), 50.0)
    assert [name for name in traced if name in before] == before == ["_arrays_of", "_solve_removed"]
    # gears share programs whether their diameters are given or not: what None stands for is a number to the programs,
    # and None to everybody who reads the gears
    found, bare = [], traced.count("slid_material")
    for tips, bores in (((None, None), (None, None)), ((63.0, 150.0), (24.75, None))):
        gears = zip((19, 48), tips, bores)
        pair = jg.GearPair(*(jg.Gear(z, 3.0, face_width=18.0, tip_diameter=t, bore_diameter=b) for z, t, b in gears))
        mesh = jg.prepare(pair, resolution=LINE)
        cycle = jg.solve(mesh, 50.0, pinion=relief)
        for held in (mesh.pair.gears, cycle.kinematics.pair.gears):
            assert [gear.tip_diameter is None for gear in held] == [tip is None for tip in tips]
            assert [gear.bore_diameter is None for gear in held] == [bore is None for bore in bores]
        found.append(np.asarray(cycle.transmission_error))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-12)
    assert [traced.count(name) for name in CONTACT] == [1, bare + 1, 1]
    # nor do sizes that a program does not read make another one
    for given in ({}, {"slide_steps": 0}, {"face_modes": 3, "newton_steps": 6}):
        sizes = replace(SLIDING, **given)
        mesh = jg.prepare(pair, resolution=sizes)
        cycle = jg.solve(mesh, 50.0, pinion=relief)
        assert mesh.resolution == sizes == cycle.kinematics.resolution
    # contacts that slide and that do not; 8 and 6 steps
    assert [traced.count(name) for name in CONTACT] == [1, bare + 2, 2]


def test_a_function_that_can_change_without_a_word_is_not_kept(shelf):
    scaled(jnp.ones(3), "twice")
    assert not shelf


def test_a_program_that_cannot_be_loaded_is_compiled_again(traced, monkeypatch):
    class Full(dict):
        """Has everything, and nothing of it can be loaded."""

        def read(self, made_of):
            return pickle.dumps(({"values": programs._Shape((3,), "float64")}, (b"torn", None, None)))

    monkeypatch.setattr(programs, "_recipe", lambda made_of: b"recipe")
    keep(ProgramStore(Full()))
    np.testing.assert_array_equal(scaled(jnp.ones(3), "twice")["values"], 2 * np.ones(3))
    keep(None)
    assert traced == ["scaled"]


def test_equal_objects_are_one_recipe_whether_they_are_one_object_or_two():
    one, other = tuple([2, 1, 16]), tuple([2, 1, 16])
    assert programs._recipe((one, one)) == programs._recipe((one, other)) != programs._recipe((one, (2, 1, 17)))


def test_files_are_whole_or_not_there(tmp_path):
    files = jax_setup.Files(tmp_path)
    assert files.read(b"recipe") is None
    files.write(b"recipe", b"program")
    (file,) = tmp_path.iterdir()
    assert files.read(b"recipe") == b"program" and files.read(b"another") is None
    whole = file.read_bytes()
    for damaged in (b"", whole[:-1], b"x" + whole[1:]):
        file.write_bytes(damaged)
        assert files.read(b"recipe") is None
    files = jax_setup.Files(tmp_path / "missing")
    files.write(b"recipe", b"program")  # an obstacle is none
    assert files.read(b"recipe") is None


@pytest.mark.skipif(os.name != "posix", reason="owners and modes are those of POSIX")
def test_what_others_can_have_written_is_not_executed(tmp_path, monkeypatch):
    files, before = jax_setup.Files(tmp_path), os.umask(0)
    try:
        files.write(b"recipe", b"program")
    finally:
        os.umask(before)
    (file,) = tmp_path.iterdir()
    assert files.read(b"recipe") == b"program"
    for path, mode in ((file, 0o620), (file, 0o602), (tmp_path, 0o770), (tmp_path, 0o707)):
        mine = path.stat().st_mode
        path.chmod(mode)
        assert files.read(b"recipe") is None
        path.chmod(mine)
    uid = os.getuid()
    with monkeypatch.context() as another:
        another.setattr(os, "getuid", lambda: uid + 1)  # so that both are owned by somebody else
        assert files.read(b"recipe") is None
    file.rename(tmp_path / "elsewhere")
    file.symlink_to(tmp_path / "elsewhere")
    assert files.read(b"recipe") is None
    file.unlink()
    os.mkfifo(file)  # at which a plain open waits
    assert files.read(b"recipe") is None
    file.unlink()
    (tmp_path / "elsewhere").rename(file)
    assert files.read(b"recipe") == b"program"


def test_many_write_at_once(tmp_path):
    files, programs_ = jax_setup.Files(tmp_path), [bytes([i]) * 100_000 for i in range(8)]
    seen = set()

    def work(mine):
        for _ in range(20):
            files.write(b"recipe", mine)
            seen.add(files.read(b"recipe"))

    threads = [threading.Thread(target=work, args=(mine,)) for mine in programs_]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert seen <= set(programs_) and len(list(tmp_path.iterdir())) == 1


def test_the_oldest_are_forgotten(tmp_path):
    for age, name in enumerate("abcd"):
        (tmp_path / name).write_bytes(bytes(100))
        os.utime(tmp_path / name, (0, time.time() - age))
    forget_the_oldest(tmp_path, 250)
    assert {file.name for file in tmp_path.iterdir()} == {"a", "b"}


def test_programs_are_those_of_their_surroundings(tmp_path, monkeypatch):
    jax_setup.Files(tmp_path).write(b"recipe", b"program")
    monkeypatch.setenv("XLA_FLAGS", "--xla_cpu_enable_fast_math=true")
    assert jax_setup.Files(tmp_path).read(b"recipe") is None


_SECOND = """
import sys, jax
compiled = []
jax.monitoring.register_event_duration_secs_listener(
    lambda name, seconds, **kw: compiled.append(name) if name.endswith("backend_compile_duration") else None)
from jaxgear.cli import main
try:
    main(["analyze", sys.argv[1], "--output", sys.argv[2], "--no-figures"])
except SystemExit as end:
    print("exit", end.code, "compiled", len(compiled))
"""
_FILE = """
[pinion]
teeth = 19
module = 3.0
face_width = 18.0
[wheel]
teeth = 48
module = 3.0
face_width = 18.0
[load]
torque = {torque}
[resolution]
positions = 16
pairs = 2
slide_steps = 0
"""


@pytest.mark.slow
def test_a_second_command_with_another_number_compiles_nothing_and_finds_the_same(tmp_path):
    # without optimization it compiles in a quarter of the time
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path), "JAX_DISABLE_MOST_OPTIMIZATIONS": "1"}
    environment["XLA_FLAGS"] = "--xla_backend_optimization_level=0"  # nothing is compiled to try options
    for name in ("JAX_COMPILATION_CACHE_DIR", "JAXGEAR_NO_CACHE"):
        environment.pop(name, None)

    def compiled(torque, folder):
        (tmp_path / "file.toml").write_text(_FILE.format(torque=torque))
        command = [sys.executable, "-c", _SECOND, str(tmp_path / "file.toml"), str(tmp_path / folder)]
        done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
        assert "exit 0" in done.stdout, done.stdout + done.stderr
        return int(done.stdout.rsplit(maxsplit=1)[-1])

    assert compiled(50.0, "first") > 5
    assert compiled(60.0, "second") == 0
    found = json.loads((tmp_path / "second" / "summary.json").read_text())["designs"]["unmodified"]
    curve = np.asarray(jg.solve(jg.prepare(gear_pair(bores=(None, None)), resolution=LINE), 60.0).transmission_error)
    assert found["ppte_um"] == pytest.approx(np.ptp(curve), rel=1e-9)
    assert found["mean_te_um"] == pytest.approx(curve.mean(), rel=1e-9)
