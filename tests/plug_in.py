"""A package that extends factory: an operation, a control law, a robot type and an exporter."""

from __future__ import annotations

from pathlib import Path

from tests.paths import ROOT

ENTRY_POINTS = {
    "factory.templates": "dab = gluing.templates",
    "factory.robots": "dabber = gluing.robots",
    "factory.laws": "near = gluing.laws:near",
    "factory.exporters": "count = gluing.count",
}

FILES = {
    "gluing/__init__.py": "",
    "gluing/templates/__init__.py": "",
    "gluing/templates/dab.op": """\
dab = (R, j, ~, <a; b>, F) where
  // a dabber comes to the station of the carrier
  R = < dot, dabber >;
  j = 1;
  ~ = { S1 = A2 };
  <a; b> = < LAB1, nopart; LAB2, nopart >;
  F = near on W to ( S1 + 2r, A2 + 2r ) within eps;
""",
    "gluing/robots/__init__.py": "",
    "gluing/laws.py": """\
from factory.api import Mode, Setting, Template, navigation


def near(template: Template, setting: Setting) -> Mode:
    return navigation(template, setting)
""",
    "gluing/count.py": '''\
"""The number of labels."""
FORMAT, TAKES = "count", "pag"


def export(subject):
    return str(len(subject.project.pag.nodes))
''',
    "p.pag": "root = s; s = dab ( m ); m = atomic ()",
}

PROJECT = """\
[project]
name = "gluing"
version = "1.0"
[build-system]
requires = ["hatchling"]
build-backend = "hatchling.build"
"""


def write_package(folder: Path, installed: bool, name: str = "gluing") -> None:
    """Write the package into a folder: its source, to be installed, or as an installation leaves
    it, with the metadata of the distribution beside it."""
    tool = (ROOT / "mjcf" / "tool.xml").read_text()
    more = {
        "gluing/robots/catalogue.toml": '[dabber]\nmjcf = "dabber.xml"\nextends = "tool"\n',
        "gluing/robots/dabber.xml": tool.replace('model="tool"', 'model="dabber"'),
    }
    points = "\n".join(f"[{group}]\n{line}" for group, line in ENTRY_POINTS.items())
    if installed:
        more[f"{name}-1.0.dist-info/entry_points.txt"] = points
        more[f"{name}-1.0.dist-info/METADATA"] = f"Name: {name}\nVersion: 1.0\n"
    else:
        tables = (f'[project.entry-points."{g}"]\n{e}' for g, e in _quoted().items())
        more["pyproject.toml"] = "\n".join([PROJECT, *tables])
    for path, text in (FILES | more).items():
        file = folder / path.replace("gluing/", f"{name}/", 1)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text.replace("gluing", name))


def _quoted() -> dict[str, str]:
    return {g: '{} = "{}"'.format(*line.split(" = ")) for g, line in ENTRY_POINTS.items()}
