"""What is exported: a PAG with all that follows from it, a net in PNML, or a log."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from factory.geometry.solids import Product
from factory.layout.layout import Layout
from factory.layout.request import Ground
from factory.nets.gears import GearNet
from factory.nets.marked import MarkedNet
from factory.pipeline import Source, read
from factory.plant.factory import Factory
from factory.record.log import Log, is_log, read_log
from factory.support.errors import Diagnostic, InputError, did_you_mean
from factory.support.files import is_net
from factory.support.settings import Settings

SOURCES = {"net": ("a PAG", "a net in PNML"), "pag": ("a PAG",), "log": ("a log",)}
"""What an exporter can take, as people call it."""


@dataclass(frozen=True)
class Subject:
    """A file to be exported, read and compiled only as far as an exporter asks.

    `of`: what is wanted of it, "" for the usual; `name`: of the file that is written; `whole`:
    whether a folder with everything is wanted; `ground`: what it is laid out for.
    """

    file: Path
    folders: tuple[Path, ...] = ()
    settings: Settings = field(default_factory=Settings)
    ground: Ground = Ground()  # noqa: RUF009
    of: str = ""
    name: str = ""
    whole: bool = False

    @cached_property
    def kind(self) -> str:
        """What the file is."""
        if is_log(self.file):
            return "a log"
        return "a net in PNML" if is_net(self.file) else "a PAG"

    def require(self, form: str, takes: str) -> None:
        """Raises InputError (Usage) where a format is not made from such a file."""
        wanted = SOURCES[takes]
        if self.kind not in wanted:
            message = f"{form} is made from {' or '.join(wanted)}; '{self.file}' is {self.kind}"
            hint = f"give {wanted[0]}"
            if takes == "log":
                hint = "keep one first: `factory run FILE.pag --log OUT`"
            raise InputError(Diagnostic("Usage", message, None, hint))

    @property
    def stem(self) -> str:
        """The name of the product."""
        return self.file.stem or "factory"

    @cached_property
    def source(self) -> Source:
        """The PAG with its templates. Raises InputError."""
        return read(self.file, self.folders)

    @cached_property
    def factory(self) -> Factory:
        """What it compiles to, with the relays of its layout if there are to be any."""
        return self.layout.factory if self.ground.relays else self.source.compile()

    @property
    def product(self) -> Product:
        """The solids of its parts. Raises InputError where a mesh cannot be read."""
        return self.source.product

    @cached_property
    def net(self) -> GearNet | MarkedNet:
        """The factory's net, or that of a PNML file. Raises InputError."""
        if self.kind == "a PAG":
            return self.factory.net
        from factory.foreign_nets.pnml_reader import read_pnml
        from factory.lang.source import read_text

        return read_pnml(read_text(self.file), str(self.file))

    @cached_property
    def layout(self) -> Layout:
        """The factory laid out. Raises RunError where there is no room."""
        return self.ground.lay_out(self.source.compile(), self.product, self.settings)

    @cached_property
    def log(self) -> Log:
        """The log. Raises InputError (BadLog)."""
        return read_log(self.file)

    def choose(self, valid: list[str], noun: str) -> str:
        """What `of` names; the first where it names nothing. Raises InputError (Usage)."""
        if self.of and self.of not in valid:
            hint = did_you_mean(self.of, valid, noun)
            message = f"--of '{self.of}' is none of the {noun}"
            raise InputError(Diagnostic("Usage", message, None, hint))
        return self.of or valid[0]
