"""Contact of a mesh whose shafts, bearings and housing give way: limits, symmetry, the one-dimensional analysis."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import FACE
from gearboxes import PAIR, gearbox

import jaxgear as jg
from jaxgear.contact.status import Status
from jaxgear.metrics import face_load_factor
from jaxgear.shafts import Housing, RigidSupport, annex_e, support

pytestmark = pytest.mark.slow

TORQUE = 50.0
FLANK = jg.LeadSlope(4.0) + jg.LeadCrowning(5.0)


def solved(given, *, compliance=None, pinion=FLANK, sizes=FACE):
    mesh = jg.prepare(PAIR, compliance=compliance, resolution=sizes, support=given)
    cycle = jg.solve(mesh, TORQUE, pinion=pinion)
    assert np.all(cycle.converged)
    return cycle


def assert_same(one, other, rtol=1e-9):
    np.testing.assert_allclose(one.transmission_error, other.transmission_error, rtol=rtol)
    np.testing.assert_allclose(one.line_load, other.line_load, rtol=rtol, atol=1e3 * rtol)


@pytest.fixture(scope="module")
def mesh():
    return jg.prepare(PAIR, resolution=FACE, support=support(gearbox(), 0))


@pytest.fixture(scope="module")
def carried(mesh):
    return jg.solve(mesh, TORQUE, pinion=FLANK)


@pytest.fixture(scope="module")
def rigid(mesh):
    """The same mesh on nothing that gives way; `test_face_coupling` prepares it so."""
    nothing = dict.fromkeys(("support", "support_gap", "support_torque", "support_status"))
    alone = replace(mesh.coupling, support_modes=None, support=None)
    cycle = jg.solve(replace(mesh, coupling=alone, **nothing), TORQUE, pinion=FLANK)
    assert np.all(cycle.converged)
    return cycle


def test_what_does_not_give_way_is_no_support(rigid, carried):
    stiff = gearbox(radial=1e12, modulus=1e14)
    assert_same(solved(support(stiff, 0)), rigid, rtol=1e-6)
    assert np.all(carried.converged)
    carried, rigid = np.asarray(carried.line_load), np.asarray(rigid.line_load)
    assert np.abs(carried - rigid).max() > 0.02 * rigid.max()


def test_a_rigid_support_and_none_are_alike(rigid):
    assert_same(solved(None), rigid)
    assert_same(solved(RigidSupport(PAIR)), rigid)


def test_a_housing_of_no_compliance_is_none(carried):
    nodes = tuple(f"{seat}.{way}" for seat in "ABCD" for way in "xyz")
    assert_same(solved(support(gearbox(housing=Housing(nodes, np.zeros((12, 12)), "compliance")), 0)), carried)


def test_a_mirrored_gearbox_mirrors_the_load(carried):
    turned = solved(support(gearbox(mirrored=True), 0), pinion=jg.LeadSlope(-4.0) + jg.LeadCrowning(5.0))
    np.testing.assert_allclose(turned.transmission_error, carried.transmission_error, rtol=1e-8)
    np.testing.assert_allclose(turned.line_load[:, ::-1], carried.line_load, rtol=1e-7, atol=1e-6)


@pytest.mark.parametrize("crowning", [5.0, 30.0])
def test_one_pair_of_constant_stiffness_is_the_one_dimensional_analysis(crowning):
    """Teeth that do not pass their load on over the face, under a linear law, at the pitch point: that is what the
    standard computes."""
    flank = jg.LeadSlope(4.0) + jg.LeadCrowning(crowning)
    model, slices = jg.legacy_compliance(), 5
    sizes = jg.Resolution(positions=4, slices=slices, pairs=2)  # with as many modes as slices
    mesh = jg.prepare(PAIR, compliance=model, resolution=sizes, support=support(gearbox(), 0))
    body = mesh.coupling.bodies[0]._replace(share=jnp.eye(slices) * slices / PAIR.face_width, rest=jnp.zeros(()))
    mesh = replace(mesh, coupling=replace(mesh.coupling, modes=jnp.eye(slices), bodies=(body,)))
    aligned = solved(None, compliance=model, pinion=jg.LeadSlope(0.0), sizes=sizes)
    mean = float(aligned.line_load[0, 0, 0])
    stiffness = mean / (float(aligned.transmission_error[0]) - float(mesh.hub) * mean)
    expected = annex_e(support(gearbox(), 0), pinion=flank, stiffness=stiffness, stations=slices)
    found = jg.solve(mesh, TORQUE, pinion=flank)
    load = np.asarray(found.line_load)[:, :, 0]
    assert load[1].max() == 0  # the pitch point, where one pair carries all
    np.testing.assert_allclose(load[0], expected.line_load, rtol=1e-8, atol=1e-6)
    assert (load[0].min() == 0) == (crowning > 20)


def test_teeth_that_pass_their_load_on_raise_the_factor_of_the_one_dimensional_analysis(carried):
    """A load gives way less the shorter it is; one stiffness along the face does not know. 5 to 25 % here."""
    given = support(gearbox(), 0)
    alone = float(annex_e(given, pinion=FLANK, stations=FACE.slices).face_load_factor)
    assert alone > 1.2
    assert 1.05 < float(face_load_factor(carried)) / alone < 1.25


def test_a_contact_on_shafts_that_cannot_be_does_not_converge(mesh):
    assert mesh.status == Status.CONVERGED
    refused = eqx.tree_at(lambda of: of.support_status, mesh, jnp.int8(Status.SUPPORT_NOT_POSSIBLE))
    cycle = jg.solve(refused, TORQUE, pinion=FLANK)
    assert not np.any(cycle.converged) and np.all(cycle.status == Status.SUPPORT_NOT_POSSIBLE)
    assert "NOT CONVERGED (shafts, bearings or housing are invalid)" in str(cycle)

    def valid(position):
        """As a traced position, which nothing checks."""
        box = eqx.tree_at(lambda of: of.shafts[0].gears[0].position, gearbox(), jnp.asarray(position, float))
        return bool(jg.prepare(PAIR, resolution=FACE, support=support(box, 0)).status == Status.CONVERGED)

    assert valid(45.0) and not valid(300.0)


def housed(values):
    """Gearbox with another radial stiffness of bearing A and another compliance of its seat in y."""
    nodes = tuple(f"{seat}.{way}" for seat in "ABCD" for way in "xyz")
    matrix = np.diag(np.full(len(nodes), 1 / 300.0)) + 1e-4
    box = gearbox(housing=Housing(nodes, matrix, "compliance"))
    return eqx.tree_at(
        lambda of: (of.shafts[0].bearings[0].radial, of.housing.matrix),
        box,
        (values[0], jnp.asarray(matrix).at[1, 1].set(values[1])),
    )


def test_derivatives_of_the_face_load_factor_are_central_differences():
    """By bearing, housing, slope and crowning, through shafts, influence and contact."""

    def factor(values):
        box = housed(values[:2])
        mesh = jg.prepare(PAIR, resolution=FACE, support=support(box, 0))
        return face_load_factor(jg.solve(mesh, TORQUE, pinion=jg.LeadSlope(values[2]) + jg.LeadCrowning(values[3])))

    at = jnp.array([150.0, 1 / 300.0, 4.0, 5.0])
    found, factor = jax.jit(jax.grad(factor))(at), jax.jit(factor)
    assert np.all(np.abs(np.asarray(found * at)) > 1e-4)
    for index, value in enumerate(np.asarray(at)):
        step = jnp.zeros(4).at[index].set(1e-4 * value)
        difference = (factor(at + step) - factor(at - step)) / (2e-4 * value)
        np.testing.assert_allclose(found[index], difference, rtol=1e-5, err_msg=str(index))
