"""Every export, read back by a reader that is not ours; the table of them in docs/exports.md."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from factory.apps.exports import exporters
from factory.apps.exports.stock import write
from factory.apps.log import read_log
from factory.apps.log.model import model_of
from factory.apps.plc.driven import drive
from factory.engine.mjcf.loading import load
from factory.engine.mjcf.names import COMPASS
from factory.engine.simulation.modelling import physical_model
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.support.rotations import rotation
from factory.theory.nets.marked import MarkedNet
from tests.export_values import (
    LAMP,
    MESHES,
    READERS,
    ask,
    kept_log,
    made,
    project,
    reads,
    subject,
    table,
)
from tests.export_values import write as written
from tests.good_runs import assert_good
from tests.paths import PAPER, ROOT
from tests.slow import slow_but
from tests.structured_text import Plc

DOCUMENT = ROOT / "docs" / "exports.md"


def paper_net() -> MarkedNet:
    return MarkedNet.of(subject(PAPER).net)


def arcs_of(net: MarkedNet) -> list[list[str]]:
    """The arcs by the names of their ends."""
    names = [t.name for t in net.net.transitions]
    found = []
    for place in net.net.places:
        found += [[names[e], place.name] for e in place.left]
        found += [[place.name, names[e]] for e in place.right]
    return sorted(found)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return kept_log(project(LAMP).layout, tmp_path_factory.mktemp("log") / "lamp.log", units=2)


# nets


@reads("pnml", "pm4py", "AGPL-3.0, a process of its own")
def pnml_by_pm4py(folder: Path) -> None:
    """the same places, transitions, arcs and tokens; every place has its position"""
    net = paper_net()
    found = ask("pm4py_pnml", written(made("pnml"), folder / "paper.pnml"))
    places = [p.name for p in net.net.places]
    ids = {f"p{n}": name for n, name in enumerate(places)}
    ids |= {f"t{n}": t.name for n, t in enumerate(net.net.transitions)}
    assert [ids[p] for p in sorted(found["places"], key=lambda p: int(p[1:]))] == places
    assert found["transitions"] == sorted(t.name for t in net.net.transitions)
    assert sorted([ids[a], ids[b]] for a, b in found["arcs"]) == arcs_of(net)
    tokens = {p: n for p, n in zip(places, net.tokens, strict=True) if n}
    assert {ids[p]: n for p, n in found["marking"].items()} == tokens
    assert found["drawn"] == len(places)


@reads("dot", "pydot", "MIT")
def dot_by_pydot(folder: Path) -> None:
    """the same arcs, the robots as clusters; of the tree an edge for each input"""
    import pydot

    net = paper_net()
    (graph,) = pydot.graph_from_dot_data(made("dot"))
    clusters = [c.get_label().strip('"') for c in graph.get_subgraphs()]
    assert clusters == [gear.robot for gear in net.gears]
    ids = {f"p{n}": p.name for n, p in enumerate(net.net.places)}
    ids |= {f"t{n}": t.name for n, t in enumerate(net.net.transitions)}
    edges = [[ids[e.get_source()], ids[e.get_destination()]] for e in graph.get_edges()]
    assert sorted(edges) == arcs_of(net)
    (tree,) = pydot.graph_from_dot_data(made("dot", PAPER, "tree"))
    pag = project(PAPER).pag
    assert len(tree.get_edges()) == len(pag) - 1


@reads("svg", "svgelements", "MIT")
def svg_by_svgelements(folder: Path) -> None:
    """a circle for each place and token inside the page, a bar for each transition, every name;
    of the tree a box for each label"""
    from svgelements import SVG, Circle, Rect, Text

    net, path = paper_net(), written(made("svg"), folder / "net.svg")
    drawn = list(SVG.parse(path).elements())
    circles = [e for e in drawn if isinstance(e, Circle)]
    round_ones = Counter(round(float(c.rx), 1) for c in circles)
    assert round_ones[12.0] == len(net.net.places)
    assert round_ones[4.5] >= sum(net.tokens)
    bars = [e for e in drawn if isinstance(e, Rect) and "bar" in str(e.values.get("class"))]
    assert len(bars) == len(net.net.transitions)
    words = {e.text for e in drawn if isinstance(e, Text)}
    assert words >= {gear.robot for gear in net.gears}
    assert words >= {t.name for t in net.net.transitions}
    page = SVG.parse(path)
    for circle in circles:
        x0, y0, x1, y1 = circle.bbox()
        assert 0 <= x0 < x1 <= float(page.width)
        assert 0 <= y0 < y1 <= float(page.height)
    tree = list(SVG.parse(written(made("svg", PAPER, "tree"), folder / "t.svg")).elements())
    assert {n.label for n in project(PAPER).pag.nodes} <= {
        e.text for e in tree if isinstance(e, Text)
    }


# the floor


@reads("dxf", "ezdxf", "MIT")
def dxf_by_ezdxf(folder: Path) -> None:
    """its audit finds nothing; millimetres, a layer for each kind of thing, the floor's extents
    (the library that writes it)"""
    import ezdxf

    layout = project(LAMP).layout
    document = ezdxf.readfile(written(made("dxf", LAMP), folder / "lamp.dxf"))
    audit = document.audit()
    assert (audit.errors, audit.fixes, document.units) == ([], [], 4)
    found = Counter((e.dxf.layer, e.dxftype()) for e in document.modelspace())
    assert found["GUIDEPATHS", "LINE"] == len(layout.guidepaths)
    assert found["ROBOTS", "LWPOLYLINE"] == 2 * len(layout.guidepaths)
    assert found["FEEDERS", "LWPOLYLINE"] == 3 * len(layout.factory.leaves)
    (floor,) = document.modelspace().query('LWPOLYLINE[layer=="FLOOR"]')
    corners = np.array(floor.get_points("xy")) / 1e3
    xlo, xhi, ylo, yhi = layout.floor
    assert np.allclose([*corners.min(axis=0), *corners.max(axis=0)], [xlo, ylo, xhi, yhi])


@reads("dxf", "trimesh", "MIT")
def dxf_by_trimesh(folder: Path) -> None:
    """millimetres, the floor's extents, the guidepaths' total length"""
    import trimesh

    layout = project(LAMP).layout
    path = trimesh.load_path(written(made("dxf", LAMP), folder / "lamp.dxf"))
    xlo, xhi, ylo, yhi = layout.floor
    assert path.units == "millimeters"
    assert np.allclose(np.asarray(path.bounds), 1e3 * np.array([[xlo, ylo], [xhi, yhi]]))
    ways = [e for e in path.entities if e.layer == "GUIDEPATHS"]
    length = sum(e.length(path.vertices) for e in ways)
    assert length == pytest.approx(1e3 * sum(p.travel for p in layout.guidepaths))


# programs


SMALL = "root = s; s = weld ( a-1, dwell = 0.5 ); a-1 = atomic ()"


def small(folder: Path) -> Path:
    path = folder / "p.pag"
    path.write_text(SMALL)
    return path


@reads("st", "blark", "GPL-2.0, a process of its own")
def st_by_blark(folder: Path) -> None:
    """it parses, but for the configuration, which TwinCAT's dialect has not: the types, the
    function, a function block for each robot, the program"""
    for file in (small(folder), PAPER, LAMP):
        text, _, configuration = made("st", file).partition("CONFIGURATION")
        assert configuration
        kinds = Counter(kind for kind, _ in ask("blark_st", written(text, folder / "p.st")))
        robots = len(project(file).factory.robots)
        assert kinds == {
            **{"DataTypeDeclaration": 8, "Function": 1, "FunctionBlock": robots, "Program": 1}
        }


@reads("st", "tree-sitter-iec61131-3-st", "MIT, a process of its own")
def st_by_tree_sitter(folder: Path) -> None:
    """it parses by a grammar of the standard, without an error: the types, the function, a function
    block for each robot, the program and its configuration"""
    for file in (small(folder), PAPER, LAMP):
        kinds = ask("tree_sitter_st", written(made("st", file), folder / "p.st"))
        robots = len(project(file).factory.robots)
        assert Counter(kinds) == {
            "type_declaration": 8,
            "function_declaration": 1,
            "function_block_declaration": robots,
            "program_declaration": 1,
            "configuration_declaration": 1,
        }


@reads("st", "an interpreter of the tests", "ours")
def st_by_an_interpreter(folder: Path) -> None:
    """executed as it stands, in lock step with the plant: the robots do what they do under the
    supervisor, product by product, and the bodies agree"""
    for file in (small(folder), LAMP, MESHES):
        plc, layout = Plc(made("st", file)), project(file).layout
        simulation = Simulation(layout, RunRequest(units=3))
        supervisor = drive(simulation, plc, plc.interval)
        run = simulation.run()
        assert (run.products, supervisor.refusals) == (3, [])
        assert_good(run)


CHILDREN = {
    "project": "fileHeader contentHeader types instances",
    "contentHeader": "Comment coordinateInfo",
    "coordinateInfo": "fbd ld sfc",
    "fbd|ld|sfc": "scaling",
    "types": "dataTypes pous",
    "dataTypes": "(dataType )+",
    "dataType": "baseType (documentation )?",
    "baseType": "(array|struct|derived|BOOL|UINT|LREAL) ",
    "array": "dimension baseType",
    "struct|inputVars|outputVars|inOutVars|localVars": "(variable )+",
    "variable": "type (documentation )?",
    "type|returnType": "(derived|BOOL|INT|UINT|UDINT|LREAL) ",
    "documentation|ST": "p",
    "pous": "(pou )+",
    "pou": "interface body",
    "interface": "(returnType )?((inputVars|outputVars|inOutVars|localVars) )*",
    "body": "ST",
    "instances": "configurations",
    "configurations": "configuration",
    "configuration": "resource",
    "resource": "task",
    "task": "pouInstance",
}
"""The elements of PLCopen's schema (TC6 2.01) that are used, each with its children in order."""

