"""Texts of design files, and what the modifications remove that are read from them."""

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np

from jaxgear.io import load_design
from jaxgear.microgeometry import Flank
from jaxgear.studies import SweepStudy

PAIR = """
[pinion]
teeth = 19
module = 3.0
face_width = 20.0
{pinion}
[wheel]
teeth = 48
module = 3
face_width = 18.0
{wheel}
[load]
torque = 50.0
{load}
"""


def text(*, pinion="", wheel="", load="", tail=""):
    return PAIR.format(pinion=pinion, wheel=wheel, load=load) + tail


def loaded(folder, content):
    """The design file of the given content, text or bytes."""
    path = folder / "gear.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return load_design(path)


def flank():
    """Points of one flank, over the profile and across the face."""
    return Flank(
        roll_length=jnp.linspace(2.0, 18.0, 33)[None],
        tip_roll_length=jnp.asarray(18.0),
        start_roll_length=jnp.asarray(2.0),
        base_radius=jnp.asarray(26.78),
        face_coordinate=jnp.linspace(-9.0, 9.0, 7)[:, None],
        face_width=jnp.asarray(18.0),
    )


def removed(modification):
    with jax.numpy_rank_promotion("allow"):  # the points of `flank` have axes of their own
        return np.broadcast_to(modification(flank()), (7, 33))


def asked_sweep(design):
    """Arguments of the sweep that a design file asks for, by name."""
    return SimpleNamespace(**SweepStudy.of(design).settings.arguments(design))
