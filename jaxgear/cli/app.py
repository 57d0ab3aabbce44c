"""The commands with their options, and the promise that every failure is one line.

JAX and the library are imported when a command runs: help, version and what is wrong with the options need neither.
"""

import os
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from ..io.first_look import check_keys
from ..provided import provided
from ..studies import registry
from ..version import version as own_version
from . import interrupt, streams
from .options import File, NoCache, NoFigures, Quick, Reported, output_option, typed

# of `optimize.METHODS` and of the search for flanks without parameters, as a test makes sure
METHODS = "slp, adam, lbfgs, genetic, cma_es, differential_evolution, factorial, te_iteration, free_form"

OK, NOT_CONVERGED, FAILED, INTERRUPTED = 0, 1, 2, 130


class _Commands(TyperGroup):
    """The commands, with those and the studies that entry points name, which are looked for where a name is unknown."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names for the help."""
        return list(dict.fromkeys([*super().list_commands(ctx), *provided("commands"), *registry.provided()]))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of a name; None for an unknown one."""
        found = super().get_command(ctx, cmd_name)
        place = registry.own().get(cmd_name) if found else registry.provided().get(cmd_name)
        if found is None and (function := _study(place, cmd_name) if place else _named(cmd_name)):
            alone = typer.Typer(add_completion=False)
            alone.command(cmd_name, help=_unbroken(function))(function)
            found = typer.main.get_command(alone)
        if found is not None and place is not None:
            found.help = registry.help_of(place)
        return found


app = typer.Typer(
    cls=_Commands,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Flank design of involute gears by loaded tooth contact analysis. Exit codes: 0 success, 1 a contact solution "
    "did not converge or a constraint is not met (results are written and flagged), 2 error (nothing is written), "
    "130 interrupted (a sweep resumes). Begin with jaxgear new. Guides: examples/guides/index.md of the source; "
    "python -m jaxgear.io prints every table and key of a design file.",
)


def _named(name: str) -> Callable[..., Any] | None:
    """The function of a command that an entry point names; None for an unknown one."""
    entry = provided("commands").get(name)
    return entry.load() if entry else None


def _unbroken(function: object) -> str:
    """Docstring of a command: the terminal breaks the lines of a paragraph, not the source."""
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in (function.__doc__ or "").split("\n\n"))


def _show_version(wanted: bool) -> None:
    if wanted:
        print(f"jaxgear {own_version()}")
        raise typer.Exit()


@app.callback()
def root(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Options of the command itself."""


@app.command()
def new(
    file: Annotated[Path, typer.Argument(metavar="FILE.toml", help="Design file to write.", show_default=False)],
    teeth: Annotated[tuple[int, int], typer.Option(metavar="Z1 Z2", help="Teeth of pinion and wheel.")],
    module: Annotated[float, typer.Option(metavar="MM", help="Module in mm.", show_default=False)],
    torque: Annotated[float, typer.Option(metavar="NM", help="Torque on the pinion in N m.", show_default=False)],
    face_width: Annotated[float, typer.Option(metavar="MM", help="Face width in mm.", show_default=False)],
    speed: Annotated[float | None, typer.Option(metavar="RPM", help="Speed of the pinion in rpm.")] = None,
    helix_angle: Annotated[
        float, typer.Option(metavar="DEG", help="Helix angle of the pinion in degrees, positive for a right hand.")
    ] = 0.0,
    pressure_angle: Annotated[
        float, typer.Option(metavar="DEG", help="Normal pressure angle of the basic rack in degrees.")
    ] = 20.0,
    profile_shift: Annotated[
        tuple[float, float], typer.Option(metavar="X1 X2", help="Profile shifts of pinion and wheel in modules.")
    ] = (0.0, 0.0),
) -> int:
    """Write a commented design file for a pair, which analyze and optimize take as it is.

    A file that is there is never replaced.
    """
    with interrupt.importing():
        from .new import new
    new(
        file,
        teeth,
        module=module,
        torque=torque,
        face_width=face_width,
        speed=speed,
        helix_angle=helix_angle,
        pressure_angle=pressure_angle,
        profile_shift=profile_shift,
    )
    return OK


def run_place(
    place: str,
    context: typer.Context,
    file: Path,
    output: Path | None,
    *,
    no_figures: bool,
    reported: bool,
    no_cache: bool,
    **options: Any,
) -> int:
    """Runs the command of a study.

    Args:
        place: of its class, as `module:class`.
        context: of the command line.
        file, output, no_figures, reported, no_cache: options that all studies have.
        options: further ones of this study.
    """
    if place.startswith("jaxgear."):
        _look_at(file)
    with interrupt.importing():
        from . import run

        study = registry.load(place)
    shared: dict[str, Any] = {"figures": not no_figures, "cache": not no_cache, "command": typed(context, reported)}
    return OK if run.run_study(partial(study.of, **options), file, output, **shared) else NOT_CONVERGED


def _look_at(file: Path) -> None:
    """Reports a misspelt key before JAX is imported, which takes seconds."""
    if "jax" not in sys.modules:
        check_keys(file)


