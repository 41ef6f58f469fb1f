"""Explanations: one for every code that the package can raise, with examples that raise it."""

from __future__ import annotations

import ast
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import trimesh

from factory.support.explanations import codes, explain
from tests.command_line import Terminal
from tests.house import this_house
from tests.paths import files_in
from tests.slow import slow_but

CODE = re.compile(r"[A-Z][A-Za-z]+")

NOT_PROVOKED = {
    *("Assets", "Engine", "Internal", "Interrupted", "Killed", "Missing", "NoGL", "NoWay"),
    *("NoVideo", "NoVulkan"),
    *("Astray", "Dropped", "Early", "Exchanged", "Frame", "Order", "Start", "Stuck", "TwoHolders"),
    *("CutOff", "NotProved", "Stalled", "Unstable"),
    *("Contact", "EngineWarning", "GripGap", "HandOffGap", "Missed", "NotRefined"),
    *("BadArm", "BadRobot", "Record", "CannotAssemble", "Hulls", "NotInPlace", "Unit"),
    *("HandOffTurn", "Mass", "NotSolid", "Options", "ProductError", "ProductTurn", "Shape"),
    *("Altered", "NotJudged", "NoWay", "Qualified", "Unseen"),
}
"""Codes that need a broken machine, run or factory, which other tests make."""


def takers(trees: list[ast.Module]) -> dict[str, set[int]]:
    """Functions and classes that take a `code: str`, and at which place: methods less their self.
    `blame` is one that is handed over as a value."""
    found: dict[str, set[int]] = {"blame": {0}}
    for node in (node for tree in trees for node in ast.walk(tree)):
        if isinstance(node, ast.FunctionDef):
            names = [a.arg for a in node.args.args]
            texts = [a.arg for a in node.args.args if a.annotation and _is_str(a.annotation)]
            if "code" in texts:
                at = names.index("code") - (names[0] == "self")
                found.setdefault(node.name, set()).add(at)
        elif isinstance(node, ast.ClassDef):
            fields = [b.target.id for b in node.body if _is_field(b)]  # type: ignore[attr-defined]
            if "code" in fields:
                found.setdefault(node.name, set()).add(fields.index("code"))
    return found


def _is_str(node: ast.expr) -> bool:
    return isinstance(node, ast.Name) and node.id == "str"


def _is_field(node: ast.stmt) -> bool:
    return isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name)


def constants(node: ast.expr) -> Iterator[str]:
    """The constant texts that an expression can have."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.IfExp):
        yield from constants(node.body)
        yield from constants(node.orelse)


def raised(tree: ast.Module, takes: dict[str, set[int]]) -> Iterator[str]:
    """The codes in a module: arguments where a code is taken, and values of what is named so."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "code":
            yield from constants(node.value)
        if not isinstance(node, ast.Call):
            continue
        name = getattr(node.func, "attr", getattr(node.func, "id", ""))
        for place in takes.get(name, ()):
            keyword = next((k.value for k in node.keywords if k.arg == "code"), None)
            given = keyword or (node.args[place] if place < len(node.args) else None)
            yield from constants(given) if given is not None else ()


def raised_anywhere() -> frozenset[str]:
    modules = this_house().modules.values()
    texts, trees = [module.text for module in modules], [module.tree for module in modules]
    takes = takers(trees)
    found = {code for tree in trees for code in raised(tree, takes) if CODE.fullmatch(code)}
    printed = {code for text in texts for code in re.findall(r"([A-Z][a-z]\w+) warning: ", text)}
    return frozenset(found | printed)


def test_every_code_is_explained_and_every_explained_code_is_there() -> None:
    found = raised_anywhere()
    assert found - set(codes()) == set(), "write explanations/CODE.txt for these"
    assert set(codes()) - found == set(), "these are raised nowhere"
    # one code for each way in which the package passes codes on
    assert {"Syntax", "GearNotClosed", "TwoHolders", "Timeout", "MissingPart", "Stuck"} <= found


