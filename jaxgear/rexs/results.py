"""Results of a loaded tooth contact as `meshing_contact_stage_data_set` of REXS."""

import numpy as np

from ..contact import MeshCycle
from ..geometry import tooth_thickness
from ..metrics import flash_temperature
from ..numerics import over_slices
from .model import Component, Model


def write_results(
    model: Model, stage_data: Component, cycle: MeshCycle, *, case: int, speed: float | None, friction: float | None
) -> None:
    """Writes line load and Hertzian stress, with a speed sliding velocity and flash temperature too.

    They belong to points of the pinion flank: radius, angle from the centreline of the tooth in its transverse section
    and face coordinate from the middle of the face, profile after profile across the face. Points are where contact is
    on the path of contact; what tip corners carry beyond it has no place of its own on this flank and is left out.

    Args:
        model: where they go.
        stage_data: component that holds the pinion's data of the stage.
        cycle: solved mesh cycle.
        case: load case under which they stand.
        speed: of the pinion [rpm].
        friction: mean coefficient of friction, None for the library's default.
    """
    kinematics, (side, _) = cycle.kinematics, cycle.sides
    shape = cycle.line_load.shape

    def everywhere(field) -> np.ndarray:
        """Values of every contact; the slices of spur gears share them."""
        return np.broadcast_to(np.asarray(over_slices(field)), shape)

    places = np.nonzero(everywhere(kinematics.contact_outside) == 0)
    order = np.lexsort((everywhere(side.contact_roll_length)[places], places[1]))
    places = tuple(axis[order] for axis in places)
    roll = everywhere(side.contact_roll_length)[places]
    face = np.asarray(kinematics.face_coordinate + side.face_middle)[places[1]]
    identifiers = np.arange(1, len(roll) + 1)
    radius = np.hypot(float(side.base_radius), roll)
    angle = np.rad2deg(np.asarray(tooth_thickness(side.gear, 2 * radius)) / (2 * radius))
    points = model.add(
        "point_list",
        "contact on the pinion flank",
        kind_of_point_list=("meshing_contact_points", "none"),
        point_ids=(identifiers, "none"),
        point_coordinates_radius=(radius, "mm"),
        point_coordinates_angle_about_u_axis=(angle, "deg"),
        point_coordinates_u_coord=(face, "mm"),
    )
    data = model.add("meshing_contact_stage_data_set", set_ids=(identifiers, "none"))
    model.relate("assembly", assembly=stage_data, part=points)
    model.relate("reference", origin=points, referenced=data)
    found = {
        "local_normal_line_load": (np.asarray(cycle.line_load)[places], "N / mm"),
        "local_hertzian_contact_stress": (np.asarray(cycle.contact_pressure)[places], "MPa"),
    }
    if speed is not None:
        path = everywhere(kinematics.contact_path)[places]
        known = {} if friction is None else {"friction": friction}
        flash = flash_temperature(cycle, speed, **known)
        found["local_sliding_velocity"] = (np.asarray(kinematics.path_of_contact.sliding_speed(path, speed)), "m / s")
        found["local_flash_temperature_blok_1937"] = (np.asarray(flash)[places], "K")
    model.under_load(case, data, **found)
