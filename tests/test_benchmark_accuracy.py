"""The accuracy benchmark fails when it should; that it passes is seen by running it."""

import json
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg
from benchmarks import accuracy, cases, face, goals, helical, internal, models, quantities, report

CASE = cases.Case("A", "strain", 50.0, "par7.81x5.05")
OTHER = cases.Case("L", "stress", 100.0, "linshort")


(NO_CORNERS,) = (model for model in models.MODELS if model.name == "no corner contact")  # by the same programs


@pytest.mark.parametrize(
    "model", [NO_CORNERS, pytest.param(models.LEGACY, marks=pytest.mark.slow)], ids=lambda model: model.name
)
@pytest.mark.slow
def test_a_worse_model_fails(capsys, model):
    assert accuracy.main(["--quick", "--cases", "A"], models=(model,)) == 1
    said = capsys.readouterr().out
    assert "9 mesh cycles" in said and "Worse than recorded" in said


def test_a_grown_error_or_a_nan_exceeds_its_bound():
    row = {quantity.key: 1.0 for quantity in quantities.QUANTITIES}
    assert accuracy.exceeded({CASE: row}, {"A": row}) == []
    for bad in (-1.2, float("nan")):
        lines = accuracy.exceeded({CASE: {**row, "mean": bad}}, {"A": row})
        assert len(lines) == 1 and "mean TE" in lines[0]


@pytest.mark.parametrize("argument", ["", "F", "A,F"])
def test_unknown_or_missing_cases_are_refused(argument):
    with pytest.raises(ValueError, match="unknown cases"):
        accuracy.main(["--cases", argument])


def test_empty_lists_are_refused():
    with pytest.raises(ValueError, match="nothing"):
        cases.select(pairs=())
    with pytest.raises(ValueError, match="nothing"):
        cases.select(("L",), ("strain",))
    with pytest.raises(ValueError, match="nothing"):
        accuracy.compare(models.MODELS, [])
    with pytest.raises(ValueError, match="nothing"):
        accuracy.compare((), [CASE])


def test_bounds_are_recorded_from_complete_runs_only(tmp_path):
    for arguments in (["--quick"], ["--cases", "A"]):
        with pytest.raises(SystemExit):
            accuracy.main(["--record", *arguments], bounds=tmp_path / "bounds.json")
    assert not list(tmp_path.iterdir())
    stored = json.loads(accuracy.BOUNDS.read_text())
    assert set(stored) == set(cases.PAIRS)
    assert all(set(row) == {quantity.key for quantity in quantities.QUANTITIES} for row in stored.values())


def test_reference_is_complete_and_in_equilibrium():
    found = cases.select()
    assert len(found) == 76
    for case in found:
        truth = cases.reference(case)
        assert truth.force.shape == truth.pressure.shape == (4, 64 if case.pair in "IL" else 128)
        force = 1e3 * case.torque / float(cases.gear_pair(case.pair).pinion.base_radius)
        np.testing.assert_allclose(truth.force.sum(axis=0), force, rtol=1e-6)
        assert np.ptp(truth.transmission_error) > 0.5 and np.nanmax(truth.pressure) > 400


def test_reference_across_the_face_is_in_equilibrium():
    """Force of the mean line load over the face; beyond the path of contact the lever is shorter, by up to 0.3 %."""
    for case in face.cases():
        truth, pair = face.reference(case, 24), face.gear_pair(case.pair)
        force = truth.line_load.mean(axis=1).sum(axis=0) * float(pair.face_width)
        expected = 1e3 * face.inputs(case)["torque_Nm"] / float(pair.pinion.base_radius)
        np.testing.assert_allclose(force, expected, rtol=3e-3)
        assert np.ptp(truth.transmission_error) > 1.0
        assert face.reference(case).factor <= truth.factor


def test_errors_across_the_face_are_held(capsys):
    case = face.FaceCase("b18", "slope20_50Nm")
    bounds = face.load_bounds()
    assert set(bounds) == {str(one) for one in face.cases()}
    kept = face.Errors(0.5, 1.0, None, None)
    held = {str(case): {key: 1.0 for key in face.TITLES}}
    assert face.exceeded({case: kept}, held) == []
    for bad in (face.Errors(-1.2, 1.0, None, None), face.Errors(0.5, float("nan"), None, None)):
        assert len(face.exceeded({case: bad}, held)) == 1
    face.print_face({"coupled": {case: kept}, "uncoupled": {case: face.Errors(-20.0, 25.0, 0.5, -0.4)}})
    printed = capsys.readouterr().out
    assert "+0.5 / -20.0" in printed and "- / +0.50" in printed


def test_every_case_shares_one_compilation():
    """Gear pairs and modifications differ in numbers only."""
    for made in (lambda case: cases.gear_pair(case.pair), cases.modifications):
        shapes = {
            (str(jax.tree.structure(tree)), *(leaf.aval.str_short() for leaf in jax.tree.leaves(tree)))
            for tree in map(made, cases.select())
        }
        assert len(shapes) == 1