ATTRIBUTES = {
    "fileHeader": "companyName productName productVersion creationDateTime",
    "contentHeader|dataType|variable|derived|configuration|resource": "name",
    "pou": "name pouType",
    "dimension": "lower upper",
    "scaling": "x y",
    "task": "name interval priority",
    "pouInstance": "name typeName",
}
"""The attributes of the same."""


def encoded(colour: Sequence[float]) -> list[float]:
    """A linear colour of glTF in sRGB (IEC 61966-2-1)."""
    *light, opacity = colour
    return [
        *(12.92 * x if x < 0.0031308 else 1.055 * x ** (1 / 2.4) - 0.055 for x in light),
        opacity,
    ]


def _of(table: Mapping[str, str], tag: str) -> str:
    return next((row for tags, row in table.items() if tag in tags.split("|")), "")


@reads("plcopen", "lxml", "BSD-3-Clause")
def plcopen_by_lxml(folder: Path) -> None:
    """elements and attributes in the order of PLCopen's schema (TC6 2.01), of which the part that
    is used is a table of the test; bodies and variables are those of the Structured Text"""
    from lxml import etree

    for file in (small(folder), PAPER, LAMP):
        root = etree.fromstring(made("plcopen", file).encode())
        for element in root.iter():
            name = etree.QName(element)
            inside = "".join(f"{etree.QName(child).localname} " for child in element)
            wanted = _of(CHILDREN, name.localname)
            assert re.fullmatch(
                wanted if wanted.endswith(("*", "+", "?", " ")) else f"{wanted} ?", inside
            ), name
            assert " ".join(element.attrib) == _of(ATTRIBUTES, name.localname), name
            paragraph = name.localname == "p"
            assert name.namespace.endswith("xhtml" if paragraph else "tc6_0201"), name
        text = made("st", file)
        for unit in root.iterfind(".//{*}pou"):
            body = unit.findtext(".//{*}ST/{*}p")
            assert f"\n{body}\nEND_" in text
            for variable in unit.iterfind(".//{*}variable"):
                (kind,) = variable.find("{*}type")
                named = kind.get("name") or etree.QName(kind).localname
                assert f"    {variable.get('name')} : {named};" in text
        (task,) = root.iterfind(".//{*}task")
        assert f"INTERVAL := {task.get('interval')}, PRIORITY := {task.get('priority')}" in text


