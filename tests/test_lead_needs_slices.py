"""A mesh of one slice stands in the middle of the face: what varies along the face is refused there, on every path.

Ignored, a crowning of 50 um left the transmission error of the nominal gears, and a search over it ended anywhere.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg
from jaxgear.contact import removed_material
from jaxgear.io import DesignFileError, load_design

REFUSED = "varies along the face, which a mesh of 1 slice cannot show: prepare with Resolution"
BOUNDS = {"crowning": (0.0, 50.0)}
LEADS = [jg.LeadCrowning(50.0), jg.LeadSlope(9.0), jg.EndRelief(9.0, 2.0), -0.5 * jg.LeadCrowning(50.0)]


def crowned(x):
    return jg.TipRelief(5.0, 3.0) + jg.LeadCrowning(x["crowning"]), jg.TipRelief(5.0, 3.0)


@pytest.mark.parametrize("lead", LEADS)
@pytest.mark.parametrize("gear", ["pinion", "wheel"])
def test_solve_refuses_what_one_slice_cannot_show(mesh, lead, gear):
    with pytest.raises(ValueError, match=f"{gear}: .*{REFUSED}"):
        jg.solve(mesh, 50.0, **{gear: jg.TipRelief(5.0, 3.0) + lead})


def test_traced_amounts_are_refused_too(mesh):
    """Whatever they will be: their derivative would be zero without a word."""

    def error(crowning):
        return jg.solve(mesh, 50.0, pinion=jg.LeadCrowning(crowning)).transmission_error[0]

    for call in (jax.jit(error), jax.grad(error)):
        with pytest.raises(ValueError, match=REFUSED):
            call(5.0)
    with pytest.raises(ValueError, match=REFUSED):
        jax.vmap(error)(jnp.arange(3.0))


@pytest.mark.parametrize(
    "call",
    [
        lambda mesh: jg.minimize(jg.Problem(mesh, 50.0, crowned, BOUNDS)),
        lambda mesh: jg.sweep(mesh, 50.0, crowned, jg.FullFactorial(BOUNDS, 3)),
        lambda mesh: jg.monte_carlo(mesh, 50.0, jg.ManufacturedGears(jg.Tolerance(), 2), pinion=LEADS[0]),
    ],
    ids=["minimize", "sweep", "monte_carlo"],
)
def test_searches_refuse_it_too(mesh, call):
    with pytest.raises(ValueError, match=REFUSED):
        call(mesh)


def test_amounts_of_zero_are_the_nominal_face(mesh):
    nothing = jg.LeadCrowning(0.0) + jg.EndRelief(0.0, 2.0)
    assert bool(jnp.all(removed_material(mesh, 50.0, pinion=nothing).amount == 0.0))
    # two programs, which a compiler may round differently
    cycle, nominal = jg.solve(mesh, 50.0, pinion=nothing), jg.solve(mesh, 50.0)
    np.testing.assert_allclose(cycle.transmission_error, nominal.transmission_error, rtol=1e-12)


FILE = """
[pinion]
teeth = 19
module = 3.0
face_width = 20.0
[[pinion.modification]]
type = "tip_relief"
amount = 5.0
length = 3.0
{lead}
[wheel]
teeth = 48
module = 3.0
face_width = 18.0
[load]
torque = 50.0
{tail}
"""
LEAD = '[[pinion.modification]]\ntype = "lead_crowning"\namount = {}'
VARIABLE = "[variables]\nc = { low = 0.0, high = 8.0 }\n[sweep]\nsamples = 8"


@pytest.fixture
def load(tmp_path):
    def write_and_load(lead="", tail=""):
        path = tmp_path / "gear.toml"
        path.write_text(FILE.format(lead=lead, tail=tail), encoding="utf-8")
        return load_design(path)

    return write_and_load


def test_design_files_take_enough_slices_where_a_modification_varies_along_the_face(load):
    """Also where only a variable makes it vary, and for the sweep of that file."""
    assert load().resolution().slices == 1
    assert load(LEAD.format(0.0)).resolution().slices == 1
    assert load(LEAD.format(5.0)).resolution().slices == 11
    assert load(LEAD.format('"c"'), VARIABLE).resolution(80.0).slices == 11
    assert load(LEAD.format(5.0), "[resolution]\nslices = 3").resolution().slices == 3


def test_design_files_refuse_one_slice_for_it(load):
    with pytest.raises(
        DesignFileError, match=r"resolution.slices: must be at least 2, 1 cannot show pinion.modif.*\[1\]"
    ):
        load(LEAD.format(5.0), "[resolution]\nslices = 1")
