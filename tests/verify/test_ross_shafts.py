"""Stepped shafts on elastic bearings against ROSS, an independent rotordynamics package of Timoshenko beam elements.

Its static analysis knows weights on rigid bearings only, so that its stiffness matrix is solved with forces too.
"""

import warnings

import jax.numpy as jnp
import numpy as np
import pytest

from jaxgear.shafts import Bearing, Gearbox, Section, Shaft, ShaftLoad, elastic_line

pytestmark = pytest.mark.verify

E, NU = 206e9, 0.3
# length, diameter, bore [mm]
STEPS = [(40.0, 25.0, 0.0), (60.0, 38.0, 10.0), (30.0, 50.0, 10.0), (90.0, 32.0, 0.0)]
ELEMENT = 10.0  # [mm]
LEFT, RIGHT, LOADED = 10.0, 180.0, 110.0
FORCE, RADIAL = 2000.0, 250.0  # N, N/um
GRAVITY = 9.8065


@pytest.fixture(scope="module")
def ross():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip("ross", exc_type=ImportError)


def elements(ross, density):
    steel = ross.Material("elastic", rho=density, E=E, G_s=E / (2 * (1 + NU)))
    parts = []
    for length, diameter, bore in STEPS:
        parts += [(1e-3 * ELEMENT, 1e-3 * bore, 1e-3 * diameter)] * round(length / ELEMENT)
    return [ross.ShaftElement(L, i, o, material=steel, shear_method_calc="cowper") for L, i, o in parts]


def ours(stiffness, force):
    bearings = [Bearing("A", LEFT, stiffness), Bearing("B", RIGHT, 0.6 * stiffness)]
    sections = [Section(*step) for step in STEPS]
    box = Gearbox([Shaft("s", sections, bearings, loads=[ShaftLoad(LOADED, (0.0, force, 0.0))])], [])
    at = jnp.arange(0.0, 220.0 + ELEMENT / 2, ELEMENT)
    return np.asarray(elastic_line(box, "s", at).displacement)[:, 1]


def test_deflection_under_a_force_on_elastic_bearings(ross):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        bearings = [
            ross.BearingElement(n=round(at / ELEMENT), kxx=1e6 * k, cxx=0, kyy=1e6 * k)
            for at, k in ((LEFT, RADIAL), (RIGHT, 0.6 * RADIAL))
        ]
        rotor = ross.Rotor(elements(ross, 7800.0), [], bearings)
        matrix = np.asarray(rotor.K(0))
    per_node = matrix.shape[0] // (len(rotor.nodes))
    keep = np.ravel([per_node * node + np.array([0, 1, 3, 4]) for node in range(len(rotor.nodes))])
    load = np.zeros(matrix.shape[0])
    load[per_node * round(LOADED / ELEMENT) + 1] = FORCE
    moved = np.linalg.solve(matrix[np.ix_(keep, keep)], load[keep])
    np.testing.assert_allclose(ours(RADIAL, FORCE), 1e6 * moved[1::4], rtol=1e-8)


def test_static_analysis_of_a_weight_on_rigid_bearings(ross):
    mass = FORCE / GRAVITY
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        bearings = [ross.BearingElement(n=round(at / ELEMENT), kxx=1e9, cxx=0) for at in (LEFT, RIGHT)]
        disk = ross.DiskElement(n=round(LOADED / ELEMENT), m=mass, Id=0.0, Ip=0.0)
        found = ross.Rotor(elements(ross, 1e-6), [disk], bearings).run_static()
    deformation = np.ravel(found.deformation)
    np.testing.assert_allclose(ours(1e14, -FORCE), 1e6 * deformation, rtol=1e-3, atol=1e-6)
