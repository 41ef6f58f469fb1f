"""Files of some kilobytes that announce, place or unpack to gigabytes: refused before memory is
taken. And damaged ones: refused in our words."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
import zipfile
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from factory.apps.importing.scene_file import read_scene
from factory.apps.planning.source import SourceOptions, read_source
from factory.support.errors import FactoryError
from factory.support.meshes import glb_reader
from factory.support.meshes.mesh_file import UnreadableMesh
from factory.theory.lang.template_reader import all_templates
from tests.paths import ROOT

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "<f4").tobytes()
CORNERS = np.array([0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2], "<u2").tobytes()
Document = dict[str, Any]


def glb(change: Callable[[Document], object], arrays: bytes = POINTS + CORNERS) -> bytes:
    """A tetrahedron whose JSON is changed."""
    document: Document = {
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": len(arrays)}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 24},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
    }
    change(document)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(arrays), b"BIN\0") + arrays
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def sparse(count: int, rows: int = 1) -> Callable[[Document], object]:
    """Corners that are announced, of which one is there."""
    values = {"bufferView": 0}
    given = {"count": rows, "indices": {"bufferView": 1, "componentType": 5123}, "values": values}
    accessor = {"componentType": 5126, "count": count, "type": "VEC3", "sparse": given}
    return lambda d: d["accessors"].__setitem__(0, accessor)


MODEL = '<model unit="inch"><resources>{}</resources><build>{}</build></model>'
CUBE = (
    '<object id="1"><mesh><vertices>{}</vertices><triangles>{}</triangles></mesh></object>'.format(
        "".join(f'<vertex x="{a}" y="{b}" z="{c}"/>' for a, b, c in np.eye(4, 3).tolist()),
        "".join(
            f'<triangle v1="{a}" v2="{b}" v3="{c}"/>'
            for a, b, c in ((0, 1, 2), (0, 3, 1), (1, 3, 2), (0, 2, 3))
        ),
    )
)


def threemf(things: str, plate: str = '<item objectid="1"/>') -> bytes:
    stream = BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("3D/3dmodel.model", MODEL.format(CUBE + things, plate))
    return stream.getvalue()


def doubled(first: int, last: int) -> str:
    """Objects each of which places the one before twice."""
    part = '<component objectid="{0}"/>'
    pairs = ((n, part.format(n - 1) * 2) for n in range(first, last))
    return "".join(f'<object id="{n}"><components>{p}</components></object>' for n, p in pairs)


BOMBS: dict[str, tuple[Callable[[], bytes], str]] = {
    "sparse.glb": (lambda: glb(sparse(350_000_000)), "the count of an accessor"),
    "zeros.glb": (
        lambda: glb(
            lambda d: d["accessors"].__setitem__(
                1, {"componentType": 5125, "count": 10**9, "type": "SCALAR"}
            )
        ),
        "the count of an accessor",
    ),
    "nodes.glb": (
        lambda: glb(lambda d: d.update(nodes=[{"mesh": 0}] * 60_001)),
        "it has 60001 bodies; at most 5000 are planned",
    ),
    "deep.glb": (
        lambda: glb(
            lambda d: d.update(nodes=[*({"children": [n + 1]} for n in range(60_000)), {"mesh": 0}])
        ),
        "nested more than 500 deep",
    ),
    "twice.glb": (
        lambda: glb(
            lambda d: d.update(nodes=[*({"children": [n + 1] * 2} for n in range(60)), {"mesh": 0}])
        ),
        "one of its nodes is below two others",
    ),
    "circle.glb": (
        lambda: glb(lambda d: d.update(nodes=[{"children": [0]}], scenes=[{"nodes": [0]}])),
        "or below itself",
    ),
    "spaces.3mf": (lambda: threemf(" " * 270_000_000), "it unpacks to more than 256 MiB"),
    "twice.3mf": (lambda: threemf(doubled(2, 42), '<item objectid="41"/>'), "it places more than"),
    "many.3mf": (
        lambda: threemf("", '<item objectid="1"/>' * 60_001),
        "it has 60001 bodies; at most 5000 are planned",
    ),
    "circle.3mf": (lambda: threemf(doubled(2, 3).replace('"1"', '"2"')), ""),
}
"""How each is made, and how it is refused; "" where it is read."""

MEMORY = 1_500_000
"""Enough to read what is small [kB of address space]."""

READ = """
import sys
from pathlib import Path
from factory.apps.importing.scene_file import read_scene
from factory.support.meshes.mesh_file import UnreadableMesh
for name in sys.argv[1:]:
    path = Path(name)
    try:
        print(path.name, len(read_scene(path.read_bytes(), path.suffix).bodies), "bodies")
    except UnreadableMesh as error:
        print(path.name, error)
