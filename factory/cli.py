"""The command line: thin. Each command reads, calls the stages and writes; see the README."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from time import perf_counter
from typing import Any, TypeVar

import click

from factory import __version__
from factory.console import emit, fail, say, table, warn
from factory.errors import Diagnostic, FactoryError, InputError, MissingError, RunError, did_you_mean

F = TypeVar("F", bound=Callable[..., Any])

CONTEXT = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


def main(arguments: Sequence[str] | None = None) -> None:
    """The entry point: runs a command and exits with its status, never with a traceback."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    status = run_command(words)
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    sys.exit(status)


def run_command(words: list[str]) -> int:
    """The exit status of a command line: 0 ok, 1 a check or run failed, 2 bad input, 3 something is
    missing on the machine, 130 interrupted."""
    as_json = "--json" in words
    try:
        result = cli.main(words, prog_name="factory", standalone_mode=False)
        return result if isinstance(result, int) else 0
    except click.exceptions.Exit as done:
        return done.exit_code
    except click.ClickException as error:
        return fail(InputError(_usage(error)), as_json)
    except FactoryError as error:
        return fail(error, as_json)
    except (KeyboardInterrupt, click.Abort):
        return fail(_Interrupted(Diagnostic("Interrupted", "stopped by the user")), as_json)
    except BrokenPipeError:
        return 0
    except ImportError as error:
        return fail(_missing_package(error), as_json)
    except OSError as error:
        message = f"{error.filename or 'the system'}: {error.strerror or error}"
        hint = "check the path, its permissions and the space on the disk"
        return fail(InputError(Diagnostic("File", message, None, hint)), as_json)
    except RecursionError:
        message = "the input is nested too deeply"
        return fail(InputError(Diagnostic("Syntax", message, None, "flatten it")), as_json)


class _Interrupted(FactoryError):
    exit_status = 130


def _usage(error: click.ClickException) -> Diagnostic:
    """A usage error of click as a diagnostic."""
    hint = "see factory --help"
    context = getattr(error, "ctx", None)
    if context is not None:
        hint = f"see {context.command_path} --help"
    if isinstance(error, click.exceptions.NoSuchOption) and error.possibilities:
        hint = f"did you mean '{sorted(error.possibilities)[0]}'?"
    return Diagnostic("Usage", error.format_message().replace("\n", " "), None, hint)


def _missing_package(error: ImportError) -> MissingError:
    name = (error.name or "").partition(".")[0] or "a package"
    message = f"the Python package '{name}' cannot be imported: {error}"
    return MissingError(Diagnostic("Missing", message, None, f"pip install {name}"))


class _Commands(click.Group):
    """A group that suggests the nearest command."""

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            hint = did_you_mean(args[0], list(self.commands), "commands")
            raise InputError(Diagnostic("Usage", error.format_message(), None, hint)) from error


@click.group(cls=_Commands, context_settings=CONTEXT)
@click.version_option(__version__, prog_name="factory")
def cli() -> None:
    """Compile a product assembly graph (PAG) into a factory, prove it live, run it in MuJoCo."""


# --- options that several commands share --------------------------------------------------------


def _options(*decorators: Callable[[F], F]) -> Callable[[F], F]:
    def decorate(function: F) -> F:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return decorate


