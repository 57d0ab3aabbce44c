"""What extends the package from outside: a class, and where it shall have a name, one line more."""

import functools
import re
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, gear_pair
from commands import FREE, call
from design_texts import asked_sweep, loaded, removed, text
from jaxtyping import Array

import jaxgear as jg
from jaxgear.compliance import AbstractCompliance, ContactGeometry, Plane
from jaxgear.io import DesignFileError, Search, describe, quantities_of_tables
from jaxgear.metrics import AbstractSettings, Quantity
from jaxgear.microgeometry import AbstractCurve, AbstractModification
from jaxgear.numerics import AbstractSpring, Checked, number
from jaxgear.numerics.fields import count
from jaxgear.numerics.reductions import Harmonic
from jaxgear.vocabulary import quantities

ROLL_LENGTH = np.linspace(0.0, 60.0, 13)
FREE_TIP = {"pinion": 'modification = [{ type = "tip_relief", amount = "a", length = 4.0 }]'}
BY_FACTORIAL = FREE.replace("starts = 2\nsteps = 100", 'method = "factorial"')


@pytest.fixture
def load(tmp_path):
    """Loads a design file with the given content, text or bytes."""
    return functools.partial(loaded, tmp_path)


class BumpAtPitch(AbstractModification):
    """A user's own modification: a bump around a roll length.

    Attributes:
        height: of the bump.
        place: roll length of its top.
        curve: by which it fades.
        rounded: whether its top is.
    """

    height: jax.Array = number("um", low=0.0, high=50.0)
    place: jax.Array = number("mm", low=0.0)
    curve: "HalfCosine" = eqx.field(default_factory=lambda: HalfCosine(1.0))
    rounded: bool = eqx.field(static=True, default=True)
    varies_along_face = False

    def __call__(self, flank):
        distance = jnp.abs(flank.roll_length - self.place) / 3.0
        return self.height * (1.0 - self.curve(jnp.clip(distance, 0.0, 1.0)))


class HalfCosine(AbstractCurve):
    """A user's own curve."""

    power: jax.Array = number("", low=0.5, default=1.0)

    def __call__(self, d):
        return (0.5 - 0.5 * jnp.cos(jnp.pi * d)) ** self.power


def test_a_modification_and_a_curve_of_a_user_need_no_line_in_the_package(load):
    """Defined above, outside the package: their fields are the keys, with units, ranges and defaults."""
    table = '[[pinion.modification]]\ntype = "bump_at_pitch"\nheight = "height"\nplace = 9.0\n'
    variables = "[variables]\nheight = { low = 0.0, high = 20.0 }\n"
    file = load(text(pinion=table, tail=variables))
    assert file.units == {"height": "um"}
    pinion, _ = file.design({"height": 6.0})
    assert isinstance(pinion, BumpAtPitch)
    np.testing.assert_allclose(removed(pinion), removed(BumpAtPitch(6.0, 9.0)))
    assert removed(pinion).max() == pytest.approx(6.0, rel=1e-2)
    # the curve in another relief, and the ranges of both
    relief = '[[pinion.modification]]\ntype = "tip_relief"\namount = 5.0\nlength = 3.0\ncurve = {}\n'
    curved, _ = load(text(pinion=relief.format('{ type = "half_cosine", power = 2 }'))).design({})
    np.testing.assert_allclose(removed(curved), removed(jg.TipRelief(5.0, 3.0, HalfCosine(2.0))))
    assert describe(curved)[0]["curve"] == {"type": "half_cosine", "power": 2.0}
    for content, problem in (
        (text(pinion=table, tail=variables.replace("20.0", "60.0")), "variables.height.high: 60 um must be at least 0"),
        (text(pinion=table.replace('"height"\n', "-1\n")), "pinion.modification[0].height: -1 um must be at least 0"),
        (text(pinion=relief.format('{ type = "half_cosine", power = 0.1 }')), "[0].curve.power: 0.1 must be at least"),
    ):
        with pytest.raises(DesignFileError, match=re.escape(problem)):
            load(content)


class Spring(AbstractSpring):
    """h = c q"""

    c: Array

    def secant(self, load):
        return self.c + 0 * load


class Table(AbstractCompliance):
    """Tooth compliances over the roll length, as from finite elements, a linear contact, no coupling, rigid hubs."""

    pinion: Array
    wheel: Array
    contact: Array
    plane: Plane = eqx.field(static=True, default="strain")

    def structure(self, pinion, wheel):
        both = (pinion, self.pinion), (wheel, self.wheel)
        teeth = jnp.stack([jnp.interp(at.roll_length, ROLL_LENGTH, table) for at, table in both])
        return jnp.eye(teeth.shape[1])[None, :, :, None] * teeth[:, None]

    def hub(self, pinion, wheel):
        return jnp.zeros(2)

    def law(self, geometry: ContactGeometry, pinion, wheel, outside):
        return Spring(jnp.broadcast_to(self.contact, geometry.face_width.shape))


