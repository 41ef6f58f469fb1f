"""Products that come as a tree: PAGs and LDraw models. Their parts are what is taken."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath

from factory.geometry.mesh_file import ANEW
from factory.importing import Options, import_product
from factory.importing.labels import file_stem
from factory.importing.mesh_files import MeshStore
from factory.lang.pag_reader import load_pag
from factory.problem.pag import PAG, Assembly, Parameter
from factory.problem.shapes import SHAPED
from factory.problem.template import Template
from factory.support.errors import Diagnostic, InputError
from factory.support.files import MESH, read_bytes


@dataclass(frozen=True, slots=True)
class TreeProduct:
    """A product as a PAG; `files` are its meshes, by path in the output folder. `has_tree`: whether
    that tree says more than that all parts belong to the product."""

    name: str
    pag: PAG
    files: Mapping[str, bytes] = field(repr=False)
    notes: tuple[str, ...]
    warnings: tuple[Diagnostic, ...] = ()
    has_tree: bool = True

    def below(self, label: str) -> tuple[Assembly, ...]:
        """The nodes of a sub-tree, inputs first."""
        return tuple(PAG(label, self.pag.nodes).postorder())


def from_ldraw(
    path: Path, templates: Mapping[str, Template], library: Path | None, boxes: bool
) -> TreeProduct:
    """An LDraw model; its steps are the tree. Raises InputError."""
    made = import_product(path, templates, Options(library, boxes))
    steps = len(made.pag) - sum(1 for _ in made.pag.parts())
    files = {name: content for name, content in made.files.items() if not name.endswith(".pag")}
    note = f"an LDraw model (its unit is 0.4 mm); its {steps} steps are thrown away"
    return TreeProduct(made.name, made.pag, files, (note,), made.warnings)


def from_pag(path: Path, templates: Mapping[str, Template]) -> TreeProduct:
    """A PAG. Raises InputError, also for a part that has no shape (MissingPart): where a default
    box stands follows from the tree."""
    pag = load_pag(path, templates)
    store, faults = MeshStore("meshes"), list[Diagnostic]()
    nodes = tuple(_stored(node, pag, store, faults) for node in pag.nodes)
    if faults:
        raise InputError(faults)
    made = replace(pag, nodes=nodes)
    others = Counter(n.operation for n in pag.nodes if n.inputs and n.operation != "mate")
    lost = ", ".join(f"{count} x {name}" for name, count in sorted(others.items()))
    note = f"a PAG of {len(pag)} labels" + (f"; with its tree go {lost}" if lost else "")
    return TreeProduct(file_stem(path.stem), made, store.files, (note,))


def _stored(node: Assembly, pag: PAG, store: MeshStore, faults: list[Diagnostic]) -> Assembly:
    """A node whose mesh, if it has one, is in the store."""
    if node.inputs:
        return node
    if not any(p.name in SHAPED - {"pos"} for p in node.parameters):
        message = f"'{node.label}' has no shape: where it is follows from the tree alone"
        hint = "give it a mesh, a box, a cylinder or a sphere, and its pos"
        faults.append(Diagnostic("MissingPart", message, node.position, hint))
        return node
    mesh = node.parameter("mesh")
    if mesh is None:
        return node
    name = PurePosixPath(str(mesh))
    try:
        content = read_bytes(Path(pag.folder) / name, MESH)
    except OSError as error:
        message = f"cannot read '{mesh}': {error.strerror}"
        faults.append(Diagnostic("BadMesh", message, node.position, ANEW))
        return node
    stored = store.add(name.stem, name.suffix.lower(), content)
    return replace(
        node,
        parameters=tuple(
            Parameter("mesh", stored, p.position) if p.name == "mesh" else p
            for p in node.parameters
        ),
    )
