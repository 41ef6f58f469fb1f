"""The digest of the code that draws pictures, kept beside those of the gallery, so that a test
finds a picture that is older than the code.

What cannot change a picture is left out: docstrings, comments and imports.
"""

from __future__ import annotations

import ast
import json
from hashlib import sha256
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
GALLERY = ROOT / "docs" / "gallery"
DIGESTS = GALLERY / "drawn.json"
"""The digest with which each picture was drawn, by its file's name."""

BY_A_BROWSER = ("report.png", "view.png")
"""Pictures of pages, which a browser draws."""


FOLDERS = "film", "support/pictures"
"""Folders of the modules that draw."""


def digest(package: Path = ROOT / "factory") -> str:
    """The digest of all modules that draw."""
    found = sha256()
    for path in sorted(path for folder in FOLDERS for path in (package / folder).glob("*.py")):
        found.update(ast.dump(_essence(ast.parse(path.read_text("utf-8")))).encode())
    return found.hexdigest()[:16]


def _essence(tree: ast.Module) -> ast.Module:
    """A module without what cannot change a picture."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [one for one in body if not _is_idle(one)]  # type: ignore[attr-defined]
    return tree


def _is_idle(node: ast.stmt) -> bool:
    is_text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    return is_text or isinstance(node, ast.Import | ast.ImportFrom)


def digests() -> dict[str, str]:
    """The digests that are kept."""
    return json.loads(DIGESTS.read_text("utf-8")) if DIGESTS.exists() else {}


def keep(name: str) -> None:
    """Note that a picture has just been drawn."""
    kept = {**digests(), name: digest()}
    DIGESTS.write_text(json.dumps(kept, indent=1, sort_keys=True) + "\n", "utf-8")
