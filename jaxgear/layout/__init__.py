"""Flank design across the face in three steps, for a mesh on its shafts.

level_load, longest_life     1: helix slope and crowning, at a torque or for a duty cycle
tolerance_cases              2: five cases of deviations, and the crowning that keeps the load off the edges
layout_flank_lines           both together
vary_profiles                3: profile modifications in all combinations
flank_line_contact           the loaded tooth contact of the flank lines alone
damage                       pitting and bending under a duty cycle, as a differentiable number
layout_findings              values of a layout out of the usual range
gear_lives                   life of either gear by the face load factors of a contact
lives_in_cases               what is left of the life in the five cases
face_load_over_torques       K_Hbeta over the torque

Steps 1 and 2 run on the one-dimensional analysis `shafts.annex_e`, step 3 on the loaded tooth contact.

References:
    U. Kissling's three-step layout of modifications.
"""

from .findings import layout_findings as layout_findings
from .flank_line import FlankLine as FlankLine
from .flank_line import Stations as Stations
from .flank_line import at_stations as at_stations
from .flank_line import at_torque as at_torque
from .flank_line import level_load as level_load
from .life import Damage as Damage
from .life import damage as damage
from .life import face_load_over_torques as face_load_over_torques
from .life import gear_lives as gear_lives
from .life import longest_life as longest_life
from .profiles import ProfileLayout as ProfileLayout
from .profiles import flank_line_contact as flank_line_contact
from .profiles import vary_profiles as vary_profiles
from .steps import FlankLineLayout as FlankLineLayout
from .steps import layout_flank_lines as layout_flank_lines
from .steps import without_housing as without_housing
from .tolerance_cases import CASES as CASES
from .tolerance_cases import FlankLineTolerance as FlankLineTolerance
from .tolerance_cases import ToleranceCases as ToleranceCases
from .tolerance_cases import crowning_off_the_edges as crowning_off_the_edges
from .tolerance_cases import flank_line_tolerance as flank_line_tolerance
from .tolerance_cases import helix_slope_limits as helix_slope_limits
from .tolerance_cases import lives_in_cases as lives_in_cases
from .tolerance_cases import tolerance_cases as tolerance_cases
