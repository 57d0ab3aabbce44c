"""The status of results: the most basic of several causes, in arrays that can be mapped and differentiated past."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, gear_pair

import jaxgear as jg
from jaxgear.contact.status import Status, explanation, reason, status_of, tally


def test_the_most_basic_cause_counts():
    causes = {
        Status.NOT_CONVERGED: np.array([False, True, True, False]),
        Status.GEARS_CANNOT_RUN: np.array([False, False, True, True]),
    }
    status = status_of(causes)
    assert status.dtype == jnp.int8
    assert status.tolist() == [Status.CONVERGED, Status.NOT_CONVERGED, Status.GEARS_CANNOT_RUN, Status.GEARS_CANNOT_RUN]
    assert status_of({Status.MORE_PAIRS_NEEDED: True}, status).tolist() == [3, 3, 6, 6]
    assert reason(status) == Status.GEARS_CANNOT_RUN.text and reason(status[:1]) == "converged"


def test_every_cause_has_a_text_of_its_own():
    texts = [status.text for status in Status]
    assert len(set(texts)) == len(texts) and all("\n" not in text for text in texts)


def test_the_commonest_cause_is_told_with_its_remedy():
    failures = tally(jnp.array([[3, 0, 3], [1, 6, 3]], jnp.int8))
    assert failures == {Status.MORE_PAIRS_NEEDED: 3, Status.NOT_CONVERGED: 1, Status.GEARS_CANNOT_RUN: 1}
    said = explanation(failures, 6, "variants", pairs=2)
    assert said.startswith("3 of 6 variants: tooth pairs beyond those of the mesh") and said.endswith("at least 3")
    assert all(status.remedy for status in Status if status) and tally(jnp.zeros(3, jnp.int8)) == {}


@pytest.mark.slow
def test_a_batch_has_a_status_of_every_member_and_derivatives_pass_it():
    """A load beyond the pairs of the mesh, beside one within them."""
    mesh = jg.prepare(gear_pair(), resolution=LINE)

    def mean(torque):
        cycle = jg.solve(mesh, torque)
        return jnp.mean(cycle.transmission_error), cycle

    torques = jnp.array([50.0, 1e5])
    slopes, cycles = jax.jit(jax.vmap(jax.grad(mean, has_aux=True)))(torques)
    assert np.isfinite(slopes[0]) and not np.any(cycles.status[0])
    assert int(np.max(cycles.status[1])) == Status.MORE_PAIRS_NEEDED
    assert cycles.converged.shape == cycles.status.shape == (2, LINE.positions)


def test_a_cycle_says_why_it_has_not_converged():
    mesh = jg.prepare(gear_pair(), resolution=LINE)
    cycle = jg.solve(mesh, 1e5)
    text = str(cycle)
    assert "NOT CONVERGED (tooth pairs beyond those of the mesh come into contact, more are needed)" in text
    assert "16 positions, converged" not in text
    batch = jax.tree.map(lambda leaf: jnp.stack([leaf, leaf]), cycle)  # as jax.vmap gives it
    assert str(batch).startswith("(2,) of MeshCycle, 16 positions, 2 of 2 NOT CONVERGED (tooth pairs beyond")


@pytest.mark.parametrize("status", list(Status))
def test_a_number_is_its_status(status):
    assert Status(int(jnp.int8(status))) is status
