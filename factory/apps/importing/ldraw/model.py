"""From LDraw models to drafts: sub-models are sub-assemblies; each building step adds to the steps
before."""

from __future__ import annotations

import re
from collections.abc import Set
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from factory.api import Diagnostic, Parameter
from factory.apps.importing.draft import MATE, MOST_NODES, PART, DraftNode, ImportFaults, too_many
from factory.apps.importing.ldraw.lines import (
    INHERITED,
    LDrawFile,
    Reference,
    direct_colour,
    key_of,
)
from factory.apps.importing.ldraw.shapes import (
    LDU,
    LIBRARY,
    UPRIGHT,
    Shapes,
    Shelf,
    children_first,
    matrix,
    mesh_of,
)
from factory.apps.importing.mesh_files import MeshStore
from factory.apps.importing.part_maker import Placement
from factory.support.arrays import Array
from factory.support.texts import quoted

DENSITY = 1050.0
"""Density of ABS [kg/m³]."""

BRICK = (0.008, 0.008, 0.0096)
"""The size of the box for a part of unknown shape: a brick with one stud [m]."""

TURNED = 1e-3
"""The tolerance for a rotation matrix: files are written with at least three digits."""

Colour = tuple[float, float, float, float] | None


@dataclass(frozen=True, slots=True)
class _Place:
    """The frame of a model in the product [LDU], and the colour that its parts inherit."""

    turn: Array
    at: Array
    colour: int


def read_ldraw(
    path: Path, library: Path | None, boxes: bool, store: MeshStore, faults: ImportFaults
) -> list[DraftNode]:
    """The drafts of a model, its main file first. A part without a known shape is an error
    (MissingPart), or a box with `boxes`. Raises InputError with every fault."""
    shelf = Shelf(path, library, faults)
    reader = _ModelReader(shelf, Shapes(shelf), boxes, store, faults)
    faults.raise_if_any()
    reader.survey()
    faults.raise_if_any()
    drafts = reader.expand()
    faults.raise_if_any()
    return drafts


