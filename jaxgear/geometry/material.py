"""Elastic and thermal constants of the gear material."""

import equinox as eqx
from jaxtyping import Array, Float

from ..numerics import check, real


class Material(eqx.Module):
    """Isotropic linear elastic material.

    Attributes:
        elastic_modulus: Young's modulus [MPa].
        poisson_ratio: Poisson's ratio.
        density: [kg/m^3].
        thermal_contact_coefficient: sqrt(conductivity * density * specific heat) [N/(m s^0.5 K)], used for the flash
            temperature (ISO/TS 6336-20).
    """

    elastic_modulus: Float[Array, ""] = eqx.field(converter=real, default=206_000.0)
    poisson_ratio: Float[Array, ""] = eqx.field(converter=real, default=0.3)
    density: Float[Array, ""] = eqx.field(converter=real, default=7850.0)
    thermal_contact_coefficient: Float[Array, ""] = eqx.field(converter=real, default=13_800.0)

    def __check_init__(self):
        check("Material", "elastic_modulus", self.elastic_modulus, "MPa", low=0.0, open_low=True)
        check("Material", "poisson_ratio", self.poisson_ratio, "", low=0.0, high=0.5, open_high=True)
        check("Material", "density", self.density, "kg/m^3", low=0.0, open_low=True)
        name = "thermal_contact_coefficient"
        check("Material", name, self.thermal_contact_coefficient, "N/(m s^0.5 K)", low=0.0, open_low=True)


STEEL: Material  # constants of gear steel


def __getattr__(name: str):
    # Made when it is asked for: arrays made at import would start JAX before its devices, processes and precision can
    # be chosen.
    if name == "STEEL":
        return Material()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