def _study(place: str, name: str) -> Callable[..., int]:
    """The command of a study without options of its own.

    Args:
        place: of its class, as `module:class`.
        name: of the command.
    """

    def command(
        context: typer.Context,
        file: File,
        output: Annotated[Path | None, output_option(name)] = None,
        quick: Quick = False,
        no_figures: NoFigures = False,
        reported: Reported = False,
        no_cache: NoCache = False,
    ) -> int:
        shared = {"no_figures": no_figures, "reported": reported, "no_cache": no_cache}
        return run_place(place, context, file, output, **shared, quick=quick)

    return command


@app.command()
def analyze(
    context: typer.Context,
    file: File,
    output: Annotated[Path | None, output_option("analyze")] = None,
    no_figures: NoFigures = False,
    reported: Reported = False,
    no_cache: NoCache = False,
) -> int:
    """Analyze the unmodified pair and the modification of the design file."""
    shared = {"no_figures": no_figures, "reported": reported, "no_cache": no_cache}
    return run_place("jaxgear.studies.design_analysis:DesignAnalysis", context, file, output, **shared)


@app.command()
def optimize(
    context: typer.Context,
    file: File,
    output: Annotated[Path | None, output_option("optimize/METHOD")] = None,
    method: Annotated[
        str | None, typer.Option("--method", "-m", metavar="NAME", help=f"In place of the file's: {METHODS}, pareto.")
    ] = None,
    quick: Quick = False,
    no_figures: NoFigures = False,
    reported: Reported = False,
    no_cache: NoCache = False,
) -> int:
    """Find the best variables or flanks by the method and for the objective of the design file.

    Without a word about them that is the least peak-to-peak transmission error (PPTE) at the design torque. Compares
    the unmodified pair, the rule-based tip relief of ISO 6336-1, and the optimum.
    """
    shared = {"no_figures": no_figures, "reported": reported, "no_cache": no_cache}
    place = "jaxgear.studies.optimization:DesignOptimization"
    return run_place(place, context, file, output, **shared, method=method, quick=quick)


for _name, _place in registry.own().items():
    app.command(_name)(_study(_place, _name))


@app.command()
def sweep(
    context: typer.Context,
    file: File,
    output: Annotated[Path | None, output_option("sweep")] = None,
    samples: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Number of variants in place of the file's.")
    ] = None,
    best: Annotated[int, typer.Option(min=1, metavar="N", help="How many of the best designs to list.")] = 10,
    coordinator: Annotated[
        str | None, typer.Option(metavar="HOST:PORT", help="Share the sweep among processes: where number 0 listens.")
    ] = None,
    processes: Annotated[int | None, typer.Option(min=1, metavar="N", help="How many processes there are.")] = None,
    process: Annotated[int | None, typer.Option(min=0, metavar="I", help="Number of this one, from 0.")] = None,
    distributed: Annotated[
        bool, typer.Option("--distributed", help="Share the sweep among the processes of a cluster job (Slurm, MPI).")
    ] = False,
    quick: Quick = False,
    no_figures: NoFigures = False,
    reported: Reported = False,
    no_cache: NoCache = False,
) -> int:
    """Evaluate the variants that the design file asks for, any number of them, into a table of Parquet files.

    The folder "table" of the results holds it and nothing else: pandas, polars and Arrow read it as a whole. An
    interrupted sweep goes on where it was when the command is repeated.
    """
    _look_at(file)
    with interrupt.importing():
        from . import devices, sweep
    devices.use_all_cores()
    devices.join_processes(coordinator, processes, process, automatic=distributed)
    fine = sweep.run_sweep(
        file,
        output,
        samples=samples,
        best=best,
        quick=quick,
        figures=not no_figures,
        cache=not no_cache,
        command=typed(context, reported),
    )
    return OK if fine else NOT_CONVERGED


for _command in app.registered_commands:
    _command.help = _unbroken(_command.callback)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Entry point of the command `jaxgear`; every failure is one line on stderr."""
    streams.silence_compiler()
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a title beyond the terminal's alphabet is no reason to fail
    with interrupt.listening(), streams.warnings():
        code = _code_of(arguments)
    sys.exit(code)


def _code_of(arguments: Sequence[str] | None) -> int:
    try:
        given = sys.argv[1:] if arguments is None else list(arguments)
        code = app(args=given, obj=given, prog_name="jaxgear", standalone_mode=False)
        sys.stdout.flush()  # what cannot be written is known here, not when the interpreter ends
        if code == INTERRUPTED or interrupt.state.asked:
            return _say_interrupted()
    except (KeyboardInterrupt, typer.Abort):
        return _say_interrupted()
    except BrokenPipeError:
        streams.forget_output()
        return OK
    except SystemExit as end:  # raised by typer where the reader of its help closes the pipe early
        if isinstance(end.__context__, BrokenPipeError):
            return OK
        raise
    except Exception as error:  # noqa: BLE001 - a user never sees a traceback
        if os.environ.get("JAXGEAR_DEBUG"):
            raise
        if interrupt.state.asked:  # a library has made something else of it
            return _say_interrupted()
        print(f"jaxgear: error: {streams.one_line(error)}", file=sys.stderr)
        if isinstance(error, OSError):
            streams.forget_output()
        return FAILED
    return code or OK


def _say_interrupted() -> int:
    print(f"jaxgear: interrupted, {interrupt.state.written}", file=sys.stderr)
    return INTERRUPTED
