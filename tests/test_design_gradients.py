"""Derivatives of the results with respect to every physical input, through `prepare` and `solve`."""

import subprocess
import sys

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg

MODIFICATION = {
    "torque": 57.0,
    "relief_amount": 6.3,
    "relief_length": 4.1,
    "relief_exponent": 1.37,
    "root_amount": 2.1,
    "root_length": 2.7,
    "crowning": 1.3,
    "slope": 0.9,
    "lead_crowning": 3.7,
    "lead_slope": 1.9,
    "end_amount": 2.3,
    "end_length": 7.1,
    "table": 0.7,
}
MACRO = {"module": 3.0, "profile_shift": 0.11, "bore": 23.0}


def mesh_of(module, profile_shift, bore, resolution):
    pinion = jg.Gear(19, module, profile_shift=profile_shift, face_width=20.0, bore_diameter=bore, root_radius=0.3)
    wheel = jg.Gear(48, module, face_width=18.0, bore_diameter=70.0)
    return jg.prepare(jg.GearPair(pinion, wheel), resolution=resolution)


def results(cycle):
    """PPTE, mean TE, peak pressure and the first five harmonic amplitudes."""
    te = cycle.transmission_error
    scalars = jnp.stack([jg.peak_to_peak(te), jnp.mean(te), jnp.max(cycle.contact_pressure)])
    return jnp.concatenate([scalars, jg.harmonics(te, 5).amplitude])


def of_modification(x, mesh):
    """Results for every kind of modification at once."""
    p = dict(zip(MODIFICATION, x, strict=True))
    places = jnp.linspace(5.0, 15.0, 5)
    cycle = jg.solve(
        mesh,
        p["torque"],
        pinion=jg.TipRelief(p["relief_amount"], p["relief_length"], jg.Power(p["relief_exponent"]))
        + jg.RootRelief(p["root_amount"], p["root_length"])
        + jg.TabulatedProfile(places, p["table"] * jnp.asarray([0.0, 0.4, 0.1, 0.5, 0.9])),
        wheel=jg.TipRelief(5.1, 3.3)
        + jg.ProfileCrowning(p["crowning"])
        + jg.ProfileSlope(p["slope"])
        + jg.LeadCrowning(p["lead_crowning"])
        + jg.LeadSlope(p["lead_slope"])
        + jg.EndRelief(p["end_amount"], p["end_length"]),
    )
    return results(cycle)


def of_macro(x):
    """Results of a relieved pair over its macro geometry, through `prepare`."""
    relief = jg.TipRelief(6.0, 4.0)
    return results(jg.solve(mesh_of(*x, jg.Resolution(positions=16)), 57.0, pinion=relief, wheel=relief))


def central_differences(function, start, step):
    columns = []
    for i in range(start.size):
        move = jnp.zeros_like(start).at[i].set(step)
        columns.append((np.asarray(function(start + move)) - np.asarray(function(start - move))) / (2 * step))
    return np.stack(columns, axis=1)


def compare(exact, difference):
    assert np.all(np.isfinite(exact))
    # differences of values of some 10 um resolve 1e-7 um per step of 1e-4 or so
    np.testing.assert_allclose(exact, difference, rtol=2e-4, atol=2e-6 * np.abs(exact).max())
    assert np.all(np.abs(exact[1]) > 1e-6), "an input without effect on the mean would agree with anything"


@pytest.mark.slow
def test_modifications_and_torque():
    with jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"):
        sizes = jg.Resolution(positions=16, slices=3, pairs=2, face_modes=2, slide_steps=0)
        mesh = mesh_of(*MACRO.values(), sizes)
        start, units = jnp.asarray(list(MODIFICATION.values())), jnp.eye(8)

        @eqx.filter_jit
        def both(x, weights):
            value, pull = jax.vjp(lambda at: of_modification(at, mesh), x)
            return value, pull(weights)[0]

        exact = np.stack([np.asarray(both(start, unit)[1]) for unit in units])
        compare(exact, central_differences(lambda x: both(x, units[0])[0], start, 1e-4))


@pytest.mark.slow
def test_module_shift_and_bore(optimized):
    start = jnp.asarray(list(MACRO.values()))
    along = eqx.filter_jit(lambda x, v: jax.jvp(of_macro, (x,), (v,)))  # one program for the values too
    units = jnp.eye(start.size)
    exact = np.stack([np.asarray(along(start, unit)[1]) for unit in units], axis=1)
    compare(exact, central_differences(lambda x: along(x, units[0])[0], start, 1e-5))


@pytest.mark.slow
def test_new_numbers_do_not_retrace():
    traces = []

    @eqx.filter_jit
    def ppte(pair, torque, relief):
        traces.append(1)
        mesh = jg.prepare(pair, resolution=jg.Resolution(positions=8, pairs=4))
        return jg.peak_to_peak(jg.solve(mesh, torque, pinion=relief).transmission_error)

    for z, m, torque, amount in ((19, 3.0, 50.0, 0.0), (21, 2, 70, 5), (30, 4.0, 100.0, 8.0)):
        pair = jg.GearPair(jg.Gear(z, m, face_width=18), jg.Gear(48, m, face_width=18.0))
        assert jnp.isfinite(ppte(pair, jnp.asarray(float(torque)), jg.TipRelief(amount, 3.0)))
    assert len(traces) == 1


@pytest.mark.slow
def test_single_precision_agrees_to_a_nanometre():
    script = (
        "import jaxgear as jg\n"
        "mesh = jg.prepare(jg.GearPair(jg.Gear(19, 3, face_width=20, bore_diameter=24),"
        " jg.Gear(48, 3, face_width=18, bore_diameter=70)))\n"
        "for r in (None, jg.TipRelief(7.0, 4.0)):\n"
        "    c = jg.solve(mesh, 50.0, pinion=r, wheel=r)\n"
        "    assert c.transmission_error.dtype == 'float32' and bool(c.converged.all())\n"
        "    print(float(jg.peak_to_peak(c.transmission_error)))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    single = [float(line) for line in done.stdout.split()]
    mesh = jg.prepare(
        jg.GearPair(jg.Gear(19, 3, face_width=20, bore_diameter=24), jg.Gear(48, 3, face_width=18, bore_diameter=70))
    )
    for value, relief in zip(single, (None, jg.TipRelief(7.0, 4.0)), strict=True):
        cycle = jg.solve(mesh, 50.0, pinion=relief, wheel=relief)
        assert value == pytest.approx(float(jg.peak_to_peak(cycle.transmission_error)), abs=1e-3)
