"""Housing: limits, an exact frame, files and what is refused."""

import importlib
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.sparse
from gearboxes import gearbox

import jaxgear as jg
from jaxgear.shafts import (
    Housing,
    ShaftLoad,
    annex_e,
    bearing_reactions,
    condense,
    read_housing,
    spread_forces,
    support,
    write_housing,
)
from jaxgear.shafts.loads import Patterns, solve, system

SEATS = "ABCD"
NODES = tuple(f"{seat}.{way}" for seat in SEATS for way in "xyz")
Y = jnp.linspace(-8.0, 8.0, 5)


def stage(housing=None):
    """One stage, whose wheel shaft carries a belt too."""
    box = gearbox(housing=housing)
    into, out = box.shafts
    return replace(box, shafts=(into, replace(out, loads=(ShaftLoad(100.0, (900.0, 200.0, 0.0)),))))


def stiffness(factor=1.0):
    """A diagonally dominant matrix that couples all seats [N/um]."""
    random = np.random.default_rng(3)
    part = random.normal(size=(len(NODES), len(NODES)))
    return factor * (400.0 * np.eye(len(NODES)) + 6.0 * (part + part.T))


@pytest.fixture(scope="module")
def housed():
    return stage(Housing(NODES, stiffness()))


@pytest.mark.slow
def test_no_compliance_is_no_housing(housed):
    """Exactly with a compliance of zero, in the limit with a stiffness that grows."""
    bare = stage()
    zero = stage(Housing(NODES, np.zeros((12, 12)), "compliance"))
    for ask in (lambda box: support(box).influence(Y), lambda box: support(box).gap(Y)):
        np.testing.assert_allclose(ask(zero), ask(bare), rtol=1e-12)
        assert np.abs(ask(bare)).max() > 1e-3
    stiff = stage(Housing(NODES, stiffness(1e9)))
    np.testing.assert_allclose(support(stiff).influence(Y), support(bare).influence(Y), rtol=1e-6)
    soft, rigid = (np.asarray(support(box).influence(Y)) for box in (housed, bare))
    assert np.linalg.eigvalsh(soft - rigid)[0] > -1e-12 and np.all(np.diag(soft) > np.diag(rigid))


def test_stiffness_and_its_inverse_are_the_same_housing(housed):
    inverse = stage(Housing(NODES, np.linalg.inv(stiffness()), "compliance"))
    np.testing.assert_allclose(support(inverse).influence(Y), support(housed).influence(Y), rtol=1e-10)


def test_seats_move_by_the_compliance_under_the_bearing_forces(housed):
    inside, bare = bearing_reactions(housed), bearing_reactions(stage())
    forces = np.asarray(inside.force)[:, :3].ravel()
    np.testing.assert_allclose(np.asarray(inside.seat)[:, :3].ravel(), np.linalg.solve(stiffness(), forces), rtol=1e-9)
    np.testing.assert_array_equal(bare.seat, 0.0)
    assert np.abs(inside.force).sum() > 0 and str(inside).count("\n") == 4
    rows = zip(inside.names, SEATS, strict=True)
    assert all(name == seat for name, seat in rows)


def test_maxwell_reciprocity_through_the_housing(housed):
    """The deflection of one shaft under a force on another one is that of the other way round."""
    first, second = np.zeros((2, 1, 5, 2))
    first[0, 0, 0] = second[0, 1, 1] = 1.0
    given = (np.array([120.0]), first), (np.array([30.0]), second)

    @eqx.filter_jit
    def moved(box, given):
        return solve(system(box, [Patterns(*map(jnp.asarray, each)) for each in given]), jnp.eye(2)).pattern

    found = np.asarray(moved(housed, given))
    np.testing.assert_allclose(found[0, 1], found[1, 0], rtol=1e-9)
    assert abs(found[0, 1]) > 1e-6


@pytest.mark.slow
def test_factor_follows_housing_entries(housed):
    """Derivative of K_Hbeta by entries of the stiffness matrix, both of a symmetric pair."""

    @jax.jit
    @jax.value_and_grad
    def factor(values):
        matrix = jnp.asarray(stiffness()).at[0, 0].set(values[0])
        matrix = matrix.at[1, 4].set(values[1]).at[4, 1].set(values[1])
        box = eqx.tree_at(lambda g: g.housing.matrix, housed, matrix)
        return annex_e(support(box, 0), pinion=jg.LeadSlope(8.0), stations=11).face_load_factor

    at = np.array([stiffness()[0, 0], stiffness()[1, 4]])
    _, found = factor(at)
    for slope, step in zip(found, 0.05 * np.eye(2)):
        np.testing.assert_allclose(slope, (factor(at + step)[0] - factor(at - step)[0]) / 0.1, rtol=1e-5)


