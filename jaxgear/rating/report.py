"""The rating as an engineer hands it in: safeties first, then the chain of factors, spectrum, temperatures and films.

Rows are in the order of the formulas, symbol, words, pinion, wheel, unit and where the number is from, so that they lie
beside the print of another program: factors with three decimals, stresses and safeties with two.
"""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..report import Chapter, Figure, Part, Table
from .chain import PairRating, Spectrum, Verdict
from .load_sharing import POINTS
from .settings import Rating
from .thermal import ThermalRating

_HEADER = "symbol", "meaning", "pinion", "wheel", "unit", "from"
_NONE = "-"
_COMPUTED, _GIVEN, _CONTACT = "computed", "given", "contact analysis"


class Row(NamedTuple):
    """A number of both gears, or of the mesh.

    Attributes:
        symbol: of the standard.
        words: what it is.
        values: of pinion and wheel, or one of the mesh.
        unit: "" for a pure number.
        digits: decimals.
        origin: where it is from.
    """

    symbol: str
    words: str
    values: Any
    unit: str = ""
    digits: int = 3
    origin: str = _COMPUTED

    @property
    def numbers(self) -> tuple[float, ...]:
        """One number of the mesh, or those of pinion and wheel."""
        return tuple(map(float, np.ravel(np.asarray(self.values))))

    @property
    def cells(self) -> tuple[str, ...]:
        """Texts of a line of a table; a number of the mesh stands in the column of the pinion."""
        shown = [shown_as(number, self.digits) for number in self.numbers]
        return (self.symbol, self.words, *shown, *[""] * (2 - len(shown)), self.unit, self.origin)


class Safety(NamedTuple):
    """A safety with the one that is required; NaN where one is not known."""

    symbol: str
    words: str
    values: Any
    required: Any


def shown_as(number: float, digits: int) -> str:
    """A number in fixed decimals; without a value "-"."""
    return f"{number:.{digits}f}" if np.isfinite(number) else _NONE


def safeties(found: PairRating, thermal: ThermalRating, rating: Rating) -> list[Safety]:
    """Required and reached safeties, those on both gears and those of the mesh."""
    flank, root = rating.required_pitting_safety, rating.required_root_safety
    scuffing, film = rating.required_scuffing_safety, rating.required_micropitting_safety
    return [
        Safety("S_F", "tooth root", found.bending.safety, root),
        Safety("S_H", "flank", found.pitting.safety, flank),
        Safety("S_F,stat", "tooth root, static", found.bending.static_safety, root),
        Safety("S_H,stat", "flank, static", found.pitting.static_safety, flank),
        Safety("S_B", "scuffing, flash temperature", thermal.flash.safety, scuffing),
        Safety("S_intS", "scuffing, integral temperature", thermal.integral.safety, scuffing),
        Safety("S_lambda", "micropitting, method B", thermal.micropitting.safety, film),
    ]


def rows(found: PairRating, thermal: ThermalRating, rating: Rating) -> dict[str, list[Row]]:
    """Rows of the chain of factors by the title of their table."""
    return {
        "load factors": [*_mesh(found, rating)],
        "flank": [*_flank(found, rating)],
        "tooth root": [*_root(found, rating)],
        "scuffing, flash temperature": [*_flash(thermal)],
        "scuffing, integral temperature": [*_integral(thermal)],
        "micropitting, method B": [*_micropitting(thermal)],
        "losses": [*_losses(thermal)],
    }


def _origin(given: object, else_: str = _COMPUTED) -> str:
    return else_ if given is None else _GIVEN


