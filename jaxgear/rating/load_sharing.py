"""Share of the load that a pair of teeth takes along the path of contact, after the standards of scuffing.

References:
    ISO/TS 6336-20 (ISO/TR 13989-1), load sharing factor X_Gamma and buttressing factor X_but; ISO/TS 6336-22 has them
    as X_Y.
"""

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..metrics.lubricant import FrictionLaw, Lubricant
from ..metrics.lubrication import mean_friction
from ..numerics import Checked, Given, result, safe_divide
from .mesh_geometry import MeshGeometry, OfGears, Real, Scalar

POINTS = "A", "AB", "B", "C", "D", "DE", "E"  # of the path of contact, at which temperatures and films are worked out
_COARSEST = 7.0  # accuracy grade that the sharing of unrelieved spur gears counts at least
_BUTTRESS, _BUTTRESS_LENGTH = 0.3, 0.2  # of X_but: by how much, and over which Gamma per sin(beta_b)
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)  # of the mean between two points of the path


class MeshLoad(Checked):
    """Load and speed of a mesh, with what makes it heat.

    Attributes:
        torque: T_1 of the pinion; no load factor is in it.
        speed: n_1 of the pinion.
        outer_factors: K_A K_gamma.
        load_factors: K_A K_gamma K_v K_Hbeta K_Halpha.
        single_stiffness: c'.
        mesh_stiffness: c_gamma_alpha.
        tip_relief: C_a of pinion and wheel as designed.
        running_in_relief: C_ay, that running in makes.
        accuracy_grade: Q, the coarser of both gears.
        meshes: n_p, contacts of the gear that has most of them in a revolution.
    """

    torque: Scalar = result("N m")
    speed: Scalar = result("rpm")
    outer_factors: Scalar = result()
    load_factors: Scalar = result()
    single_stiffness: Scalar = result("N/(mm um)")
    mesh_stiffness: Scalar = result("N/(mm um)")
    tip_relief: OfGears = result("um")
    running_in_relief: Scalar = result("um")
    accuracy_grade: Scalar = result()
    meshes: Scalar = result()

    def line_load(self, geometry: MeshGeometry) -> Scalar:
        """w_Bt = F_t / b times the load factors [N/mm]."""
        return geometry.tangential_force(self.torque) / geometry.face_width * self.load_factors

    def effective_relief(self, geometry: MeshGeometry) -> Scalar:
        """C_eff = K_A K_gamma F_bt / (b c_gamma_alpha) [um], relief that takes up the deflection (ISO/TS 6336-20)."""
        line_load = geometry.base_force(self.torque) / geometry.face_width
        return self.outer_factors * line_load / self.mesh_stiffness


def points_of(geometry: MeshGeometry) -> Float[Array, " points"]:
    """`POINTS` of the path of contact, distances from the pitch point [mm]; AB and DE are halfway."""
    a, b, c, d, e = geometry.path
    return jnp.stack([a, 0.5 * (a + b), b, c, d, 0.5 * (d + e), e])


def load_sharing(geometry: MeshGeometry, load: MeshLoad, path: Given) -> Real:
    """X_Gamma at distances from the pitch point [mm].

    Of spur gears (Q - 2) / 15, Q at least 7, at A and E, growing by 1/3 up to B and D, and 1 between them; of gears
    with a tip relief of C_eff growing from 0 to 1, and between the two linearly with the relief of that tip. Of helical
    gears with an overlap ratio of 1 and more X_but / eps_alpha, where X_but rises to 1.3 towards A and E; below 1
    linear in the overlap ratio.
    """
    start, inner, _, outer, end = geometry.path
    relieved = jnp.minimum(load.tip_relief / load.effective_relief(geometry), 1.0)
    low = (jnp.maximum(load.accuracy_grade, _COARSEST) - 2) / 15

    def at_ends(far: Real, length: Real, relief: Real) -> Real:
        way = safe_divide(far, length, default=1.0)
        return (1 - relief) * (low + way / 3) + relief * way

    entering = at_ends(path - start, inner - start, relieved[1])
    leaving = at_ends(end - path, end - outer, relieved[0])
    spur = jnp.where(path < inner, entering, jnp.where(path > outer, leaving, 1.0))
    overlap = jnp.minimum(geometry.overlap_ratio, 1.0)
    near = jnp.minimum(path - start, end - path)
    inside = jnp.clip(safe_divide(near, _buttressed(geometry), default=1.0), 0.0, 1.0)
    buttress = 1 + _BUTTRESS * overlap * (1 - inside)
    return buttress * ((1 - overlap) * spur + overlap / geometry.contact_ratio)


def mean_over_path(geometry: MeshGeometry, of: Callable[[Real], Real]) -> Scalar:
    """Mean from A to E of a function of the distance from the pitch point [mm], smooth between the points."""
    start, inner, pitch, outer, end = geometry.path
    reach = _buttressed(geometry)
    corners = jnp.sort(jnp.clip(jnp.stack([start, start + reach, inner, pitch, outer, end - reach, end]), start, end))
    half = 0.5 * jnp.diff(corners)
    nodes, weights = jnp.asarray(_NODES, half.dtype), jnp.asarray(_WEIGHTS, half.dtype)
    values = of((corners[:-1] + half)[:, None] + half[:, None] * nodes[None, :])
    return jnp.sum(half * (values @ weights)) / (end - start)


def pitch_point_friction(
    geometry: MeshGeometry, load: MeshLoad, lubricant: Lubricant, law: FrictionLaw, line_load: Scalar
) -> tuple[Scalar, Scalar]:
    """Mean coefficient of friction by a law of `metrics.friction_coefficient`, and rho_nC [mm].

    Args:
        geometry: of the mesh.
        load: of the mesh.
        lubricant: oil.
        law: of friction.
        line_load: w that it counts [N/mm].
    """
    radius = geometry.reduced_radius(0.0) / jnp.cos(geometry.base_helix_angle)
    rolling = sum(geometry.surface_speeds(0.0, load.speed))
    return mean_friction(lubricant, law, line_load, rolling, radius), radius


def _buttressed(geometry: MeshGeometry) -> Scalar:
    """Length of the path over which X_but falls to 1 [mm]."""
    return _BUTTRESS_LENGTH * jnp.sin(geometry.base_helix_angle) * geometry.tangent_lengths[0]
