"""What of a published study of relief and wear on a 30/30 and a 20/30 pair can be reproduced?

The study couples neighbouring teeth through the gear body and reports stiffness and quasi-static transmission error of
the 30/30 pair at the boundary of single and double contact, over amount and length of a tip relief. Its amounts are
relative to a largest amount that it does not give: the trends are compared, and the values where the pair that enters
contact no longer carries load.

It wears the flanks by Archard's law, without a coefficient of wear, and prints stiffness and error at the same boundary
over "wear steps". Its sum of both gears' depths takes pinion and wheel through as many cycles, and its sliding
velocities are rolling ones; here each gear wears by its own revolutions. Its tables do not agree with themselves (see
`INCONSISTENT`). Those over its wear steps stand beside ours over the deepest wear; those after wear beside ours after
as much wear as changes the error behind a relief of 0.6 as there, for two largest amounts.

Run it: `python examples/reproduce_30_30_20_30_study.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402
import textwrap  # noqa: E402

import equinox as eqx  # noqa: E402
import jax.numpy as jnp  # noqa: E402

import jaxgear as jg  # noqa: E402
from jaxgear import wear  # noqa: E402
from jaxgear.wear.case import points_for  # noqa: E402
from jaxgear.wear.worn_volume import grid  # noqa: E402

TORQUES = {"30/30": 150.0, "20/30": 98.0}  # N m
# The study's largest amount is not known: with 0.4 of it the pair that enters contact carries little at the boundary,
# with 0.6 nothing. Here it carries nothing from 16.5 um on.
LARGEST, OTHER = 33.0, 25.0  # um
AMOUNTS = (0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 20.0, 30.0)  # um
LENGTHS = (0.5, 1.0, 2.0, 3.0)  # mm
COEFFICIENT = 1e-18  # m2/N; any other one is another number of revolutions
REVOLUTIONS = 1.3e8  # of the pinion; farther on nothing is left of the load at A, nor of what the study shows
RELATIVE = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)  # amounts of relief, to the largest one; lengths from 0.2 on
MIDDLE = RELATIVE.index(0.6)  # the relief behind which the study varies wear steps and lengths

# wear steps of the study, with its stiffness [N/um] and QSTE [um] at the boundary, "unworn" and "worn"
STEPS = (10_000, 20_000, 40_000, 60_000, 100_000)
STIFFNESS = ((231.0, 225.0, 220.0, 218.0, 218.0), (185.0, 186.0, 199.0, 208.0, 213.0))
ERROR = ((24.1, 26.0, 29.2, 32.3, 38.3), (31.5, 34.2, 37.2, 39.9, 46.0))
# relative amounts 0.2 to 1.0, new and after wear
STIFFNESS_OVER_AMOUNT = ((213.0, 190.0, 185.0, 185.0, 185.0), (216.0, 210.0, 199.0, 185.0, 185.0))
ERROR_OVER_AMOUNT = ((25.0, 28.0, 28.7, 28.7, 28.7), (30.9, 33.6, 37.1, 39.9, 39.9))
# relative lengths 0.2 to 1.0 of the relief of 0.6: stiffness new and after wear, change of the error [%]
STIFFNESS_OVER_LENGTH, ERROR_CHANGE_OVER_LENGTH = (185.0, 199.0), 29.4
INCONSISTENT = """
- 199 and 185 N/um stand for the same relief of 0.6 twice: once as the study's model beside its finite elements (error
  7.57 %), once as worn beside new flanks (change 7.59 %).
- The "unworn" numbers change with the number of wear steps, the error by 59 %, though nothing has worn there. At 40,000
  steps the worn numbers are those of the relief of 0.6 in another table: "unworn" seems to mean worn without relief.
- That "unworn" stiffness begins with 231 N/um, above the 216 N/um of new flanks without relief.
- The change of stiffness is printed as -19.63 % at the first step and as +17.18 % at the second, for differences of the
  same sign; as the study defines its rate, none has a sign.
- The coupled fillet compliance is printed with E B in the numerator; E B divides it. The error in meshing-in has the
  product of the coupling compliances in a sum of compliances, where their sum belongs.
