"""How inputs come together: slide, lower or blocked, at three levels, against brute force and the
engine."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product as every
from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold
from scipy.spatial import ConvexHull

from factory.apps.exports.clash_picture import draw
from factory.commands.warnings import LISTED, condensed
from factory.floor.geometry.overlap import merged
from factory.floor.geometry.overlapping import overlaps_of
from factory.floor.geometry.product import product_geometry
from factory.floor.geometry.solids import Product
from factory.floor.mating import bodies, paths
from factory.floor.mating.depth import exact, polytope
from factory.floor.mating.findings import Level, Mating, Matings
from factory.floor.mating.mating import judged as without_lifts
from factory.floor.mating.mating import matings
from factory.floor.mating.paths import LAST, NEAR, depths_of, sought
from factory.support.errors import Diagnostic
from factory.theory.compiler.expanding import Node
from factory.theory.lang import read_pag
from factory.theory.lang.pag_reader import load_pag
from factory.theory.lang.template_reader import all_templates
from factory.theory.problem.pag import PAG, AllowedOverlap
from tests.command_line import Terminal
from tests.pag_values import factory_of

TEMPLATES = all_templates()
MM = 1e-3
ALONG_Y = "root = r; r = mate ( a, b ); "
ALONG_X = (
    "root = r; r = mate ( s, far ); s = mate ( a, b ); far = atomic ( box = (0.01, 0.01, 0.01),"
)
ALONG_X += " pos = (0, 9, 0) ); "


def block(*spans: tuple[float, float]) -> np.ndarray:
    """The corners of a box from its intervals in x, y and z [mm]."""
    return np.array(list(every(*spans)), float) * MM


def prism(radius: float, low: float, high: float, axis: int, sides: int = 48) -> np.ndarray:
    """A round peg along an axis through the origin [mm]."""
    angles = 2 * np.pi * np.arange(sides) / sides
    rim = np.column_stack([np.cos(angles), np.sin(angles)]) * radius
    ends = [np.insert(rim, axis, value, axis=1) for value in (low, high)]
    return np.concatenate(ends) * MM


def plate(hole: float, axis: int, size: float = 30, thick: float = 5) -> list[np.ndarray]:
    """A plate across an axis, with a square hole of half width `hole`, in four boxes [mm]."""
    spans = (
        [(-size, -hole), (-size, size)],
        [(hole, size), (-size, size)],
        [(-hole, hole), (-size, -hole)],
        [(-hole, hole), (hole, size)],
    )
    found = []
    for span in spans:
        span.insert(axis, (-thick, thick))
        found.append(block(*span))
    return found


def judged(text: str, **pieces: list[np.ndarray]) -> Matings:
    """The matings of a PAG whose parts `pieces` are made of these convex bodies."""
    pag, product = made_of(text, **pieces)
    return matings(Node.expand(pag, TEMPLATES), product)


def made_of(text: str, **pieces: list[np.ndarray]) -> tuple[PAG, Product]:
    """A PAG whose parts `pieces` are made of these convex bodies."""
    atoms = "; ".join(f"{name} = atomic ( box = (1, 1, 1) )" for name in pieces)
    pag = read_pag(text + atoms, TEMPLATES)
    product = product_geometry(pag)
    solids = dict(product.solids)
    for name, mine in pieces.items():
        corners = np.concatenate(mine)
        low, high = corners.min(axis=0), corners.max(axis=0)
        solid = replace(solids[name], pieces=tuple(mine), corners=corners, low=low, high=high)
        solids[name] = solid
    return pag, replace_solids(product, solids)


def replace_solids(product: Product, solids: Mapping[str, object]) -> Product:
    return Product(solids, product.low, product.high)  # type: ignore[arg-type]


def one(found: Matings, label: str = "") -> Mating:
    """The mating of a label, or the first."""
    return next(m for m in found.all if label in ("", m.label))


@pytest.mark.parametrize(
    ("axis", "text", "kind"),
    [(1, ALONG_Y, "slide"), (0, ALONG_X, "slide"), (0, ALONG_Y, "blocked")],
)
def test_a_peg_goes_into_its_hole_along_its_axis_alone(axis: int, text: str, kind: str) -> None:
    found = judged(text, a=plate(8, axis), b=[prism(7.9, -20, 20, axis)])
    mating = one(found, "r" if text == ALONG_Y else "s")
    assert mating.approach.kind == kind
    if kind == "blocked":
        assert mating.clashes[0].depth > 5 * MM
    else:
        assert mating.level == Level.STRICT


def test_a_box_in_a_frame_is_lowered_and_under_a_lid_is_blocked() -> None:
    frame, inner = plate(8, 2), block((-8, 8), (-8, 8), (-4, 4))
    into = one(judged(ALONG_Y, a=frame, b=[inner])).approach
    assert (into.kind, into.stroke) == ("lower", pytest.approx(0.029))
    lids = [block((-30, 30), (-30, 30), z) for z in ((-7, -5), (5, 7))]
    closed = one(judged(ALONG_Y, a=frame + lids, b=[inner]))
    assert closed.approach.kind == "blocked"
    assert closed.clashes[0].parts == ("a", "b")


def test_robots_without_lifts_lower_nothing() -> None:
    pag, product = made_of(ALONG_Y, a=plate(8, 2), b=[block((-8, 8), (-8, 8), (-4, 4))])
    factory = without_lifts(factory_of(pag), product)
    (approach,) = (o.approach for o in factory.operations if len(o.inputs) > 1)
    assert approach is not None and approach.kind == "blocked"


@pytest.mark.parametrize(("by", "level"), [(-0.04, Level.NO_DEEPER)])
def test_planted_fault_something_is_in_the_way_by_a_hair(by: float, level: int) -> None:
    peg = [block((-7, 7), (-20, 20), (-7, 7)), block((-8 - by, 0), (6, 20), (-7, 7))]
    peg.append(block((-8 - by, 0), (-20, -6), (-7, 7)))
    assert one(judged(ALONG_Y, a=plate(8, 1), b=peg)).slide == level


def convex_pair(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Two convex bodies near each other, of some centimetres: random, prisms, or alike."""
    rng = np.random.default_rng(seed)
    found = []
    for kind in rng.integers(3, size=2):
        if kind == 0:
            found.append(rng.normal(size=(int(rng.integers(4, 24)), 3)) * 0.02)
        else:
            sides, axis = int(rng.integers(3, 14)), int(rng.integers(3))
            found.append(prism(20, -15, 25, axis, sides) * rng.uniform(0.5, 1.5))
    if seed % 5 == 0:
        found[1] = found[0].copy()
    return found[0], found[1] + rng.normal(size=3) * 0.04


