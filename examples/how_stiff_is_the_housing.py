"""Does the housing matter? A box of plates by finite elements, condensed onto its bearing seats, under a gear pair.

scikit-fem (`pip install scikit-fem`) makes a three-dimensional model of an open box: a bottom, four walls, an opening
for each of the four bearings. Its stiffness matrix is condensed onto the seats and written as the CSV file that
`read_housing` takes: matrices of other finite-element programs have to be brought into it, their own files are not
read. Then the bearing displacements and the load over the face follow: on rigid seats, in the box on a good foundation,
and on one that is missing under a corner.
Run it: `python examples/how_stiff_is_the_housing.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402
from dataclasses import replace  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402
import skfem  # noqa: E402
from skfem.models.elasticity import lame_parameters, linear_elasticity  # noqa: E402

import jaxgear as jg  # noqa: E402
from jaxgear import shafts  # noqa: E402

CELL, WALL = 25.0, 12.0  # mm: size of the elements, thickness of the plates
ACROSS, HIGH, DEEP = 9, 5, 5  # cells inside the walls
SHAFTS = 50.0, 150.0  # mm, x of the axes; centre distance rounded to the grid
HEIGHT = 75.0  # mm, of the axes over the bottom
SEATS = ("A", "B"), ("C", "D")  # of pinion and wheel shaft, at the front and at the back
E, NU = 110_000.0, 0.28  # MPa, grey cast iron
TORQUE = 150.0  # N m


def box():
    """Quadratic elements of the box, and the coordinates of its nodes with their degrees of freedom."""
    x = np.concatenate([[-WALL], CELL * np.arange(ACROSS + 1), [CELL * ACROSS + WALL]])
    y = np.concatenate([[-WALL], CELL * np.arange(HIGH + 1)])
    z = np.concatenate([[-WALL], CELL * np.arange(DEEP + 1), [CELL * DEEP + WALL]])
    mesh = skfem.MeshHex.init_tensor(x, y, z)
    middle = mesh.p[:, mesh.t].mean(axis=1)
    inside = (middle[1] > 0) & (middle[0] > 0) & (middle[0] < x[-2]) & (middle[2] > 0) & (middle[2] < z[-2])
    bore = np.zeros_like(inside)
    for axis in SHAFTS:
        bore |= (np.abs(middle[0] - axis) < CELL) & (np.abs(middle[1] - HEIGHT) < CELL)
    ends = (middle[2] < 0) | (middle[2] > z[-2])
    plates = mesh.remove_elements(np.flatnonzero(inside | (bore & ends)))
    basis = skfem.Basis(plates, skfem.ElementVector(skfem.ElementHexS2()), intorder=4)
    rows = np.hstack([basis.nodal_dofs, basis.edge_dofs])
    return basis, basis.doflocs[:, rows[0]].T, rows.T


def housing(missing=False):
    """The box on its foundation, which is missing under the back corner of the wheel shaft or not."""
    basis, nodes, rows = box()
    stiffness = skfem.asm(linear_elasticity(*lame_parameters(E, NU)), basis)
    bottom = nodes[:, 1] < -WALL + 1e-6
    if missing:
        bottom &= ~((nodes[:, 0] > 0.45 * CELL * ACROSS) & (nodes[:, 2] > 0.5 * CELL * DEEP))
    free = np.setdiff1d(np.arange(stiffness.shape[0]), rows[bottom])
    place = np.full(stiffness.shape[0], -1)
    place[free] = np.arange(len(free))
    seats = {}
    for axis, names in zip(SHAFTS, SEATS):
        for name, face in zip(names, (-0.5 * WALL, CELL * DEEP + 0.5 * WALL)):
            center = np.array([axis, HEIGHT, face])
            around = np.abs(nodes - center) <= np.array([CELL, CELL, 0.5 * WALL]) + 1e-6
            bore = around.all(axis=1)
            seats[name] = shafts.spread_forces(nodes[bore], center, place[rows[bore]], len(free))
    return shafts.condense(stiffness[free][:, free], seats)


def gearbox(seats=None):
    """Pinion and wheel on shafts that reach from the front to the back of the box."""
    span = CELL * DEEP + WALL
    pinion = jg.Gear(teeth=19, module=3.0, face_width=24.0, bore_diameter=30.0)
    wheel = jg.Gear(teeth=48, module=3.0, face_width=24.0, bore_diameter=40.0)
    first = shafts.Shaft(
        "pinion",
        [shafts.Section(40.0, 28.0), shafts.Section(span, 35.0)],
        [shafts.Bearing("A", 40.0, 400.0, 100.0), shafts.Bearing("B", 40.0 + span, 400.0)],
        [shafts.MountedGear("19", pinion, 40.0 + 0.6 * span, shafts.integral_diameter(pinion))],
        [shafts.Coupling(0.0, TORQUE)],
    )
    second = shafts.Shaft(
        "wheel",
        [shafts.Section(span, 45.0), shafts.Section(60.0, 40.0)],
        [shafts.Bearing("C", 0.0, 500.0, 100.0), shafts.Bearing("D", span, 500.0)],
        [shafts.MountedGear("48", wheel, 0.6 * span)],
        [shafts.Coupling(span + 60.0)],
    )
    return shafts.Gearbox([first, second], [shafts.GearMesh("19", "48")], seats)


def study(fast=False):
    """The gearbox on rigid seats and in both housings, read back from their files."""
    del fast
    folder = Path("results")
    folder.mkdir(exist_ok=True)
    cases = {"rigid seats": gearbox()}
    for name, missing in (("good foundation", False), ("corner missing", True)):
        path = folder / f"housing_{name.replace(' ', '_')}.csv"
        shafts.write_housing(path, housing(missing))
        cases[name] = replace(cases["rigid seats"], housing=shafts.read_housing(path))
    return {name: (shafts.bearing_reactions(box), shafts.annex_e(shafts.support(box))) for name, box in cases.items()}


def numbers(found):
    """K_Hbeta and the largest displacement of a seat [um] of every case."""
    answers = {}
    for name, (bearings, load) in found.items():
        key = name.replace(" ", "_")
        answers[f"{key}_face_load_factor"] = float(load.face_load_factor)
        answers[f"{key}_seat_um"] = float(np.abs(bearings.seat).max())
    return answers


def main(fast=False):
    """Prints the tables and returns the numbers."""
    found = study(fast)
    for name, (bearings, load) in found.items():
        print(f"{name}: K_Hbeta {float(load.face_load_factor):.3f}\n{bearings}\n")
    return numbers(found)


if __name__ == "__main__":
    main(fast="--fast" in sys.argv)