- The modification is multiplied by the cosine of tan(alpha_c) - alpha_2, though amounts are taken normal to the flank.
- C_n is called normalized by the module: 0.6 of a module of 2 mm would be 1.2 mm.
- 100,000 wear steps are called 100 million cycles, without a coefficient of wear or a depth.
"""

# key of the result, text, published value, unit, where the difference comes from
LINES = [
    (
        "single_stiffness_30_30",
        "30/30, largest single-pair stiffness",
        185.0,
        "N/um",
        "Finite elements give 180 N/um in plane stress and 189 N/um in plane strain.",
    ),
    (
        "boundary_stiffness_30_30",
        "30/30, double-pair stiffness at the boundary (A)",
        216.0,
        "N/um",
        "The study's finite elements give 213, those of this project's benchmark 223 N/um. The study's logarithmic "
        "Hertz term is twice that of the literature.",
    ),
    (
        "relieved_te_30_30",
        "30/30, QSTE at A with a relief that keeps the pair apart",
        28.7,
        "um",
        "The force over the single-pair stiffness, so the same difference.",
    ),
    ("relieved_stiffness_30_30", "30/30, stiffness there", 185.0, "N/um", ""),
    (
        "length_effect_30_30",
        "30/30, change of QSTE at A over the relief length",
        0.0,
        "um",
        "At A the wheel's tip meets the pinion: the amount at the tip counts, not the length, unless the relief is so "
        "short that the contact slides off it.",
    ),
]


def gear_pair(name):
    if name == "30/30":
        gears = [jg.Gear(teeth=30, module=2.0, face_width=20.0, bore_diameter=12.6)] * 2
    else:
        bores = {20: 23.4, 30: 76.6}
        gears = [jg.Gear(teeth=z, module=4.0, face_width=40.0, bore_diameter=bore) for z, bore in bores.items()]
    return jg.GearPair(*gears)


@eqx.filter_jit
def prepare(pair, resolution):
    # two-dimensional, as the study and the finite elements named above
    return jg.prepare(pair, compliance=jg.default_compliance("stress"), resolution=resolution)


def without_coupling(mesh):
    """The mesh with the compliance between different pairs taken out."""
    own = jnp.eye(mesh.structure.shape[0])[:, :, None, None] * mesh.structure
    return eqx.tree_at(lambda m: m.structure, mesh, own)


@eqx.filter_jit
def over_reliefs(mesh, torque, amounts, lengths):
    """Curves over `mesh.phase` with a linear tip relief of every amount [um] and length [mm] on both gears.

    Returns:
        transmission error [um], secant stiffness [N/um] and number of loaded pairs, each of shape (designs, positions).
    """

    def curves(amount, length):
        relief = jg.TipRelief(amount, length, jg.Linear())
        cycle = jg.solve(mesh, torque, pinion=relief, wheel=relief)
        return cycle.transmission_error, jg.secant_stiffness(cycle), jnp.sum(cycle.pair_force > 0, axis=0)

    return jax.vmap(curves)(amounts, lengths)


def at_entry(mesh, curves):
    """Values of curves (designs, positions) where the following pair reaches point A."""
    contact = mesh.path_of_contact
    phase = jnp.mod(contact.start / contact.base_pitch, 1.0)
    return jax.vmap(lambda curve: jnp.interp(phase, mesh.phase, curve, period=1.0))(curves)


def after_entry(mesh, curves):
    """Values at the first position after that, from which on contact is on the path alone."""
    contact, count = mesh.path_of_contact, len(mesh.phase)
    place = jnp.ceil(jnp.mod(contact.start / contact.base_pitch - mesh.phase[0], 1.0) * count)
    return jnp.take(curves, place.astype(int), axis=1, mode="wrap")


def largest(stiffness, pairs, count) -> float:
    """Largest stiffness [N/um] with that many pairs in contact."""
    return float(jnp.max(jnp.where(pairs == count, stiffness, 0.0)))


@eqx.filter_jit
def live(mesh, torque, amount, length, worn_before, revolutions, blocks):
    """The life of both gears with a linear tip relief [um, mm] and material worn off before [um], (gears, points)."""
    lengths = grid(mesh, points_for(mesh.resolution.positions))
    before = [jg.TabulatedProfile(*of) for of in zip(lengths, worn_before)]
    pinion, wheel = (jg.TipRelief(amount, length, jg.Linear()) + of for of in before)
    life = wear.wear(mesh, torque, revolutions, coefficient=COEFFICIENT, pinion=pinion, wheel=wheel, blocks=blocks)
    te, stiffness = life.cycles.transmission_error, jg.secant_stiffness(life.cycles)
    return {
        "te": at_entry(mesh, te),
        "stiffness": at_entry(mesh, stiffness),
        "stiffness_after": after_entry(mesh, stiffness),
        "ppte": wear.over_life(life, "ppte"),
        "depth": wear.wear_depth(life),
        "error": life.error,
        "root": life.pinion_depth[:, 0, 0],
        "cycles": jnp.stack([te[jnp.array([0, -1])], stiffness[jnp.array([0, -1])]]),
        "worn": jnp.stack([life.pinion_depth[-1, 0], life.wheel_depth[-1, 0]]),
    }


def over_life(fast=False) -> dict:
    """Lives of the 30/30 pair; lists are over designs and, last, over the life.

    "worn" and "worn_other" run over the relative amounts of `LARGEST` and `OTHER`, "worn_length" over the relative
    lengths; "recovery" is by how much wear raises the stiffness at A behind a relief of 0.6 [%], by what is changed.
    Contacts in points have neither a width nor a slope to slide down, as those of the study.
    """
    pair = gear_pair("30/30")

    def prepared(**sizes):
        """With contact beyond the path and without, of one structure: one program serves both."""
        on, off = (
            prepare(pair, jg.Resolution(32 if fast else 64, extended_contact=extended, **sizes))
            for extended in (True, False)
        )
        return on, eqx.tree_at(lambda mesh: mesh.kinematics, off, on.kinematics)

    (on, off), points = prepared(), prepared(contact_nodes=1)
    long = jg.long_relief_length(pair)
    nothing = jnp.zeros((2, points_for(on.resolution.positions)))

    def one(amount, length=1.0, mesh=on, torque=TORQUES["30/30"], before=nothing, revolutions=REVOLUTIONS):
        numbers = [jnp.asarray(number, float) for number in (torque, amount, length * long)]
        return live(mesh, *numbers, before, jnp.asarray(revolutions), 24 if fast else 30)

    kept = one(RELATIVE[MIDDLE] * LARGEST, revolutions=1.0)
    frozen = one(RELATIVE[MIDDLE] * LARGEST, before=REVOLUTIONS * kept["worn"], revolutions=1.0)
    worn = [one(share * LARGEST) for share in RELATIVE]
    lives = {
        "worn": worn,
        "worn_other": worn[:1] + [one(share * OTHER) for share in RELATIVE[1:]],
        "worn_length": [one(RELATIVE[MIDDLE] * LARGEST, length) for length in RELATIVE[1:-1]] + [worn[MIDDLE]],
        "path_alone": [one(share * LARGEST, mesh=off) for share in (0.0, RELATIVE[MIDDLE])],
        "points": [one(RELATIVE[MIDDLE] * LARGEST, mesh=mesh) for mesh in points],
        "torques": [one(RELATIVE[MIDDLE] * LARGEST, torque=torque) for torque in (100.0, 200.0)],
    }
    found = {
        f"{name}_{key}": [life[key].tolist() for life in of]
        for name, of in lives.items()
        for key in of[0]
        if key != "worn"
    }

    def risen(stiffness) -> float:
        return 100 * (max(stiffness) / stiffness[0] - 1)

    recovery = {
        f"{LARGEST:g} um as the largest amount": found["worn_stiffness"][MIDDLE],
        f"{OTHER:g} um": found["worn_other_stiffness"][MIDDLE],
        "contact on the path alone": found["path_alone_stiffness_after"][1],
        "contact in points": found["points_stiffness"][0],
        "contact in points on the path alone": found["points_stiffness_after"][1],
        "100 N m": found["torques_stiffness"][0],
        "200 N m": found["torques_stiffness"][1],
        "worn on under the loads of new flanks": [float(kept["stiffness"][0]), float(frozen["stiffness"][0])],
    }
    path = on.path_of_contact
    faster = [sum(wear.specific_sliding(path, at)) for at in (path.start, path.outer_single)]
    return found | {
        "phase": on.phase.tolist(),
        "recovery": {name: risen(stiffness) for name, stiffness in recovery.items()},
        "faster_at_A": float(faster[0] / faster[1]),
    }


def main(fast=False) -> dict:
    """Numbers of the study as jaxgear sees them; lists run over `AMOUNTS` and `LENGTHS`."""
    resolution = jg.Resolution(positions=64 if fast else 256)
    found = {}
    for name, torque in TORQUES.items():
        key = name.replace("/", "_")
        pair = gear_pair(name)
        long = float(jg.long_relief_length(pair))
        amounts = jnp.asarray(AMOUNTS + (AMOUNTS[-1],) * len(LENGTHS))
        lengths = jnp.asarray((long,) * len(AMOUNTS) + LENGTHS)
        mesh = prepare(pair, resolution)
        curves = jnp.asarray(torque), amounts, lengths
        te, stiffness, pairs = over_reliefs(mesh, *curves)
        _, apart, apart_pairs = over_reliefs(without_coupling(mesh), *curves)
        te_at_entry, stiffness_at_entry = at_entry(mesh, te), at_entry(mesh, stiffness)
        count = len(AMOUNTS)
        found |= {
            f"single_stiffness_{key}": largest(stiffness[0], pairs[0], 1),
            f"double_stiffness_{key}": largest(stiffness[0], pairs[0], 2),
            f"uncoupled_double_stiffness_{key}": largest(apart[0], apart_pairs[0], 2),
            f"boundary_stiffness_{key}": float(stiffness_at_entry[0]),
            f"relieved_te_{key}": float(te_at_entry[-1]),
            f"relieved_stiffness_{key}": float(stiffness_at_entry[-1]),
            f"length_effect_{key}": float(jnp.ptp(te_at_entry[count:])),
            f"te_over_amount_{key}": te_at_entry[:count].tolist(),
            f"stiffness_over_amount_{key}": stiffness_at_entry[:count].tolist(),
            f"te_over_length_{key}": te_at_entry[count:].tolist(),
        }
    return found | over_life(fast)


def show(found):
    """Prints every published number, jaxgear's and the difference, and where the difference comes from."""
    print(f"{'':60}{'published':>10}{'jaxgear':>10}")
    for key, text, published, unit, why in LINES:
        difference = f"{100 * (found[key] / published - 1):+8.1f} %" if published else ""
        print(f"{text} [{unit}]".ljust(60) + f"{published:10.4g}{found[key]:10.4g}{difference}")
        if why:
            print(textwrap.fill(why, 100, initial_indent="    ", subsequent_indent="    "))


