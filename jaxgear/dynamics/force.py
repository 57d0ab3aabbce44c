"""The interface of a mesh force, and those of closed form."""

from abc import abstractmethod
from collections.abc import Callable
from functools import partial
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from ..numerics import Checked, bracketed_root, number, program, real

# Doublings of 1 um until a bracket holds the DTE of a force; there is no root where they do not suffice.
_DOUBLINGS = 40
# mesh positions over which a stiffness is averaged
POSITIONS = 32
# Share of a force by which flanks count as touching, where the deflection under the force is measured from.
_TOUCHING = 1e-6

Scalar = Float[Array, ""]


class AbstractMeshForce(Checked):
    """Force between the flanks of a mesh on the line of action, as a function of mesh position and DTE.

    The DTE q [um] is how much farther the pinion has turned than the wheel, on the line of action: under a static
    load it is the loaded transmission error. The force [N] is positive on the drive flanks, zero in the clearance and
    negative on the coast flanks.

    What depends on the mesh position alone is `at` that position, so that an integrator whose steps meet the same
    positions in every cycle works it out once. Both methods are of single numbers; `jax.vmap` makes many.
    """

    # whether the force jumps at some mesh positions: the ends of an integrator's steps then lie on the step's side
    jumps: ClassVar[bool] = False

    @property
    def averaged_positions(self) -> int:
        """Mesh positions over which stiffnesses are averaged."""
        return POSITIONS

    def nodes(self, steps: int) -> Float[Array, " nodes"]:
        """Mesh positions between which an integrator steps, from 0 to 1 [base pitches], shape (steps + 1,)."""
        return jnp.linspace(0.0, 1.0, steps + 1)

    @abstractmethod
    def at(self, phase: Scalar) -> PyTree[Array]:
        """A tree of arrays: what the force at a mesh position [base pitches, any number] depends on."""

    @abstractmethod
    def force(self, place: PyTree[Array], dte: Scalar) -> Scalar:
        """Force [N] at a place that `at` has found and a DTE [um]."""

    def __call__(self, phase: Scalar, dte: Scalar) -> Scalar:
        """Force [N] at a mesh position [base pitches] and a DTE [um]."""
        return self.force(self.at(phase), dte)

    def stiffness(self, phase: Scalar, dte: Scalar) -> Scalar:
        """Slope of the force over the DTE [N/um]."""
        place = self.at(phase)
        return jax.jvp(lambda q: self.force(place, q), (dte,), (jnp.ones_like(dte),))[1]

    def static_te(self, phase: Scalar, force: Scalar) -> Scalar:
        """Loaded transmission error [um] under a force [N].

        A positive force has one on the drive flanks, a negative one on the coast flanks; for a force of zero it is
        somewhere in the clearance. NaN where there is none, as for a negative force without coast flanks.
        """
        return te_under(self, self.at(phase), force)

    def mean_tangent_stiffness(self, force: Scalar) -> Scalar:
        """Slope of the force under a static force [N], averaged over the mesh cycle [N/um].

        The stiffness that a small vibration about the static transmission error meets: natural frequencies and
        damping ratios refer to it.
        """
        return _mean_tangent_stiffness(self, real(force))

    def mean_secant_stiffness(self, force: Scalar) -> Scalar:
        """A static force [N], not zero, over the mean deflection of the mesh cycle under it [N/um].

        The deflection is the static transmission error under the force less that at which the flanks touch: the
        stiffness of a linear spring with the same mean deflection, below the tangent one since contacts stiffen from
        zero on. Studies that know a static transmission error and no slope state it.
        """
        return _mean_secant_stiffness(self, real(force))

    def over_cycle(self, of: Callable[[Scalar], Scalar], dtype: np.dtype) -> Scalar:
        """Mean of a function of the mesh position over a cycle, each position for the step about it."""
        begin = self.nodes(self.averaged_positions).astype(dtype)
        return jnp.sum(jnp.diff(begin) * jax.vmap(of)((begin[:-1] + begin[1:]) / 2))


