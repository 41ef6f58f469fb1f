"""The law that the core names no app: neither in code nor in what it says of itself."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

from tests.house import FLOORS, House

WORDS = {
    "deviations": r"deviations?|disturb\w*",
    "recovery": r"recover\w*|undo\w*|undone|spares?|scrap\w*",
    "monitor": r"monitor\w*",
    "live": r"interven\w*|browser",
    "log": r"logs?|logged|logging",
    "report": r"html",
    "plc": r"plc|opcua|opc",
    "relay": r"relay\w*",
    "platen": r"platens?|tiles?|tiled",
    "few robots": r"tees?|stems?",
    "revise": r"revis\w*",
    "studies": r"pareto|sweeps? of|fidelity",
    "mixes": r"mix\w*",
    "demand": r"demands?|demanded|wip",
    "manipulators": r"manipulat\w*",
}
"""What each app or feature is called, as an expression that a word of it matches whole."""

KEPT = "named_in_core.toml"
"""The modules that still name one, by its name."""

WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
"""A word of a name or of a text: `with_tees` has two, `MonitorSubject` too."""


def named(house: House) -> dict[str, set[str]]:
    """The modules of the core that name each app or feature, in names or in texts."""
    rooms = {room for floor in FLOORS for room in floor}
    patterns = {name: re.compile(pattern) for name, pattern in WORDS.items()}
    there: dict[str, set[str]] = {name: set() for name in WORDS}
    for module in house.modules.values():
        if module.room in rooms:
            words = {word.lower() for word in WORD.findall(module.text)}
            for name, pattern in patterns.items():
                if any(pattern.fullmatch(word) for word in words):
                    there[name].add(module.name)
    return there


def listed(root: Path) -> dict[str, set[str]]:
    """The list that is kept."""
    path = root / "tests" / KEPT
    kept = tomllib.loads(path.read_text("utf-8")) if path.exists() else {}
    return {name: {*modules} for name, modules in kept.items()}


def named_apps(house: House) -> Iterator[str]:
    """Modules of the core that name an app and are not in the list, and lines of the list that
    nothing needs."""
    kept = listed(house.root)
    for name, modules in named(house).items():
        known = kept.get(name, set())
        yield from (f"{module} names {name}" for module in sorted(modules - known))
        yield from (f"{module} no longer names {name}" for module in sorted(known - modules))
