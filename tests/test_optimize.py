"""Gradient search: it finds known optima, says what it did, and refuses what it cannot search."""

import jax
import numpy as np
import pytest

import jaxgear as jg

BOX = {"pinion": (0.0, 20.0), "wheel": (0.0, 20.0), "length": (1.0, 5.7)}


def design(x):
    return jg.TipRelief(x["pinion"], x["length"]), jg.TipRelief(x["wheel"], x["length"])


@pytest.fixture(scope="module")
def mesh():
    pinion = jg.Gear(19, 3.0, face_width=20.0, bore_diameter=24.0)
    wheel = jg.Gear(48, 3.0, face_width=18.0, bore_diameter=70.0)
    return jg.prepare(jg.GearPair(pinion, wheel), resolution=jg.Resolution(positions=32))


@pytest.fixture(scope="module")
def optimum(mesh):
    looks = []
    result = jg.minimize(
        design, BOX, mesh=mesh, torque=50.0, starts=8, steps=200, callback=lambda *args: looks.append(args)
    )
    return result, looks


def test_cuts_the_variation_by_three_quarters(mesh, optimum):
    result, _ = optimum
    unmodified = float(jg.peak_to_peak(jg.solve(mesh, 50.0).transmission_error))
    assert result.ppte < 0.25 * unmodified


def test_beats_the_sizing_rule_and_every_point_of_a_grid(mesh, optimum):
    result, _ = optimum
    rule = jg.iso_relief(mesh.pair, 50.0)
    ruled = float(jg.peak_to_peak(jg.solve(mesh, 50.0, pinion=rule, wheel=rule).transmission_error))

    def ppte(x):
        pinion, wheel = design(dict(zip(BOX, x, strict=True)))
        return jg.peak_to_peak(jg.solve(mesh, 50.0, pinion=pinion, wheel=wheel).transmission_error)

    axes = np.meshgrid(*(np.linspace(low, high, 8) for low, high in BOX.values()))
    grid = np.stack([axis.ravel() for axis in axes], axis=-1)
    best = float(np.min(jax.lax.map(ppte, jax.numpy.asarray(grid), batch_size=64)))
    assert result.ppte < ruled
    assert result.ppte < best


def test_result_belongs_to_its_parameters(mesh, optimum):
    result, _ = optimum
    again = jg.solve(mesh, 50.0, pinion=result.pinion, wheel=result.wheel)
    assert float(jg.peak_to_peak(again.transmission_error)) == pytest.approx(result.ppte, abs=1e-9)
    assert float(result.pinion.amount) == pytest.approx(result.parameters["pinion"])
    for name, (low, high) in BOX.items():
        at = {low: "lower", high: "upper"}.get(result.parameters[name])
        assert result.active_bounds.get(name) == at


def test_progress_only_improves(optimum):
    result, looks = optimum
    assert [total for _, total, _ in looks] == [200] * len(looks)
    assert looks[-1][0] == 200
    assert np.all(np.diff(result.history) <= 0)
    assert result.history[-1] >= result.ppte


def test_a_bound_in_the_way_is_named(mesh):
    narrow = {"pinion": (0.0, 2.0), "wheel": (0.0, 2.0), "length": (1.0, 5.7)}
    result = jg.minimize(design, narrow, mesh=mesh, torque=50.0, starts=4, steps=120)
    assert result.active_bounds["pinion"] == "upper"
    assert result.active_bounds["wheel"] == "upper"


@pytest.mark.parametrize(
    ("bounds", "options", "words"),
    [
        ({}, {}, "at least one"),
        ({"pinion": (2.0, 1.0)}, {}, "upper bound of pinion"),
        ({"pinion": (float("nan"), 1.0)}, {}, "lower bound of pinion"),
        (BOX, {"starts": 0}, "starts = 0"),
        (BOX, {"steps": 1}, "steps = 1"),
    ],
)
def test_refuses_what_it_cannot_search(mesh, bounds, options, words):
    with pytest.raises(ValueError, match=words):
        jg.minimize(design, bounds, mesh=mesh, torque=50.0, **options)


def test_a_search_without_a_finite_design_fails(mesh):
    def broken(x):
        return jg.TipRelief(x["pinion"] * float("nan"), 3.0), None

    with pytest.raises(RuntimeError, match="converged"):
        jg.minimize(broken, {"pinion": (0.0, 1.0)}, mesh=mesh, torque=50.0, starts=2, steps=20)
