"""PNML: read ∘ write is the identity; what is broken is diagnosed."""

from __future__ import annotations

import random
import re
import tracemalloc
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.apps.exports.dot import write_dot
from factory.apps.exports.pnml import write_pnml
from factory.apps.foreign_nets.behaviour import analyse
from factory.apps.foreign_nets.pnml_reader import read_pnml
from factory.support.errors import InputError
from factory.theory.nets.gears import GearNet
from factory.theory.nets.marked import MarkedNet, marked
from factory.theory.nets.petri import Transition
from factory.theory.plant.factory import Factory
from tests.command_line import Terminal
from tests.net_values import (
    net_from,
    planted,
    random_marked_net,
)
from tests.pag_values import factories, factory_of, paper
from tests.paths import ROOT

NS = "http://www.pnml.org/version-2009/grammar/pnml"


@given(factories())
def test_read_after_write_is_the_identity(factory: Factory) -> None:
    text = write_pnml(factory.net)
    net = read_pnml(text, "net.pnml")
    assert net == factory.net
    assert isinstance(net, GearNet)
    assert write_pnml(net) == text
    assert [p.position for p in net.threaded.places] == [
        p.position for p in factory.net.threaded.places
    ]


@given(st.integers(0, 10**9))
def test_any_marked_net_survives(seed: int) -> None:
    net = random_marked_net(random.Random(seed))
    assert read_pnml(write_pnml(net)) == net


def test_it_is_pnml_of_2009() -> None:
    root = ElementTree.fromstring(write_pnml(factory_of(paper()).net))
    assert root.tag == f"{{{NS}}}pnml"
    net = root.find(f"{{{NS}}}net")
    assert net is not None
    assert net.get("type") == "http://www.pnml.org/version-2009/grammar/ptnet"
    page = net.find(f"{{{NS}}}page")
    assert page is not None
    counts = [len(page.findall(f"{{{NS}}}{name}")) for name in ("place", "transition", "arc")]
    assert counts == [19, 14, 38]
    ids = [e.get("id") for e in root.iter() if e.get("id")]
    assert len(ids) == len(set(ids))


def test_names_are_escaped() -> None:
    net = net_from([("a", "b", 1), ("b", "a", 0)])
    named = replace(net.net, transitions=(Transition('<&">'), Transition("ä\x01")))
    found = read_pnml(write_pnml(replace(net, net=named)))
    assert isinstance(found, MarkedNet)
    assert [t.name for t in found.net.transitions] == ['<&">', "ä?"]


def test_equal_names_give_way_to_ids() -> None:
    text = minimal('<place id="x"><name><text>n</text></name></place>').replace('id="n"', 'id="m"')
    more = '<place id="n"/><place id="y"><name><text>n</text></name></place></page>'
    found = read_pnml(text.replace("</page>", more))
    assert isinstance(found, MarkedNet)
    assert [p.name for p in found.net.places] == ["p", "x", "n", "y"]


def test_an_id_that_is_the_name_of_another() -> None:
    names = {"a": "b", "b": "c", "c": "c", "d": "#a"}
    places = (f'<place id="{i}"><name><text>{n}</text></name></place>' for i, n in names.items())
    found = read_pnml(minimal("".join(places)))
    assert isinstance(found, MarkedNet)
    assert [p.name for p in found.net.places] == ["p", "a", "b", "c", "d"]


@given(factories(20), st.randoms(use_true_random=False), st.integers(0, 4))
def test_broken_nets_are_read_and_judged_alike(
    factory: Factory, rng: random.Random, which: int
) -> None:
    net = factory.net
    broken = planted(net, rng, which)
    before, after = analyse(broken), analyse(read_pnml(write_pnml(broken)))
    assert before.as_json() == after.as_json()
    assert not after.holds
    assert any(w.robots for w in after.witness)
    assert any(w.lines for w in after.witness)


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


def test_foreign_lines_are_those_of_the_file() -> None:
    text = re.sub(r"<toolspecific(?s:.*?)</toolspecific>", "", write_pnml(factory_of(paper()).net))
    text = text.replace("<initialMarking><text>1</text></initialMarking>", "", 1)
    verdict = analyse(read_pnml(text, "other.pnml"))
    assert (verdict.gear_net, verdict.live, verdict.legal) == (True, False, False)
    assert all(line.startswith("other.pnml:") for w in verdict.witness for line in w.lines)


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
TWO = "<pnml><net id='a' type='ptnet'/>\n<net id='b' type='ptnet'/></pnml>"
PLACE = '<place id="q">\n<initialMarking><text>two</text></initialMarking></place>'