def test_condensing_a_chain_of_springs_is_its_closed_form():
    """Ground - k1 - seat A - k2 - free node - k3 - seat B, in x; y and z on springs of their own."""
    k1, k2, k3 = 100.0, 50.0, 200.0
    chain = np.array([[k1 + k2, -k2, 0.0], [-k2, k2 + k3, -k3], [0.0, -k3, k3]])
    matrix = scipy.sparse.block_diag([scipy.sparse.coo_array(chain), 7e3 * np.eye(4)])
    pick = np.eye(7)
    housing = condense(matrix, {"A": pick[:, [0, 3, 4]], "B": pick[:, [2, 5, 6]]})
    among = 1e3 * np.array([[1 / k1, 1 / k1], [1 / k1, 1 / k1 + 1 / k2 + 1 / k3]])
    np.testing.assert_allclose(housing.compliance[jnp.ix_(jnp.array([0, 3]), jnp.array([0, 3]))], among, rtol=1e-12)
    schur = chain[np.ix_([0, 2], [0, 2])] - np.outer(chain[[0, 2], 1], chain[1, [0, 2]]) / chain[1, 1]
    np.testing.assert_allclose(np.linalg.inv(among), 1e-3 * schur, rtol=1e-12)


def test_spread_forces_have_the_resultant_they_stand_for():
    random = np.random.default_rng(0)
    nodes, center = random.normal(size=(7, 3)), np.array([0.2, -0.1, 0.5])
    forces = spread_forces(nodes, center, np.arange(21).reshape(7, 3), 21, tilting=True).reshape(7, 3, 5)
    np.testing.assert_allclose(forces.sum(0), np.eye(3, 5), atol=1e-12)
    moments = np.cross((nodes - center)[..., None], forces, axis=1).sum(0)
    np.testing.assert_allclose(moments, np.eye(3, 5, 3), atol=1e-12)
    with pytest.raises(ValueError, match="lie on one line$"):
        spread_forces(np.outer(np.arange(4.0), [1, 1, 0]), [0, 0, 0], np.arange(12).reshape(4, 3), 12)
    with pytest.raises(ValueError, match="^degrees_of_freedom .* the nodes of a seat must be free$"):
        spread_forces(nodes, center, np.arange(-1, 20).reshape(7, 3), 21)


def test_condensing_refuses_what_is_no_held_housing():
    """A chain that floats is singular but for rounding; half of a symmetric matrix is another one."""
    count = 30
    chain = np.diag(np.full(count - 1, -7.3), 1)
    chain = chain + chain.T
    chain -= np.diag(chain.sum(1))
    seat = {"A": np.eye(count)[:, :3]}
    with pytest.raises(ValueError, match="^stiffness is singular"):
        condense(chain, seat)
    held = chain + np.diag([50.0] + [0.0] * (count - 1))
    condense(held, seat)
    with pytest.raises(ValueError, match="must be square and symmetric, both of its triangles given$"):
        condense(np.triu(held), seat)


@pytest.mark.parametrize("ending", ["csv", "npz"])
@pytest.mark.parametrize("kind", ["stiffness", "compliance"])
def test_files_come_back(tmp_path, ending, kind):
    matrix = stiffness() if kind == "stiffness" else np.linalg.inv(stiffness())
    given = Housing(NODES, matrix, kind)
    path = tmp_path / f"housing.{ending}"
    write_housing(path, given)
    back = read_housing(path)
    assert (back.nodes, back.kind) == (NODES, kind)
    np.testing.assert_array_equal(back.matrix, given.matrix)


@pytest.mark.parametrize("unit, factor", [("N/um", 1.0), ("N/mm", 1e-3), ("N/m", 1e-6)])
def test_units_of_other_programs(tmp_path, unit, factor):
    path = tmp_path / "housing.csv"
    path.write_text(f"# FE\nstiffness {unit}; A.x; A.ry\nA.x; 9e3; 5e2\nA.ry; 5e2; 8e5\n")
    turned = {"N/um": 1.0, "N/mm": 1e-3, "N/m": 1e-3}[unit]
    expected = [[9e3 * factor, 5e2 * turned], [5e2 * turned, 8e5 * {"N/um": 1.0, "N/mm": 1e-3, "N/m": 1.0}[unit]]]
    np.testing.assert_allclose(read_housing(path).matrix, expected, rtol=1e-12)


