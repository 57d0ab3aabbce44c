"""Flanks from a measured transmission error: true values, what one torque cannot tell, and data that are refused."""

from functools import cache

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import FACE, LINE, SLIDING, gear_pair

import jaxgear as jg
from jaxgear.conditions import solve_case
from jaxgear.identification import Measurement, identify, read_measurement
from jaxgear.io import DesignFileError
from jaxgear.revolution import Teeth, TeethDeviations, solve_revolution
from jaxgear.tolerance import ToleranceClass

TORQUES = (30.0, 60.0, 120.0)
PRIOR = {"pinion": (8.0, 3.0), "wheel": (8.0, 3.0)}
TRUE = {"pinion": 9.0, "wheel": 6.5}
NOISE, OFFSET = 0.1, 3.0  # [um]

GOOD = {"phase": np.tile(np.arange(8) / 8, 2), "torque_Nm": np.repeat(TORQUES[:2], 8), "te_um": np.arange(16.0)}


@cache
def mesh() -> jg.Mesh:
    return jg.prepare(gear_pair(), resolution=SLIDING)


def design(unknown):
    return jg.TipRelief(unknown["pinion"], 4.0), jg.TipRelief(unknown["wheel"], 4.0)


@cache
def readings(torques, scale=1.005):
    """A pair read at two torques with a scale in error, an offset and noise."""
    flanks = design(dict(zip(TRUE, map(jnp.asarray, TRUE.values()))))
    found = [solve_case(mesh(), jnp.asarray(scale * torque), *flanks).transmission_error for torque in torques]
    value = np.concatenate(found) + OFFSET + NOISE * np.random.default_rng(1).standard_normal(16 * len(torques))
    return np.tile(np.asarray(mesh().phase), len(torques)), np.repeat(torques, 16), value


def found(torques, **options):
    data = Measurement(*readings(torques), noise=NOISE)
    return identify(mesh(), data, design, PRIOR, offset=10.0, **options)


def test_a_relief_and_an_offset_are_found_where_the_model_itself_made_the_data():
    meshed = jg.prepare(gear_pair(), resolution=LINE)

    def relief(unknown):
        return jg.TipRelief(unknown["pinion"], 4.0), jg.NoModification()

    true = solve_case(meshed, jnp.asarray(TORQUES[1]), *relief({"pinion": jnp.asarray(9.0)})).transmission_error
    data = Measurement(meshed.phase, np.full(16, TORQUES[1]), true + OFFSET, noise=1e-6)
    result = identify(
        meshed, data, relief, {"pinion": PRIOR["pinion"]}, torque_scale=None, offset=10.0, model_error=0.0
    )
    assert result.converged and result.names == ("pinion", "offset") and not result.undetermined()
    np.testing.assert_allclose(result.estimate, [9.0, OFFSET], atol=1e-6)
    assert np.all(result.deviation < 1e-4) and np.all(result.deviation < result.prior[1])


@pytest.mark.slow
def test_three_torques_tell_flanks_scale_and_offset():
    result = found(TORQUES, model_error=0.0)  # the model itself made the data
    true = np.array([*TRUE.values(), 1.005, OFFSET])
    assert result.converged and result.names == ("pinion", "wheel", "torque_scale", "offset")
    assert np.all(np.abs(result.estimate - true) < 2.5 * result.deviation)
    assert np.all(result.deviation < result.prior[1]) and 0.5 < result.chi_square < 1.5
    assert not result.undetermined()
    assert np.mean(result.residual_orders < result.noise_orders[:, None]) > 0.8  # 95 % but for what the fit takes
    np.testing.assert_allclose(np.diag(result.correlation), 1.0)


@pytest.mark.slow
def test_one_torque_cannot_tell_its_scale_and_names_the_torque_that_would():
    one = found(TORQUES[1:2], candidates=(60.0, 240.0))
    assert any("torque_scale" in line and "cannot be told" in line for line in one.undetermined())
    scale = one.names.index("torque_scale")
    assert one.deviation[scale] > 0.7 * one.prior[1, scale]  # the prior is nearly all that is known
    # the same torque once more says little, another one most
    assert one.best_candidate == 240.0


