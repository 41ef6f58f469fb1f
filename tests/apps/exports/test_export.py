"""Exporters: found by directory, the same bytes again, what is refused, and what a reader would not
notice."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import os
import random
import re
import struct
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from datetime import datetime
from importlib.util import find_spec
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import factory.apps.exports
from factory import to_networkx
from factory.apps.exports import Subject, exporters
from factory.apps.exports.csv import COLUMNS
from factory.apps.exports.subject import file_name
from factory.apps.exports.svg import draw_net, draw_tree
from factory.apps.exports.swimlanes import swimlanes
from factory.apps.exports.urdf import roll_pitch_yaw
from factory.apps.exports.xes import EPOCH
from factory.apps.log import read_log
from factory.floor.geometry.solids import rotation
from factory.floor.modes.modes import operation_modes
from factory.theory.nets.marked import MarkedNet, marked
from factory.theory.nets.petri import PetriNet
from factory.theory.plant.factory import Factory
from tests.command_line import Terminal
from tests.export_values import LAMP, MESHES, kept_log, made, project, subject
from tests.net_values import PHILOSOPHERS, net_from, planted, random_marked_net
from tests.pag_values import factories
from tests.paths import PAPER, ROOT, files_in
from tests.structured_text import Plc

TEXTS = ("pnml", "dot", "svg", "dxf", "st")


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "paper.log"
    return kept_log(project(PAPER).layout, path, world="ideal", units=2)


# the catalogue


def test_they_are_found_by_directory() -> None:
    found = exporters()
    folder = Path(factory.apps.exports.__file__ or "").parent
    texts = [p.read_text("utf-8") for p in folder.glob("*.py")]
    assert len(found) == sum(bool(re.search(r"^FORMAT\b", text, re.M)) for text in texts)
    assert list(found) == sorted(found)
    for exporter in found.values():
        assert exporter.summary.endswith(".")
        assert exporter.takes in ("net", "pag", "cell", "log", "factory")


def test_help_says_what_each_is(run: Terminal) -> None:
    text = " ".join(run("export", "--help").out.split())
    for exporter in exporters().values():
        assert " ".join(exporter.summary.split()[:3]) in text


def test_the_docs_list_them_all() -> None:
    text = (ROOT / "docs" / "exports.md").read_text("utf-8")
    assert all(f"`{form}`" in text for form in exporters())


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


# process mining


def test_xes_has_a_trace_for_each_product(log: Path) -> None:
    root = ElementTree.fromstring(made("xes", log))
    space = {"x": "http://www.xes-standard.org/"}
    traces = root.findall("x:trace", space)
    rows = list(csv.DictReader(io.StringIO(made("csv", log))))
    names = [trace.find("x:string", space).get("value") for trace in traces]
    assert names[:2] == ["paper 1", "paper 2"]
    for number, trace in enumerate(traces, 1):
        events = [
            {node.get("key"): node.get("value") for node in event}
            for event in trace.findall("x:event", space)
        ]
        mine = [row for row in rows if int(row["unit"]) == number]
        assert [e["transition"] for e in events] == [row["transition"] for row in mine]
        assert [e["org:resource"] for e in events] == [row["robots"] for row in mine]
        kinds = {"start": "start", "end": "complete"}
        assert [e["lifecycle:transition"] for e in events] == [kinds[row["kind"]] for row in mine]
        since = [datetime.fromisoformat(e["time:timestamp"]) - EPOCH for e in events]
        for elapsed, row in zip(since, mine, strict=True):
            assert elapsed.total_seconds() == pytest.approx(float(row["time_s"]), abs=1e-3)
    assert sum(len(trace.findall("x:event", space)) for trace in traces) == len(rows) > 20


def test_xes_of_a_mix_counts_units_of_the_period(tmp_path: Path) -> None:
    family = project(ROOT / "examples" / "family.pag")
    period = family.plain.period
    log = kept_log(family.layout, tmp_path / "family.log", world="ideal", units=period)
    root = ElementTree.fromstring(made("xes", log))
    space = {"x": "http://www.xes-standard.org/"}
    dropped = [
        {node.get("value") for node in event}
        for trace in root.findall("x:trace", space)[:period]
        for event in trace.findall("x:event", space)
        if any(node.get("value") == "dropoff" for node in event)
    ]
    assert period > 1 and len(dropped) == 2 * period


# the command


def test_texts_go_to_stdout(run: Terminal) -> None:
    for form in TEXTS:
        shown = run("export", PAPER, "--format", form)
        assert shown.status == 0
        assert shown.out.rstrip("\n") == made(form).rstrip("\n")


@pytest.mark.parametrize("form", [e.format for e in exporters().values() if e.binary])
def test_what_is_binary_needs_a_file(run: Terminal, form: str, log: Path) -> None:
    file = log if exporters()[form].takes == "log" else PAPER
    done = run("export", file, "--format", form)
    assert done.status == 2
    assert done.err == (
        f"Usage {form} is binary and is not written to a terminal\n"
        f"    give -o OUT.{exporters()[form].ending or form}\n"
    )


def test_what_takes_several_files_needs_a_place(run: Terminal, out: Path) -> None:
    done = run("export", MESHES, "--format", "urdf")
    assert (done.status, done.out) == (2, "")
    assert run("export", MESHES, "--format", "urdf", "-o", out / "m.urdf", "--json").status == 0
    files = files_in(out)
    assert f"this format writes {len(files)} files" in done.err
    assert {name.partition("/")[0] for name in files} == {"m.urdf", "m_meshes"}
    named = set(re.findall(r'filename="([^"]*)"', files["m.urdf"].decode()))
    assert named == set(files) - {"m.urdf"}


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--format", "dfx"], "Usage unknown format 'dfx'\n    did you mean 'dxf'?"),
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


def test_a_log_is_no_pag(run: Terminal, log: Path) -> None:
    for form in ("pnml", "stl"):
        done = run("export", log, "--format", form, "-o", log.parent / "x", "--json")
        assert done.codes == ["Usage"]
    assert f"dot is made from a PAG or a net in PNML; '{log}' is a log" in (
        run("export", log, "--format", "dot").err
    )


def test_the_ideal_world_has_no_bodies(run: Terminal, log: Path, out: Path) -> None:
    for form in ("mcap", "usd") if find_spec("pxr") else ("mcap",):
        done = run("export", log, "--format", form, "-o", out / "x")
        assert done.status == 2
        assert "BadLog" in done.err
        assert "is of the ideal world, which has no bodies to show" in done.err
    assert files_in(out) == {}
    assert run("export", log, "--format", "csv").out.startswith(",".join(COLUMNS))


def test_a_table_commands_neither_a_spreadsheet_nor_a_terminal(run: Terminal, out: Path) -> None:
    """A label and the name of a file may begin as a formula does; a file's name may have codes."""
    file, log = out / "=1+2\x1b[2J.pag", out / "a.log"
    file.write_text("root = -s; -s = mate(a, b); a = atomic(); b = atomic();")
    assert run("run", file, "--world", "ideal", "--log", log, "-q").status == 0
    kept = read_log(log)
    header = {**kept.header, "pag": {**kept.header["pag"], "file": file.name}}
    text = exporters()["csv"].export(Subject(log, replace(kept, header=header)))
    assert isinstance(text, str)
    cells = {cell for row in csv.reader(io.StringIO(text)) for cell in row}
    assert {"'-s", "'=1+2 [2J.pag"} <= cells
    assert not any(cell.startswith(("=", "+", "-", "@")) for cell in cells)
    assert "\x1b" not in text
    assert "\x1b" not in run("monitor", log).out + run("check", file, "-v").out


