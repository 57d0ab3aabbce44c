"""Table of the throughput benchmark and the machine it was measured on."""

import platform
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

_COLUMNS = ("threads", "variants/s", "median", "/ C", "/ NumPy", "/core", "cold start", "compile", "memory")
_DIFFERENCES = ("PPTE", "gradient")
_LEGEND = """\
variants/s: the best repetition. / C, / NumPy: over their best rate with as many slices, C on all cores, NumPy on one.
/core: variants per second of processor time, less sensitive to other work on the machine. cold start, compile: seconds
from the start of the process and from the first call to the first result. coupled, helical: other problems, of coupled
slices and of helical gears with the pairs that they need; the lines tell what that costs. memory: peak in MiB. PPTE,
gradient: largest difference from jaxgear in float64 (of other problems from itself), in um and in um per um or mm."""


def machine(cores: int) -> dict[str, str]:
    """Processor, usable cores and system."""
    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = (line.partition(":") for line in info.read_text().splitlines())
        model = next((value.strip() for key, _, value in lines if key.strip() == "model name"), model)
    return {"processor": model, "cores": str(cores), "system": platform.system()}


def print_rates(rows, host: dict[str, str], *, has_compiler: bool) -> None:
    """One line per contender; ratios are to C and to NumPy with as many slices, without gradient."""
    console = Console(width=160)
    console.print(", ".join(f"{key} {value}" for key, value in host.items()), markup=False, highlight=False)
    table = Table()
    table.add_column("slices")
    table.add_column("contender", no_wrap=True)
    for title in (*_COLUMNS, *_DIFFERENCES):
        table.add_column(title, justify="right")
    for slices in sorted({row.contender.slices for row in rows}):
        group = [row for row in rows if row.contender.slices == slices]
        base = {kind: _fastest(group, kind) for kind in ("C", "NumPy")}
        for row in group:
            gradient = "" if row.gradient_difference is None else f"{row.gradient_difference:.0e}"
            table.add_row(
                str(slices),
                row.contender.name,
                str(row.contender.threads),
                _digits(row.rate),
                _digits(float(np.median(row.rates))),
                *(f"{row.rate / base[kind]:.3g}" if base[kind] else "" for kind in base),
                _digits(max(row.core_rates)),
                f"{row.cold_start:.1f}",
                f"{row.compilation:.1f}" if row.contender.kind == "jaxgear" else "",
                f"{row.memory:.0f}",
                f"{row.difference:.0e}",
                gradient,
            )
        table.add_section()
    console.print(table)
    console.print(_LEGEND, highlight=False)
    if not has_compiler:
        console.print("No C compiler found (cc, gcc, clang or $CC): the C kernel did not take part.", highlight=False)


def _fastest(group, kind: str) -> float | None:
    rates = [row.rate for row in group if row.contender.kind == kind and not row.contender.gradient]
    return max(rates, default=None)


def _digits(value: float) -> str:
    """Three significant digits with thousands apart."""
    return f"{float(f'{value:.3g}'):,.0f}"