@pytest.mark.slow
def test_a_tabulated_compliance_needs_nothing_of_the_package():
    """At the pitch point one pair bears the load: TE = F / b (tooth + tooth + contact), with slopes by each."""
    pair = gear_pair()

    def mean_and_pitch(numbers):
        table = Table(numbers[0] + 2e-4 * ROLL_LENGTH**2, numbers[1] + 1e-4 * ROLL_LENGTH**2, numbers[2])
        cycle = jg.solve(jg.prepare(pair, compliance=table, resolution=LINE), 50.0)
        return cycle.transmission_error[0], cycle

    numbers = jnp.asarray([0.04, 0.05, 0.02])
    (te, cycle), slope = eqx.filter_jit(eqx.filter_value_and_grad(mean_and_pitch, has_aux=True))(numbers)
    assert bool(jnp.all(cycle.converged))
    line_load = 50e3 / float(pair.pinion.base_radius) / float(pair.face_width)
    contact = jg.path_of_contact(pair)
    rho = [float(contact.pinion_pitch_roll_length), float(contact.wheel_pitch_roll_length)]
    tables = 0.04 + 2e-4 * ROLL_LENGTH**2, 0.05 + 1e-4 * ROLL_LENGTH**2
    teeth = sum(np.interp(r, ROLL_LENGTH, table) for r, table in zip(rho, tables))
    assert float(te) == pytest.approx(line_load * (teeth + 0.02), rel=1e-9)
    np.testing.assert_allclose(slope, line_load, rtol=1e-9)
    # elsewhere two pairs share it
    assert float(cycle.transmission_error.min()) < 0.8 * float(te)


SECOND = Quantity(
    "te_second_harmonic", lambda c: c.transmission_error, "um", "second mesh harmonic", Harmonic(2), local=True
)


@pytest.fixture
def known(monkeypatch):
    """The vocabulary with a quantity more, until the end of the test."""
    monkeypatch.setattr(quantities, "_here", dict(quantities._known))
    quantities.add(SECOND)


@pytest.mark.slow
def test_a_quantity_of_a_user_is_swept_searched_limited_and_reported(known, tmp_path, monkeypatch):
    """By its name after one line: in sweeps, and as objective and limit of a design file, in the table."""
    mesh = jg.prepare(gear_pair(), resolution=LINE)
    plan = jg.VariantList(["amount"], [[0.0], [6.0]])
    table = jg.sweep(
        mesh, 50.0, lambda v: (jg.TipRelief(v["amount"], 4.0), None), plan, results=("te_second_harmonic",)
    )
    error = np.asarray(eqx.filter_jit(lambda: jg.solve(mesh, 50.0).transmission_error)())
    expected = 2 * abs(np.fft.fft(error)[2]) / len(error)
    assert table.column("te_second_harmonic")[0] == pytest.approx(expected, rel=1e-9)
    monkeypatch.setenv("JAXGEAR_NO_CACHE", "1")
    asked = 'objective = "te_second_harmonic"\nconstraint = [{ of = "te_second_harmonic_um", high = 1.0 }]\n'
    (tmp_path / "gear.toml").write_text(BY_FACTORIAL + asked)
    said = call("optimize", tmp_path / "gear.toml", "--quick", "--no-figures", "-o", tmp_path / "out")
    assert said.code == 0, said.err
    assert re.search(r"te_second_harmonic \[um\] +\d", said.out)
    assert re.search(r"te_second_harmonic \S+ um, met: at most 1\b", said.out)


class Microphone(AbstractSettings):
    """A user's own settings of a quantity.

    Attributes:
        distance: from the gears.
    """

    table = "microphone"
    distance: jax.Array = number("m", low=0.0, open_low=True)


@pytest.fixture
def traced(monkeypatch):
    """The settings that a quantity of them is traced with, which the vocabulary has until the end of the test."""
    seen = []

    def level(analysis, microphone):
        seen.append(microphone)
        return jg.peak_to_peak(analysis.cycle.transmission_error) / microphone.distance

    monkeypatch.setattr(quantities, "_here", dict(quantities._known))
    quantities.add(Quantity("level", level, "um/m", takes=Microphone, label="sound level"))
    return seen


