"""Compliance of the teeth, the gear bodies and the contact, in um/N per unit face width (um mm/N).

    tooth (beam) + body (elastic ring with neighbouring teeth, or Sainsot's polynomial) + contact law (Hertz)
    tooth and body by finite elements, as a table per gear + contact law

`Compliance` composes the parts; `default_compliance` is the recommended set, `legacy_compliance` the one that most
published spur-gear studies use, `finite_element_compliance` the most accurate one for gears that stay as they are.
Anything else that knows the elasticity of both gears is an `AbstractCompliance`.
"""

from .assembly import AbstractCompliance as AbstractCompliance
from .assembly import Compliance as Compliance
from .assembly import default_compliance as default_compliance
from .body import AbstractBody as AbstractBody
from .body import ElasticRing as ElasticRing
from .face import face_ends as face_ends
from .face import face_kernel as face_kernel
from .face import few_modes as few_modes
from .face import slice_basis as slice_basis
from .finite_element import GearTable as GearTable
from .finite_element import TabulatedCompliance as TabulatedCompliance
from .finite_element import finite_element_compliance as finite_element_compliance
from .finite_element import write_table as write_table
from .hertz import AbstractContact as AbstractContact
from .hertz import ContactGeometry as ContactGeometry
from .hertz import DepthReferenced as DepthReferenced
from .iso_6336 import IsoStiffness as IsoStiffness
from .iso_6336 import iso_stiffness as iso_stiffness
from .laws import AbstractLaw as AbstractLaw
from .plane import Plane as Plane
from .plane import PlaneState as PlaneState
from .plane import plane_stress_share as plane_stress_share
from .published import CenterDistance as CenterDistance
from .published import ConstantHertz as ConstantHertz
from .published import HalfPlane as HalfPlane
from .published import Kovalskii as Kovalskii
from .published import NonlinearPower as NonlinearPower
from .published import Palmgren as Palmgren
from .published import Sainsot as Sainsot
from .published import Weber as Weber
from .published import legacy_compliance as legacy_compliance
from .tooth import AbstractTooth as AbstractTooth
from .tooth import Beam as Beam
from .tooth import ToothLoad as ToothLoad
