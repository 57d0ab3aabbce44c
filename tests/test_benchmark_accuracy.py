"""The accuracy benchmark: its quick mode passes, and it fails when it should."""

import json

import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg
from benchmarks import accuracy, cases, models, quantities

CASE = cases.Case("A", "strain", 50.0, "par7.81x5.05")


def test_quick_mode_holds_the_recorded_bounds(capsys):
    assert accuracy.main(["--quick"]) == 0
    assert "28 mesh cycles" in capsys.readouterr().out


def test_a_worse_model_fails(capsys):
    assert accuracy.main(["--quick", "--cases", "A"], models=(models.LEGACY,)) == 1
    assert "Worse than recorded" in capsys.readouterr().out


def test_a_grown_error_or_a_nan_exceeds_its_bound():
    row = {quantity.key: 1.0 for quantity in quantities.QUANTITIES}
    assert accuracy.exceeded({CASE: row}, {"A": row}) == []
    for bad in (-1.2, float("nan")):
        lines = accuracy.exceeded({CASE: {**row, "mean": bad}}, {"A": row})
        assert len(lines) == 1 and "mean TE" in lines[0]


@pytest.mark.parametrize("argument", ["", "E", "A,E"])
def test_unknown_or_missing_cases_are_refused(argument):
    with pytest.raises(ValueError, match="unknown cases"):
        accuracy.main(["--cases", argument])


def test_empty_lists_are_refused():
    with pytest.raises(ValueError, match="nothing"):
        cases.select(pairs=())
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
    assert len(found) == 56
    for case in found:
        truth = cases.reference(case)
        assert truth.force.shape == truth.pressure.shape == (4, 128)
        force = 1e3 * case.torque / float(cases.gear_pair(case.pair).pinion.base_radius)
        np.testing.assert_allclose(truth.force.sum(axis=0), force, rtol=1e-6)
        assert np.ptp(truth.transmission_error) > 0.5 and np.nanmax(truth.pressure) > 400


def test_reference_agrees_with_itself():
    truth = cases.reference(CASE)
    assert max(abs(value) for value in quantities.errors(CASE, truth, truth, truth).values()) < 1e-12


def test_alignment_moves_by_half_the_transmission_error():
    truth, moved = cases.reference(CASE), cases.aligned(CASE)
    share = 1e-3 * truth.transmission_error[40] / cases.path_of_contact(CASE.pair).base_pitch
    assert 1e-4 < share < 1e-2
    # the curve at phase 40/128 comes from half that share of a base pitch earlier
    slope = (truth.force[1, 41] - truth.force[1, 39]) * 64
    np.testing.assert_allclose(moved.force[1, 40], truth.force[1, 40] - 0.5 * share * slope, rtol=1e-4)
    np.testing.assert_allclose(moved.force.sum(axis=0), truth.force.sum(axis=0), rtol=1e-6)


@pytest.mark.slow
def test_solution_is_that_of_the_public_functions():
    """The benchmark solves all models under one compliance label to save compilations: that must change nothing."""
    model = next(model for model in models.MODELS if model.name == "constant Hertz")
    curves = models.run(model, [CASE])[CASE]
    resolution = jg.Resolution(positions=models.POSITIONS, pairs=models.PAIRS)
    mesh = jg.prepare(cases.gear_pair(CASE.pair), compliance=model.compliance(CASE.plane), resolution=resolution)
    pinion, wheel = cases.reliefs(CASE)
    cycle = jg.solve(mesh, CASE.torque, pinion=pinion, wheel=wheel)
    np.testing.assert_allclose(curves.transmission_error, cycle.transmission_error, rtol=1e-9)
    np.testing.assert_allclose(curves.force, cycle.pair_force, atol=1e-6)
    flank = np.isfinite(curves.pressure)
    np.testing.assert_allclose(curves.pressure[flank], jnp.asarray(cycle.contact_pressure[:, 0])[flank], rtol=1e-6)


def test_figures_are_written(tmp_path):
    from benchmarks.figures import write_figures

    results = accuracy.compare((models.DEFAULT, models.LEGACY), [CASE])
    (path,) = write_figures(tmp_path, results)
    assert path.stat().st_size > 20_000
