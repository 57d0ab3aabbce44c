"""Dimensionless torsional model of a gear pair, as in publications on dynamic profile modification."""

from typing import ClassVar, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from ..contact import MeshCycle
from ..dynamics.force import AbstractMeshForce, DeadZone, te_under
from ..dynamics.oscillator import Excitation, Oscillator
from ..metrics import harmonics, secant_stiffness
from ..numerics import Checked, Given, Numbers, check, number, real, result, safe_sqrt
from .clearance import PolynomialClearance, warn_of_false_well
from .relief import CycleRelief

Scalar = Float[Array, ""]
Orders = Float[Array, " orders"]

ReliefForm = Literal["exact", "first order", "first order as printed"]


def loaded_te(clearance: AbstractMeshForce, load: Scalar) -> Scalar:
    """Positive x with f(x) = load, for a load above 0."""
    if isinstance(clearance, PolynomialClearance):
        return clearance.loaded(load)
    assert isinstance(clearance, DeadZone)  # which the force has checked
    return clearance.half_clearance + load / clearance.stiffness_constant


class DimensionlessForce(AbstractMeshForce):
    """Dimensionless mesh force [1 + sum_j B_j cos(2 pi j phase + phi_j)] f(x - C(phase)).

    Attributes:
        clearance: f, `DeadZone()` or a `PolynomialClearance`.
        stiffness_harmonics: B_j over the mean stiffness, j = 1, 2, ..., shape (orders,).
        stiffness_angles: phi_j [rad], shape (orders,).
        relief: C; None for none.
        relief_form: "exact" is f(x - C). "first order" is f(x) - f'(x) C, which the exact one tends to for small C. "as
            printed" has a plus instead, which is correct only if C adds material or x has the opposite sign. Both need
            a polynomial, since the slope of a dead zone jumps.
    """

    jumps: ClassVar[bool] = True  # C does where a pair comes or goes

    clearance: AbstractMeshForce
    stiffness_harmonics: Orders = number("", shape=("orders",))
    stiffness_angles: Orders = number("rad", shape=("orders",))
    relief: CycleRelief | None = None
    relief_form: ReliefForm = eqx.field(default="exact", static=True)

    def check_together(self) -> None:
        if not isinstance(self.clearance, DeadZone | PolynomialClearance):
            raise TypeError(
                f"DimensionlessForce: clearance is {type(self.clearance).__name__}, must be DeadZone or "
                "PolynomialClearance"
            )
        if self.relief_form != "exact" and not isinstance(self.clearance, PolynomialClearance):
            raise ValueError(
                f'DimensionlessForce: relief_form = "{self.relief_form}" needs a PolynomialClearance: the slope of '
                f"{type(self.clearance).__name__} jumps"
            )

    def nodes(self, steps: int) -> Float[Array, " nodes"]:
        """Mesh positions between which an integrator steps, from 0 to 1 [base pitches], shape (steps + 1,).

        Evenly spaced, but for the two nearest to where the relief jumps, which are moved there.
        """
        even = real(np.linspace(0.0, 1.0, steps + 1))
        if self.relief is None:
            return even
        ends = self.relief.ends
        first, second = jnp.clip(jnp.round(ends * steps), 1, steps - 1)
        beside = jnp.where((ends[1] > ends[0]) & (first < steps - 1) | (first == 1), first + 1, first - 1)
        second = jnp.where(second == first, beside, second)
        place = jnp.arange(steps + 1, dtype=even.dtype)
        moved = jnp.where(place == first, ends[0], jnp.where(place == second, ends[1], even))
        return jnp.sort(moved)

    def static_te(self, phase: Scalar, force: Scalar) -> Scalar:
        """Static x under a force; for the exact form C + f^-1(force / stiffness), outside a false double well."""
        place = self.at(phase)
        if self.relief_form != "exact":
            return te_under(self, place, force)
        _, stiffness, taken = place
        size = loaded_te(self.clearance, jnp.abs(force) / stiffness)
        return taken + jnp.where(force < 0, -size, size)

    def at(self, phase: Scalar) -> PyTree[Array]:
        order = jnp.arange(1, len(self.stiffness_harmonics) + 1, dtype=self.stiffness_harmonics.dtype)
        angle = 2 * jnp.pi * order * phase + self.stiffness_angles
        stiffness = 1 + jnp.sum(self.stiffness_harmonics * jnp.cos(angle))
        taken = jnp.zeros_like(stiffness) if self.relief is None else self.relief(phase)
        return self.clearance.at(phase), stiffness, taken

    def force(self, place: PyTree[Array], dte: Scalar) -> Scalar:
        inner, stiffness, taken = place
        if self.relief_form == "exact":
            return stiffness * self.clearance.force(inner, dte - taken)
        sign = 1.0 if self.relief_form == "first order as printed" else -1.0

        def of(x):
            return self.clearance.force(inner, x)

        value, change = jax.jvp(of, (dte,), (taken,))
        return stiffness * (value + sign * change)


