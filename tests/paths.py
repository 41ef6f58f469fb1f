"""Where the tests' inputs lie, and what a folder holds."""

from __future__ import annotations

from pathlib import Path

TESTS = Path(__file__).resolve().parent
ROOT = TESTS.parent
EXAMPLES = ROOT / "examples"
PAPER = EXAMPLES / "paper.pag"


def files_in(folder: Path) -> dict[str, bytes]:
    """Every file below a folder, by its name, with its content."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }
