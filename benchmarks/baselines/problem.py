"""The benchmark's gear pair as plain NumPy arrays, the common input of all baselines."""

from dataclasses import dataclass, fields, replace

import numpy as np

TORQUE = 50.0
DEFLECTION = 40.0  # [um], beyond what any variant reaches
# one parabolic tip relief per gear: amount [um] and length [mm], of the pinion and of the wheel
LOWER = np.array([0.0, 1.0, 0.0, 1.0])
UPPER = np.array([20.0, 5.0, 20.0, 5.0])
# lead crowning of each gear [um], where the face is divided into slices
CROWNING = 5.0


@dataclass(frozen=True)
class Law:
    """Contact law of every pair at every position, arrays (pairs, positions); see `jaxgear.compliance`.

    compliance, depth, poisson: of pinion and wheel, shape (2, pairs, positions).
    """

    compliance: np.ndarray
    depth: np.ndarray
    poisson: np.ndarray
    width_factor: np.ndarray
    truncation: np.ndarray
    distance: np.ndarray
    wedge: np.ndarray
    reach: np.ndarray


@dataclass(frozen=True)
class Problem:
    """What does not depend on the variant.

    Attributes:
        force: on the line of action [N].
        slice_width: [mm], shape (slices,).
        crowning: material that the lead crowning of both gears removes [um], shape (slices,).
        structure: [um per N/mm], shape (pairs, pairs, positions).
        law: contact law.
        corner_gap: [um], shape (pairs, positions).
        lever: closing per unit of approach, shape (pairs, positions).
        beyond_tip: roll length beyond the tip at the points across the contact [mm], negative on the flank, shape
            (2 gears, nodes, pairs, positions).
        node_weight: weight of those points, shape (nodes,).
    """

    force: float
    slice_width: np.ndarray
    crowning: np.ndarray
    structure: np.ndarray
    law: Law
    corner_gap: np.ndarray
    lever: np.ndarray
    beyond_tip: np.ndarray
    node_weight: np.ndarray

    @property
    def full_load(self) -> np.ndarray:
        """Line load of a pair that bears everything alone [N/mm], shape (pairs, positions)."""
        return self.force / (self.lever * self.slice_width.sum())


def prepare(positions: int = 64, slices: int = 1, *, coupled: bool = False, helix_angle: float = 0.0):
    """The prepared mesh of the 19/48 pair of `examples/spur_19_48.toml`, a `jaxgear.Mesh`, or of such helical gears.

    The slices of the baselines are not coupled, and no gear overhangs the other.
    """
    import jaxgear as jg

    pinion = jg.Gear(teeth=19, module=3.0, face_width=18.0, bore_diameter=24.0, helix_angle=helix_angle)
    wheel = jg.Gear(teeth=48, module=3.0, face_width=18.0, bore_diameter=70.0, helix_angle=-helix_angle)
    pair = jg.GearPair(pinion, wheel)
    pairs = jg.fewest_pairs(pair, deflection=DEFLECTION)
    # the baselines leave the contacts at their nominal places
    sizes = jg.Resolution(positions=positions, slices=slices, pairs=pairs, slide_steps=0, coupled_slices=coupled)
    return jg.prepare(pair, resolution=sizes)