def brute(p: np.ndarray, q: np.ndarray, direction: np.ndarray, shifts: np.ndarray) -> np.ndarray:
    """D(λ) from the hull of all differences of vertices."""
    hull = ConvexHull((q[:, None] - p[None]).reshape(-1, 3) * 100).equations
    heights = -hull[:, 3] / 100
    return np.array([(heights - hull[:, :3] @ (shift * direction)).min() for shift in shifts])


def test_blades_over_a_box_meet_its_edges_on_the_right_side() -> None:
    """The faces beside the edge of a blade say nearly nothing of where outside is."""
    box, along = block((-20, 20), (-20, 20), (-20, 20)), np.array([-0.03, 0.03])
    blade = np.array([(x, y, z) for x in along for y, z in ((0, 0), (5e-4, 0.02), (-5e-4, 0.02))])
    met = 0
    for seed in range(24):
        rng = np.random.default_rng(seed)
        turned = blade @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + rng.normal(size=3) * 0.02
        depth = exact(polytope(box), polytope(turned)).heights(np.zeros((1, 3))).min()
        expected = brute(box, turned, np.eye(3)[0], np.zeros(1))[0]
        assert max(depth, 0) == pytest.approx(max(expected, 0), abs=1e-8), seed
        assert (depth > 0) == (expected > 0)
        met += depth > 0
    assert 5 < met < 24


