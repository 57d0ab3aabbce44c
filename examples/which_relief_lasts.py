"""The relief with the least transmission error when new: is it the best one over the life?

Two published pairs, 30/30 of module 2 and 20/30 of module 4, with a tip relief of one curve on both gears, designed
twice within one box: for the least PPTE of the new flanks, and by the gradient through 20 blocks of contact and wear
for the least mean PPTE over a life of a few micrometres of wear. Both are judged on more positions and blocks than the
search has seen.

Wear takes most where the flanks slide most, at root and tip: it deepens a tip relief. A relief that is right when new
is soon too much, and its error grows from the first revolution on. The relief with the lowest mean PPTE over the wear
history begins with less, wears into the right one and out of it again. On the 20/30 pair the best relief when new is
over the life worse than none.

Run it: `python examples/which_relief_lasts.py`. Most of the time it compiles.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402

import numpy as np  # noqa: E402

import jaxgear as jg  # noqa: E402
from jaxgear import wear  # noqa: E402

TORQUES = {"30/30": 150.0, "20/30": 98.0}  # N m on the pinion
# revolutions of the pinion at 1e-18 m2/N; the teeth of the second pair carry a fifth of the load per face width
REVOLUTIONS = {"30/30": 2e7, "20/30": 8e7}
COEFFICIENT = 1e-18  # m2/N
BOUNDS = {
    "30/30": {"amount": (0.0, 25.0), "length": (1.0, 3.8)},  # um, mm
    "20/30": {"amount": (0.0, 12.0), "length": (2.0, 7.0)},
}
DESIGNS = "when new", "over life"


def prepare(name, positions, fast=False) -> jg.Mesh:
    """The pair of a name."""
    if name == "30/30":
        gears = [jg.Gear(teeth=30, module=2.0, face_width=20.0, bore_diameter=12.6)] * 2
    else:
        bores = {20: 23.4, 30: 76.6}
        gears = [jg.Gear(teeth=z, module=4.0, face_width=40.0, bore_diameter=bore) for z, bore in bores.items()]
    # two pairs reach as far as these loads do, and one program of so many serves both names
    quick = {"pairs": 2, "slide_steps": 0} if fast else {}
    sizes = jg.Resolution(positions=positions, **quick)
    return jg.prepare(jg.GearPair(*gears), compliance=jg.default_compliance("stress"), resolution=sizes)


def design(parameters):
    """One parabolic tip relief on both gears."""
    relief = jg.TipRelief(parameters["amount"], parameters["length"], jg.Parabolic())
    return relief, relief


def settings(name, *, blocks, points=None) -> wear.Wear:
    return wear.Wear(REVOLUTIONS[name], COEFFICIENT, blocks=blocks, points=points, depth_limit=5.0)


def designs(name, mesh, fast=False, callback=None) -> dict:
    """Both optima."""
    search = settings(name, blocks=8 if fast else 20, points=17)
    asked = mesh, TORQUES[name], design, BOUNDS[name]
    options = {"positions": None, "callback": callback}  # the grid of the wear goes with the positions
    lasting = jg.Problem(*asked, objective=search.quantity("mean_ppte_over_life"))
    return {
        DESIGNS[0]: jg.minimize(jg.Problem(*asked), **options),
        DESIGNS[1]: jg.minimize(lasting, jg.optimize.SLP(starts=1, steps=6 if fast else 15), **options),
    }


def lives(name, mesh, optima, fast=False) -> dict:
    """The lives of the unmodified pair and of both optima."""
    judge = settings(name, blocks=16 if fast else 40)
    flanks = {"unmodified": design({"amount": 0.0, "length": BOUNDS[name]["length"][0]})}
    flanks |= {key: design(optimum.parameters) for key, optimum in optima.items()}
    return {
        key: judge.history(mesh, TORQUES[name], pinion=pinion, wheel=wheel) for key, (pinion, wheel) in flanks.items()
    }


def study(fast=False, callback=None) -> dict:
    """By name of the pair: both optima, and the lives of the designs."""
    searched, judged = (32, 48) if fast else (64, 96)
    results = {}
    for name in TORQUES:
        optima = designs(name, prepare(name, searched, fast), fast, callback)
        results[name] = optima, lives(name, prepare(name, judged, fast), optima, fast)
    return results


def numbers(results) -> dict:
    found = {}
    for name, (optima, of_designs) in results.items():
        pair = name.replace("/", "_")
        for key, optimum in optima.items():
            found |= {f"{pair} {key}: {variable}": float(value) for variable, value in optimum.parameters.items()}
        for key, life in of_designs.items():
            ppte = wear.over_life(life, "ppte")
            found |= {
                f"{pair} {key}: new PPTE [um]": float(ppte[0]),
                f"{pair} {key}: worn PPTE [um]": float(ppte[-1]),
                f"{pair} {key}: mean PPTE [um]": float(wear.mean_over_life(life, "ppte")),
                f"{pair} {key}: wear depth [um]": float(wear.wear_depth(life)[-1]),
                f"{pair} {key}: uncertainty of the depth [um]": float(life.error[-1]),
                f"{pair} {key}: million revolutions to 5 um": float(wear.life_to_depth(life, 5.0)) / 1e6,
            }
        new, lasting = (found[f"{pair} {key}: mean PPTE [um]"] for key in DESIGNS)
        found[f"{pair} mean PPTE lower by [%]"] = 100 * (1 - lasting / new)
    return found


def main(fast=False) -> dict:
    return numbers(study(fast))


def draw(results):
    from jaxgear import plot

    width = 92.0 * len(results)
    with plot.figure.report_axes(None, columns=len(results), width=width, height=84.0) as panels:
        for number, (panel, (name, (_, of_designs))) in enumerate(zip(np.ravel(panels), results.items())):
            plot.wear_history(of_designs, "ppte", panel)
            panel.set_title(name, pad=28)
            panel.set_ylabel(panel.get_ylabel() if number == 0 else "")
    plot.save(np.ravel(panels)[0].figure, "results/which_relief_lasts.png")


if __name__ == "__main__":
    results = study(fast="--fast" in sys.argv)
    for key, value in numbers(results).items():
        print(f"{key:52} {value:9.3f}")
    draw(results)
