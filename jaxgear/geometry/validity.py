"""Checks of a gear pair on concrete values; traced pairs pass."""

from typing import TYPE_CHECKING

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..numerics import check
from .involute import diameter
from .outline import outline

if TYPE_CHECKING:
    from .pair import GearPair


def check_pair(pair: "GearPair") -> None:
    """Raises a `ValueError` when the pair cannot run; see `GearPair`."""
    if any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(pair)):
        return
    for name, unit in (("module", "mm"), ("pressure_angle", "deg")):
        ours, theirs = np.asarray(getattr(pair.pinion, name)), np.asarray(getattr(pair.wheel, name))
        if not np.array_equal(ours, theirs):
            raise ValueError(
                f"GearPair: wheel {name} = {float(theirs.flat[0]):g} {unit} must equal the pinion's, "
                f"{float(ours.flat[0]):g} {unit}"
            )
    facts = jax.tree.map(np.asarray, _facts(pair))
    check("GearPair", "center_distance", pair.center_distance, "mm", low=facts.closest.max(), open_low=True)
    # single precision resolves a centre distance to about 1e-7 of its value
    free = facts.backlash_free.max() * (1 - 1e-6)
    check("GearPair", "center_distance", pair.center_distance, "mm (backlash-free)", low=free)
    if (facts.contact_ratio < 1).any():
        raise ValueError(
            f"GearPair: contact ratio = {float(facts.contact_ratio.min()):.4g} must be at least 1: raise a "
            "tip_diameter or addendum, or lower center_distance"
        )
    _check_interference("pinion", "wheel", facts.pinion_reached, facts.pinion_form)
    _check_interference("wheel", "pinion", facts.wheel_reached, facts.wheel_form)


class _Facts(eqx.Module):
    """What decides whether a pair can run: distances and diameters in mm.

    `reached` is the diameter at which the mate's tip meets the flank, negative when that is below the base circle.
    """

    closest: Array
    backlash_free: Array
    contact_ratio: Array
    pinion_reached: Array
    pinion_form: Array
    wheel_reached: Array
    wheel_form: Array


@eqx.filter_jit
def _facts(pair: "GearPair") -> _Facts:
    from .path import path_of_contact

    path = path_of_contact(pair)
    free = eqx.tree_at(lambda p: p.center_distance, pair, None, is_leaf=lambda leaf: leaf is None)

    def form(gear):
        return diameter(gear, outline(gear).form_roll_length)

    def reached(gear, rho):
        return jnp.where(rho < 0, -1.0, 1.0) * diameter(gear, rho)

    return _Facts(
        closest=pair.pinion.base_radius + pair.wheel.base_radius,
        backlash_free=free.working_center_distance,
        contact_ratio=path.contact_ratio,
        pinion_reached=reached(pair.pinion, path.pinion_roll_length(path.start)),
        pinion_form=form(pair.pinion),
        wheel_reached=reached(pair.wheel, path.wheel_roll_length(path.end)),
        wheel_form=form(pair.wheel),
    )


def _check_interference(name: str, mate: str, reached, form) -> None:
    # a micrometre of the radius below the form circle is within the accuracy of any generated outline
    if (reached < form - 2e-3).any():
        below = " (below the base circle)" if (reached < 0).any() else ""
        raise ValueError(
            f"GearPair: {mate} tip_diameter reaches the {name}'s flank at diameter {abs(float(reached.flat[0])):.6g} mm"
            f"{below}, must be at least its form diameter {float(form.flat[0]):.6g} mm"
        )
