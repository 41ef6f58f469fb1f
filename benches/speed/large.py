"""Products of more than a thousand parts: how long it takes to import, build and run them."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import factory
from benches.fidelity.products import BRICKS
from benches.speed.processes import FACTORY, run
from benches.tables import table
from factory.theory.problem.pag import PAG, Assembly

TOWN = (("5935-1-IslandHopper", 6), ("889-1-RadarTruck", 1))
"""Models of bricks that stand side by side, and how many of each: 1,253 bricks."""

APART = 0.35
"""Between two of them [m]."""

OFFSET = 1e-5
"""Between two bricks that a model has in one place [m]."""


def town() -> dict[str, Any]:
    """The tree of all of them, for `import`. One after the other is added to those before."""
    found: dict[str, Any] = {}
    number = 0
    for name, copies in TOWN:
        pag = factory.load_pag(BRICKS / f"{name}.pag")
        for _ in range(copies):
            node = {**tree(pag, pag[pag.root], number, {}), "at": [APART * number, 0, 0]}
            number += 1
            found = {"name": f"town{number}", "children": [found, node]} if found else node
    return found


def tree(pag: PAG, node: Assembly, number: int, placed: dict[object, int]) -> dict[str, Any]:
    """A sub-assembly with all its parts, whose labels end with a number. Bricks that the model has
    twice in one place, which `import` refuses, are raised by an offset each time."""
    name = f"{node.label}-{number}"
    if node.inputs:
        return {"name": name, "children": [tree(pag, pag[i], number, placed) for i in node.inputs]}
    given = {p.name: p.value for p in node.parameters}
    mesh, (x, y, z) = Path(str(given.pop("mesh"))).name, given.pop("pos")
    key = mesh, x, y, z, given.get("quat")
    again = placed.get(key, 0)
    placed[key] = again + 1
    return {"name": name, "part": mesh, "at": [x, y, z + OFFSET * again], **given}


def measure(quick: bool = False) -> Iterator[dict[str, Any]]:
    """Each command once, in a process of its own, with an empty cache."""
    rows = list[dict[str, Any]]()
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        environment = {"XDG_CACHE_HOME": str(place / "cache")}

        def timed(name: str, *words: object) -> dict[str, Any]:
            done = run([*FACTORY, *words, "--json"], **environment)
            said = json.loads(done.text)
            rows.append(
                {
                    "product": name,
                    "command": str(words[0]),
                    "seconds": done.seconds,
                    "megabytes": done.megabytes,
                    "said": {key: said.get(key) for key in ("robots", "parts", "wip")},
                }
            )
            print(".", end="", flush=True)
            return {"rows": rows}

        (place / "town.json").write_text(json.dumps(town()))
        pag = place / "town" / "town.pag"
        source, meshes = place / "town.json", BRICKS / "bricks"
        yield timed("town", "import", source, "--meshes", meshes, "-o", pag.parent)
        if not quick:
            yield timed("town", "build", pag, "--mjcf", place / "town.xml")
            yield timed("town", "run", pag, "--units", 1)
    print()


def section(results: dict[str, Any]) -> str:
    """The report."""
    head = ("product", "command", "seconds", "memory", "robots", "bodies", "units inside")
    rows = [
        (
            row["product"],
            f"`{row['command']}{' --units 1' if row['command'] == 'run' else ''}`",
            f"{row['seconds']:.0f}",
            f"{row['megabytes']:.0f} MB",
            row["said"]["robots"],
            row["said"]["parts"] if row["command"] == "build" else None,
            row["said"]["wip"],
        )
        for row in results["rows"]
    ]
    return "\n\n".join(
        [
            "## Large products",
            "*Town*: six Island Hoppers and a Radar Truck side by side, 1,253 bricks with meshes,"
            " as a tree of meshes. Each command once, in a process of its own; nothing is in the"
            " cache when a product's first one begins. *Units inside*: the bound that `build`"
            " chooses, because the whole pool would have more than 8,000 bodies. The rocket, 1,845"
            " parts without shapes, is built in the [comparison](comparison.md#bricks).",
            table(head, rows),
        ]
    )
