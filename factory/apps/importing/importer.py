"""Import of a product: the choice of the reader, and the files to be written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from factory.api import PAG, Diagnostic, InputError, Template, read_text, write_pag
from factory.apps.importing.bill import BillReader
from factory.apps.importing.document import read_json, read_yaml
from factory.apps.importing.draft import DraftNode, ImportFaults, Mates, assemble, file_stem
from factory.apps.importing.ldraw.model import read_ldraw
from factory.apps.importing.mesh_files import MeshStore
from factory.apps.importing.part_maker import PartMaker
from factory.apps.importing.tree_file import TreeReader
from factory.support.collector import collector_paused
from factory.support.errors import did_you_mean
from factory.support.texts import quoted, source_of

LDRAW, YAML, JSON, BILL = (".ldr", ".mpd", ".dat"), (".yaml", ".yml"), (".json",), (".csv", ".tsv")
KINDS = (*LDRAW[:2], *JSON, *YAML, *BILL)
"""The endings of files that can be imported."""


@dataclass(frozen=True, slots=True)
class Options:
    """`library`: an LDraw parts library; `boxes`: whether parts without a known shape become boxes;
    `meshes`: the folder of a tree's meshes, None for the tree's own folder; `unit`: the unit of
    length of a tree or a bill and its meshes [m]; `mates`: how three or more inputs are mated;
    `columns`: titles of a bill's columns, by their names."""

    library: Path | None = None
    boxes: bool = False
    meshes: Path | None = None
    unit: float = 1.0
    mates: Mates = "many"
    columns: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Imported:
    """A product as a PAG. `name`: that of the PAG's file, without `.pag`; `meshes`: the contents of
    mesh files, by path in the output folder; `source`: the name of the file it was read from;
    `notes`: what was read, in words; `has_tree`: whether the tree of the PAG says more than that
    all parts belong to the product; `unused`: the titles of a bill's columns that are not used."""

    name: str
    pag: PAG
    meshes: Mapping[str, bytes] = field(repr=False)
    source: str
    notes: tuple[str, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()
    has_tree: bool = True
    unused: tuple[str, ...] = ()

    @cached_property
    def files(self) -> Mapping[str, bytes]:
        """The contents of all files by path in the output folder, the PAG's first."""
        text = f"// {self.name}, imported from {self.source}\n{write_pag(self.pag)}"
        return {f"{self.name}.pag": text.encode(), **self.meshes}


@collector_paused()
def import_product(
    path: Path, templates: Mapping[str, Template], options: Options | None = None
) -> Imported:
    """The product in a file, or in a folder with one tree or bill. Nothing is written. Raises
    InputError with every fault."""
    options = options or Options()
    file = _file(path)
    faults = ImportFaults()
    store = MeshStore("bricks" if file.suffix.lower() in LDRAW else "meshes")
    unused = list[str]()
    drafts = _drafts(file, templates, options, store, faults, unused)
    pag = assemble(drafts, faults, options.mates)
    if file.suffix.lower() in LDRAW:
        pag = _allowing(pag, store.files)
    name = file_stem(file.stem)
    made = Imported(name, pag, store.files, file.name, warnings=tuple(faults.warnings))
    return replace(made, unused=tuple(unused))


def _allowing(pag: PAG, files: Mapping[str, bytes]) -> PAG:
    """An LDraw model in which parts may overlap as much as drawings without fits do."""
    from factory.api import product_geometry
    from factory.apps.importing.draft import everywhere

    try:
        return replace(pag, allowed=everywhere(product_geometry(pag, files)))
    except InputError:
        return pag  # whoever uses it will hear of that


def _drafts(
    file: Path,
    templates: Mapping[str, Template],
    options: Options,
    store: MeshStore,
    faults: ImportFaults,
    unused: list[str],
) -> list[DraftNode]:
    kind = file.suffix.lower()
    if kind in LDRAW:
        return read_ldraw(file, options.library, options.boxes, store, faults)
    if kind not in KINDS:
        hint = did_you_mean(kind, KINDS, "endings of files")
        message = f"{quoted(file.name)} is not a file that can be imported"
        raise InputError(Diagnostic("BadFile", message, None, hint))
    source = source_of(read_text(file), str(file))
    parts = PartMaker(options.meshes or file.parent, store, options.unit, faults)
    if kind in BILL:
        bill = BillReader(source, parts, faults, options.columns)
        made = bill.read(file.stem)
        unused.extend(bill.table.header.unused)
        return made
    root = read_json(source) if kind in JSON else read_yaml(source)
    return TreeReader(templates, parts, faults).read(root, file.stem)


def _file(path: Path) -> Path:
    """The file itself, or the one tree or bill in a folder."""
    if not path.is_dir():
        return path
    files = sorted(p for p in path.iterdir() if p.suffix.lower() in KINDS and p.is_file())
    if len(files) == 1:
        return files[0]
    named = ", ".join(p.name for p in files[:5])
    message = f"the folder {quoted(str(path))} has {named or 'neither a tree nor a bill'}"
    hint = (
        "name one of them"
        if files
        else "add a tree.json or a bill.csv: how the meshes are assembled"
    )
    raise InputError(Diagnostic("BadFile", message, None, hint))


__all__ = ["KINDS", "Imported", "Options", "import_product"]
