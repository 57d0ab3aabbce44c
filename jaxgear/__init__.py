"""jaxgear: what a flank modification of a gear pair does under load, and which one is best.

The pipeline in reading order, every step differentiable and vmappable:

    Gear, RingGear, GearPair    geometry of an involute pair, external (spur or helical) or internal
    TipRelief + LeadCrowning    microgeometry, composed with `+`
    default_compliance          teeth, gear bodies with coupled neighbours, Hertzian contact
    finite_element_compliance   teeth and bodies by finite elements, for gears that stay as they are
    prepare, solve              loaded tooth contact over one base pitch -> MeshCycle
    peak_to_peak, ...           metrics on the MeshCycle
    monte_carlo                 what manufacturing tolerances make of it
    solve_revolution            teeth that differ, over whole revolutions (jaxgear.revolution)
    sweep                       any number of modifications -> SweepTable
    Problem, minimize           the best modification, by gradient and by other methods
    dynamics                    mesh force, oscillators, steady states over the speed, orbits and their bifurcations
    wear                        the flanks over their life, worn by their own contact
    shafts                      shafts, bearings, housing: the load over the face

The rest lives in the namespaces `jaxgear.geometry`, `compliance`, `contact`, `tolerance`, `conditions`, `metrics`,
`revolution`, `sizing`, `sweeps`, `optimize`, `dynamics`, `wear`, `shafts`, `studies`, `plot` and `io`,
with their `Abstract...` classes as extension points. Applications that none of these knows, such as `jaxgear.layout`,
`jaxgear.manufacture`, `jaxgear.planetary` and `jaxgear.rexs`, are imported by name; see `jaxgear.provided`.

Units: mm for geometry, um for modifications and transmission error, N, N m (on the pinion), MPa, degrees in
constructors.
Importing jaxgear changes no JAX setting; switch on `jax_enable_x64` for double precision. It imports nothing else: the
public names are listed in `__init__.pyi`, and what one needs is imported when it is asked for.
"""

import lazy_loader

from . import provided as _provided

_named, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str):
    if name == "STEEL":  # made whenever it is asked for, see `jaxgear.geometry.material`
        return _named("geometry").STEEL
    if name == "__version__":
        from importlib import metadata

        return metadata.version(__name__)
    if name not in __all__:
        if name in (given := _provided.provided("functions")):
            return given[name].load()
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return _named(name)