class _ModelReader:
    def __init__(
        self, shelf: Shelf, shapes: Shapes, boxes: bool, store: MeshStore, faults: ImportFaults
    ) -> None:
        self.shelf, self.shapes, self.boxes = shelf, shapes, boxes
        self.store, self.faults = store, faults
        self.meshes: dict[tuple[int, bytes], str] = {}
        self.there: dict[tuple[str, bytes], list[Reference]] = {}
        self.greys: set[int] = set()

    def survey(self) -> None:
        """Check every model once: none may be missing, empty, too large, or contain itself."""
        size: dict[int, int] = {}
        for model in children_first(self.shelf.main, self._models_in, size):
            entries = [self.shelf.find(reference) for reference in model.references]
            size[id(model)] = 1 + sum(size.get(id(entry), 1) for entry in entries)
            if size[id(model)] > MOST_NODES:
                raise too_many(model.position)

    def _models_in(self, model: LDrawFile, path: Set[int]) -> list[LDrawFile]:
        if not any(model.steps):
            message = f"the model {quoted(model.name)} has no parts"
            hint = "a model places parts and other models by lines of type 1"
            self.faults.add("EmptyNode", message, model.position, hint)
        if model.triangles:
            message = f"{quoted(model.name)} has surfaces of its own, which are ignored"
            hint = "only parts have shapes: put them in a 0 FILE of their own, ending in .dat"
            many = "models have surfaces of their own, which are ignored"
            self.faults.warn("BadMesh", message, model.position, hint, many)
        models = []
        for reference in model.references:
            below = self.shelf.find(reference)
            if below is not None and id(below) in path:
                message = f"the model {quoted(reference.file)} contains itself"
                hint = "remove this line, or the one that leads here"
                self.faults.add("CyclicModel", message, reference.position, hint)
            elif below is not None and not below.is_part:
                models.append(below)
            else:
                self._check_part(reference, below)
        return models

    def _check_part(self, reference: Reference, file: LDrawFile | None) -> None:
        if abs(np.linalg.det(matrix(reference))) < 1e-9:
            message = f"the matrix of {quoted(reference.file)} is singular: the part would be flat"
            self.faults.add(
                "BadValue", message, reference.position, "the identity is 1 0 0 0 1 0 0 0 1"
            )
        if self.boxes:
            return
        if file is None and key_of(reference.file) not in self.shelf.refused:
            message = f"there is no part file {quoted(reference.file)}"
            self.faults.add("MissingPart", message, reference.position, LIBRARY)
        elif file is not None and isinstance(trouble := self.shapes.of(file), Diagnostic):
            self.faults.diagnostics.append(trouble)

    def expand(self) -> list[DraftNode]:
        """A draft for every model, step and part of the product."""
        main = self.shelf.main
        drafts = [DraftNode(_name(main), main.position)]
        stack = [(main, 0, _Place(np.eye(3), np.zeros(3), INHERITED[0]))]
        while stack:
            model, index, place = stack.pop()
            steps = [step for step in model.steps if step]
            for number, step in reversed(list(enumerate(steps))):
                entries = [self._enter(reference, place, drafts) for reference in step]
                drafts[index].inputs = [entry for entry, _ in entries]
                stack += [(file, entry, at) for entry, (file, at) in entries if file is not None]
                if number > 0:
                    drafts.append(DraftNode("", step[0].position))
                    drafts[index].inputs.insert(0, len(drafts) - 1)
                    index = len(drafts) - 1
        for references in self.there.values():
            places = [reference.position for reference in references]
            self.faults.check_used_once(quoted(references[0].file), places)
        return drafts

    def _enter(
        self, reference: Reference, place: _Place, drafts: list[DraftNode]
    ) -> tuple[int, tuple[LDrawFile | None, _Place]]:
        """Add the draft of a line. Returns its index, and the model that the line places, if
        any."""
        turn = place.turn @ matrix(reference)
        at = place.turn @ np.array(reference.place[:3]) + place.at
        colour = place.colour if reference.colour in INHERITED else reference.colour
        here = _Place(turn, at, colour)
        file = self.shelf.find(reference)
        if file is not None and not file.is_part:
            drafts.append(DraftNode(_name(file), reference.position, MATE))
            return len(drafts) - 1, (file, here)
        where = np.round(np.concatenate([turn.ravel(), at]), 3) + 0.0
        self.there.setdefault((key_of(reference.file), where.tobytes()), []).append(reference)
        drafts.append(
            DraftNode("", reference.position, PART, [], self._look(reference, file, here))
        )
        return len(drafts) - 1, (None, here)

    def _look(
        self, reference: Reference, file: LDrawFile | None, place: _Place
    ) -> tuple[Parameter, ...]:
        """The geometry of a part: shape, place, density, colour."""
        turn = UPRIGHT @ place.turn @ UPRIGHT.T
        rigid = np.abs(turn @ turn.T - np.eye(3)).max() < TURNED and np.linalg.det(turn) > 0
        mesh = self._mesh(reference, file, np.eye(3) if rigid else place.turn)
        parameters = [Parameter("mesh", mesh) if mesh else Parameter("box", BRICK)]
        at = UPRIGHT @ place.at * LDU
        if not mesh:
            at = at - turn @ np.array([0.0, 0.0, BRICK[2] / 2])
        parameters += Placement(turn if rigid else np.eye(3), at, moved=True).parameters({})
        parameters.append(Parameter("density", DENSITY))
        rgba = self._rgba(place.colour, reference)
        return (*parameters, Parameter("rgba", rgba)) if rgba else tuple(parameters)

    def _mesh(self, reference: Reference, file: LDrawFile | None, turn: Array) -> str:
        """The path of a part's mesh; "" if it has none."""
        triangles = self.shapes.of(file) if file is not None else None
        if file is None or triangles is None or isinstance(triangles, Diagnostic):
            return ""
        key = (id(file), np.round(turn, 6).tobytes())
        if key not in self.meshes:
            content = mesh_of(triangles, turn)
            if content is None and not self.boxes:
                message = f"the part {quoted(reference.file)} has no surfaces"
                self.faults.add("BadMesh", message, reference.position, "--boxes does without")
            stem = re.sub(r"\.(dat|ldr)$", "", key_of(file.name))
            self.meshes[key] = self.store.add(stem, ".obj", content) if content else ""
        return self.meshes[key]

    def _rgba(self, code: int, reference: Reference) -> Colour:
        if code in INHERITED:
            return None
        rgba = self.shelf.colours.get(code) or direct_colour(code)
        if rgba is None and code not in self.greys:
            self.greys.add(code)
            message = f"colour {code} is unknown: the part gets a default colour"
            hint = "a library's LDConfig.ldr defines colours, or a line 0 !COLOUR"
            many = "colours are unknown: parts get default colours"
            position = replace(reference.position, column=3)
            self.faults.warn("UnknownColour", message, position, hint, many)
        return rgba


def _name(file: LDrawFile) -> str:
    return re.sub(r"(?i)\.(ldr|mpd|dat)$", "", file.name)
