"""Traced shafts, bearings and housings that cannot be: flagged where concrete ones are refused, and never a load."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from gearboxes import PAIR, PINION, TILTED, WHEEL, gearbox, stage, two_stages

import jaxgear as jg
from jaxgear.contact.status import Status
from jaxgear.layout import damage, level_load
from jaxgear.metrics import Strength
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
from jaxgear.shafts.stepped_beam import semidefinite

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
    return np.asarray(jax.jit(jax.vmap(lambda values: spoiled(values).status))(batch)).reshape(2, -1)


@pytest.mark.parametrize(
    "index", range(len(CASES)), ids=[f"{name} {number}" for number, (name, *_) in enumerate(CASES)]
)
def test_numbers_that_cannot_be_are_not_valid(judged, index):
    bad, good = judged[:, index]
    assert bad in (Status.SUPPORT_NOT_POSSIBLE, Status.GEARS_CANNOT_RUN) and good == Status.CONVERGED


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


# stiffness of the first bearing and profile shift of the pinion: two that can be, shafts that cannot, and a pointed and
# an undercut pinion
RADIAL = np.array([150.0, 300.0, -100.0, 0.0, np.nan, 150.0, 150.0])
SHIFT = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.0, -0.8])
GOOD, BAD_SHAFTS, BAD_GEARS = slice(0, 2), slice(2, 5), slice(5, 7)


@pytest.fixture(scope="module")
def batch():
    """What shafts do to the load, in one batch of those that can be and those that cannot."""
    load = jg.LoadSpectrum.from_hours([0.0, 50.0], [5.0, 10.0], 500.0)
    strength = Strength(
        1500.0, bending=900.0, pitting_exponent=13.2, pitting_cycles=5e7, bending_exponent=8.7, bending_cycles=3e6
    )

    def of(radial, shift):
        box = eqx.tree_at(
            lambda of: (of.shafts[0].bearings[0].radial, of.shafts[0].gears[0].gear.profile_shift),
            gearbox(),
            (radial, shift),
        )
        held, pair = support(box), box.pair(0)
        table = TabulatedSupport(pair, jnp.zeros((STATIONS, STATIONS)))
        faces = [annex_e(held, stations=STATIONS)]
        faces += [annex_e(each, torque=50.0, stations=STATIONS) for each in (RigidSupport(pair), table)]
        spent = damage(held, load, strength, stations=STATIONS)
        return {
            "valid": jg.margins(pair).valid,
            "loads": jnp.stack([jnp.append(face.line_load, face.approach) for face in faces]),
            "factors": jnp.stack([face.face_load_factor for face in faces]),
            "status": jnp.stack([face.status for face in faces]),
            "slope": level_load(RigidSupport(pair), torque=50.0, stations=STATIONS).slope,
            "spent": jnp.stack([spent.life, spent.largest, spent.face_load_factor[1]]),
            "found": spent.converged,
            "pitting": spent.pitting,
            "force": bearing_reactions(held.gearbox).force[0, 1],
        }

    found = jax.jit(jax.vmap(of))(RADIAL, SHIFT)
    return {name: np.asarray(part) for name, part in found.items()}


@pytest.mark.slow
def test_a_batch_keeps_its_good_members(batch):
    """Load, damage and bearing forces of shafts that cannot be are NaN beside those that can."""
    assert (batch["factors"][GOOD, 0] > 1.1).all() and np.isfinite(batch["loads"][GOOD]).all()
    assert np.isfinite(batch["spent"][GOOD]).all() and np.isfinite(batch["force"][GOOD]).all()
    # a gearbox and what it does at the stations carry the load alike
    np.testing.assert_allclose(batch["spent"][GOOD, 2], batch["factors"][GOOD, 0], rtol=1e-9)
    assert np.isnan(batch["loads"][BAD_SHAFTS, 0]).all() and np.isnan(batch["factors"][BAD_SHAFTS, 0]).all()
    assert np.isnan(batch["spent"][BAD_SHAFTS]).all() and np.isnan(batch["force"][BAD_SHAFTS]).all()
    assert not batch["status"][GOOD, 0].any() and (batch["status"][BAD_SHAFTS, 0] == Status.SUPPORT_NOT_POSSIBLE).all()
    # idle loads do no damage whatever holds the gears
    np.testing.assert_array_equal(batch["found"][:5], [[True, good] for good in (True, True, False, False, False)])
    np.testing.assert_array_equal(batch["pitting"][:5, :, 0], 0.0)
    assert np.isnan(batch["pitting"][BAD_SHAFTS, :, 1]).all() and (batch["pitting"][GOOD, :, 1] > 0).all()


@pytest.mark.slow
def test_gears_that_cannot_run_carry_no_load_whatever_holds_them(batch):
    """Not converged, as in the contact, and NaN: rigid, by a table, and on shafts."""
    np.testing.assert_array_equal(batch["valid"], np.arange(7) < 5)
    assert not batch["status"][GOOD].any() and (batch["status"][BAD_GEARS] == Status.GEARS_CANNOT_RUN).all()
    assert np.isnan(batch["loads"][BAD_GEARS]).all()
    assert np.isfinite(batch["slope"][GOOD]).all() and np.isnan(batch["slope"][BAD_GEARS]).all()


@pytest.mark.slow
def test_a_shaft_afloat_carries_no_even_load():
    """A belt holds the one shaft in place; nothing does the other, whose clearance no torque takes up."""
    afloat = annex_e(support(stage(20.0, moment=0.0)), stations=STATIONS)
    assert np.isnan(float(afloat.face_load_factor)) and afloat.status == Status.NOT_CONVERGED


def test_other_supports_tell_too():
    matrix = np.eye(4) + 0.5
    valid = jax.jit(lambda given: TabulatedSupport(PAIR, given).status == Status.CONVERGED)
    assert bool(valid(matrix)) and bool(valid(0 * matrix)) and not bool(valid(matrix - 1.1 * np.eye(4)))
    span = jax.jit(
        lambda given: RigidSupport(PAIR, Misalignment(skew=5.0, bearing_span=given)).status == Status.CONVERGED
    )
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
