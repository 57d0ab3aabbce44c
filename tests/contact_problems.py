"""Random contact problems in the range of gear teeth, for the tests of the contact solver."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from jaxgear.compliance import face_kernel, few_modes
from jaxgear.numerics import AbstractSpring, ContactProblem, solve_contact, tangent_stiffness

# one program for all numbers of the same shapes, in place of one for every operation in it
solved_in_20 = eqx.filter_jit(lambda data: solve_contact(data, steps=20))
stiffness_at = eqx.filter_jit(tangent_stiffness)
kernel_of = jax.jit(face_kernel, static_argnums=2)
modes_of = jax.jit(few_modes, static_argnums=(1, 3))


class LinearSpring(AbstractSpring):
    """h = c q"""

    c: Array

    def secant(self, load):
        return self.c + 0 * load


class SofteningSpring(AbstractSpring):
    """h = q (a - b log(q)), as Hertzian line contact: it stiffens under load."""

    a: Array
    b: Array

    def secant(self, load):
        return self.a - self.b * jnp.log(load)


class PowerSpring(AbstractSpring):
    """h = a q^n"""

    a: Array
    n: Array

    def secant(self, load):
        return self.a * load ** (self.n - 1)


def problem(compliance, law, gap, *, lever=None, weight=(1.0,), load=1.0) -> ContactProblem:
    """A contact problem from anything array-like; levers default to 1."""
    gap = jnp.asarray(gap)
    lever = jnp.ones((gap.shape[0], gap.shape[-1])) if lever is None else jnp.asarray(lever)
    compliance, lever = jnp.asarray(compliance)[:, :, None], lever[:, None]
    return ContactProblem(compliance, law, gap, lever, jnp.asarray(weight), jnp.asarray(load))


def coupled(problem, coupling, **given) -> ContactProblem:
    """The problem with slices coupled on bodies."""
    return replace(problem, compliance=coupling.local(len(problem.gap)), coupling=coupling, **given)


def influence(coupling, weight):
    """Deflection of every slice of every pair under the line load of every other one, without a support: the whole
    matrix in NumPy, shape (pairs, slices, pairs, slices, positions); `weight` are the widths of the slices.
    """
    modes, found = np.asarray(coupling.modes), 0.0
    for compliance, share, rest in coupling.bodies:
        face = float(rest) * np.eye(len(modes)) + modes @ np.asarray(share) @ modes.T * np.asarray(weight)
        found = found + np.einsum("ijx,st->isjtx", compliance, face)
    if coupling.scale is not None:
        found = np.einsum("isx,isjtx,jtx->isjtx", coupling.scale, found, coupling.scale)
    return found


def random_problem(seed, springs, slices, positions, law="softening", levers=True) -> ContactProblem:
    """Coupled springs of 0.005 ... 0.05 um/N with gaps from 0 to 1000 um, many of them exactly equal."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(springs, springs, positions))
    compliance = np.einsum("ikn,jkn->ijn", root, root) * 0.01 / springs
    compliance[np.arange(springs), np.arange(springs)] += rng.uniform(0.005, 0.04, (springs, positions))
    size = rng.choice([0.0, 1.0, 10.0, 100.0, 1000.0], size=(springs, 1, positions))
    gap = size * rng.uniform(0.0, 1.0, (springs, slices, positions))
    field = (springs, 1, positions)
    if law == "softening":
        spring = SofteningSpring(rng.uniform(0.02, 0.04, field), rng.uniform(0.001, 0.003, field))
    else:
        spring = PowerSpring(rng.uniform(0.01, 0.04, field), rng.uniform(0.7, 0.95, field))
    lever = rng.uniform(0.8, 1.0, (springs, positions)) if levers else None
    spring = jax.tree.map(jnp.asarray, spring)
    return problem(compliance, spring, gap, lever=lever, weight=rng.uniform(0.5, 1.5, slices), load=1.0)


def with_load(data: ContactProblem, load) -> ContactProblem:
    """The same problem under another load."""
    return eqx.tree_at(lambda p: p.load, data, load)


def at_approach(data: ContactProblem, approach) -> ContactProblem:
    """The same problem at a prescribed approach, shape (positions,)."""
    return ContactProblem(data.compliance, data.law, data.gap, data.lever, data.weight, approach=approach)
