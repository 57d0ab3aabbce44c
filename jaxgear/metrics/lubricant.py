"""The lubricant: viscosity and density with their dependence on pressure, and its scuffing resistance.

References:
    ASTM D341 and DIN 51563 (Ubbelohde, Walther) for viscosity over temperature; ISO/TS 6336-22 (ISO/TR 15144-1) for
    density and pressure-viscosity coefficient over viscosity and temperature.
"""

from collections.abc import Mapping
from typing import Literal, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import concrete, number
from .quantity import AbstractSettings

Real = Float[Array, "..."]
Given = Real | float
Scalar = Float[Array, ""]
Base = Literal["mineral", "pao", "pag"]
FrictionLaw = Literal["schlenk", "iso_6336_20", "iso_6336_22"]
BulkLaw = Literal["flash", "loss"]

_KELVIN = 273.15
_WALTHER = 0.7  # mm2/s, good from 2 mm2/s on
_LOW, _HIGH = 40.0, 100.0  # degC, at which viscosities are measured
# ISO/TS 6336-22 counts the pressure-viscosity coefficient from 38 degC = 311 K, and takes 273 for the zero of Celsius
_ISO_KELVIN, _ISO_REFERENCE, _ISO_SLOPE = 273.0, 311.0, 516.0
_DENSITY_REFERENCE, _DENSITY_SLOPE = 289.0, 0.7  # K, kg/(m3 K)


class _BaseOil(NamedTuple):
    """Constants of a kind of oil.

    Attributes:
        pressure_viscosity, exponent: constants of alpha_38 = pressure_viscosity * eta_38^exponent [1/Pa], eta_38 in
            Pa s.
        friction_factor: X_L of the laws of friction.
    """

    pressure_viscosity: float
    exponent: float
    friction_factor: float


# friction factors of ISO/TR 13989-1; of polyglycols the one that does not dissolve in water
BASES: Mapping[str, _BaseOil] = {
    "mineral": _BaseOil(2.657e-8, 0.1348, 1.0),
    "pao": _BaseOil(1.466e-8, 0.0507, 0.8),
    "pag": _BaseOil(1.392e-8, 0.1572, 0.7),
}


