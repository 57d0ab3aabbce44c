"""Numbers that reports of commercial programs and an ISO technical report print, against those of this package.

`published.csv` has the numbers as they are printed: one row for each, of a pair in `SETS` and a quantity in
`QUANTITIES`, with the index 1 or 2 of a gear behind the symbol where the quantity has one. A number holds within 0.1 %
or half a unit of the last printed digit; a row with a note says why it does not.
"""

import csv
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import pytest
from helical_pairs import SIZES

import jaxgear as jg
from jaxgear import metrics
from jaxgear.contact.kinematics import kinematics
from jaxgear.geometry import diameter, drawn_gear, margins, measures, outline, path_of_contact, teeth_spanned
from jaxgear.geometry.margins import play_between
from jaxgear.metrics.stress import (
    contact_factor_squares,
    critical_section,
    root_helix_factor,
    single_contact_factors,
)
from jaxgear.numerics import changed, real
from jaxgear.shafts import method_c
from jaxgear.tolerance import ToleranceClass, iso_rounded

FILE = Path(__file__).with_name("published.csv")
ROWS = list(csv.DictReader(line for line in FILE.read_text().splitlines() if not line.startswith("#")))


class Published(NamedTuple):
    """A pair, and how it was loaded and measured.

    Attributes:
        gears: pinion and wheel.
        center_distance: [mm].
        spanned: number of teeth of the span of either gear.
        balls: diameter of the measuring balls of either gear [mm].
        force: F_t on the reference circle [N].
    """

    gears: tuple[jg.Gear, jg.Gear]
    center_distance: float
    spanned: tuple[float, float] = (3.0, 3.0)
    balls: tuple[float, float] = (5.0, 5.0)
    force: float = 1000.0


def published(
    teeth,
    module,
    shift,
    distance,
    width,
    tips,
    rack,
    *,
    beta=0.0,
    modulus=206_000.0,
    form=None,
    blank=(1.0, 1.0),
    bores=None,
    **more,
):
    """A function that makes the pair with tooth thickness allowances [um], or with spans over the numbers of teeth.

    All of its gears have one tree structure, so that one program serves all pairs: helical with an angle of 0 deg, and
    with a web, of a share `blank` of rim over module and web over face width.
    """

    def of(allowances=(0.0, 0.0), spans=None):
        gears = []
        for side, hand in enumerate((beta, -beta)):
            thickness = {"tooth_thickness_allowance": allowances[side]}
            if spans is not None:
                thickness = {"span": spans[side], "teeth_spanned": int(more["spanned"][side])}
            gear = drawn_gear(
                teeth=teeth[side], module=module, profile_shift=shift[side], face_width=width, helix_angle=hand,
                tip_diameter=tips[side], tip_form_diameter=(form or tips)[side], dedendum=rack[0], root_radius=rack[1],
                material=jg.Material(modulus), bore_diameter=(bores or (0.4 * tips[0], 0.4 * tips[1]))[side],
                tip_edge_radius=0.02 * module,
                rim_thickness=blank[0] * module, web_thickness=blank[1] * width, **thickness,
            )  # fmt: skip
            gears.append(changed(gear, helix_angle=real(hand)))
        return Published(tuple(gears), distance, **more)

    return of


STAGE_3 = published(
    (24, 95), 14.0, (0.48, 0.6691), 861.0, 360.0, (380.747, 1395.376), (1.25, 0.38), beta=10.0, spanned=(4.0, 13.0),
    balls=(28.0, 25.0), force=40953e3 / (0.5 * 341.18334), blank=(5.0, 0.25),
)  # fmt: skip
STAGE_1 = published((19, 17), 45.0, (0.6170, 0.8021), 863.0, 491.0, (978.808, 905.470), (1.25, 0.38))
EXAMPLE_1 = published(
    (17, 103), 8.0, (0.14522, 0.0), 500.0, 100.0, (159.66, 872.35), (1.4, 0.39), beta=15.8, spanned=(2.0, 13.0),
    force=127352.0,
)  # fmt: skip
FZG_C = published(
    (16, 24), 4.5, (0.1818, 0.1714), 91.5, 14.0, (82.45, 118.35), (1.39, 0.25), modulus=210_000.0, spanned=(3.0, 4.0),
    balls=(8.0, 7.5), force=130e3 / 36.0, bores=(30.0, 30.0),
)  # fmt: skip
HELIX_20 = published(
    (25, 65), 5.0, (0.25, 0.0686), 241.0, 50.0, (145.522, 356.544), (1.25, 0.30), beta=20.0, spanned=(5.0, 10.0),
    balls=(10.0, 9.0),
)  # fmt: skip
HELIX_30 = published(
    (25, 40), 3.0, (0.3, -0.1), 113.175, 30.0, (94.403, 143.964), (1.25, 0.38), beta=30.0, spanned=(6.0, 7.0),
    balls=(6.5, 6.0),
)  # fmt: skip
CHAMFER = published(
    (20, 34), 2.0, (0.2, 0.1), 54.578, 20.0, (44.8, 72.4), (1.25, 0.25), form=(44.4, 71.8), spanned=(3.0, 5.0),
    balls=(3.5, 3.5),
)  # fmt: skip
UNDERCUT = published(
    (12, 40), 2.0, (0.0, 0.0), 52.0, 20.0, (28.0, 83.166), (1.25, 0.25), spanned=(3.0, 5.0), balls=(4.0, 3.5)
)

