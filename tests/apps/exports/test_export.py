"""Exporters: found by directory, the same bytes again, what is refused, and what a reader would not
notice. The floor plan: valid, self-contained, to scale, and complete. PNML: read ∘ write is the
identity; what is broken is diagnosed."""

from __future__ import annotations

import hashlib
import json
import os
import random
import re
import struct
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations, pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from factory.apps.exports import exporters
from factory.apps.exports.floor_sheet import write_svg
from factory.apps.exports.pnml import write_pnml
from factory.apps.exports.subject import file_name
from factory.apps.exports.svg import draw_net
from factory.apps.exports.swimlanes import swimlanes
from factory.apps.foreign_nets.behaviour import analyse
from factory.apps.foreign_nets.pnml_reader import read_pnml
from factory.apps.log import read_log
from factory.floor.layout.layout import Layout
from factory.floor.modes.modes import operation_modes
from factory.support.errors import InputError
from factory.theory.nets.marked import MarkedNet
from tests.command_line import Terminal
from tests.export_values import LAMP, kept_log, made, project
from tests.layout_values import many_layouts, paper_layout, row_of_inserts
from tests.net_values import PHILOSOPHERS, net_from, random_marked_net
from tests.pag_values import factory_of, paper
from tests.paths import PAPER, ROOT, files_in


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "paper.log"
    return kept_log(project(PAPER).layout, path, world="ideal", units=2)


def test_help_says_what_each_is(run: Terminal) -> None:
    text = " ".join(run("export", "--help").out.split())
    for exporter in exporters().values():
        assert " ".join(exporter.summary.split()[:3]) in text


def test_the_order_of_hashing_does_not_show() -> None:
    code = (
        "import hashlib, pathlib; from factory.apps.exports import Subject, exporters;"
        "from factory.pipeline import read;"
        f"file = pathlib.Path({str(PAPER)!r}); s = Subject(file, read(file));"
        "made = [e.export(s) for e in exporters().values() if e.takes not in ('log', 'cell')];"
        "print(*(hashlib.sha256(str(m).encode()).hexdigest() for m in made))"
    )
    seed = "1" if os.environ.get("PYTHONHASHSEED") != "1" else "2"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONHASHSEED": seed},
        capture_output=True,
        text=True,
        check=True,
    )
    here = [made(e.format) for e in exporters().values() if e.takes not in ("log", "cell")]
    assert done.stdout.split() == [hashlib.sha256(str(m).encode()).hexdigest() for m in here]


@pytest.mark.parametrize("form", [e.format for e in exporters().values() if e.binary])
def test_what_is_binary_needs_a_file(run: Terminal, form: str, log: Path) -> None:
    file = log if exporters()[form].takes == "log" else PAPER
    done = run("export", file, "--format", form)
    assert done.status == 2
    assert done.err == (
        f"Usage {form} is binary and is not written to a terminal\n"
        f"    give -o OUT.{exporters()[form].ending or form}\n"
    )


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--format", "csv"], "Usage csv is made from a log; '{}' is a PAG\n    keep one first:"),
        (["--format", "dxf", "--of", "x"], "Usage format dxf offers no choice, so no --of\n"),
        (
            ["--format", "svg", "--of", "nett"],
            "Usage --of 'nett' is none of the views\n    did you mean",
        ),
        (["--format", "stl", "--of", "sub4", "-o", "/dev/null"], "did you mean 'sub3'?"),
    ],
)
def test_what_is_refused(run: Terminal, words: list[str], says: str) -> None:
    done = run("export", PAPER, *words)
    assert (done.status, done.out) == (2, "")
    assert says.format(PAPER) in done.err


def test_a_log_of_something_else(run: Terminal, log: Path, out: Path) -> None:
    broken = out.parent / "b.log"
    broken.write_bytes(log.read_bytes().replace(b'"sub3_s"', b'"sub9_s"', 1))
    done = run("export", broken, "--format", "csv", "-o", out / "x", "--json")
    assert done.codes == ["BadLog"]
    broken.write_bytes(log.read_bytes()[:60])
    assert run("export", broken, "--format", "csv", "--json").codes == ["BadLog"]
    assert files_in(out) == {}


