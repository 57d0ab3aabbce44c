"""Small vibrations of a planetary stage: masses and springs of all members, natural frequencies and modes.

The coordinates are those of the carrier at rest: its Coriolis and centrifugal terms are left out, as for speeds far
below the natural frequencies of translations.

References:
    J. Lin, R. G. Parker, Analytical characterization of the unique properties of planetary gear free vibration, J. Vib.
    Acoust. 121 (1999) 316-321.
"""

from collections.abc import Iterator
from itertools import product
from typing import Literal, NamedTuple, Self

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..dynamics.oscillator import NEWTON
from ..dynamics.systems import inertia_of, mass_of
from ..geometry import Gear
from ..numerics import Checked, Given, check, concrete, number, optional_real, program, real, result, safe_sqrt
from .springs import Linkage, linkage
from .stage import PlanetaryStage

Scalar = Float[Array, ""]
Coordinates = Float[Array, " coordinates"]
Kind = Literal["rotation", "translation", "planet"]

_MM, _UM = 1e-3, 1e6  # in m, and um in a metre
_MEMBERS = "sun", "ring", "carrier"
_ROTATIONS = tuple(f"{member} rotation" for member in _MEMBERS)
# Share of the kinetic energy of a mode below which a motion is rounding, or the error of angles of few digits
_MOVES = 1e-6


class StageInertias(Checked):
    """Inertias of the members of a stage, each with the parts that move with it.

    Attributes:
        sun, planet, ring, carrier: moments of inertia about the own axis [kg m2]; of the carrier without the planets.
        planet_mass: mass of a planet [kg].
        sun_mass, ring_mass, carrier_mass: masses [kg]; None for members with a rigid support.
    """

    sun: Scalar = number("kg m2", low=0.0, open_low=True, kw_only=True)
    planet: Scalar = number("kg m2", low=0.0, open_low=True, kw_only=True)
    ring: Scalar = number("kg m2", low=0.0, open_low=True, kw_only=True)
    carrier: Scalar = number("kg m2", low=0.0, open_low=True, kw_only=True)
    planet_mass: Scalar = number("kg", low=0.0, open_low=True, kw_only=True)
    sun_mass: Scalar | None = number("kg", low=0.0, open_low=True, optional=True, default=None, kw_only=True)
    ring_mass: Scalar | None = number("kg", low=0.0, open_low=True, optional=True, default=None, kw_only=True)
    carrier_mass: Scalar | None = number("kg", low=0.0, open_low=True, optional=True, default=None, kw_only=True)

    @classmethod
    def of_gears(
        cls, sun: Gear, planet: Gear, ring: Gear, *, carrier: Given, carrier_mass: Given | None = None
    ) -> Self:
        """Inertias and masses of the gear bodies, see `dynamics.inertia_of`.

        Args:
            sun, planet, ring: gears of the stage.
            carrier: moment of inertia of the carrier without the planets [kg m2].
            carrier_mass: mass of the carrier [kg]; None where it has a rigid support.
        """
        return cls(
            sun=inertia_of(sun),
            planet=inertia_of(planet),
            ring=inertia_of(ring),
            carrier=real(carrier),
            planet_mass=mass_of(planet),
            sun_mass=mass_of(sun),
            ring_mass=mass_of(ring),
            carrier_mass=optional_real(carrier_mass),
        )


class StageSystem(eqx.Module):
    """Masses and springs of a stage; made by `stage_system`.

    Coordinates [um] are rotations of sun and ring on their base circles and of the carrier on the circle of the pins,
    without that of a fixed member; displacements (x, y) of central members that have no rigid support; radial and
    tangential displacement and rotation on the base circle of every planet. Ring and planets turn against the sun.

    Attributes:
        mass: mass of every coordinate [kg], shape (coordinates,).
        of_contacts: approach of the teeth with sun and ring per unit of every coordinate, shape (2, planets,
            coordinates).
        of_pins: radial and tangential displacement of every planet against the carrier, of the same shape; None with
            rigid pins.
        mesh_stiffness: mean stiffness of the meshes with sun and ring [N/um], shape (2, planets).
        pin_stiffness: radial and tangential stiffness of the pins [N/um], shape (2,).
        support: stiffness of the supports of every coordinate [N/um], shape (coordinates,).
        of_error: transmission error at the base circle of the sun per unit of every coordinate: its rotation against
            those of ring and carrier, zero where the stage turns as a whole; shape (coordinates,).
        names: names of the coordinates.
    """

    mass: Coordinates
    of_contacts: Float[Array, "2 planets coordinates"]
    of_pins: Float[Array, "2 planets coordinates"] | None
    mesh_stiffness: Float[Array, "2 planets"]
    pin_stiffness: Float[Array, "2"]
    support: Coordinates
    of_error: Coordinates
    names: tuple[str, ...] = eqx.field(static=True)

    @property
    def stiffness(self) -> Float[Array, "coordinates coordinates"]:
        """Stiffness of meshes, pins and supports [N/um], shape (coordinates, coordinates)."""
        total = jnp.einsum("sic,sid,si->cd", self.of_contacts, self.of_contacts, self.mesh_stiffness)
        if self.of_pins is not None:
            total = total + jnp.einsum("sic,sid,s->cd", self.of_pins, self.of_pins, self.pin_stiffness)
        return total + jnp.diag(self.support)