SETS: dict[str, Callable[[], Published]] = {
    "KS-stage3": STAGE_3,
    "KS-stage3 upper": lambda: STAGE_3((-130.0, -240.0)),
    "KS-stage3 lower": lambda: STAGE_3((-190.0, -340.0)),
    "KS-stage1": STAGE_1,
    "TR30-ex1": EXAMPLE_1,
    "TR30-ex1 span": lambda: EXAMPLE_1(spans=(38.196, 307.943)),
    "ST-fzgC": FZG_C,
    "ST-fzgC upper": lambda: FZG_C((-85.0, -85.0)),
    "ST-fzgC lower": lambda: FZG_C((-125.0, -125.0)),
    "ST-helix20": HELIX_20,
    "ST-helix20 upper": lambda: HELIX_20((-115.0, -155.0)),
    "ST-helix30": HELIX_30,
    "ST-helix30 upper": lambda: HELIX_30((-85.0, -115.0)),
    "ST-chamfer": CHAMFER,
    "ST-undercut": UNDERCUT,
    "ST-undercut upper": lambda: UNDERCUT((-65.0, -85.0)),
    "ST-undercut usable": published(
        (12, 40), 2.0, (0.0, 0.0), 52.0, 20.0, (28.0, 83.166), (1.25, 0.25), form=(28.0, 82.285)
    ),
}


class Known(NamedTuple):
    """A pair with what several quantities are read from, each found once; leaves of `both` have an axis of gears."""

    case: Published
    pair: jg.GearPair
    both: jg.Gear
    path: Any
    contact: Any
    root: Any
    section: Any
    stiffness: Any
    measures: Any


def stacked(trees: Any) -> Any:
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *trees)


def known(case: Published) -> Known:
    pair, both = jg.GearPair(*case.gears, case.center_distance), stacked(case.gears)
    path = path_of_contact(pair)
    return Known(
        case=case,
        pair=pair,
        both=both,
        path=path,
        contact=contact_factor_squares(pair, path),
        root=stacked(single_contact_factors(pair, path)),
        section=jax.vmap(critical_section)(both),
        stiffness=jg.sizing.iso_stiffness(pair),
        measures=jax.vmap(measures)(both, jnp.asarray(case.spanned), jnp.asarray(case.balls)),
    )


def active_root(of: Known):
    path = of.path
    return diameter(of.both, jnp.stack([path.pinion_roll_length(path.start), path.wheel_roll_length(path.end)]))


def active_tip(of: Known):
    path = of.path
    return diameter(of.both, jnp.stack([path.pinion_roll_length(path.end), path.wheel_roll_length(path.start)]))


def play(of: Known):
    return play_between(*of.pair.gears, jnp.tan(of.pair.working_pressure_angle))


def tip_land(gear: jg.Gear):
    """s_an, normal to the tooth."""
    inclined = jnp.tan(jnp.deg2rad(gear.helix_angle)) * gear.tip_radius / gear.pitch_radius
    return gear.tip_land * jnp.cos(jnp.arctan(inclined))


def contact_stress(of: Known):
    """sigma_H0."""
    gear, z = of.pair.pinion, of.contact
    squares = z.zone * z.elasticity * z.contact_ratio * z.helix_angle * (1 + 1 / of.pair.gear_ratio)
    return jnp.sqrt(squares * of.case.force / (2 * gear.pitch_radius * of.pair.face_width))


def root_stress(of: Known):
    """sigma_F0."""
    line_load = of.case.force / (of.pair.face_width * of.pair.pinion.module)
    return line_load * of.root.form * of.root.correction * root_helix_factor(of.pair)


