"""Products of our own with true clearances: a chest of drawers, of which everything slides, and a
gearbox, which needs the lift. Nothing of them touches, on the way or when finished, in the engine's
own eyes."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np
import pytest

import factory
from factory.floor.geometry.product import product_geometry
from factory.floor.geometry.solids import Product
from factory.support.arrays import Array
from tests.command_line import Terminal
from tests.paths import ROOT, files_in

EXAMPLES = ROOT / "examples"
OWN = ["chest", "gearbox"]

GAP = 0.08e-3
"""What finished parts are at least apart [m]."""

STEP = 0.5e-3
"""Between two places at which a moving input is looked at [m]."""


def test_the_generator_writes_the_same_bytes(tmp_path: Path) -> None:
    subprocess.run([sys.executable, EXAMPLES / "make_meshes.py", tmp_path], check=True)
    made = files_in(tmp_path)
    kept = {f"{name}/{k}" for name in [*OWN, "peg"] for k in files_in(EXAMPLES / name)}
    assert len(made) == len(kept) > 0
    for path in tmp_path.rglob("*.obj"):
        assert path.read_bytes() == (EXAMPLES / path.relative_to(tmp_path)).read_bytes(), path.name


@pytest.mark.parametrize("name", OWN)
def test_every_file_is_convex_bodies(name: str) -> None:
    product = product_geometry(factory.load_pag(EXAMPLES / f"{name}.pag"))
    assert product.warnings == ()
    for solid in product.solids.values():
        assert solid.mesh is not None and len(solid.mesh.pieces) > 1, solid.label
        bodies = (EXAMPLES / name).rglob("*.obj")
        counts = {path.read_text().count("# body") for path in bodies}
        assert len(solid.mesh.pieces) in counts


@pytest.mark.parametrize("name", OWN)
def test_every_approach_is_clean(run: Terminal, name: str) -> None:
    document = run("check", EXAMPLES / f"{name}.pag", "--json").json
    found = document["approaches"]
    assert found["strict"] == found["operations"] > 10
    assert found["blocked"] == 0 and document["clashes"] == []
    assert all(pairs == 0 for approach in found["list"] for pairs in approach["excluded"])
    if name == "chest":
        assert found["slide"] == found["operations"]
    else:
        assert found["lower"] >= 2 and found["slide"] >= 2
        assert all(approach["stroke_m"] < 0.15 for approach in found["list"])


@pytest.mark.parametrize("name", OWN)
def test_it_is_made(run: Terminal, name: str) -> None:
    done = run("run", EXAMPLES / f"{name}.pag", "--units", 2, "--json")
    assert done.status == 0, done.err
    document = done.json
    assert document["products"] == 2 and document["refines_net"]
    assert document["product_error_max_mm"] <= 0.05
    assert document["unintended_contacts"] == 0, document["contacts"]
    assert document["engine_warnings"] == 0


# --- the engine's own eyes ------------------------------------------------------------------------


class Hands:
    """A product's parts in the engine, each to be shifted from its place."""

    def __init__(self, product: Product) -> None:
        self.labels = list(product.solids)
        assets, bodies = [], []
        for label in self.labels:
            geoms = []
            for n, piece in enumerate(product.solids[label].pieces):
                vertices = " ".join(f"{v:.9g}" for v in piece.ravel())
                assets.append(f'<mesh name="{label}.{n}" vertex="{vertices}"/>')
                geoms.append(f'<geom type="mesh" mesh="{label}.{n}"/>')
            bodies.append(f"<body><freejoint/>{''.join(geoms)}</body>")
        self.m = mujoco.MjModel.from_xml_string(
            f"<mujoco><asset>{''.join(assets)}</asset>"
            f"<worldbody>{''.join(bodies)}</worldbody></mujoco>"
        )
        self.d = mujoco.MjData(self.m)

    def contacts(self, shifts: Mapping[str, Array]) -> set[tuple[str, str]]:
        """The parts that touch, of those named, shifted; the others are far away."""
        places = self.d.qpos.reshape(-1, 7)
        for n, label in enumerate(self.labels):
            places[n] = (100.0 * (n + 1), 0, 0, 1, 0, 0, 0)
            if label in shifts:
                places[n, :3] = shifts[label]
        mujoco.mj_fwdPosition(self.m, self.d)
        touching = self.m.geom_bodyid[self.d.contact.geom] - 1
        return {(self.labels[a], self.labels[b]) for a, b in touching}


def way(approach: Mapping[str, object], side: int, long: float) -> list[Array]:
    """Shifts of the input that moves relative to the other, from afar to its place; none at the
    end."""
    axis = np.eye(3)["xy".index(str(approach["axis"]))]
    slide = [side * s * axis for s in np.arange(long, 0, -STEP)]
    stroke = float(approach["stroke_m"])  # type: ignore[arg-type]
    if not approach["lowered"]:
        return slide
    up = np.array([0, 0, stroke])
    return [
        *(up + s for s in slide[:: int(5e-3 / STEP)]),
        *np.arange(1, 0, -STEP / stroke)[:, None] * up,
    ]


@pytest.mark.parametrize("name", OWN)
def test_nothing_touches_on_the_way(run: Terminal, name: str) -> None:
    document = run("check", EXAMPLES / f"{name}.pag", "--json").json
    plan = factory.compile(factory.load_pag(EXAMPLES / f"{name}.pag"))
    product = product_geometry(plan.pag)
    hands = Hands(product)
    long = float((product.high - product.low).max())
    for approach in document["approaches"]["list"]:
        first, last = (plan.contents[label] for label in approach["inputs"])
        lowers_first = approach["lowered"] == approach["inputs"][0]
        for side in approach["sides"]:
            for shift in way(approach, side, long):
                shift = shift * (1, 1, -1 if lowers_first else 1)
                shifts = {**dict.fromkeys(first, np.zeros(3)), **dict.fromkeys(last, shift)}
                assert not hands.contacts(shifts), (approach["label"], side, shift)


@pytest.mark.parametrize("name", OWN)
def test_finished_parts_are_apart(name: str) -> None:
    product = product_geometry(factory.load_pag(EXAMPLES / f"{name}.pag"))
    hands = Hands(product)
    in_place = dict.fromkeys(hands.labels, np.zeros(3))
    assert not hands.contacts(in_place)
    hands.m.geom_margin[:] = GAP / 2
    assert not hands.contacts(in_place)
    hands.m.geom_margin[:] = 1e-3
    assert len(hands.contacts(in_place)) >= len(hands.labels) - 1  # or the test is blind


def test_a_peg_that_misses_its_hole_is_seen() -> None:
    """The tests above would notice: the knob half a millimetre to the side touches its front."""
    hands = Hands(product_geometry(factory.load_pag(EXAMPLES / "chest.pag")))
    for x, touches in ((0.0, False), (0.0005, True)):
        shifts = {"front1": np.zeros(3), "knob1": np.array([x, 0, 0])}
        assert bool(hands.contacts(shifts)) == touches