HEAD = "stiffness N/um, A.x, A.y\n"
FAULTS = {
    "": "is empty",
    "stiffness N/furlong, A.x\nA.x, 1\n": '"stiffness N/furlong" is not a kind and unit of a housing',
    HEAD + "A.y, 1, 0\nA.x, 0, 1\n": "rows must have the names of the columns",
    HEAD + "A.x, 1, 0\nA.y, 0\n": "row A.y has 1 numbers, must have 2",
    HEAD + "A.x, 1, 0\nA.y, 0, one\n": r"\(A.y, A.y\) = 'one' must be a number",
    HEAD + "A.x, 1, 0\nA.y, 0, nan\n": r"stiffness \(A.y, A.y\) = nan must be finite",
    HEAD + "A.x, 1, 0.5\nA.y, 0, 1\n": r"stiffness must be symmetric, but \(A.x, A.y\) = 0.5 and \(A.y, A.x\) = 0",
    HEAD + "A.x, 1, 2\nA.y, 2, 1\n": "must be positive definite, .* is the housing fixed to its foundation",
    HEAD + "A.x, 0, 0\nA.y, 0, 1\n": "stiffness of A.x is 0, must be greater than 0",
    "stiffness N/um, A.x, A.x\nA.x, 1, 0\nA.x, 0, 1\n": 'node "A.x" is given twice',
    "stiffness N/um, A.u\nA.u, 1\n": "node 'A.u' must be SEAT.DIRECTION with a direction of x, y, z, rx, ry",
    "stiffness N/um, 17\n17, 1\n": "node '17' must be SEAT.DIRECTION",
}


@pytest.mark.parametrize("text", FAULTS)
def test_malformed_files_are_refused_in_one_line(tmp_path, text):
    path = tmp_path / "housing.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=f"housing.csv: .*{FAULTS[text]}") as caught:
        read_housing(path)
    assert "\n" not in str(caught.value)


def test_other_files_are_refused_in_one_line(tmp_path):
    np.savez(tmp_path / "bare.npz", stiffness=np.eye(2))
    (tmp_path / "broken.npz").write_bytes(b"nothing")
    whole = (tmp_path / "bare.npz").read_bytes()
    (tmp_path / "cut.npz").write_bytes(whole[: len(whole) // 2])
    np.savez(tmp_path / "words.npz", stiffness=np.array([["a"]]), nodes=["A.x"], unit="N/um")
    np.savez(tmp_path / "wide.npz", stiffness=np.eye(2), nodes=["A.x"], unit="N/um")
    (tmp_path / "latin.csv").write_bytes(b"stiffness N/\xb5m")
    for name, fault in {
        "bare.npz": "must hold nodes, holds stiffness",
        "broken.npz": "is not a valid npz archive",
        "cut.npz": "is not a valid npz archive",
        "words.npz": "stiffness must hold real numbers",
        "wide.npz": r"stiffness has shape \(2, 2\), must be \(1, 1\) as its nodes",
        "latin.csv": "must be text in UTF-8",
        "missing.csv": "no such file",
        "matrix.op2": "a housing is read from a .csv or .npz file",
    }.items():
        with pytest.raises(ValueError, match=fault) as caught:
            read_housing(tmp_path / name)
        assert name in str(caught.value) and "\n" not in str(caught.value)


def test_node_maps_must_fit_the_gearbox():
    with pytest.raises(ValueError, match='^Gearbox: seat of the housing "G" is not known, must be one of A, B, C'):
        stage(Housing(("G.x",), np.eye(1)))
    with pytest.raises(ValueError, match='^Gearbox: the housing has no seat for bearing "B"$'):
        stage(Housing(("A.x",), np.eye(1)))


@pytest.mark.slow
def test_a_box_on_a_good_foundation_hardly_matters(tmp_path, monkeypatch):
    """The example by scikit-fem: seats give way alike, so that the load over the face stays."""
    pytest.importorskip("skfem")
    monkeypatch.chdir(tmp_path)
    found = importlib.import_module("examples.how_stiff_is_the_housing").main(fast=True)
    assert found["rigid_seats_seat_um"] == 0.0 and found["good_foundation_seat_um"] > 0.5
    rigid = found["rigid_seats_face_load_factor"]
    assert found["good_foundation_face_load_factor"] == pytest.approx(rigid, rel=0.01)
    assert found["corner_missing_seat_um"] > 2 * found["good_foundation_seat_um"]
