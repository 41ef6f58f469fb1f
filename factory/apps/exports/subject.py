"""Subjects of exports: a project, the net of a project or of a PNML file, or the log of a run; and
the parts of its product, or of a sub-assembly of it, as triangle meshes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

import numpy as np

from factory.api import Diagnostic, GearNet, InputError, MarkedNet, Mesh, Project, Solid
from factory.apps.log import Log
from factory.support.errors import did_you_mean
from factory.support.extensions import blaming
from factory.support.guard import reading

Source = Project | GearNet | MarkedNet | Log
"""Source of an export."""


@dataclass(frozen=True)
class Subject:
    """Source and options of an export.

    Attributes:
        file: the file that was read.
        source: what was read from it: a project, a net or a log.
        of: the value of `--of`, "" for the default.
        name: name of the file to write.
        whole: whether to write a folder with everything.
    """

    file: Path
    source: Source = field(repr=False)
    of: str = ""
    name: str = ""
    whole: bool = False

    @property
    def stem(self) -> str:
        """The name of the product."""
        return self.file.stem.strip("-") or "factory"

    @property
    def project(self) -> Project:
        """The project, for exporters of a PAG."""
        assert isinstance(self.source, Project)
        return self.source

    @property
    def net(self) -> GearNet | MarkedNet:
        """The factory's net, or that of a PNML file. Raises InputError."""
        if isinstance(self.source, Project):
            return self.source.factory.net
        assert not isinstance(self.source, Log)
        return self.source

    @property
    def log(self) -> Log:
        """The log, for exporters of a log."""
        assert isinstance(self.source, Log)
        return self.source

    def choose(self, valid: list[str], noun: str) -> str:
        """The choice that `of` names, the first by default. Raises InputError (Usage)."""
        if self.of and self.of not in valid:
            hint = did_you_mean(self.of, valid, noun)
            message = f"--of '{self.of}' is none of the {noun}"
            raise InputError(Diagnostic("Usage", message, None, hint))
        return self.of or valid[0]


ROUND = 64
"""Sides of a cylinder."""


def triangles(solid: Solid) -> Mesh:
    """A part's mesh in its own frame [m]: cylinders as prisms, spheres as polytopes with their
    vertices on the surface."""
    from trimesh import creation

    if solid.mesh is not None:
        return solid.mesh
    if solid.kind == "box":
        made = creation.box(extents=2 * np.array(solid.size))
    elif solid.kind == "cylinder":
        made = creation.cylinder(solid.size[0], 2 * solid.size[1], sections=ROUND)
    else:
        made = creation.icosphere(subdivisions=3, radius=solid.size[0])
    return Mesh(solid.kind, np.asarray(made.vertices, float), np.asarray(made.faces, np.int64))


def wanted(subject: Subject, ending: str) -> Iterator[tuple[str, str]]:
    """Labels to write, with the names of their files: the requested one, or the product, under "";
    for a whole folder every sub-assembly and part. Raises InputError."""
    pag = subject.project.pag
    if not subject.whole:
        yield subject.choose(list(dict.fromkeys((pag.root, *pag.by_label))), "labels"), ""
        return
    taken: set[str] = set()
    for node in pag.postorder():
        name = file_name(node.label, taken)
        yield node.label, f"{name}{ending}"


def file_name(label: str, taken: set[str]) -> str:
    """A file name for a label, distinct from those `taken` whatever the case; the label itself
    where that is a safe name."""
    safe = "".join(c if c.isalnum() or c in "-_." else "_" for c in label).strip(".") or "_"
    name, number = safe[:80], 2
    while name.casefold() in taken:
        name, number = f"{safe[:80]}~{number}", number + 1
    taken.add(name.casefold())
    return name


def user_modules(folder: Path) -> Iterator[ModuleType]:
    """The modules in a folder of the user, by name. Raises InputError: Usage, BadExtension."""
    if not folder.is_dir():
        message = f"'{folder}' is no folder"
        raise InputError(Diagnostic("Usage", message, None, "give a folder with modules (*.py)"))
    for path in sorted(folder.glob("*.py")):
        reading(path)
        spec = spec_from_file_location(f"factory_user_{path.stem}", path)
        assert spec is not None and spec.loader is not None
        module = module_from_spec(spec)
        with blaming(path.name, path):
            spec.loader.exec_module(module)
        yield module
