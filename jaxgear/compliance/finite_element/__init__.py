"""Teeth and gear bodies by finite elements: once per gear, then a table over the roll length.

shape -> sector (mesh) -> solve (ring of sectors) -> build (numbers) -> kept (on the disk) -> table (in JAX)
files: tables of other programs
"""

from .compliance import TabulatedCompliance as TabulatedCompliance
from .compliance import finite_element_compliance as finite_element_compliance
from .compliance_table import GearTable as GearTable
from .files import write_table as write_table