def stage_system(
    stage: PlanetaryStage,
    inertias: StageInertias,
    *,
    sun_stiffness: Given,
    ring_stiffness: Given,
    torsional: bool = False,
    fixed_support: Given | None = None,
) -> StageSystem:
    """Masses and springs of a stage with meshes of constant stiffness.

    Args:
        stage: the stage; pin stiffnesses and supports count as in `solve_stage`.
        inertias: inertias of all members.
        sun_stiffness, ring_stiffness: stiffness of every planet's mesh [N/um], shape () or (planets,):
            `StageMeshes.mean_stiffness` has that of a solved stage.
        torsional: True for rotations alone: pins and centres of the members are held in place.
        fixed_support: torsional stiffness of the support of the fixed member [N m/rad]; None for a rigid one.

    Raises:
        ValueError: for stiffnesses that are not positive, and for a missing mass of a member that can move.
    """
    planets, dtype = stage.planets, stage.gears.module.dtype
    stiffness = []
    for name, value in (("sun_stiffness", sun_stiffness), ("ring_stiffness", ring_stiffness)):
        given = real(value)
        if given.shape not in ((), (planets,)):
            raise ValueError(f"{name} has shape {given.shape}, must be a single number or ({planets},)")
        check(name, given, "N/um", low=0.0, open_low=True)
        stiffness.append(jnp.broadcast_to(given.astype(dtype), (planets,)))
    held = None
    if fixed_support is not None:
        check("fixed_support", fixed_support, "N m/rad", low=0.0)
        held = real(fixed_support).astype(dtype)
    for member in _MEMBERS if not torsional else ():
        if getattr(stage, f"{member}_support") is not None and getattr(inertias, f"{member}_mass") is None:
            raise ValueError(f"inertias: {member}_mass is missing, the support of the {member} is not rigid")
    bodies = jax.tree.map(lambda leaf: leaf.astype(dtype), inertias)
    return _assembled(stage, bodies, jnp.stack(stiffness), held, torsional)


class _Coordinate(NamedTuple):
    """One coordinate: stretch of the springs of every planet, mass, stiffness to ground, share in the error."""

    name: str
    springs: Float[Array, "springs planets"]
    mass: Scalar
    support: Given = 0.0
    error: Given = 0.0


@program
def _assembled(
    stage: PlanetaryStage,
    inertias: StageInertias,
    mesh_stiffness: Float[Array, "2 planets"],
    fixed_support: Scalar | None,
    torsional: bool,
) -> StageSystem:
    link = linkage(stage, jnp.ones_like(stage.gears.module))
    coordinates = [*_rotations(stage, inertias, link, fixed_support, torsional)]
    if not torsional:
        coordinates += _displacements(stage, inertias, link)
    coordinates += _of_planets(stage, inertias, link, torsional)
    dtype = link.force.dtype
    springs = jnp.stack([each.springs for each in coordinates], axis=-1)
    mass, support, error = (
        jnp.stack([real(getattr(each, name)).astype(dtype) for each in coordinates])
        for name in ("mass", "support", "error")
    )
    return StageSystem(
        mass=mass,
        of_contacts=springs[:2],
        of_pins=None if torsional else springs[2:],
        mesh_stiffness=mesh_stiffness,
        pin_stiffness=link.pin,
        support=support,
        of_error=error,
        names=tuple(each.name for each in coordinates),
    )


