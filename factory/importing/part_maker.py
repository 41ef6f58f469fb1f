"""From the description of a part in a tree or a bill to the parameters of `atomic`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from factory.importing.draft import ImportFaults
from factory.importing.mesh_files import MeshFolder
from factory.importing.places import Placement
from factory.lang.source import quoted
from factory.lang.values import GEOMETRY, SHAPES
from factory.problem.pag import Parameter, Value
from factory.support.errors import Position

LENGTHS = tuple(name for name, kind in GEOMETRY.items() if kind.long)
"""Parameters in the unit of the file."""


@dataclass(slots=True)
class PartMaker:
    """`unit`: the length that 1 stands for in the file and its meshes [m]."""

    meshes: MeshFolder
    unit: float
    faults: ImportFaults
    there: dict[tuple[Parameter, ...], list[Position]] = field(default_factory=dict)

    def parameters(
        self, given: Mapping[str, Value], place: Placement, position: Position
    ) -> tuple[Parameter, ...]:
        """The parameters of a part in a frame; its mesh is fetched, its lengths are in metres. Two
        shapes and an unknown mesh are noted."""
        shapes = [name for name in SHAPES if name in given]
        if len(shapes) > 1:
            message = f"a part has one shape, but '{shapes[0]}' and '{shapes[1]}' are given"
            self.faults.add("BadValue", message, position, f"keep one of {', '.join(SHAPES)}")
        metres = self.metres(given)
        if "mesh" in given:
            path = self.meshes.path(str(given["mesh"]), position)
            metres |= {"mesh": path or ""}
            if self.unit != 1:
                metres.setdefault("scale", self.unit)
        placed = shapes or "pos" in given or "quat" in given
        stands = place.parameters(metres) if placed else []
        first = [Parameter(name, metres.pop(name)) for name in shapes]
        rest = [Parameter(name, metres[name]) for name in metres if name not in ("pos", "quat")]
        if self.meshes.found.get(str(given.get("mesh"))):
            self.there.setdefault((*first, *stands), []).append(position)
        return (*first, *stands, *rest)

    def check_places(self) -> None:
        """Note each mesh in the place of an equal one (UsedTwice)."""
        for (mesh, *_), positions in self.there.items():
            name = quoted(str(mesh.value).partition("/")[2])
            self.faults.check_used_once(f"the mesh {name}", positions)

    def metres(self, given: Mapping[str, Value]) -> dict[str, Value]:
        """These parameters with lengths in metres."""
        made = dict(given)
        for name in LENGTHS:
            value = given.get(name)
            if self.unit != 1 and isinstance(value, tuple):
                made[name] = tuple(x * self.unit for x in value)
            elif self.unit != 1 and isinstance(value, float):
                made[name] = value * self.unit
        return made
