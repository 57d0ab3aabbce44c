"""Small motions of a planetary stage and the springs between them: contacts of all planets, and their pins.

Unknowns are the motions of the central members, `central`, and radial and tangential displacement and rotation of every
planet, `local`; all in um, rotations on the base circles. Each planet has four springs: contact with the sun, contact
with the ring, pin radially and tangentially. Their stretches follow from the motions,

    d_i = A_i central + B local_i - offset_i,

and the equilibrium is the stationary point of the energy of all springs: B^T f_i = 0, sum A_i^T f_i + K central = load.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics.coupling import small_inverse
from .stage import PlanetaryStage

Central = Float[Array, "central positions"]
Local = Float[Array, "3 planets positions"]
Springs = Float[Array, "springs planets positions"]

# Share of the pin stiffness that stands in the equations of a motion without any stiffness: of a planet whose contacts
# are lost, of a floating member that no mesh holds.
_REGULARIZATION = 1e-6


class Motion(NamedTuple):
    """Motions of central members and planets, or the forces that belong to them.

    Attributes:
        central: rotation of the sun, then displacements (x, y) of sun, ring and carrier as far as they can move, shape
            (central, positions).
        local: radial and tangential displacement and rotation of the planets, shape (3, planets, positions).
    """

    central: Central
    local: Local


class Linkage(eqx.Module):
    """Geometry and supports of a stage.

    Attributes:
        of_central: stretch of the springs of every planet by the central motions, shape (springs, central, planets).
        of_local: stretch of the springs by the motions of the planet, shape (springs, 3).
        offset: stretch that is missing by errors [um], shape (springs, planets).
        support: stiffness of the supports of the central motions [N/um], shape (central,).
        pin: radial and tangential stiffness of the pins [N/um], shape (2,).
        force: sum of the mesh forces [N], shape ().
    """

    of_central: Float[Array, "springs central planets"]
    of_local: Float[Array, "springs 3"]
    offset: Float[Array, "springs planets"]
    support: Float[Array, " central"]
    pin: Float[Array, "2"]
    force: Float[Array, ""]

    @property
    def regularization(self) -> Float[Array, ""]:
        """Stiffness that is added for motions without any [N/um]; it changes no equilibrium, only the way there."""
        return _REGULARIZATION * jnp.max(self.pin)

    def stretch(self, motion: Motion) -> Springs:
        """Stretch of all springs [um] by motions, without the offset."""
        central = _summed("smi,mp->sip", self.of_central, motion.central)
        return central + _summed("sa,aip->sip", self.of_local, motion.local)

    def forces_on(self, springs: Springs, motion: Motion) -> Motion:
        """Forces of springs [N] and supports against all motions."""
        central = _summed("smi,sip->mp", self.of_central, springs) + self.support[:, None] * motion.central
        return Motion(central, _summed("sa,sip->aip", self.of_local, springs))

    def left_over(self, springs: Springs, motion: Motion) -> Motion:
        """Forces on all motions that are not in equilibrium with the load [N]."""
        forces = self.forces_on(springs, motion)
        return forces._replace(central=forces.central.at[0].add(-self.force))

    def solve(self, stiffness: Springs, forces: Motion) -> tuple[Motion, Central]:
        """Motions that change the forces of springs and supports by those given, and the least stiffness.

        The planets are eliminated first: none touches another one.

        Args:
            stiffness: of all springs [N/um].
            forces: on all motions [N].

        Returns:
            the motions, and the diagonal of the inverse stiffness of the central motions [um/N].
        """
        planets, positions = stiffness.shape[1:]
        small = self.regularization
        of_local, of_central = self.of_local, self.of_central
        own = _summed("sa,sb,sip->abip", of_local, of_local, stiffness).at[2, 2].add(small)
        inverse = small_inverse(own.reshape(3, 3, planets * positions)).reshape(own.shape)
        beside = _summed("sa,smi,sip->amip", of_local, of_central, stiffness)
        central = _summed("smi,sni,sip->mnp", of_central, of_central, stiffness)
        central = central + jnp.diag(self.support + small)[:, :, None]
        carried = _summed("abip,bmip->amip", inverse, beside)
        reduced = central - _summed("amip,anip->mnp", beside, carried)
        left = forces.central - _summed("amip,aip->mp", carried, forces.local)
        flexible = small_inverse(reduced)
        found = _summed("mnp,np->mp", flexible, left)
        local = _summed("abip,bip->aip", inverse, forces.local) - _summed("amip,mp->aip", carried, found)
        return Motion(found, local), jnp.stack([row[place] for place, row in enumerate(flexible)])


def _summed(subscripts: str, *factors: Array) -> Array:
    """`jnp.einsum` as an elementwise product and its sum: of so few entries that compiles, and runs, in less time."""
    given, kept = subscripts.split("->")
    axes = "".join(sorted(set(given) - set(kept) - {","})) + kept
    product: Array | float = 1.0
    for names, factor in zip(given.split(","), factors):
        ordered = factor.transpose([names.index(axis) for axis in axes if axis in names])
        product = product * jnp.expand_dims(ordered, [place for place, axis in enumerate(axes) if axis not in names])
    return jnp.sum(jnp.asarray(product), axis=range(len(axes) - len(kept)))


def linkage(stage: PlanetaryStage, force: Float[Array, ""]) -> Linkage:
    """Geometry and supports of a stage under a sum of the mesh forces [N]."""
    sun_angle, ring_angle = stage.gears.working_pressure_angles
    angles = stage.planet_angles
    zero, one = jnp.zeros_like(angles), jnp.ones_like(angles)
    radial, tangential = (
        jnp.stack([jnp.cos(angles), jnp.sin(angles)]),
        jnp.stack([-jnp.sin(angles), jnp.cos(angles)]),
    )
    # forces of the sun on the planet and of the planet on the ring
    on_planet = jnp.sin(sun_angle) * radial + jnp.cos(sun_angle) * tangential
    on_ring = jnp.sin(ring_angle) * radial - jnp.cos(ring_angle) * tangential
    none = jnp.zeros_like(radial)
    # rows: contact with the sun, contact with the ring, pin radially and tangentially
    columns = [jnp.stack([one, zero, zero, zero])[:, None]]
    supports = [jnp.zeros_like(sun_angle)]
    for support, rows in (
        (stage.sun_support, (on_planet, none, none, none)),
        (stage.ring_support, (none, -on_ring, none, none)),
        (stage.carrier_support, (none, none, -radial, -tangential)),
    ):
        if support is not None:
            columns.append(jnp.stack(rows))
            supports += [support, support]
    sun_row = jnp.stack([-jnp.sin(sun_angle), -jnp.cos(sun_angle), -jnp.ones_like(sun_angle)])
    ring_row = jnp.stack([jnp.sin(ring_angle), -jnp.cos(ring_angle), jnp.ones_like(ring_angle)])
    pins = jnp.eye(2, 3, dtype=sun_row.dtype)
    given = stage.sun_gap, stage.ring_gap, stage.radial_pin_error, stage.tangential_pin_error
    return Linkage(
        of_central=jnp.concatenate(columns, axis=1),
        of_local=jnp.concatenate([sun_row[None], ring_row[None], pins]),
        offset=jnp.stack([zero if each is None else each for each in given]),
        support=jnp.stack(supports),
        pin=jnp.stack([stage.radial_pin_stiffness, stage.tangential_pin_stiffness]),
        force=force,
    )
