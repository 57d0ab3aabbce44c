"""Fields over the contacts as tables over a flank."""

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


def contact_field(mesh, gear, rate=RATE):
    """Linear over roll length and face, constant of one um at the pitch point in the middle of the face."""
    side = side_of(mesh, gear)
    along = side.contact_roll_length - side.pitch_roll_length
    return 1.0 + rate[0] * along[:, None] + rate[1] * mesh.face_coordinate[None, :, None]


def on_path(mesh):
    return np.broadcast_to(np.asarray(mesh.outside <= 0)[:, None], (2, 3, 16))


@GEARS
def test_table_holds_the_field_at_every_contact(mesh, gear):
    field = jnp.asarray(np.random.default_rng(1).normal(size=(2, 3, 16)))
    table = flank_table(mesh.kinematics, field, gear)
    inside = on_path(mesh)
    back = np.asarray(table(mesh.flanks()[gear == "wheel"]))
    np.testing.assert_allclose(back[inside], np.asarray(field)[inside], atol=1e-11)
    # between the contacts on the path, and nowhere else, the table follows the field
    start, tip = side_of(mesh, gear).start_roll_length, side_of(mesh, gear).tip_roll_length
    used = (table.roll_length >= start) & (table.roll_length <= tip)
    assert used.sum() == inside[:, 0].sum()


@GEARS
def test_linear_fields_are_linear_over_the_flank(mesh, gear):
    side = side_of(mesh, gear)
    table = flank_table(mesh.kinematics, contact_field(mesh, gear), gear)
    step = float(mesh.path_of_contact.base_pitch) / 16
    roll = jnp.linspace(side.start_roll_length + step, side.tip_roll_length - step, 101)
    face = jnp.linspace(mesh.face_coordinate[0], mesh.face_coordinate[-1], 101)
    expected = 1.0 + RATE[0] * (roll - side.pitch_roll_length) + RATE[1] * face
    np.testing.assert_allclose(table(side.flank(roll, face)), expected, rtol=1e-12)


@GEARS
def test_the_table_removes_what_the_field_says(mesh, gear):
    """The mean over the contact leaves a linear field as it is, but for the flank's curvature."""
    field = contact_field(mesh, gear)
    removed = removed_material(mesh, 50.0, **{gear: flank_table(mesh.kinematics, field, gear)}).amount
    step = float(mesh.path_of_contact.base_pitch) / 16
    path, contact = mesh.path, mesh.path_of_contact
    inner = np.asarray((path > contact.start + step) & (path < contact.end - step))
    inner = np.broadcast_to(inner[:, None], removed.shape)
    np.testing.assert_allclose(np.asarray(removed)[inner], np.asarray(field)[inner], atol=2e-3)
    constant = flank_table(mesh.kinematics, jnp.full((2, 3, 16), 4.0), gear)
    np.testing.assert_allclose(removed_material(mesh, 50.0, **{gear: constant}).amount, 4.0, rtol=1e-13)


def test_one_slice_gives_a_profile():
    mesh = jg.prepare(gear_pair(), resolution=LINE)
    table = jax.jit(lambda field: flank_table(mesh.kinematics, field, "pinion"))(jnp.ones((2, 1, 16)))
    assert isinstance(table, jg.TabulatedProfile) and not table.varies_along_face


def test_derivatives_and_batches(mesh):
    """Material removed sums up what the table was given: the derivative by the field of one design, and of many."""
    points, inside = mesh.flanks()[1], on_path(mesh)

    @jax.jit
    @jax.vmap
    def removed(rate):
        table = flank_table(mesh.kinematics, contact_field(mesh, "wheel", rate), "wheel")
        return jnp.sum(jnp.where(inside, table(points), 0.0))

    rates = jnp.asarray([[3.0, 0.5], [0.0, 2.0]])
    values, slopes = removed(rates), jax.jacrev(lambda r: removed(r).sum())(rates)
    along = jnp.where(inside, contact_field(mesh, "wheel", (1.0, 0.0)) - 1.0, 0.0).sum()
    across = jnp.where(inside, contact_field(mesh, "wheel", (0.0, 1.0)) - 1.0, 0.0).sum()
    np.testing.assert_allclose(slopes, np.tile([along, across], (2, 1)), rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(values, float(inside.sum()) + rates @ jnp.stack([along, across]), rtol=1e-10)


def test_what_is_no_field_is_refused(mesh):
    with pytest.raises(ValueError, match=r"flank_table: field has shape \(2, 16\), must be \(2, 3, 16\)"):
        flank_table(mesh.kinematics, jnp.ones((2, 16)), "pinion")
    with pytest.raises(ValueError, match="flank_table: gear = 'gear' must be"):
        flank_table(mesh.kinematics, jnp.ones((2, 3, 16)), "gear")
