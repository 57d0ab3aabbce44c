"""Dimensionless oscillators whose orbits are known exactly: mass, natural frequency and static load of one."""

import jax.numpy as jnp

from jaxgear.dynamics import DeadZone, Excitation, Oscillator, RectangularStiffness

SHARE = 0.37  # of the cycle with two pairs in contact


def frequency(omega):
    """Mesh frequency of an angular one."""
    return omega / (2 * jnp.pi)


def rectangular(zeta=0.05, ratio=1.75):
    """Rectangular stiffness of mean one, zero out of contact."""
    single = 1 / (SHARE * ratio + 1 - SHARE)
    force = RectangularStiffness(ratio * single, single, SHARE)
    return Oscillator(force, mass=[1.0], direction=[1.0], load=[1.0], mesh_damping=2 * zeta, newton=1.0)


def dead_zone(mesh_frequency):
    """Constant stiffness about a clearance, with a load of 0.1 (1 + Omega^2 / 2 cos(Omega t)), and its frequency."""
    amplitude = 0.5 * (2 * jnp.pi * mesh_frequency) ** 2
    drive = Excitation(
        load=jnp.reshape(amplitude, (1,)), load_angle=[0.0], displacement=[0.0], displacement_angle=[0.0], orders=[1.0]
    )
    moving = Oscillator(
        DeadZone(), mass=[1.0], direction=[1.0], load=[0.1], mesh_damping=0.1, excitation=drive, newton=1.0
    )
    return moving, mesh_frequency