_OUTPUT = _options(
    click.option("--json", "as_json", is_flag=True, help="One JSON document on stdout."),
    click.option("-q", "--quiet", is_flag=True, help="No progress, no warnings."),
    click.option("-v", "--verbose", is_flag=True, help="Say more."),
)
_SOURCE = _options(
    click.argument("file", type=click.Path(path_type=Path)),
    click.option(
        "--templates",
        "folders",
        multiple=True,
        type=click.Path(path_type=Path),
        help="A folder of further operations, searched first (repeatable).",
    ),
)
_MOTION = _options(
    click.option("--speed", type=float, help="Speed of a robot [m/s]."),
    click.option("--acceleration", type=float, help="Acceleration of a robot [m/s²]."),
    click.option("--force", type=float, help="Actuator limit, as a multiple of what is needed."),
    click.option("--timestep", type=float, help="The engine's timestep [s]."),
    click.option("--substeps", type=click.IntRange(1), help="Timesteps in a supervisor's tick."),
)
_FLOOR = _options(
    click.option("--clearance", type=float, help="Least distance between things [m]."),
    click.option("--floor", help="Width x depth of the floor there is [m], as 4x3."),
)
_RUN = _options(
    click.option("--world", type=click.Choice(["mujoco", "ideal"]), default="mujoco"),
    click.option("--units", type=click.IntRange(1), default=1, help="Products to make."),
    click.option("--seed", type=click.IntRange(0), default=0),
    click.option("--jitter", type=click.FloatRange(0, 0.9), default=0.0,
                 help="Draw each robot's speed and gain within ± this share."),
    click.option("--wip", type=click.IntRange(1), help="Copies of each part let in at once."),
    click.option("--from", "start", help="Start from a legal marking: place names, comma-separated."),
    click.option("--max-time", type=float, help="Stop after this simulated time [s]."),
)
_PICTURE = _options(
    click.option("--size", default="1280x720", help="Of the picture, as 1280x720."),
    click.option("--fps", type=click.IntRange(1, 120), default=30),
    click.option("--camera", default="overview", help="overview, top or product."),
)


def _settings(file: Path, options: dict[str, Any]) -> Any:
    """Options before the `factory.toml` beside the PAG or in the current folder."""
    from factory.settings import load_settings

    names = ("speed", "acceleration", "force", "timestep", "substeps", "clearance")
    beside = file.parent / "factory.toml"
    settings = load_settings(beside if beside.is_file() else Path("factory.toml"))
    return settings.with_options({name: options.get(name) for name in names})


def _pair(text: str | None, option: str, example: str, number: type) -> tuple[Any, Any] | None:
    """`4x3` as two positive numbers."""
    if text is None:
        return None
    try:
        width, depth = (number(word) for word in text.lower().split("x"))
        if not (0 < width < float("inf") and 0 < depth < float("inf")):
            raise ValueError
    except ValueError:
        message = f"{option} takes two positive numbers, not '{text}'"
        raise InputError(Diagnostic("BadValue", message, None, f"for example {option} {example}")) from None
    return width, depth


def _plan(file: Path, folders: Sequence[Path], settings: Any, floor: str | None) -> tuple[Any, Any, Any]:
    """PAG to layout; warnings on stderr. Gives source, factory and layout."""
    from factory.geometry import product_geometry
    from factory.layout.embedding import lay_out
    from factory.pipeline import read

    source = read(file, folders)
    factory = source.compile()
    product = product_geometry(source.pag)
    room = _pair(floor, "--floor", "4x3", float)
    return source, factory, lay_out(factory, product, settings.clearance, room)


def _not_a_folder(path: Path | None) -> None:
    """An output file must be writable: its folder there, itself no folder."""
    if path is None:
        return
    if path.is_dir():
        raise InputError(Diagnostic("File", f"'{path}' is a folder", None, "give the name of a file"))
    if not path.parent.is_dir():
        message = f"the folder '{path.parent}' does not exist"
        raise InputError(Diagnostic("File", message, None, f"mkdir -p {path.parent}"))


# --- commands -----------------------------------------------------------------------------------


