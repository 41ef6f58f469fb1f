"""What no hand can hold is told, with the nearest misses and what is in their way, and drawn."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from shutil import copytree
from tempfile import TemporaryDirectory
from xml.etree import ElementTree

import numpy as np
import pytest

import factory
from factory.floor.layout.hands.in_the_way import IN_THE_WAY
from factory.floor.layout.hands.misses import THERE, NoGrip
from factory.floor.layout.hands.tips import STRONG
from factory.pipeline import read
from tests.command_line import Terminal
from tests.drawn_products import drawn_product
from tests.paths import ROOT

GEARBOX = ROOT / "examples" / "gearbox.pag"

TUB = """root = all; all = mate ( tub, axle ); axle = mate ( shaft, gear );
tub = mate ( base, walls ); walls = mate ( left, right, front, back );
base = atomic ( box = ( 0.1, 0.1, 0.01 ), pos = ( 0, 0, 0.005 ) );
left = atomic ( box = ( 0.01, 0.1, 0.06 ), pos = ( -0.045, 0, 0.04 ) );
right = atomic ( box = ( 0.01, 0.1, 0.06 ), pos = ( 0.045, 0, 0.04 ) );
front = atomic ( box = ( 0.08, 0.01, 0.06 ), pos = ( 0, -0.045, 0.04 ) );
back = atomic ( box = ( 0.08, 0.01, 0.06 ), pos = ( 0, 0.045, 0.04 ) );
shaft = atomic ( box = ( 0.01, 0.01, 0.03 ), pos = ( 0, 0, 0.025 ) );
gear = atomic ( box = ( 0.03, 0.03, 0.01 ), pos = ( 0, 0, 0.045 ) )
"""


@pytest.fixture
def tub(tmp_path: Path) -> Path:
    """An axle whose gear is lowered onto its shaft, in a tub: no hand can hold it."""
    file = tmp_path / "tub.pag"
    file.write_text(TUB)
    return file


def found(file: Path) -> tuple[NoGrip, ...]:
    return read(file).no_grips


@cache
def of_the_gearbox() -> tuple[NoGrip, ...]:
    """Of the gearbox whose shafts have their gears before they are lowered into the tub."""
    text = GEARBOX.read_text()
    for shaft, gear, whole in (("long", "pinion", "input"), ("short", "gear", "output")):
        text = text.replace(f"{shaft}_shaft, {gear},", f"{whole},", 1)
        text += f";\n{whole} = mate ( {shaft}_shaft, {gear} )"
    with TemporaryDirectory() as folder:
        copytree(GEARBOX.with_suffix(""), Path(folder) / "gearbox")
        file = Path(folder) / "gearbox.pag"
        file.write_text(text)
        return found(file)


def test_what_no_hand_can_hold_is_said(tub: Path) -> None:
    (told,) = (warning for warning in read(tub).warnings if warning.code == "NoGrip")
    assert told.message == "no hand can hold 'axle'"
    assert told.hint.startswith("above, 180 of 180 places: parts that are lowered")
    assert "at the nearest miss, (0, 9, 50) mm, gear lowered onto it; behind, " in told.hint
    assert told.position is not None and told.position.line == 1
    assert not found(ROOT / "examples" / "stool.pag")


SCREWS = """unit = mm; root = all; all = mate ( pair, screw ); pair = mate ( base, lid );
base = atomic ( mesh = "base.stl" ); lid = atomic ( mesh = "lid.stl" );
screw[2] = atomic ( mesh = "screw.stl" ) at ( 20, 0, 0 ), ( -20, 0, 0 )
"""
"""A lid on a base, which screws with heads hold."""


def screwed(folder: Path, size: float, head: float, long: float) -> Path:
    """A product with two screws of a size, with heads of some diameter [mm]."""
    import trimesh

    def turned(radius: float, low: float, high: float, at: float = 0.0) -> trimesh.Trimesh:
        body = trimesh.creation.cylinder(radius, high - low, sections=24)
        return body.apply_translation((at, 0, (low + high) / 2))

    def drilled(low: float, high: float) -> trimesh.Trimesh:
        body = trimesh.creation.box((60, 40, high - low)).apply_translation(
            (0, 0, (low + high) / 2)
        )
        holes = [turned(size / 2 + 0.1, low - 1, high + 1, x) for x in (-20, 20)]
        return trimesh.boolean.difference([body, *holes], engine="manifold")

    shank, top = turned(size / 2, 4 - long, 4), turned(head / 2, 4, 4 + size)
    trimesh.boolean.union([shank, top], engine="manifold").export(folder / "screw.stl")
    drilled(-12, 0).export(folder / "base.stl")
    drilled(0, 4).export(folder / "lid.stl")
    file = folder / "screwed.pag"
    file.write_text(SCREWS)
    return file


@pytest.mark.parametrize(("size", "head", "long"), [(2, 3.8, 6), (3, 5.5, 10), (4, 7, 12)])
def test_small_screws_are_held(tmp_path: Path, size: float, head: float, long: float) -> None:
    file = screwed(tmp_path, size, head, long)
    assert not found(file)
    if size == 3:
        made = read(file)
        run = factory.run(made.layout, units=2)
        assert run.succeeded, run.verdict


def test_a_line_says_what_has_no_grip(run: Terminal, tmp_path: Path) -> None:
    """One for all parts, and none where the product is of an unlikely size."""
    file = tmp_path / "pins.pag"
    places = ", ".join(f"( {10 * x}, {10 * y}, 3 )" for x in range(4) for y in range(3))
    file.write_text(
        "unit = mm; root = all; all = mate ( plate, pin );"
        "plate = atomic ( box = (90, 90, 2) );"
        f"pin[12] = atomic ( cylinder = (0.5, 4) ) at {places}"
    )
    pins = ", ".join(f"pin{n}" for n in range(1, 13))
    line = f"NoGrip warning: 12 parts have no grip: {pins}; -v"
    for command in (["check"], ["build"]):
        assert run(*command, file).err.splitlines() == [line]
    assert run("check", file, "-v").err.count("no hand can hold 'pin") == 12
    file.write_text(file.read_text().replace("unit = mm;", ""))
    (told,) = run("check", file, "--json").json["warnings"]
    assert told["code"] == "Size"


def test_the_nearest_miss_is_free_without_what_is_in_its_way(tub: Path) -> None:
    """What is named is what there is: without the wall behind a hand from behind can hold."""
    (grip,) = found(tub)
    behind = next(miss for miss in grip.misses if miss.kind == "behind")
    assert behind.named in [f"{wall} joined to it" for wall in ("front", "back", "left", "right")]
    (wall,) = behind.parts
    lines = [line for line in TUB.splitlines() if not line.startswith(f"{wall} =")]
    walls = [w for w in ("left", "right", "front", "back") if w != wall]
    tub.write_text("\n".join(lines).replace("left, right, front, back", ", ".join(walls)))
    assert not found(tub)


@pytest.mark.parametrize("name", ["input", "output"])
def test_a_miss_is_met_by_all_that_it_names(name: str) -> None:
    grip = next(grip for grip in of_the_gearbox() if grip.label == name)
    assert {miss.kind for miss in grip.misses} == {"below", "behind", "above"}
    for miss in grip.misses:
        assert miss.at is not None and miss.obstacles
        assert np.abs(miss.tried - miss.at).max(axis=1).min() < 1e-6
        for obstacle in miss.obstacles:
            if not obstacle.part:
                assert obstacle.why in ("weak", "hands", "feeder")
                continue
            low = np.maximum(obstacle.ways[:, 0], obstacle.bodies[:, 0])
            high = np.minimum(obstacle.ways[:, 1], obstacle.bodies[:, 1])
            assert len(low) and (high > low).all()
            assert obstacle.part in (*grip.parts, *grip.beside)


def test_a_strong_place_is_nearer_than_a_weak_one(tub: Path) -> None:
    (grip,) = found(tub)
    assert all(miss.share <= STRONG for miss in grip.misses)


def test_check_lists_and_draws_it(run: Terminal, tub: Path, out: Path) -> None:
    document = run("check", tub, "--clashes", out, "--json").json
    (listed,) = document["no_grips"]
    assert (listed["label"], listed["line"], listed["robot"]) == ("axle", 1, "r2")
    above, behind, below = listed["nearest_misses"]
    assert (above["kind"], behind["kind"], below["kind"]) == ("above", "behind", "below")
    assert above["tried"] == 180 and above["at_m"] == [0.0, 0.009, 0.05]
    assert above["in_the_way"] == [{"part": "gear", "why": "lowered onto it"}]
    (file,) = out.iterdir()
    assert file.name == "grip-001-axle.svg"
    text = file.read_text()
    root = ElementTree.fromstring(text)
    assert "href" not in text and "url(" not in text
    words = "".join(root.itertext())
    assert "No hand can hold axle" in words and "obstacles: gear lowered onto it" in words
    drawn = [element.get("class") for element in root.iter()]
    assert drawn.count("nearest") == 6 and drawn.count("hand") == 6 + 1
    tried = sum(miss["tried"] for miss in listed["nearest_misses"])
    assert drawn.count("tried") == tried + 1
    again = run("check", tub, "--clashes", out, "--json").json
    assert again == document and file.read_text() == text


def test_what_hands_can_hold_is_not_drawn(run: Terminal, out: Path) -> None:
    stool = run("check", ROOT / "examples" / "stool.pag", "--clashes", out, "--json")
    assert stool.json["no_grips"] == [] and not list(out.iterdir())


@pytest.mark.parametrize("seed", [39608, 87122, 134636, 150474, 213826])
def test_robots_have_a_hand_unless_it_is_told_before(seed: int, tmp_path: Path) -> None:
    """A robot was laid out on a side on which no hand can hold what it brings, though there was one
    on the other, and nothing told it before the run."""
    project = read(drawn_product(seed).write(tmp_path))
    layout = project.layout
    lacking = {
        robot.name
        for robot in layout.factory.robots
        if (hand := layout.hand(robot.index)) is not None and hand.kind == "none"
    }
    assert lacking == {no_grip.robot for no_grip in project.no_grips}


def test_every_obstacle_of_a_hand_has_words() -> None:
    assert {*THERE} == {*IN_THE_WAY}
