"""Two dimensionless oscillators with orbits known to many digits: mass, natural frequency and static load of one.

Their forces are linear in pieces: the motion within a piece is known in closed form, and the orbit follows from where
the pieces meet. The numbers are such orbits, printed to the digits that a comparison is made to.
"""

from typing import NamedTuple

import jax.numpy as jnp

from jaxgear.dynamics import DeadZone, Excitation, Oscillator, RectangularStiffness

SHARE = 0.37  # of the cycle with two pairs in contact
RATIO = 1.75  # of the stiffness with two pairs to that with one
ZETA = 0.05
MORE_ZETA = 0.08


class Known(NamedTuple):
    """An orbit and its printed numbers, None where none is printed.

    Attributes:
        omega: angular mesh frequency.
        periods: mesh cycles after which it repeats.
        x0, v0: dte and its rate at mesh position 0, of the sharper table to eight digits.
        mean, rms, most, least: of the DTE.
        factor: largest force over the static one (K_v).
        moduli: of the Floquet multipliers, to four digits.
        harmonic: amplitude of the DTE at the mesh frequency.
        zeta: damping ratio.
        near: state from which shooting finds it, where no state is printed.
        stable: whether a motion settles on it.
    """

    omega: float
    periods: int
    x0: float | None = None
    v0: float | None = None
    mean: float | None = None
    rms: float | None = None
    most: float | None = None
    least: float | None = None
    factor: float | None = None
    moduli: tuple[float, ...] = ()
    harmonic: float | None = None
    zeta: float = ZETA
    near: tuple[float, float] | None = None
    stable: bool = True

    @property
    def name(self) -> str:
        kind = "" if self.stable else ", unstable"
        return f"{self.omega:.2f}, {self.periods} cycle{'s' * (self.periods > 1)}{kind}"


