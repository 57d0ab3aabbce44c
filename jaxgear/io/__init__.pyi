"""The public names, for type checkers and for `__init__.py`, which imports each when it is asked for."""

from .design_file import DesignFile as DesignFile
from .design_file import load_design as load_design
from .errors import DesignFileError as DesignFileError
from .flanks import read_flank as read_flank
from .flanks import read_worn as read_worn
from .flanks import write_worn as write_worn
from .folder import result_folder as result_folder
from .folder import writing as writing
from .named_quantities import quantities_of_tables as quantities_of_tables
from .optimize_table import OptimizeSection as OptimizeSection
from .optimize_table import Search as Search
from .reference import reference as reference
from .results import describe as describe
from .results import flank_rows as flank_rows
from .results import write_flanks as write_flanks
from .results import write_front as write_front
from .results import write_summary as write_summary
from .results import write_traces as write_traces
from .rows import read_variants as read_variants
from .settings_tables import DynamicsSection as DynamicsSection
from .settings_tables import LubricantSection as LubricantSection
from .settings_tables import WearSection as WearSection
from .sweep_table import SweepSection as SweepSection
from .teeth_table import teeth_of as teeth_of
from .write_design import write_design as write_design
from .write_design import write_stage_design as write_stage_design
