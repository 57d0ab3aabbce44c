"""Sweeps: rows are those of `solve`, failures stay, selections are exact, and a folder resumes or is refused."""

import csv
import math
import shutil

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pyarrow.parquet as parquet
import pytest
from catalogue import LINE, gear_pair
from scipy.stats.mstats import hdquantiles

import jaxgear as jg
from jaxgear.contact.status import Status
from jaxgear.sweeps.columns import FLAG, NUMBER, Column, described
from jaxgear.sweeps.store import Manifest, Store, load_manifest
from jaxgear.sweeps.table import front, smallest
from jaxgear.vocabulary import quantities

BOUNDS = {"pinion": (0.0, 20.0), "wheel": (0.0, 20.0), "length": (1.0, 5.5)}
# without those that need a speed, several slices or settings
SLICED = "face_load_factor", "mean_face_load_factor", "root_face_load_factor", "edge_load_factor"
NAMES = tuple(name for name, quantity in quantities.items() if quantity.takes is None and name not in SLICED)
# of the curves, the contact, the gears and the flanks
FEW = ("ppte", "max_flank_pressure", "effective_contact_ratio", "wheel_tip_land", "removed_material")
PLAN = jg.Sobol(BOUNDS, 40, seed=5)

traced = []  # whether values were those of a program, for every time that the design was asked


def design(x):
    traced.append(isinstance(x["length"], jax.core.Tracer))
    return jg.TipRelief(x["pinion"], x["length"]), jg.TipRelief(x["wheel"], x["length"])


@pytest.fixture(scope="module")
def mesh():
    return jg.prepare(gear_pair(), resolution=LINE)


@eqx.filter_jit
def results_of(cycle, names):
    return {name: quantities[name](cycle) for name in names}


def numbers(mesh, row, torque=50.0, names=FEW):
    """Results of one variant, straight from `solve`."""
    pinion, wheel = design(dict(zip(BOUNDS, jnp.asarray(row))))
    return results_of(jg.solve(mesh, torque, pinion=pinion, wheel=wheel), names)


def run(mesh, plan=PLAN, **options):
    """A sweep of the few results; all calls share one compiled program."""
    torque = options.pop("torque", 50.0)
    return jg.sweep(mesh, torque, design, plan, **{"results": FEW, "part_rows": 16, **options})


@pytest.fixture(scope="module")
def table(mesh):
    before = sum(traced)
    table = run(mesh)
    assert sum(traced) - before <= 3  # for its shapes, to compile it and, with a folder, to identify it
    return table


@pytest.fixture(scope="module")
def spectrum_table(mesh):
    return run(mesh, torque=jg.LoadSpectrum([25.0, 62.5], [3.0, 1.0]), results=("ppte", "effective_contact_ratio"))


@pytest.fixture(scope="module")
def written(mesh, tmp_path_factory):
    path = tmp_path_factory.mktemp("sweep") / "out"
    run(mesh, output=path, title="a title", units={"length": "mm"})
    return path


@pytest.fixture
def folder(written, tmp_path):
    """A copy of its own for every test."""
    return shutil.copytree(written, tmp_path / "out")


def content(table):
    return {name: table.column(name) for name in table.names}


def parts_of(folder):
    return sorted(folder.glob("part-*.parquet"))


def assert_same(first, second):
    """To the last bit."""
    assert first.names == second.names
    for name in first.names:
        np.testing.assert_array_equal(first.column(name), second.column(name), err_msg=name)


def assert_results_of_solve(mesh, table, names, rows):
    assert table.names == ("variant", *BOUNDS, *(quantities[name].key for name in names), "converged", "status")
    columns = content(table)
    np.testing.assert_array_equal(columns["variant"], np.arange(40))
    assert columns["converged"].all() and len(table) == 40
    for row in rows:
        values = PLAN.rows(row, row + 1)[0]
        assert [columns[name][row] for name in BOUNDS] == list(values)
        for name, expected in numbers(mesh, values, names=names).items():
            assert columns[quantities[name].key][row] == pytest.approx(float(expected), rel=1e-9, abs=1e-9), name


def test_results_are_those_of_solve(mesh, table):
    assert_results_of_solve(mesh, table, FEW, (0, 17, 39))


@pytest.mark.slow
def test_every_result_is_that_of_solve(mesh):
    assert_results_of_solve(mesh, run(mesh, results=NAMES), NAMES, (17,))


