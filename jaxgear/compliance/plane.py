"""Plane stress and plane strain: the two-dimensional elastic constants."""

from typing import Literal

from ..geometry import Material

Plane = Literal["stress", "strain"]


def plane_modulus(material: Material, plane: Plane):
    """Young's modulus of the two-dimensional problem [MPa]: E, or E / (1 - nu^2) in plane strain."""
    if plane == "stress":
        return material.elastic_modulus
    return material.elastic_modulus / (1 - material.poisson_ratio**2)


def combined_modulus(first: Material, second: Material, plane: Plane):
    """E* of two bodies in contact [MPa]: 1 / E* = 1 / E'_1 + 1 / E'_2."""
    return 1 / (1 / plane_modulus(first, plane) + 1 / plane_modulus(second, plane))


def plane_poisson(material: Material, plane: Plane):
    """Poisson's ratio of the two-dimensional problem: nu, or nu / (1 - nu) in plane strain."""
    if plane == "stress":
        return material.poisson_ratio
    return material.poisson_ratio / (1 - material.poisson_ratio)


def shear_modulus(material: Material):
    """[MPa]"""
    return material.elastic_modulus / (2 * (1 + material.poisson_ratio))


def check_plane(plane: str) -> None:
    if plane not in ("stress", "strain"):
        raise ValueError(f'plane = {plane!r} must be "stress" or "strain"')
