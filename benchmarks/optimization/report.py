"""Table of the comparison, what is seen in it, and what has to hold."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from rich.console import Console
from rich.table import Table

_WIDTH = 160
_COLUMNS = (
    ("PPTE", "um"),
    ("over torque", "um"),
    ("95 % of gears", "um"),
    ("pressure", "MPa"),
    ("relief", "um"),
    ("analyses", ""),
    ("cold", "s"),
    ("warm", "s"),
)
_LEGEND = """\
PPTE: at the design torque. over torque: worst from half to twice the design torque. 95 % of gears: as many of the
manufactured gears of ISO 1328 class 5 stay below. pressure, relief: largest of contact, and material removed. All of
this on a mesh finer than that of the search. analyses: contact analyses spent, one with its gradient counted as three,
those of earlier stages included. cold, warm: wall time of the first call, with the compilation of what no row above
has compiled, and of the second."""


@dataclass(frozen=True)
class Row:
    """A method on a pair; every quantity carries its unit."""

    pair: str
    method: str
    ppte_um: float
    worst_over_torque_um: float
    quantile95_um: float
    max_pressure_MPa: float
    max_relief_um: float
    evaluations: int
    steps: int | None
    cold_s: float
    warm_s: float


class Rows:
    """Rows by pair and method; asking for one that did not take part raises a `KeyError`."""

    def __init__(self, rows: Sequence[Row]):
        self._rows = {(row.pair, row.method): row for row in rows}

    def __call__(self, pair: str, method: str) -> Row:
        """The row of a method."""
        return self._rows[pair, method]


@dataclass(frozen=True)
class Claim:
    """What the README claims; `holds` is None where a method did not take part."""

    text: str
    holds: bool | None


def print_table(rows: Sequence[Row], host: dict[str, str]) -> None:
    """One line per method, pairs apart."""
    console = Console(width=_WIDTH)
    console.print(", ".join(f"{key} {value}" for key, value in host.items()), markup=False, highlight=False)
    table = Table()
    table.add_column("pair")
    table.add_column("method", no_wrap=True)
    for title, unit in _COLUMNS:
        table.add_column(f"{title}\n{unit}" if unit else title, justify="right")
    for pair in dict.fromkeys(row.pair for row in rows):
        for row in (row for row in rows if row.pair == pair):
            table.add_row(
                pair,
                row.method,
                f"{row.ppte_um:.3f}",
                f"{row.worst_over_torque_um:.2f}",
                f"{row.quantile95_um:.2f}",
                f"{row.max_pressure_MPa:.0f}",
                f"{row.max_relief_um:.2f}",
                f"{row.evaluations:,}",
                f"{row.cold_s:.1f}",
                f"{row.warm_s:.2f}",
            )
        table.add_section()
    console.print(table)
    console.print(_LEGEND, markup=False, highlight=False)


def findings(rows: Sequence[Row]) -> list[str]:
    """What is seen, one sentence each, of the methods that took part."""
    of = Rows(rows)
    lines = []
    for pair in dict.fromkeys(row.pair for row in rows):
        for sentence in (_against_genetic, _against_named_curves, _robust, _iterations):
            try:
                lines.append(f"{pair}: {sentence(of, pair)}")
            except KeyError:
                continue
    return lines


def claims(rows: Sequence[Row]) -> list[Claim]:
    """What the README claims about these rows."""
    of = Rows(rows)

    def claim(text: str, holds: Callable[[], bool]) -> Claim:
        try:
            return Claim(text, bool(holds()))
        except KeyError:
            return Claim(text, None)

    a, b = "50/50", "19/48"
    levelled = "{} iteration: PPTE at least 75 % lower in at most 5 steps with at most 7 um of relief"

    def levels(method: str) -> bool:
        row = of(a, method)
        few = row.steps is not None and row.steps <= 5
        return few and row.ppte_um <= 0.25 * of(a, "unmodified").ppte_um and row.max_relief_um <= 7.0 + 1e-6

    def against(pair: str) -> list[Claim]:
        return [
            claim(
                f"{pair}, slp: PPTE at most 1 % above that of the genetic algorithm",
                lambda: of(pair, "slp").ppte_um <= 1.01 * of(pair, "genetic").ppte_um,
            ),
            claim(
                f"{pair}, slp: less than 2 % of the contact analyses of the genetic algorithm",
                lambda: of(pair, "slp").evaluations < 0.02 * of(pair, "genetic").evaluations,
            ),
            claim(
                f"{pair}, free form: PPTE at least 30 % below that of slp",
                lambda: of(pair, "free form").ppte_um <= 0.7 * of(pair, "slp").ppte_um,
            ),
        ]

    return [
        *against(a),
        *against(b),
        claim(f"{a}, " + levelled.format("type 1"), lambda: levels("iteration, type 1")),
        claim(f"{a}, " + levelled.format("type 2"), lambda: levels("iteration, type 2")),
        claim(
            f"{a}, type 2 iteration: lower largest contact pressure than type 1",
            lambda: of(a, "iteration, type 2").max_pressure_MPa < of(a, "iteration, type 1").max_pressure_MPa,
        ),
    ]


def _against_genetic(of: Rows, pair: str) -> str:
    genetic, slp = of(pair, "genetic"), of(pair, "slp")
    share = 100 * slp.evaluations / genetic.evaluations
    return (
        f"slp reaches {slp.ppte_um / genetic.ppte_um:.3f} times the PPTE of the genetic algorithm with "
        f"{share:.2g} % of its contact analyses, {genetic.warm_s / slp.warm_s:.2g} times as fast once compiled."
    )


def _against_named_curves(of: Rows, pair: str) -> str:
    free, named = of(pair, "free form"), of(pair, "slp")
    cubic, power = of(pair, "free form as cubic"), of(pair, "free form as power")
    return (
        f"free flanks reach {free.ppte_um:.3f} um, {_change(free.ppte_um, named.ppte_um)} slp with its named "
        f"curve; replaced by a cubic they give {cubic.ppte_um:.3f} um, by a power {power.ppte_um:.3f} um."
    )


def _robust(of: Rows, pair: str) -> str:
    robust, sharp = of(pair, "robust slp"), of(pair, "slp")
    return (
        f"the robust design keeps 95 % of the gears {_change(robust.quantile95_um, sharp.quantile95_um)} the design "
        f"for nominal gears ({robust.quantile95_um:.2f} and {sharp.quantile95_um:.2f} um), its worst PPTE over torque "
        f"{_change(robust.worst_over_torque_um, sharp.worst_over_torque_um)}, its nominal PPTE {robust.ppte_um:.3f} um."
    )


def _iterations(of: Rows, pair: str) -> str:
    unmodified = of(pair, "unmodified")
    first, second = of(pair, "iteration, type 1"), of(pair, "iteration, type 2")

    def said(row: Row) -> str:
        cut = 100 * (1 - row.ppte_um / unmodified.ppte_um)
        return f"{cut:.0f} % in {row.steps} steps at {row.max_pressure_MPa:.0f} MPa"

    return (
        f"the transmission-error iteration lowers PPTE by {said(first)} from the involute and by {said(second)} from "
        f"the relief of least pressure (unmodified: {unmodified.max_pressure_MPa:.0f} MPa)."
    )


def _change(value: float, reference: float) -> str:
    share = 100 * (value / reference - 1)
    return f"{abs(share):.0f} % {'below' if share < 0 else 'above'}"
