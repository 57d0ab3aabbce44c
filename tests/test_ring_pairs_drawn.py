"""Random internal pairs: what may run against teeth that are drawn point by point and turned, and their contact."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helical_pairs import SIZES

import jaxgear as jg
from jaxgear.geometry import explicit, pair_geometry

NAMES = "planet ring module angle x1 x2 tip1 tip2 root1 root2 radius cutter width helix".split()
# margins of what the drawn teeth show
SEEN = "trochoid_clearance pinion_form_clearance wheel_form_clearance pinion_tip_clearance wheel_tip_clearance".split()


def draw(rng, steepest):
    planet = int(rng.integers(10, 70))
    ring = planet + int(rng.choice([rng.integers(4, 16), rng.integers(10, 80)]))
    tips = rng.uniform(0.6, 1.1), rng.uniform(0.5, 0.95)
    module = np.exp(rng.uniform(0, 2))
    return {
        "planet": planet,
        "ring": ring,
        "module": module,
        "angle": rng.choice([17.5, 20.0, 22.5, 25.0, 28.0]),
        "x1": rng.uniform(-0.2, 0.8),
        "x2": rng.uniform(-0.8, 0.2),
        "tip1": tips[0],
        "tip2": tips[1],
        "root1": tips[1] + rng.uniform(0.15, 0.4),
        "root2": tips[0] + rng.uniform(0.15, 0.4),
        "radius": rng.uniform(0.05, 0.25),
        "cutter": max(round(ring * rng.uniform(0.25, 0.55)), 10),
        "width": rng.uniform(4, 15) * module,
        "helix": rng.uniform(-steepest, steepest) if steepest else 0.0,
    }


def made(of):
    both = {
        "module": of["module"],
        "pressure_angle": of["angle"],
        "face_width": of["width"],
        "helix_angle": of["helix"],
    }
    planet = jg.Gear(
        of["planet"],
        profile_shift=of["x1"],
        addendum=of["tip1"],
        dedendum=of["root1"],
        root_radius=of["radius"],
        **both,
    )
    kept = {"addendum": of["tip2"], "dedendum": of["root2"], "cutter_teeth": of["cutter"]}
    return jg.GearPair(planet, jg.RingGear(of["ring"], profile_shift=of["x2"], **kept, **both))


@jax.jit
def geometry(numbers):
    """Margins that are met, half teeth as radius and half angle, radii of tips and roots, centre distance."""
    pair = made(dict(zip(NAMES, numbers)))
    found = pair_geometry(explicit(pair))

    def half(drawn):
        roll = jnp.linspace(drawn.form_roll_length, drawn.gear.tip_roll_length, 110)
        g = jnp.linspace(drawn.junction, jnp.pi / 2, 110)
        fillet = drawn.curves.over(g.shape).trochoid(g)
        x, y = map(jnp.concatenate, zip(jax.vmap(drawn.curves.involute)(roll), fillet))
        return jnp.hypot(x, y), jnp.abs(jnp.arctan2(x, jnp.abs(y)))

    radii = [(abs(gear.tip_radius), abs(gear.root_circle_radius)) for gear in pair.gears]
    return found.held, [half(drawn) for drawn in found.outlines], radii, pair.working_center_distance


def overlap(of, teeth, radii, distance):
    """Largest depth [mm] of points of one gear in the teeth of the other while they roll, without backlash."""
    z1, z2 = of["planet"], of["ring"]
    (tip1, root1), (tip2, root2) = radii
    inner, outer = (tuple(np.asarray(part)[np.argsort(radius)] for part in (radius, half)) for radius, half in teeth)

    def wrapped(angle, count):
        return (angle + np.pi / count) % (2 * np.pi / count) - np.pi / count

    # points of a planet tooth, in the ring's space that is on the line of centres with it
    turn = np.linspace(0, np.pi, 900)[:, None]
    radius, angle = np.append(inner[0], np.full(20, tip1)), np.append(inner[1], np.linspace(0, inner[1][-1], 20))
    radius, angle = np.tile(radius, 2), np.append(angle, -angle)
    x, y = radius * np.sin(angle + turn), distance + radius * np.cos(angle + turn)
    far, apart = np.hypot(x, y), wrapped(np.arctan2(x, y) - turn * z1 / z2, z2)
    space = np.pi / z2 - np.interp(far, *outer)
    depth = np.where(far > tip2, (np.abs(apart) - space) * far, -1.0)
    worst = np.maximum(depth, far - root2).max()
    # points of a ring tooth, in the planet's teeth
    turn = np.linspace(-np.pi, np.pi, 1800)[:, None] * z1 / z2
    radius, angle = np.tile(outer[0], 2), np.append(outer[1], -outer[1]) + np.pi / z2
    x, y = radius * np.sin(angle + turn), radius * np.cos(angle + turn) - distance
    far, apart = np.hypot(x, y), wrapped(np.arctan2(x, y) - turn * z2 / z1, z1)
    depth = np.where(far < tip1, (np.interp(far, *inner) - np.abs(apart)) * far, -1.0)
    return max(worst, np.where(far < root1, np.maximum(depth, root1 - far), depth).max())


@pytest.mark.slow
@pytest.mark.parametrize("steepest", [0.0, 30.0])
def test_random_pairs_run_where_drawn_teeth_are_free(steepest):
    """Pairs that run are free within 4e-3 modules, the accuracy of the drawing; refused ones hit by 2e-4 or more.

    Of those that run none gives numbers without a status, with reliefs and up to some hundred MPa at the root.
    """
    rng = np.random.default_rng(11)
    counts = {"runs": 0, "hits": 0}
    for _ in range(60):
        of = draw(rng, steepest)
        held, teeth, radii, distance = jax.device_get(geometry(jnp.asarray([of[name] for name in NAMES])))
        missed = {name for name, holds in held.items() if not holds}
        if missed - set(SEEN):
            continue
        depth = overlap(of, teeth, radii, float(distance)) / of["module"]
        counts["hits" if missed else "runs"] += 1
        assert depth > 2e-4 if missed else depth < 4e-3, (of, missed, depth)
        if missed or counts["runs"] > 6:
            continue
        pair = made(of)
        relief = jg.TipRelief(rng.uniform(0, 12) * of["module"], rng.uniform(0.2, 2) * of["module"])
        mesh = jg.prepare(pair, resolution=replace(SIZES, slices=5 if steepest else 1, pairs=None))
        torque = rng.uniform(0.01, 0.04) * of["planet"] * of["module"] ** 2 * of["width"]
        cycle = jg.solve(mesh, torque, pinion=relief, wheel=relief)
        assert np.all(np.asarray(cycle.converged)), (of, torque, relief)
        assert np.all(np.isfinite(cycle.transmission_error)) and np.all(cycle.residual < 1e-9)
    assert counts["runs"] > 20 and counts["hits"] > 4