def test_a_log_of_something_else(run: Terminal, log: Path, out: Path) -> None:
    broken = out.parent / "b.log"
    broken.write_bytes(log.read_bytes().replace(b'"sub3_s"', b'"sub9_s"', 1))
    done = run("export", broken, "--format", "csv", "-o", out / "x", "--json")
    assert done.codes == ["BadLog"]
    broken.write_bytes(log.read_bytes()[:60])
    assert run("export", broken, "--format", "csv", "--json").codes == ["BadLog"]
    assert files_in(out) == {}


@pytest.mark.parametrize(
    ("form", "module"),
    [("dxf", "ezdxf"), ("mcap", "foxglove"), ("usd", "pxr.Usd")],
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


def test_a_folder_gets_every_label(run: Terminal, out: Path) -> None:
    labels = {node.label for node in project(LAMP).pag.nodes}
    for form, ending in (("stl", "stl"), ("gltf", "glb")):
        folder = out / form
        assert run("export", LAMP, "--format", form, "-o", folder).status == 0
        assert {path.name for path in folder.iterdir()} == {f"{n}.{ending}" for n in labels}


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


# nets


@given(factories(12))
@settings(max_examples=20, deadline=None)
def test_graphs_of_networkx_are_the_net_and_the_tree(made_factory: Factory) -> None:
    net, graph = marked(made_factory.net), to_networkx(made_factory)
    arcs = {(f"t{e}", f"p{p}") for p, at in enumerate(net.net.places) for e in at.left}
    arcs |= {(f"p{p}", f"t{e}") for p, at in enumerate(net.net.places) for e in at.right}
    assert set(graph.edges) == arcs
    assert len(graph) == len(net.net.places) + len(net.net.transitions)
    assert nx.is_strongly_connected(graph)
    tree = to_networkx(made_factory.pag)
    assert tree.graph["root"] == made_factory.pag.root
    assert list(nx.topological_sort(tree))[-1] == made_factory.pag.root
    assert set(tree) == {node.label for node in made_factory.pag.nodes}


@given(factories(20), st.randoms(use_true_random=False), st.integers(-1, 4))
def test_nodes_are_drawn_apart_and_time_goes_right(
    made_factory: Factory, rng: random.Random, which: int
) -> None:
    whole = marked(made_factory.net)
    net = whole if which < 0 else planted(made_factory.net, rng, which)
    at = swimlanes(net)
    assert len(set(at.places)) == len(at.places) or which >= 0
    assert all(0 <= x <= at.width and 0 <= y <= at.height for x, y in at.places)
    ElementTree.fromstring(draw_net(net, "<&"))
    if which >= 0:
        return
    for place, owners in enumerate(net.owners):
        shape = net.net.places[place]
        assert at.places[place][1] in [at.lanes[gear] for gear in owners]
        assert at.x[shape.right[0]] > at.places[place][0]
        if not net.tokens[place]:
            assert at.x[shape.left[0]] < at.places[place][0]


def test_nets_without_gears_are_drawn() -> None:
    net = replace(marked(subject(PAPER).net), gears=(), slots=())
    at = swimlanes(net)
    assert len(set(at.places)) == 19
    assert "0 robots" not in draw_net(net, "x").partition("</title>")[0]
    ElementTree.fromstring(draw_net(net, "x"))
    empty = MarkedNet(PetriNet((), ()), ())
    ElementTree.fromstring(draw_net(empty, "x"))


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


@given(factories(20))
@settings(max_examples=40)
def test_trees_are_drawn(made_factory: Factory) -> None:
    root = ElementTree.fromstring(draw_tree(made_factory.pag))
    boxes = [e for e in root.iter() if e.get("class") in ("part", "made")]
    places = {(box.get("x"), box.get("y")) for box in boxes}
    assert len(places) == len(made_factory.pag)


# programs


def test_odd_labels_and_names_are_no_obstacle(tmp_path: Path) -> None:
    file = tmp_path / "odd *) name.pag"
    file.write_text(
        "root = A.b; A.b = mate ( a_b, a-B, ä ); a_b = atomic(); a-B = atomic(); ä = atomic()"
    )
    text = made("st", file)
    assert text.isascii()
    assert Plc(text).compiled.program == "FACTORY"


def test_a_dwell_is_a_timer() -> None:
    text = made("st", MESHES)
    assert "Dwell(IN := Reached, PT := T#300ms);" in text
    assert text.count("T#300ms") == 2


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


# the floor and the product


@pytest.mark.parametrize("ending", ["glb", "gltf"])
def test_gltf_shares_meshes(ending: str) -> None:
    content = made("gltf", ROOT / "examples" / "stool.pag", "", f"x.{ending}")
    if ending == "glb":
        assert content[:4] == b"glTF"
        (length,) = struct.unpack_from("<I", content, 12)
        content = content[20 : 20 + length]
    document: dict[str, Any] = json.loads(content)
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


def turns() -> Iterator[list[float]]:
    yield from ([1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1])
    yield from ([0.5**0.5, 0, 0.5**0.5, 0], [0.5**0.5, 0, -(0.5**0.5), 0], [0.5, 0.5, 0.5, 0.5])
    rng = np.random.default_rng(0)
    for _ in range(50):
        turn = rng.normal(size=4)
        yield (turn / np.linalg.norm(turn)).tolist()


def test_roll_pitch_yaw() -> None:
    for turn in turns():
        roll, pitch, yaw = roll_pitch_yaw(np.array(turn))

        def about(axis: int, angle: float) -> Any:
            quaternion = np.zeros(4)
            quaternion[0], quaternion[1 + axis] = np.cos(angle / 2), np.sin(angle / 2)
            return rotation(quaternion)

        made_of = about(2, yaw) @ about(1, pitch) @ about(0, roll)
        assert np.allclose(made_of, rotation(np.array(turn)), atol=1e-9)


def test_what_is_written_is_said(run: Terminal, out: Path) -> None:
    assert run("export", PAPER, "--format", "pnml", "-o", out / "a.pnml").out == (
        f"pnml: {out / 'a.pnml'}\n"
    )
    done = run("export", PAPER, "--format", "stl", "-o", out / "all")
    assert done.out == f"stl: {out / 'all'}, {len(files_in(out / 'all'))} files\n"


def test_where_an_arc_leaves_the_drawing_its_place_is_named() -> None:
    net = net_from(PHILOSOPHERS)
    at, root = swimlanes(net), ElementTree.fromstring(draw_net(net, "x"))
    back = {
        place.name
        for n, place in enumerate(net.net.places)
        if not net.owners[n] and any(not at.forward(n, event) for event in place.left)
    }
    assert back and {e.text for e in root.iter() if e.get("class") == "edge"} == back
