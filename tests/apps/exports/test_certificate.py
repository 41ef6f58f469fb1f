"""Certificates: what `certificate` writes passes the check, and nothing tampered with does."""

from __future__ import annotations

import ast
import copy
import json
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given

import factory.apps.exports.certificate
from factory.apps.exports.certificate.check import check_certificate
from factory.apps.exports.certificate.listing import CLAIMS, digest
from factory.apps.exports.certificate.writer import certificate
from factory.apps.foreign_nets.behaviour import analyse
from factory.theory.nets.gears import GearNet
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.petri import Place
from factory.theory.plant.factory import Factory
from tests.command_line import Done, Terminal
from tests.net_values import net_from
from tests.pag_values import factories, factory_of, paper
from tests.paths import PAPER

Json = dict[str, Any]


def certified(net: GearNet | MarkedNet) -> Json:
    """The certificate of a net, through JSON text."""
    found: Json = json.loads(json.dumps(certificate(net, analyse(net))))
    return found


@given(factories())
def test_certificates_of_factories_pass(factory: Factory) -> None:
    document = certified(factory.net)
    assert check_certificate(document) == []
    assert all(document[claim]["holds"] is True for claim in CLAIMS)


@pytest.mark.parametrize(
    "edges", [[("b", "a c", 1), ("a", "b", 0), ("c e", "d", 0), ("d", "e", 0)]]
)
def test_certificates_of_nets_with_choice_pass(edges: list[tuple[str, str, int]]) -> None:
    document = certified(net_from(edges))
    assert check_certificate(document) == []
    assert document["gear_net"]["holds"] is False


def seal(document: Json) -> Json:
    """The document with the digest that belongs to it: what a forger would do."""
    return {**document, "digest": digest(document)}