class DimensionlessModel(Checked):
    """x'' + 2 zeta x' + [1 + sum B_j cos(j Omega t + phi_j)] f(x - C)
        = F_m + sum F_aT cos(n Omega t + phi_T) + sum F_ah (n Omega)^2 cos(n Omega t + phi_h)

    Lengths are over the half clearance b, times times omega_0 = sqrt(k_mean / m), forces over b k_mean; Omega is the
    mesh frequency over omega_0. x is the dynamic transmission error, 0 in the middle of the clearance. The study of
    dynamic modification writes one harmonic each of F_aT and F_ah, at frequencies of their own: here at any multiples n
    of the mesh frequency.

    F_ah is the amplitude of a displacement e between the gears: with the coordinate q = x + e of an `Oscillator` the
    right-hand side has no Omega^2, and -e'' brings it about for x.

    Attributes:
        load: F_m.
        damping_ratio: zeta, of critical at the mean stiffness; acts in contact and out of it.
        stiffness_harmonics, stiffness_angles: B_j, phi_j [rad], j = 1, 2, ..., shape (harmonics,).
        orders: n, multiples of the mesh frequency, shape (orders,).
        torque, torque_angles: F_aT and phi_T [rad], shape (orders,).
        displacement, displacement_angles: F_ah and phi_h [rad], shape (orders,).
        clearance: f; the dead zone itself, or a polynomial.
        relief: C; None for none.
        relief_form: as in `DimensionlessForce`.

    Warns:
        UserWarning: where the load lies in the false double well of a polynomial.
    """

    load: Scalar = number("", low=0.0, open_low=True)
    damping_ratio: Scalar = number("", low=0.0)
    stiffness_harmonics: Float[Array, " harmonics"] = number("", shape=("harmonics",))
    stiffness_angles: Float[Array, " harmonics"] = number("rad", shape=("harmonics",))
    orders: Orders = number("", shape=("orders",), low=0.0, open_low=True)
    torque: Orders = number("", shape=("orders",))
    torque_angles: Orders = number("rad", shape=("orders",))
    displacement: Orders = number("", shape=("orders",))
    displacement_angles: Orders = number("rad", shape=("orders",))
    clearance: AbstractMeshForce
    relief: CycleRelief | None = None
    relief_form: ReliefForm = eqx.field(default="exact", static=True)

    def check_together(self) -> None:
        for first, *others in (
            ("stiffness_harmonics", "stiffness_angles"),
            ("orders", "torque", "torque_angles", "displacement", "displacement_angles"),
        ):
            wanted = getattr(self, first).shape
            for name in others:
                if getattr(self, name).shape != wanted:
                    raise ValueError(
                        f"DimensionlessModel: {name} has shape {getattr(self, name).shape}, must be that of {first}, "
                        f"{wanted}"
                    )
        if isinstance(self.clearance, PolynomialClearance):
            warn_of_false_well(self.clearance, self.load)

    @property
    def mesh_force(self) -> DimensionlessForce:
        """Mesh force of the model, without the external excitation."""
        return DimensionlessForce(
            self.clearance, self.stiffness_harmonics, self.stiffness_angles, self.relief, self.relief_form
        )

    def oscillator(self) -> Oscillator:
        """Oscillator of the model with the coordinate x + e, where x = `oscillator.dte`.

        Its mesh frequency is Omega / (2 pi).
        """
        excitation = Excitation(
            self.torque / self.load, self.torque_angles, self.displacement, self.displacement_angles, self.orders
        )
        one = jnp.ones_like(self.load)[None]
        return Oscillator(
            self.mesh_force, one, one, self.load[None], 2 * self.damping_ratio, excitation=excitation, newton=1.0
        )