@program
def _mean_tangent_stiffness(of: AbstractMeshForce, force: Scalar) -> Scalar:
    return of.over_cycle(lambda phase: of.stiffness(phase, of.static_te(phase, force)), force.dtype)


@program
def _mean_secant_stiffness(of: AbstractMeshForce, force: Scalar) -> Scalar:
    def deflection(phase):
        return of.static_te(phase, force) - of.static_te(phase, _TOUCHING * force)

    return (1 - _TOUCHING) * force / of.over_cycle(deflection, force.dtype)


@partial(jax.jit, inline=True)
def te_under(mesh_force: AbstractMeshForce, place: PyTree[Array], force: Scalar) -> Scalar:
    """Transmission error [um] at which a mesh force has a value [N]; NaN where it has it nowhere.

    A mesh force that is NaN from some DTE on counts as larger than any value there.
    """
    args = mesh_force, place, force
    fixed = jax.lax.stop_gradient(args)

    def is_short(width):
        return (missing(width, fixed) < 0) | (missing(-width, fixed) > 0)

    def is_searched(state):
        width, doublings = state
        return (doublings < _DOUBLINGS) & is_short(width)

    start = jnp.ones_like(force), 0
    width, _ = jax.lax.while_loop(is_searched, lambda state: (2 * state[0], state[1] + 1), start)
    found = bracketed_root(missing, -width, width, args)
    known = ~is_short(width) & jnp.isfinite(missing(jax.lax.stop_gradient(found), fixed))
    return jnp.where(known, found, jnp.nan)


def missing(dte: Scalar, args: tuple[AbstractMeshForce, PyTree[Array], Scalar]) -> Scalar:
    """Force [N] at a DTE [um] less the wanted one; args are (mesh force, place, wanted force)."""
    mesh_force, place, force = args
    found = mesh_force.force(place, dte)
    return jnp.where(jnp.isnan(found), jnp.where(dte < 0, -jnp.inf, jnp.inf), found - force)


class DeadZone(AbstractMeshForce):
    """Constant stiffness on either side of a clearance (Kahraman, Singh, J. Sound Vib. 142, 1990).

    Attributes:
        stiffness_constant: [N/um].
        half_clearance: of the clearance about DTE zero [um].
    """

    stiffness_constant: Scalar = number("N/um", low=0.0, open_low=True, default=1.0)
    half_clearance: Scalar = number("um", low=0.0, default=1.0)

    def at(self, phase: Scalar) -> tuple[()]:
        return ()

    def force(self, place: tuple[()], dte: Scalar) -> Scalar:
        half = self.half_clearance
        return self.stiffness_constant * (jnp.maximum(dte - half, 0.0) + jnp.minimum(dte + half, 0.0))


class RectangularStiffness(AbstractMeshForce):
    """Two and one pair in turn, both of constant stiffness, without coast flanks: exact solutions are known for it.

    Attributes:
        double, single: stiffness with two pairs and with one in contact [N/um].
        share: of the cycle with two pairs, from mesh position 0 on.
    """

    jumps: ClassVar[bool] = True

    double: Scalar = number("N/um", low=0.0, open_low=True)
    single: Scalar = number("N/um", low=0.0, open_low=True)
    share: Scalar = number("", low=0.0, high=1.0)

    def nodes(self, steps: int) -> Float[Array, " nodes"]:
        """Half of the steps with two pairs and half with one, so that the jump lies between two steps."""
        half = steps // 2
        double = self.share * jnp.linspace(0.0, 1.0, half + 1)
        return jnp.append(double[:-1], self.share + (1 - self.share) * jnp.linspace(0.0, 1.0, steps - half + 1))

    def at(self, phase: Scalar) -> Scalar:
        return jnp.where(phase - jnp.floor(phase) < self.share, self.double, self.single)

    def force(self, place: Scalar, dte: Scalar) -> Scalar:
        return place * jnp.maximum(dte, 0.0)