def test_a_load_spectrum_gives_mean_worst_and_every_torque(mesh, spectrum_table):
    assert spectrum_table.results[:4] == ("ppte_um_mean", "ppte_um_worst", "ppte_um_25Nm", "ppte_um_62.5Nm")
    columns = content(spectrum_table)
    row = PLAN.rows(3, 4)[0]
    at_low, at_high = (numbers(mesh, row, torque) for torque in (25.0, 62.5))
    for name, worst in (("ppte", np.maximum), ("effective_contact_ratio", np.minimum)):
        key = quantities[name].key
        low, high = columns[f"{key}_25Nm"], columns[f"{key}_62.5Nm"]
        np.testing.assert_allclose(columns[f"{key}_mean"], 0.75 * low + 0.25 * high, rtol=1e-13)
        np.testing.assert_array_equal(columns[f"{key}_worst"], worst(low, high))
        assert low[3] == pytest.approx(float(at_low[name]), rel=1e-9)
        assert high[3] == pytest.approx(float(at_high[name]), rel=1e-9)


@pytest.mark.slow
def test_a_tolerance_gives_mean_and_quantile_over_common_deviations(mesh):
    tolerance = jg.Tolerance.from_class(mesh.pair, 6).without_lead()
    made = jg.ManufacturedGears(tolerance, 4, 9)
    table = run(mesh, manufactured=made, results=("ppte", "effective_contact_ratio"))
    assert table.results[:2] == ("ppte_um_mean", "ppte_um_q95")
    deviations = made.on(mesh)
    pinion, wheel = design(dict(zip(BOUNDS, PLAN.rows(7, 8)[0])))

    @eqx.filter_jit
    def sampled(deviation):
        removed = jg.tolerance.deviated_material(mesh, 50.0, deviation, pinion=pinion, wheel=wheel)
        cycle = jg.contact.solve_removed(mesh, 50.0, removed)
        return jg.peak_to_peak(cycle.transmission_error), jg.effective_contact_ratio(cycle)

    ppte, ratio = map(np.asarray, jax.vmap(sampled)(deviations))
    assert np.ptp(ppte) > 0.1
    assert table.column("ppte_um_mean")[7] == pytest.approx(ppte.mean())
    harrell_davis = [float(hdquantiles(values, [level])[0]) for values, level in ((ppte, 0.95), (ratio, 0.05))]
    assert table.column("ppte_um_q95")[7] == pytest.approx(harrell_davis[0])
    assert table.column("effective_contact_ratio_q95")[7] == pytest.approx(harrell_davis[1])


def test_impossible_variants_are_rows(mesh, table):
    good = PLAN.rows(0, 5)
    rows = np.repeat(good, 2, axis=0)
    rows[1, 2], rows[4, 0], rows[9, 1] = -1.0, np.nan, np.inf
    mixed = run(mesh, jg.VariantList(tuple(BOUNDS), rows))
    failed = np.isin(np.arange(10), [1, 4, 9])
    np.testing.assert_array_equal(mixed.column("converged"), ~failed)
    np.testing.assert_array_equal(np.isnan(mixed.column("ppte_um")), failed)
    np.testing.assert_array_equal(mixed.column("ppte_um")[~failed], np.repeat(table.column("ppte_um")[:5], 2)[~failed])
    assert mixed.failures() == 3 and len(mixed.best(10)) == 7
    assert [text for text in mixed.column("status") if text != "converged"] == 3 * ["out_of_validity"]
    assert mixed.causes() == {Status.OUT_OF_VALIDITY: 3} and "3 of 10 variants: a number is out of" in str(mixed)