# products


@reads("stl", "trimesh", "MIT")
def stl_by_trimesh(folder: Path) -> None:
    """closed, with the extents of the parts in millimetres; the product, and each sub-assembly"""
    import trimesh

    for file in (MESHES, LAMP):
        chosen = project(file)
        for label in (node.label for node in chosen.pag.nodes):
            mesh = trimesh.load(written(made("stl", file, label), folder / "x.stl"))
            assert mesh.is_watertight, label
            parts = chosen.pag.product(label).parts()
            solids = [chosen.product.solids[p.label] for p in parts]
            low, high = np.min([s.low for s in solids], 0), np.max([s.high for s in solids], 0)
            assert np.allclose(mesh.bounds, 1e3 * np.array([low, high]), atol=0.2), label


@reads("gltf", "trimesh", "MIT")
def gltf_by_trimesh(folder: Path) -> None:
    """the assembly tree as its scene graph, in metres, y upwards (the library that writes it)"""
    import trimesh

    chosen = project(MESHES)
    for ending in ("glb", "gltf"):
        content = made("gltf", MESHES, "", f"x.{ending}")
        scene = trimesh.load_scene(written(content, folder / f"x.{ending}"))
        tree = {child: parent for parent, child, _ in scene.graph.to_edgelist()}
        for node in chosen.pag.nodes:
            assert all(tree[label] == node.label for label in node.inputs)
        low, high = chosen.product.low, chosen.product.high
        upright = [[low[0], low[2], -high[1]], [high[0], high[2], -low[1]]]
        assert np.allclose(scene.bounds, upright, atol=2e-4)


