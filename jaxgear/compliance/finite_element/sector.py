"""One sector of a gear as a mesh of biquadratic quadrilaterals, by mapping: no mesher, and the same mesh every time.

A half sector has three blocks, each a Coons patch; the other half is its mirror image:

    tooth   from the flank and the upper half of the fillet (v = 0) to the centreline (v = 1), tip to the middle
    foot    from the lower half of the fillet and the root circle (v = 0) to an arc inside the ring (v = 1)
    ring    from that arc to the bore, or outwards to the rim circle of a ring gear

Tooth and foot meet on the line from the middle of the fillet to the point P on the centreline below the root, so that
no element has an angle close to zero where the fillet meets the root circle. Layers are graded towards the surface.

The tooth points upwards. Radii and polar angles of a ring gear are negative: its axis is above the tooth.
"""

from typing import NamedTuple

import numpy as np

from .shape import Tooth

# Edges in modules. Twice as fine: centre within 0.007 %, neighbours 0.03 % (thin rim), local term 3 % of itself.
_FLANK_EDGE = 0.03
_FILLET_EDGE = 0.045
_ROOT_EDGE = 0.09
_LAYERS, _GROWTH = 11, 1.2  # from the surface to the centreline
_INSIDE = 0.6  # depth of P below the root circle
_OF_RIM = 0.45  # and at most this share of the rim
_RING_GROWTH, _RING_STEP = 1.3, 0.15  # of the ring's layers, and at most this share of the radius
_NARROWEST = 0.02  # sine of the smallest angle of an element; a square has 1


class Sector(NamedTuple):
    """The mesh of one sector, tooth upwards, lengths in modules.

    Attributes:
        points: nodes, shape (nodes, 2).
        elements: nodes of every element, shape (elements, 9), row by row in its local coordinates.
        left, right: nodes on the two cuts from the root inwards, without those on the bore, (cut,).
        held: nodes on the bore, or on the rim circle of a ring gear.
        flank: nodes along the working (right) flank's involute from the tip down, (2 edges + 1,).
        flank_arc: their length of involute from the base circle.
        centreline: nodes on the centreline from the tip down, (2 edges + 1,).
    """

    points: np.ndarray
    elements: np.ndarray
    left: np.ndarray
    right: np.ndarray
    held: np.ndarray
    flank: np.ndarray
    flank_arc: np.ndarray
    centreline: np.ndarray