def _mesh(found: PairRating, rating: Rating) -> Iterator[Row]:
    geometry, factors = found.geometry, found.factors
    yield Row("F_t", "tangential force", found.tangential_force, "N", 1)
    yield Row("v", "speed at the reference circle", found.speed, "m/s", 2)
    yield Row("eps_alpha", "transverse contact ratio", geometry.contact_ratio)
    yield Row("eps_beta", "overlap ratio", geometry.overlap_ratio)
    yield Row("eps_gamma", "total contact ratio", geometry.total_contact_ratio)
    yield Row("c'", "single stiffness", factors.single_stiffness, "N/(mm um)")
    yield Row("c_gamma_alpha", "mesh stiffness", factors.mesh_stiffness, "N/(mm um)")
    yield Row("c_gamma_beta", "mesh stiffness for the face load", factors.face_mesh_stiffness, "N/(mm um)")
    yield Row("m_red", "reduced mass", factors.reduced_mass, "kg/mm", 5)
    yield Row("n_E1", "resonance speed", factors.resonance_speed, "1/min", 0)
    yield Row("N", "resonance ratio", factors.resonance_ratio)
    yield Row("f_pb", "base pitch deviation", factors.base_pitch_deviation, "um", 1)
    yield Row("f_falpha", "profile form deviation", factors.profile_form_deviation, "um", 1)
    yield Row("y_p", "running-in of the pitch", factors.pitch_run_in, "um", 1)
    yield Row("y_f", "running-in of the profile", factors.form_run_in, "um", 1)
    yield Row("K_A", "application factor", factors.application, origin=_GIVEN)
    yield Row("K_gamma", "mesh load factor", factors.mesh, origin=_GIVEN)
    yield Row("K_v", "dynamic factor", factors.dynamic, origin=_origin(rating.dynamic_factor))
    face = "method C" if rating.shaft_deflection is not None else _origin(rating.face_load_factor, _CONTACT)
    yield Row("K_Hbeta", "face load factor, flank", factors.face, origin=face)
    root = _origin(rating.root_face_load_factor)
    yield Row("K_Fbeta", "face load factor, root", factors.root_face, origin=root)
    across = _origin(rating.transverse_load_factor)
    yield Row("K_Halpha", "transverse load factor, flank", factors.transverse, origin=across)
    yield Row("K_Falpha", "transverse load factor, root", factors.root_transverse, origin=across)
    yield Row("N_L", "load cycles", np.asarray(found.cycles) / 1e6, "1e6", 3)


def _flank(found: PairRating, rating: Rating) -> Iterator[Row]:
    flank, verdict = found.flank, found.pitting
    yield Row("Z_H", "zone factor", flank.zone)
    yield Row("Z_E", "elasticity factor", flank.elasticity, "sqrt(MPa)")
    yield Row("Z_eps", "contact ratio factor", flank.contact_ratio)
    yield Row("Z_beta", "helix angle factor", flank.helix_angle)
    yield Row("Z_B, Z_D", "single pair contact factor", flank.single_pair)
    yield Row("sigma_H0", "nominal contact stress", verdict.nominal_stress, "MPa", 2)
    yield Row("sigma_H", "contact stress", verdict.stress, "MPa", 2)
    limits = [gear.pitting_strength for gear in rating.gears]
    yield Row("sigma_Hlim", "endurance limit", limits, "MPa", 2, _material(rating, "pitting_limit"))
    yield Row("Z_L", "lubricant factor", flank.lubricant)
    yield Row("Z_v", "velocity factor", flank.velocity)
    yield Row("Z_R", "roughness factor", flank.roughness)
    yield Row("Z_W", "work hardening factor", flank.work_hardening)
    yield Row("Z_X", "size factor", flank.size)
    yield Row("Z_NT", "life factor", verdict.life_factor)
    yield from _reached(verdict, "H", limits, "product of the factors", rating)


def _root(found: PairRating, rating: Rating) -> Iterator[Row]:
    root, verdict = found.root, found.bending
    yield Row("x_E", "generating profile shift coefficient", root.generating_shift, "", 4)
    yield Row("h_Fe", "bending moment arm", root.lever_arm, "mm", 2)
    yield Row("s_Fn", "root chord", root.chord, "mm", 2)
    yield Row("rho_F", "root radius", root.fillet_radius, "mm", 2)
    yield Row("alpha_Fen", "load angle", root.load_angle, "deg", 2)
    yield Row("q_s", "notch parameter", root.notch)
    yield Row("Y_F", "form factor", root.form)
    yield Row("Y_S", "stress correction factor", root.correction)
    yield Row("Y_beta", "helix angle factor", root.helix_angle)
    yield Row("Y_B", "rim factor", root.rim)
    yield Row("Y_DT", "deep tooth factor", root.deep_tooth)
    yield Row("sigma_F0", "nominal root stress", verdict.nominal_stress, "MPa", 2)
    yield Row("sigma_F", "root stress", verdict.stress, "MPa", 2)
    limits = [gear.bending_strength for gear in rating.gears]
    yield Row("sigma_Flim", "endurance limit", limits, "MPa", 2, _material(rating, "bending_limit"))
    yield Row("Y_deltarelT", "notch sensitivity factor", root.notch_sensitivity)
    yield Row("Y_RrelT", "surface factor", root.surface)
    yield Row("Y_X", "size factor", root.size)
    yield Row("Y_M", "mean stress factor", root.mean_stress)
    yield Row("Y_NT", "life factor", verdict.life_factor)
    yield from _reached(verdict, "F", limits, "product of the factors, Y_ST = 2", rating)


