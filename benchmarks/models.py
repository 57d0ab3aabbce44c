"""The models under comparison: jaxgear's default, the usual published model, and the default with one
ingredient changed."""

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np

import jaxgear as jg

from .cases import Case, Curves, gear_pair, reliefs, strong

POSITIONS, PAIRS = 128, 4  # those of the reference
_APART = 1e6  # corner gap that keeps tip corners out of contact [um]


@dataclass(frozen=True)
class Model:
    """A compliance model for each plane, with or without corner contact."""

    name: str
    compliance: Callable[[str], jg.Compliance]
    corner_contact: bool = True


def _default_with(**changes) -> Callable[[str], jg.Compliance]:
    return lambda plane: replace(jg.default_compliance(plane), **changes)


DEFAULT = Model("default", jg.default_compliance)
LEGACY = Model("legacy", lambda plane: jg.legacy_compliance())
MODELS = (
    DEFAULT,
    LEGACY,
    Model("no coupling", _default_with(body=jg.compliance.ElasticRing(coupling=False))),
    Model("no edge softening", _default_with(edge_softening=False)),
    Model("no corner contact", jg.default_compliance, corner_contact=False),
    Model("constant Hertz", _default_with(contact=jg.compliance.ConstantHertz())),
    Model("Weber", _default_with(contact=jg.compliance.Weber())),
)


def run(model: Model, cases: Sequence[Case]) -> dict[Case, Curves]:
    """Solves all cases with one model.

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
        curves[case] = _curves(cycle)
    return curves


def _curves(cycle: jg.MeshCycle) -> Curves:
    force = np.asarray(cycle.pair_force)
    corner = (np.asarray(cycle.kinematics.outside) > 0) & (force > 0)
    pressure = np.where(corner, np.nan, np.asarray(cycle.contact_pressure[:, 0]))
    te = np.asarray(cycle.transmission_error)
    return Curves(te, np.asarray(cycle.unloaded_transmission_error), force, pressure)


_prepare = eqx.filter_jit(jg.prepare)
_solve = eqx.filter_jit(jg.solve)


@functools.cache
def _mesh(model: Model, pair: str, plane: str) -> jg.Mesh:
    compliance, resolution = model.compliance(plane), jg.Resolution(positions=POSITIONS, pairs=PAIRS)
    mesh = strong(_prepare(gear_pair(pair), compliance=compliance, resolution=resolution))
    if model.corner_contact:
        return mesh
    return eqx.tree_at(lambda m: m.corner_gap, mesh, jnp.where(mesh.outside > 0, _APART, mesh.corner_gap))


def _solved(mesh: jg.Mesh, case: Case) -> jg.MeshCycle:
    """`solve` reads the prepared compliance only, so one label for all models leaves one compilation per
    contact law.
    """
    labelled = eqx.tree_at(lambda m: m.compliance, mesh, strong(jg.default_compliance()))
    pinion, wheel = reliefs(case)
    return _solve(labelled, jnp.asarray(np.float64(case.torque)), pinion=pinion, wheel=wheel)
