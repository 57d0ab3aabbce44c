"""The models under comparison: jaxgear's default, the usual published model, and the default with one
ingredient changed."""

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

import jaxgear as jg

from .cases import PAIR_COUNT, Case, Curves, as_the_reference, gear_pair, modifications, strong
from .goals import DEFAULT_GOALS, FINITE_ELEMENT_STRUCTURE_GOALS, Goal

# The reference has 128 or 64 positions. Every model is solved at more and compared at those of the reference: the
# peak-to-peak value of fewer positions is smaller, in pair L by up to 0.17 um.
RESOLUTION = jg.Resolution(positions=256, pairs=PAIR_COUNT)
_APART = 1e6  # corner gap that keeps tip corners out of contact [um]


@dataclass(frozen=True)
class Model:
    """A compliance model of a gear pair in a plane state, and how the contact is solved.

    Attributes:
        name: how tables call it.
        compliance: function of the pair and the name of the plane.
        corner_contact: whether tip corners touch beyond the path of contact.
        resolution: array sizes, of as many positions and pairs as `RESOLUTION`.
        goals: accuracy that the project aims at; none for models that only show what an ingredient buys.
    """

    name: str
    compliance: Callable[[jg.GearPair, Any], Any]
    corner_contact: bool = True
    resolution: jg.Resolution = RESOLUTION
    goals: tuple[Goal, ...] = ()


def _default(pair: jg.GearPair, plane) -> jg.Compliance:
    return jg.default_compliance(plane)


def _finite_elements(pair: jg.GearPair, plane) -> jg.compliance.AbstractCompliance:
    return jg.finite_element_compliance(pair, plane=plane)


def _default_with(**changes) -> Callable[[jg.GearPair, Any], jg.Compliance]:
    return lambda pair, plane: replace(jg.default_compliance(plane), **changes)


DEFAULT = Model("default", _default, goals=DEFAULT_GOALS)
LEGACY = Model("legacy", lambda pair, plane: jg.legacy_compliance())
MODELS = (
    DEFAULT,
    LEGACY,
    Model("finite-element structure", _finite_elements, goals=FINITE_ELEMENT_STRUCTURE_GOALS),
    Model("no sliding", _default, resolution=replace(RESOLUTION, slide_steps=0)),
    Model("no coupling", _default_with(body=jg.compliance.ElasticRing(coupling=False))),
    Model("no edge softening", _default_with(edge_softening=False)),
    Model("no corner contact", _default, corner_contact=False),
    Model("constant Hertz", _default_with(contact=jg.compliance.ConstantHertz())),
    Model("Weber", _default_with(contact=jg.compliance.Weber())),
)


def run(model: Model, cases: Sequence[Case]) -> dict[Case, Curves]:
    """Solves all cases with one model. Curves are at the positions of the reference.

    Raises:
        RuntimeError: when a contact solution has not converged.
    """
    curves = {}
    for case in cases:
        cycle = _solved(_mesh(model, case.pair, case.plane), case)
        if not bool(jnp.all(cycle.converged)):
            raise RuntimeError(
                f"{model.name}, {case}: contact solution not converged, residual {cycle.residual.max():g}"
            )
        curves[case] = as_the_reference(case, curves_of(cycle))
    return curves


def curves_of(cycle: jg.MeshCycle) -> Curves:
    """What is compared, at the positions of the cycle."""
    force = np.asarray(cycle.pair_force)
    corner = (np.asarray(cycle.kinematics.outside)[:, 0] > 0) & (force > 0)
    pressure = np.where(corner, np.nan, np.asarray(cycle.contact_pressure[:, 0]))
    te = np.asarray(cycle.transmission_error)
    return Curves(te, np.asarray(cycle.unloaded_transmission_error), force, pressure)


_prepare = jg.quick_jit(jg.prepare)
_solve = jg.quick_jit(jg.solve)


@functools.cache
def _mesh(model: Model, pair: str, plane: str) -> jg.Mesh:
    compliance = model.compliance(gear_pair(pair), plane)
    mesh = strong(_prepare(gear_pair(pair), compliance=compliance, resolution=model.resolution))
    if model.corner_contact:
        return mesh
    return eqx.tree_at(lambda m: m.corner_gap, mesh, jnp.where(mesh.outside > 0, _APART, mesh.corner_gap))


def _solved(mesh: jg.Mesh, case: Case) -> jg.MeshCycle:
    """`solve` reads the prepared arrays, and of the compliance how wide it takes the contacts to be: one label for all
    models that agree in this leaves one compilation per contact law.
    """
    labelled = mesh
    if not mesh.compliance.averages_over_loaded_width:
        labelled = eqx.tree_at(lambda m: m.compliance, mesh, strong(jg.default_compliance()))
    pinion, wheel = modifications(case)
    return _solve(labelled, jnp.asarray(np.float64(case.torque)), pinion=pinion, wheel=wheel)
