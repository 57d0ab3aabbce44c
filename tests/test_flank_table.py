"""Fields over the contacts as tables over a flank."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, gear_pair

import jaxgear as jg
from jaxgear.contact import flank_table, removed_material

GEARS = pytest.mark.parametrize("gear", ["pinion", "wheel"])
RATE = 3.0, 0.5  # um per mm of roll length and of face


@pytest.fixture(scope="module")
def mesh():
    return jg.prepare(gear_pair(), resolution=jg.Resolution(positions=16, pairs=2, slices=3, slide_steps=0))


def side_of(mesh, gear):
    return mesh.sides[gear == "wheel"]


@eqx.filter_jit
def contact_field(mesh, gear, rate=RATE):
    """Linear over roll length and face, constant of one um at the pitch point in the middle of the face."""
    side = side_of(mesh, gear)
    along = side.contact_roll_length - side.pitch_roll_length
    return 1.0 + rate[0] * along + rate[1] * mesh.face_coordinate[None, :, None]


table_of = eqx.filter_jit(flank_table)


@jax.jit
def taken(table, flank):
    return table(flank)


def on_path(mesh):
    return np.broadcast_to(np.asarray(mesh.outside <= 0), (2, 3, 16))


@GEARS
def test_table_holds_the_field_at_every_contact(mesh, gear):
    field = np.random.default_rng(1).normal(size=(2, 3, 16))
    table = table_of(mesh.kinematics, field, gear)
    inside = on_path(mesh)
    back = np.asarray(taken(table, eqx.filter_jit(mesh.flanks)()[gear == "wheel"]))
    np.testing.assert_allclose(back[inside], field[inside], atol=1e-11)
    # between the contacts on the path, and nowhere else, the table follows the field
    start, tip = float(side_of(mesh, gear).start_roll_length), float(side_of(mesh, gear).tip_roll_length)
    used = (np.asarray(table.roll_length) >= start) & (np.asarray(table.roll_length) <= tip)
    assert used.sum() == inside[:, 0].sum()


@GEARS
def test_linear_fields_are_linear_over_the_flank(mesh, gear):
    side = side_of(mesh, gear)
    table = table_of(mesh.kinematics, contact_field(mesh, gear), gear)
    step = float(mesh.path_of_contact.base_pitch) / 16
    roll = np.linspace(float(side.start_roll_length) + step, float(side.tip_roll_length) - step, 101)
    face = np.linspace(*np.asarray(mesh.face_coordinate)[[0, -1]], 101)
    expected = 1.0 + RATE[0] * (roll - float(side.pitch_roll_length)) + RATE[1] * face
    found = eqx.filter_jit(lambda side, roll, face: table(side.flank(roll, face)))(side, roll, face)
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@GEARS
def test_the_table_removes_what_the_field_says(mesh, gear):
    """The mean over the contact leaves a linear field as it is, but for the flank's curvature."""
    field = contact_field(mesh, gear)
    removed = removed_material(mesh, 50.0, **{gear: table_of(mesh.kinematics, field, gear)}).amount
    step = float(mesh.path_of_contact.base_pitch) / 16
    path, contact = np.asarray(mesh.path), mesh.path_of_contact
    inner = (path > float(contact.start) + step) & (path < float(contact.end) - step)
    inner = np.broadcast_to(inner, removed.shape)
    np.testing.assert_allclose(np.asarray(removed)[inner], np.asarray(field)[inner], atol=2e-3)
    constant = table_of(mesh.kinematics, np.full((2, 3, 16), 4.0), gear)
    np.testing.assert_allclose(removed_material(mesh, 50.0, **{gear: constant}).amount, 4.0, rtol=1e-13)


def test_one_slice_gives_a_profile():
    mesh = jg.prepare(gear_pair(), resolution=LINE)
    table = jax.jit(lambda field: flank_table(mesh.kinematics, field, "pinion"))(np.ones((2, 1, 16)))
    assert isinstance(table, jg.TabulatedProfile) and not table.varies_along_face


def test_derivatives_and_batches(mesh):
    """Material removed sums up what the table was given: the derivative by the field of one design, and of many."""
    points, inside = mesh.flanks()[1], on_path(mesh)

    @jax.jit
    @jax.vmap
    def removed(rate):
        table = flank_table(mesh.kinematics, contact_field(mesh, "wheel", rate), "wheel")
        return jnp.sum(jnp.where(inside, table(points), 0.0))

    rates = np.array([[3.0, 0.5], [0.0, 2.0]])
    slopes, values = jax.jit(jax.jacrev(lambda r: ((values := removed(r)).sum(), values), has_aux=True))(rates)
    along, across = (np.asarray(contact_field(mesh, "wheel", rate))[inside].sum() - inside.sum() for rate in np.eye(2))
    np.testing.assert_allclose(slopes, np.tile([along, across], (2, 1)), rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(values, float(inside.sum()) + rates @ [along, across], rtol=1e-10)


def test_what_is_no_field_is_refused(mesh):
    with pytest.raises(ValueError, match=r"field has shape \(2, 16\), must be \(2, 3, 16\)"):
        flank_table(mesh.kinematics, jnp.asarray(np.ones((2, 16))), "pinion")
    with pytest.raises(ValueError, match="gear = 'gear' must be"):
        flank_table(mesh.kinematics, jnp.asarray(np.ones((2, 3, 16))), "gear")