def wear_trends(found) -> dict[str, bool]:
    """Trends of the study over the wear, and whether the numbers have them."""
    te, stiffness = ([list(zip(of, of[1:])) for of in found[f"worn_{key}"]] for key in ("te", "stiffness"))
    relieved = found["worn_stiffness"][MIDDLE]
    return {
        "the error at A grows with the wear, whatever the relief": all(new < old for of in te for new, old in of),
        "the stiffness of unmodified flanks falls": all(new > old for new, old in stiffness[0]),
        "a relief of 0.6 that has kept the second pair apart does so no longer": max(relieved) > 1.01 * relieved[0],
    }


def after_wear(found, name):
    """Stiffness [N/um] and error [um] of designs, new and once the error behind a relief of 0.6 has changed as in the
    study: two pairs of lists."""
    middle = found["worn_other_te" if name == "worn_other" else "worn_te"][MIDDLE]
    new, worn = (of[MIDDLE - 1] for of in ERROR_OVER_AMOUNT)
    life = jnp.interp(worn / new * middle[0], jnp.asarray(middle), jnp.arange(float(len(middle))))
    return [
        ([of[0] for of in rows], [float(jnp.interp(life, jnp.arange(float(len(of))), jnp.asarray(of))) for of in rows])
        for rows in (found[f"{name}_stiffness"], found[f"{name}_te"])
    ]