def test_the_search_for_codes_sees_them() -> None:
    takes = {"Diagnostic": {0}}
    source = 'Diagnostic("One" if x else "Two", "m"); code = "Three"\nDiagnostic(code="Four")'
    assert sorted(raised(ast.parse(source), takes)) == ["Four", "One", "Three", "Two"]


def test_an_explanation_says_what_it_means_and_what_the_remedy_is() -> None:
    for code in codes():
        found = explain(code)
        assert found.code == code
        assert found.title and found.title[0].islower() and not found.title.endswith("."), code
        lines = found.text.splitlines()
        assert max(map(len, lines)) <= 100, code
        assert any(line.startswith("Remedy: ") for line in lines) or code == "Interrupted", code


def example(code: str, folder: Path) -> list[str]:
    """Writes the files of an example; gives its commands."""
    text = explain(code).text
    for name, block in re.findall(r"^ {4}(\S+\.\w+)\n((?: {4}\|.*\n)+)", text, re.M):
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(re.sub(r"^ {4}\| ?", "", block, flags=re.M))
    return re.findall(r"^ {4}\$ factory (.*)$", text, re.M)


DEAR = ("Unreachable", "ArmLoad", "Failed", "NoCell", "NoGrip", "Timeout")
"""Codes whose examples lay cells out, or run; tests of what they are about provoke them sooner."""


@pytest.mark.parametrize(
    "code",
    slow_but({*codes()} - {*DEAR}, [code for code in codes() if code not in NOT_PROVOKED]),
)
def test_the_example_provokes_the_code(
    code: str, run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    commands = example(code, tmp_path)
    assert commands
    for command in commands:
        done = run(*shlex.split(command))
        assert re.search(rf"^(?:.*: )?\s*{code}(?: warning:)? ", done.err + done.out, re.M), done


def test_those_without_an_example_have_none(tmp_path: Path) -> None:
    assert set(codes()) >= NOT_PROVOKED
    assert not any(example(code, tmp_path) for code in NOT_PROVOKED)
    assert files_in(tmp_path) == {}


OPENED, TURNED = 4, 2
LINES = [
    "BadMesh warning: 4 meshes are open: their convex hulls are used; list: -v",
    "BadMesh warning: 2 meshes were repaired: closed, or turned outwards; list: -v",
]


def meshes(folder: Path) -> list[str]:
    """Files of boxes, all different, the first ones without a side, the others inside out."""
    for number in range(OPENED + TURNED):
        box = trimesh.creation.box((0.05, 0.05, 0.05 - 0.001 * number))
        if number < OPENED:
            box.update_faces(np.arange(len(box.faces)) < 10)
        else:
            box.invert()
        box.export(folder / f"{number}.obj")
    return [f"{number}.obj" for number in range(OPENED + TURNED)]


@pytest.fixture(scope="module")
def pag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("warned")
    parts = [
        f'p{n} = atomic ( mesh = "{name}", pos = ({0.05 * n:.2f}, 0, 0) );'
        for n, name in enumerate(meshes(folder))
    ]
    names = ", ".join(f"p{n}" for n in range(len(parts)))
    (folder / "x.pag").write_text("\n".join([f"root = x; x = mate ( {names} );", *parts]))
    return folder / "x.pag"


def test_the_list_is_shown_if_asked_for(run: Terminal, pag: Path, tmp_path: Path) -> None:
    """And by a build that has been left out as well, as nothing has changed since."""
    for _ in range(2):
        done = run("build", pag, "--mjcf", tmp_path / "m.xml", "-v")
        assert done.err.count("is open (not watertight); its convex hull is used") == OPENED
        assert done.err.count("was inside out; it was repaired") == TURNED
    assert run("build", pag, "--mjcf", tmp_path / "m.xml").err.splitlines() == LINES