@reads("gltf", "pygltflib", "MIT")
def gltf_by_pygltflib(folder: Path) -> None:
    """valid references; each part's colour, and its triangles within its extents"""
    from pygltflib import GLTF2
    from pygltflib.validator import validate

    content = made("gltf", MESHES, "", "x.glb")
    document = GLTF2().load(str(written(content, folder / "x.glb")))
    validate(document)
    chosen = project(MESHES)
    nodes = {node.name: node for node in document.nodes}
    for part in (node.label for node in chosen.pag.parts()):
        solid = chosen.product.solids[part]
        primitive = document.meshes[nodes[part].mesh].primitives[0]
        colour = document.materials[primitive.material].pbrMetallicRoughness.baseColorFactor
        assert np.allclose(encoded(colour), solid.rgba, atol=0.01)
        accessor = document.accessors[primitive.attributes.POSITION]
        size = np.array(accessor.max) - np.array(accessor.min)
        assert np.allclose(size, solid.high - solid.low, atol=2e-4), part


# the factory


def states(log: Path) -> Iterator[tuple[Any, Any, bytes]]:
    """A factory at its start, during a run and at its end: the engine's model and state of it, and
    the export."""
    import mujoco

    kept = read_log(log)
    m = model_of(kept)
    row = len(kept) // 2
    start = load(physical_model(project(LAMP).layout, 1, project(LAMP).settings))
    for model, qpos, file, of in (
        (start, start.qpos0, LAMP, ""),
        (m, kept.qpos[row], log, str(kept.time[row])),
        (m, kept.qpos[-1], log, ""),
    ):
        d = mujoco.MjData(model)
        d.qpos[:] = qpos
        mujoco.mj_kinematics(model, d)
        yield model, d, made("gltf-factory", file, of, "x.glb")


def upright(points: Any) -> Any:
    """From z upwards to y upwards."""
    return np.asarray(points) @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])


