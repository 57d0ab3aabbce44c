"""Elastic and thermal constants of the gear material."""

from jaxtyping import Array, Float

from ..numerics import Checked, Usual, number

Scalar = Float[Array, ""]

_MODULI = Usual(500.0, 700_000.0, "MPa", "plastics 1000 to 10000, steel 206000 MPa: is it in GPa or Pa?")


class Material(Checked):
    """Isotropic linear elastic material.

    Attributes:
        elastic_modulus: Young's modulus [MPa].
        poisson_ratio: Poisson's ratio.
        density: density [kg/m^3].
        thermal_contact_coefficient: sqrt(conductivity * density * specific heat) [N/(m s^0.5 K)], used for the flash
            temperature (ISO/TS 6336-20).
    """

    elastic_modulus: Scalar = number("MPa", low=0.0, open_low=True, default=206_000.0, usual=_MODULI)
    poisson_ratio: Scalar = number("", low=0.0, high=0.5, default=0.3)
    density: Scalar = number("kg/m^3", low=0.0, open_low=True, default=7850.0)
    thermal_contact_coefficient: Scalar = number("N/(m s^0.5 K)", low=0.0, open_low=True, default=13_800.0)


STEEL: Material  # constants of gear steel


def __getattr__(name: str) -> Material:
    # Made when it is asked for: arrays made at import would start JAX before its devices, processes and precision can
    # be chosen.
    if name == "STEEL":
        return Material()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
