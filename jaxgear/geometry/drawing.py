"""A gear as its drawing describes it: tip and root by diameters and heights, where a rack has coefficients."""

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics import Checked, concrete, number, safe_sqrt
from .gear import Gear, full_radius, has_full_radius
from .outline import outline
from .thickness import WAYS, ToothThickness, with_thickness

Scalar = Float[Array, ""]

# what each says in place of a field of `Gear`
_REPLACED = {
    "root_diameter": "dedendum",
    "root_form_diameter": "root_radius",
    "full_root_radius": "root_radius",
    "tip_chamfer": "tip_form_diameter",
}


class ToothProfile(Checked):
    """Tip and root of a tooth on its drawing; None for what the drawing does not give.

    Attributes:
        root_diameter: root diameter d_f [mm] of the tooth with its mean thickness, in place of `dedendum`.
        root_form_diameter: root form diameter d_Ff [mm] of that tooth, in place of `root_radius`; of a tooth without
            undercut.
        full_root_radius: True if one arc rounds the whole tip of the tool, in place of `root_radius`; of a rack
            rho_fP = (pi / 4 - h_fP tan(alpha_n)) cos(alpha_n) / (1 - sin(alpha_n)).
        tip_chamfer: radial height h_K of the tip's chamfer or rounding, coefficient of the module, in place of
            `tip_form_diameter`.
    """

    root_diameter: Scalar | None = number("mm", low=0.0, open_low=True, optional=True, default=None)
    root_form_diameter: Scalar | None = number("mm", low=0.0, open_low=True, optional=True, default=None)
    full_root_radius: bool = False
    tip_chamfer: Scalar | None = number("x module", low=0.0, optional=True, default=None)

    def check_together(self) -> None:
        if self.full_root_radius and self.root_form_diameter is not None:
            raise ValueError("ToothProfile: full_root_radius: cannot be given with root_form_diameter, give one")


def with_profile(gear: Gear, profile: ToothProfile) -> Gear:
    """Copy of a gear with tip and root of a drawing.

    Equations: d_f = d - 2 m_n (h_fP - x_E), of a cutter 2 a_0 - d_a0; d_Ff as in `outline`, with 1 - sin(alpha_n)
        times rho_fP (ISO 21771); d_Fa = d_a - 2 h_K.

    Raises:
        ValueError: for what no tool makes, naming the key of the drawing and the coefficient.
    """
    if (chamfer := profile.tip_chamfer) is not None:
        form = 2 * (gear.tip_radius - chamfer * gear.module)
        gear = _named("tip_chamfer", lambda: replace(gear, tip_form_diameter=form))
    if (root := profile.root_diameter) is not None:
        if gear.cutter_teeth is None:
            dedendum = gear.generating_profile_shift + (gear.pitch_radius - 0.5 * root) / gear.module
        else:
            dedendum = gear.dedendum + (gear.root_circle_radius - 0.5 * root) / gear.module
            if has_full_radius(gear):  # of the dedendum that is replaced
                gear = replace(gear, root_radius=jnp.zeros_like(gear.module))
                profile = replace(profile, full_root_radius=profile.root_form_diameter is None)
        if (
            profile.root_form_diameter is not None or profile.full_root_radius
        ):  # the gear's rounding is not the drawing's
            gear = replace(gear, root_radius=jnp.zeros_like(gear.module))
        gear = _named("root_diameter", lambda: replace(gear, dedendum=dedendum))
    if profile.full_root_radius:
        gear = replace(gear, root_radius=full_radius(gear))
    if profile.root_form_diameter is not None:
        radius = _root_radius(gear, profile.root_form_diameter)
        gear = _named("root_form_diameter", lambda: replace(gear, root_radius=radius))
        if (undercut := concrete(outline(gear).undercut)) is not None and undercut.any():
            raise ValueError("ToothProfile: root_form_diameter: the tooth is undercut, give root_radius")
    return gear


def _root_radius(gear: Gear, form_diameter: Scalar) -> Scalar:
    """rho_fP of a root form diameter [mm], coefficient of the module.

    Of a cutter (r_a0^2 - r_b0^2 - rho^2) / (2 (r_a0 - rho)), rho the roll length of its own that touches there.
    """
    sine = jnp.sin(gear.transverse_pressure_angle)
    roll = safe_sqrt((0.5 * form_diameter) ** 2 - gear.base_radius**2)
    if (cutter := gear.cutter) is not None:
        own = cutter.line_length - roll
        return (cutter.tip_radius**2 - cutter.base_radius**2 - own**2) / (2 * (cutter.tip_radius - own) * gear.module)
    straight = (gear.pitch_radius * sine - roll) * sine / gear.module
    depth = gear.dedendum - gear.generating_profile_shift
    return (depth - straight) / (1 - jnp.sin(jnp.deg2rad(gear.pressure_angle)))


def _named(name: str, made: Callable[[], Any]) -> Any:
    try:
        return made()
    except ValueError as error:
        raise ValueError(f"ToothProfile: {name}: {str(error).partition(': ')[2]}") from error


def drawn_gear(**given: Any) -> Gear:
    """A gear with what its drawing says: the arguments of `Gear`, of `ToothThickness` and of `ToothProfile`.

    Raises:
        ValueError: for what any of them refuses, for a `tooth_thickness_tolerance` beside lower and upper limit, and
            for a number of the drawing beside the one that it replaces.
    """
    profile = _taken(given, ToothProfile)
    for name in profile:
        if profile[name] is not False and given.get(_REPLACED[name]) is not None:
            raise ValueError(f"ToothProfile: {name}: cannot be given with {_REPLACED[name]}: give one of them")
    gear = _thick_gear(given)
    return with_profile(gear, ToothProfile(**profile)) if profile else gear


def _thick_gear(given: dict[str, Any]) -> Gear:
    thickness = _taken(given, ToothThickness)
    if not thickness:
        return Gear(**given)
    says = ToothThickness(**thickness)
    if given.get("tooth_thickness_tolerance") is not None:
        which = next(name for name in WAYS if name in thickness)
        if which != "tooth_thickness_allowance" or np.ndim(thickness[which]):
            raise ValueError(f"Gear: tooth_thickness_tolerance: has no effect, give lower and upper limit of {which}")
        return Gear(**given, **thickness)
    return with_thickness(Gear(**given), says)


def _taken(given: dict[str, Any], cls: type) -> dict[str, Any]:
    """Takes the fields of a class that are not None out of what is given."""
    found = {field.name: given.pop(field.name, None) for field in fields(cls)}
    return {name: value for name, value in found.items() if value is not None}