@pytest.mark.parametrize(
    ("form", "module"), [("dxf", "ezdxf"), ("mcap", "foxglove"), ("usd", "pxr.Usd")]
)
def test_a_library_that_is_missing(
    run: Terminal, log: Path, out: Path, form: str, module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    file = log if exporters()[form].takes == "log" else PAPER
    done = run("export", file, "--format", form, "-o", out / "x")
    assert done.status == 3
    extra = "usd" if form == "usd" else "export"
    assert f"pip install 'klavins-factory[{extra}]'" in done.err
    assert files_in(out) == {}


def test_nets_from_elsewhere(run: Terminal, out: Path) -> None:
    assert run("export", PAPER, "--format", "pnml", "-o", out / "net.pnml").status == 0
    for form in ("dot", "svg"):
        shown = run("export", out / "net.pnml", "--format", form).out
        assert shown.replace("net: 6 robots", "paper: 6 robots") == run(
            "export", PAPER, "--format", form
        ).out.replace("<title>paper: net", "<title>net: net")
        done = run("export", out / "net.pnml", "--format", form, "--of", "tree")
        assert "in which there is no assembly tree" in done.err
    assert run("export", out / "net.pnml", "--format", "st", "--json").codes == ["Usage"]


def test_without_gears_no_bar_lies_on_another_and_no_arc_goes_through_one() -> None:
    """The philosophers' left forks seemed to be taken by one transition."""
    for seed in range(12):
        net = random_marked_net(random.Random(seed)) if seed else net_from(PHILOSOPHERS)
        at = swimlanes(net)
        bars = list(zip(at.x, at.spans, strict=True))
        for (x, (low, high)), (other, (begin, end)) in combinations(bars, 2):
            assert x != other or high < begin or end < low
        for place, shape in enumerate(net.net.places):
            here = at.places[place]
            for event in shape.right:
                way = at.way(here, at.touch(event, here[1]))
                for (x, y), (to, down) in pairwise(way):
                    for bar, (low, high) in bars:
                        if x < bar < to:
                            assert not low < y + (bar - x) / (to - x) * (down - y) < high
        ElementTree.fromstring(draw_net(net, "x"))


def curve(way: str) -> Iterator[tuple[float, float]]:
    """Points of a path of cubics."""
    start, *cubics = way.removeprefix("M").split("C")
    at = tuple(map(float, start.split()))
    for cubic in cubics:
        numbers = tuple(map(float, cubic.split()))
        corners = np.array([at, numbers[:2], numbers[2:4], numbers[4:]])
        for t in np.linspace(0, 1, 24):
            share = np.array([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3])
            x, y = share @ corners
            yield float(x), float(y)
        at = numbers[4:]


def test_a_choice_can_be_read_off_a_drawing() -> None:
    """The arcs of each fork have a colour of their own and end at the middles of bars; no label is
    crossed by an arc."""
    net = net_from(PHILOSOPHERS)
    root = ElementTree.fromstring(draw_net(net, "x"))
    groups = {int(g.get("data-arc", -1)): g for g in root.iter() if g.get("data-arc")}
    styles = [groups[n].get("class", "").split() for n in range(len(net.net.places))]
    chosen = [style[-1] for style in styles if style[-1].startswith("choice")]
    assert [style[-1] in chosen for style in styles] == [True, True] + [False] * 6
    assert len({*chosen}) == 2
    at = swimlanes(net)
    for place, shape in enumerate(net.net.places):
        ends = [
            list(curve(path.get("d", "")))[-1] for path in groups[place].iter() if path.get("d")
        ]
        for event in shape.right:
            x, y = at.middle(event)
            assert any(abs(x - a - 11) < 0.2 and abs(y - b) < 0.2 for a, b in ends)
    arcs = [
        p for group in groups.values() for e in group.iter() for p in curve(e.get("d") or "M0 0")
    ]
    for text in (e for e in root.iter() if e.tag.endswith("text") and e.get("text-anchor")):
        size, x = float(text.get("font-size", 0)), float(text.get("x", 0))
        y, half = float(text.get("y", 0)) - 0.35 * size, 0.3 * size * len(text.text or "")
        assert not any(abs(a - x) < half and abs(b - y) < 0.4 * size for a, b in arcs), text.text


def test_gates_are_kept() -> None:
    """What must wait for another axis stays short of its goal until that one stands."""
    chosen, text = project(LAMP), made("st", LAMP)
    gates = 0
    for mode, axes in zip(operation_modes(chosen.layout, 2e-4), chosen.factory.moves, strict=True):
        for slot, gate in enumerate(mode.gate):
            if gate >= 0:
                gates += 1
                goal, standoff = mode.goals[slot], mode.standoff[slot]
                assert re.search(
                    rf"IF ABS\(Axes\[{axes[gate] + 1}\]\.Position - {mode.goals[gate]:.4g}.*"
                    rf"\n +Axes\[{axes[slot] + 1}\]\.Target := {goal:.4g}.*\n +ELSE"
                    rf"\n +Axes\[{axes[slot] + 1}\]\.Target := {goal + standoff:.4g}",
                    text,
                )
    assert gates


def test_gltf_shares_meshes() -> None:
    document = json.loads(made("gltf", ROOT / "examples" / "stool.pag", "", "x.gltf"))
    legs = [
        n["mesh"] for n in document["nodes"] if n.get("name", "").startswith("leg") and "mesh" in n
    ]
    assert len(legs) == 3
    assert len(set(legs)) == 1


def test_a_factory_is_exported_at_a_time_of_its_log(
    run: Terminal, out: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    log = kept_log(project().layout, tmp_path_factory.mktemp("log") / "paper.log")
    words = ["--format", "gltf-factory", "-o", out / "x.gltf"]
    for of in ("nan", "-1", "soon", "1e9"):
        done = run("export", log, *words, "--of", of, "--json")
        assert (done.status, done.codes) == (2, ["Usage"]) and files_in(out) == {}
        end = int(100 * read_log(log).time[-1] + 1e-6) / 100
        assert done.json["errors"][0]["hint"] == f"give a time from 0 to {end:.2f} s"
    assert "give a log" in run("export", PAPER, *words, "--of", "1").err
    assert run("export", log, *words, "--of", "0.5").status == 0
    names = {node.get("name") for node in json.loads((out / "x.gltf").read_bytes())["nodes"]}
    assert {"floor", "r1/carriage", "outfeed/tray"} <= names


def test_stl_counts_its_triangles() -> None:
    content = made("stl", LAMP)
    (count,) = struct.unpack_from("<I", content, 80)
    assert len(content) == 84 + 50 * count


def test_file_names_differ_in_whatever_case() -> None:
    taken: set[str] = set()
    names = [file_name(label, taken) for label in ("a", "A", "a/2", "a_2", "..", "...", "é" * 99)]
    assert len({name.casefold() for name in names}) == len(names)
    assert all(name and "/" not in name and name not in (".", "..") for name in names)


def test_what_is_written_is_said(run: Terminal, out: Path) -> None:
    assert run("export", PAPER, "--format", "pnml", "-o", out / "a.pnml").out == (
        f"pnml: {out / 'a.pnml'}\n"
    )
    done = run("export", PAPER, "--format", "stl", "-o", out / "all")
    assert done.out == f"stl: {out / 'all'}, {len(files_in(out / 'all'))} files\n"


SVG = "{http://www.w3.org/2000/svg}"


def drawn(layout: Layout) -> ElementTree.Element:
    return ElementTree.fromstring(write_svg(layout).encode())


def group(root: ElementTree.Element, name: str) -> ElementTree.Element:
    return next(g for g in root.iter(f"{SVG}g") if g.get("id") == name)


def texts(element: ElementTree.Element) -> list[str]:
    return [t.text or "" for t in element.iter(f"{SVG}text")]


@pytest.mark.parametrize("seed", [None, *range(3)])
def test_everything_is_drawn(seed: int | None) -> None:
    layout = paper_layout() if seed is None else many_layouts(25, range(seed, seed + 1))[0]
    root, factory = drawn(layout), layout.factory
    shown = texts(group(root, "labels"))
    assert {robot.name for robot in factory.robots} <= set(shown)
    assert {leaf.label for leaf in factory.leaves} <= set(shown)
    joined = {o.label for o in factory.operations if len(o.robots) > 1}
    assert joined <= set(shown)
    paths = [p for p in group(root, "guidepaths") if p.get("class") == "path"]
    assert len(paths) == len(factory.robots)
    assert len(group(root, "parts")) == len(factory.leaves)
    outlines = [p for p in group(root, "outfeed") if p.get("class") == "product"]
    assert len(outlines) == len(factory.leaves)


def test_a_tall_floor_has_its_legend_beside_it() -> None:
    layout = paper_layout()
    tall = replace(layout, floor=(-0.5, 0.5, -3.0, 3.0))
    for shown, beside in ((layout, False), (tall, True)):
        root = drawn(shown)
        floor = next(r for r in root.iter(f"{SVG}rect") if r.get("class") == "floor")
        words = next(t for t in root.iter(f"{SVG}text") if t.text == "outfeed")
        right = float(floor.get("x", 0)) + float(floor.get("width", 0))
        assert (float(words.get("x", 0)) > right) == beside
    assert "tool" in texts(group(drawn(layout), "sheet"))
    assert "tool" not in texts(group(drawn(row_of_inserts()), "sheet"))


def test_where_an_arc_leaves_the_drawing_its_place_is_named() -> None:
    net = net_from(PHILOSOPHERS)
    at, root = swimlanes(net), ElementTree.fromstring(draw_net(net, "x"))
    back = {
        place.name
        for n, place in enumerate(net.net.places)
        if not net.owners[n] and any(not at.forward(n, event) for event in place.left)
    }
    assert back and {e.text for e in root.iter() if e.get("class") == "edge"} == back


def test_chevrons_point_along_the_belt() -> None:
    belt = group(drawn(paper_layout()), "outfeed")
    ways = [p.get("d", "") for p in belt if p.get("class") == "chevron"]
    assert ways
    for way in ways:
        (x, y), (tip, middle), (back, down) = (
            map(float, corner.split()) for corner in way.removeprefix("M").split("L")
        )
        assert x == back < tip and y < middle < down


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