@reads("gltf-factory", "trimesh", "MIT")
def factory_by_trimesh(log: Path) -> None:
    """each body where the engine has it, at the start and at two times of a log, spare parts left
    out; all on a floor (the library that writes it)"""
    import trimesh

    for m, d, content in states(log):
        scene = trimesh.load_scene(written(content, log.with_name("x.glb")))
        shown = {m.body(b).name: b for b in range(1, m.nbody) if d.xpos[b, 2] > -0.1}
        del shown[COMPASS]
        bodies = [name for name in scene.graph.nodes if name in shown]
        assert len(bodies) == len(shown) > 10
        for name in bodies:
            place = scene.graph[name][0][:3, 3]
            assert np.allclose(place, upright(d.xpos[shown[name]]), atol=1e-6), name
        low, high = scene.bounds
        floor = scene.geometry[scene.graph["floor"][1]]
        turned = scene.graph["floor"][0]
        reach = trimesh.transform_points(floor.bounds, turned)
        assert low[1] == pytest.approx(-0.002) and high[1] > 0.2
        assert np.allclose(np.sort(reach, axis=0)[:, [0, 2]], [low[[0, 2]], high[[0, 2]]])


@reads("gltf-factory", "pygltflib", "MIT")
def factory_by_pygltflib(log: Path) -> None:
    """valid references; the parts' colours, and robots that share their meshes"""
    from pygltflib import GLTF2
    from pygltflib.validator import validate

    content = made("gltf-factory", log, "0", "x.glb")
    document = GLTF2().load(str(written(content, log.with_name("y.glb"))))
    validate(document)
    nodes = {node.name: node for node in document.nodes}
    for label, solid in project(LAMP).product.solids.items():
        primitive = document.meshes[nodes[f"part/{label}#1/shape"].mesh].primitives[0]
        colour = document.materials[primitive.material].pbrMetallicRoughness.baseColorFactor
        assert np.allclose(encoded(colour), solid.rgba, atol=0.01)
    masts = {nodes[f"{robot.name}/mast"].mesh for robot in project(LAMP).factory.robots}
    assert len(masts) == 1


# robots


@reads("urdf", "MuJoCo", "Apache-2.0")
def urdf_by_mujoco(folder: Path) -> None:
    """the bodies, joints, ranges and masses of the MJCF; the same poses at home, where all joints
    are 0, and for random joint values, to a nanometre"""
    import mujoco

    for file in (MESHES, LAMP):
        path = written(made("urdf", file, "", "x.urdf"), folder / file.stem / "x.urdf")
        one = load(physical_model(project(file).layout, 1, project(file).settings, finish=write))
        other = mujoco.MjModel.from_xml_path(str(path))
        bodies = {one.body(n).name for n in range(one.nbody)} - {COMPASS}
        assert bodies == {other.body(n).name for n in range(other.nbody)}
        assert one.njnt == other.njnt
        values = _random_joints(one)
        for name in values:
            low, high = other.joint(name).range
            assert low < 0.0 < high
            assert [low, high] == pytest.approx(one.joint(name).range)
        for share in (0.0, 1.0):
            here, there = mujoco.MjData(one), mujoco.MjData(other)
            for joint, value in values.items():
                here.joint(joint).qpos[0] = there.joint(joint).qpos[0] = share * value
            for m, d in ((one, here), (other, there)):
                mujoco.mj_kinematics(m, d)
            for name in bodies:
                assert np.allclose(here.body(name).xpos, there.body(name).xpos, atol=1e-9), name
                assert np.allclose(here.body(name).xquat, there.body(name).xquat, atol=1e-9), name
        for name in bodies:
            if one.body_jntnum[one.body(name).id]:
                assert one.body(name).mass == pytest.approx(other.body(name).mass)
                assert np.allclose(_inertia(one, name), _inertia(other, name), rtol=1e-6)


def _inertia(m: Any, name: str) -> Any:
    """The inertia tensor of a body in its own frame, and its centre of mass."""
    body = m.body(name)
    turn = rotation(body.iquat)
    return [*(turn @ np.diag(body.inertia) @ turn.T).ravel().round(12), *body.ipos]