def leaves(node: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The paths to every scalar."""
    pairs = node.items() if isinstance(node, dict) else enumerate(node)
    for key, value in pairs:
        if isinstance(value, dict | list):
            yield from leaves(value, (*path, key))
        else:
            yield (*path, key)


def tampered(document: Json, path: tuple[Any, ...]) -> Json:
    """The document with one scalar changed."""
    changed = copy.deepcopy(document)
    node: Any = changed
    for key in path[:-1]:
        node = node[key]
    value = node[path[-1]]
    if isinstance(value, bool):
        node[path[-1]] = not value
    elif isinstance(value, int):
        node[path[-1]] = value + 1
    else:
        node[path[-1]] = 0 if value is None else f"{value}x"
    return changed


_FREE = {"name", "mode", "label", "type", "cover"}
"""What a forger may change without a lie: names, and a gear that covers as well."""


def test_tampering_is_caught_although_sealed_again() -> None:
    document = certified(factory_of(paper()).net)
    for path in leaves(document):
        changed = tampered(document, path)
        assert check_certificate(changed) != [], path
        if path != ("digest",) and not _FREE & set(path):
            assert check_certificate(seal(changed)) != [], path


def test_leaving_anything_out_is_caught() -> None:
    document = certified(factory_of(paper()).net)
    for path in leaves(document):
        changed = copy.deepcopy(document)
        node: Any = changed
        for key in path[:-1]:
            node = node[key]
        del node[path[-1]]
        if path != ("digest",):
            changed = seal(changed)
        if not {"mode", "label", "type", "size"} & set(path) and path[:2] != ("gear_net", "meets"):
            assert check_certificate(changed) != [], path


@pytest.mark.parametrize("claim", CLAIMS)
def test_what_is_not_claimed_needs_a_reason(claim: str) -> None:
    document = certified(factory_of(paper()).net)
    for holds in (None, False):
        assert check_certificate(seal({**document, claim: {"holds": holds, "reason": ""}})) != []
    said = seal({**document, claim: {"holds": None, "reason": "not certified"}})
    assert (check_certificate(said) == []) is (claim not in ("live", "safe"))


def test_a_marked_place_without_robots_is_not_legal() -> None:
    subject = MarkedNet.of(factory_of(paper()).net)
    places = (*subject.net.places, Place("spare", (), (), size=0))
    net = replace(subject.net, places=places)
    document = certified(MarkedNet(net, (*subject.tokens, 1), subject.gears, (*subject.slots, ())))
    assert check_certificate(document) == []
    whole = certified(subject)
    assert check_certificate(seal({**document, "legal": whole["legal"]})) != []


def test_what_is_not_live_is_not_reversible() -> None:
    net = net_from([("a", "b", 0), ("b", "c", 0), ("c", "b", 0), ("c", "a", 1)])
    document = certified(net)
    assert document["live"]["holds"] is document["reversible"]["holds"] is False
    document["reversible"] = {"holds": True}
    assert any("for nets that are live" in fault for fault in check_certificate(seal(document)))


@pytest.mark.parametrize("junk", [[], {"schema": 1}, {"schema": 2, "digest": ""}])
def test_junk_is_no_certificate(junk: object) -> None:
    assert len(check_certificate(junk)) >= 1


def test_the_checker_uses_nothing_that_made_the_certificate() -> None:
    folder = Path(factory.apps.exports.certificate.__file__ or "").parent
    checker = {path.stem: path for path in folder.glob("*.py")}
    assert set(checker) == {"__init__", "writer", "proof_file", "check", "listing"}
    allowed = {f"factory.apps.exports.certificate.{name}" for name in ("check", "listing")}
    for name in ("check", "listing"):
        tree = ast.parse(checker[name].read_text("utf-8"))
        froms = {n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
        plain = {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
        inside = {module for module in froms | plain if module.split(".")[0] == "factory"}
        assert inside <= allowed, name
    (docstring,) = ast.parse((folder / "__init__.py").read_text("utf-8")).body
    assert isinstance(docstring, ast.Expr), "the package itself does nothing"


@pytest.fixture
def written(run: Terminal, tmp_path: Path) -> Path:
    """The certificate of the paper's example."""
    file = tmp_path / "proof.json"
    assert run("check", PAPER, "--certificate", file).status == 0
    return file


def refused(done: Done, status: int) -> str:
    """The messages of a refusal."""
    assert done.status == status, done
    assert set(done.codes) == {"BadProof"}
    return "\n".join(error["message"] for error in done.json["errors"])


def exported(run: Terminal, folder: Path) -> str:
    net = folder / "net.pnml"
    assert run("export", PAPER, "--format", "pnml", "-o", net).status == 0
    return net.read_text()


def test_a_certificate_of_another_net(run: Terminal, written: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.pag"
    other.write_text(PAPER.read_text().replace("weld", "press"))
    message = refused(run("check", other, "--against", written, "--json"), 1)
    assert 'of another net: they differ first in place sub2.mode: "weld" and ' in message
    other.write_text("root = a; a = mate(b, c); b = atomic(); c = atomic();")
    message = refused(run("check", other, "--against", written, "--json"), 1)
    assert "they differ first in transition a_s: nothing and " in message
    net = tmp_path / "net.pnml"
    moved = exported(run, tmp_path).replace("<text>1</text>", "<text>0</text>", 1)
    net.write_text(moved)
    message = refused(run("check", net, "--against", written, "--json"), 1)
    assert re.search(r"another net: they differ first in place .*\.tokens: 1 and 0", message)


def change_tokens(document: Json) -> None:
    document["net"]["places"][3]["tokens"] += 1


@pytest.mark.parametrize(
    ("change", "fault"), [(change_tokens, "of another net: they differ first in place")]
)
def test_a_changed_certificate_is_refuted(
    run: Terminal, written: Path, change: Callable[[Json], None], fault: str
) -> None:
    document = json.loads(written.read_text())
    change(document)
    written.write_text(json.dumps(document))
    message = refused(run("check", PAPER, "--against", written, "--json"), 1)
    assert "the digest is not that of the document" in message and fault in message
    written.write_text(json.dumps({**document, "digest": digest(document)}))
    message = refused(run("check", PAPER, "--against", written, "--json"), 1)
    assert "digest" not in message and fault in message


@pytest.mark.parametrize(
    ("content", "place", "words"),
    [
        (lambda text: text[:-2], (1, None), "it ends too early"),
        (lambda text: "[" * 100_000, (1, 1), "no JSON in UTF-8"),
    ],
)
def test_what_cannot_be_read_is_no_certificate(
    run: Terminal,
    written: Path,
    content: Callable[[str], str],
    place: tuple[int, int | None],
    words: str,
) -> None:
    written.write_text(content(written.read_text()))
    done = run("check", PAPER, "--against", written, "--json")
    assert words in refused(done, 2)
    (error,) = done.json["errors"]
    assert error["file"] == str(written)
    assert error["line"] == place[0] and place[1] in (None, error["col"])


def test_files_that_are_none(run: Terminal, written: Path, tmp_path: Path) -> None:
    for file, words in ((tmp_path, "it is a folder"), (tmp_path / "x", "No such file")):
        assert words in refused(run("check", PAPER, "--against", file, "--json"), 2)
    written.write_bytes(b"\xff\xfe{}")
    assert "no JSON in UTF-8" in refused(run("check", PAPER, "--against", written, "--json"), 2)


def test_a_net_that_fails_has_a_certificate_too(run: Terminal, tmp_path: Path) -> None:
    net, file = tmp_path / "net.pnml", tmp_path / "proof.json"
    net.write_text(
        '<pnml><net id="n" type="x/ptnet"><page id="g"><place id="p"/><transition id="t"/>'
        '<arc id="a" source="p" target="t"/><arc id="b" source="t" target="p"/>'
        "</page></net></pnml>"
    )
    assert run("check", net, "--certificate", file).status == 1
    done = run("check", net, "--against", file, "--json")
    assert done.status == 1
    assert done.json["certificate"]["live"] is False
    assert "a reason against gear net" in run("check", net, "--against", file).out
