"""The first stages in a row, for the command line and the Python API: templates, PAG, factory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path

from factory.compiler.compiler import compile_pag
from factory.compiler.mating.mating import Matings, matings, shaped
from factory.geometry.product import product_geometry
from factory.geometry.solids import Product
from factory.lang.pag_reader import load_pag
from factory.lang.template_reader import load_templates
from factory.plant.approaches import Approach
from factory.plant.factory import Factory
from factory.problem.pag import PAG
from factory.problem.robot_types import Catalogue, load_catalogue
from factory.problem.template import Template
from factory.support.errors import Diagnostic, InputError
from factory.support.resources import templates_folder


@dataclass(frozen=True)
class Source:
    """A PAG with the templates and robot types it is to be compiled with."""

    pag: PAG
    templates: Mapping[str, Template]
    catalogue: Catalogue

    @cached_property
    def product(self) -> Product:
        """The solids of its parts. Raises InputError where a mesh cannot be read."""
        return product_geometry(self.pag)

    @cached_property
    def approaches(self) -> Mapping[str, Approach]:
        """How the inputs of its operations can come together; empty for a product none of whose
        parts has a shape of its own: its default boxes can always slide."""
        return self.matings.approaches if self.matings else {}

    @cached_property
    def matings(self) -> Matings | None:
        """What was found of how its inputs come together; None for a product of default boxes."""
        return matings(self.pag, self.templates, self.product) if shaped(self.pag) else None

    def compile(self) -> Factory:
        """Compile(P). Raises InputError where there is no such factory."""
        factory = compile_pag(self.pag, self.templates, self.catalogue, self.approaches)
        own = {name for name, template in self.templates.items() if not _is_shipped(template)}
        tried = own and own & {operation.template.name for operation in factory.operations}
        if tried:
            from factory.modes.modes import check_modes

            check_modes(factory, [self.templates[name] for name in sorted(tried)], self.product)
        return factory


def _is_shipped(template: Template) -> bool:
    """Whether a template is known to have a mode in every layout."""
    at = template.position
    return at is not None and Path(at.file).parent == templates_folder()


def all_templates(folders: Sequence[Path] = ()) -> Mapping[str, Template]:
    """The templates of the user's folders and the shipped ones. Raises InputError."""
    for folder in folders:
        if not Path(folder).is_dir():
            message = f"the templates folder '{folder}' is no directory"
            raise InputError(
                Diagnostic("BadTemplate", message, None, "--templates takes a directory")
            )
    return load_templates([*map(Path, folders), templates_folder()])


def read(path: str | PathLike[str], folders: Sequence[Path] = ()) -> Source:
    """A PAG file with what it needs. Raises InputError with every error found."""
    templates = all_templates(folders)
    return Source(load_pag(path, templates), templates, load_catalogue())
