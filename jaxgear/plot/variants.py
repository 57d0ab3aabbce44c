"""Tables of variants as the pictures of many variants read them: columns, units, and which way is better."""

import re
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from ..metrics import quantities

Table = Mapping[str, np.ndarray]
Labels = Mapping[str, str]

# unit as it stands in a column name, and in print
_UNITS = {
    "N_per_mm": "N/mm",
    "N_per_um": "N/µm",
    "um": "µm",
    "mm": "mm",
    "MPa": "MPa",
    "Nm": "N m",
    "N": "N",
    "W": "W",
    "deg": "deg",
    "degC": "°C",
    "rpm": "rpm",
    "Hz": "Hz",
    "percent": "%",
    "h": "h",
}
# what may follow the unit: the torque, or a statistic over torques and samples
_STATISTIC = r"_[-+.\de]+(?:Nm|rpm)|_mean|_worst|_q[.\d]+|_cvar[.\d]+"
_NAME = re.compile(rf"(?P<what>.+?)(_(?P<unit>{'|'.join(_UNITS)}))?(?P<of>({_STATISTIC})*)")


def label(name: str, labels: Labels | None = None) -> str:
    """Label of a column with its unit, "max flank pressure [MPa]" for `max_flank_pressure_MPa`.

    Args:
        name: of the column.
        labels: whole labels by the name of the column, which go before the ones derived from the names.
    """
    if labels and name in labels:
        return labels[name]
    match = _NAME.fullmatch(name)
    what, unit, of = (match["what"], _UNITS.get(match["unit"], "-"), match["of"]) if match else (name, "-", "")
    words = quantities[what].words if what in quantities else what.replace("_", " ")
    return f"{words}{_in_words(re.findall(_STATISTIC, of))} [{unit}]"


def _in_words(statistics: Sequence[str]) -> str:
    """Cases and statistics of a column: the last of several is over manufactured gears, one before it over torques."""
    texts = [re.sub(r"^([-+.\de]+)(Nm|rpm)$", lambda match: f"at {match[1]} {_UNITS[match[2]]}", one[1:])
             for one in statistics]  # fmt: skip
    over = [index for index, text in enumerate(texts) if not text.startswith("at ")]
    if over and len(texts) > 1:
        texts[over[-1]] += " over gears"
        texts[over[0]] += " over torques" if len(over) > 1 else ""
    return f" {', '.join(texts)}".rstrip()


def parts(text: str) -> tuple[str, str]:
    """A label in two: what it is, and its unit ("" for a pure number or none)."""
    match = re.fullmatch(r"(.*?)\s*\[(.*)\]", text)
    what, unit = (match[1], match[2]) if match else (text, "")
    return what, "" if unit == "-" else unit


def columns_of(owner: str, table: Table, names: Sequence[str], *, least: int = 1) -> np.ndarray:
    """Columns of a table side by side as floats, shape (variants, columns).

    Raises:
        ValueError: for a name that the table does not have, columns of different lengths or too few of them.
    """
    if len(names) < least:
        raise ValueError(f"{owner}: columns has {len(names)} names, must have at least {least}")
    for name in names:
        if name not in table:
            raise ValueError(f'{owner}: "{name}" is not a column of the table, must be one of {", ".join(table)}')
    columns = [np.asarray(table[name], float) for name in names]
    if len({column.shape for column in columns}) > 1 or columns[0].ndim != 1 or columns[0].size == 0:
        shapes = ", ".join(f"{name} {column.shape}" for name, column in zip(names, columns))
        raise ValueError(f"{owner}: columns must be lists of the same length and not empty, not {shapes}")
    return np.stack(columns, axis=1)


def costs(values: np.ndarray, names: Sequence[str], maximize: Collection[str]) -> np.ndarray:
    """The columns with their signs turned so that smaller is better in each."""
    return values * np.array([-1.0 if name in maximize else 1.0 for name in names])


def subsample(rows: np.ndarray, count: int) -> np.ndarray:
    """At most `count` of the rows, drawn without order or replacement, the same ones every time."""
    if rows.size <= count:
        return rows
    return np.sort(np.random.default_rng(0).choice(rows, count, replace=False))


def share_text(shown: int, total: int, failed: int = 0) -> str:
    """How many variants a picture shows of how many, and how many failed."""
    text = f"{total:,} variants" if shown >= total else f"{shown:,} of {total:,} variants"
    return text.replace(",", "\u2009") + (f", {failed} failed" if failed else "")