@pytest.mark.slow
def test_true_values_lie_within_two_deviations_where_finite_elements_made_the_data():
    """Four unknowns of reliefs of class 6, torque scale and offset: at least 90 of 100 draws, each unknown."""
    structure = jg.finite_element_compliance(gear_pair())
    true_mesh = jg.prepare(gear_pair(), compliance=structure, resolution=SLIDING)
    limits = [ToleranceClass.of(gear, 6).profile_total / 3 for gear in gear_pair().gears]
    names = "pinion", "pinion_length", "wheel", "wheel_length"
    prior = dict(zip(names, ((10.0, float(limits[0])), (4.0, 0.4), (10.0, float(limits[1])), (4.0, 0.4))))

    def reliefs(unknown):
        return tuple(jg.TipRelief(unknown[side], unknown[f"{side}_length"]) for side in ("pinion", "wheel"))

    def measured(values):
        flanks, torques = reliefs(dict(zip(names, values))), jnp.asarray(TORQUES) * values[4]
        return jax.vmap(lambda torque: solve_case(true_mesh, torque, *flanks).transmission_error)(torques) + values[5]

    mean, spread = np.array([*prior.values(), (1.0, 0.01), (0.0, 5.0)]).T
    rng = np.random.default_rng(0)
    true = mean + spread * np.clip(rng.standard_normal((100, 6)), -2.4, 2.4)  # reliefs, no bumps
    read = np.asarray(jax.jit(lambda all: jax.lax.map(measured, all))(jnp.asarray(true))).reshape(100, -1)
    read = jnp.asarray(read + NOISE * rng.standard_normal(read.shape))
    phase, torque = np.tile(np.asarray(mesh().phase), 3), np.repeat(TORQUES, 16)

    @jax.jit
    def estimates(readings):
        def one(reading):
            data = Measurement(phase, torque, reading, noise=NOISE)
            found = identify(mesh(), data, reliefs, prior, offset=5.0)
            return found.estimate, found.deviation, found.converged

        return jax.lax.map(one, readings, batch_size=5)

    estimate, deviation, converged = estimates(read)
    inside = np.sum(np.abs(np.asarray(estimate) - true) <= 2 * np.asarray(deviation), axis=0)
    assert np.sum(converged) >= 98 and np.all(inside >= 90), inside


@pytest.mark.slow
def test_single_precision_finds_what_double_precision_finds():
    def single(unknown):
        return tuple(jg.TipRelief(unknown[gear], jnp.float32(4.0)) for gear in PRIOR)

    given = jax.tree.map(lambda leaf: leaf.astype("float32") if eqx.is_inexact_array(leaf) else leaf, mesh())
    data = Measurement(*readings(TORQUES), noise=NOISE)
    result, exact = identify(given, data, single, PRIOR, offset=10.0), found(TORQUES)
    assert result.estimate.dtype == "float32" and result.converged
    np.testing.assert_allclose(result.estimate, exact.estimate, atol=0.02 * np.min(exact.deviation[:2]))
    np.testing.assert_allclose(result.deviation, exact.deviation, rtol=0.01)


@pytest.mark.slow
def test_lead_modifications_are_found_exactly_without_noise():
    """Crowning and slope, which the transmission error shows by the softer contact."""
    true, prior = {"crowning": 6.0, "slope": 4.0}, {"crowning": (8.0, 3.0), "slope": (6.0, 3.0)}
    meshed = jg.prepare(gear_pair(), resolution=FACE)

    def flanks(unknown):
        return jg.LeadCrowning(unknown["crowning"]), jg.LeadSlope(unknown["slope"])

    torques, made = (60.0, 120.0), flanks(dict(zip(true, map(jnp.asarray, true.values()))))
    value = [solve_case(meshed, jnp.asarray(torque), *made).transmission_error for torque in torques]
    data = Measurement(np.tile(meshed.phase, 2), np.repeat(torques, 8), jnp.concatenate(value), noise=1e-6)
    result = identify(meshed, data, flanks, prior, torque_scale=None, model_error=0.0)
    assert result.converged
    np.testing.assert_allclose(result.estimate, list(true.values()), atol=1e-6)


