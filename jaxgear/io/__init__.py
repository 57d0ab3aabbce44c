"""Files: design files (TOML) in, results (JSON, CSV) out."""

from .design_file import DesignFile as DesignFile
from .design_file import load_design as load_design
from .dynamics_request import DynamicsRequest as DynamicsRequest
from .dynamics_request import dynamics_request as dynamics_request
from .errors import DesignFileError as DesignFileError
from .folder import result_folder as result_folder
from .folder import writing as writing
from .optimize_request import OptimizeRequest as OptimizeRequest
from .optimize_request import optimize_request as optimize_request
from .reference import reference as reference
from .results import describe as describe
from .results import flank_rows as flank_rows
from .results import write_flanks as write_flanks
from .results import write_front as write_front
from .results import write_summary as write_summary
from .sweep_request import SweepRequest as SweepRequest
from .sweep_request import sweep_request as sweep_request
from .variants import read_variants as read_variants
from .wear_request import WearRequest as WearRequest
from .wear_request import wear_request as wear_request
from .worn import read_worn as read_worn
from .worn import write_worn as write_worn