@pytest.mark.parametrize(
    ("text", "code", "line", "message"),
    [
        ("", "Syntax", 1, "not well-formed"),
        ("pnml", "Syntax", 1, "not well-formed"),
        ("<pnml>\n<net>", "Syntax", 2, "not well-formed"),
        ("\ud800", "Syntax", 1, "not well-formed"),
        (LAUGHS, "Syntax", 1, "document type"),
        ('<!DOCTYPE pnml SYSTEM "x.dtd"><pnml/>', "Syntax", 1, "document type"),
        (minimal() + "\x00", "Syntax", 7, "not well-formed"),
        ("<html/>", "BadNet", 1, "<html>"),
        ("<pnml/>", "BadNet", 1, "0 nets"),
        (TWO, "BadNet", 2, "2 nets"),
        ('<pnml>\n<net id="n" type="x/ptnet"/></pnml>', "BadNet", 2, "no page"),
        (minimal(kind="http://x/symmetricnet"), "BadNet", 2, "symmetricnet"),
        (minimal(kind=""), "BadNet", 2, "without a type"),
        (arc("q"), "BadNet", 6, "unknown node 'q'"),
        (minimal('<arc id="a" source="p"/>'), "BadNet", 6, "nothing"),
        (arc().replace('"a"', '"p"'), "BadNet", 6, "used twice"),
        (minimal("<place/>"), "BadNet", 6, "without id"),
        (arc("p"), "BadNet", 6, "from place 'p' to place"),
        (arc("t", "<inscription><text>2</text></inscription>"), "BadNet", 6, "weight '2'"),
        (arc("t", '<type value="inhibitor"/>'), "BadNet", 6, "type 'inhibitor'"),
        (arc("t", '</arc>\n<arc id="b" source="p" target="t">'), "BadNet", 7, "second arc"),
        (minimal(PLACE), "BadNet", 7, "initial marking is 'two'"),
        (minimal('<referencePlace id="r" ref="x"/>'), "BadNet", 6, "refers to unknown 'x'"),
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


def test_a_size_that_is_not_that_of_the_slots_is_a_fault_of_the_net() -> None:
    text = edited('size="3"', 'size="999999"')
    tracemalloc.start()
    net = read_pnml(text, "large.pnml")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 10_000_000
    first = analyse(net).witness[0]
    assert (first.property, first.kind) == ("gear_net", "slots")
    assert "acts on 999999 robots with slots for r3, r2, r1" in first.reason


def test_several_faults_are_reported_at_once() -> None:
    arcs = '<arc id="a" source="x" target="t"/>\n<arc id="b" source="p" target="y"/>'
    with pytest.raises(InputError) as caught:
        read_pnml(minimal(arcs))
    assert [d.position and d.position.line for d in caught.value.diagnostics] == [6, 7]


def test_pages_and_references_are_followed() -> None:
    inner = (
        '<page id="h"><referencePlace id="r" ref="p"/><transition id="u"/>'
        '<place id="q"><initialMarking><text>1</text></initialMarking></place>'
        '<arc id="a" source="u" target="r"/><arc id="b" source="q" target="u"/></page>'
        '<arc id="c" source="p" target="t"/><arc id="d" source="t" target="q"/>'
    )
    found = read_pnml(minimal(inner))
    assert isinstance(found, MarkedNet)
    assert analyse(found).holds


def test_very_deep_documents_are_no_trouble() -> None:
    deep = "<page id='x'>" + "<a>" * 20_000 + "</a>" * 20_000 + "</page>"
    assert read_pnml(minimal(deep))


@given(st.integers(0, 10**9))
@settings(max_examples=300)
def test_garbled_documents_give_diagnostics_only(seed: int) -> None:
    rng = random.Random(seed)
    text = write_pnml(factory_of(paper()).net)
    for _ in range(rng.randint(1, 4)):
        at, size = rng.randrange(len(text)), rng.choice((1, 2, 30))
        lines = text.split("\n")
        if rng.random() < 0.4:
            del lines[rng.randrange(len(lines))]
            text = "\n".join(lines)
        else:
            text = text[:at] + rng.choice(("", "<", '"', "p0", "99", "&x;")) + text[at + size :]
    try:
        net = read_pnml(text, "garbled.pnml")
    except InputError as error:
        placed = [d.position is not None for d in error.diagnostics]
    else:
        verdict = analyse(net, limit=2_000)
        placed = [verdict.holds or bool(verdict.witness)]
    assert placed
    assert all(placed)


def test_dot_shows_robots_tokens_and_arcs() -> None:
    text = write_dot(factory_of(paper()).net)
    assert text.count("subgraph cluster_") == 6
    assert text.count("●") == 6
    assert text.count("->") == 38
    assert 'label="r3:nopart\\nwait\\n●"' in text


def test_dot_escapes() -> None:
    net = net_from([("a", "b", 7)])
    named = replace(net.net, transitions=(Transition('say "hi"\\'), Transition("x\ny")))
    text = write_dot(replace(net, net=named))
    assert r'xlabel="say \"hi\"\\"' in text
    assert r'xlabel="x\ny"' in text
    assert "● 7" in text
    assert marked(net) is net


def test_check_and_export_tell_of_it(run: Terminal, tmp_path: Path) -> None:
    file, out = ROOT / "examples" / "stool.pag", tmp_path / "stool.pnml"
    told = run("check", file, "-v").out
    assert "live: yes" in told.split("coordinated")[1].splitlines()[0]
    assert "order place" in told
    assert not run("export", file, "--format", "pnml", "--of", "coordinated", "-o", out).status
    again = run("check", out).out
    assert "live: yes, safe: yes, reversible: yes" in again
    assert "tray" in out.read_text()