def test_what_grazes_is_met_beyond_the_last_bit_of_the_way() -> None:
    for seed in range(12):
        p, q = convex_pair(seed)
        difference = exact(polytope(p), polytope(q))
        for axis, direction in enumerate(np.eye(3)):
            heights, slopes = difference.heights(np.zeros((1, 3))), difference.normals[:, axis]
            depths, places = depths_of(heights, slopes)
            for side, sign in enumerate((-1, 1)):
                graze, place = depths.graze[0, side], places[2 + side]
                assert sign * place[0] >= LAST
                assert max(graze, 0) == pytest.approx(
                    max(brute(p, q, direction, place)[0], 0), abs=1e-8
                )
                beyond = sign * np.linspace(LAST, 0.4, 400)
                assert max(graze, 0) >= brute(p, q, direction, beyond).max() - 1e-8


def test_depths_that_are_sought_are_those_of_all_facets() -> None:
    for seed in range(12):
        p, q = convex_pair(seed)
        apart = np.random.default_rng(seed).normal(size=(6, 3)) * 0.04
        for axis in range(3):
            difference = exact(polytope(p), polytope(q))
            all_, _ = depths_of(difference.heights(apart), difference.normals[:, axis])
            found = sought(p, q, apart, axis)
            assert (found.faulty == all_.faulty).all()
            faulty = all_.faulty.any(axis=1)
            for one, other in ((found.path, all_.path), (found.finished, all_.finished)):
                assert np.maximum(one, 0)[faulty] == pytest.approx(
                    np.maximum(other, 0)[faulty], abs=NEAR
                )
                assert (np.maximum(one, 0) >= np.maximum(other, 0) - 1e-8).all()


def egg(count: int, size: Sequence[float]) -> np.ndarray:
    """Points spread over an ellipsoid."""
    z = 1 - (2 * np.arange(count) + 1) / count
    turns = np.pi * (1 + 5**0.5) * np.arange(count)
    ring = np.sqrt(1 - z**2)
    return np.column_stack([ring * np.cos(turns), ring * np.sin(turns), z]) * size


