"""From a source to parts in place: the choice of the reader, and the solids of the parts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from factory.api import (
    PAG,
    Assembly,
    Diagnostic,
    DrawnSolids,
    InputError,
    Product,
    Solid,
    Template,
    load_pag,
    product_geometry,
)
from factory.apps.importing import Imported, Options, import_product
from factory.apps.importing.alike import alike
from factory.apps.importing.bodies import check_count
from factory.apps.importing.draft import file_stem
from factory.apps.importing.importer import LDRAW
from factory.apps.importing.loose import bodies_in, loose_product
from factory.apps.importing.mesh_files import MeshStore
from factory.apps.importing.scene_file import MESHES, SCENES
from factory.apps.planning.faults import check_in_place, check_places, raise_if_any
from factory.apps.planning.parts import EXTRA, InPlace, Kept, PlacedPart, hull_stands
from factory.apps.planning.shanks import screws_among
from factory.support.arrays import Array, Indices
from factory.support.collector import collector_paused
from factory.support.errors import did_you_mean
from factory.support.meshes.alike import shape_of
from factory.support.meshes.mesh_file import ANEW
from factory.support.meshes.triangles import convex_hull
from factory.support.rotations import rotation
from factory.support.texts import quoted

DECOMPOSE = f"{EXTRA}: then it is decomposed into convex bodies"

AS_BODIES = "CoACD cannot decompose it: write it as closed convex bodies that touch"

SHOWN = 12
"""The most kinds of parts that a note names."""


@dataclass(frozen=True, slots=True)
class SourceOptions:
    """`unit`: the unit of length, None to determine it; `keep`: labels of sub-trees to keep;
    `replan`: whether the tree of a PAG is discarded; `library` and `boxes` as for an LDraw import;
    `in_place`: whether the check that parts are in place is skipped; `screws`: parts that are
    screws besides those that are recognised, None for no screws at all."""

    unit: str | None = None
    keep: tuple[str, ...] = ()
    replan: bool = False
    library: Path | None = None
    boxes: bool = False
    in_place: bool = False
    screws: tuple[str, ...] | None = ()


@collector_paused()
def read_source(
    path: Path, templates: Mapping[str, Template], options: SourceOptions | None = None
) -> InPlace:
    """The parts in place of a folder of meshes, a scene file, an LDraw model or a PAG. Nothing is
    written. Raises InputError with every fault."""
    asked = options or SourceOptions()
    made = _product(path, templates, asked)
    check_count(path, [node.label for node in made.pag.parts()])
    parts, warnings = placed(made.pag, made.meshes)
    kinds = alike([shape_of(part.vertices, part.faces) for part in parts])
    firsts = zip(parts, kinds.kinds, strict=True)
    named = tuple(replace(part, kind=parts[first].label) for part, first in firsts)
    doubtful = check_places(named, made.has_tree, asked.unit is not None)
    if not (made.has_tree or asked.in_place):
        screws = () if asked.screws is None else screws_among(named, asked.screws)
        raise_if_any(check_in_place(named, screws))
    twins = (
        f"'{parts[one].label}' and '{parts[other].label}' are mirror images: two kinds"
        for one, other in kinds.twins[:SHOWN]
    )
    notes = (*made.notes, _kinds(named), *twins)
    kept = _kept(made, asked.keep)
    kept_notes = tuple(f"'{k.label}' stays as it is: {len(k.parts)} parts" for k in kept)
    warnings = (*made.warnings, *warnings, *doubtful)
    tree = made.pag if made.has_tree else None
    allowed = made.pag.allowed
    return InPlace(made.name, named, notes + kept_notes, kept, made.meshes, tree, warnings, allowed)


def _product(path: Path, templates: Mapping[str, Template], asked: SourceOptions) -> Imported:
    suffix = path.suffix.lower()
    if not path.exists():
        message = f"there is no file or folder '{path}'"
        hint = "a folder of meshes, a .glb, .3mf or .step file, a model .ldr or .mpd, or a .pag"
        raise InputError(Diagnostic("BadFile", message, None, hint))
    if path.is_dir() or suffix in (*SCENES, *MESHES):
        if asked.keep or asked.replan:
            hint = "--keep and --replan are for a PAG, or --keep for an LDraw model"
            message = f"{quoted(path.name)} has no tree"
            raise InputError(Diagnostic("Usage", message, None, hint))
        return loose_product(path, bodies_in(path), asked.unit)
    if asked.unit is not None:
        message = f"{quoted(path.name)} is in metres, or states its unit"
        raise InputError(Diagnostic("Usage", message, None, "leave out --unit"))
    if suffix in LDRAW:
        made = import_product(path, templates, Options(asked.library, asked.boxes))
        steps = len(made.pag) - sum(1 for _ in made.pag.parts())
        note = f"an LDraw model (its unit is 0.4 mm); its {steps} steps are discarded"
        return replace(made, notes=(note,))
    if suffix != ".pag":
        suffixes = (*SCENES, *MESHES, *LDRAW[:2], ".pag")
        message = f"{quoted(path.name)} is not a source of parts in place"
        hint = did_you_mean(suffix, suffixes, "endings")
        raise InputError(Diagnostic("BadFile", message, None, hint))
    if not (asked.replan or asked.keep):
        message = f"{quoted(path.name)} has a tree already"
        hint = "--replan discards it; --keep LABEL keeps a sub-tree and plans the rest"
        raise InputError(Diagnostic("Usage", message, None, hint))
    return _from_pag(path, templates)


def _from_pag(path: Path, templates: Mapping[str, Template]) -> Imported:
    """A PAG. Raises InputError, also for a part without a shape (MissingPart): the place of its
    default box depends on the tree."""
    pag = load_pag(path, templates)
    store, faults = MeshStore("meshes"), list[Diagnostic]()
    nodes = tuple(_stored(node, pag, store, faults) for node in pag.nodes)
    if faults:
        raise InputError(faults)
    made = replace(pag, nodes=nodes)
    others = Counter(n.operation for n in pag.nodes if n.inputs and n.operation != "mate")
    lost = ", ".join(f"{count} x {name}" for name, count in sorted(others.items()))
    note = f"a PAG of {len(pag)} labels" + (f"; its tree is discarded, with {lost}" if lost else "")
    return Imported(file_stem(path.stem), made, store.files, path.name, (note,))


def _stored(node: Assembly, pag: PAG, store: MeshStore, faults: list[Diagnostic]) -> Assembly:
    """A node, after its mesh, if it has one, was added to the store."""
    if node.inputs:
        return node
    if not any(p.name in PAG.SHAPES for p in node.parameters):
        message = f"'{node.label}' has no shape: its place is known only from the tree"
        hint = "give it a mesh, a box, a cylinder or a sphere, and its pos"
        faults.append(Diagnostic("MissingPart", message, node.position, hint))
        return node
    try:
        return store.keep(node, pag.folder)
    except OSError as error:
        message = f"cannot read '{node.parameter('mesh')}': {error.strerror}"
        faults.append(Diagnostic("BadMesh", message, node.position, ANEW))
        return node


def _kinds(parts: tuple[PlacedPart, ...]) -> str:
    """A note on the number of parts and kinds."""
    counts = Counter(part.kind for part in parts)
    several = [f"{count} like {kind}" for kind, count in counts.most_common() if count > 1]
    shown = ", ".join(several[:SHOWN]) + ", ..." * (len(several) > SHOWN)
    alike = f" ({shown})" if several else ", no two alike"
    return f"{len(parts)} parts of {len(counts)} kind{'s' * (len(counts) > 1)}{alike}"


def _kept(made: Imported, labels: tuple[str, ...]) -> tuple[Kept, ...]:
    """The sub-trees to be kept; one inside another is part of the outer one. Raises InputError
    (UndefinedLabel, Usage)."""
    pag, faults, sub_trees = made.pag, [], {}
    for label in dict.fromkeys(labels):
        if label not in pag.by_label:
            hint = did_you_mean(label, [n.label for n in pag.nodes if n.inputs], "sub-assemblies")
            message = f"--keep: {quoted(label)} is not defined"
            faults.append(Diagnostic("UndefinedLabel", message, None, hint))
        elif label == pag.root:
            message = f"--keep: {quoted(label)} is the product: nothing is left to plan"
            faults.append(Diagnostic("Usage", message, None, "keep sub-assemblies of it"))
        else:
            sub_trees[label] = tuple(PAG(label, pag.nodes).postorder())
    if faults:
        raise InputError(faults)
    inside = {node.label for nodes in sub_trees.values() for node in nodes[:-1]}
    return tuple(
        Kept(label, tuple(n.label for n in nodes if not n.inputs), nodes)
        for label, nodes in sub_trees.items()
        if label not in inside and len(nodes) > 1
    )


def placed(
    pag: PAG, files: Mapping[str, bytes]
) -> tuple[tuple[PlacedPart, ...], tuple[Diagnostic, ...]]:
    """The parts of a PAG, each as a kind of its own, and warnings. Raises InputError (BadMesh,
    BadValue)."""
    product = product_geometry(pag, files, decomposed=False)
    solids = dict(product.solids)
    if DrawnSolids.can_decompose() and (beside := _beside_open(product)):
        nodes = [node for node in pag.parts() if node.label in beside]
        whole = Assembly(pag.root, "mate", tuple(node.label for node in nodes))
        solids |= product_geometry(replace(pag, nodes=(whole, *nodes)), files).solids
    parts = []
    for node in pag.parts():
        solid = solids[node.label]
        parts.append(PlacedPart(node.label, *surface(solid), node.label, solid, node))
    hulls = () if DrawnSolids.can_decompose() else _hulls(parts)
    return tuple(parts), (*product.warnings, *hulls)


def _beside_open(product: Product) -> set[str]:
    """The parts that bound no volume, and those whose boxes meet theirs: what these block is known
    by convex bodies."""
    solids = product.solids
    boxes = [solid for solid in solids.values() if DrawnSolids.body(solid) is None]
    return {
        label
        for label, solid in solids.items()
        if any((solid.low <= box.high).all() and (box.low <= solid.high).all() for box in boxes)
    }


def _hulls(parts: Sequence[PlacedPart]) -> list[Diagnostic]:
    """A warning for each closed mesh that is not convex and is represented by its hull: parts
    inside it seem to overlap with it."""
    warnings = {}
    for part in parts:
        file = str(part.node.parameter("mesh"))
        if file not in warnings and hull_stands(part.solid.mesh):
            message = f"{file} is not convex; its convex hull is used instead"
            hint = AS_BODIES if DrawnSolids.can_decompose() else DECOMPOSE
            many = f"meshes are not convex: their convex hulls are used ({hint})"
            warnings[file] = Diagnostic("BadMesh", message, part.node.position, hint, many)
    return list(warnings.values())


def surface(solid: Solid) -> tuple[Array, Indices]:
    """The surface of a solid in place: vertices (n, 3) [m] and faces (m, 3); for a round solid, the
    polytope around it."""
    if solid.mesh is None:
        return convex_hull(solid.pieces[0])
    turn = rotation(solid.quaternion)
    return solid.mesh.vertices @ turn.T + solid.position, np.asarray(solid.mesh.faces)