QUANTITIES: dict[str, Callable[[Known], Any]] = {
    "alpha_t": lambda of: jnp.rad2deg(of.pair.pinion.transverse_pressure_angle),
    "alpha_wt": lambda of: jnp.rad2deg(of.pair.working_pressure_angle),
    "beta_b": lambda of: jnp.rad2deg(of.pair.pinion.base_helix_angle),
    "mt": lambda of: of.pair.pinion.transverse_module,
    "a": lambda of: jg.GearPair(*of.pair.gears).working_center_distance,
    "d": lambda of: 2 * of.both.pitch_radius,
    "db": lambda of: 2 * of.both.base_radius,
    "da": lambda of: 2 * of.both.tip_radius,
    "df": lambda of: 2 * of.both.root_circle_radius,
    "dFf": lambda of: diameter(of.both, jax.vmap(outline)(of.both).form_roll_length),
    "dNa": active_tip,
    "dNf": active_root,
    "dw": lambda of: 2 * of.both.base_radius / jnp.cos(of.pair.working_pressure_angle),
    "zn": lambda of: of.both.virtual_teeth,
    "san": lambda of: jax.vmap(tip_land)(of.both),
    "x_E": lambda of: of.both.generating_profile_shift,
    "Wk": lambda of: of.measures.span,
    "MdK": lambda of: of.measures.over_balls,
    "j_n": lambda of: 1e-3 * play(of) * jnp.cos(of.pair.pinion.base_helix_angle),
    "g": lambda of: of.path.end - of.path.start,
    "pet": lambda of: of.pair.base_pitch,
    "eps_a": lambda of: of.path.contact_ratio,
    "eps_b": lambda of: of.pair.overlap_ratio,
    "eps_g": lambda of: of.pair.overlap_ratio + of.path.contact_ratio,
    "Z_H": lambda of: jnp.sqrt(of.contact.zone),
    "Z_E": lambda of: jnp.sqrt(of.contact.elasticity),
    "Z_eps": lambda of: jnp.sqrt(of.contact.contact_ratio),
    "Z_beta": lambda of: jnp.sqrt(of.contact.helix_angle),
    "Z_B": lambda of: jnp.sqrt(of.contact.pinion_single_pair),
    "Z_D": lambda of: jnp.sqrt(of.contact.wheel_single_pair),
    "sigma_H0": contact_stress,
    "Y_F": lambda of: of.root.form,
    "Y_S": lambda of: of.root.correction,
    "hF": lambda of: of.root.lever_arm / of.both.module,
    "sFn": lambda of: of.section.chord / of.both.module,
    "rhoF": lambda of: of.section.fillet_radius / of.both.module,
    "Y_beta": lambda of: root_helix_factor(of.pair),
    "sigma_F0": root_stress,
    "c'_th": lambda of: of.stiffness.theoretical,
    "c'": lambda of: of.stiffness.single,
    "c_ga": lambda of: of.stiffness.mesh,
}
SPANNED = {row["set"] for row in ROWS if row["quantity"] in ("k1", "f_pT1")}
DIFFERENCES = {"A_We": "Wk", "A_Mde": "MdK"}  # by which an allowance changes another quantity


@jax.jit
def everything(case: Published) -> dict[str, Any]:
    """All quantities of a pair, which is traced: also of one that cannot run."""
    shared = known(case)
    return {name: of(shared) for name, of in QUANTITIES.items()}


def values_of(name: str) -> dict[str, Any]:
    return everything(jax.tree.map(jnp.asarray, SETS[name]()))


class Rated(NamedTuple):
    """How a pair was run, and what its report takes further factors from.

    Attributes:
        torque, speed: of the pinion [N m, rpm].
        application, dynamic, face, transverse: K_A, K_v, K_Hbeta and K_Halpha as printed.
        oil: with the oil's and the flanks' numbers.
        bulk: temperature of the teeth as printed [degC].
    """

    torque: float
    speed: float
    application: float
    dynamic: float
    face: float
    transverse: float
    oil: metrics.Lubricant
    bulk: float


RATED: dict[str, Rated] = {
    "KS-stage3": Rated(
        40953.0, 1165.9, 1.25, 1.092, 1.15, 1.069,
        metrics.Lubricant(220.0, 19.0, 80.0, 0.6, density=890.0, bulk="loss", permissible_film=0.143), 85.0,
    ),
    "ST-fzgC upper": Rated(
        130.0, 1500.0, 1.0, 1.03, 1.32, 1.0,
        metrics.Lubricant(90.02, 10.41, 60.0, 0.3, density=884.1, bulk="loss", permissible_film=1.0), 72.1,
    ),
}  # fmt: skip


A = 1, 2, 0  # the middle pair in the middle of the face at the first position


