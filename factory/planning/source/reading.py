"""From a source to parts in place: the choice of the reader, and what is said of what it found."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from factory.geometry.alike import Alike, alike
from factory.importing.importer import LDRAW
from factory.lang.source import quoted
from factory.planning.parts import InPlace, Kept, PlacedPart
from factory.planning.source.faults import check_count, check_places, raise_if_any
from factory.planning.source.in_place import check_in_place
from factory.planning.source.loose import bodies_in, loose_product
from factory.planning.source.placing import placed, shape_in_place
from factory.planning.source.scene_file import MESHES, SCENES
from factory.planning.source.trees import TreeProduct, from_ldraw, from_pag
from factory.problem.template import Template
from factory.support.collector import collector_paused
from factory.support.errors import Diagnostic, InputError, did_you_mean

SHOWN = 12
"""So many kinds of parts are named."""


@dataclass(frozen=True, slots=True)
class SourceOptions:
    """`unit`: that of lengths, None to be found out; `keep`: labels of sub-trees that stay;
    `replan`: whether a PAG's tree is thrown away; `library` and `boxes` as for an LDraw import;
    `in_place`: whether parts are taken to be in place, whatever they look like."""

    unit: str | None = None
    keep: tuple[str, ...] = ()
    replan: bool = False
    library: Path | None = None
    boxes: bool = False
    in_place: bool = False


@collector_paused()
def read_source(
    path: Path, templates: Mapping[str, Template], options: SourceOptions | None = None
) -> InPlace:
    """The parts of a folder of meshes, of a scene file, of an LDraw model or of a PAG, in place.
    Nothing is written. Raises InputError with every fault found."""
    asked = options or SourceOptions()
    made = _product(path, templates, asked)
    check_count(path, [node.label for node in made.pag.parts()])
    parts, warnings = placed(made.pag, made.files)
    found = alike([shape_in_place(part) for part in parts])
    firsts = zip(parts, found.kinds, strict=True)
    named = tuple(replace(part, kind=parts[first].label) for part, first in firsts)
    doubtful = check_places(named, made.has_tree, asked.unit is not None)
    if not (made.has_tree or asked.in_place):
        raise_if_any(check_in_place(named))
    notes = (*made.notes, _kinds(named), *_twins(named, found))
    kept = _kept(made, asked.keep)
    said = tuple(f"'{k.label}' stays as it is: {len(k.parts)} parts" for k in kept)
    warnings = (*made.warnings, *warnings, *doubtful)
    tree = made.pag if made.has_tree else None
    allowed = made.pag.allowed
    return InPlace(made.name, named, notes + said, kept, made.files, tree, warnings, allowed)


def _product(path: Path, templates: Mapping[str, Template], asked: SourceOptions) -> TreeProduct:
    suffix = path.suffix.lower()
    if not path.exists():
        message = f"there is no file or folder '{path}'"
        hint = "a folder of meshes, a .glb, .3mf or .step file, a model .ldr or .mpd, or a .pag"
        raise InputError(Diagnostic("BadFile", message, None, hint))
    if path.is_dir() or suffix in (*SCENES, *MESHES):
        _refuse_keep(asked, f"{quoted(path.name)} has no tree")
        return loose_product(path, bodies_in(path), asked.unit)
    if asked.unit is not None:
        message = f"{quoted(path.name)} is in metres, or states its unit"
        raise InputError(Diagnostic("Usage", message, None, "leave out --unit"))
    if suffix in LDRAW:
        return from_ldraw(path, templates, asked.library, asked.boxes)
    if suffix != ".pag":
        known = (*SCENES, *MESHES, *LDRAW[:2], ".pag")
        message = f"{quoted(path.name)} is nothing that parts in place can be read from"
        hint = did_you_mean(suffix, known, "endings")
        raise InputError(Diagnostic("BadFile", message, None, hint))
    if not (asked.replan or asked.keep):
        message = f"{quoted(path.name)} has a tree already"
        hint = "--replan throws it away; --keep LABEL keeps a sub-tree, and plans the rest"
        raise InputError(Diagnostic("Usage", message, None, hint))
    return from_pag(path, templates)


def _refuse_keep(asked: SourceOptions, why: str) -> None:
    if asked.keep or asked.replan:
        hint = "--keep and --replan are for a PAG, or --keep for an LDraw model"
        raise InputError(Diagnostic("Usage", why, None, hint))


def _kinds(parts: tuple[PlacedPart, ...]) -> str:
    """How many parts of how many kinds there are."""
    counts = Counter(part.kind for part in parts)
    several = [f"{count} like {kind}" for kind, count in counts.most_common() if count > 1]
    shown = ", ".join(several[:SHOWN]) + ", ..." * (len(several) > SHOWN)
    alike = f" ({shown})" if several else ", no two alike"
    return f"{len(parts)} parts of {len(counts)} kind{'s' * (len(counts) > 1)}{alike}"


def _twins(parts: tuple[PlacedPart, ...], found: Alike) -> list[str]:
    return [
        f"'{parts[one].label}' and '{parts[other].label}' are mirror images: two kinds"
        for one, other in found.twins[:SHOWN]
    ]


def _kept(made: TreeProduct, labels: tuple[str, ...]) -> tuple[Kept, ...]:
    """The sub-trees to be kept; one inside another is part of that. Raises InputError
    (UndefinedLabel, Usage)."""
    pag, faults, found = made.pag, [], {}
    for label in dict.fromkeys(labels):
        if label not in pag.by_label:
            hint = did_you_mean(label, [n.label for n in pag.nodes if n.inputs], "sub-assemblies")
            message = f"--keep: {quoted(label)} is not defined"
            faults.append(Diagnostic("UndefinedLabel", message, None, hint))
        elif label == pag.root:
            message = f"--keep: {quoted(label)} is the product: nothing is left to plan"
            faults.append(Diagnostic("Usage", message, None, "keep sub-assemblies of it"))
        else:
            found[label] = made.below(label)
    if faults:
        raise InputError(faults)
    inside = {node.label for nodes in found.values() for node in nodes[:-1]}
    return tuple(
        Kept(label, tuple(n.label for n in nodes if not n.inputs), nodes)
        for label, nodes in found.items()
        if label not in inside and len(nodes) > 1
    )
