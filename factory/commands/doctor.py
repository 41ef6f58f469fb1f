"""The command `doctor`: what works on this machine, and a command that repairs the rest."""

from __future__ import annotations

import platform
import sys
from dataclasses import dataclass

import click

from factory.commands.options import OUTPUT
from factory.commands.requests import OutputOptions
from factory.support.console import emit, say
from factory.support.errors import FactoryError
from factory.support.namesake import MEND, clash
from factory.support.version import EXTRAS, installs, release

PACKAGES = (
    "mujoco",
    "numpy",
    "networkx",
    "lark",
    "trimesh",
    "scipy",
    "shapely",
    "manifold3d",
    "imageio",
    "av",
    "pillow",
    "click",
    "rich",
)


@click.command()
@OUTPUT
def doctor(out: OutputOptions) -> int:
    """Report what works on this machine, and how to repair the rest."""
    findings = examine()
    good = all(f.ok for f in findings)
    extras = [_extra(name) for name in EXTRAS]
    filament = _filament() if good else Finding("filament", False, "", "repair the rest first")
    if out.as_json:
        emit(
            {
                "ok": good,
                "checks": [
                    {"name": f.name, "ok": f.ok, "found": f.found, "mend": f.mend} for f in findings
                ],
                "extras": [
                    {"name": f.name, "for": EXTRAS[f.name][1], "installed": f.ok, "mend": f.mend}
                    for f in extras
                ],
                "filament": {"ok": filament.ok, "mend": filament.mend},
            }
        )
    else:
        for finding in findings:
            say(f"{'ok     ' if finding.ok else 'FAULTY '} {finding.name}: {finding.found}")
            if not finding.ok:
                say(f"        {finding.mend}")
        say("optional extras:")
        for extra in extras:
            here = extra.found if extra.ok else f"not installed: {extra.mend}"
            say(f"  {extra.name:10} {EXTRAS[extra.name][1]}: {here}")
        say(f"renderer filament: {filament.found if filament.ok else filament.mend}")
    return 0 if good else 3


@dataclass(frozen=True, slots=True)
class Finding:
    """One check: its result, what was found, and a command that repairs it."""

    name: str
    ok: bool
    found: str
    mend: str = ""


def examine() -> list[Finding]:
    """The checks: Python, packages, assets, the engine and headless rendering."""
    engine = _engine()
    rendering = _rendering() if engine.ok else Finding("rendering", False, "no engine", engine.mend)
    return [_python(), _name(), *map(_package, PACKAGES), _assets(), engine, rendering]


def _python() -> Finding:
    good = sys.version_info >= (3, 11)
    return Finding("python", good, platform.python_version(), "install Python 3.11 or newer")


def _name() -> Finding:
    wrong = clash()
    return Finding("import name", not wrong, wrong or "factory is this package", MEND)


def _package(name: str) -> Finding:
    if version := release(name):
        return Finding(name, True, version)
    return Finding(name, False, "not installed", f"pip install {name}")


def _extra(name: str) -> Finding:
    """Whether all packages of an extra are installed."""
    releases = {package: release(package) for package in EXTRAS[name][0]}
    versions = ", ".join(f"{package} {version}" for package, version in releases.items())
    return Finding(name, all(releases.values()), versions, installs(name))


def _assets() -> Finding:
    try:
        from factory.floor.robots.catalogue import load_catalogue
        from factory.theory.lang.template_reader import all_templates

        counts = f"{len(all_templates())} operations, {len(load_catalogue().types)} robot types"
        return Finding("assets", True, counts)
    except (FactoryError, ImportError) as error:
        return Finding("assets", False, str(error), "install factory again")


def _engine() -> Finding:
    try:
        from factory.support.gl import import_mujoco

        mujoco = import_mujoco()
        model = mujoco.MjModel.from_xml_string("<mujoco><worldbody/></mujoco>")
        mujoco.mj_step(model, mujoco.MjData(model))
        return Finding("engine", True, f"MuJoCo {mujoco.mj_versionString()} steps")
    except FactoryError as error:
        return Finding("engine", False, error.diagnostics[0].message, error.diagnostics[0].hint)
    except Exception as error:  # whatever a broken installation raises
        return Finding("engine", False, str(error), "pip install --force-reinstall mujoco")


def _filament() -> Finding:
    """Whether the physically based renderer draws; nothing needs it."""
    from factory.film.filament import fault

    missing = fault()
    if missing is None:
        return Finding("filament", True, "draws stills (--renderer)")
    return Finding("filament", False, missing.message, missing.hint)


def _rendering() -> Finding:
    from factory.support.gl import probe

    try:
        probe()
        return Finding("rendering", True, "EGL draws headless")
    except FactoryError as error:
        first = error.diagnostics[0]
        return Finding("rendering", False, first.message, first.hint)
