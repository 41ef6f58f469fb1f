"""Certificates in files, checked against a net from the command line."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from factory.apps.exports.certificate.listing import digest
from tests.command_line import Done, Terminal
from tests.paths import PAPER

Json = dict[str, Any]


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