def dimensionless_model(
    *,
    load: Given,
    damping_ratio: Given,
    stiffness_harmonics: Numbers = (0.0,),
    stiffness_angles: Numbers | None = None,
    torque: Given = 0.0,
    torque_angle: Given = 0.0,
    torque_order: Given = 1.0,
    displacement: Given = 0.0,
    displacement_angle: Given = 0.0,
    displacement_order: Given = 1.0,
    clearance: AbstractMeshForce | None = None,
    relief: CycleRelief | None = None,
    relief_form: ReliefForm = "exact",
) -> DimensionlessModel:
    """Dimensionless model with one harmonic each of torque and displacement, as in the paper on dynamic modification.

    Args:
        load, damping_ratio: F_m, zeta.
        stiffness_harmonics, stiffness_angles: B_j, phi_j [rad].
        torque, torque_angle, torque_order: F_aT, phi_T [rad], omega_eT / omega_e.
        displacement, displacement_angle, displacement_order: F_ah, phi_h [rad], omega_eh / omega_e.
        clearance: None for the polynomial of order 7 over |x| <= 3.
        relief, relief_form: as in `DimensionlessForce`.
    """
    harmonics = real(stiffness_harmonics)
    none = real(np.zeros(1))
    return DimensionlessModel(
        real(load, "DimensionlessModel: load"),
        real(damping_ratio, "DimensionlessModel: damping_ratio"),
        harmonics,
        jnp.zeros_like(harmonics) if stiffness_angles is None else real(stiffness_angles),
        jnp.stack([real(torque_order), real(displacement_order)]),
        jnp.concatenate([real(torque)[None], none]),
        jnp.concatenate([real(torque_angle)[None], none]),
        jnp.concatenate([none, real(displacement)[None]]),
        jnp.concatenate([none, real(displacement_angle)[None]]),
        PolynomialClearance.fit() if clearance is None else clearance,
        relief,
        relief_form,
    )


def rectangular_harmonics(ratio: Given, share: Given, count: int = 5) -> Float[Array, " harmonics"]:
    """B_j = 2 (k_D - k_S) sin(pi j share) / (pi j k_mean) of a stiffness k_D = ratio k_S over a share of the cycle
    about mesh position 0, and k_S over the rest; all angles are zero.

    Args:
        ratio: stiffness with two pairs over that with one.
        share: share of the cycle with two pairs, contact ratio - 1.
        count: number of harmonics.
    """
    check("ratio", ratio, "", low=0.0, open_low=True)
    check("share", share, "", low=0.0, high=1.0)
    ratio, share = real(ratio), real(share)
    order = real(np.arange(1, count + 1)).astype(ratio.dtype)
    return 2 * (ratio - 1) * jnp.sin(jnp.pi * order * share) / (jnp.pi * order * (1 + (ratio - 1) * share))


def with_relief(model: DimensionlessModel, relief: CycleRelief | None) -> DimensionlessModel:
    """Copy of a model with another relief; None for no relief."""
    return eqx.tree_at(lambda m: m.relief, model, relief, is_leaf=lambda part: part is None)


_MICRO = 1e-6  # kg um/s^2 are 1e-6 N


class Identified(Checked):
    """Dimensionless model of a gear pair, and the scales between both.

    Attributes:
        model: x = 1 + (transmission error - mean unloaded one) / b on the drive flanks.
        half_clearance: b, half of the backlash on the line of action.
        mean_stiffness: k_mean.
        natural_frequency: omega_0 / (2 pi); the mesh frequency is Omega times this.
        mass: equivalent mass m on the line of action [kg].
    """

    model: DimensionlessModel
    half_clearance: Scalar = result("um")
    mean_stiffness: Scalar = result("N/um")
    natural_frequency: Scalar = result("Hz")
    mass: Scalar = result("kg")


