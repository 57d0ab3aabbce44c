"""The rating of a gear pair after ISO 6336, from the torque to the safeties of both gears."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..conditions import LoadSpectrum
from ..geometry import GearPair, PathOfContact, path_of_contact
from ..metrics import SNLine
from ..metrics.safety import safety_factor
from ..numerics import Checked, Given, check, on_both, program, result
from .flank import FlankFactors, flank_factors, flank_strengths
from .life import equivalent_torque, safety
from .load_factors import LoadFactors, load_factors
from .mesh_geometry import MeshGeometry, mesh_geometry
from .root import BendingFactors, bending_factors, root_strengths
from .settings import Rating, check_metal

Scalar = Float[Array, ""]
OfGears = Float[Array, " gears"]
Lines = tuple[SNLine, SNLine]

_MINUTES = 60.0  # per hour
_LONGEST = 1e9  # [h], the life without damage: a finite number
_STEPS = 2  # of the S-N line over the torque per step over the contact stress


class Verdict(Checked):
    """One way to fail, of both gears: what occurs and what is borne.

    Attributes:
        nominal_stress: without load factors.
        stress: with load factors.
        life_factor: Z_NT or Y_NT.
        limit: sigma_HG or sigma_FG, the strength at the required life.
        static_limit: of static strength.
        permissible: limit over required safety.
        safety: S_H or S_F, on the stress; of a spectrum the factor on all stresses for a damage sum of 1.
        static_safety: static strength over the largest stress, without K_A: the torque is that of the largest load.
        damage: damage sum at the required life.
        power: that may be transmitted with the required safety.
    """

    nominal_stress: OfGears = result("MPa")
    stress: OfGears = result("MPa")
    life_factor: OfGears = result()
    limit: OfGears = result("MPa")
    static_limit: OfGears = result("MPa")
    permissible: OfGears = result("MPa")
    safety: OfGears = result()
    static_safety: OfGears = result()
    damage: OfGears = result()
    power: OfGears = result("kW")


class Spectrum(Checked):
    """A load spectrum bin by bin; axes (bins,) and (gears, bins).

    Attributes:
        torques, speeds: of the pinion.
        cycles: load cycles of both gears.
        factors: load factors of every bin.
        contact_stress, root_stress: with them.
        pitting_damage, root_damage: of every bin.
        pitting_torque, root_torque: equivalent torque T_eq of Annex A, whose carried cycles are an estimate.
    """

    torques: Float[Array, " bins"] = result("N m")
    speeds: Float[Array, " bins"] = result("rpm")
    cycles: Float[Array, "gears bins"] = result()
    factors: LoadFactors = eqx.field()
    contact_stress: Float[Array, "gears bins"] = result("MPa")
    root_stress: Float[Array, "gears bins"] = result("MPa")
    pitting_damage: Float[Array, "gears bins"] = result()
    root_damage: Float[Array, "gears bins"] = result()
    pitting_torque: OfGears = result("N m")
    root_torque: OfGears = result("N m")


class PairRating(Checked):
    """A rated pair: every factor, stress, limit and safety.

    Attributes:
        geometry: of the mesh.
        tangential_force: F_t.
        speed: v at the reference circle.
        factors: load factors.
        flank, root: factors of ISO 6336-2 and -3.
        pitting, bending: what comes of them.
        flank_lines, root_lines: S-N lines of pinion and wheel.
        cycles: load cycles N_L of both gears; those of the endurance limit without a required life.
        spectrum: bins of the load spectrum; None without one.
        life: until the first damage sum of either gear is 1, at most 1e9 h; None without a required life.
    """

    geometry: MeshGeometry
    tangential_force: Scalar = result("N")
    speed: Scalar = result("m/s")
    factors: LoadFactors = eqx.field()
    flank: FlankFactors = eqx.field()
    root: BendingFactors = eqx.field()
    pitting: Verdict = eqx.field()
    bending: Verdict = eqx.field()
    flank_lines: Lines = eqx.field()
    root_lines: Lines = eqx.field()
    cycles: OfGears = result()
    spectrum: Spectrum | None = eqx.field()
    life: OfGears | None = result("h")


def rate(
    pair: GearPair,
    torque: Given,
    speed: Given,
    rating: Rating,
    *,
    path: PathOfContact | None = None,
    face_load_factor: Given = 1.0,
    tip_relief: Given = 0.0,
) -> PairRating:
    """The rating of a gear pair under a torque, differentiable in every number; `jax.vmap` makes many.

        sigma_H = Z_B sigma_H0 sqrt(K_A K_gamma K_v K_Hbeta K_Halpha),  S_H = sigma_HG / sigma_H
        sigma_F = sigma_F0 K_A K_gamma K_v K_Fbeta K_Falpha,  S_F = sigma_FG / sigma_F

    Of a load spectrum the safeties are those for a damage sum of 1, with load factors of every bin; the stresses are
    those of the torque.

    Args:
        pair: gear pair.
        torque: on the pinion, nominal [N m].
        speed: of the pinion [rpm].
        rating: settings, with the lubricant.
        path: path of contact of the pair, where it is known.
        face_load_factor: K_Hbeta, where the rating gives none; that of a contact analysis.
        tip_relief: C_a, where the rating gives none: the smaller of those at both ends of the path of contact [um].

    Raises:
        ValueError: for what is missing, with the factor that needs it, a pair at rest or without load, and gears that
            are not of metal.
    """
    check("rate: torque", torque, "N m", low=0.0, open_low=True)
    check("rate: speed", speed, "rpm", low=0.0, open_low=True)
    for name, gear in zip(("pinion", "wheel"), pair.gears):
        check_metal(f"rate: elastic_modulus of the {name}", gear.material)
    numbers = (jnp.asarray(each, pair.pinion.module.dtype) for each in (torque, speed, face_load_factor, tip_relief))
    load, turns, face, relief = numbers
    return _rate(pair, load, turns, rating, path, {"face_load_factor": face, "tip_relief": relief})


@program
def _rate(
    pair: GearPair,
    torque: Scalar,
    speed: Scalar,
    rating: Rating,
    path: PathOfContact | None,
    given: dict[str, Scalar],
) -> PairRating:
    path = path_of_contact(pair) if path is None else path
    geometry = mesh_geometry(pair, path)
    factors = load_factors(pair, geometry, torque, speed, rating, **given)
    flank = flank_factors(pair, path, geometry, speed, rating)
    root = bending_factors(pair, path, geometry, rating)
    strengths = flank_strengths(flank, rating), root_strengths(root, rating)
    lines = strengths[0].lines(rating.long_life_factor), strengths[1].lines(rating.long_life_factor)
    spectrum = None
    if rating.loads is not None:
        spectrum = _spectrum(pair, geometry, rating, rating.loads, (flank, root), lines, given)
    cycles = _cycles(geometry, speed, rating, lines, spectrum)
    nominal = jnp.stack([flank.nominal_stress(geometry, torque)] * 2), root.nominal_stress(geometry, torque)
    stresses = flank.single_pair * nominal[0] * jnp.sqrt(factors.flank), nominal[1] * factors.root
    required = rating.required_pitting_safety, rating.required_root_safety
    life_factors = [of.life_factors(at, rating.long_life_factor) for of, at in zip(strengths, cycles)]
    power = torque * speed * jnp.pi / 30 * 1e-3
    common = factors.application, power, spectrum
    verdicts = [
        _verdict(of, nominal[of], stresses[of], life_factors[of], lines[of], cycles[of], required[of], *common)
        for of in (0, 1)
    ]
    return PairRating(
        geometry=geometry,
        tangential_force=geometry.tangential_force(torque),
        speed=geometry.reference_speed(speed),
        factors=factors,
        flank=flank,
        root=root,
        pitting=verdicts[0],
        bending=verdicts[1],
        flank_lines=lines[0],
        root_lines=lines[1],
        cycles=cycles[0],
        spectrum=spectrum,
        life=None if rating.service_life is None else _life(rating.service_life, verdicts),
    )


def _turns(geometry: MeshGeometry, rating: Rating) -> OfGears:
    """Load cycles of both gears per revolution of the pinion."""
    contacts = jnp.stack([gear.contacts_per_revolution for gear in rating.gears])
    return contacts * jnp.abs(geometry.teeth[0] / geometry.teeth)


def _cycles(
    geometry: MeshGeometry, speed: Scalar, rating: Rating, lines: tuple[Lines, Lines], spectrum: Spectrum | None
) -> tuple[OfGears, OfGears]:
    """Load cycles of flanks and roots: of the required life, or of the endurance limits."""
    if spectrum is not None:
        return (jnp.sum(spectrum.cycles, axis=1),) * 2
    if rating.service_life is not None:
        return (_MINUTES * rating.service_life * speed * _turns(geometry, rating),) * 2
    flank, root = (jnp.stack([line.cycles[-2] for line in of]) for of in lines)
    return flank, root


def _verdict(of, nominal, stress, life, lines, cycles, required, application, power, spectrum) -> Verdict:
    steps = (_STEPS, 1)[of]
    limit = jnp.stack([line.bears(count) for line, count in zip(lines, cycles)])
    static = jnp.stack([line.stress[0] for line in lines])
    reached, largest = safety_factor(limit, stress), stress / application ** (1 / steps)
    damage = jnp.stack([line.damage(*each) for line, *each in zip(lines, stress, cycles)])
    if spectrum is not None:
        in_bins = (spectrum.contact_stress, spectrum.root_stress)[of]
        largest = jnp.max(in_bins, axis=1)
        reached = jnp.stack(on_both(lambda of_gear: safety(*of_gear), *zip(lines, in_bins, spectrum.cycles)))
        damage = jnp.sum((spectrum.pitting_damage, spectrum.root_damage)[of], axis=1)
    return Verdict(
        nominal_stress=nominal,
        stress=stress,
        life_factor=life,
        limit=limit,
        static_limit=static,
        permissible=limit / required,
        safety=reached,
        static_safety=safety_factor(static, largest),
        damage=damage,
        power=power * (reached / required) ** steps,
    )


def _life(required: Scalar, verdicts: list[Verdict]) -> OfGears:
    damage = jnp.maximum(verdicts[0].damage, verdicts[1].damage)
    return required / jnp.maximum(damage, required / _LONGEST)


def _spectrum(
    pair: GearPair,
    geometry: MeshGeometry,
    rating: Rating,
    loads: LoadSpectrum,
    of: tuple[FlankFactors, BendingFactors],
    lines: tuple[Lines, Lines],
    given: dict[str, Scalar],
) -> Spectrum:
    """Every bin with load factors of its own; weights are shares of the time."""
    if rating.service_life is None or loads.speeds is None:
        raise ValueError("a load spectrum needs service_life and speeds, for the number of load cycles")
    settings = eqx.tree_at(lambda given: given.application_factor, rating, jnp.ones_like(rating.application_factor))
    factors = jax.vmap(lambda torque, speed: load_factors(pair, geometry, torque, speed, settings, **given))(
        loads.torques, loads.speeds
    )
    turned = _MINUTES * rating.service_life * loads.weights * loads.speeds
    cycles = jnp.outer(_turns(geometry, rating), turned)
    flank, root = of
    at_pitch = jax.vmap(lambda torque: flank.nominal_stress(geometry, torque))(loads.torques)
    contact = jnp.outer(flank.single_pair, at_pitch * jnp.sqrt(factors.flank))
    bending = jax.vmap(lambda torque: root.nominal_stress(geometry, torque))(loads.torques).T * factors.root[None]

    def damages(lines: Lines, stresses: Array) -> Array:
        return jnp.stack([line.damage(*each) for line, *each in zip(lines, stresses, cycles)])

    def equal(lines: Lines, steps: int) -> OfGears:
        found = []
        for line, count in zip(lines, cycles):
            (first, *_, last), stresses = line.cycles[:-1], line.stress
            exponent = jnp.log(last / first) / jnp.log(stresses[0] / stresses[-2]) / steps
            found.append(equivalent_torque(loads.torques, count, exponent, last))
        return jnp.stack(found)

    return Spectrum(
        torques=loads.torques,
        speeds=loads.speeds,
        cycles=cycles,
        factors=factors,
        contact_stress=contact,
        root_stress=bending,
        pitting_damage=damages(lines[0], contact),
        root_damage=damages(lines[1], bending),
        pitting_torque=equal(lines[0], _STEPS),
        root_torque=equal(lines[1], 1),
    )
