"""Pairs of `jaxgear new` and rounded drawings are accepted, unless points of one gear lie in the other one."""

import numpy as np
import pytest
from points_in_material import Rack, Toothed, interference, runs

import jaxgear as jg
from jaxgear.contact import fewest_pairs
from jaxgear.contact.covering import check_cover
from jaxgear.io.write_design import starter_pair


def drawn(rng):
    """Teeth, module, face width, helix and pressure angle of a random pair."""
    low, high = np.log([8, 8, 0.2, 2.0]), np.log([200, 200, 50.0, 40.0])
    first, second, module, widths = np.exp(rng.uniform(low, high))
    helix = rng.choice([0.0, rng.uniform(0.0, 45.0)], p=[0.3, 0.7])
    module, helix, angle = round(module, 2), round(helix, 1), round(rng.uniform(14.5, 28.0), 1)
    return (round(first), round(second)), module, round(widths * module, 1), helix, angle


def refusal(make, *args):
    """Why a pair is refused where it is made and where its tooth pairs are counted; "" where it is not."""
    try:
        pair = make(*args)
    except ValueError as error:
        return str(error)
    pairs = fewest_pairs(pair, deflection=16.0 * float(pair.pinion.module))
    check_cover(pair, jg.path_of_contact(pair), jg.Resolution(pairs=pairs))
    return ""


def toothed(teeth, module, width, helix, angle, shifts=(0.0, 0.0), tips=None, distance=None):
    """The two gears of NumPy, with their centre distance."""
    alpha, beta = np.deg2rad(angle), np.deg2rad(helix)
    full = (np.pi / 4 - 1.25 * np.tan(alpha)) * np.cos(alpha) / (1 - np.sin(alpha))
    radius = 0.25 / (1 - np.sin(alpha)) if angle < 20 else min(0.38, full)
    rack = Rack(module, alpha, beta, 1.25, radius)
    tips = tips or [z * module / np.cos(beta) + 2 * module * (1 + x) for z, x in zip(teeth, shifts)]
    gears = [Toothed(rack, z, x, 0.5 * tip) for z, x, tip in zip(teeth, shifts, tips)]
    return *gears, sum(gear.pitch for gear in gears) if distance is None else distance


def wrongly_refused(numbers, said, **drawing):
    """The numbers of a pair that is refused but runs."""
    if not said or runs(*toothed(*numbers, **drawing), numbers[2]):
        return []
    return [(numbers, drawing, said)]


def test_points_in_material_tell_undercut_from_interference():
    """12/40: clear of the undercut of a full rack, 84 um into the flank that a rack without clearance leaves."""
    teeth, tips = (12, 40), (28.0, 84.0)
    for dedendum, depth in ((1.25, 0.0), (1.0, 84.4)):
        rack = Rack(2.0, np.deg2rad(20.0), 0.0, dedendum, 0.3)
        pinion, wheel = (Toothed(rack, z, 0.0, 0.5 * tip) for z, tip in zip(teeth, tips))
        assert 1e3 * max(interference(pinion, wheel, 52.0), 0.0) == pytest.approx(depth, abs=0.1)


def test_random_pairs_of_the_template_are_accepted():
    rng = np.random.default_rng(1)
    for numbers in [drawn(rng) for _ in range(4)]:
        assert not wrongly_refused(numbers, refusal(starter_pair, *numbers))


@pytest.mark.slow
def test_two_thousand_pairs_of_the_template_are_accepted():
    rng = np.random.default_rng(0)
    draws = [drawn(rng) for _ in range(2000)]
    said = [refusal(starter_pair, *numbers) for numbers in draws]
    assert sum(map(bool, said)) < 200
    assert not sum(map(wrongly_refused, draws, said), [])
    accepted = [numbers for numbers, why in zip(draws, said) if not why]
    assert not [numbers for numbers in accepted[::60] if runs(*toothed(*numbers), numbers[2])]


def drawing(rng, numbers):
    """A drawing of a legal pair with profile shifts, whose numbers are rounded to two decimals."""
    teeth, module, width, helix, angle = numbers
    shifts = [max(rng.uniform(-0.2, 0.6), 1 - z / 17) for z in teeth]
    gears = [
        jg.Gear(z, module, angle, x, face_width=width, helix_angle=b, root_radius=0.2)
        for z, x, b in zip(teeth, shifts, (helix, -helix))
    ]
    pair = jg.GearPair(*gears)
    rounded = [round(x, 2) for x in shifts]
    tips = [round(2 * float(gear.tip_radius), 2) for gear in gears]
    return rounded, tips, round(float(pair.working_center_distance), 2)


def made(numbers, shifts, tips, distance):
    teeth, module, width, helix, angle = numbers
    gears = [
        jg.Gear(z, module, angle, x, face_width=width, helix_angle=b, tip_diameter=tip, root_radius=0.2)
        for z, x, b, tip in zip(teeth, shifts, (helix, -helix), tips)
    ]
    return jg.GearPair(*gears, distance)


@pytest.mark.slow
def test_three_hundred_rounded_drawings_are_accepted():
    rng, refused, count = np.random.default_rng(2), [], 0
    while count < 300:
        numbers = drawn(rng)
        try:
            shifts, tips, distance = drawing(rng, numbers)
        except ValueError:  # no legal pair
            continue
        count += 1
        said = refusal(made, numbers, shifts, tips, distance)
        refused += [(numbers, shifts, tips, distance, said)] if said else []
    assert not refused
