"""The folders of the shipped templates and MJCF files: beside the package in a checkout, inside it
in a wheel."""

from __future__ import annotations

from pathlib import Path

from factory.support.errors import Diagnostic, MissingError

__all__ = ["mjcf_folder"]


def _folder(name: str) -> Path:
    package = Path(__file__).resolve().parents[1]
    for candidate in (package / "assets" / name, package.parent / name):
        if candidate.is_dir():
            return candidate
    message = f"the folder '{name}' of factory is missing"
    raise MissingError(Diagnostic("Assets", message, None, "install factory again"))


def templates_folder() -> Path:
    """The folder of the shipped operation templates (`*.op`)."""
    return _folder("templates")


def mjcf_folder() -> Path:
    """The folder of the shipped robot types and scene (`*.xml`, `catalogue.toml`)."""
    return _folder("mjcf")