def _reached(verdict: Verdict, index: str, limits: Any, product: str, rating: Rating) -> Iterator[Row]:
    """Rows from the product of the factors to the damage sum."""
    yield Row(f"sigma_{index}G / sigma_{index}lim", product, verdict.limit / np.asarray(limits))
    yield Row(f"sigma_{index}G", "limit strength", verdict.limit, "MPa", 2)
    yield Row(f"sigma_{index}P", "permissible stress", verdict.permissible, "MPa", 2)
    yield Row(f"S_{index}", "safety", verdict.safety, "", 2)
    if index == "H":
        yield Row("S_H^2", "safety on the torque", np.asarray(verdict.safety) ** 2, "", 2)
    yield Row(f"P_{index}", "transmittable power", verdict.power, "kW", 2)
    yield Row(f"sigma_{index}G,stat", "static strength", verdict.static_limit, "MPa", 2)
    yield Row(f"S_{index},stat", "static safety", verdict.static_safety, "", 2)
    if rating.service_life is not None:
        yield Row(f"U_{index}", "damage sum of the service life", verdict.damage, "", 4)


def _material(rating: Rating, name: str) -> str:
    names = [_GIVEN if getattr(gear, name) is not None else str(gear.heat_treatment) for gear in rating.gears]
    return " / ".join(dict.fromkeys(each.replace("_", " ") for each in names))


def _flash(thermal: ThermalRating) -> Iterator[Row]:
    flash = thermal.flash
    yield Row("w_Bt", "line load with the load factors", flash.line_load, "N/mm", 3)
    yield Row("C_eff", "optimal tip relief", flash.effective_relief, "um", 2)
    yield Row("X_alphabeta", "angle factor", flash.angle_factor)
    yield Row("X_M", "flash factor", flash.flash_factor, "", 3)
    yield Row("X_L", "lubricant factor", flash.lubricant_factor)
    yield Row("X_mp", "multiple path factor", flash.path_multiplicity_factor)
    yield Row("mu", "mean coefficient of friction", flash.friction)
    yield Row("theta_flm", "mean flash temperature", flash.mean_flash_temperature, "K", 2)
    yield Row("theta_M", "bulk temperature", flash.bulk_temperature, "degC", 2)
    yield Row("theta_Bmax", "largest contact temperature", flash.contact_temperature, "degC", 2)
    yield Row("theta_S", "scuffing temperature", flash.scuffing_temperature, "degC", 2)
    yield Row("S_B", "safety", flash.safety, "", 3)


def _integral(thermal: ThermalRating) -> Iterator[Row]:
    integral = thermal.integral
    yield Row("C_eff", "effective tip relief", integral.effective_relief, "um", 2)
    yield Row("K_Bgamma", "helical load factor", integral.helical_load_factor)
    yield Row("mu", "mean coefficient of friction", integral.friction)
    yield Row("X_R", "roughness factor", integral.roughness_factor)
    yield Row("X_E", "running-in factor", integral.running_in_factor)
    yield Row("X_BE", "geometry factor", integral.geometry_factor)
    yield Row("X_Q", "approach factor", integral.approach_factor)
    yield Row("X_Ca", "tip relief factor", integral.tip_relief_factor)
    yield Row("X_eps", "contact ratio factor", integral.contact_ratio_factor)
    yield Row("theta_flaE", "flash temperature at the tip", integral.tip_flash_temperature, "K", 2)
    yield Row("theta_flaint", "mean flash temperature", integral.mean_flash_temperature, "K", 2)
    yield Row("theta_M", "bulk temperature", integral.bulk_temperature, "degC", 2)
    yield Row("theta_int", "integral temperature", integral.integral_temperature, "degC", 2)
    yield Row("theta_intS", "scuffing integral temperature", integral.scuffing_temperature, "degC", 2)
    yield Row("S_intS", "safety", integral.safety, "", 3)
    yield Row("S_SL", "safety on the torque", integral.load_safety, "", 3)


