"""Numbers of a mesh cycle by name: what a table of many designs can hold."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..numerics import maximum, minimum, safe_sqrt
from .load import contact_shock, effective_contact_ratio
from .loss import loss_factor
from .root_stress import root_stress
from .transmission_error import harmonics, peak_to_peak

Scalar = Float[Array, ""]


class Result(NamedTuple):
    """A named number of a mesh cycle.

    Attributes:
        of: computes it from a cycle; traceable.
        unit: "" for a pure number.
        meaning: in a few words.
        worst: which of several values is the worst one, "max" or "min".
    """

    of: Callable[[MeshCycle], Scalar]
    unit: str
    meaning: str
    worst: str = "max"


def result_key(name: str) -> str:
    """Name of a result with its unit, as tables and summaries carry it: `ppte_um`, `max_line_load_N_per_mm`.

    Raises:
        ValueError: for an unknown name.
    """
    if name not in RESULTS:
        raise ValueError(f'"{name}" is not a result, must be one of {", ".join(RESULTS)}')
    suffix = RESULTS[name].unit.replace(" ", "").replace("/", "_per_")
    return f"{name}_{suffix}" if suffix else name


def te_rms(cycle: MeshCycle) -> Scalar:
    """Root mean square of the transmission error about its mean [um]."""
    curve = cycle.transmission_error
    return safe_sqrt(jnp.mean((curve - jnp.mean(curve)) ** 2))


def mean_removed_material(cycle: MeshCycle) -> Scalar:
    """Material removed from both flanks together, mean over the contacts on the path of contact [um].

    It breaks ties among designs of equal transmission error: what is not removed need not be ground.
    """
    inside = cycle.kinematics.outside <= 0
    # on the path of contact unmodified flanks have no gap: what is there is the modification
    removed = jnp.where(inside, jnp.mean(cycle.gap, axis=1), 0.0)
    return jnp.sum(removed) / jnp.sum(inside.astype(removed.dtype))


def _te_harmonic(order: int) -> Result:
    def amplitude(cycle: MeshCycle) -> Scalar:
        return harmonics(cycle.transmission_error, count=order).amplitude[order - 1]

    return Result(amplitude, "um", f"amplitude of mesh harmonic {order} of the transmission error")


def _corner_length(cycle: MeshCycle) -> Scalar:
    shock = contact_shock(cycle)
    return shock.approach + shock.recess


RESULTS: Mapping[str, Result] = MappingProxyType(
    {
        "ppte": Result(lambda c: peak_to_peak(c.transmission_error), "um", "peak-to-peak transmission error"),
        "mean_te": Result(lambda c: jnp.mean(c.transmission_error), "um", "mean transmission error"),
        "te_rms": Result(te_rms, "um", "rms of the transmission error about its mean"),
        "unloaded_ppte": Result(
            lambda c: peak_to_peak(c.unloaded_transmission_error), "um", "peak-to-peak transmission error, unloaded"
        ),
        "te_harmonic_1": _te_harmonic(1),
        "te_harmonic_2": _te_harmonic(2),
        "te_harmonic_3": _te_harmonic(3),
        "max_flank_pressure": Result(lambda c: maximum(c.contact_pressure), "MPa", "largest Hertzian flank pressure"),
        "max_corner_pressure": Result(lambda c: maximum(c.corner_pressure), "MPa", "largest pressure of a tip edge"),
        "max_contact_pressure": Result(
            # one of the two is zero
            lambda c: maximum(c.contact_pressure + c.corner_pressure),
            "MPa",
            "largest pressure of flanks and tip edges",
        ),
        "max_line_load": Result(lambda c: maximum(c.line_load), "N/mm", "largest line load"),
        "contact_ratio": Result(
            lambda c: c.kinematics.path_of_contact.contact_ratio, "", "theoretical contact ratio", worst="min"
        ),
        "effective_contact_ratio": Result(effective_contact_ratio, "", "mean number of loaded pairs", worst="min"),
        "corner_contact_length": Result(_corner_length, "mm", "loaded path beyond the theoretical path of contact"),
        "corner_force": Result(lambda c: contact_shock(c).force, "N", "largest force on a pair there"),
        "pinion_root_stress": Result(lambda c: maximum(root_stress(c).pinion), "MPa", "largest root stress, pinion"),
        "wheel_root_stress": Result(lambda c: maximum(root_stress(c).wheel), "MPa", "largest root stress, wheel"),
        "mesh_loss_factor": Result(loss_factor, "", "loss power per input power and coefficient of friction"),
        "min_tangent_stiffness": Result(
            lambda c: minimum(c.tangent_stiffness), "N/um", "smallest mesh stiffness", worst="min"
        ),
        "max_tangent_stiffness": Result(lambda c: maximum(c.tangent_stiffness), "N/um", "largest mesh stiffness"),
        "removed_material": Result(mean_removed_material, "um", "mean material removed from both flanks together"),
    }
)
