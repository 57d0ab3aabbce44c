"""Rules of standards and papers that size a modification from the load: they evaluate formulas and search nothing."""

from ..compliance import IsoStiffness as IsoStiffness
from ..compliance import iso_stiffness as iso_stiffness
from .lead import crowning_for_misalignment as crowning_for_misalignment
from .lead import crowning_for_tolerance as crowning_for_tolerance
from .lead import end_relief_amount as end_relief_amount
from .lead import end_relief_length as end_relief_length
from .lead import equivalent_misalignment as equivalent_misalignment
from .relief import dynamic_relief as dynamic_relief
from .relief import effective_relief as effective_relief
from .relief import iso_relief as iso_relief
from .relief import long_relief_length as long_relief_length
from .relief import mesh_stiffness_relief as mesh_stiffness_relief
from .relief import relief_amount as relief_amount
from .relief import run_in_relief as run_in_relief
from .relief import short_relief_length as short_relief_length
