"""Input that is too large, endless or beyond all bounds: refused before it costs memory or time."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from factory.apps.foreign_nets import pnml_reader
from factory.apps.log.content import RECORD
from factory.support import files, xml_tree
from factory.support.errors import SHOWN, InputError
from factory.support.files import MESH, MIB, TABLE, TEXT, read_bytes
from factory.theory.lang import load_templates, read_pag
from tests.command_line import Terminal
from tests.paths import PAPER, ROOT

PART = 'root = p; p = atomic(mesh = "p.obj");'
NET_OF = '<pnml><net id="n" type="x/ptnet"><page id="g">{}</page></net></pnml>'


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


READERS = [
    (["check", PAPER, "--templates", "own"], "own/x.op", TEXT),
    (["check", "p.pag"], "factory.toml", TABLE),
    (["check", "p.pag"], "p.obj", MESH),
    (["import", "t.json", "-o", "out"], "p.obj", MESH),
    (["import", "m.ldr", "--library", "own", "-o", "out"], "own/LDConfig.ldr", TEXT),
    (["monitor", "F"], "", RECORD),
]
"""Commands, the file that they read, where they do not name it, and the most that they read."""


@pytest.mark.parametrize(("words", "name", "most"), READERS, ids=str)
def test_a_file_that_is_too_large_is_not_read(
    run: Terminal, here: Path, words: list[object], name: str, most: int
) -> None:
    file = _prepare(here, words, name)
    with file.open("wb") as stream:
        stream.truncate(most + 1)
    done = run(*words, "--json")
    assert done.status == 2
    assert (
        f"larger than {most // MIB} MiB, the most that is read" in done.json["errors"][0]["message"]
    )


@pytest.mark.parametrize(("words", "name", "most"), READERS, ids=str)
def test_devices_and_silent_pipes_are_not_waited_for(
    run: Terminal,
    here: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: list[object],
    name: str,
    most: int,
) -> None:
    monkeypatch.setattr(files, "PATIENCE", 0.01)
    file = _prepare(here, words, name)
    for put in (lambda: file.symlink_to("/dev/zero"), lambda: os.mkfifo(file)):
        put()
        done = run(*words, "--json")
        found = {"factory.toml": 0, "own/LDConfig.ldr": 0}.get(name, 2)
        assert done.status == found, done
        file.unlink()


def _prepare(folder: Path, words: list[object], name: str) -> Path:
    """The file that a command reads, which is not there yet, beside others that are right."""
    (folder / "own").mkdir()
    (folder / "p.pag").write_text(PART if name == "p.obj" else "root = p; p = atomic();")
    (folder / "t.json").write_text('{"name": "t", "children": ["p.obj", "p.obj"]}')
    (folder / "m.ldr").write_text("3 16 0 0 0 10 0 0 0 10 0\n1 4 0 0 0 1 0 0 0 1 0 0 0 1 a.dat\n")
    (folder / "a.dat").write_text("3 16 0 0 0 10 0 0 0 10 0\n3 16 0 0 0 10 0 0 0 0 10\n")
    own = next((str(word) for word in words if str(word)[0] == "F"), name)
    return folder / own


def test_what_comes_through_a_pipe_is_read_as_far_as_a_file_is(tmp_path: Path) -> None:
    for size, is_read in ((0, False), (1, True), (3 * MIB, True), (3 * MIB + 1, False)):
        pipe = tmp_path / f"pipe{size}"
        os.mkfifo(pipe)
        writer = f"import sys; open({str(pipe)!r}, 'wb').write(b'x' * {size})"
        with subprocess.Popen([sys.executable, "-c", writer], stderr=subprocess.DEVNULL):
            if is_read:
                assert read_bytes(pipe, 3 * MIB) == b"x" * size
            else:
                with pytest.raises(
                    OSError, match="larger than 3 MiB" if size else "nothing is wri"
                ):
                    read_bytes(pipe, 3 * MIB)


def test_process_substitution_and_stdin() -> None:
    command = f"{sys.executable} -m factory check"
    for words in (f"{command} <(cat {PAPER}) -q", f"cat {PAPER} | {command} /dev/stdin -q"):
        done = subprocess.run(["bash", "-c", words], cwd=ROOT, capture_output=True, check=False)
        assert (done.returncode, done.stderr) == (0, b"")


def test_of_many_errors_the_first_are_told_and_the_others_counted(
    run: Terminal, here: Path
) -> None:
    unused = "".join(f"p{i} = atomic();\n" for i in range(SHOWN + 23))
    (here / "p.pag").write_text(f"root = a; a = atomic();\n{unused}")
    done = run("check", "p.pag", "--json")
    assert done.status == 2
    assert len(done.json["errors"]) == SHOWN and done.json["errors_left_out"] == 23
    assert done.err.count("UnreachableLabel") == SHOWN
    assert done.err.endswith("... and 23 more errors\n")
    with pytest.raises(InputError) as caught:
        read_pag((here / "p.pag").read_text(), load_templates([ROOT / "templates"]))
    assert len(caught.value.diagnostics) == SHOWN + 23
    assert str(caught.value).endswith("... and 23 more errors")


def test_unknown_nodes_of_a_net_get_few_suggestions(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    monkeypatch.setattr(pnml_reader, "did_you_mean", lambda name, *_: asked.append(name) or "")
    arcs = "".join(f'<arc id="a{i}" source="s{i}" target="t{i}"/>' for i in range(500))
    with pytest.raises(InputError) as caught:
        pnml_reader.read_pnml(NET_OF.format(arcs))
    assert len(caught.value.diagnostics) == 1000
    assert len(asked) == pnml_reader.SUGGESTIONS


def test_a_net_of_too_many_elements(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xml_tree, "MOST", 10)
    with pytest.raises(InputError, match="1:31: BadNet it has more than 10 elements"):
        pnml_reader.read_pnml("<a>" * 11 + "</a>" * 11)


def test_references_lead_to_their_node_in_a_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """A chain of references is walked once, not once from each of its links."""
    count = 300
    chain = "".join(f'<referencePlace id="r{i}" ref="r{i + 1}"/>' for i in range(count))
    net = NET_OF.format(f'{chain}<place id="r{count}"/>')
    reader = pnml_reader._Reader(xml_tree.XmlDocument("<text>", net.split("\n"), "BadNet"))
    looked_up: list[str] = []

    class Nodes(dict[str, xml_tree.Element]):
        def __getitem__(self, name: str) -> xml_tree.Element:
            looked_up.append(name)
            return super().__getitem__(name)

    reader.nodes = Nodes()
    reader.net(reader.document.read(net, frozenset()))
    assert len(looked_up) < 4 * count


def test_yaml_is_not_nested_without_end(run: Terminal, here: Path) -> None:
    (here / "t.yaml").write_text("[" * 20_000)
    (error,) = run("import", "t.yaml", "-o", "out", "--json").json["errors"]
    assert error["message"] == "more than 1000 values are nested here"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"speed = " + b"9" * 5000, "a number has too many digits"),
        (b"speed = 1 # \xff", "byte 0xff is not UTF-8 text"),
        (b"speed = " + b"[" * 5000, "the file is nested too deeply"),
    ],
)
def test_settings_are_refused_in_plain_words(
    run: Terminal, here: Path, content: bytes, words: str
) -> None:
    (here / "p.pag").write_text("root = p; p = atomic();")
    (here / "factory.toml").write_bytes(content)
    (error,) = run("check", "p.pag", "--json").json["errors"]
    assert (error["code"], error["message"]) == ("Syntax", words)


def test_a_long_text_in_quotes_takes_little_memory(here: Path) -> None:
    (here / "p.pag").write_text(f'root = a; a = atomic(mesh = "{"x" * 15_000_000}.obj");')
    words = f"ulimit -v 2000000; {sys.executable} -m factory check p.pag --json"
    done = subprocess.run(["bash", "-c", words], capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr[:1000]
    assert "there is no mesh file" in done.stdout


def test_a_named_pipe_is_opened_once(here: Path) -> None:
    """Its content cannot be had a second time, for the receipt of a build."""
    os.mkfifo("pipe")
    words = f"cat {PAPER} > pipe & {sys.executable} -m factory build pipe --mjcf m.xml -q"
    done = subprocess.run(["bash", "-c", words], timeout=60, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
