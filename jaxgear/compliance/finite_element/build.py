"""The compliance of one gear by finite elements, without size and modulus: numbers over the roll length."""

from typing import NamedTuple

import numpy as np
import scipy  # its packages load when they are used

from ..edge import APEX_DISTANCE, WEDGE_REACH
from .sector import Sector, sector
from .sectors import Places, along_edge, responses
from .shape import Shape, Tooth

# of everything here that the numbers depend on: files of another version are made anew
VERSION = 2
POINTS = 25  # of every table: twice as many change nothing above 1e-5
NEIGHBOURS = 7  # teeth whose coupling is kept; further ones feel the common wind-up alone
# Half width of the elliptic pressure under which the local term is read, in modules: two edges of the mesh, and as the
# contacts of heavily loaded gears are.
_PATCH = 0.06
_PATCH_POINTS = 64  # of its quadrature
# Distance of its middle from the tip corner, over its half width: closer the corner bends the patch.
_CLEAR = 2.0


class GearNumbers(NamedTuple):
    """Displacements of one gear along the load line under unit line load, for unit module and unit plane modulus.

    Attributes:
        roll_length: from the form circle to the tip, negative for a ring gear, (points,).
        center: of the crossing of load line and centreline, bore or rim circle held, (points,).
        local: deflection of the flank against that point, beyond the depth-referenced law, (points,).
        neighbours: of the flank of the teeth counter-clockwise of the loaded one, where the load pushes
            counter-clockwise; shape (teeth, loaded point, point of the neighbour).
    """

    roll_length: np.ndarray
    center: np.ndarray
    local: np.ndarray
    neighbours: np.ndarray


def build(shape: Shape, fineness: float = 1.0) -> GearNumbers:
    """Meshes a gear and solves it.

    Args:
        shape: the gear's numbers.
        fineness: of the mesh, for studies of convergence.

    Raises:
        ValueError: for a shape that cannot be meshed, naming the number to blame.
    """
    tooth = Tooth(shape)
    mesh = sector(tooth, fineness)
    rho = np.linspace(tooth.form_roll_length, tooth.tip_roll_length, POINTS)
    patched = tooth.roll_length(_readable_arcs(tooth))
    flank, patches = _on_flank(tooth, mesh, rho), _patches(tooth, mesh, patched)
    seen = [flank, _on_centreline(tooth, mesh, rho), _on_flank(tooth, mesh, patched)]
    seen += [_on_centreline(tooth, mesh, patched)]
    loads, teeth = _together([flank, patches]), int(shape.signed(shape.teeth))
    found = responses(mesh, shape.poisson, teeth, loads, _together(seen), NEIGHBOURS)
    own = found[0]
    center = np.diagonal(own[POINTS : 2 * POINTS, :POINTS])
    surface, below = (np.diagonal(rows[:, POINTS:]) for rows in np.split(own[2 * POINTS :], 2))
    local = surface - below - _law(tooth, patched) - _wedge(tooth, patched)
    # displacements of the neighbour are rows, loads are columns
    neighbours = found[1:, :POINTS, :POINTS].transpose(0, 2, 1)
    return GearNumbers(rho, center.copy(), _extended(tooth.arc(patched), local, tooth.arc(rho)), neighbours.copy())


def hub(shape: Shape) -> float:
    """Torsion of the ring between root circle and bore, or rim circle, on the line of action, for unit plane modulus.

    (1 + nu) / E is (1 + nu') / E' of the plane problem: see `ElasticRing.hub`.
    """
    tooth = Tooth(shape)
    return shape.signed(float((1 + shape.poisson) / (2 * np.pi) * tooth.base**2 * (tooth.bore**-2 - tooth.root**-2)))


def _readable_arcs(tooth: Tooth) -> np.ndarray:
    """Places along the involute at which a patch lies clear of both ends of it."""
    low, high = tooth.arc(tooth.form_roll_length) + _PATCH, tooth.arc(tooth.tip_roll_length) - _CLEAR * _PATCH
    if not high - low > _PATCH:
        raise ValueError(
            f"tip_diameter leaves {high - low + (1 + _CLEAR) * _PATCH:.3g} x module of "
            f"involute, must be more than {(2 + _CLEAR) * _PATCH:.3g}"
        )
    return np.linspace(low, high, POINTS)


def _inwards(tooth: Tooth, rho: np.ndarray) -> np.ndarray:
    """Direction of the load, shape (points, 2)."""
    angle = tooth.load_angle(rho)
    return np.stack([-np.cos(angle), -np.sin(angle)], axis=1)


def _on_flank(tooth: Tooth, mesh: Sector, rho: np.ndarray) -> Places:
    nodes, shapes = along_edge(mesh.flank, mesh.flank_arc, tooth.arc(rho))
    return Places.of_points(nodes, shapes, _inwards(tooth, rho), len(mesh.points))


def _on_centreline(tooth: Tooth, mesh: Sector, rho: np.ndarray) -> Places:
    nodes, shapes = along_edge(mesh.centreline, mesh.points[mesh.centreline, 1], tooth.crossing(rho))
    return Places.of_points(nodes, shapes, _inwards(tooth, rho), len(mesh.points))


def _patches(tooth: Tooth, mesh: Sector, rho: np.ndarray) -> Places:
    """Elliptic pressures normal to the flank around each point, of unit resultant."""
    angle = np.pi * np.arange(1, _PATCH_POINTS + 1) / (_PATCH_POINTS + 1)
    weights = np.sin(angle) ** 2 / np.sum(np.sin(angle) ** 2)
    columns = []
    for arc in tooth.arc(rho):
        points = _on_flank(tooth, mesh, tooth.roll_length(arc + _PATCH * np.cos(angle)))
        columns.append(points.weights @ weights)
    return Places(np.stack(columns, axis=1))


def _together(places: list[Places]) -> Places:
    return Places(np.concatenate([each.weights for each in places], axis=1))


def _law(tooth: Tooth, rho: np.ndarray) -> np.ndarray:
    """The depth-referenced law of one body under the patch."""
    h = tooth.depth(rho)
    reach = np.hypot(h, _PATCH)
    return 2 / np.pi * (np.arcsinh(h / _PATCH) - tooth.shape.poisson * h / (reach + h))


def _wedge(tooth: Tooth, rho: np.ndarray) -> np.ndarray:
    """Compliance that `EdgeLaw` adds for the wedge of the tip, to be left out of the table."""
    b = 0.5 * (np.pi / 2 + np.arctan(tooth.tip_roll_length / tooth.base))
    twin = 0.5 * np.sin(2 * b)
    excess = np.sin(b) ** 2 / (b + twin) + np.cos(b) ** 2 / (b - twin) - 2 / np.pi
    distance = tooth.arc(tooth.tip_roll_length) - tooth.arc(rho)
    inner = distance + np.sqrt(distance**2 - _PATCH**2)
    mean = 0.5 * inner * np.exp(0.5 * (_PATCH / inner) ** 2)
    span = WEDGE_REACH * tooth.depth(rho) / (APEX_DISTANCE * mean)
    return excess * 0.25 * np.log1p(span**4)


def _extended(arcs: np.ndarray, values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """A curve over the involute: along its tangent towards the fillet, constant towards the tip, where it is level."""
    curve = scipy.interpolate.CubicSpline(arcs, values)
    inside = np.clip(wanted, arcs[0], arcs[-1])
    return curve(inside) + curve(arcs[0], 1) * np.minimum(wanted - arcs[0], 0.0)
