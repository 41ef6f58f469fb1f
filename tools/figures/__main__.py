"""Draws the figures of the theory pages.

usage: python -m tools.figures [-o FOLDER] [NAME ...]    (default: all, into docs/theory/figures)
"""

from __future__ import annotations

import argparse
from pathlib import Path

from tools.figures.all import FIGURES

ROOT = Path(__file__).resolve().parents[2]


def main() -> None:
    """Draw what the command line names."""
    parser = argparse.ArgumentParser(prog="python -m tools.figures")
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(FIGURES))
    parser.add_argument("-o", dest="folder", type=Path, default=ROOT / "docs/theory/figures")
    options = parser.parse_args()
    if unknown := {*options.names} - {*FIGURES}:
        parser.error(f"no figure {', '.join(sorted(unknown))}; valid: {', '.join(FIGURES)}")
    options.folder.mkdir(parents=True, exist_ok=True)
    for name in options.names or FIGURES:
        path = options.folder / f"{name}.svg"
        path.write_text(FIGURES[name](), "utf-8", newline="\n")
        print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