def _random_joints(m: Any) -> dict[str, float]:
    rng = np.random.default_rng(1)
    slides = (m.joint(j) for j in range(m.njnt) if m.jnt_type[j] in (2, 3))
    return {joint.name: float(rng.uniform(*joint.range)) for joint in slides}


@reads("urdf", "yourdfpy", "MIT, a process of its own")
def urdf_by_yourdfpy(folder: Path) -> None:
    """valid, every mesh is found; for random joint values the poses that MuJoCo has"""
    import mujoco

    path = written(made("urdf", MESHES, "", "x.urdf"), folder / "x.urdf")
    m = load(physical_model(project(MESHES).layout, 1, project(MESHES).settings, finish=write))
    values, d = _random_joints(m), mujoco.MjData(m)
    for joint, value in values.items():
        d.joint(joint).qpos[0] = value
    mujoco.mj_kinematics(m, d)
    found = ask("yourdfpy_urdf", path, json.dumps(values))
    assert found["valid"]
    kinds = Counter(found["joints"].values())
    assert kinds["prismatic"] == len(values)
    assert kinds["floating"] == len(project(MESHES).factory.leaves)
    for name in values:
        body = m.body(int(m.jnt_bodyid[m.joint(name).id])).name
        assert np.allclose(found["at"][body], d.body(body).xpos, atol=1e-8), body


# runs


@reads("csv", "DuckDB", "MIT")
def csv_by_duckdb(log: Path) -> None:
    """the events of the log, in order, with numbers as numbers"""
    import duckdb

    path = written(made("csv", log), log.with_name("x.csv"))
    with duckdb.connect() as database:
        query = f"select time_s, transition, unit, robots, line from read_csv('{path}')"
        rows = database.sql(query).fetchall()
    events = subject(log).log.events
    assert [(t, name) for t, name, *_ in rows] == [(round(t, 9), name) for t, name in events]
    assert max(unit for _, _, unit, *_ in rows) == 2
    operations = {o.label: o for o in project(LAMP).factory.operations}
    for _, name, _, robots, line in rows:
        operation = operations[name[:-2]]
        assert robots.split() == [f"r{r + 1}" for r in operation.robots]
        assert operation.position is None or line == operation.position.line


@reads("mcap", "mcap", "MIT")
def mcap_by_mcap(log: Path) -> None:
    """Foxglove's schemas, checksums, time in order; each body where the engine has it in every
    frame, each event with its source line"""
    import mujoco
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    path = written(made("mcap", log), log.with_name("x.mcap"))
    topics: dict[str, list[Any]] = {}
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for schema, channel, message, content in reader.iter_decoded_messages():
            assert schema is not None
            assert schema.name.startswith("foxglove.")
            topics.setdefault(channel.topic, []).append((message.log_time, content))
    assert set(topics) == {"/tf", "/scene", "/events"}
    kept = subject(log).log
    said = [(t, content.name) for t, content in topics["/events"]]
    assert said == [(round(t * 1e9), name) for t, name in kept.events]
    files = {f"meshes/{name}": content for name, content in kept.files.items()}
    m = mujoco.MjModel.from_xml_string(kept.xml, files)
    d, at = mujoco.MjData(m), dict[str, Any]()
    poses = dict(topics["/tf"])
    rows = {round(t * 1e9): row for row, t in enumerate(kept.time.tolist())}
    for time, pose in poses.items():
        for transform in pose.transforms:
            at[transform.child_frame_id] = transform
        d.qpos[:] = kept.qpos[rows[time]]
        mujoco.mj_kinematics(m, d)
        for body in range(1, m.nbody):
            shown, parent = at[m.body(body).name], int(m.body_parentid[body])
            assert shown.parent_frame_id == m.body(parent).name
            moved = [shown.translation.x, shown.translation.y, shown.translation.z]
            place = d.xpos[parent] + rotation(d.xquat[parent]) @ moved
            assert np.abs(place - d.xpos[body]).max() < 1e-4, (time, m.body(body).name)
    drawn = {e.id for _, update in topics["/scene"] for e in update.entities}
    assert {f"part/{o.label}#1" for o in project(LAMP).factory.leaves} <= drawn