def plain(mesh) -> Problem:
    """The numbers of a prepared mesh with the default compliance model, under the benchmark's torque."""
    import jax.numpy as jnp

    from jaxgear.compliance.hertz import contact_geometry
    from jaxgear.compliance.tooth import tooth_load
    from jaxgear.contact.contact_width import place_of
    from jaxgear.geometry import outline

    gears = mesh.pair.pinion, mesh.pair.wheel
    force = 1e3 * TORQUE / float(gears[0].base_radius)
    place = place_of(mesh, jnp.asarray(TORQUE))
    half_width, lowest, highest = (np.asarray(each)[:, 0] for each in (place.half_width, place.lowest, place.highest))
    # Chebyshev nodes of the second kind integrate with the semi-elliptic pressure as their weight
    count = mesh.resolution.contact_nodes
    angle = np.pi * np.arange(1, count + 1) / (count + 1)
    offset = np.clip(np.cos(angle)[:, None, None] * half_width, lowest, highest)
    loads = [tooth_load(outline(side.gear), side.contact_roll_length[:, 0]) for side in mesh.sides]
    rolls = [np.asarray(load.roll_length) for load in loads]
    beyond = [
        np.maximum(roll + sign * offset * float(gear.base_radius) / roll, 0.0) - float(gear.tip_roll_length)
        for roll, gear, sign in zip(rolls, gears, (+1, -1))
    ]
    geometry = contact_geometry(*loads, mesh.kinematics.plane, mesh.pair.face_width)
    edge = mesh.law.edge

    def of_both(value):
        """Shape (2, pairs, positions)."""
        return np.stack([np.asarray(value(side))[:, 0] for side in geometry.sides])

    law = Law(
        compliance=of_both(lambda side: 2e3 / (np.pi * side.modulus)),
        depth=of_both(lambda side: side.depth),
        poisson=of_both(lambda side: side.poisson),
        width_factor=np.asarray(mesh.law.width_factor)[:, 0],
        truncation=1e-3 * np.asarray(mesh.law.truncation)[:, 0],
        distance=np.asarray(edge.distance)[:, 0],
        wedge=1e-3 * np.asarray(edge.wedge)[:, 0],
        reach=np.asarray(edge.reach)[:, 0],
    )
    slices = mesh.resolution.slices
    along = 2 * np.asarray(mesh.face_coordinate) / float(mesh.pair.face_width)
    return Problem(
        force=force,
        slice_width=np.asarray(mesh.slice_width),
        crowning=2 * CROWNING * along**2 if slices > 1 else np.zeros(1),
        structure=np.asarray(mesh.structure)[:, :, 0],
        law=law,
        corner_gap=np.asarray(mesh.corner_gap)[:, 0],
        lever=np.asarray(mesh.lever)[:, 0],
        beyond_tip=np.stack(beyond),
        node_weight=2 / (count + 1) * np.sin(angle) ** 2,
    )


def removed(problem: Problem, variants: np.ndarray) -> np.ndarray:
    """Material removed by both tip reliefs, averaged over the contact [um], shape (variants, pairs, positions)."""
    total = np.zeros((len(variants), *problem.corner_gap.shape))
    for gear in range(2):
        amount, length = (variants[:, 2 * gear + k][:, None, None] for k in range(2))
        for weight, beyond in zip(problem.node_weight, problem.beyond_tip[gear]):
            d = np.clip(1 + beyond / length, 0, 1)
            total += weight * amount * d * (0.44 + 0.56 * d)
    return total


def random_variants(count: int, seed: int = 0) -> np.ndarray:
    """Uniform between `LOWER` and `UPPER`, shape (count, 4)."""
    return np.random.default_rng(seed).uniform(LOWER, UPPER, (count, 4))


def two_candidates(problem: Problem) -> Problem:
    """The problem with the two pairs per position that can touch under any variant within the bounds.

    Relief grows with its amount and its length, so the approach stays below that of any pair that bears the load alone
    with the largest relief; pairs whose corner gap is wider stay open.

    Raises:
        ValueError: when more than two pairs can touch somewhere.
    """
    from .law import deflection

    load = problem.full_load
    pairs, positions = load.shape
    own = np.einsum("iin->in", problem.structure)
    elastic = own * load + deflection(problem.law, load)[0]
    widest = problem.corner_gap + removed(problem, UPPER[None])[0] + problem.crowning.max()
    bound = np.min((elastic + widest) / problem.lever, axis=0)
    margin = problem.corner_gap / problem.lever - bound
    if (np.sum(margin < 0, axis=0) > 2).any():
        raise ValueError("two_candidates: more than two pairs can touch at the same position")
    pick = np.sort(np.argsort(margin, axis=0)[:2], axis=0)

    def select(array):
        """Takes the picked pairs on the last but one axis."""
        return np.take_along_axis(array, pick.reshape((1,) * (array.ndim - 2) + pick.shape), axis=-2)

    first, second = pick[:, None], pick[None]
    return replace(
        problem,
        structure=problem.structure[first, second, np.arange(positions)],
        law=Law(**{field.name: select(getattr(problem.law, field.name)) for field in fields(Law)}),
        corner_gap=select(problem.corner_gap),
        lever=select(problem.lever),
        beyond_tip=select(problem.beyond_tip),
    )
