"""Figures of a layout: line load and face load factor under the combinations of deviations."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from ..plot.figure import GREY, captioned, legend_above, line_style, marker_style, report_axes
from .cases import CASES, ToleranceCases


def _name(case: str) -> str:
    for written, shown in (("f_Hb", "$f_{H\\beta}$"), ("f_ma", "$f_{ma}$"), ("-", "\N{MINUS SIGN}")):
        case = case.replace(written, shown)
    return case


def tolerance_line_load(cases: ToleranceCases, ax: Axes | None = None, *, title: str = "") -> Axes:
    """Line load [N/mm] over the face coordinate [mm] without deviations and in the four combinations of them.

    Cases whose largest load is at an end of the face are marked there with a cross.

    Args:
        cases: of one flank line and one torque.
        ax: Axes; None for a new figure.
        title: over the panel.
    """
    with report_axes(ax) as panel:
        edges = np.asarray(cases.edge_contact)
        for number, (name, face, load) in enumerate(
            zip(CASES, np.asarray(cases.load.face_coordinate), np.asarray(cases.load.line_load))
        ):
            factor = float(cases.face_load_factor[number])
            panel.plot(face, load, **line_style(number), label=f"{_name(name)}, {factor:.2f}")
            if edges[number]:
                end = 0 if load[0] > load[-1] else -1
                style = {"marker": "X", "color": line_style(number)["color"], "markersize": 6.5, "linestyle": ""}
                panel.plot(face[end], load[end], clip_on=False, **style)
        panel.set_xlabel("face coordinate [mm]")
        panel.set_ylabel("line load [N/mm]")
        panel.set_ylim(bottom=0.0)
        heading = f"{title}, " if title else ""
        style = {"frameon": False, "borderaxespad": 0.0, "alignment": "left", "columnspacing": 1.2, "handlelength": 2.4}
        above = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.03), "ncols": 2}
        panel.legend(title=heading + r"$K_{H\beta}$ of the cases", **style, **above)
    return panel


@captioned("Face load factor under the combinations of deviations within the tolerances.")
def face_load_factors(cases: Mapping[str, ToleranceCases], ax: Axes | None = None) -> Axes:
    """K_Hbeta of the five cases of deviations, one line of marks per flank line; hollow marks where an edge is touched.

    Args:
        cases: by the name of the flank line, "step 1" for instance.
        ax: Axes; None for a new figure.
    """
    with report_axes(ax) as panel:
        places = np.arange(len(CASES))
        for number, (name, one) in enumerate(cases.items()):
            style = {**marker_style(number), "markersize": 5.5}
            factors, edges = np.asarray(one.face_load_factor), np.asarray(one.edge_contact)
            panel.plot(places, factors, **style, label=name)
            hollow = {**style, "linestyle": "", "markerfacecolor": "white"}
            panel.plot(places[edges], factors[edges], **hollow)
        panel.axhline(1.0, color=GREY, linewidth=0.8)
        panel.set_xticks(places, [_name(name).replace(" $", "\n$", 1) for name in CASES])
        panel.set_xlabel("deviations (hollow: largest load at an edge)")
        panel.set_ylabel(r"face load factor $K_{H\beta}$ [-]")
        legend_above(panel)
    return panel