def from_mesh(
    cycle: MeshCycle,
    *,
    mass: Given,
    damping_ratio: Given | None = None,
    damping: Given | None = None,
    half_clearance: Given | None = None,
    torque_fluctuation: Given = 0.0,
    torque_order: Given = 1.0,
    orders: int = 5,
    stiffness: Literal["secant", "tangent"] = "secant",
    clearance: AbstractMeshForce | None = None,
) -> Identified:
    """Identify omega_0, zeta, B_j and phi_j, F_m, F_aT and F_ah of a mesh.

    F_m = F / (b k_mean), B_j and phi_j from the harmonics of the stiffness over its mean, F_ah from the harmonics of
    the unloaded transmission error over b. Both contain the modification of the flanks of the cycle: the model needs no
    relief. A model of unmodified flanks can get a relief by `with_relief`.

    Args:
        cycle: mesh cycle of one design under one torque above 0.
        mass: equivalent mass on the line of action [kg], m = I_1 I_2 / (I_1 r_b2^2 + I_2 r_b1^2).
        damping_ratio: damping ratio zeta; None if `damping` is given.
        damping: damping of the DTE [N s/um], zeta = c / (2 sqrt(m k_mean)); None if `damping_ratio` is given.
        half_clearance: half clearance b on the line of action [um]; None for half of the backlash.
        torque_fluctuation: F_aT over F_m, at one order.
        torque_order: order of the torque fluctuation, as a multiple of the mesh frequency.
        orders: number of harmonics.
        stiffness: "secant" reproduces the static transmission error at this torque, "tangent" small vibrations.
        clearance: clearance function f; None for the dead zone. A `PolynomialClearance` is only valid in its range.

    Raises:
        ValueError: in one line, for no load, no backlash or not exactly one damping.
    """
    if (damping_ratio is None) == (damping is None):
        raise ValueError("give either damping_ratio or damping [N s/um]")
    if stiffness not in ("secant", "tangent"):
        raise ValueError(f'stiffness = {stiffness!r} must be "secant" or "tangent"')
    half = 0.5 * cycle.margins.backlash if half_clearance is None else real(half_clearance)
    check("half_clearance", half, "um", low=0.0, open_low=True)
    check("mass", mass, "kg", low=0.0, open_low=True)
    check("torque", cycle.torque, "N m", low=0.0, open_low=True)
    curve = secant_stiffness(cycle) if stiffness == "secant" else cycle.tangent_stiffness
    mass, mean = real(mass), jnp.mean(curve)
    # the phase 0 of the mesh is the time 0 of the model, with which the torque fluctuates
    parametric, unloaded = (
        harmonics(each, orders, first_phase=cycle.kinematics.first_phase)
        for each in (curve / mean, cycle.unloaded_transmission_error / half)
    )
    if damping is None:
        assert damping_ratio is not None  # one of both is given
        ratio = real(damping_ratio)
    else:
        ratio = 0.5 * real(damping) / safe_sqrt(mass * _MICRO * mean)
    load = cycle.force / (half * mean)
    order = jnp.arange(1, orders + 1, dtype=mean.dtype)
    # F_aT and F_ah share the list of orders; the fluctuation comes first
    first = jnp.zeros(orders + 1, mean.dtype).at[0].set(real(torque_fluctuation) * load)
    model = DimensionlessModel(
        load=load,
        damping_ratio=ratio,
        stiffness_harmonics=parametric.amplitude,
        stiffness_angles=jnp.deg2rad(parametric.phase),
        orders=jnp.concatenate([real(torque_order)[None], order]),
        torque=first,
        torque_angles=jnp.zeros_like(first),
        displacement=jnp.concatenate([jnp.zeros(1, mean.dtype), unloaded.amplitude]),
        displacement_angles=jnp.concatenate([jnp.zeros(1, mean.dtype), jnp.deg2rad(unloaded.phase)]),
        clearance=DeadZone() if clearance is None else clearance,
    )
    natural = safe_sqrt(mean / (mass * _MICRO)) / (2 * jnp.pi)
    return Identified(model, half, mean, natural, mass)
