"""`check --clearance DIR`: what `build -o DIR` writes of every example is proved from its files
alone; what is forged is refused by name, and what is broken is diagnosed."""

from __future__ import annotations

import ast
import json
import random
import re
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import pytest

from factory.api import HOMES
from factory.apps.exports.build import BuildRequest, build
from factory.apps.exports.clearance.checking import faults_of
from factory.apps.exports.clearance.documents import ENDINGS, read_folder
from factory.pipeline import read
from factory.support.errors import InputError
from factory.theory.nets.verify import proved
from tests.command_line import Terminal
from tests.paths import ROOT

Json = Any


MUTANTS = 12
"""So many documents are changed at one place."""


@cache
def built(name: str) -> Path:
    """The folder of an example that is built once."""
    import tempfile

    folder = Path(tempfile.mkdtemp(prefix="clearance-")) / name
    project = read(ROOT / "examples" / f"{name}.pag")
    build(project, proved(project.layout.factory.net), BuildRequest(output=folder))
    return folder


def test_the_checker_knows_nothing_of_layouts() -> None:
    """It shares no code with the search, nor with what writes its files."""
    allowed = (
        *("support", "apps.foreign_nets", "theory.lang.source", "theory.nets.marked"),
        *("apps.exports.clearance", "apps.log.content"),
    )
    homes = {name: f"factory.{home}" for home, names in HOMES.items() for name in names.split()}
    modules = [*(ROOT / "factory" / "apps" / "exports" / "clearance").glob("*.py")]
    assert len(modules) > 3
    for module in modules:
        nodes = ast.walk(ast.parse(module.read_text()))
        imports = [
            homes.get(name.name, "api") if node.module == "factory.api" else node.module or ""
            for node in nodes
            if isinstance(node, ast.ImportFrom)
            for name in node.names
        ]
        ours = [name.removeprefix("factory.") for name in imports if name.startswith("factory.")]
        assert not [name for name in ours if not name.startswith(allowed)], module.name


@dataclass
class Forgery:
    """The documents of an example, to be changed."""

    folder: Path
    name: str = "stool"

    def path(self, end: str) -> Path:
        return self.folder / f"{self.name}.{end}"

    def edit(self, end: str, change: Callable[[Json], object]) -> None:
        document = json.loads(self.path(end).read_text())
        change(document)
        self.path(end).write_text(json.dumps(document))

    def ways(self, change: Callable[[list[Json]], object]) -> None:
        self.edit("ways.json", lambda document: change(document["ways"]))

    def sub(self, end: str, pattern: str, new: str) -> None:
        text = self.path(end).read_text()
        assert re.search(pattern, text)
        self.path(end).write_text(re.sub(pattern, new, text))


def cut(ways: list[Json], machine: str, share: float = 0.0) -> None:
    """Leave so much of the spans of a machine, from their lower ends."""
    for way in ways:
        if way["machine"] == machine:
            way["spans"] = [[[a, a + share * (b - a)] for a, b in group] for group in way["spans"]]


def without(ways: list[Json], machine: str) -> None:
    """Leave out the ways of machines whose names begin so."""
    ways[:] = [way for way in ways if not way["machine"].startswith(machine)]


def cut_all(ways: list[Json]) -> None:
    for machine in {way["machine"] for way in ways}:
        cut(ways, machine)


def leave_out(forgery: Forgery, machine: str) -> None:
    """Leave out a machine, and its pairs."""
    forgery.ways(lambda ways: without(ways, machine))

    def unpaired(document: Json) -> None:
        pairs = [p for p in document["excluded"] if machine not in p["machines"]]
        assert len(pairs) < len(document["excluded"])
        document["excluded"] = pairs

    forgery.edit("clearance.json", unpaired)


def rename(ways: list[Json], machine: str, name: str) -> None:
    for way in ways:
        if way["machine"] == machine:
            way["machine"] = name


def invent(document: Json, ends: tuple[str, str]) -> None:
    """A place that all ways share."""
    document["places"].append({"place": "always", "before": ends[0], "after": ends[1], "tokens": 1})
    for way in document["ways"]:
        way["places"].append("always")


def share(document: Json) -> None:
    """All ways share a place of the net."""
    for way in document["ways"]:
        way["places"] = [*dict.fromkeys([*way["places"], "r1:topped"])]


def forge_net(forgery: Forgery) -> None:
    """A place that all ways share, in the net as well: it is always marked."""
    forgery.edit("ways.json", lambda d: invent(d, ("topped_s", "topped_s")))
    transition = re.search(
        r'<transition id="([^"]+)">.{0,80}?<text>topped_s</text>',
        forgery.path("coordinated.pnml").read_text(),
        re.DOTALL,
    )
    assert transition is not None
    place = (
        '<place id="z"><name><text>always</text></name>'
        "<initialMarking><text>1</text></initialMarking></place>"
        f'<arc id="z1" source="z" target="{transition[1]}"/>'
        f'<arc id="z2" source="{transition[1]}" target="z"/></page>'
    )
    forgery.sub("coordinated.pnml", "</page>", place)


