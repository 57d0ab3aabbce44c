"""Flank design across the face in three steps, for a mesh on its shafts.

level_load, longest_life     1: helix slope and crowning, at a torque or for a duty cycle
tolerance_cases              2: five cases of deviations; crowning or end reliefs that keep the load off the edges
layout_flank_lines           both together
vary_profiles                3: profile modifications in all combinations
flank_line_contact           the loaded tooth contact of the flank lines alone
damage                       pitting and bending under a duty cycle, as a differentiable number
layout_findings              values of a layout out of the usual range
gear_lives                   life of either gear by the face load factors of a contact
lives_in_cases               what is left of the life in the five cases
face_load_over_torques       K_Hbeta over the torque

The command `layout` and the table [layout] are named in `application.toml`. The public names are listed in
`__init__.pyi` and imported when they are asked for.

Steps 1 and 2 run on the one-dimensional analysis `shafts.annex_e`, step 3 on the loaded tooth contact.

References:
    U. Kissling's three-step layout of modifications.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
