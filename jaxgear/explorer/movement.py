"""One movement of a slider: contact under all torques at once, results, and their gradients by every slider."""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..conditions import cycle_status
from ..contact import Mesh, MeshCycle, OperatingPoint, solve
from ..contact.solve import solve_known
from ..contact.status import Statuses
from ..io.design_file import FileDesign
from ..io.template import Template
from ..metrics import AbstractSettings, Analysis, Quantity, harmonics, load_sharing, profile_relief
from ..microgeometry import AbstractModification
from ..numerics import Known, kernel, program
from ..shafts import RigidSupport

Parameters = Mapping[str, Any]  # numbers or arrays


class Curves(eqx.Module):
    """Curves of a mesh cycle.

    Attributes:
        transmission_error: [um], shape (positions,).
        load_sharing: share of every pair in the load, shape (pairs, positions).
        flank_pressure, corner_pressure: largest of all slices [MPa], shape (pairs, positions).
        orders: amplitudes of the mesh harmonics of the transmission error [um], shape (orders,).
        line_load: [N/mm], shape (pairs, slices, positions); None for one slice.
    """

    transmission_error: Float[Array, " positions"]
    load_sharing: Float[Array, "pairs positions"]
    flank_pressure: Float[Array, "pairs positions"]
    corner_pressure: Float[Array, "pairs positions"]
    orders: Float[Array, " orders"]
    line_load: Float[Array, "pairs slices positions"] | None


class Found(eqx.Module):
    """Results of a movement.

    Attributes:
        cycle: mesh cycle under the torque of the design.
        curves: its curves.
        profiles: material removed from pinion and wheel in the middle of the face, from the start of the active profile
            to the tip [um], shape (points,) each.
        numbers: values of the quantities, shape (quantities,).
        gradient: their derivatives by every slider, shape (quantities, sliders).
    """

    cycle: MeshCycle
    curves: Curves
    profiles: tuple[Float[Array, " points"], Float[Array, " points"]]
    numbers: Float[Array, " quantities"]
    gradient: Float[Array, "quantities sliders"]


class Moved(eqx.Module):
    """Mesh, load and flanks as functions of the sliders.

    Attributes:
        names: names of the sliders.
        mesh: prepared mesh, or a function of the sliders that prepares it.
        misalignment: misalignment of the axes; None if no slider changes it.
        load: torque, speed and friction.
        flanks: modifications of pinion and wheel.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    mesh: Any
    misalignment: Template | None
    load: Template
    flanks: FileDesign

    def mesh_of(self, parameters: Parameters) -> Mesh:
        """Mesh of these values."""
        if not isinstance(self.mesh, Mesh):
            return self.mesh(parameters)
        if self.misalignment is None:
            return self.mesh
        support = RigidSupport(self.mesh.pair, self.misalignment.build(parameters))
        return tilted(self.mesh, support)

    def __call__(
        self, parameters: Parameters
    ) -> tuple[Mesh, OperatingPoint, AbstractModification, AbstractModification]:
        """Mesh, load, and modifications of pinion and wheel of these values."""
        flanks = self.flanks({name: parameters[name] for name in self.flanks.names})
        return self.mesh_of(parameters), self.load.build(parameters), *flanks


def tilted(mesh: Mesh, support: RigidSupport) -> Mesh:
    """A prepared mesh with another misalignment of its axes."""
    gap = support.gap(mesh.face_coordinate).astype(mesh.slice_width.dtype)
    return eqx.tree_at(lambda tree: (tree.support, tree.support_gap), mesh, (support, gap))


class Contacts(eqx.Module):
    """Contact of one design under several torques, the first of which is that of the design.

    Attributes:
        known: solution under the torque of the design.
        ppte: peak-to-peak transmission error under every further torque [um], shape (torques,).
        status: worst status of all contacts.
    """

    known: Known
    ppte: Float[Array, " torques"]
    status: Statuses


def _contacts(at: Moved, values: Float[Array, " sliders"], torques: Float[Array, " torques"]) -> Contacts:
    """Contact of one movement under the torque of the design and further torques [N m], together.

    Args:
        at: mesh, load and flanks as functions of the sliders.
        values: values of the sliders.
        torques: further torques [N m].
    """
    mesh, point, pinion, wheel = at(dict(zip(at.names, values)))

    def under(torque: Array) -> tuple[Known, Statuses]:
        cycle = solve(mesh, eqx.tree_at(lambda tree: tree.torque, point, torque), pinion=pinion, wheel=wheel)
        return Known(cycle.line_load, cycle.opening, cycle.transmission_error), cycle_status(cycle)

    known, status = jax.vmap(under)(jnp.concatenate([jnp.reshape(point.torque, (1,)), torques]))
    ppte = jnp.ptp(known.approach[1:], axis=-1)
    return Contacts(jax.tree.map(lambda leaf: leaf[0], known), ppte, jnp.max(status))


# without optimization those of one slice take 2 ms in place of 1, those of eleven 1.6 s in place of 0.1
contacts_of_slice = program(_contacts)
contacts_of_slices = kernel(_contacts, often=True)


@program
def found(
    at: Moved,
    values: Float[Array, " sliders"],
    known: Known,
    orders: int,
    wanted: tuple[Quantity, ...],
    settings: tuple[AbstractSettings, ...],
) -> Found:
    """Results of a movement and their gradients, by the implicit function theorem without another iteration.

    Args:
        at: mesh, load and flanks as functions of the sliders.
        values: values of the sliders.
        known: contact under the torque of the design.
        orders: number of mesh harmonics.
        wanted: quantities.
        settings: settings that they share.
    """

    def numbers(values: Array) -> tuple[Array, tuple[Array, MeshCycle]]:
        mesh, point, pinion, wheel = at(dict(zip(at.names, values)))
        cycle = solve_known(mesh, point, known, pinion, wheel)
        analysis = Analysis(cycle, mesh, settings)
        values = jnp.stack([quantity(analysis) for quantity in wanted])
        return values, (values, cycle)

    gradient, (values, cycle) = jax.jacfwd(numbers, has_aux=True)(values)
    profiles = profile_relief(cycle.kinematics, cycle.pinion, cycle.wheel)
    return Found(cycle, _curves(cycle, orders), profiles, values, gradient)


@program
def curves_of(cycle: MeshCycle, orders: int) -> Curves:
    """Curves of a mesh cycle, with a number of mesh harmonics."""
    return _curves(cycle, orders)


@program
def numbers_of(
    cycle: MeshCycle, mesh: Mesh, wanted: tuple[Quantity, ...], settings: tuple[AbstractSettings, ...]
) -> Float[Array, " quantities"]:
    """Values of quantities of a mesh cycle."""
    analysis = Analysis(cycle, mesh, settings)
    return jnp.stack([quantity(analysis) for quantity in wanted])


def _curves(cycle: MeshCycle, orders: int) -> Curves:
    sliced = cycle.kinematics.resolution.slices > 1
    return Curves(
        transmission_error=cycle.transmission_error,
        load_sharing=load_sharing(cycle),
        flank_pressure=jnp.max(cycle.contact_pressure, axis=1),
        corner_pressure=jnp.max(cycle.corner_pressure, axis=1),
        orders=harmonics(cycle.transmission_error, orders).amplitude,
        line_load=cycle.line_load if sliced else None,
    )