"""


def test_what_announces_gigabytes_is_refused_within_little_memory(tmp_path: Path) -> None:
    for name, (make, _) in BOMBS.items():
        (tmp_path / name).write_bytes(make())
    limit = f'ulimit -v {MEMORY}; exec "$@"'
    words = ["bash", "-c", limit, "bash", sys.executable, "-c", READ]
    files = [str(tmp_path / name) for name in BOMBS]
    done = subprocess.run([*words, *files], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    for (name, (_, why)), line in zip(BOMBS.items(), done.stdout.splitlines(), strict=True):
        assert line.startswith(name) and (why or "1 bodies") in line, line


@pytest.mark.parametrize("encoding", ["utf-16", "big5"])
def test_an_encoding_that_is_not_read_is_told(encoding: str) -> None:
    head = f'<?xml version="1.0" encoding="{encoding}"?>'
    stream = BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("3D/3dmodel.model", head + MODEL.format(CUBE, ""))
    with pytest.raises(UnreadableMesh, match=r"is not XML|encoding that is not read"):
        read_scene(stream.getvalue(), ".3mf")


def test_few_triangles_at_many_places_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    content = glb(lambda d: d.update(nodes=[{"mesh": 0}] * 30))
    assert len(read_scene(content, ".glb").bodies) == 30
    monkeypatch.setattr(glb_reader, "MOST", 100)
    with pytest.raises(UnreadableMesh, match="more than 100 triangles together"):
        read_scene(content, ".glb")


def test_a_sparse_accessor_is_read() -> None:
    """Of four corners two are replaced: here the first by itself, the third by the second."""
    (body,) = glb_reader.read_glb(glb(sparse(4, rows=2)))
    ((vertices, faces),) = body.bodies
    assert vertices.tolist() == [[0, 0, 0], [0, 0, 0], [1, 0, 0], [0, 0, 0]]
    assert faces.shape == (4, 3)


def test_strips_fans_and_places_are_read() -> None:
    """A strip turned by 90 degrees and scaled, and a fan in a mirrored node."""
    fan = {"attributes": {"POSITION": 0}, "mode": 6}
    nodes = [
        {"mesh": 0, "rotation": [0, 0, 0.5**0.5, 0.5**0.5], "scale": [2, 2, 2]},
        {"mesh": 1, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1]},
    ]
    meshes = [{"primitives": [{**fan, "mode": 5}]}, {"primitives": [fan]}]
    content = glb(lambda d: d.update(nodes=nodes, meshes=meshes))
    strip, other = glb_reader.read_glb(content, np.eye(4))
    assert strip.bodies[0][0] == pytest.approx(
        np.array([[0, 0, 0], [0, 2, 0], [-2, 0, 0], [0, 0, 2]])
    )
    assert strip.bodies[0][1].tolist() == [[0, 1, 2], [3, 2, 1]]
    assert other.bodies[0][0][1] == pytest.approx((4, 0, 0))
    assert other.bodies[0][1].tolist() == [[2, 1, 0], [3, 2, 0]]


def test_a_3mf_file_places_objects_within_objects() -> None:
    things = (
        '<object id="2"><components><component objectid="1" transform="{}"/></components></object>'
    )
    moved = things.format("1 0 0 0 1 0 0 0 1 10 0 0")
    plate = '<item objectid="2" transform="2 0 0 0 2 0 0 0 2 0 0 1"/><item objectid="1"/>'
    found = read_scene(threemf(moved, plate), ".3mf")
    assert found.by == "the 3MF file states inch"
    low = [body.mesh.bodies[0][0].min(axis=0) / 0.0254 for body in found.bodies]
    assert low[0] == pytest.approx((20, 0, 1)) and low[1] == pytest.approx((0, 0, 0))


def test_damaged_files_are_refused_in_our_words(tmp_path: Path) -> None:
    """Cut off, with bytes changed, or digits: no exception but ours."""
    scene = trimesh.Scene()
    for number, name in enumerate(("a", "b")):
        box = trimesh.creation.box((1, 1, 1)).apply_translation((0, 0, number))
        scene.add_geometry(box, node_name=name, geom_name=name)
    content = bytes(scene.export(file_type="glb"))
    rng, refused = np.random.default_rng(7), 0
    for number in range(60):
        damaged = bytearray(content)
        if number % 3 == 0:
            del damaged[int(rng.integers(len(content))) :]
        for _ in range(1 + number % 5):
            if len(damaged) > 1:
                damaged[int(rng.integers(len(damaged)))] = int(rng.integers(256))
        (tmp_path / "m.glb").write_bytes(damaged)
        try:
            options = SourceOptions("mm", in_place=True)
            read_source(tmp_path / "m.glb", all_templates(()), options)
        except FactoryError:
            refused += 1
    assert refused > 15


def test_compression_is_called_what_it_is() -> None:
    """Of a file whose triangles a decoder must unpack first, before its accessors are looked at."""
    document = b'{"asset":{"version":"2.0"},"extensionsRequired":["KHR_draco_mesh_compression"]}'
    document += b" " * (-len(document) % 4)
    chunk = len(document).to_bytes(4, "little") + b"JSON" + document
    content = b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunk)).to_bytes(4, "little") + chunk
    with pytest.raises(UnreadableMesh, match=r"compressed \(Draco\).*export it without"):
        glb_reader.read_glb(content)
