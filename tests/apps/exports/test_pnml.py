"""PNML: read ∘ write is the identity; what is broken is diagnosed."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from factory.apps.exports.pnml import write_pnml
from factory.apps.foreign_nets.behaviour import analyse
from factory.apps.foreign_nets.pnml_reader import read_pnml
from factory.support.errors import InputError
from factory.theory.nets.marked import MarkedNet
from tests.command_line import Terminal
from tests.net_values import random_marked_net
from tests.pag_values import factory_of, paper
from tests.paths import ROOT

NS = "http://www.pnml.org/version-2009/grammar/pnml"


@given(st.integers(0, 10**9))
def test_any_marked_net_survives(seed: int) -> None:
    net = random_marked_net(random.Random(seed))
    assert read_pnml(write_pnml(net)) == net


def test_an_id_that_is_the_name_of_another() -> None:
    names = {"a": "b", "b": "c", "c": "c", "d": "#a"}
    places = (f'<place id="{i}"><name><text>{n}</text></name></place>' for i, n in names.items())
    found = read_pnml(minimal("".join(places)))
    assert isinstance(found, MarkedNet)
    assert [p.name for p in found.net.places] == ["p", "a", "b", "c", "d"]


def edited(old: str, new: str) -> str:
    """The paper's net with one place of its text changed."""
    text = write_pnml(factory_of(paper()).net)
    assert re.search(old, text)
    return re.sub(old, new, text, count=1)


def test_a_net_with_an_arc_cut_names_robots_labels_and_lines() -> None:
    verdict = analyse(read_pnml(edited('<arc id="a5"[^>]*/>\n', ""), "cut.pnml"))
    first = verdict.witness[0]
    assert verdict.gear_net is False
    assert first.kind == "missing consumer"
    assert (first.robots, first.labels) == (("r3",), ("sub2",))
    assert first.lines == ("test.pag:4",)


def test_a_net_with_a_place_cut() -> None:
    text = edited(r'<place id="p8">.*\n.*\n', "")
    text = re.sub(r'<arc [^>]*"p8"[^>]*/>\n', "", text)
    verdict = analyse(read_pnml(text))
    assert verdict.gear_net is False
    assert "r1" in {robot for w in verdict.witness for robot in w.robots}


def minimal(content: str = "", kind: str = "http://www.pnml.org/version-2009/grammar/ptnet") -> str:
    """A net with one transition and what else is given."""
    return (
        f'<pnml xmlns="{NS}">\n<net id="n" type="{kind}">\n<page id="g">\n'
        f'<place id="p"/>\n<transition id="t"/>\n{content}\n</page></net></pnml>'
    )


def arc(target: str = "t", inside: str = "") -> str:
    """A net with an arc from its place."""
    return minimal(f'<arc id="a" source="p" target="{target}">{inside}</arc>')


LAUGHS = '<!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]><pnml>&b;</pnml>'
PLACE = '<place id="q">\n<initialMarking><text>two</text></initialMarking></place>'


@pytest.mark.parametrize(
    ("text", "code", "line", "message"),
    [
        (LAUGHS, "Syntax", 1, "document type"),
        ("<html/>", "BadNet", 1, "<html>"),
        ("<pnml/>", "BadNet", 1, "0 nets"),
        (arc().replace('"a"', '"p"'), "BadNet", 6, "used twice"),
        (minimal("<place/>"), "BadNet", 6, "without id"),
        (arc("p"), "BadNet", 6, "from place 'p' to place"),
        (arc("t", "<inscription><text>2</text></inscription>"), "BadNet", 6, "weight '2'"),
        (arc("t", '<type value="inhibitor"/>'), "BadNet", 6, "type 'inhibitor'"),
        (arc("t", '</arc>\n<arc id="b" source="p" target="t">'), "BadNet", 7, "second arc"),
        (minimal(PLACE), "BadNet", 7, "initial marking is 'two'"),
        (minimal('<referencePlace id="r" ref="r"/>'), "BadNet", 6, "stands for itself"),
        (minimal('<referencePlace id="r" ref="t"/>'), "BadNet", 6, "refers to a transition"),
        (minimal().replace("</net>", '<place id="z"/></net>'), "BadNet", 7, "outside every page"),
    ],
)
def test_what_is_broken_is_diagnosed(text: str, code: str, line: int, message: str) -> None:
    with pytest.raises(InputError) as caught:
        read_pnml(text, "bad.pnml")
    first = caught.value.diagnostics[0]
    assert (first.code, first.position and first.position.line) == (code, line)
    assert first.position is not None
    assert str(first.position).startswith("bad.pnml:")
    assert message in first.message
    assert first.hint


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('<gear robot="r2"', '<gear robot="r1"', "names of their own"),
        ('size="3"', 'size="many"', "size of a mode"),
        ('<move from="p0 0"', '<move from="p0 1"', "not a bijection"),
    ],
)
def test_notes_that_contradict_the_net_are_refused(old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_pnml(edited(old, new))


def test_several_faults_are_reported_at_once() -> None:
    arcs = '<arc id="a" source="x" target="t"/>\n<arc id="b" source="p" target="y"/>'
    with pytest.raises(InputError) as caught:
        read_pnml(minimal(arcs))
    assert [d.position and d.position.line for d in caught.value.diagnostics] == [6, 7]


def test_check_and_export_tell_of_it(run: Terminal, tmp_path: Path) -> None:
    file, out = ROOT / "examples" / "stool.pag", tmp_path / "stool.pnml"
    told = run("check", file, "-v").out
    assert "live: yes" in told.split("coordinated")[1].splitlines()[0]
    assert "order place" in told
    assert not run("export", file, "--format", "pnml", "--of", "coordinated", "-o", out).status
    again = run("check", out).out
    assert "live: yes, safe: yes, reversible: yes" in again
    assert "tray" in out.read_text()
