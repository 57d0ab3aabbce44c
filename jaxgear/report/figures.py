"""Pictures of a result folder, with what they show."""

import base64
import struct
from pathlib import Path

from .contents import Figure

# in the order of the report; k-charts and other charts by the names of their files
CAPTIONS = {
    "transmission_error": "Loaded transmission error over two base pitches at the design torque, with its peak-to-peak "
    "value (PPTE).",
    "transmission_error_orders": "Amplitudes of the transmission error at the orders of the mesh frequency.",
    "load_sharing": "Share of the load that one tooth pair carries on its way along the path of contact.",
    "pressure": "Largest pressure of one tooth pair along the path of contact, of flanks and tip corners (dots).",
    "pressure_map": "Pressure over path of contact and face width.",
    "contact_pattern": "Contact pattern: largest pressure of every place of the flank over a whole mesh.",
    "contact_pattern_unmodified": "Contact pattern without modification: largest pressure of every place of the flank.",
    "contact_pattern_layout": "Contact pattern after all three steps: largest pressure of every place of the flank.",
    "line_load": "Load per length over the face.",
    "face_gap": "Gap over the face before the load closes it.",
    "k_chart": "Profile modification of both gears over the roll angle, material removed downwards (K-chart). A shaded "
    "band is the total profile tolerance of the quality class about the design that the legend names.",
    "lead_chart": "Modification across the face, at the pitch point. A shaded band is the total helix tolerance of the "
    "quality class about the design that the legend names.",
    "ppte_over_torque": "PPTE over the torque.",
    "ppte_distribution": "Share of the manufactured pairs whose PPTE stays below a value.",
    "harris_map": "Harris map: transmission error over two base pitches at several torques.",
    "response_surface": "Transmission error over phase and torque.",
    "face_load_over_torque": "Face load factor over the torque.",
    "convergence": "Course of the search: best objective over the contact analyses spent. Dotted: as judged "
    "on the finer grid on which the search ends.",
    "front": "Pareto front: designs of which none is better in every objective.",
    "iterations_relief": "Relief after every iteration of the search.",
    "iterations_transmission_error": "Transmission error after every iteration of the search.",
    "dynamic_factor": "Dynamic factor over the mesh frequency, speed going up and down.",
    "dte_rms": "Root mean square of the dynamic transmission error about its mean over the mesh frequency.",
    "waterfall": "Campbell diagram: amplitudes of the mesh force by order over the mesh frequency.",
    "order_tracks": "Level of the orders of the mesh force over the mesh frequency, rms values re 1 µN (ISO 1683).",
    "run_up": "Largest mesh force over the static one while the speed rises at constant acceleration.",
    "bifurcation": "Dynamic transmission error once per mesh cycle over the mesh frequency (bifurcation diagram).",
    "phase_portrait": "Dynamic transmission error and its rate at the speed of the largest dynamic factor; marked once "
    "per mesh cycle. The abscissae differ from panel to panel.",
    "branches": "Stable and unstable periodic motions of the unmodified design.",
    "shaft_deflection": "Elastic lines of the shafts at the design torque, exaggerated, with bearings and gears.",
    "tolerance_cases": "Load over the face under the combinations of deviations within the tolerances.",
    "face_load_factors": "Face load factor under the combinations of deviations within the tolerances.",
    "worn_pinion": "Flank of the pinion at several lives.",
    "worn_wheel": "Flank of the wheel at several lives.",
    "ppte_over_life": "PPTE over the life.",
    "depth_over_life": "Depth of wear over the life.",
    "life_ppte_distribution": "Share of the manufactured pairs whose mean PPTE over the life stays below a value.",
    "dynamic_factor_over_life": "Largest mesh force of the steady motion over the static one, over the life.",
    "pareto": "Results of the variants against each other, with the Pareto front.",
    "parallel_coordinates": "Variables and results of the variants, one line per variant.",
    "radar": "Results of chosen variants side by side.",
}

_VARIANT = "_variant_"  # before the number in the name of a file
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_SIZE_AT = 16  # bytes before width and height (PNG specification, chunk IHDR)
_DENSITY = b"pHYs"  # pixels per unit in both directions, and the unit
_PER_METRE = 1
_MM = 1000.0  # per m


def figure(path: Path) -> Figure:
    """A PNG file with its density written in it, to be embedded.

    Raises:
        ValueError: when it is no such file.
    """
    held = path.read_bytes()
    place = held.find(_DENSITY)
    if not held.startswith(_SIGNATURE) or place < 0:
        raise ValueError(f"{path}: is not a PNG file that tells its density")
    (pixels,) = struct.unpack_from(">I", held, _SIZE_AT)
    density, _, unit = struct.unpack_from(">IIB", held, place + len(_DENSITY))
    if unit != _PER_METRE or density == 0:
        raise ValueError(f"{path}: does not tell its pixels per metre")
    data = f"data:image/png;base64,{base64.b64encode(held).decode()}"
    kind = path.stem.partition(_VARIANT)[0]  # of one variant: what is said of the picture of several
    caption = CAPTIONS.get(kind, f"{path.stem.replace('_', ' ')}.")
    return Figure(path.stem, caption, data, pixels / density * _MM)
