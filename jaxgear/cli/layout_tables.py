"""The tables of `jaxgear layout`."""

from collections.abc import Iterator

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from ..layout import CASES, FlankLineLayout, ToleranceCases
from ..shafts import bearing_reactions
from .layout_study import Study, root_factor


def tables(study: Study) -> Iterator[Table]:
    """The steps, what the contact says of them, and the bearings."""
    yield _steps(study)
    if study.contacts:
        yield _contacts(study)
        yield _contact_cases(study)
    yield _bearings(study)


def _steps(study: Study) -> Table:
    result = Table(title=f"{study.design.title}: flank lines", title_justify="left", box=SIMPLE_HEAD)
    result.add_column("", no_wrap=True)
    for name in study.layouts:
        result.add_column(name, justify="right", no_wrap=True)

    def row(text: str, values: Iterator[str]) -> None:
        result.add_row(text, *values)

    each = list(study.layouts.values())
    row("torque of the layout [N m]", (f"{float(one.torque):g}" for one in each))
    row("K_Hbeta without modification", (f"{float(one.factors[0]):.3f}" for one in each))
    row("K_Fbeta without modification", (f"{float(root_factor(one, one.factors[0])):.3f}" for one in each))
    result.add_section()
    row(f"step 1, {study.main.gear}: slope [um]", (f"{float(one.line.slope):.2f}" for one in each))
    row("  crowning [um]", (f"{float(one.line.crowning):.2f}" for one in each))
    row("  K_Hbeta", (f"{float(one.factors[1]):.3f}" for one in each))
    row("  K_Fbeta", (f"{float(root_factor(one, one.factors[1])):.3f}" for one in each))
    result.add_section()
    for index, gear in enumerate(("pinion", "wheel")):
        row(f"step 2, {gear}: crowning C_b [um]", (f"{float(one.further[index]):.2f}" for one in each))
    row("  least of both together [um]", (f"{float(one.needed):.2f}" for one in each))
    for name in study.request.tolerances:
        result.add_section()
        tolerance = study.request.tolerances[name]
        row(
            f"{name}: f_Hb {float(tolerance.helix_slope):.1f}, f_ma {float(tolerance.misalignment):.1f} um",
            ("unmodified / step 1 / step 2" for _ in each),
        )
        for number, case in enumerate(CASES):
            row(
                f"  K_Hbeta, {case}",
                (" / ".join(_cell(of[name], number) for of in one.cases) for one in each),
            )
        row("  K_Fbeta, worst case", (_worst_root(one, name) for one in each))
        if study.main.damage:
            row("  life, worst case [h]", (_worst_life(one, name) for one in each))
    if study.main.damage:
        result.add_section()
        for number, text in enumerate(("without modification", "after step 1", "after step 2")):
            row(f"life {text} [h]", (f"{float(one.damage[number].life):.4g}" for one in each))
    result.caption = "* largest load at an edge" + ("; last rows: no deviation" if study.main.damage else "")
    return result


def _cell(cases: ToleranceCases, number: int) -> str:
    return f"{float(cases.face_load_factor[number]):.3f}{'*' if bool(cases.edge_contact[number]) else ' '}"


def _worst_root(layout: FlankLineLayout, name: str) -> str:
    worst = (np.max(of[name].face_load_factor) for of in layout.cases)
    return " / ".join(f"{float(root_factor(layout, factor)):.3f} " for factor in worst)


def _worst_life(layout: FlankLineLayout, name: str) -> str:
    return " / ".join(f"{float(np.min(lives)):.4g} " for lives in layout.lives[name])


def _contacts(study: Study) -> Table:
    """The contact analysis of every step, beside the one-dimensional one at the same torque."""
    title = f"contact analysis at {study.request.profile_torque:g} N m, without deviations"
    result = Table(title=title, title_justify="left", box=SIMPLE_HEAD)
    for name in ("", "K_Hbeta", "K_Fbeta", "edge load factor", "K_Hbeta of Annex E"):
        result.add_column(name, justify="right" if name else "left", no_wrap=True)
    for support, steps in study.contacts.items():
        for step, found in steps.items():
            cells = [_number(found[name]) for name in FACTORS]
            given = study.factors[support].get(step)
            result.add_row(f"{support}: {step}", *cells, "" if given is None else _number(given))
    return result


def _contact_cases(study: Study) -> Table:
    """K_Hbeta of the contact analysis in the five cases."""
    title = f"K_Hbeta of the contact analysis at {study.request.profile_torque:g} N m in the cases of deviations"
    result = Table(title=title, title_justify="left", box=SIMPLE_HEAD)
    for number, name in enumerate(("", *CASES)):
        result.add_column(name, justify="right" if number else "left", no_wrap=True)
    for support, tolerances in study.contact_cases.items():
        for tolerance, steps in tolerances.items():
            for step, factors in steps.items():
                result.add_row(f"{support}, {tolerance}: {step}", *map(_number, factors))
    return result


FACTORS = ("face_load_factor", "root_face_load_factor", "edge_load_factor")


def _number(value: float) -> str:
    return f"{value:.3f}"


def _bearings(study: Study) -> Table:
    """Displacements of the shafts at the bearings."""
    result = Table(title="bearings: displacement of the shaft [um]", title_justify="left", box=SIMPLE_HEAD)
    result.add_column("bearing", no_wrap=True)
    result.add_column("force [N]", justify="right")
    found = {name: bearing_reactions(support.gearbox) for name, support in study.request.supports.items()}
    for name in found:
        for way in "xy":
            result.add_column(f"{way}, {name}", justify="right", no_wrap=True)
    first = next(iter(found.values()))
    for number, name in enumerate(first.names):
        force = float(np.hypot(*np.asarray(first.force)[number, :2]))
        moved = [f"{float(each.shaft[number, way]):.2f}" for each in found.values() for way in range(2)]
        result.add_row(name, f"{force:.0f}", *moved)
    return result
