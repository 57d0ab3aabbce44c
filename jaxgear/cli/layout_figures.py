"""The figures of `jaxgear layout`."""

from pathlib import Path
from typing import Any

import numpy as np

from . import report
from .layout_study import STEPS, Study, designs, lives

_PANEL, _HEIGHT = 92.0, 90.0  # [mm]


def write_figures(folder: Path, study: Study) -> list[Path]:
    """Writes the figures of the cases, K_Hbeta over the torque, shafts, profiles and the contact; gives the files."""
    import matplotlib

    matplotlib.use("Agg")  # the command line never shows a window
    from .. import plot

    layout = study.main
    name = list(layout.after)[-1]
    axes: dict[str, Any] = {}
    with plot.figure.report_axes(None, columns=3, width=3 * _PANEL, height=_HEIGHT) as panels:
        for panel, of, title in zip(np.ravel(panels), layout.cases, STEPS):
            plot.tolerance_line_load(of[name], panel, title=f"{title}, {name} deviations")
        for panel in panels[1:]:
            panel.set_ylabel("")
    axes["tolerance_cases"] = panels
    shown = {f"{step}, {kind}": one for step, of in zip(STEPS, layout.cases) for kind, one in of.items()}
    axes["face_load_factors"] = plot.face_load_factors(shown)
    axes["face_load_over_torque"] = plot.face_load_over_torque(
        study.request.torques, study.over_torque, design_torque=study.design.torque
    )
    axes["shaft_deflection"] = plot.shaft_deflection(next(iter(study.request.supports.values())).gearbox)
    if study.cycles:
        axes["transmission_error"] = plot.transmission_error(study.cycles)
        axes["load_sharing"] = plot.load_sharing(study.cycles)
        for step, cycle in study.cycles.items():
            axes[f"contact_pattern_{step}"] = plot.contact_pattern(cycle)
        mesh = next(iter(study.meshes.values()))
        axes["lead_chart"] = plot.lead_chart(mesh, designs(study))
    if study.profile is not None:
        rows, names = study.profile.radar_variants()
        results = ["ppte_um", "effective_contact_ratio", "mesh_loss_factor", "max_flank_pressure_MPa"]
        values = {one: study.profile.table.column(one) for one in results}
        of_gears = lives(study, study.profile)
        values |= {one: hours for one, hours in of_gears.items() if np.isfinite(hours[rows]).all()}
        axes["radar"] = plot.radar(values, list(values), rows, names, maximize=set(of_gears) & set(values))
    return report.save_figures(folder, axes)