def _micropitting(thermal: ThermalRating) -> Iterator[Row]:
    film = thermal.micropitting
    yield Row("mu", "mean coefficient of friction", film.friction)
    yield Row("X_R", "roughness factor", film.roughness_factor)
    yield Row("X_Ca", "tip relief factor", film.tip_relief_factor)
    yield Row("theta_M", "bulk temperature", film.bulk_temperature, "degC", 1)
    yield Row("E_r", "reduced modulus", film.reduced_modulus, "MPa", 0)
    yield Row("lambda_GFmin", "smallest specific film thickness", film.min_specific_film_thickness)
    yield Row("lambda_GFP", "permissible specific film thickness", film.permissible_film)
    yield Row("S_lambda", "safety", film.safety, "", 3)


def _losses(thermal: ThermalRating) -> Iterator[Row]:
    yield Row("mu_mz", "mean coefficient of friction (Schlenk)", thermal.friction)
    yield Row("H_v", "loss factor", thermal.loss_factor)
    yield Row("P_VZP", "mesh loss under load", thermal.loss_power, "W", 1)
    yield Row("eta_zP", "efficiency of the mesh under load", thermal.efficiency)
    estimate = "estimate"
    yield Row("P_VZ0", "no-load loss (Mauz)", thermal.no_load_loss_power, "W", 1, estimate)
    yield Row("P_churn", "churning (Changenet, Velex)", thermal.churning_loss_power, "W", 1, estimate)


def safety_table(found: PairRating, thermal: ThermalRating, rating: Rating) -> Table:
    """Required and reached safeties, and whether they are met."""
    table = Table(("safety", "pinion", "wheel", "required", ""), title="safeties after ISO 6336")
    for each in safeties(found, thermal, rating):
        reached, required = np.ravel(np.asarray(each.values)), float(each.required)
        shown = [shown_as(float(number), 2) for number in reached]
        met = "" if not np.isfinite(reached).all() else "met" if (reached >= required).all() else "NOT MET"
        name = f"{each.symbol}, {each.words}"
        table.add_row(name, *shown, *[""] * (2 - len(shown)), shown_as(required, 2), met)
    return table


def spectrum_tables(spectrum: Spectrum) -> list[Table]:
    """Every bin of a load spectrum: its load factors, and its stresses and damages."""
    load = ("T_1 [N m]", spectrum.torques, ".6g"), ("n_1 [1/min]", spectrum.speeds, ".6g")
    cycles = ("N_1 [1e6]", spectrum.cycles[0] / 1e6, ".4g"), ("N_2 [1e6]", spectrum.cycles[1] / 1e6, ".4g")
    named = ("K_v", "dynamic"), ("K_Hbeta", "face"), ("K_Halpha", "transverse")
    factors = [(name, getattr(spectrum.factors, of), ".3f") for name, of in named]
    stressed = [
        column
        for gear in (0, 1)
        for column in (
            (f"sigma_H{gear + 1}", spectrum.contact_stress[gear], ".2f"),
            (f"U_H{gear + 1}", spectrum.pitting_damage[gear], ".4f"),
            (f"sigma_F{gear + 1}", spectrum.root_stress[gear], ".2f"),
            (f"U_F{gear + 1}", spectrum.root_damage[gear], ".4f"),
        )
    ]
    sums = [
        f"{name} {' / '.join(f'{number:.4f}' for number in np.asarray(of).sum(axis=1))}"
        for name, of in (("U_H", spectrum.pitting_damage), ("U_F", spectrum.root_damage))
    ]
    note = f"Stresses in MPa; damage sums over the service life, pinion / wheel: {', '.join(sums)}."
    return [
        _binned([*load, *cycles, *factors], "load spectrum"),
        _binned(stressed, "load spectrum, stresses and damages", note),
    ]


def _binned(columns: Sequence[tuple[str, Any, str]], title: str, note: str = "") -> Table:
    cells = zip(*([format(float(number), form) for number in np.asarray(values)] for _, values, form in columns))
    lines = tuple((str(number), *line) for number, line in enumerate(cells, 1))
    return Table(("bin", *(name for name, *_ in columns)), lines, title, note)


