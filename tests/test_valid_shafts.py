"""Traced shafts, bearings and housings that cannot be: flagged where concrete ones are refused, and never a load."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from test_clearance import stage
from test_shafts import PINION, TILTED, WHEEL, two_stages
from test_supported_contact import PAIR, gearbox

import jaxgear as jg
from jaxgear.layout import Endurance, WoehlerLine, damage, level_load
from jaxgear.numerics import positive_definite, within_limits
from jaxgear.shafts import (
    Bearing,
    Housing,
    Misalignment,
    RigidSupport,
    TabulatedSupport,
    annex_e,
    bearing_reactions,
    support,
)
from jaxgear.shafts.matrices import semidefinite

NODES = tuple(f"{seat}.{way}" for seat in "ABCDEF" for way in "xy")
COMPLIANCE = np.diag(np.linspace(1e-3, 3e-3, len(NODES)))
BOX = two_stages(housing=Housing(NODES, COMPLIANCE, "compliance"))
STATIONS = 7


def places(box):
    """Numbers by which a gearbox can be spoiled."""
    first, middle, _ = box.shafts
    return {
        "torque": first.couplings[0].torque,
        "bore": first.sections[0].bore,
        "length": first.sections[1].length,
        "radial": first.bearings[0].radial,
        "other radial": first.bearings[1].radial,
        "bearing": first.bearings[1].position,
        "gear": first.gears[0].position,
        "body": first.gears[0].body_diameter,
        "neighbour": middle.gears[1].position,
        "diameter": middle.sections[0].diameter,
        "tangent": middle.bearings[1].stiffness,
        "housing": box.housing.matrix,
        "offset": box.meshes[0].axial_offset,
    }


def spoiled(values):
    """The gearbox with other numbers."""
    return eqx.tree_at(lambda box: list(places(box).values()), BOX, [values[name] for name in places(BOX)])


def coupled(entry, first=0, second=2):
    return (
        COMPLIANCE
        + entry * (np.eye(len(NODES))[[first]].T @ np.eye(len(NODES))[[second]])
        + (entry * (np.eye(len(NODES))[[second]].T @ np.eye(len(NODES))[[first]]))
    )


UPSIDE_DOWN = TILTED * np.array([1.0, -1.0, 1.0, 1.0, 1.0])[None]
# every one out of bounds alone, and as far as it may go
CASES = [
    ("torque", -1.0, 0.0),
    ("bore", 31.0, 24.9),
    ("bore", -1.0, 0.0),
    ("length", -80.0, 75.0),
    ("radial", -100.0, 1e-3),
    ("radial", np.nan, 1e9),
    ("other radial", 0.0, 1e-3),
    ("bearing", 10.0, 10.5),
    ("bearing", 151.0, 150.0),
    ("gear", 300.0, 141.0),
    ("gear", -50.0, 9.0),
    ("body", 63.0, 62.9),
    ("neighbour", 60.0, 68.0),
    ("diameter", 150.0, 53.0),
    ("tangent", UPSIDE_DOWN, TILTED),
    ("housing", coupled(5e-3), coupled(1e-3)),
    ("housing", -COMPLIANCE, 0 * COMPLIANCE),
    ("offset", 18.1, 17.0),
]


@pytest.fixture(scope="module")
def judged():
    """Whether every case is valid, in one batch: those out of bounds first."""
    names = list(places(BOX))
    rows = [
        {**places(BOX), name: jnp.asarray(value)} for pair in (1, 2) for name, value in [(c[0], c[pair]) for c in CASES]
    ]
    batch = {
        name: jnp.stack([jnp.broadcast_to(row[name], jnp.shape(places(BOX)[name])) for row in rows]) for name in names
    }
    return np.asarray(jax.jit(jax.vmap(lambda values: spoiled(values).valid))(batch)).reshape(2, -1)


@pytest.mark.parametrize(
    "index", range(len(CASES)), ids=[f"{name} {number}" for number, (name, *_) in enumerate(CASES)]
)
def test_numbers_that_cannot_be_are_not_valid(judged, index):
    assert list(judged[:, index]) == [False, True]


def test_what_is_refused_is_not_valid_and_what_is_taken_is():
    """By the same rules: making the shafts anew checks them."""
    for name, bad, good in CASES:
        if name not in ("bearing", "gear", "body", "neighbour", "diameter", "other radial"):
            continue
        box = spoiled({**places(BOX), name: jnp.asarray(good)})
        assert len([replace(shaft) for shaft in box.shafts]) == 3
        box = spoiled({**places(BOX), name: jnp.asarray(bad)})
        with pytest.raises(ValueError, match=r"^Shaft "):
            _ = [replace(shaft) for shaft in box.shafts]


def test_a_batch_keeps_its_good_members():
    """Load, damage and bearing forces of shafts that cannot be are NaN beside one that can."""
    box = gearbox()
    load = jg.LoadSpectrum.from_hours([0.0, 50.0], [5.0, 10.0], 500.0)
    endurance = Endurance(WoehlerLine(1500.0, 13.2, 5e7), WoehlerLine(900.0, 8.7, 3e6))

    def of(radial):
        held = support(eqx.tree_at(lambda of: of.shafts[0].bearings[0].radial, box, radial))
        face = annex_e(held, stations=STATIONS)
        spent = damage(held, load, endurance, stations=STATIONS)
        force = bearing_reactions(held.gearbox).force[0, 1]
        numbers = face.face_load_factor, face.approach, spent.life, spent.largest, spent.face_load_factor[1], force
        return jnp.stack(numbers), jnp.append(spent.converged, face.converged), spent.pitting

    numbers, converged, pitting = jax.jit(jax.vmap(of))(jnp.array([-100.0, 150.0, 0.0, np.nan]))
    bad = jnp.array([0, 2, 3])
    assert np.isfinite(numbers[1]).all() and float(numbers[1, 0]) > 1.1
    assert np.isnan(numbers[bad]).all()
    # idle loads do no damage whatever holds the gears
    np.testing.assert_array_equal(converged, [[True, good, good] for good in (False, True, False, False)])
    np.testing.assert_array_equal(pitting[..., 0], 0.0)
    assert np.isnan(pitting[bad, :, 1]).all() and (pitting[1, :, 1] > 0).all()


def test_gears_that_cannot_run_carry_no_load_whatever_holds_them():
    """Traced ones with a pointed or an undercut pinion: not converged, as in the contact, and NaN."""

    def of(shift):
        box = eqx.tree_at(lambda box: box.shafts[0].gears[0].gear.profile_shift, gearbox(), shift)
        pair = box.pair(0)
        table = TabulatedSupport(pair, jnp.zeros((STATIONS, STATIONS)))
        faces = [annex_e(each, torque=50.0, stations=STATIONS) for each in (RigidSupport(pair), table)]
        faces.append(annex_e(support(box), stations=STATIONS))
        loads = jnp.stack([jnp.append(face.line_load, face.approach) for face in faces])
        slope = level_load(RigidSupport(pair), torque=50.0, stations=STATIONS).slope
        return jg.margins(pair).valid, jnp.stack([face.converged for face in faces]), loads, slope

    valid, converged, loads, slopes = jax.jit(jax.vmap(of))(jnp.array([0.0, 2.0, -0.8]))
    np.testing.assert_array_equal(valid, [True, False, False])
    np.testing.assert_array_equal(converged, np.repeat(valid[:, None], 3, axis=1))
    assert np.isfinite(loads[0]).all() and np.isnan(loads[1:]).all()
    assert np.isfinite(slopes[0]) and np.isnan(slopes[1:]).all()


def test_a_shaft_afloat_carries_no_even_load():
    """A belt holds the one shaft in place; nothing does the other, whose clearance no torque takes up."""
    afloat = annex_e(support(stage(20.0, moment=0.0)), stations=STATIONS)
    assert np.isnan(float(afloat.face_load_factor)) and not bool(afloat.converged)


def test_other_supports_tell_too():
    matrix = np.eye(4) + 0.5
    valid = jax.jit(lambda given: TabulatedSupport(PAIR, given).valid)
    assert bool(valid(matrix)) and bool(valid(0 * matrix)) and not bool(valid(matrix - 1.1 * np.eye(4)))
    span = jax.jit(lambda given: RigidSupport(PAIR, Misalignment(skew=5.0, bearing_span=given)).valid)
    assert bool(span(100.0)) and not bool(span(-100.0))


def test_pivots_are_as_positive_as_eigenvalues():
    """Random symmetric matrices, moved to either side of singular: definite exactly where LAPACK's eigenvalues are."""
    random = np.random.default_rng(1)
    ask = jax.jit(jax.vmap(positive_definite)), jax.jit(jax.vmap(semidefinite))
    for size in (1, 4, 12):
        part = random.normal(size=(20, size, size))
        even = part + part.swapaxes(1, 2)
        lowest = np.linalg.eigvalsh(even)[:, 0, None, None]
        for shift, definite, half in ((1e-6, True, True), (0.0, None, True), (-1e-6, False, False)):
            moved = even + (shift - lowest) * np.eye(size)
            if definite is not None:
                np.testing.assert_array_equal(ask[0](moved), definite)
            np.testing.assert_array_equal(ask[1](moved), half)
    assert not bool(positive_definite(jnp.full((2, 2), jnp.nan)))


def test_limits_of_fields_hold_for_traced_numbers():
    def within(radial, clearance):
        return within_limits((Bearing("A", 0.0, radial, clearance=clearance), {"gear": PINION, "wheel": WHEEL}))

    ask = jax.jit(within)
    for radial, clearance, expected in (
        (0.0, 0.0, True),
        (-1e-9, 0.0, False),
        (np.inf, 0.0, False),
        (1.0, -1.0, False),
    ):
        assert bool(ask(radial, clearance)) == expected
    assert bool(within_limits(())) and bool(within_limits(BOX))