@reads("mcap", "Rerun", "Apache-2.0 or MIT, a process of its own")
def mcap_by_rerun(log: Path) -> None:
    """its importer turns `/tf` into transforms by frame and the events into its text log; from
    `/scene` it makes no geometry: that comes from the URDF, whose frames have the same names"""
    path = written(made("mcap", log), log.with_name("r.mcap"))
    chunks = ask("rerun_mcap", path, log.with_name("r.rrd"))["chunks"]
    moved = [c for c in chunks if " /tf " in c and "Transform3D:translation" in c]
    assert moved
    assert any(" /events " in c and "TextLog:text" in c for c in chunks)


@reads("usd", "usd-core", "TOST-1.0 (Apache-2.0 and a clause on trademarks)")
def usd_by_usd_core(log: Path) -> None:
    """metres, z upwards, the log's pace; robots' carriages where the engine has them, in the first
    frame and the last (the library that writes it)"""
    import mujoco

    pytest.importorskip("pxr", reason="the extra `usd` is not installed")
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(written(made("usd", log, "", "x.usd"), log.with_name("x.usd"))))
    as_text = written(made("usd", log, "", "x.usda"), log.with_name("x.usda"))
    assert as_text.read_bytes().startswith(b"#usda 1.0")
    assert Usd.Stage.Open(str(as_text)).GetEndTimeCode() == stage.GetEndTimeCode()
    assert (UsdGeom.GetStageMetersPerUnit(stage), UsdGeom.GetStageUpAxis(stage)) == (1.0, "Z")
    kept = subject(log).log
    seconds = (stage.GetEndTimeCode() - 1) / stage.GetTimeCodesPerSecond()
    assert seconds == pytest.approx(kept.time[-1] - kept.time[0], abs=0.05)
    files = {f"meshes/{name}": content for name, content in kept.files.items()}
    m = mujoco.MjModel.from_xml_string(kept.xml, files)
    d = mujoco.MjData(m)
    drawn = {prim.GetName(): prim for prim in stage.Traverse()}
    for row, code in ((0, 0), (-1, stage.GetEndTimeCode() - 1)):
        d.qpos[:] = kept.qpos[row]
        mujoco.mj_kinematics(m, d)
        for robot in project(LAMP).factory.robots:
            geom = m.geom(f"{robot.name}/carriage").id
            prim = drawn[f"Mesh_Xform_{robot.name}_carriage_id{geom}_geom"]
            place = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(code).ExtractTranslation()
            assert np.allclose(place, d.geom_xpos[geom], atol=1e-5)


LONG = {"st-an interpreter of the tests", "gltf-factory-pygltflib"}
"""What `test_plc.py` and another reader of the format find as soon."""


@pytest.mark.parametrize("which", slow_but(READERS.keys() - LONG, READERS))
def test_read_back(which: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    reader = READERS[which]
    takes_log = exporters()[reader.form].takes in ("log", "factory")
    reader.check(request.getfixturevalue("log") if takes_log else tmp_path)


def test_the_table_in_the_docs(request: pytest.FixtureRequest) -> None:
    text = DOCUMENT.read_text("utf-8")
    start, end = "<!-- readers -->\n", "<!-- end -->"
    head, _, rest = text.partition(start)
    old, _, tail = rest.partition(end)
    if request.config.getoption("--update-golden"):
        DOCUMENT.write_text(head + start + table(READERS) + end + tail, "utf-8")
        return
    assert old == table(READERS)


def test_every_format_has_a_reader_or_says_that_there_is_none() -> None:
    without = set(exporters()) - {reader.form for reader in READERS.values()}
    text = DOCUMENT.read_text("utf-8")
    for form in sorted(without):
        assert f"`{form}`: no independent reader" in text