def deviation(found, name) -> float:
    """Root mean square of what both tables over the amount differ by from the study's [%]."""
    published = STIFFNESS_OVER_AMOUNT, ERROR_OVER_AMOUNT
    ratios = [
        ours / theirs - 1
        for table, of_study in zip(after_wear(found, name), published)
        for row, study in zip(table, of_study)
        for ours, theirs in zip(row[1:], study)
    ]
    return 100 * (sum(ratio**2 for ratio in ratios) / len(ratios)) ** 0.5


def show_after_wear(found):
    """Prints the study's tables after wear, over amount and length of the relief, beside ours."""

    def line(text, values, of="{:8.1f}"):
        print(f"  {text:38}" + "".join(of.format(value) for value in values))

    def table(text, ours, study):
        for state, *both in zip(("new", "after wear"), ours, study):
            line(f"{text}, {state}", both[0])
            line("  study", both[1])
        line("  change [%]", [100 * (worn / new - 1) for new, worn in zip(*ours)])
        line("    study", [100 * (worn / new - 1) for new, worn in zip(*study)])

    names = {"worn": LARGEST, "worn_other": OTHER}
    for name, largest in names.items():
        print(f"Relief, relative to {largest:g} um, new and after as much wear as changes QSTE at 0.6 as in the study:")
        line("amount", RELATIVE[1:])
        published = STIFFNESS_OVER_AMOUNT, ERROR_OVER_AMOUNT
        for text, ours, study in zip(("stiffness at A [N/um]", "QSTE at A [um]"), after_wear(found, name), published):
            table(text, [row[1:] for row in ours], study)
    off = {largest: deviation(found, name) for name, largest in names.items()}
    print("  root mean square of the differences: " + ", ".join(f"{of:.1f} % with {um:g} um" for um, of in off.items()))
    print(f"  {min(off, key=off.get):g} um as the largest amount reproduces the tables better")
    print(f"Length of a relief of 0.6 of {LARGEST:g} um, relative to the double-contact zone, likewise:")
    line("length", RELATIVE[1:])
    stiffness, te = after_wear(found, "worn_length")
    table("stiffness at A [N/um]", stiffness, [[value] * len(te[0]) for value in STIFFNESS_OVER_LENGTH])
    line("QSTE at A [um], new", te[0])
    line("after wear", te[1])
    line("  change [%]", [100 * (worn / new - 1) for new, worn in zip(*te)])
    line("    study", [ERROR_CHANGE_OVER_LENGTH] * len(te[0]))