@pytest.mark.slow
def test_an_error_of_the_model_widens_the_deviations():
    phase, torque, value = readings(TORQUES)
    error = 0.5 * torque / max(TORQUES) * np.cos(2 * np.pi * phase)
    options = {"design": design, "prior": PRIOR, "offset": 10.0, "model_error": 0.0}
    right = identify(mesh(), Measurement(phase, torque, value, noise=NOISE), **options)
    wrong = identify(mesh(), Measurement(phase, torque, value + error, noise=NOISE), **options)
    assert wrong.model_error > 2 * right.model_error
    assert np.all(wrong.deviation[:2] > 1.2 * right.deviation[:2])


@pytest.mark.slow
def test_repeats_tell_the_noise():
    phase, torque, value = (np.tile(column, 30) for column in readings(TORQUES[:1]))
    value = value + NOISE * np.random.default_rng(2).standard_normal(len(value))
    result = identify(mesh(), Measurement(phase, torque, value), design, PRIOR, offset=10.0, steps=1)
    np.testing.assert_allclose(result.noise, NOISE / np.sqrt(30), rtol=0.1)


@pytest.mark.slow
def test_all_pitch_deviations_are_told_once_all_teeth_have_met():
    """Within two deviations; over one revolution of the wheel the sums of the teeth that met alone are."""
    pair = gear_pair((16, 17), bores=(20.0, 22.0))
    mesh, draw = jg.prepare(pair, resolution=SLIDING), np.random.default_rng(3).standard_normal
    single = [of - of.mean() for of in (2.5 * draw(16), 2.5 * draw(17))]
    teeth = Teeth(*map(TeethDeviations.from_single_pitch, single))
    flanks = design(dict(zip(TRUE, map(jnp.asarray, TRUE.values()))))
    found = solve_revolution(mesh, 60.0, teeth, pinion=flanks[0], wheel=flanks[1])
    value = np.asarray(found.transmission_error) + NOISE * draw(272 * 16)

    def told(rows):
        data = Measurement(found.phase[:rows], np.full(rows, 60.0), value[:rows], noise=NOISE)
        result = identify(mesh, data, design, PRIOR, offset=10.0, single_pitch=(2.5, 2.5))
        every = np.concatenate([np.stack(result.single_pitch[gear]) for gear in ("pinion", "wheel")], axis=1)
        assert result.converged and np.mean(np.abs(every[0] - np.concatenate(single)) < 2 * every[1]) > 0.85
        assert abs(sum(result.single_pitch["pinion"][0])) < 1e-9
        return result, every[1]

    whole, deviation = told(272 * 16)
    assert np.max(deviation) < 0.1 and not any("pitch" in line for line in whole.undetermined())
    np.testing.assert_allclose(whole.estimate[:2], list(TRUE.values()), atol=0.1)
    turn, deviation = told(17 * 16)
    assert np.median(deviation) > 1.0
    # 31 are independent; 17 pairs that meet, with that of the next revolution, tell 17 at most
    (line,) = (line for line in turn.undetermined() if "pitch" in line)
    assert 13 <= int(line.split()[0]) <= 16 and "their sum alone is seen" in line