def _rotations(
    stage: PlanetaryStage, inertias: StageInertias, link: Linkage, fixed_support: Scalar | None, torsional: bool
) -> Iterator[_Coordinate]:
    """Rotations of sun, ring and carrier, but for that of a fixed member with a rigid support."""
    gears, none = stage.gears, jnp.zeros_like(link.of_central[0, 0])
    # planets on rigid pins move with the carrier
    carried = link.of_local[:, 1:2] if torsional else jnp.asarray([0.0, 0.0, 0.0, -1.0], none.dtype)[:, None]
    springs = {
        "sun": link.of_central[:, 0],
        "ring": jnp.stack([none, none - 1, none, none]),
        "carrier": carried + none[None],
    }
    radii = gears.base_radius(gears.sun_teeth), gears.base_radius(gears.ring_teeth), gears.working_center_distance
    errors: tuple[Given, ...] = 1.0, -1.0, link.of_local[0, 1] + link.of_local[1, 1]
    for member, radius, error in zip(_MEMBERS, radii, errors):
        held = fixed_support if member == stage.fixed else jnp.zeros_like(radius)
        if held is None:
            continue
        square = (_MM * radius) ** 2
        mass = getattr(inertias, member) / square
        if torsional and member == "carrier":
            mass = mass + stage.planets * inertias.planet_mass
        yield _Coordinate(f"{member} rotation", springs[member], mass, held / (_UM * square), error)


def _displacements(stage: PlanetaryStage, inertias: StageInertias, link: Linkage) -> Iterator[_Coordinate]:
    """Displacements (x, y) of the central members that have no rigid support."""
    moving = [member for member in _MEMBERS if getattr(stage, f"{member}_support") is not None]
    for place, (member, axis) in enumerate(product(moving, "xy"), start=1):
        mass = getattr(inertias, f"{member}_mass")
        yield _Coordinate(f"{member} {axis}", link.of_central[:, place], mass, link.support[place])


def _of_planets(
    stage: PlanetaryStage, inertias: StageInertias, link: Linkage, torsional: bool
) -> Iterator[_Coordinate]:
    """Displacements and rotation of every planet; its rotation alone on rigid pins."""
    gears, mass = stage.gears, inertias.planet_mass
    turning = inertias.planet / (_MM * gears.base_radius(gears.planet_teeth)) ** 2
    own = jnp.eye(stage.planets, dtype=turning.dtype)
    for planet in range(stage.planets):
        for place, (motion, moved) in enumerate(zip(("radial", "tangential", "rotation"), (mass, mass, turning))):
            if motion == "rotation" or not torsional:
                springs = link.of_local[:, place, None] * own[planet][None]
                yield _Coordinate(f"planet {planet + 1} {motion}", springs, moved)


class StageModes(Checked):
    """Natural frequencies and modes of a stage.

    Attributes:
        frequency: natural frequencies [Hz], rising, shape (modes,); zero for the rotation of a free stage.
        shape: displacements of all coordinates, largest 1, shape (modes, coordinates); without derivatives.
        kinetic_energy: share of every coordinate in the kinetic energy of a mode, of the same shape.
        names: names of the coordinates.
    """

    frequency: Float[Array, " modes"] = result("Hz")
    shape: Float[Array, "modes coordinates"] = result()
    kinetic_energy: Float[Array, "modes coordinates"] = result()
    names: tuple[str, ...] = eqx.field(static=True)

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """Kind of every mode by the motion of the central members (Lin and Parker).

        "rotation": they turn and all planets move alike; "translation": their centres move, in pairs of modes;
        "planet": only planets move, in N - 3 modes of each frequency, of rotations alone N - 1. Modes of stages without
        that symmetry are of the kind that has more kinetic energy.

        Raises:
            ValueError: for traced modes.
        """
        energy = concrete(self.kinetic_energy)
        if energy is None:
            raise ValueError("StageModes: kinds are being traced, must be concrete")
        turning = np.asarray([name in _ROTATIONS for name in self.names])
        moving = np.asarray([not name.startswith("planet") for name in self.names]) & ~turning
        shares = [np.sum(energy[:, each], axis=1) for each in (turning, moving)]
        larger = np.where(shares[0] >= shares[1], "rotation", "translation")
        return tuple(np.where(shares[0] + shares[1] < _MOVES, "planet", larger).tolist())


@program
def natural_modes(system: StageSystem) -> StageModes:
    """Natural frequencies and modes of a stage without damping.

    Frequencies are differentiable; derivatives of equal ones are those of the modes that were found.
    """
    root = jnp.sqrt(system.mass)
    stiffness = NEWTON * system.stiffness / (root[:, None] * root[None])
    vectors = jax.lax.stop_gradient(jnp.linalg.eigh(stiffness)[1])
    square = jnp.einsum("cm,cd,dm->m", vectors, stiffness, vectors)
    shape = (vectors / jax.lax.stop_gradient(root)[:, None]).T
    largest = jnp.take_along_axis(shape, jnp.argmax(jnp.abs(shape), axis=1)[:, None], axis=1)
    return StageModes(
        frequency=safe_sqrt(jnp.maximum(square, 0.0)) / (2 * jnp.pi),
        shape=shape / largest,
        kinetic_energy=vectors.T**2,
        names=system.names,
    )
