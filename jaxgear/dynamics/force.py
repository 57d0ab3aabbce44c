"""Interface of mesh forces, and mesh forces in closed form."""

from abc import abstractmethod
from collections.abc import Callable
from functools import partial
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from ..numerics import Checked, bracketed_root, number, program, real

# Most doublings of 1 um for a bracket of the DTE of a force; beyond them no root exists.
_DOUBLINGS = 40
# mesh positions over which a stiffness is averaged
POSITIONS = 32
# Share of a force by which flanks count as touching, where the deflection under the force is measured from.
_TOUCHING = 1e-6

Scalar = Float[Array, ""]


class AbstractMeshForce(Checked):
    """Force between the flanks of a mesh on the line of action, as a function of mesh position and DTE.

    The DTE q [um] is the lead of the pinion over the wheel on the line of action; under a static load it is the loaded
    transmission error. The force [N] is positive on the drive flanks, zero in the clearance and negative on the coast
    flanks.

    The method `at` computes everything that depends only on the mesh position, once for an integrator whose steps meet
    the same positions in every cycle. Both methods take single numbers; use `jax.vmap` for many.
    """

    # whether the force jumps at some mesh positions: the ends of an integrator's steps then lie on the step's side
    jumps: ClassVar[bool] = False

    @property
    def averaged_positions(self) -> int:
        """Number of mesh positions over which stiffnesses are averaged."""
        return POSITIONS

    def nodes(self, steps: int) -> Float[Array, " nodes"]:
        """Mesh positions between which an integrator steps, from 0 to 1 [base pitches], shape (steps + 1,)."""
        return jnp.linspace(0.0, 1.0, steps + 1)

    @abstractmethod
    def at(self, phase: Scalar) -> PyTree[Array]:
        """Data of the force at a mesh position [base pitches], any real number; a tree of arrays for `force`."""

    @abstractmethod
    def force(self, place: PyTree[Array], dte: Scalar) -> Scalar:
        """Force [N] at a DTE [um], with the data of a mesh position from `at`."""

    def __call__(self, phase: Scalar, dte: Scalar) -> Scalar:
        """Force [N] at a mesh position [base pitches] and a DTE [um]."""
        return self.force(self.at(phase), dte)

    def stiffness(self, phase: Scalar, dte: Scalar) -> Scalar:
        """Tangent stiffness [N/um] at a mesh position [base pitches] and a DTE [um]."""
        place = self.at(phase)
        return jax.jvp(lambda q: self.force(place, q), (dte,), (jnp.ones_like(dte),))[1]

    def static_te(self, phase: Scalar, force: Scalar) -> Scalar:
        """Loaded transmission error [um] under a force [N].

        It lies on the drive flanks for a positive force, on the coast flanks for a negative force, and somewhere in the
        clearance for zero. It is NaN if it does not exist, for instance for a negative force without coast flanks.
        """
        return te_under(self, self.at(phase), force)

    def mean_tangent_stiffness(self, force: Scalar) -> Scalar:
        """Mean tangent stiffness over the mesh cycle under a static force [N], in N/um.

        It is the stiffness for small vibrations about the static transmission error. Natural frequencies and damping
        ratios refer to it.
        """
        return _mean_tangent_stiffness(self, real(force))

    def mean_secant_stiffness(self, force: Scalar) -> Scalar:
        """Mean secant stiffness under a static force [N] other than zero: force over mean deflection, in N/um.

        The deflection is the static transmission error under the force minus the transmission error at first contact.
        The secant stiffness is below the tangent stiffness, since contacts stiffen with the load. Publications use it
        if they only know the static transmission error.
        """
        return _mean_secant_stiffness(self, real(force))

    def over_cycle(self, of: Callable[[Scalar], Scalar], dtype: np.dtype) -> Scalar:
        """Mean of a function of the mesh position over a cycle, by the midpoint rule between the nodes."""
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
    """Transmission error [um] at which a mesh force has a given value [N]; NaN if it does not exist.

    A mesh force of NaN beyond some DTE counts as larger than any value.
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
    """Force at a DTE [um] minus a given force [N]; args are (mesh force, data of the position, given force)."""
    mesh_force, place, force = args
    found = mesh_force.force(place, dte)
    return jnp.where(jnp.isnan(found), jnp.where(dte < 0, -jnp.inf, jnp.inf), found - force)


class DeadZone(AbstractMeshForce):
    """Constant stiffness on either side of a clearance (Kahraman, Singh, J. Sound Vib. 142, 1990).

    Attributes:
        stiffness_constant: stiffness in contact [N/um].
        half_clearance: half of the clearance, which is centred at a DTE of zero [um].
    """

    stiffness_constant: Scalar = number("N/um", low=0.0, open_low=True, default=1.0)
    half_clearance: Scalar = number("um", low=0.0, default=1.0)

    def at(self, phase: Scalar) -> tuple[()]:
        return ()

    def force(self, place: tuple[()], dte: Scalar) -> Scalar:
        half = self.half_clearance
        return self.stiffness_constant * (jnp.maximum(dte - half, 0.0) + jnp.minimum(dte + half, 0.0))


class RectangularStiffness(AbstractMeshForce):
    """Mesh force with alternating constant stiffness of two pairs and of one, without coast flanks.

    Exact solutions of its vibration are known.

    Attributes:
        double, single: stiffness with two pairs and with one pair in contact [N/um].
        share: share of the cycle with two pairs, from mesh position 0 on.
    """

    jumps: ClassVar[bool] = True

    double: Scalar = number("N/um", low=0.0, open_low=True)
    single: Scalar = number("N/um", low=0.0, open_low=True)
    share: Scalar = number("", low=0.0, high=1.0)

    def nodes(self, steps: int) -> Float[Array, " nodes"]:
        """Nodes with half of the steps for two pairs and half for one pair; the jump lies between two steps."""
        half = steps // 2
        double = self.share * jnp.linspace(0.0, 1.0, half + 1)
        return jnp.append(double[:-1], self.share + (1 - self.share) * jnp.linspace(0.0, 1.0, steps - half + 1))

    def at(self, phase: Scalar) -> Scalar:
        return jnp.where(phase - jnp.floor(phase) < self.share, self.double, self.single)

    def force(self, place: Scalar, dte: Scalar) -> Scalar:
        return place * jnp.maximum(dte, 0.0)