def test_few_facets_of_fine_bodies_are_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two balls of 3,000 vertices: their difference has about 20,000 facets, and pairs of edges
    that may span one are 80 million."""
    looked: list[int] = []

    def touching(normals: np.ndarray, *bodies: np.ndarray) -> object:
        looked.append(len(normals))
        return real_touching(normals, *bodies)

    real_touching = paths._touching
    monkeypatch.setattr(paths, "_touching", touching)
    monkeypatch.setattr(bodies, "exact", pytest.fail)
    p, q = egg(3000, (0.02, 0.03, 0.02)), egg(3000, (0.02, 0.02, 0.04))
    beside, above = (
        one(judged(ALONG_Y, a=[p], b=[q + by])) for by in ([0.041, 0, 0], [0, 0.06, 0])
    )
    assert beside.approach.sides == (-1, +1) and above.approach.sides == (+1,)
    depth = sought(q, p, np.array([[0.03, 0.0, 0.0]]), 1).finished[0]
    assert depth == pytest.approx(0.01, abs=1e-4)  # the radii along x are 0.04 together
    assert sum(looked) < 500


CLOSED = """root = r;
r = mate ( a, b );
a = mate ( low, left, right, front, rear, lid );
low = atomic ( box = (0.06, 0.06, 0.01), pos = (0, 0, 0.005) );
left = atomic ( box = (0.01, 0.06, 0.03), pos = (-0.025, 0, 0.025) );
right = atomic ( box = (0.01, 0.06, 0.03), pos = (0.025, 0, 0.025) );
front = atomic ( box = (0.0398, 0.01, 0.03), pos = (0, -0.025, 0.025) );
rear = atomic ( box = (0.0398, 0.01, 0.03), pos = (0, 0.025, 0.025) );
lid = atomic ( box = (0.06, 0.06, 0.01), pos = (0, 0, 0.045) );
b = atomic ( box = (0.03, 0.03, 0.02), pos = (0, 0, 0.02) )
"""


@pytest.fixture
def closed(tmp_path: Path) -> Path:
    """A box in a closed box."""
    file = tmp_path / "closed.pag"
    file.write_text(CLOSED)
    return file


def test_of_many_blocked_operations_the_first_are_told_and_how_many_more() -> None:
    other, (shown, _) = Diagnostic("Size", "long"), LISTED["Blocked"]
    many = [Diagnostic("Blocked", f"b cannot come to r{i}: b and c 1.00 mm") for i in range(shown)]
    assert condensed([other, *many], verbose=False) == [other, *many]
    more = [*many, *many]
    assert condensed([other, *more], verbose=True) == [other, *more]
    *first, last = condensed([other, *more], verbose=False)
    assert first == [other, *many]
    assert str(last) == f"Blocked and {shown} more operations are blocked\n    list: -v"


def test_check_lists_approaches_and_clashes(run: Terminal, closed: Path) -> None:
    document = run("check", closed, "--json").json
    found = document["approaches"]
    assert {k: found[k] for k in ("operations", "slide", "lower", "blocked")} == {
        "operations": 6,
        "slide": 0,
        "lower": 5,
        "blocked": 1,
    }
    assert (found["left_out"], found["no_deeper"], found["strict"]) == (5, 5, 5)
    last = found["list"][-1]
    assert (last["label"], last["kind"], last["axis"], last["level"]) == (
        "r",
        "blocked",
        "y",
        "none",
    )
    (clashes,) = document["clashes"]
    (clash,) = clashes["pairs"]
    assert (clashes["label"], clash["parts"]) == ("r", ["b", "front"])
    assert clash["depth_mm"] == pytest.approx(20) and clashes["line"] == 2
    assert Path(clashes["file"]) == closed


def test_check_computes_no_geometry_where_no_part_has_a_shape(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "plain.pag"
    file.write_text("root = r; r = mate ( a, b ); a = atomic(); b = atomic()")
    monkeypatch.setattr("factory.floor.geometry.product.product_geometry", pytest.fail)
    document = run("check", file, "--clashes", tmp_path / "none", "--json").json
    assert document["approaches"] is None and document["clashes"] == []
    assert not (tmp_path / "none").exists()


def test_pictures_are_written_into_the_folder_alone(run: Terminal, tmp_path: Path) -> None:
    file, folder = tmp_path / "odd.pag", tmp_path / "pictures" / "here"
    file.write_text(
        CLOSED.replace("root = r", "root = ..").replace("r = mate ( a", ".. = mate ( a")
    )
    before = set(tmp_path.rglob("*"))
    assert run("check", file, "--clashes", folder).status == 0
    new = set(tmp_path.rglob("*")) - before - {folder, folder.parent}
    assert {path.parent for path in new} == {folder}
    blocked, grip = sorted(path.name for path in new)
    assert grip.startswith("grip-")
    text = (folder / blocked).read_text()
    root = ElementTree.fromstring(text)
    assert root.tag.endswith("svg") and "href" not in text and "url(" not in text
    words = "".join(root.itertext())
    assert "b and front overlap by 20.00 mm, 25.00 mm before" in words
    assert 'class="clash"' in text and " mm" in words


def test_a_link_in_the_folder_is_not_followed(run: Terminal, closed: Path, out: Path) -> None:
    aim = closed.parent / "elsewhere.svg"
    (out / "clash-001-r.svg").symlink_to(aim)
    done = run("check", closed, "--clashes", out)
    assert done.status == 2 and "is a link" in done.err
    assert not aim.exists()


def test_a_file_where_the_folder_should_be_is_refused(run: Terminal, closed: Path) -> None:
    done = run("check", closed, "--clashes", closed)
    assert done.status == 2 and "is a file, not a folder" in done.err


def test_a_picture_is_the_same_every_time_and_survives_odd_labels() -> None:
    pag = read_pag(CLOSED.replace("front", "fé"), TEMPLATES)
    product = product_geometry(pag)
    found = matings(Node.expand(pag, TEMPLATES), product)
    (mating,) = found.of_kind("blocked")
    picture = draw(mating, found, product)
    assert picture == draw(mating, matings(Node.expand(pag, TEMPLATES), product), product)
    odd = ElementTree.fromstring(draw(replace(mating, label="<&>" + "x" * 90), found, product))
    assert "<&>xxxx" in "".join(odd.itertext())


def bar(diameter: float, length: float, sides: int = 48) -> Manifold:
    """An upright round bar about the origin [mm]."""
    return Manifold.cylinder(MM * length, MM * diameter / 2, -1.0, sides, True)


def write(folder: Path, **bodies: Manifold) -> Path:
    """A folder of STL files in millimetres."""
    folder.mkdir(exist_ok=True)
    for name, body in bodies.items():
        vertices, faces = merged(body.to_mesh64())
        mesh = trimesh.Trimesh(vertices / MM, faces, process=False)
        (folder / f"{name}.stl").write_bytes(mesh.export(file_type="stl"))
    return folder


PINNED = """root = r; r = mate ( ring, pin );
ring = atomic ( mesh = "ring.stl", scale = 0.001 );
pin = atomic ( cylinder = ( 0.0015, 0.03 ), pos = ( 0.012, 0, 0.005 ) );
allow ( pin, ring, 0.01 );"""


def test_a_way_that_cuts_is_not_clean_however_deep_parts_are(tmp_path: Path) -> None:
    """A pin where the ring has no hole is as deep in it as it is thick. It comes sideways through
    solid without getting deeper, or from above, where it cuts no more than it fills."""
    cone = Manifold.cylinder(10 * MM, 20 * MM, 19 * MM, 48, True)
    write(tmp_path, ring=cone - bar(10, 20))
    (tmp_path / "r.pag").write_text(PINNED)
    pag = load_pag(tmp_path / "r.pag", all_templates())
    product = product_geometry(pag)
    assert overlaps_of(product).pairs[0].depth == pytest.approx(1.5e-3, rel=0.05)
    nodes = Node.expand(pag, all_templates())
    (made,) = matings(nodes, product).all
    assert made.approach.told == "pin is lowered 0.035 m"
    assert (made.slide, made.lower) == (Level.LEFT_OUT, Level.NO_DEEPER)
    found = matings(nodes, product, lifts=False)
    assert found.faults(pag.allowed) == ()
    assert "through each other" in found.notes(pag.allowed)[0]


def hooks() -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Two hooks that hold each other along y."""
    high = (0, 10)
    a = [block((0, 30), (0, 10), high), block((20, 30), (10, 30), high)]
    a.append(block((10, 20), (20, 30), high))
    b = [block((0, 20), (40, 50), high), block((0, 9.9), (10.1, 40), high)]
    b.append(block((9.9, 19.9), (10.1, 19.9), high))
    return a, b


def test_what_passes_through_each_other_is_noted_where_it_is_allowed() -> None:
    a, b = hooks()
    covers = [block((0, 30), (0, 50), z) for z in ((-5, 0), (10, 15))]
    found = judged(ALONG_Y, a=a + covers, b=b)
    assert found.notes([]) == found.notes([AllowedOverlap(0.001)]) == []
    (note,) = found.notes([AllowedOverlap(0.011, ("a", "b"))])
    assert note.startswith("a pair of parts passes through each other on the way by up to")