def test_a_goal_is_met_by_either_of_its_limits():
    goal = goals.Goal("ppte", 5.0, ("ppte_um", 0.1))
    assert goal.met({"ppte": -4.9, "ppte_um": -0.3}) and goal.met({"ppte": 7.0, "ppte_um": 0.09})
    for error in (-5.1, float("nan")):
        assert not goal.met({"ppte": error, "ppte_um": 2 * error})
    assert goals.Goal("k1", 3.0).met({"mean": 1.0})  # no position with a single pair
    assert str(goal) == "PPTE, of at least 2 um within 5 % or 0.1 um"


def test_summary_lists_the_cycles_that_miss_a_goal(capsys):
    quiet = {quantity.key: 0.0 for quantity in quantities.QUANTITIES}
    results = {
        "one": {CASE: quiet, OTHER: {**quiet, "ppte": -7.5, "ppte_um": -0.25}},
        "two": {CASE: quiet, OTHER: quiet},
    }
    goal = goals.Goal("ppte", 5.0, ("ppte_um", 0.1), part=0.95)
    report.print_summary(results, {"one": (goal,), "two": ()})
    printed = capsys.readouterr().out
    assert "MISSED by the one model" in printed and "two model" not in printed
    (line,) = (line for line in printed.splitlines() if str(OTHER) in line and line.rstrip("│ ").endswith("ppte"))
    ppte = np.ptp(cases.reference(OTHER).transmission_error)
    assert str(CASE) not in printed and f"{ppte:.3f}" in line and f"{ppte - 0.25:.3f}" in line and "-7.50" in line


def test_stiffness_is_left_out_where_the_reference_has_none():
    never_single = cases.Case("I", "stress", 1500.0, "none")
    truth = cases.reference(never_single)
    found = quantities.errors(never_single, truth, truth)
    assert "k1" not in found and found["k2"] == 0.0


def test_reference_agrees_with_itself():
    truth = cases.reference(CASE)
    assert max(abs(value) for value in quantities.errors(CASE, truth, truth).values()) < 1e-12


@pytest.mark.parametrize(
    "pair", [pair if pair in "AL" else pytest.param(pair, marks=pytest.mark.slow) for pair in cases.PAIRS]
)
def test_rigid_flanks_touch_as_in_the_reference(pair):
    """The unloaded transmission error tells whether reliefs, crownings, racks and phases mean the same on both sides:
    2 % more crowning would change it by 0.4 um."""
    for name in cases.inputs()[pair]["modifications"]:
        case = cases.Case(pair, "stress", float(cases.inputs()[pair]["torques"][0]), name)
        expected = cases.reference(case).unloaded_transmission_error
        found = rigid_transmission_error(case, np.arange(0, expected.size, 4) / expected.size)
        difference = found - expected[::4]
        assert np.abs(difference).max() < 0.035 and np.sqrt(np.mean(difference**2)) < 0.012, name


def rigid_transmission_error(case, phases):
    """Smallest gap [um] between the flanks at every phase: of each point of the pinion's flank, its distance from the
    wheel's involute along the tangent to the wheel's base circle. The wheel is held."""
    pair, path = cases.gear_pair(case.pair), cases.path_of_contact(case.pair)
    first, second = float(pair.pinion.base_radius), float(pair.wheel.base_radius)
    angle = float(pair.working_pressure_angle)
    whole = path.pinion_pitch_roll_length + path.wheel_pitch_roll_length
    tips = tuple(float(gear.tip_roll_length) for gear in (pair.pinion, pair.wheel))
    roll_length = np.linspace(0.1 * tips[0], tips[0], 20_001)
    places = roll_length, np.linspace(0.0, tips[1], 20_001)
    removed = []
    for side, modification in enumerate(cases.modifications(case)):
        flank = places[side], tips[side], whole - tips[1 - side], (first, second)[side], 0.0, 1.0
        removed.append(np.asarray(modification(jg.microgeometry.Flank(*map(jnp.asarray, flank)))))
    gaps = []
    for travelled in phases[:, None] + np.arange(-2, 2):
        nominal = path.pinion_pitch_roll_length + travelled[:, None] * path.base_pitch
        turned = angle + (roll_length - nominal) / first
        across = first * np.cos(turned) + roll_length * np.sin(turned)
        along = first * np.sin(turned) - roll_length * np.cos(turned)
        distance = (first + second) / np.cos(angle) - across
        reached = np.sqrt(np.maximum(distance**2 + along**2 - second**2, 0.0))
        tangent = np.arctan2(-along, distance) + np.arctan2(reached, second)
        gap = 1e3 * (reached - (whole - nominal) - second * (tangent - angle))
        lever = (across * np.cos(tangent) + along * np.sin(tangent)) / first
        closing = (gap + removed[0] + np.interp(reached, places[1], removed[1])) / lever
        gaps.append(closing[(reached > 0) & (reached <= tips[1])].min())
    return np.array(gaps)