# stiffness in turn of one and two pairs, no force out of contact
RECTANGULAR = (
    Known(0.35, 1, 1.648687, 0.276777, 1.038569, 0.543260, 1.962546, -0.105576, 2.298924, (0.4075, 0.4075)),
    Known(0.45, 1, 1.397338, 0.036080, 1.079562, 0.387123, 1.457924, 0.145926, 1.915133, (0.4975, 0.4975)),
    Known(0.50, 1, 1.390083, 0.574387, 1.080967, 0.622171, 2.157169, 0.015619, 2.119300, (0.6147, 0.4630)),
    Known(0.70, 1, 0.936449, -0.274675, 1.108917, 0.471900, 1.821345, 0.452400, 1.425710, (0.6384, 0.6384)),
    Known(0.70, 1, 3.332644, 1.645712, -0.731543, 2.588885, 3.678720, -3.835178, 5.039343, (0.6384, 0.6384)),
    Known(0.80, 1, 1.028996, -0.572884, 1.150150, 0.644710, 2.068119, 0.215482, 1.618880, (0.6752, 0.6752)),
    Known(0.80, 1, 2.590742, 1.722510, -0.069470, 1.907104, 3.084581, -2.392970, 4.225453, (0.6752, 0.6752)),
    Known(0.90, 1, 2.031854, 1.638302, 0.332164, 1.427648, 2.616350, -1.444173, 3.584040, (0.7053, 0.7053)),
    Known(1.00, 1, 1.664274, 1.458325, 0.585805, 1.080237, 2.258973, -0.791533, 3.094483, (0.7304, 0.7304)),
    Known(1.20, 1, 1.311115, 0.922941, 0.866159, 0.553646, 1.691276, 0.128918, 2.316816, (0.7697, 0.7697)),
    Known(1.70, 1, 1.045985, 0.352461, 0.967610, 0.129608, 1.161816, 0.799680, 1.591529, (0.8313, 0.8313)),
    Known(1.70, 2, -1.636469, -0.189108, 0.363866, 1.636903, 3.042975, -1.654128, 4.168459, (0.6910, 0.6910)),
    Known(
        1.90, 1, 1.031065, 0.290763, 0.976502, 0.093761, 1.117137, 0.855626, 1.530325, (1.0797, 0.6654), stable=False
    ),
    Known(1.90, 2, -0.778739, -0.198446, 0.736544, 1.212573, 2.670787, -0.798173, 3.658612, (0.7184, 0.7184)),
    Known(
        2.00, 1, 1.026317, 0.268197, 0.979545, 0.081540, 1.101895, 0.874627, 1.509445, (1.1230, 0.6504), stable=False
    ),
)
MORE_DAMPED = (
    Known(0.80, 1, rms=1.793530, factor=4.267209, zeta=MORE_ZETA, near=(2.5, 1.7)),
    Known(0.90, 1, rms=1.373012, factor=3.656888, zeta=MORE_ZETA, near=(2.0, 1.6)),
    Known(1.00, 1, rms=1.044662, factor=3.125866, zeta=MORE_ZETA, near=(1.65, 1.45)),
    Known(1.70, 2, rms=1.528408, factor=4.017806, zeta=MORE_ZETA, near=(-1.45, -0.19)),
    Known(1.90, 1, moduli=(0.9823, 0.5997), zeta=MORE_ZETA, near=(1.03, 0.29)),
    Known(1.90, 2, rms=1.131640, factor=3.521593, zeta=MORE_ZETA, near=(-0.7, -0.2)),
    Known(2.00, 1, moduli=(1.0223,), zeta=MORE_ZETA, near=(1.03, 0.27), stable=False),
)
# constant stiffness beyond a clearance of half width 1, load 0.1 + 0.05 Omega^2 cos(Omega t)
DEAD_ZONE = (
    Known(0.70, 1, 1.14715094, 0.00453019, 1.1, 0.033653, 1.147593, 1.052407, harmonic=0.047593),
    Known(0.75, 1, 0.83384301, 0.16407875, 0.998125, 0.224724, 1.353042, 0.716349, harmonic=0.315526),
    Known(0.80, 1, 1.18470588, 0.01505882, 1.1, 0.061357, 1.186772, 1.013228, harmonic=0.086772),
    Known(0.80, 1, 0.82523679, 0.12460593, 1.019012, 0.202258, 1.333009, 0.761570, harmonic=0.284516),
    Known(0.85, 1, 0.84127443, 0.09870540, 1.037179, 0.181301, 1.314362, 0.803296, harmonic=0.255404),
    Known(0.90, 1, 0.86319781, 0.08016883, 1.051981, 0.162860, 1.297581, 0.839249, harmonic=0.229684),
    Known(1.00, 1, 0.90596537, 0.05577444, 1.073115, 0.133083, 1.269255, 0.895288, harmonic=0.187972),
    Known(1.20, 1, 0.96623122, 0.03143497, 1.093828, 0.094212, 1.228617, 0.963318, harmonic=0.133219),
    Known(1.50, 1, 1.01127760, 0.01597003, 1.1, 0.063186, 1.189359, 1.010641, harmonic=0.089359),
)
LOAD, EXCITED = 0.1, 0.05  # of the dead zone: mean load, amplitude of the base


def frequency(omega):
    """Mesh frequency of an angular one."""
    return omega / (2 * jnp.pi)


def stiffness(ratio=RATIO):
    """With two pairs and with one: mean one over a cycle."""
    single = 1 / (SHARE * ratio + 1 - SHARE)
    return ratio * single, single


def rectangular(zeta=ZETA, ratio=RATIO, force=None):
    """Rectangular stiffness of mean one, zero out of contact; or another force of the same load and damping."""
    made = RectangularStiffness(*stiffness(ratio), SHARE) if force is None else force
    return Oscillator(made, mass=[1.0], direction=[1.0], load=[1.0], mesh_damping=2 * zeta, newton=1.0)


def dead_zone(mesh_frequency, zeta=ZETA):
    """Constant stiffness about a clearance, with a load of 0.1 (1 + Omega^2 / 2 cos(Omega t)), and its frequency."""
    amplitude = EXCITED / LOAD * (2 * jnp.pi * mesh_frequency) ** 2
    return _driven(zeta, load=jnp.reshape(amplitude, (1,)), displacement=[0.0]), mesh_frequency


def dead_zone_on_a_moving_base(zeta=ZETA):
    """The same DTE at every mesh frequency: the base of the mass moves by -0.05 cos(Omega t)."""
    return _driven(zeta, load=[0.0], displacement=[EXCITED])


def _driven(zeta, *, load, displacement):
    drive = Excitation(load=load, load_angle=[0.0], displacement=displacement, displacement_angle=[0.0], orders=[1.0])
    return Oscillator(
        DeadZone(), mass=[1.0], direction=[1.0], load=[LOAD], mesh_damping=2 * zeta, excitation=drive, newton=1.0
    )