def point_table(thermal: ThermalRating) -> Table:
    """Temperatures and films at the points of the path of contact."""
    flash, film = thermal.flash, thermal.micropitting
    lines: Sequence[tuple[str, Any, int]] = (
        ("Gamma", flash.path_parameter, 3),
        ("X_Gamma", flash.sharing_factor, 3),
        ("X_J", flash.approach_factor, 3),
        ("theta_fl [K], -20", flash.flash_temperature, 1),
        ("rho_n [mm]", film.normal_radius, 3),
        ("p_H [MPa]", film.nominal_pressure, 2),
        ("p_dyn [MPa]", film.pressure, 2),
        ("theta_B [degC], -22", film.contact_temperature, 1),
        ("h [um]", film.film_thickness, 3),
        ("lambda_GF", film.specific_film_thickness, 3),
    )
    cells = tuple((name, *(shown_as(float(number), digits) for number in values)) for name, values, digits in lines)
    return Table(("", *POINTS), cells, "points of the path of contact, ISO/TS 6336-20 and -22")


def part(found: PairRating, thermal: ThermalRating, rating: Rating, name: str, *, coast: bool = False) -> Part:
    """The rating of a design by its name, for the terminal, the report and the files.

    Args:
        found, thermal: numbers of the rating.
        rating: settings.
        name: of the design.
        coast: whether the coast flanks are rated, which carry a negative torque.
    """
    return Part(
        tables=(safety_table(found, thermal, rating),),
        chapters=tuple(chapters(found, thermal, rating, name, coast=coast)),
        data=summary(found, thermal, rating),
        lines=tuple(lines(found, thermal, rating)),
        figures=() if rating.service_life is None else (partial(_woehler, found),),
    )


def _woehler(found: PairRating) -> Figure:
    from .figures import woehler  # imports matplotlib

    return Figure.of(woehler, found)


def chapters(
    found: PairRating, thermal: ThermalRating, rating: Rating, name: str, *, coast: bool = False
) -> list[Chapter]:
    """The rating of a design as chapters of a report: safeties, factors, spectrum, temperatures and films."""
    chain = rows(found, thermal, rating)
    tables = {title: Table(_HEADER, tuple(row.cells for row in several), title) for title, several in chain.items()}
    mechanical, thermal_tables = list(tables.values())[:3], list(tables.values())[3:]
    spectrum = [] if found.spectrum is None else spectrum_tables(found.spectrum)
    points = [point_table(thermal)]
    of = f"Design: {name}. Edition {rating.edition} of ISO 6336; load factors are not in the torque."
    if coast:
        of += " The coast flanks are rated, which carry the negative torque."
    first = [safety_table(found, thermal, rating), *mechanical[:1], *spectrum]
    return [
        Chapter("Rating after ISO 6336", [of], tables=first, new_page=True),
        Chapter("Flank and tooth root", tables=mechanical[1:]),
        Chapter("Scuffing, micropitting and losses", [_THERMAL], tables=[*points, *thermal_tables]),
    ]


_THERMAL = (
    "ISO/TS 6336-20, -21 and -22 (method B) share the load by their own factors; safeties of the contact analysis at "
    "its own line loads are the quantities local_scuffing_safety and local_micropitting_safety. Losses count the "
    "torque without load factors; those without load are estimates."
)


def summary(found: PairRating, thermal: ThermalRating, rating: Rating) -> dict[str, Any]:
    """Rows by table and symbol as plain data: a number of the mesh, or those of pinion and wheel, with the unit."""
    reached: dict[str, Any] = {
        each.symbol: {**_plain(each.values), "required": float(each.required)}
        for each in safeties(found, thermal, rating)
    }
    chain = {
        title.replace(",", "").replace(" ", "_"): {
            row.symbol: {**_plain(row.values), **({"unit": row.unit} if row.unit else {})} for row in several
        }
        for title, several in rows(found, thermal, rating).items()
    }
    return {"safeties": reached, **chain}


def _plain(values: Any) -> dict[str, float | None]:
    numbers = [float(each) if np.isfinite(each) else None for each in np.ravel(np.asarray(values))]
    return dict(zip(("mesh",) if len(numbers) == 1 else ("pinion", "wheel"), numbers))


def lines(found: PairRating, thermal: ThermalRating, rating: Rating) -> Iterator[tuple[str, ...]]:
    """Header and rows of `rating.csv`, with every digit."""
    yield ("table", *_HEADER)
    for title, several in rows(found, thermal, rating).items():
        for row in several:
            shown = [repr(number) if np.isfinite(number) else "" for number in row.numbers]
            yield (title, row.symbol, row.words, *shown, *[""] * (2 - len(shown)), row.unit, row.origin)