def test_unsolved_variants_are_rows(mesh, tmp_path):
    # teeth that give way against the load have no equilibrium, and every number of the last step is finite
    yielding = eqx.tree_at(lambda m: m.structure, mesh, -3.0 * mesh.structure)
    cycle = jg.solve(yielding, 50.0)
    assert not bool(jnp.all(cycle.converged)) and bool(jnp.all(jnp.isfinite(cycle.transmission_error)))
    table = run(yielding, output=tmp_path / "out")
    assert len(table) == 40 and not table.column("converged").any()
    assert np.isnan(table.column("ppte_um")).all()
    assert len(table.best(3)) == 0 and len(table.pareto(["ppte_um", "length"])) == 0
    stored = parquet.read_table(parts_of(tmp_path / "out")[0])
    assert stored["ppte_um"].null_count == 16  # null, which statistics leave out, not NaN
    table.to_csv(tmp_path / "table.csv")
    with (tmp_path / "table.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 40 and rows[0]["ppte_um"] == "" and rows[0]["converged"] == "false"
    assert rows[0]["status"] == "not_converged" and (table.to_pandas()["status"] == "not_converged").all()


def test_the_size_of_the_parts_changes_nothing(mesh, table, folder):
    assert_same(table, run(mesh, part_rows=40))
    assert_same(table, jg.open_sweep(folder))


def test_an_interruption_costs_a_small_share_of_a_sweep(mesh, table, tmp_path, monkeypatch):
    """Without a size the parts are as small as the devices work well with; a resumed sweep keeps those that are there,
    whatever its devices would like."""
    sizes = {}
    for batch in (4, 7):
        monkeypatch.setattr("jaxgear.sweeps.run.side_by_side", lambda *_, batch=batch: batch)
        found = run(mesh, part_rows=None, output=tmp_path / "out")
        assert found.names == table.names and (found.column("status") == table.column("status")).all()
        for name in table.names:  # as many side by side as on another device: equal to rounding
            if name != "status":
                np.testing.assert_allclose(found.column(name), table.column(name), rtol=1e-13, err_msg=name)
        sizes[batch] = [path.name for path in parts_of(tmp_path / "out")]
        parts_of(tmp_path / "out")[1].unlink()
    assert sizes[4] == sizes[7] and len(sizes[4]) == -(-40 // (8 * len(jax.local_devices())))
    assert 64 * _part_rows_of(10**6) >= 10**6 > 60 * _part_rows_of(10**6)
    assert -(-20_000 // _part_rows_of(20_000)) == 64


def _part_rows_of(variants):
    """As a sweep of few variants side by side chooses them."""
    from types import SimpleNamespace

    from jaxgear.sweeps.run import _part_rows

    made = SimpleNamespace(mesh_shape=lambda _: None, conditions=SimpleNamespace(count=1))
    return _part_rows(made, None, variants, "not there")


def test_a_design_is_traced_once_for_all_parts(mesh, table):
    before = sum(traced)
    assert before > 0 and len(run(mesh, torque=40.0, part_rows=5)) == len(table)
    assert sum(traced) - before <= 2  # not compiled again


def test_best_is_sorted_and_large_where_large_is_better(table):
    columns = content(table)
    best = table.best(7)
    np.testing.assert_array_equal(best.column("variant"), np.argsort(columns["ppte_um"])[:7])
    assert best.designs()[0] == {name: columns[name][best.column("variant")[0]] for name in BOUNDS}
    ratio = table.best(1, by="effective_contact_ratio").column("effective_contact_ratio")
    assert ratio == columns["effective_contact_ratio"].max()
    assert len(table.best(100)) == 40 and "40 variants, 0 failed" in str(table)
    with pytest.raises(ValueError, match='"noise" is not a column, must be one of variant, pinion'):
        table.best(1, by="noise")


def test_a_column_is_found_with_and_without_its_unit(table, spectrum_table):
    for name in ("ppte", "max_flank_pressure"):
        best = table.best(3, by=name)
        np.testing.assert_array_equal(best.column("variant"), table.best(3, by=table.find(name).name).column("variant"))
        np.testing.assert_array_equal(best.column(name), best.column(table.find(name).name))
    assert next(table.batches(["ppte"]))["ppte"][0] == table.column("ppte_um")[0]
    pair = table.pareto(["ppte", "max_flank_pressure_MPa"])
    assert_same(pair, table.pareto(["ppte_um", "max_flank_pressure"]))
    with pytest.raises(ValueError, match="two or three different columns"):
        table.pareto(["ppte", "ppte_um"])
    assert [spectrum_table.find(name).name for name in ("ppte", "ppte_worst")] == ["ppte_um_mean", "ppte_um_worst"]
    assert [head.name for head in spectrum_table.heads] == ["ppte_um_mean", "effective_contact_ratio_mean"]


def test_the_table_is_arrow_pandas_and_xarray_with_units(table, folder):
    import pandas
    import polars
    import pyarrow

    for view in (table, jg.open_sweep(folder)):
        arrow = pyarrow.table(view)  # through the stream
        assert arrow.equals(view.to_arrow()) and len(arrow) == 40
        assert arrow.schema.field("ppte_um").metadata[b"unit"] == b"um"
        frame, dataset = view.to_pandas(), view.to_xarray()
        assert isinstance(frame, pandas.DataFrame) and frame.attrs["units"]["ppte_um"] == "um"
        assert dataset["ppte_um"].attrs["units"] == "um" and dataset["length"].attrs["high"] == 5.5
        for name in view.names:
            for values in (arrow[name], frame[name], dataset[name], polars.DataFrame(view)[name]):
                np.testing.assert_array_equal(values.to_numpy(), view.column(name))


def test_a_folder_is_read_as_a_folder(table, folder):
    import pandas
    import polars

    for frame in (pandas.read_parquet(folder), polars.scan_parquet(folder).collect(), polars.read_parquet(folder)):
        assert tuple(frame.columns) == table.names
        for name in table.names:
            np.testing.assert_array_equal(frame[name].to_numpy(), table.column(name))


@pytest.mark.parametrize(
    "by", [("ppte_um", "max_flank_pressure_MPa"), ("ppte_um", "effective_contact_ratio", "length")]
)
def test_pareto_is_what_comparing_all_pairs_gives(table, by):
    signs = [-1.0 if name == "effective_contact_ratio" else 1.0 for name in by]
    values = np.stack([table.column(name) for name in by], axis=1) * signs
    beats = (values[:, None] <= values[None]).all(axis=2) & (values[:, None] < values[None]).any(axis=2)
    chosen = table.pareto(by)
    assert set(chosen.column("variant")) == set(np.flatnonzero(~beats.any(axis=0)))
    assert (np.diff(chosen.column(by[0])) >= 0).all()


def test_selections_of_a_stream_are_those_of_the_whole():
    random = np.random.default_rng(0)
    values = random.integers(0, 30, (3000, 2)).astype(float)  # many equal ones
    values[random.integers(0, 3000, 100), 0] = math.nan
    numbers = np.arange(3000)
    cuts = [slice(start, start + 7) for start in range(0, 3000, 7)]
    stable = np.argsort(values[:, 0], kind="stable")[:50]
    np.testing.assert_array_equal(smallest([(numbers[c], values[c, 0]) for c in cuts], 50), stable)
    whole = front([(numbers, values)])
    np.testing.assert_array_equal(front([(numbers[c], values[c]) for c in cuts]), whole)
    assert len(np.unique(values[whole], axis=0)) == len(whole)  # of equal rows one
    assert all((numbers[(values == values[i]).all(axis=1)] >= i).all() for i in whole)  # the first


def test_units_ranges_and_settings_are_in_the_files(folder):
    schema = parquet.read_schema(parts_of(folder)[2])
    field = schema.field("max_flank_pressure_MPa")
    assert {b"unit": b"MPa", b"kind": b"result", b"better": b"smaller"}.items() <= field.metadata.items()
    field = schema.field("length")
    assert (field.metadata[b"unit"], field.metadata[b"low"], field.metadata[b"high"]) == (b"mm", b"1.0", b"5.5")
    assert schema.metadata[b"title"] == b"a title" and schema.metadata[b"torques_Nm"] == b"[50.0]"
    assert {b"jaxgear", b"plan", b"weights", b"fingerprint"} <= set(schema.metadata)
    table = jg.open_sweep(folder)
    for column in table.columns[4:-2]:  # what tables and figures say of a result
        of = quantities[column.quantity.name]
        said = "words", "unit", "meaning", "form", "better", "key"
        assert [getattr(column.quantity, name) for name in said] == [getattr(of, name) for name in said]
        assert (column.name, column.torque, column.statistic) == (of.key, None, "")
    with pytest.raises(ValueError, match="its description only and no function"):
        table.find("ppte").quantity.of(None)
    assert table.units["ppte_um"] == "um" and table.units["effective_contact_ratio"] == ""
    table.to_csv(folder.parent / "table.csv")
    header, first, *_ = (folder.parent / "table.csv").read_text().splitlines()
    assert header.split(",")[3:5] == ['"length [mm]"', '"ppte_um"']
    assert float(first.split(",")[4]) == table.column("ppte_um")[0]


def test_a_column_knows_its_cases_also_when_it_is_read(tmp_path):
    own = described("ripple", "N/um", label="own ripple", meaning="a meaning", form=".1f", better="larger")
    columns = (
        NUMBER,
        Column(described("length", "mm"), "parameter", low=1.0, high=5.5),
        Column(own, statistic="mean"),
        Column(own, torque=25.0, speed=1e3),
        Column(own, torque=62.5, speed=1e3, statistic="q95"),
        FLAG,
    )
    settings = {"variants": 4, "part_rows": 2}
    Store(tmp_path, Manifest("t", columns, settings)).claim(leader=True)
    read = load_manifest(tmp_path).columns
    assert read == columns
    assert [column.name for column in read[2:5]] == [
        "ripple_N_per_um_mean",
        "ripple_N_per_um_25Nm_1000rpm",
        "ripple_N_per_um_62.5Nm_1000rpm_q95",
    ]
    assert [column.heading for column in read[1:5]] == [
        "length [mm]",
        "own ripple mean [N/um]",
        "own ripple at 25 N m and 1000 rpm [N/um]",
        "own ripple at 62.5 N m and 1000 rpm, q95 over gears [N/um]",
    ]
    assert [column.better for column in read] == ["", "", "larger", "larger", "larger", ""]


def test_a_resumed_sweep_computes_what_is_missing_and_only_that(mesh, table, folder, caplog):
    parts = parts_of(folder)
    assert [path.name[:13] for path in parts] == [f"part-000000{i}-" for i in range(3)]
    before = parts[0].stat().st_mtime_ns
    parts[1].write_bytes(parts[1].read_bytes()[:-100])  # torn
    parts[2].unlink()
    for part in (1, 0):
        (folder / f".{parts[part].name}.0f.tmp").write_bytes(b"PAR1")
    with pytest.raises(ValueError, match="not complete, 1 of 3 parts are missing and part-0000001-.* is damaged"):
        jg.open_sweep(folder)
    seen = []
    resumed = run(mesh, output=folder, callback=lambda *progress: seen.append(progress))
    assert_same(table, resumed)
    assert parts[0].stat().st_mtime_ns == before
    assert seen == [(16, 40, None), (32, 40, None), (40, 40, None)]
    assert {path.name for path in folder.iterdir()} == {*(path.name for path in parts), "_sweep.parquet"}
    assert [record.getMessage() for record in caplog.records if record.name == "jaxgear"] == [
        f"{parts[1]}: is damaged or displaced, its variants are evaluated again"
    ]


def test_every_flipped_byte_and_every_swap_of_parts_is_found(mesh, table, folder, caplog):
    parts = parts_of(folder)
    manifest = load_manifest(folder)
    store = Store(folder, manifest)
    sound = parts[1].read_bytes()
    for place in range(0, len(sound), 29):  # data, footer and the names in it
        parts[1].write_bytes(sound[:place] + bytes([sound[place] ^ 0x10]) + sound[place + 1 :])
        assert store.unsound(parts) == [parts[1]]
    assert_same(table, run(mesh, output=folder))
    assert f"{parts[1]}: is damaged" in caplog.text
    first, second = (path.read_bytes() for path in parts[:2])
    parts[0].write_bytes(second), parts[1].write_bytes(first)
    with pytest.raises(ValueError, match="part-0000000-.* is damaged or displaced: repeat"):
        jg.open_sweep(folder)
    assert_same(table, run(mesh, output=folder))
    displaced = folder / parts[0].name.replace("part-0000000", "part-0000002")  # a good part at another's place
    parts[2].unlink()
    parts[0].rename(displaced)
    assert_same(table, run(mesh, output=folder))
    assert not displaced.exists() and parts_of(folder) == parts


def test_a_part_that_is_damaged_later_is_named(folder):
    table = jg.open_sweep(folder)
    part = parts_of(folder)[1]
    part.write_bytes(b"PAR1" + bytes(200))
    with pytest.raises(ValueError, match=rf"{part.name}: is damaged or missing: repeat the sweep"):
        table.column("ppte")


@pytest.mark.parametrize(
    "changes, named",
    [
        ({"plan": jg.Sobol(BOUNDS, 40, seed=6)}, "plan"),
        ({"torque": 51.0}, "design, torques_Nm"),  # the width of the contact depends on the torque
        ({"results": FEW[:2]}, "columns, results"),
        ({"part_rows": 20}, "part_rows"),
    ],
)
def test_a_folder_of_another_sweep_is_refused(mesh, folder, changes, named):
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(ValueError, match=rf"out: holds a sweep of other settings \({named}\), delete it or choose"):
        run(mesh, output=folder, **changes)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_another_design_or_mesh_is_another_sweep(mesh, folder):
    def other(x):
        return jg.TipRelief(x["pinion"], x["length"]), jg.TipRelief(x["wheel"], x["length"], jg.Linear())

    with pytest.raises(ValueError, match=r"other settings \(design\)"):
        jg.sweep(mesh, 50.0, other, PLAN, results=FEW, part_rows=16, output=folder)
    softer = eqx.tree_at(lambda m: m.structure, mesh, mesh.structure * (1 + 1e-12))
    with pytest.raises(ValueError, match=r"other settings \(mesh\)"):
        run(softer, output=folder)


@pytest.mark.parametrize(
    "options, problem",
    [
        ({"results": ()}, "results must be different and at least one"),
        ({"results": ("ppte", "ppte")}, "results must be different"),
        ({"results": ("noise",)}, '"noise" is not known'),
        ({"part_rows": 0}, "part_rows = 0 must be a whole number of at least 1"),
        ({"torque": -1.0}, "torque = -1 N m must be at least 0"),
    ],
)
def test_wrong_arguments_are_refused_before_anything_is_written(mesh, tmp_path, options, problem):
    with pytest.raises(ValueError, match=problem):
        run(mesh, output=tmp_path / "out", **options)
    assert not list(tmp_path.iterdir())


def test_a_parameter_may_not_have_the_name_of_another_column(mesh):
    plan = jg.Sobol({"ppte_um": (0.0, 1.0)}, 4, seed=0)
    with pytest.raises(ValueError, match='parameter "ppte_um" has the name of another column'):
        jg.sweep(mesh, 50.0, lambda x: (jg.TipRelief(x["ppte_um"], 2.0), None), plan)


@pytest.mark.parametrize(
    "torques, weights, problem",
    [
        ([], None, "at least one torque"),
        ([50.0, 50.0], None, "torques must be different"),
        ([50.0, 60.0], [1.0], "1 weights must be as many as the 2 torques"),
        ([50.0, 60.0], [1.0, -1.0], "weights = -1 must be at least 0"),
        ([50.0, 60.0], [0.0, 0.0], "sum of the weights = 0 must be greater than 0"),
    ],
)
def test_wrong_load_spectra_are_refused(torques, weights, problem):
    with pytest.raises(ValueError, match=problem):
        jg.LoadSpectrum(torques, weights)


def test_folders_that_cannot_be_used_are_refused(mesh, tmp_path):
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.tex").write_text("years of work")
    (tmp_path / "file").write_text("")
    for target, problem in (
        ("thesis", "holds other files than a sweep"),
        ("file", "is a file"),
        ("file/x", "cannot be"),
    ):
        with pytest.raises(ValueError, match=problem):
            run(mesh, output=tmp_path / target)
    with pytest.raises(ValueError, match="is not a sweep: _sweep.parquet: No such file"):
        jg.open_sweep(tmp_path)
    (tmp_path / "_sweep.parquet").write_text("PAR1")
    with pytest.raises(ValueError, match="is not a sweep: _sweep.parquet: is damaged"):
        jg.open_sweep(tmp_path)


@pytest.mark.parametrize("settings", ["null", "{}", '{"variants": null, "part_rows": 16}', "[1", '{"variants": -1}'])
def test_a_manifest_that_cannot_be_trusted_is_refused(mesh, folder, settings):
    path = folder / "_sweep.parquet"
    empty = parquet.read_table(path)
    notes = {**empty.schema.metadata, b"sweep": settings.encode()}
    parquet.write_table(empty.replace_schema_metadata(notes), path)
    for use in (lambda: jg.open_sweep(folder), lambda: run(mesh, output=folder)):
        with pytest.raises(ValueError, match="is not a sweep: _sweep.parquet: is damaged, or of another version"):
            use()


def test_summary_is_made_of_the_named_results(mesh):
    summary = jax.eval_shape(lambda mesh: jg.summary(jg.solve(mesh, 50.0)), mesh)
    assert set(summary) - {quantity.key for quantity in quantities.values()} == {"torque_Nm", "converged"}
    assert {"ppte_um", "max_line_load_N_per_mm", "mesh_loss_factor", "corner_contact_length_mm"} <= set(summary)


def test_removed_material_is_the_mean_over_the_path(mesh):
    inside = np.asarray(mesh.outside <= 0)
    removed = np.random.default_rng(0).random((2, 1, 16))
    cycle = jg.contact.solve_removed(mesh, 50.0, jnp.asarray(removed))
    assert float(quantities["removed_material"](cycle)) == pytest.approx(removed[inside].mean())