@cli.command()
@_SOURCE
@click.option("--certificate", type=click.Path(path_type=Path), help="Write the proof here.")
@click.option("--wip", type=click.IntRange(1), help="Copies of each part let in at once.")
@_OUTPUT
def check(
    file: Path,
    folders: tuple[Path, ...],
    certificate: Path | None,
    wip: int | None,
    as_json: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Parse, compile and prove FILE.pag (or a net in FILE.pnml)."""
    from factory.checking import check_file, describe

    _not_a_folder(certificate)
    checked = check_file(file, folders, wip)
    if certificate is not None:
        from factory.files import write_text

        write_text(certificate, checked.certificate())
    if as_json:
        emit(checked.as_json())
    elif not quiet:
        describe(checked, verbose)
    return 0 if checked.verdict.holds else 1


@cli.command()
@_SOURCE
@click.option("--mjcf", type=click.Path(path_type=Path), help="Write the model as one XML here.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Write everything in a folder.")
@click.option("--units", type=click.IntRange(1), help="Size the pool of parts for so many products.")
@click.option("--wip", type=click.IntRange(1), help="Copies of each part let in at once.")
@_FLOOR
@_MOTION
@_OUTPUT
def build(
    file: Path,
    folders: tuple[Path, ...],
    mjcf: Path | None,
    output: Path | None,
    units: int | None,
    wip: int | None,
    floor: str | None,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    **options: Any,
) -> int:
    """Compile, verify and lay out FILE.pag; write the MJCF model, the floor plan, the net."""
    from factory.building import build_all, refuse_unproved

    begin = perf_counter()
    _not_a_folder(mjcf)
    settings = _settings(file, options)
    source, factory, layout = _plan(file, folders, settings, floor)
    refuse_unproved(factory)
    spent = perf_counter() - begin
    warn(layout.product.warnings, quiet)
    built = build_all(source, layout, settings, mjcf, output, units, wip)
    document = {
        "product": source.pag.root,
        "mjcf": str(built.mjcf) if built.mjcf else None,
        "robots": len(factory.robots),
        "parts": built.model.bodies,
        "joints": built.model.joints,
        "welds": built.model.welds,
        "guidepath_length_m": round(layout.guidepath_length, 6),
        "area_m2": round(layout.area, 6),
        "compile_s": spent,
        "clearance": built.clearance,
        "files": [str(path) for path in built.files],
        "warnings": [d.as_json() for d in layout.product.warnings],
    }
    if as_json:
        emit(document)
    elif not quiet:
        say(f"{source.pag.root}: {document['robots']} robots, {document['parts']} bodies of parts, "
            f"{document['joints']} joints, {document['welds']} welds")
        say(f"floor {layout.area:.2f} m², guidepaths {layout.guidepath_length:.2f} m, "
            f"clearance {settings.clearance * 1000:g} mm proved")
        for path in built.files[:20]:
            say(f"  {path}")
    return 0


@cli.command()
@_SOURCE
@_RUN
@click.option("--video", type=click.Path(path_type=Path), help="Film the run (.mp4).")
@click.option("--log", type=click.Path(path_type=Path), help="Keep every tick in a file.")
@click.option("--distributed", is_flag=True, help="Each robot runs its own program (paper, section 6).")
@_PICTURE
@_FLOOR
@_MOTION
@_OUTPUT
def run(
    file: Path,
    folders: tuple[Path, ...],
    video: Path | None,
    log: Path | None,
    floor: str | None,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    **options: Any,
) -> int:
    """Run FILE.pag until its products are dropped off."""
    from factory.running import run_file

    for path in (video, log):
        _not_a_folder(path)
    settings = _settings(file, options)
    source, factory, layout = _plan(file, folders, settings, floor)
    warn(layout.product.warnings, quiet)
    size = _pair(options["size"], "--size", "1280x720", int)
    record = run_file(source, layout, settings, video, log, size, quiet or as_json, options)
    if as_json:
        document = record.as_json()
        document.pop("schema")
        trouble = [record.trouble.as_json()] if record.trouble else []
        emit({**document, **({"errors": trouble} if trouble else {})})
    elif not quiet:
        from factory.running import summarise

        summarise(record, factory, verbose)
    if record.trouble is not None:
        print(record.trouble, file=sys.stderr)
    return 1 if record.trouble is not None or not record.refines_net else 0


@cli.command()
@_SOURCE
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True,
              help="OUT.mp4, or OUT.png for a still.")
@click.option("--at", default="end", help="Time of a still [s], or `end`.")
@_RUN
@_PICTURE
@_FLOOR
@_MOTION
@_OUTPUT
def render(
    file: Path,
    folders: tuple[Path, ...],
    output: Path,
    at: str,
    floor: str | None,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    **options: Any,
) -> int:
    """Film FILE.pag, or a LOG that `run --log` has kept, headless through EGL."""
    from factory.running import render_file

    _not_a_folder(output)
    size = _pair(options["size"], "--size", "1280x720", int)
    document = render_file(file, folders, output, at, floor, size, quiet or as_json, options)
    if as_json:
        emit(document)
    elif not quiet:
        say(f"{output}: {document['frames']} frames of {document['width']}x{document['height']}, "
            f"{document['seconds']:.1f} s")
    return 0


@cli.command()
@_SOURCE
@click.option("--robot", help="Only this robot, as r3.")
@_OUTPUT
def programs(
    file: Path,
    folders: tuple[Path, ...],
    robot: str | None,
    as_json: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Print each robot's program, in the paper's form."""
    from factory.pipeline import read
    from factory.programs import program_of, write_program

    factory = read(file, folders).compile()
    names = [r.name for r in factory.robots]
    if robot is not None and robot not in names:
        hint = did_you_mean(robot, names, "robots")
        raise InputError(Diagnostic("Usage", f"there is no robot '{robot}'", None, hint))
    chosen = [r for r in factory.robots if robot in (None, r.name)]
    texts = {r.name: write_program(program_of(factory, r.index)) for r in chosen}
    if as_json:
        emit({"programs": texts})
    else:
        say("\n\n".join(texts.values()))
    return 0


@cli.command()
@_SOURCE
@click.option("--format", "form", required=True, help="pnml or dot.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="A file; stdout without.")
@_OUTPUT
def export(
    file: Path,
    folders: tuple[Path, ...],
    form: str,
    output: Path | None,
    as_json: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Write the net of FILE.pag for other tools."""
    from factory.export import exporters
    from factory.files import write_text
    from factory.pipeline import read

    known = exporters()
    if form not in known:
        hint = did_you_mean(form, list(known), "formats")
        raise InputError(Diagnostic("Usage", f"unknown format '{form}'", None, hint))
    _not_a_folder(output)
    text = known[form](read(file, folders).compile())
    if output is not None:
        write_text(output, text)
    if as_json:
        emit({"format": form, "output": str(output) if output else None,
              **({} if output else {"text": text})})
    elif output is None:
        say(text.rstrip("\n"))
    return 0


@cli.command()
@click.option("--templates", "folders", multiple=True, type=click.Path(path_type=Path))
@_OUTPUT
def templates(folders: tuple[Path, ...], as_json: bool, quiet: bool, verbose: bool) -> int:
    """List the operations and robot types there are."""
    from factory.lang.template_writer import write_template
    from factory.pipeline import all_templates
    from factory.robots import load_catalogue

    found, catalogue = all_templates(folders), load_catalogue()
    if as_json:
        emit({
            "templates": [
                {
                    "name": t.name,
                    "robots": list(t.robots),
                    "carrier": t.carrier,
                    "inputs": len(t.inputs),
                    "further": t.further or None,
                    "parameters": dict(t.parameters),
                    "geometry": t.geometry,
                    "text": write_template(t),
                }
                for t in found.values()
            ],
            "robots": [
                {"name": r.name, "extends": r.extends or None, "summary": r.summary}
                for r in catalogue.types.values()
            ],
        })
        return 0
    rows = (
        (t.name, f"< {', '.join(t.robots)} >", f"{len(t.inputs)}{'+' if t.further else ''}",
         ", ".join(f"{k} = {v}" for k, v in t.parameters) or ("geometry" if t.geometry else ""))
        for t in found.values()
    )
    table("Operations", ("name", "robots", "inputs", "parameters"), rows)
    table("Robot types", ("name", "extends", "what it is"),
          ((r.name, r.extends, r.summary) for r in catalogue.types.values()))
    if verbose:
        for template in found.values():
            say(write_template(template))
    return 0


@cli.command()
@_OUTPUT
def doctor(as_json: bool, quiet: bool, verbose: bool) -> int:
    """Say what works on this machine, and what would mend the rest."""
    from factory.doctor import examine

    findings = examine()
    good = all(f.ok for f in findings)
    if as_json:
        emit({"ok": good, "checks": [
            {"name": f.name, "ok": f.ok, "found": f.found, "mend": f.mend} for f in findings
        ]})
    else:
        for finding in findings:
            say(f"{'ok     ' if finding.ok else 'MISSING'} {finding.name}: {finding.found}")
            if not finding.ok:
                say(f"        {finding.mend}")
    return 0 if good else 3


__all__ = ["RunError", "cli", "main", "run_command"]
