"""Planetary stages: loaded contact of all meshes of sun, planets and ring, in equilibrium with their supports.

sun_planet, planet_ring = jaxgear.GearPair(sun, planet), jaxgear.GearPair(planet, ring)  # `ring` is a `RingGear`
gears = StageGears.of_pairs(sun_planet, planet_ring)
stage = PlanetaryStage(gears, 3, radial_pin_stiffness=400.0, tangential_pin_stiffness=400.0, sun_support=0.0)
prepared = prepare_stage(stage, sun=jaxgear.prepare(sun_planet), ring=jaxgear.prepare(planet_ring))
cycle = solve_stage(prepared, 400.0, planet_to_sun=jaxgear.TipRelief(10.0, 4.0))
cycle.load_sharing_factor, cycle.orders(6).amplitude
meshes = mesh_cycles(prepared, cycle)
meshes.max_flank_pressure, meshes.root_stress.planet_to_ring
"""

from .cycle import StageCycle as StageCycle
from .flanks import PlanetFlanks as PlanetFlanks
from .gears import StageGears as StageGears
from .kinematics import AxialLoads as AxialLoads
from .kinematics import Members as Members
from .kinematics import Phasing as Phasing
from .kinematics import axial_loads as axial_loads
from .kinematics import gear_ratio as gear_ratio
from .kinematics import member_speeds as member_speeds
from .kinematics import member_torques as member_torques
from .kinematics import mesh_force as mesh_force
from .kinematics import mesh_frequency as mesh_frequency
from .kinematics import output_member as output_member
from .kinematics import phasing as phasing
from .kinematics import planet_phases as planet_phases
from .losses import StageLosses as StageLosses
from .losses import stage_efficiency as stage_efficiency
from .losses import stage_losses as stage_losses
from .mesh_cycles import PerFlank as PerFlank
from .mesh_cycles import PerMesh as PerMesh
from .mesh_cycles import StageMeshes as StageMeshes
from .mesh_cycles import mesh_cycles as mesh_cycles
from .meshes import AbstractLoadedMesh as AbstractLoadedMesh
from .meshes import AbstractPlacedMesh as AbstractPlacedMesh
from .meshes import AbstractStageMesh as AbstractStageMesh
from .meshes import MeshForces as MeshForces
from .meshes import StageFlanks as StageFlanks
from .meshes import TableMesh as TableMesh
from .quantities import STAGE_QUANTITIES as STAGE_QUANTITIES
from .quantities import StageSettings as StageSettings
from .response import StageResponse as StageResponse
from .response import stage_response as stage_response
from .solve import PreparedStage as PreparedStage
from .solve import prepare_stage as prepare_stage
from .solve import solve_stage as solve_stage
from .stage import PlanetaryStage as PlanetaryStage
from .vibration import StageInertias as StageInertias
from .vibration import StageModes as StageModes
from .vibration import StageSystem as StageSystem
from .vibration import natural_modes as natural_modes
from .vibration import stage_system as stage_system