def show_recovery(found):
    """Prints by how much wear raises the stiffness at A behind a relief of 0.6, and what that depends on."""
    study = 100 * (STIFFNESS[1][-1] / STIFFNESS[1][0] - 1)
    ours = ", ".join(f"{value:.1f} % ({name})" for name, value in found["recovery"].items())
    share = 1 / (1 + found["faster_at_A"])
    told = (
        f"The stiffness at A behind a relief of 0.6 rises by {study:.1f} % over the wear steps of the study, here by at"
        f" most {ours}. A load wears {found['faster_at_A']:.1f} times as fast at A as at D, where the other pair is:"
        f" both wear alike once the pair at A carries {100 * share:.0f} % of the load. Pairs that share no compliance"
        f" are {100 * share / (1 - share):.0f} % stiffer then, which is the study's rise. Here the bodies wind up with"
        " the whole load, and neighbouring teeth bend each other: half of it is left, which contacts in points on the"
        " path alone approach. Contacts with a width wear the flank around them and slide down its slopes, at A to the"
        " root and at D to the ridge at the pitch point, and tip corners wear the flank before A: all of this takes"
        " load off the pair at A. Without relief and after every"
        f" amount and length of it wear leads to that balance, from above to {found['worn_stiffness'][0][-1]:.0f} N/um."
        " Gears of equal numbers of teeth go through as many cycles."
    )
    print(textwrap.fill(told, 118, subsequent_indent="  "))


def draw(found):
    """Stiffness and QSTE over the mesh cycle: new and worn, without and with relief; with and without corners."""
    import matplotlib.pyplot as plt

    from jaxgear import plot
    from jaxgear.plot.figure import line_style, report_axes
    from jaxgear.plot.mesh_cycle import PHASE_LABEL, two_pitches

    relief = f"relief {RELATIVE[MIDDLE] * LARGEST:.0f} µm"
    worn, alone = found["worn_cycles"], found["path_alone_cycles"]  # of each design: QSTE and stiffness, new and worn
    figures = {
        "worn": [
            (f"{name}, {state}", [worn[index][quantity][life] for quantity in (1, 0)])
            for index, name in ((0, "unmodified"), (MIDDLE, relief))
            for life, state in enumerate(("new", "worn"))
        ],
        "extended_contact": [
            (f"{name}, {contact}", [of[quantity][0] for quantity in (1, 0)])
            for name, both in (("unmodified", (worn[0], alone[0])), (relief, (worn[MIDDLE], alone[1])))
            for of, contact in zip(both, ("extended", "path alone"))
        ],
    }
    for name, curves in figures.items():
        figure, axes = plt.subplots(2, figsize=(4.7, 5.2), sharex=True, layout="constrained")
        for axis, label, quantity in zip(axes, ("mesh stiffness [N/µm]", "QSTE [µm]"), (0, 1)):
            with report_axes(axis):
                for number, (text, values) in enumerate(curves):
                    axis.plot(*two_pitches(found["phase"], values[quantity]), label=text, **line_style(number))
                axis.set(xlim=(0, 2), ylabel=label)
        axes[1].set_xlabel(PHASE_LABEL)
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=2, frameon=False)
        plot.save(figure, f"results/reproduce_30_30_{name}.png")