class Lubricant(AbstractSettings):
    """Lubricant in operation: data sheet, temperature, flank surfaces and test results.

    `quantity` gives with it the numbers of the lubricated mesh, `metrics.LUBRICANT_QUANTITIES`.

    Attributes:
        viscosity_40: kinematic viscosity at 40 degC.
        viscosity_100: kinematic viscosity at 100 degC.
        temperature: temperature of the oil that reaches the mesh.
        roughness: arithmetic mean roughness Ra of the flanks, mean of pinion and wheel.
        base: kind of oil, which says how pressure thickens it and how slippery it is.
        density: density at 15 degC; None for that of an oil of this viscosity, 43.37 log10(viscosity_40) + 805.5.
        friction: law of the mean coefficient of friction, see `friction_coefficient`; a coefficient that is given with
            the load counts in its place.
        friction_factor: X_L of these laws; None for 1 of mineral oil, 0.8 of polyalphaolefin, 0.7 of polyglycol.
        bulk: law of the bulk temperature of the teeth, see `bulk_temperature`.
        cooling_factor: X_S of that law, 1 for dip and 1.2 for spray lubrication.
        permissible_film: specific film thickness lambda_GFP below which micropitting is to be expected, from a test.
        scuffing_temperature: contact temperature at which the oil fails, from a test.
        fzg_stage: load stage at which the oil fails in the FZG scuffing test A/8.3/90 (ISO 14635-1), for the scuffing
            temperatures of a rating.
        structure_factor: X_W of the flanks, X_WrelT against those of the test: 1 for normal steel, 1.15 case-hardened
            with less than 10 % austenite and 0.85 with more than 20 %, 1.25 phosphated, 1.5 copper-plated or nitrided,
            0.45 stainless.
        run_in: phi_E, from 0 of new flanks to 1 of those that are run in.
        micropitting_test: pinion torque of the failure stage of the FZG micropitting test C-GF/8.3/90 (FVA 54), for the
            permissible film of a rating: 70.0, 98.9, 132.5, 171.6, 215.6, 265.1 N m of stages 5 to 10.
        micropitting_test_film: specific film thickness lambda_GFT of that test, where it is known in place of a torque.
        pinion_immersion, wheel_immersion: depths to which the gears dip into the oil at rest, for the losses without
            load.
        splash_factor: C_Sp of the no-load loss, 1 for spray lubrication; see `rating.splash_factor`.
        oil_volume: oil volume of the bath, for the churning loss.
        load_factor: product of the load factors, K_A K_gamma K_v K_Hbeta K_Halpha as far as the contact analysis does
            not know them, for friction by ISO, flash temperature and film. The power loss, and with `bulk` = "loss" the
            bulk temperature, count the torque itself.
    """

    table = "lubricant"
    viscosity_40: Scalar = number("mm2/s", low=2.0)
    viscosity_100: Scalar = number("mm2/s", low=2.0)
    temperature: Scalar = number("degC", low=-60.0, high=250.0)
    roughness: Scalar = number("um", low=0.0, open_low=True)
    base: Base = eqx.field(default="mineral", static=True)
    density: Scalar | None = number("kg/m^3", low=0.0, open_low=True, optional=True, default=None)
    friction: FrictionLaw = eqx.field(default="schlenk", static=True)
    friction_factor: Scalar | None = number("", low=0.0, open_low=True, optional=True, default=None)
    bulk: BulkLaw = eqx.field(default="flash", static=True)
    cooling_factor: Scalar = number("", low=0.0, high=10.0, default=1.0)
    permissible_film: Scalar | None = number("", low=0.0, open_low=True, optional=True, default=None)
    scuffing_temperature: Scalar | None = number("degC", low=0.0, high=2000.0, optional=True, default=None)
    load_factor: Scalar = number("", low=0.0, high=100.0, open_low=True, default=1.0)
    fzg_stage: Scalar | None = number("", low=5.0, high=14.0, optional=True, default=None)
    structure_factor: Scalar = number("", low=0.1, high=2.0, default=1.0)
    run_in: Scalar = number("", low=0.0, high=1.0, default=0.0)
    micropitting_test: Scalar | None = number("N m", low=50.0, high=500.0, optional=True, default=None)
    micropitting_test_film: Scalar | None = number("", low=0.0, open_low=True, optional=True, default=None)
    pinion_immersion: Scalar | None = number("mm", low=0.0, optional=True, default=None)
    wheel_immersion: Scalar | None = number("mm", low=0.0, optional=True, default=None)
    splash_factor: Scalar = number("", low=0.0, high=10.0, default=1.0)
    oil_volume: Scalar | None = number("dm^3", low=0.0, open_low=True, optional=True, default=None)

    def check_together(self) -> None:
        if self.micropitting_test is not None and self.micropitting_test_film is not None:
            raise ValueError("Lubricant: micropitting_test has no effect beside micropitting_test_film, give either")
        _check_less(self, "viscosity_100", "viscosity_40", "mm2/s")
        _check_less(self, "temperature", "scuffing_temperature", "degC")

    @property
    def slipperiness(self) -> Scalar:
        """Lubricant factor X_L: the given one, or the value of the kind of oil."""
        if self.friction_factor is not None:
            return self.friction_factor
        return jnp.full_like(self.viscosity_40, BASES[self.base].friction_factor)

    def kinematic_viscosity(self, temperature: Given) -> Real:
        """nu [mm2/s] at a temperature [degC]: log log (nu + 0.7) is linear in the logarithm of the absolute one."""
        cold, hot = (jnp.log(jnp.log(nu + _WALTHER)) for nu in (self.viscosity_40, self.viscosity_100))
        span = jnp.log((_HIGH + _KELVIN) / (_LOW + _KELVIN))
        way = jnp.log((temperature + _KELVIN) / (_LOW + _KELVIN)) / span
        return jnp.exp(jnp.exp(cold + (hot - cold) * way)) - _WALTHER

    def density_at(self, temperature: Given) -> Real:
        """Density [kg/m^3] at a temperature [degC], 0.7 kg/m^3 less per kelvin."""
        at_15 = 43.37 * jnp.log10(self.viscosity_40) + 805.5 if self.density is None else self.density
        return at_15 - _DENSITY_SLOPE * (temperature + _ISO_KELVIN - _DENSITY_REFERENCE)

    def viscosity(self, temperature: Given) -> Real:
        """Dynamic viscosity eta [Pa s] at a temperature [degC]."""
        return 1e-6 * self.kinematic_viscosity(temperature) * self.density_at(temperature)

    def pressure_viscosity(self, temperature: Given) -> Real:
        """Pressure-viscosity coefficient [1/Pa] at a temperature [degC]: alpha_38 (1 + 516 (1 / T - 1 / 311)), T in K;
        negative above 510 degC, beyond the range of any oil.
        """
        base = BASES[self.base]
        reference = jnp.full_like(self.viscosity_40, _ISO_REFERENCE - _ISO_KELVIN)
        at_38 = base.pressure_viscosity * self.viscosity(reference) ** base.exponent
        return at_38 * (1 + _ISO_SLOPE * (1 / (temperature + _ISO_KELVIN) - 1 / _ISO_REFERENCE))


def _check_less(lubricant: Lubricant, name: str, other: str, unit: str) -> None:
    """Raise unless a number is less than another one; tracers pass."""
    given = getattr(lubricant, name), getattr(lubricant, other)
    known = [concrete(value) for value in given if value is not None]
    if len(known) < len(given) or any(value is None for value in known):
        return
    low, high = map(float, known)  # type: ignore[arg-type]
    if low >= high:
        raise ValueError(f"Lubricant: {name} = {low:g} {unit} must be less than {other} = {high:g} {unit}")