def test_curves_are_brought_to_the_position_of_the_wheel():
    """A curve over the mean position of both gears, made from one over that of the wheel, comes back."""
    pitch = cases.path_of_contact(CASE.pair).base_pitch
    wheel = np.arange(4096) / 4096
    error = 7.0 + np.sin(2 * np.pi * wheel)
    share = 0.5e-3 * error / pitch
    assert 1e-4 < share.min() and share.max() < 1e-2
    mean = np.interp(wheel, wheel + share, error, period=1.0)
    force = np.tile(1 + 0.1 * mean, (4, 1))
    found = cases.as_the_reference(CASE, cases.Curves(mean, 0 * mean, force, force))
    phase = np.arange(128) / 128
    np.testing.assert_allclose(found.transmission_error, 7.0 + np.sin(2 * np.pi * phase), atol=2e-6)
    np.testing.assert_allclose(found.force[1], 1.7 + 0.1 * np.sin(2 * np.pi * phase), atol=2e-6)
    unmoved = np.interp(phase, wheel, mean)
    assert np.abs(unmoved - found.transmission_error).max() > 1e-3


@pytest.mark.slow
def test_solution_is_that_of_the_public_functions():
    """The benchmark solves all models under one compliance label to save compilations: that must change nothing."""
    model = next(model for model in models.MODELS if model.name == "constant Hertz")
    curves = models.run(model, [CASE])[CASE]
    pair = cases.gear_pair(CASE.pair)
    mesh = jg.prepare(pair, compliance=model.compliance(pair, CASE.plane), resolution=model.resolution)
    pinion, wheel = cases.modifications(CASE)
    cycle = jg.solve(mesh, CASE.torque, pinion=pinion, wheel=wheel)
    expected = cases.as_the_reference(CASE, models.curves_of(cycle))
    np.testing.assert_allclose(curves.transmission_error, expected.transmission_error, rtol=1e-9)
    np.testing.assert_allclose(curves.force, expected.force, atol=1e-6)
    flank = np.isfinite(curves.pressure)
    np.testing.assert_allclose(curves.pressure[flank], expected.pressure[flank], rtol=1e-6)


@pytest.mark.parametrize(
    "second",
    [replace(NO_CORNERS, name="legacy"), models.LEGACY],
    ids=["stand-in", "legacy"],
)
@pytest.mark.slow
def test_figures_are_written(tmp_path, monkeypatch, second):
    from benchmarks import figures

    monkeypatch.setattr(figures, "LEGACY", second)
    results = accuracy.compare((models.DEFAULT, second), [CASE])
    (path,) = figures.write_figures(tmp_path, results)
    assert path.stat().st_size > 20_000


def test_errors_of_helical_pairs_are_held_to_their_bounds():
    """The reference itself has none; a grown one and what is not a number are told."""
    results = {}
    for name, data in helical.stored().items():
        for key, case in data["cases"].items():
            curve = case["mean_te_um"] + 0.5 * case["ppte_um"] * np.array([-1.0, 1.0])
            results[f"{name} {key}"] = helical._errors(case, 3.0 * np.asarray(case["face_load"]), curve)
    assert len(results) == 36 and all(error.close for error in results.values())
    assert max(abs(value) for *_, value in helical._values(results)) < 0.1  # the digits of the file
    assert helical.exceeded(results) == []
    worst = next(iter(results))
    for bad in (-50.0, float("nan")):
        grown = {**results, worst: replace(results[worst], ripple=bad)}
        assert [line.split()[:3] for line in helical.exceeded(grown)] == [[*worst.split(), "ripple:"]]


def test_errors_of_internal_pairs_are_held_to_their_bounds():
    """The reference itself has none, but for positions half a transmission error off; grown ones are told."""
    results = {}
    for name, data in internal.stored()["pairs"].items():
        for group, curves in data["curves"].items():
            for key, curve in curves.items():
                found = internal.errors(np.asarray(curve), np.arange(64) / 64, np.asarray(curve), 1e9)
                results.setdefault(f"{name} {group}", {})[key] = found
    assert sum(map(len, results.values())) == 115
    assert max(value for *_, value in internal._values(results)) < 1e-4
    assert internal.exceeded(results) == []
    worst = next(iter(results))
    for bad in (-5.0, float("nan")):
        grown = {**results, worst: {"one": replace(found, mean=bad)}}
        assert [line.split()[:4] for line in internal.exceeded(grown)] == [[*worst.split(), "mean:"]]


@pytest.mark.slow
def test_internal_pairs_are_within_their_bounds(capsys):
    results = {"R2 six_at stress": internal.run("R2", "six_at stress")}
    assert internal.exceeded(results) == []
    internal.print_internal(results)
    assert "0 of 10 cycles" in capsys.readouterr().out
