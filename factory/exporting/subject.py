"""Subjects of exports: a project, the net of a project or of a PNML file, or the log of a run."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from factory.nets.gears import GearNet
from factory.nets.marked import MarkedNet
from factory.pipeline import Project
from factory.record.log import Log
from factory.support.errors import Diagnostic, InputError, did_you_mean

Source = Project | GearNet | MarkedNet | Log
"""Source of an export."""


@dataclass(frozen=True)
class Subject:
    """Source and options of an export. `file`: the file that was read; `of`: the value of `--of`,
    "" for the default; `name`: name of the file to write; `whole`: whether to write a folder with
    everything."""

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
