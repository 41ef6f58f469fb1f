"""The other package that is imported as `factory`, factory_boy: in one environment the files of one
replace those of the other."""

from __future__ import annotations

import sys
from pathlib import Path

from factory.support.version import release

MEND = (
    "give each an environment of its own: python -m venv DIR, DIR/bin/pip install klavins-factory"
)

FOLDER = Path(__file__).parent.parent


def is_mixed() -> bool:
    """Whether files of factory_boy lie among those of this package."""
    return (FOLDER / "declarations.py").is_file()


def clash() -> str:
    """What is wrong with the import name, "" for nothing."""
    other = release("factory_boy")
    if not hasattr(sys.modules["factory"], "load_pag"):
        if other:
            return (
                f"`import factory` gives factory_boy {other}: it was installed after this package"
            )
        return "`import factory` gives nothing: factory_boy took its __init__.py along, uninstalled"
    if other or is_mixed():
        return f"factory_boy {other}, which has the same import name, is in this environment"
    return ""