def test_design_files_know_a_quantity_of_own_settings(traced, load):
    """As result of a sweep, objective, limit, and number of the table of designs."""
    asked = "[variables]\na = { low = 0.0, high = 9.0 }\n"
    asked += '[sweep]\nsamples = 8\nresults = ["level"]\n'
    asked += '[optimize]\nobjective = "level"\nconstraint = [{ of = "level", high = 9.0 }]\n'
    design = load(text(**FREE_TIP, tail=f"[microphone]\ndistance = 0.5\n{asked}"))
    (result,) = asked_sweep(design).results
    asked_for = Search.of(design).problem
    (limit,) = asked_for["constraints"]
    known = {quantity.name: quantity for quantity in quantities_of_tables(design)}
    for quantity in (result, asked_for["objective"], limit.quantity, known["level"]):
        assert float(quantity.settings.distance) == 0.5 and quantity.heading == "sound level [um/m]"
    with pytest.raises(DesignFileError, match=r'optimize.objective: "level" needs the table \[microphone\]'):
        load(text(**FREE_TIP, tail=asked))


def test_a_quantity_of_own_settings_is_swept_limited_and_compiled_once(traced):
    """Other settings compile nothing, and a gradient goes through them."""
    mesh = jg.prepare(gear_pair(), resolution=LINE)
    plan = jg.VariantList(["amount"], [[0.0], [6.0]])

    def swept(distance):
        results = ("ppte", Microphone(distance).quantity("level"))
        return jg.sweep(mesh, 50.0, lambda v: (jg.TipRelief(v["amount"], 4.0), None), plan, results=results)

    near = swept(0.5)
    assert near.column("level_um_per_m") == pytest.approx(2 * near.column("ppte_um"))
    cycle = jg.solve(mesh, 50.0)
    level_at = eqx.filter_jit(lambda quantity, cycle: quantity(cycle))
    values = [level_at(Microphone(distance).quantity("level"), cycle) for distance in (0.5, 2.0)]
    assert float(values[0]) == pytest.approx(4 * float(values[1]))
    count = len(traced)
    level_at(Microphone(3.0).quantity("level"), cycle)
    assert len(traced) == count
    slope = jax.grad(lambda distance: Microphone(distance).quantity("level")(cycle))(2.0)
    assert float(slope) == pytest.approx(-float(values[1]) / 2.0)
    limit = jg.Constraint(Microphone(0.5).quantity("level"), high=1.0)
    assert (limit.name, limit.unit) == ("level", "um/m")
    with pytest.raises(ValueError, match=r"^level: needs settings, give .*Microphone\(...\).quantity\("):
        quantities["level"](cycle)
    with pytest.raises(TypeError, match="^level: takes Microphone, not Strength"):
        quantities["level"].with_settings(jg.metrics.Strength(1500.0))
    with pytest.raises(ValueError, match='^Microphone: quantity "volume" is not known, must be one of level'):
        Microphone(1.0).quantity("volume")


class Scatter(Checked, jg.optimize.AbstractSearch):
    """A user's own method: designs at random.

    Attributes:
        designs: how many.
        seed: of the random numbers.
    """

    designs: int = count(high=1000, default=32)
    seed: int = count(low=0, default=0)

    @property
    def name(self):
        return "scatter"

    def search(self, problem, record):
        points = np.random.default_rng(self.seed).random((self.designs, len(problem.names)))
        score = eqx.filter_jit(lambda points: jax.lax.map(problem.score, points))(
            jnp.asarray(points, problem.low.dtype)
        )
        record.spend(self.designs)
        record.offer(points, score.value[:, 0], score.violation)
        record.look(1, 1)


@pytest.mark.slow
def test_a_method_of_a_user_is_given_as_an_object_or_known_by_name(load, monkeypatch):
    file = load(BY_FACTORIAL)
    mesh = file.mesh(replace(file.resolution(), positions=8))
    given = jg.minimize(jg.Problem(mesh, 50.0, file.design, file.bounds), Scatter(5, seed=3), positions=None)
    height = 20.0 * np.random.default_rng(3).random(5)
    assert np.abs(height - given.parameters["height"]).min() < 1e-9 and given.method == "scatter"
    monkeypatch.setitem(jg.optimize.METHODS, "scatter", Scatter)
    asked = BY_FACTORIAL.replace("factorial", "scatter") + "seed = 3\nscatter = { designs = 5 }\n"
    asked += "rounding = { length = 0, amount = 0 }\n"
    named = Search.of(load(asked), quick=True)(mesh)
    assert named.parameters == given.parameters and named.objective == given.objective
    for wrong, problem in (
        ("designs = 0", "optimize.scatter.designs: 0 must be at least 1 and at most 1000"),
        ("design = 5", 'optimize.scatter.design: unknown key, did you mean "designs"?'),
    ):
        with pytest.raises(DesignFileError, match=re.escape(problem)):
            Search.of(load(asked.replace("designs = 5", wrong)))
