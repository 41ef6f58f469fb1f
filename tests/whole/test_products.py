"""Real products that nobody here designed: LEGO sets with brick meshes, from the folder beside the
project. Skipped where that is missing."""

from __future__ import annotations

from pathlib import Path

import mujoco
import pytest

from tests.command_line import Terminal
from tests.paths import PAPER, ROOT, files_in

FOLDER = ROOT.parent / "shared" / "products" / "ldraw"

SMALL = ["30023-1-Lighthouse", "889-1-RadarTruck", "6966-1-JediStarfighter-Mini"]
LARGE = ["4494-1-Imperial_Shuttle-Mini", "5935-1-IslandHopper"]

pytestmark = pytest.mark.skipif(
    not FOLDER.is_dir(), reason="the LDraw products are not beside this checkout"
)


def product(name: str) -> Path:
    return FOLDER / f"{name}.pag"


CLASHES = {LARGE[0]: "8mm", LARGE[1]: "13mm", SMALL[2]: "1mm"}
"""How deep bricks pass through each other in the steps of those whose order is not free of it."""


def assert_well_made(run: Terminal, name: str, units: int) -> None:
    allowed = ("--allow", CLASHES[name]) if name in CLASHES else ()
    done = run("run", product(name), "--units", units, "--json", *allowed)
    assert done.status == 0, done.err
    document = done.json
    assert document["products"] == units
    assert document["refines_net"]
    assert document["product_error_max_mm"] <= 0.2
    assert document["handoff_gap_max_mm"] <= 1.0
    assert document["unintended_contacts"] == 0, document["contacts"]
    assert document["engine_warnings"] == 0
    events = [event["transition"] for event in document["events"]]
    assert events.count("dropoff_e") == units


@pytest.mark.slow
@pytest.mark.parametrize("name", LARGE)
def test_large_products_are_made(run: Terminal, name: str) -> None:
    assert_well_made(run, name, 1)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "robots"), [(SMALL[0], 7), (SMALL[1], 17)])
def test_magazines_of_lines_are_solid(run: Terminal, name: str, robots: int) -> None:
    words = ("--robots", robots, "--effort", 40, "--seeds", 1, "--units", 2)
    done = run("fidelity", product(name), *words, "--jobs", 1, "--json")
    assert done.json["figures"]["hidden_penetration_max_mm"]["worst"] < 0.1


@pytest.mark.slow
@pytest.mark.parametrize(
    "file", [product(SMALL[0]), PAPER.with_name("truck.pag")], ids=["light", "truck"]
)
def test_few_robots_take_the_time_that_is_predicted(run: Terminal, file: Path) -> None:
    robots = 7 if file.parent == FOLDER else 17
    words = ("--robots", robots, "--effort", 40, "--units", 12, "--json")
    done = run("run", file, *words).json
    assert done["cycle_time_s"] == pytest.approx(done["predicted_cycle_time_s"], rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("name", LARGE)
def test_large_products_are_built(run: Terminal, tmp_path: Path, name: str) -> None:
    done = run("build", product(name), "--mjcf", tmp_path / "m.xml", "--units", 1, "--json")
    assert done.status == 0, done.err
    assert done.json["clearance"]["holds"]
    (tmp_path / "elsewhere").mkdir()
    for path in tmp_path.glob("m*"):
        path.rename(tmp_path / "elsewhere" / path.name)
    m = mujoco.MjModel.from_xml_path(str(tmp_path / "elsewhere" / "m.xml"))
    assert (m.njnt, m.neq) == (done.json["joints"], done.json["welds"])
    meshes = sum(m.mesh(n).name.startswith("mesh/") for n in range(m.nmesh))
    assert len(files_in(tmp_path)) == 1 + meshes + len({"m.mjb", "m.mjb.seal"})