def sector(tooth: Tooth, fineness: float = 1.0) -> Sector:
    """Meshes a sector.

    Args:
        tooth: its outline.
        fineness: divides the edges; the layers grow in number with it.

    Raises:
        ValueError: for a shape that cannot be meshed, naming the number to blame.
    """
    arcs, flank, fillet, root = _surface(tooth, fineness)
    inside = tooth.root - min(_INSIDE, _OF_RIM * (tooth.root - tooth.bore))
    layers = _graded(max(4, round(_LAYERS * fineness)), 1 + (_GROWTH - 1) / fineness)
    signed = tooth.shape.signed
    tip = signed(float(np.linalg.norm(flank[:, 0])))
    upper = np.concatenate([flank, fillet[:, 1:]], axis=1)
    share = _lengths(upper)
    heights = tip + share * (inside - tip)
    corner = np.arctan2(*signed(flank[:, 0])) * (1 - layers)
    across = _line(fillet[:, -1], np.array([0.0, inside]), layers)
    axis = np.stack([np.zeros_like(heights), heights])
    tooth_block = _coons(upper, axis, tip * np.stack([np.sin(corner), np.cos(corner)]), across, layers)
    half = tooth.sector_half_angle
    arc = half * np.linspace(0, 1, root.shape[1])
    below = inside * np.stack([np.sin(arc), np.cos(arc)])
    foot_block = _coons(root, below, across, _line(root[:, -1], below[:, -1], layers), layers)
    radii = _ring_radii(inside, tooth.bore, inside * half / (root.shape[1] // 2), fineness)
    ring_block = radii[None, :, None] * np.stack([np.sin(arc), np.cos(arc)])[:, None, :]
    return _joined(tooth_block, foot_block, ring_block, arcs, tooth)


def _surface(tooth: Tooth, fineness: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The right half of the surface from the tip to the cut: arcs of the involute, then points of three curves."""
    top, bottom = tooth.arc(tooth.tip_roll_length), tooth.arc(tooth.form_roll_length)
    arcs = np.linspace(top, bottom, 2 * _edges(top - bottom, _FLANK_EDGE / fineness) + 1)
    flank = tooth.involute(tooth.roll_length(arcs))
    middle = 0.5 * (tooth.junction + np.pi / 2)
    fine = tooth.trochoid(np.linspace(tooth.junction, middle, 400))
    fillet = _along(fine, _edges(_length(fine), _FILLET_EDGE / fineness))
    fillet[:, 0] = flank[:, -1]
    foot = tooth.trochoid(np.linspace(middle, np.pi / 2, 400))
    end = tooth.sector_half_angle
    land = np.linspace(tooth.root_half_angle, end, 200)[1:]
    if abs(tooth.root_half_angle) < abs(end) - 1e-6:
        foot = np.concatenate([foot, tooth.root * np.stack([np.sin(land), np.cos(land)])], axis=1)
    root = _along(foot, _edges(_length(foot), _ROOT_EDGE / fineness))
    root[:, 0] = fillet[:, -1]
    root[:, -1] = tooth.root * np.array([np.sin(end), np.cos(end)])
    return arcs, flank, fillet, root


def _edges(length: float, edge: float) -> int:
    return max(3, int(np.ceil(length / edge)))


def _length(curve: np.ndarray) -> float:
    return float(np.sum(np.hypot(*np.diff(curve))))


def _lengths(curve: np.ndarray) -> np.ndarray:
    """Length along a curve up to each point, as a share of the whole."""
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(curve)))])
    return lengths / lengths[-1]


def _along(curve: np.ndarray, edges: int) -> np.ndarray:
    """Points at equal distances along a finely drawn curve."""
    wanted, share = np.linspace(0, 1, 2 * edges + 1), _lengths(curve)
    return np.stack([np.interp(wanted, share, row) for row in curve])


def _graded(layers: int, growth: float) -> np.ndarray:
    """Nodes of layers that grow from 0 to 1, those in the middle of each included."""
    ends = np.concatenate([[0.0], np.cumsum(growth ** np.arange(layers))])
    return _with_middles(ends / ends[-1])


def _with_middles(ends: np.ndarray) -> np.ndarray:
    found = np.empty(2 * len(ends) - 1)
    found[::2], found[1::2] = ends, 0.5 * (ends[1:] + ends[:-1])
    return found


def _line(start: np.ndarray, end: np.ndarray, share: np.ndarray) -> np.ndarray:
    return start[:, None] + share * (end - start)[:, None]


def _ring_radii(outer: float, bore: float, step: float, fineness: float) -> np.ndarray:
    """Radii of the ring's nodes, in steps that grow from the root to the circle that is held."""
    ends = [outer]
    while ends[-1] - bore > step:
        ends.append(ends[-1] - step)
        step = min(step * _RING_GROWTH ** (1 / fineness), _RING_STEP / fineness * abs(ends[-1]))
    if len(ends) > 1 and ends[-1] - bore < 0.5 * step:
        ends.pop()
    return _with_middles(np.array([*ends, bore]))


def _coons(top: np.ndarray, bottom: np.ndarray, start: np.ndarray, end: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Points between four curves, shape (2, v, u): top and bottom run along u, start and end along v."""
    u, v = _lengths(top)[None, None, :], v[None, :, None]
    ruled = (1 - v) * top[:, None, :] + v * bottom[:, None, :] + (1 - u) * start[:, :, None] + u * end[:, :, None]
    first, last = ((1 - v) * top[:, None, [i]] + v * bottom[:, None, [i]] for i in (0, -1))
    return ruled - (1 - u) * first - u * last


def _joined(
    tooth_block: np.ndarray, foot_block: np.ndarray, ring_block: np.ndarray, arcs: np.ndarray, tooth: Tooth
) -> Sector:
    """The right half from its three blocks, (2, v, u) each, and its mirror image."""
    blocks = tooth_block, foot_block, ring_block
    starts = np.cumsum([0, *(block[0].size for block in blocks)])
    top, foot, ring = (
        start + np.arange(block[0].size).reshape(block.shape[1:]) for start, block in zip(starts, blocks)
    )
    foot[:, 0] = top[:, -1]
    ring[0] = foot[-1]
    half = np.concatenate([block.reshape(2, -1) for block in blocks], axis=1)
    half[0, top[-1]] = half[0, ring[:, 0]] = 0.0
    mirrored = np.arange(starts[-1]) + starts[-1]
    axis = np.union1d(top[-1], ring[:, 0])
    mirrored[axis] = axis
    points = np.concatenate([half, half * [[-1], [1]]], axis=1).T
    right = np.concatenate([_elements(block) for block in (top, foot, ring)])
    left = np.concatenate([_elements(mirrored[block].T) for block in (top, foot, ring)])
    # mirrored elements keep their sense by the order of their rows
    elements = np.concatenate([right.reshape(-1, 9), left.reshape(-1, 9)])
    cut = np.concatenate([foot[:, -1], ring[1:-1, -1]])
    held = np.union1d(ring[-1], mirrored[ring[-1]])
    used, compact = np.unique(elements, return_inverse=True)
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    found = Sector(
        points[used],
        compact.reshape(elements.shape),
        number[mirrored[cut]],
        number[cut],
        number[held],
        number[top[0, : len(arcs)]],
        arcs,
        number[np.concatenate([top[-1], ring[1:, 0]])],
    )
    _check(found, tooth)
    return found


def _elements(grid: np.ndarray) -> np.ndarray:
    """Nodes of the elements of a grid of nodes, shape (elements, 9)."""
    windows = np.lib.stride_tricks.sliding_window_view(grid, (3, 3))[::2, ::2]
    return windows.reshape(-1, 9)


def _check(found: Sector, tooth: Tooth) -> None:
    """Refuses a mesh with an element that is folded or nearly so."""
    narrowest = float(np.min(sines(found)))
    if narrowest > _NARROWEST:
        return
    rim = tooth.root - tooth.bore
    body = "rim_diameter" if tooth.shape.is_internal else "bore_diameter"
    blame = (
        f"{body} leaves a rim of {rim:.3g} x module"
        if rim < 0.5 * _INSIDE
        else f"teeth = {abs(tooth.shape.teeth):g} with profile_shift = {tooth.shape.profile_shift:g}"
    )
    raise ValueError(
        f"{blame}, which cannot be meshed: the narrowest angle of an element has the sine "
        f"{narrowest:.2g}, must be greater than {_NARROWEST:g}"
    )


def sines(found: Sector) -> np.ndarray:
    """Sine of the angle between the edges of every element at its corners, middles and centre, (elements, 9)."""
    gradients = shape_gradients(np.array([-1.0, 0.0, 1.0]), np.array([-1.0, 0.0, 1.0]))
    tangents = np.einsum("pni,enc->epic", gradients, found.points[found.elements])
    first, second = tangents[:, :, 0], tangents[:, :, 1]
    turn = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    return turn / (np.linalg.norm(first, axis=-1) * np.linalg.norm(second, axis=-1))


def quadratic(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Quadratic shape functions of the nodes -1, 0, 1 and their derivatives, shape (points, 3)."""
    values = np.stack([0.5 * x * (x - 1), 1 - x * x, 0.5 * x * (x + 1)], axis=-1)
    return values, np.stack([x - 0.5, -2 * x, x + 0.5], axis=-1)


def shape_gradients(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Local derivatives of the nine shape functions at the points of a grid, shape (points, 9, 2)."""
    (a, da), (b, db) = quadratic(first), quadratic(second)
    grids = np.einsum("pi,qj->pqij", da, b), np.einsum("pi,qj->pqij", a, db)
    return np.stack([grid.reshape(-1, 9) for grid in grids], axis=-1)