def at_the_start(pair: jg.GearPair, torque, speed) -> jg.MeshCycle:
    """A single contact at A, with the share of the load that reports of helical gears have there, 1.3 / eps_alpha."""
    path = path_of_contact(pair)
    of = kinematics(pair, path.start * (1 - 1e-9) / path.base_pitch, SIZES, "strain")
    none, curve = jnp.zeros((3, 5, 8)), jnp.zeros(8)
    load = none.at[A].set(1e3 * torque / pair.pinion.base_radius / pair.face_width * 1.3 / path.contact_ratio)
    force, status = jnp.sum(load, axis=1) * pair.face_width / 5, jnp.zeros(8, jnp.int8)
    point = jg.OperatingPoint(torque, speed)
    return jg.MeshCycle(
        of, margins(pair), point, None, None, curve, curve, load, force, none, none, none, none, curve, curve, status
    )


@jax.jit
def rating(case: Published, rated: Rated) -> dict[str, Any]:
    """What the lubricant makes of the contact at A, and K_Hbeta by method C."""
    pair = jg.GearPair(*case.gears, case.center_distance)
    cycle = at_the_start(pair, rated.torque, rated.speed)
    factor = rated.application * rated.dynamic * rated.face * rated.transverse
    oil = replace(rated.oil, load_factor=factor)
    schlenk, flash, film = (
        metrics.friction_coefficient(cycle, replace(oil, friction=law))
        for law in ("schlenk", "iso_6336_20", "iso_6336_22")
    )
    # the film at the temperature of the report, which has the loss of the geometry in place of that of the contact
    oil = replace(oil, friction="iso_6336_22")
    rise = metrics.bulk_temperature(cycle, oil) - oil.temperature
    oil = replace(oil, cooling_factor=(rated.bulk - oil.temperature) / rise)
    loss, path = metrics.ohlendorf_loss_factor(pair), path_of_contact(pair)
    power = rated.torque * rated.speed * jnp.pi / 30
    pressure = cycle.contact_pressure[A]
    line_load = rated.application * 1e3 * rated.torque / pair.pinion.pitch_radius / pair.face_width
    return {
        "Ft": metrics.rating_factors(cycle)["tangential_force_N"],
        "K_Hbeta": method_c(line_load * rated.dynamic, 0.85 * jg.sizing.iso_stiffness(pair).mesh, 6.0, 8.0),
        "K_Bgamma": metrics.helical_load_factor(pair),
        "H_v": loss,
        "mu_mz": schlenk,
        "mu_20": flash,
        "mu_22": film,
        "P_VZP": power * schlenk * loss,
        "eta_zP": 1 - schlenk * loss,
        "rho_nA": path.reduced_radius(path.start) / jnp.cos(pair.pinion.base_helix_angle),
        "p_HA": pressure,
        "p_dynA": pressure * jnp.sqrt(factor),
        "h_A": metrics.film_thickness(cycle, oil)[A],
        "lambda_A": metrics.specific_film_thickness(cycle, oil)[A],
        "S_lambda": metrics.micropitting_safety(cycle, oil)[A],
    }


def tolerances(gears: tuple[jg.Gear, jg.Gear]) -> dict[str, Any]:
    """Single pitch and base pitch deviations of both gears in class 5 [um]."""
    pitch = [iso_rounded(ToleranceClass.of(gear, 5).single_pitch) for gear in gears]
    return {"f_pT": pitch, "f_pb": [of * jnp.cos(gear.transverse_pressure_angle) for of, gear in zip(pitch, gears)]}


def found_for(name: str, values: dict[str, Any]) -> float:
    """The number of a row, with the index of a gear or without."""
    return float(values[name]) if name in values else float(values[name[:-1]][int(name[-1]) - 1])


@pytest.mark.parametrize("name", SETS)
def test_numbers_of_reports(name):
    values, nominal, missed = values_of(name), values_of(name.partition(" ")[0]), []
    values |= {quantity: values[of] - nominal[of] for quantity, of in DIFFERENCES.items()}
    if name in RATED:
        values |= rating(*jax.tree.map(jnp.asarray, (SETS[name](), RATED[name])))
    if name in SPANNED:
        gears = SETS[name]().gears
        values |= tolerances(gears) | {"k": [teeth_spanned(gear) for gear in gears]}
    for row in (row for row in ROWS if row["set"] == name and not row["note"]):
        printed, found = float(row["printed"]), found_for(row["quantity"], values)
        half_unit = 0.5 * 10.0 ** -len(row["printed"].partition(".")[2])
        if not abs(found - printed) <= max(1e-3 * abs(printed), half_unit):
            missed.append(f"{row['quantity']} = {found:.7g}, printed {row['printed']}")
    assert not missed


def test_every_row_is_read_once():
    assert {row["set"] for row in ROWS} == set(SETS)
    assert len(ROWS) == len({(row["set"], row["quantity"]) for row in ROWS}) > 200
