"""A planetary stage under load over one base pitch: forces, motions, load sharing."""

from typing import Self

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..contact.status import Statuses, WithStatus, reason
from ..metrics import Harmonics, harmonics
from ..numerics import Checked, maximum, result, safe_sqrt
from .equilibrium import Equilibrium
from .kinematics import member_torques
from .meshes import StageFlanks
from .stage import PlanetaryStage

Curve = Float[Array, " positions"]
Curves = Float[Array, "planets positions"]
Path = Float[Array, "2 positions"]
Scalar = Float[Array, ""]


class StageCycle(WithStatus, Checked):
    """Result of `solve_stage`: one stage under one torque, over one base pitch.

    Displacements count in the coordinates of `PlanetaryStage`.

    Attributes:
        stage: the stage.
        torque: torque on the driving member [N m].
        transmission_error: rotation of the sun on its base circle against ring and carrier [um], shape (positions,).
        sun_force, ring_force: force of every planet's mesh with sun and ring on the line of action [N], shape (planets,
            positions).
        sun_approach, ring_approach: approach of the teeth in these meshes on the line of action [um], zero where
            unmodified teeth begin to touch, shape (planets, positions).
        bearing_force: radial and tangential force of every planet on its pin [N], shape (2, planets, positions).
        sun_displacement, ring_displacement, carrier_displacement: displacement (x, y) of the centres [um], shape (2,
            positions); zero with a rigid support.
        planet_displacement: radial and tangential displacement of every planet, pin error included, and its rotation on
            the base circle [um], shape (3, planets, positions).
        residual: largest force that is left over, relative to the sum of the mesh forces, shape (positions,).
        loose: True where nothing holds a floating member in some direction, so that its displacement is not determined,
            shape (positions,).
        flanks: modifications of all flanks.
        status: of every position, of all contacts and the equilibrium, shape (positions,).
    """

    stage: PlanetaryStage
    torque: Scalar = result("N m")
    transmission_error: Curve = result("um")
    sun_force: Curves = result("N")
    ring_force: Curves = result("N")
    sun_approach: Curves = result("um")
    ring_approach: Curves = result("um")
    bearing_force: Float[Array, "2 planets positions"] = result("N")
    sun_displacement: Path = result("um")
    ring_displacement: Path = result("um")
    carrier_displacement: Path = result("um")
    planet_displacement: Float[Array, "3 planets positions"] = result("um")
    residual: Curve = result()
    loose: Bool[Array, " positions"] = eqx.field()
    flanks: StageFlanks = eqx.field()
    status: Statuses = result()

    @classmethod
    def of(
        cls,
        stage: PlanetaryStage,
        torque: Scalar,
        found: Equilibrium,
        windup: Scalar,
        approach: Float[Array, "2 planets positions"],
        flanks: StageFlanks,
    ) -> Self:
        """The cycle of an equilibrium; `windup` of sun and ring is added to its transmission error [um]."""
        rotation, moving = found.motion.central[0], found.motion.central[1:]
        supports = {"sun": stage.sun_support, "ring": stage.ring_support, "carrier": stage.carrier_support}
        places = {}
        for member, support in supports.items():
            floating = 0 if support is None else 2
            places[member] = moving[:floating] if floating else jnp.zeros((2, len(rotation)), rotation.dtype)
            moving = moving[floating:]
        return cls(
            stage=stage,
            torque=torque,
            transmission_error=rotation + windup,
            sun_force=found.springs[0],
            ring_force=found.springs[1],
            sun_approach=approach[0],
            ring_approach=approach[1],
            bearing_force=found.springs[2:],
            sun_displacement=places["sun"],
            ring_displacement=places["ring"],
            carrier_displacement=places["carrier"],
            planet_displacement=found.motion.local,
            residual=found.residual,
            loose=found.loose,
            flanks=flanks,
            status=found.status,
        )

    @property
    def phase(self) -> Curve:
        """Mesh position of the stage [base pitches], shape (positions,)."""
        positions = self.transmission_error.shape[-1]
        return jnp.arange(positions, dtype=self.transmission_error.dtype) / positions

    @property
    def load_share(self) -> Curves:
        """Force of every planet over the mean of all, in the mesh with the sun, shape (planets, positions)."""
        return self.sun_force / jnp.mean(self.sun_force, axis=-2, keepdims=True)

    @property
    def mean_load_share(self) -> Float[Array, " planets"]:
        """Mean of `load_share` over the cycle, shape (planets,)."""
        return jnp.mean(self.load_share, axis=-1)

    @property
    def load_sharing_factor(self) -> Scalar:
        """Load sharing factor K_gamma of the planets: the largest `mean_load_share`."""
        return maximum(self.mean_load_share, -1)

    @property
    def peak_load_sharing_factor(self) -> Scalar:
        """Largest load share of a planet at any position."""
        return maximum(self.load_share, (-2, -1))

    def orders(self, count: int = 6) -> Harmonics:
        """Amplitudes [um] and phases of the mesh harmonics 1 ... n of the transmission error."""
        return harmonics(self.transmission_error, count)

    @property
    def orbit(self) -> Scalar:
        """Largest distance of the sun's centre from its mean place over the cycle [um]."""
        moved = self.sun_displacement - jnp.mean(self.sun_displacement, axis=-1, keepdims=True)
        return maximum(safe_sqrt(moved[..., 0, :] ** 2 + moved[..., 1, :] ** 2), -1)

    @property
    def pin_force(self) -> Curves:
        """Force of every planet on its pin [N], about 2 F cos(alpha_w), shape (planets, positions)."""
        radial, tangential = self.bearing_force[..., 0, :, :], self.bearing_force[..., 1, :, :]
        return safe_sqrt(radial**2 + tangential**2)

    def __str__(self) -> str:
        error = np.asarray(self.transmission_error)
        state = "converged" if np.all(self.converged) else f"NOT CONVERGED ({reason(self.status)})"
        shares = " ".join(f"{share:.3f}" for share in np.asarray(self.mean_load_share))
        torque = float(member_torques(self.stage, self.torque).sun)
        return "\n".join(
            [
                f"StageCycle, {self.stage.planets} planets, {torque:g} N m on the sun, {len(error)} positions, {state}",
                f"  transmission error   mean {error.mean():.3f} um, peak to peak {np.ptp(error):.3f} um",
                f"  load shares          {shares}",
                f"  K_gamma              mean {float(self.load_sharing_factor):.3f}, "
                f"peak {float(self.peak_load_sharing_factor):.3f}",
                f"  orbit of the sun     {float(self.orbit):.3f} um",
                f"  force on a pin       max {float(jnp.max(self.pin_force)):.0f} N",
            ]
        )