def relief_trends(found) -> dict[str, bool]:
    """Trends of the study over amount and length of the relief, and whether the numbers of both pairs have them."""

    def both(has) -> bool:
        return all(has(key) for key in ("30_30", "20_30"))

    def grows(key) -> bool:
        te = found[f"te_over_amount_{key}"]
        return all(low < high for low, high in zip(te, te[1:]))

    return {
        "QSTE grows with the amount": both(grows),
        "up to where the stiffness is that of a single pair, within 4 %": both(
            lambda key: abs(found[f"relieved_stiffness_{key}"] / found[f"single_stiffness_{key}"] - 1) < 0.04
        ),
        "the length changes QSTE by less than 2 %": both(
            lambda key: found[f"length_effect_{key}"] < 0.02 * found[f"relieved_te_{key}"]
        ),
        "models without coupling overstate the stiffness of double contact": both(
            lambda key: found[f"uncoupled_double_stiffness_{key}"] > found[f"double_stiffness_{key}"]
        ),
    }


def say(trends):
    """Prints which trends of the study the numbers have."""
    for trend, holds in trends.items():
        print(f"  {'as in the study' if holds else 'NOT as in the study'}: {trend}")


def show_wear(found):
    """Prints the study's tables over wear beside those of unmodified and of relieved flanks."""
    print("\nWear, 30/30. The study over its wear steps, without and with relief:")
    print("  wear steps                " + "".join(f"{step:>9,}" for step in STEPS))
    for text, (without, relieved) in (("stiffness at A [N/um]", STIFFNESS), ("QSTE at A [um]", ERROR)):
        print(f"  {text:26}" + "".join(f"{value:9.1f}" for value in without))
        print(f"  {'  with relief':26}" + "".join(f"{value:9.1f}" for value in relieved))
    lives = len(found["worn_depth"][0])
    shown = [round(share * (lives - 1)) for share in (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)]
    for index in (0, MIDDLE):
        print(f"jaxgear, {RELATIVE[index]:g} of the largest relief:")
        lines = {"deepest wear [um]": "depth", "stiffness at A [N/um]": "stiffness", "QSTE at A [um]": "te"}
        for text, key in (lines | {"PPTE [um]": "ppte"}).items():
            print(f"  {text:26}" + "".join(f"{found[f'worn_{key}'][index][life]:9.2f}" for life in shown))
    show_after_wear(found)
    show_recovery(found)
    say(wear_trends(found))
    print("What does not agree within the study:" + INCONSISTENT)


if __name__ == "__main__":
    found = main(fast="--fast" in sys.argv)
    show(found)
    show_wear(found)
    for key in ("30_30", "20_30"):
        print(f"{key.replace('_', '/')} at point A, linear relief over the whole double-contact zone")
        print("  amount [um]     " + "".join(f"{amount:8g}" for amount in AMOUNTS))
        print("  QSTE [um]       " + "".join(f"{value:8.2f}" for value in found[f"te_over_amount_{key}"]))
        print("  stiffness [N/um]" + "".join(f"{value:8.1f}" for value in found[f"stiffness_over_amount_{key}"]))
        coupled, uncoupled = found[f"double_stiffness_{key}"], found[f"uncoupled_double_stiffness_{key}"]
        print(f"  double-pair stiffness {coupled:.0f} N/um, without coupling {uncoupled:.0f} N/um")
    say(relief_trends(found))
    draw(found)