@pytest.mark.parametrize(
    "options, says",
    [
        ({"offset": None}, "offset must be unknown with pitch deviations"),
        ({"single_pitch": (2.0, 0.0)}, "single_pitch of the wheel"),
        ({}, "phase covers 0.94 base pitches, pitch deviations need whole revolutions"),
        ({"phase": lambda phase: 2 * phase, "prior": {"wheel_pitch_3": (0.0, 1.0)}}, "choose another name"),
    ],
)
def test_pitch_deviations_need_whole_revolutions_and_an_offset(options, says):
    given = {"offset": 10.0, "single_pitch": (2.0, 2.0), "phase": lambda phase: phase, "prior": PRIOR, **options}
    columns = np.tile(np.arange(16) / 16, 3), np.repeat(TORQUES, 16), np.arange(48.0)
    data = Measurement(given.pop("phase")(columns[0]), *columns[1:], noise=NOISE)
    with pytest.raises(ValueError, match=says):
        identify(mesh(), data, design, given.pop("prior"), **given)


@pytest.mark.parametrize(
    "change, says",
    [
        ({"phase": lambda column: column[:10]}, "phase has 10 rows, must have 12 at least"),
        ({"torque": lambda column: column[:20]}, "torque has 20 rows, phase 48"),
        ({"phase": lambda column: 0.5 * column}, "phase does not cover a base pitch at 30 N m"),
        ({"transmission_error": lambda column: np.where(column > 20, np.nan, column)}, "transmission_error"),
        ({"torque": lambda column: -column}, "torque"),
    ],
)
def test_data_that_cannot_be_meant_are_refused_by_column(change, says):
    columns = {"phase": np.tile(np.arange(16) / 16, 3), "torque": np.repeat(TORQUES, 16)}
    columns["transmission_error"] = np.arange(48.0)
    columns |= {name: of(columns[name]) for name, of in change.items()}
    with pytest.raises(ValueError, match=says) as refused:
        Measurement(**columns, noise=NOISE)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "options, says",
    [
        ({"prior": {}}, "prior must name at least one unknown"),
        ({"prior": {**PRIOR, "pinion": (8.0, 0.0)}}, "prior standard deviation of pinion"),
        ({"prior": {**PRIOR, "crowning": (0.0, 3.0)}}, 'nothing depends on "crowning"'),
        ({"prior": {**PRIOR, "offset": (0.0, 3.0)}}, "give offset = its standard deviation"),
        ({"noise": None}, "noise = None needs 12 repeated readings"),
        ({"steps": 0}, "steps = 0"),
    ],
)
def test_impossible_questions_are_refused(options, says):
    given = {"prior": PRIOR, "noise": NOISE, "steps": 3, **options}
    data = Measurement(*GOOD.values(), noise=given["noise"])
    with pytest.raises(ValueError, match=says):
        identify(mesh(), data, design, given["prior"], steps=given["steps"])


def rows(columns):
    table = zip(*(np.char.mod("%.6g", column) for column in columns.values()))
    return "\n".join([",".join(columns), *map(",".join, table)])


def test_revolutions_are_counted_where_angles_begin_anew(tmp_path):
    columns = {"angle_deg": GOOD["phase"] * 360 / 19, **{name: GOOD[name] for name in ("torque_Nm", "te_um")}}
    (tmp_path / "te.csv").write_text(rows(columns | {"revolution": np.arange(16) % 2 + 1}))
    read = read_measurement(tmp_path / "te.csv", mesh().pair, noise=0.2)
    np.testing.assert_allclose(read.phase, GOOD["phase"] + 19 * (np.arange(16) % 2), atol=1e-5)


@pytest.mark.parametrize("unit", ["phase", "angle_deg"])
def test_a_file_is_read_by_phase_or_angle(tmp_path, unit):
    columns = {(unit if name == "phase" else name): column for name, column in GOOD.items()}
    if unit == "angle_deg":
        columns[unit] = columns[unit] * 360 / 19
    (tmp_path / "te.csv").write_text(rows(columns | {"revolution": np.ones(16)}))
    read = read_measurement(tmp_path / "te.csv", mesh().pair, noise=0.2)
    np.testing.assert_allclose(read.phase, GOOD["phase"], atol=1e-5)
    np.testing.assert_allclose([read.torque, read.transmission_error], [GOOD["torque_Nm"], GOOD["te_um"]])