FORGERIES: dict[str, tuple[Callable[[Forgery], object], tuple[str, ...]]] = {
    "spans cut to points": (lambda f: f.ways(cut_all), ("joint 'r1/slide'", "beyond its ways")),
    "two machines called one": (
        lambda f: f.ways(lambda w: rename(w, "r4", "r1")),
        ("called 'r1'", "r1/carriage and r4/carriage"),
    ),
    "one machine called two": (
        lambda f: f.ways(lambda w: rename(w[:1], "r1", "r0")),
        ("r1/carriage", "called r0 and r1"),
    ),
    "a place that all share": (
        lambda f: f.edit("ways.json", lambda d: invent(d, ("topped_s", "topped_e"))),
        ("'always' is not of the net",),
    ),
    "a place of the net that all share": (lambda f: f.edit("ways.json", share), ("r4 is in none",)),
    "a place in the net, too": (forge_net, ("'always'", "to the same")),
    "tokens": (
        lambda f: f.edit("ways.json", lambda d: d["places"][0].update(tokens=7)),
        ("place", "with 7 tokens", "in the net"),
    ),
    "a circuit": (
        lambda f: f.edit("clearance.json", lambda d: d["excluded"][0]["circuit"].pop()),
        ("its circuit",),
    ),
}
"""What is changed in the files of the stool, and words of what is said then."""


@pytest.fixture
def forgery(tmp_path: Path) -> Forgery:
    return Forgery(Path(shutil.copytree(built("stool"), tmp_path / "built")))


@pytest.mark.parametrize("name", FORGERIES)
def test_what_is_forged_is_refused_by_name(name: str, forgery: Forgery) -> None:
    change, words = FORGERIES[name]
    change(forgery)
    faults = faults_of(read_folder(forgery.folder))
    assert any(all(word in fault for word in words) for fault in faults), faults[:5]


def test_the_command_says_whether_it_holds(forgery: Forgery, run: Terminal) -> None:
    done = run("check", "--clearance", forgery.folder)
    assert (done.status, done.err) == (0, "") and "no two machines ever meet" in done.out
    assert run("check", "--clearance", forgery.folder, "--json").json["holds"] is True
    leave_out(forgery, "r4")
    done = run("check", "--clearance", forgery.folder)
    assert (
        done.status == 1 and "BadProof 'r4/carriage' has joint 'r4/slide', and no ways" in done.err
    )
    done = run("check", "--clearance", forgery.folder, "--json")
    assert done.status == 1 and not done.json["holds"] and "r4/carriage" in done.json["faults"][0]
    done = run("check", "x.pag", "--clearance", forgery.folder)
    assert done.status == 2 and "Usage" in done.err


def halved(forgery: Forgery, end: str) -> None:
    content = forgery.path(end).read_bytes()
    forgery.path(end).write_bytes(content[: len(content) // 2])


BROKEN: dict[str, Callable[[Forgery], object]] = {
    **{f"no {end}": partial(lambda end, f: f.path(end).unlink(), end) for end in ENDINGS},
    **{f"half of {end}": partial(lambda end, f: halved(f, end), end) for end in ENDINGS},
    **{
        f"bytes in {end}": partial(lambda end, f: f.path(end).write_bytes(b"\xff\x00" * 50), end)
        for end in ENDINGS
    },
    "a list": lambda f: f.path("ways.json").write_text("[]"),
    "an interval of three": lambda f: f.ways(lambda w: w[0]["spans"][0][0].append(1.0)),
    "turned": lambda f: f.ways(lambda w: w[0]["spans"][0].__setitem__(0, [1.0, 0.0])),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_broken_is_diagnosed(name: str, forgery: Forgery) -> None:
    BROKEN[name](forgery)
    with pytest.raises(InputError) as caught:
        read_folder(forgery.folder)
    assert {d.code for d in caught.value.diagnostics} <= {"BadProof", "BadNet", "Syntax"}


def leaves(value: Json) -> Iterator[tuple[Json, Any]]:
    """The places in a document: a container, and a key of it."""
    if isinstance(value, dict | list):
        for key in [*value] if isinstance(value, dict) else range(len(value)):
            yield value, key
            yield from leaves(value[key])


@pytest.mark.parametrize("end", ENDINGS[2:])
def test_a_document_that_is_changed_anywhere_is_read_or_diagnosed(end: str, tmp_path: Path) -> None:
    rng, folder = random.Random(end), tmp_path / "built"
    shutil.copytree(built("paper"), folder)
    forgery = Forgery(folder, "paper")
    original = forgery.path(end).read_text()
    for _ in range(MUTANTS):
        document = json.loads(original)
        where, key = rng.choice([*leaves(document)])
        where[key] = rng.choice([None, True, -1, 0.5, "r2", [], {}, ["r1", "r1"], [[0, 1e308]]])
        forgery.path(end).write_text(json.dumps(document))
        try:
            faults_of(read_folder(folder))
        except InputError as error:
            assert error.diagnostics[0].code == "BadProof"
