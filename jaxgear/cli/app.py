"""The commands with their options, and the promise that every failure is one line.

JAX and the library are imported when a command runs: help, version and what is wrong with the options need neither.
"""

import inspect
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from ..io.first_look import check_keys, known_methods
from ..provided import provided
from ..studies import registry
from ..version import version as own_version
from . import interrupt, streams

Quick = Annotated[
    bool, typer.Option("--quick", help="Coarse positions and a short search: for a first look, not for a result.")
]
OK, NOT_CONVERGED, FAILED, INTERRUPTED = 0, 1, 2, 130


class _Commands(TyperGroup):
    """All commands: built-in ones, and the studies of entry points, which are searched if a name is unknown."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names for the help."""
        return list(dict.fromkeys([*super().list_commands(ctx), *provided("commands"), *registry.provided()]))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of a name; None for an unknown one."""
        found = super().get_command(ctx, cmd_name)
        place = registry.OWN.get(cmd_name) if found else registry.provided().get(cmd_name)
        if found is None and (function := command_of(place, cmd_name, _plain) if place else _named(cmd_name)):
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
    planetary: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="A planetary stage with N planets; the teeth are those of sun and planets.", min=2
        ),
    ] = None,
    ring: Annotated[bool, typer.Option("--ring", help="The wheel is a ring gear.")] = False,
) -> int:
    """Write a commented design file for a pair, ready for `analyze` and `optimize`.

    A file that is there is never replaced.
    """
    given = locals()
    with interrupt.importing():
        from .new import new
    new(given.pop("file"), planets=given.pop("planetary"), **given)
    return OK


def _look_at(file: Path) -> None:
    """Report a misspelt key before the import of JAX, which takes seconds."""
    if "jax" not in sys.modules:
        check_keys(file)


def command_of(place: str, name: str, own: Callable[..., Mapping[str, Any]]) -> Callable[..., int]:
    """Command of a study, with its own arguments and options among those of all studies.

    Args:
        place: place of its class, as `module:class`.
        name: name of the command.
        own: function of its own arguments and options that gives the arguments of `AbstractStudy.of`.
    """
    folder = _FOLDERS.get(name, name)

    def shared(
        context: typer.Context,
        file: Annotated[Path, typer.Argument(metavar="FILE.toml", help="Design file.", show_default=False)],
        output: Annotated[
            Path | None,
            typer.Option("--output", "-o", metavar="DIR", help="Result folder.", show_default=f"results/FILE/{folder}"),
        ] = None,
        no_figures: Annotated[bool, typer.Option("--no-figures", help="Write no figures.")] = False,
        reported: Annotated[
            bool,
            typer.Option("--report", help="Write report.html too, a self-contained file (needs jaxgear\\[report])."),
        ] = False,
        no_cache: Annotated[
            bool, typer.Option("--no-cache", envvar="JAXGEAR_NO_CACHE", help="Do not keep compiled programs on disk.")
        ] = False,
    ) -> Mapping[str, Any]:
        return {
            "file": file,
            "output": output,
            "figures": not no_figures,
            "cache": not no_cache,
            "command": list(context.obj) if reported else None,
        }

    def command(**given: Any) -> int:
        if place.startswith("jaxgear."):
            _look_at(given["file"])
        options = own(**{key: given.pop(key) for key in inspect.signature(own).parameters})
        with interrupt.importing():
            from . import run

            study = registry.load(place)
        return OK if run.run_study(study, options, **shared(**given)) else NOT_CONVERGED

    (context, file, output, *flags), of_study = (
        [*inspect.signature(function).parameters.values()] for function in (shared, own)
    )
    required = [one for one in of_study if one.default is one.empty]
    optional = [one for one in of_study if one.default is not one.empty]
    keywords = [one.replace(kind=one.KEYWORD_ONLY) for one in (context, file, *required, output, *optional, *flags)]
    command.__signature__ = inspect.Signature(keywords)  # type: ignore[attr-defined]
    command.__annotations__ = {one.name: one.annotation for one in keywords}
    return command


def _analyze() -> dict[str, Any]:
    return locals()


def _plain(quick: Quick = False) -> dict[str, Any]:
    return locals()


def _optimize(
    method: Annotated[
        str | None,
        typer.Option("--method", "-m", metavar="NAME", help=f"In place of the file's: {', '.join(known_methods())}."),
    ] = None,
    quick: Quick = False,
) -> dict[str, Any]:
    return locals()


def _sweep(
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
) -> dict[str, Any]:
    with interrupt.importing():
        from . import jax_setup
    jax_setup.use_all_cores()
    jax_setup.join_processes(coordinator, processes, process, automatic=distributed)
    return {"samples": samples, "best": best, "quick": quick}


_FOLDERS = {"optimize": "optimize/METHOD"}
_OWN: Mapping[str, Callable[..., Mapping[str, Any]]] = {
    "analyze": _analyze,
    "optimize": _optimize,
    "sweep": _sweep,
}
for _name, _place in registry.OWN.items():
    app.command(_name)(command_of(_place, _name, _OWN.get(_name, _plain)))


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
        if code == INTERRUPTED or interrupt.state.requested:
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
        if interrupt.state.requested:  # a library has made something else of it
            return _say_interrupted()
        print(f"jaxgear: error: {streams.one_line(error)}", file=sys.stderr)
        if isinstance(error, OSError):
            streams.forget_output()
        return FAILED
    return code or OK


def _say_interrupted() -> int:
    print(f"jaxgear: interrupted, {interrupt.state.written}", file=sys.stderr)
    return INTERRUPTED