@pytest.mark.parametrize(
    "heading, per_micrometre",
    [
        ("te_mm", lambda radius: 1e-3),
        ("TE [\u00b5m]", lambda radius: 1.0),
        ("te_{}_deg", lambda radius: 1e-3 / radius * 180 / np.pi),
        ("te_{}_arcsec", lambda radius: 1e-3 / radius * 180 / np.pi * 3600),
        ("TE {} [arc-sec]", lambda radius: 1e-3 / radius * 180 / np.pi * 3600),
        ("te_{}_rad", lambda radius: 1e-3 / radius),
        ("te_{} (\u00b5rad)", lambda radius: 1e3 / radius),
    ],
)
@pytest.mark.parametrize("teeth, shaft", [(19, "pinion"), (48, "wheel")])
def test_errors_in_other_units_are_lengths_on_the_line_of_action(tmp_path, heading, per_micrometre, teeth, shaft):
    """An angle of a shaft by the base radius of its gear, of module 3 and 20 degrees, by hand."""
    scale = per_micrometre(1.5 * teeth * np.cos(np.deg2rad(20.0)))
    columns = {name: column for name, column in GOOD.items() if name != "te_um"}
    lines = rows(columns | {heading.format(shaft): np.zeros(16)}).splitlines()
    texts = [lines[0], *(line[:-1] + repr(float(scale * value)) for line, value in zip(lines[1:], GOOD["te_um"]))]
    (tmp_path / "te.csv").write_text("\n".join(texts), encoding="utf-8")
    read = read_measurement(tmp_path / "te.csv", gear_pair(), noise=0.2)
    np.testing.assert_allclose(read.transmission_error, GOOD["te_um"], rtol=1e-12)


@pytest.mark.parametrize(
    "columns, says",
    [
        ({name: GOOD[name] for name in ("phase", "te_um")}, "torque_Nm: missing, this column is required"),
        ({name: GOOD[name] for name in ("torque_Nm", "te_um")}, "phase: there must be one of the columns"),
        (GOOD | {"te_mm": GOOD["te_um"]}, "has several columns of te_um: te_um, te_mm, must have one"),
        (GOOD | {"te_wheel_deg": GOOD["te_um"]}, "te_wheel_deg: has no effect beside te_um, leave one out"),
        (
            {"te_arcsec" if name == "te_um" else name: column for name, column in GOOD.items()},
            "te_arcsec: is an angle of one shaft: name it te_wheel_arcsec or te_pinion_arcsec (1 arcsec is ",
        ),
        (GOOD | {"torque_Nm": 1e3 * GOOD["torque_Nm"]}, "torque_Nm: 60000 N m is more than the teeth carry"),
        (GOOD | {"te_um": 1e-6 * GOOD["te_um"]}, "te_um: varies by 1.5e-05 um only"),
        (GOOD | {"te_um": 1e3 * GOOD["te_um"]}, "te_um: varies by 15000 um"),
        (GOOD | {"te_um": np.where(GOOD["te_um"] > 9, np.nan, 1.0)}, 'te_um of point 11 is "nan", must be a number'),
        (GOOD | {"revolution": 0.5 * np.arange(16)}, "revolution: must be whole numbers"),
        (GOOD | {"phase": 0.5 * GOOD["phase"]}, "phase: does not cover a base pitch at 30 N m"),
        ({name: column[:10] for name, column in GOOD.items()}, "phase: has 10 rows, must have 12 at least"),
        (GOOD | {"torque_Nm": -GOOD["torque_Nm"]}, "torque_Nm: "),
    ],
)
def test_bad_files_are_refused_in_one_line_with_the_column(tmp_path, columns, says):
    (tmp_path / "te.csv").write_text(rows(columns))
    with pytest.raises(DesignFileError) as refused:
        read_measurement(tmp_path / "te.csv", mesh().pair)
    assert f"te.csv: {says}" in str(refused.value) and "\n" not in str(refused.value)
