"""Parts that are not where they are in the finished product, and units that no one states: refused,
or asked about on a run."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
import trimesh

from factory.apps.planning.parts import InPlace
from factory.apps.planning.source import SourceOptions, read_source
from factory.pipeline import all_templates
from factory.support.errors import InputError
from tests.command_line import Terminal
from tests.paths import ROOT

TEMPLATES = all_templates(())
CASES = ROOT.parent / "shared" / "cases"
Parts = Mapping[str, trimesh.Trimesh]


def block(low: tuple[float, ...], high: tuple[float, ...]) -> trimesh.Trimesh:
    """A box from corner to corner."""
    return trimesh.creation.box(bounds=[low, high])


def folder_of(folder: Path, parts: Parts, scale: float = 1.0) -> Path:
    """A folder of STL files."""
    folder.mkdir()
    for name, mesh in parts.items():
        mesh.copy().apply_scale(scale).export(folder / f"{name}.stl")
    return folder


def read(path: Path, parts: Parts, scale: float = 1.0, unit: str | None = None) -> InPlace:
    return read_source(folder_of(path / "parts", parts, scale), TEMPLATES, SourceOptions(unit))


def refused(
    path: Path, parts: Parts, scale: float = 1.0, unit: str | None = None
) -> tuple[str, str]:
    """The code and the message with which parts are refused."""
    with pytest.raises(InputError) as caught:
        read(path, parts, scale, unit)
    (fault,) = caught.value.diagnostics
    assert fault.hint
    return fault.code, fault.message


def stool() -> dict[str, trimesh.Trimesh]:
    """A seat on three legs, in millimetres."""
    places = ((0, 0), (260, 0), (130, 260))
    legs = {f"leg{n}": block((x, y, 0), (x + 40, y + 40, 400)) for n, (x, y) in enumerate(places)}
    return {"seat": block((0, 0, 400), (300, 300, 430)), **legs}


def peg(thicker: float, width: float = 40.0) -> dict[str, trimesh.Trimesh]:
    """A peg in a frame, thicker than the hole by so much [mm]."""
    half, wall = width / 2, width
    hole = block((-half, -half, -50), (half, half, 50))
    frame = block((-wall, -wall, -20), (wall, wall, 20)).difference(hole)
    side = half + thicker / 2
    return {"frame": frame, "peg": block((-side, -side, -30), (side, side, 40))}


@pytest.mark.skipif(not CASES.exists(), reason="shared inputs are not here")
def test_parts_about_their_own_origins_are_refused(run: Terminal, tmp_path: Path) -> None:
    words = ("plan", CASES / "all_at_origin", "-o", tmp_path / "out", "--no-look")
    done = run(*words, "--json")
    assert (done.status, done.codes) == (2, ["NotInPlace"])
    assert "100% of 'lid' is in 'housing'" in done.json["errors"][0]["message"]
    assert not (tmp_path / "out").exists()
    again = run(*words, "--in-place", "--json")
    assert again.status == 0 or "NotInPlace" not in again.codes


@pytest.mark.parametrize("thicker", [0.0, 0.4, 0.8])
@pytest.mark.parametrize("width", [8.0, 40.0])
def test_a_press_fit_is_in_place(tmp_path: Path, thicker: float, width: float) -> None:
    assert len(read(tmp_path, peg(thicker, width)).parts) == 2


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        (peg(4.0), "of 'peg' is in 'frame'"),
        (
            {"a": block((0, 0, 0), (50, 50, 50)), "b": block((0, 0, 48), (50, 50, 90))},
            "of 'b' is in 'a' (2.0 mm deep)",
        ),
        (
            {"a": block((0, 0, 0), (90, 60, 1)), "b": block((20, 0, -30), (21, 60, 30))},
            "of 'b' is in 'a' (0.5 mm deep)",
        ),
    ],
)
def test_parts_one_inside_another_are_refused(tmp_path: Path, parts: Parts, words: str) -> None:
    code, message = refused(tmp_path, parts, unit="mm")
    assert code == "NotInPlace"
    assert "a pair of parts overlaps" in message and words in message


def moved(parts: Parts, factor: float, flat: bool = False) -> dict[str, trimesh.Trimesh]:
    """Parts drawn apart by a factor; `flat`: side by side on a print bed."""
    middle, found, at = parts["seat"].centroid, {}, 0.0
    for name, mesh in parts.items():
        shift = (mesh.centroid - middle) * factor
        if flat:
            shift, at = np.array([at, 0, 0]) - mesh.bounds[0], at + np.ptp(mesh.bounds[:, 0]) + 5
        found[name] = mesh.copy().apply_translation(shift)
    return found


@pytest.mark.parametrize(
    "parts",
    [
        moved(stool(), 0.3),
        moved(stool(), 0.0, flat=True),
        {**stool(), "knob": block((140, 140, 460), (160, 160, 480))},
    ],
    ids=["exploded", "bed", "floating"],
)
def test_groups_that_touch_nothing_are_refused(tmp_path: Path, parts: Parts) -> None:
    code, message = refused(tmp_path, parts)
    assert code == "NotInPlace"
    assert "groups that do not touch each other" in message


def test_a_folder_gives_the_product_its_whole_name(tmp_path: Path) -> None:
    folder_of(tmp_path / "stool_0.4m tall", stool())
    assert read_source(tmp_path / "stool_0.4m tall", TEMPLATES).name == "stool_0.4m-tall"


def test_parts_with_some_play_touch(tmp_path: Path) -> None:
    parts = stool()
    parts["seat"].apply_translation((0, 0, 0.8))
    assert len(read(tmp_path, parts).parts) == 4
    assert len(read_source(tmp_path / "parts", TEMPLATES, SourceOptions("cm")).parts) == 4


def test_a_sheet_of_two_sides_is_said_to_bound_nothing(run: Terminal, tmp_path: Path) -> None:
    """It is neither "-0%" of its hull, nor a fault of ours."""
    turns = np.linspace(0, np.pi, 13)
    points = [(200 * np.cos(t), y, 200 * np.sin(t)) for t in turns for y in (0.0, 500.0)]
    faces = [f for k in range(0, 24, 2) for f in ([k, k + 1, k + 2], [k + 1, k + 3, k + 2])]
    both = [*faces, *([a, c, b] for a, b, c in faces)]
    parts = {
        "gutter": trimesh.Trimesh(points, both, process=False),
        "block": block((-150, 0, -50), (150, 500, 50)),
    }
    words = ("plan", folder_of(tmp_path / "parts", parts), "-o", tmp_path / "out", "--no-look")
    done = run(*words, "--json")
    assert (done.status, done.codes) == (2, ["Hulls"])
    message = done.json["errors"][0]["message"]
    assert message.startswith("'gutter' bounds no volume, and its hull overlaps 'block'")
    assert "%" not in done.err and "not convex" not in done.err


@pytest.mark.parametrize("scale", [1 / 25.4, 0.05, 1 / 254, 0.004])
def test_a_unit_that_is_not_known_is_refused(tmp_path: Path, scale: float) -> None:
    """A product of 17 or 1.7 inches, or of 21.5 or 1.7 cm."""
    code, message = refused(tmp_path, stool(), scale)
    assert code == "Unit"
    length = 430 * scale
    assert f"the product is {length:.4g} units long, {length:.3g} m in m" in message
    assert f"{length * 0.0254:.3g} m in inches" in message
    source = read_source(tmp_path / "parts", TEMPLATES, SourceOptions(unit="in"))
    assert max(p.solid.high[2] for p in source.parts) == pytest.approx(0.0254 * length, rel=1e-4)


@pytest.mark.parametrize(("scale", "unit"), [(1.0, "mm"), (0.001, "m"), (0.2, "mm")])
def test_a_unit_that_is_clear_is_taken_and_said(tmp_path: Path, scale: float, unit: str) -> None:
    source = read(tmp_path, stool(), scale)
    assert any(f"lengths are taken as {unit}: the files state no unit" in n for n in source.notes)


@pytest.mark.parametrize(
    ("name", "scale", "answer", "status"),
    [("unit", 0.01, "in\n", 0), ("place", 1.0, "y\n", 0), ("no", 1.0, "n\n", 2)],
)
def test_on_a_terminal_the_user_is_asked(
    run: Terminal,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    scale: float,
    answer: str,
    status: int,
) -> None:
    parts = stool() if name == "unit" else {**stool(), "knob": block((0, 0, 450), (20, 20, 470))}
    words = ("plan", folder_of(tmp_path / "parts", parts, scale), "-o", tmp_path / "out")
    monkeypatch.setattr("factory.apps.planning.command_line.asking.is_terminal", lambda: True)
    monkeypatch.setattr("sys.stdin", io.StringIO(answer))
    done = run(*words, "--no-look", "--seconds", 1)
    assert done.status == status, done.err
    asked = "unit of lengths" if name == "unit" else "plan them where they are?"
    assert asked in done.err
    assert (tmp_path / "out").exists() == (status == 0)


def test_links_of_a_chain_that_do_not_touch_are_in_place(tmp_path: Path) -> None:
    """One reaches into the other: no print bed and no exploded display looks so."""
    ring = trimesh.creation.torus(15.0, 3.0, major_sections=24, minor_sections=12)
    other = ring.copy().apply_transform(
        trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0])
    )
    other.apply_translation([15.0, 0.0, 0.0])
    assert len(read(tmp_path, {"one": ring, "other": other}).parts) == 2
