"""Figure of the accuracy benchmark: curves over the finite elements, and what each ingredient of the model buys."""

from pathlib import Path

import matplotlib
import numpy as np

from .cases import Case, inputs, reference
from .models import DEFAULT, LEGACY, run
from .report import Errors

PANELS = (
    Case("A", "stress", 50.0, "none"),
    Case("A", "stress", 50.0, "par7.81x5.05"),
    Case("B", "stress", 150.0, "lin10long"),
    Case("C", "stress", 300.0, "lin10long"),
    Case("D", "stress", 200.0, "none"),
    Case("D", "stress", 200.0, "par6pitch"),
    Case("E", "stress", 80.0, "lin8x1.5"),
    Case("I", "stress", 1500.0, "lin"),
    Case("L", "stress", 100.0, "linshort"),
)
_MODIFICATION_NAMES = {
    "none": "no relief",
    "par7.81x5.05": "parabolic relief 7.8 um x 5.05 mm",
    "lin10long": "long linear relief 10 um",
    "par6pitch": "parabolic relief 6 um from C",
    "lin8x1.5": "linear relief 8 um x 1.5 mm",
    "lin": "linear relief 18 um x 6 mm",
    "linshort": "linear relief 15 um x 1.2 mm",
}
_FINITE_ELEMENTS, _DEFAULT, _LEGACY = "#B0B0B0", "#0072B2", "#D55E00"  # the last two of Okabe and Ito
_STYLE = {"font.size": 8, "axes.titlesize": 8, "axes.spines.top": False, "axes.spines.right": False}


def write_figures(folder: Path, results: Errors) -> list[Path]:
    """Writes `accuracy.png` into the folder and returns the files written."""
    import matplotlib.pyplot as plt

    with matplotlib.rc_context(_STYLE):
        figure = plt.figure(figsize=(8.4, 9.8), layout="constrained")
        top, bottom = figure.subfigures(2, 1, height_ratios=(2.6, 1.0))
        _draw_curves(top)
        _draw_models(bottom.subplots(), results)
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / "accuracy.png"
        figure.savefig(path, dpi=150)
        plt.close(figure)
    return [path]


def _draw_curves(figure) -> None:
    panels = figure.subplots(3, len(PANELS) // 3)
    curves = {model.name: run(model, PANELS) for model in (DEFAULT, LEGACY)}

    def draw(ax, curve, **style):
        # one position more closes the period
        ax.plot(np.linspace(0.0, 1.0, curve.size + 1), np.append(curve, curve[0]), **style)

    for ax, case in zip(panels.flat, PANELS):
        draw(ax, reference(case).transmission_error, color=_FINITE_ELEMENTS, lw=4, label="finite elements")
        draw(ax, curves["default"][case].transmission_error, color=_DEFAULT, lw=1.3, label="jaxgear, default model")
        draw(
            ax,
            curves["legacy"][case].transmission_error,
            color=_LEGACY,
            lw=1.3,
            ls=(0, (5, 2)),
            label="usual published model (uncoupled, constant Hertz)",
        )
        title = f"{inputs()[case.pair]['description']}, {case.torque:g} N m\n{_MODIFICATION_NAMES[case.modification]}"
        ax.set_title(title.replace("um", "µm"), loc="left")
        ax.set(xlim=(0, 1), xticks=(0, 0.5, 1))
        ax.grid(color="#E6E6E6", lw=0.5)
    for ax in panels[:, 0]:
        ax.set_ylabel("transmission error [µm]")
    for ax in panels[-1]:
        ax.set_xlabel("mesh position [base pitches]")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False)


def _draw_models(ax, results: Errors) -> None:
    goal = next(goal for goal in DEFAULT.goals if goal.key == "ppte")
    generator = np.random.default_rng(0)
    for row, (name, cases) in enumerate(results.items()):
        values = np.array([abs(error[goal.key]) for error in cases.values()])
        height = row + generator.uniform(-0.22, 0.22, values.size)
        colour = _DEFAULT if name == DEFAULT.name else _LEGACY if name == LEGACY.name else "#595959"
        # errors below the axis are as good as zero
        ax.scatter(np.maximum(values, 0.1), height, s=9, color=colour, alpha=0.55, lw=0)
        ax.plot([values.mean()] * 2, [row - 0.33, row + 0.33], color="black", lw=2)
    ax.axvline(goal.limit, color="#009E73", lw=1.2, ls=(0, (4, 2)))
    ax.annotate(
        f"goal {goal.limit:g} %",
        (goal.limit, -0.62),
        xytext=(-3, 0),
        textcoords="offset points",
        ha="right",
        color="#007A59",
    )
    ax.set_xscale("log")
    ax.set(xlim=(0.09, 400), ylim=(len(results) - 0.4, -0.85), yticks=range(len(results)))
    ax.set_yticklabels(results)
    ax.set_xticks([0.1, 1, 10, 100], ["0.1", "1", "10", "100"])
    ax.set_xlabel("error of the peak-to-peak transmission error [%], relative to at least 2 µm")
    count = len(next(iter(results.values())))
    ax.set_title(f"what each ingredient buys: {count} mesh cycles against finite elements, bar: mean", loc="left")
    ax.grid(axis="x", color="#E6E6E6", lw=0.5)
    ax.set_axisbelow(True)
