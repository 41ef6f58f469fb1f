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
from factory.support.errors import InputError
from factory.theory.lang.template_reader import all_templates
from tests.command_line import Terminal

TEMPLATES = all_templates(())
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


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        (
            {"a": block((0, 0, 0), (90, 60, 1)), "b": block((20, 0, -30), (21, 60, 30))},
            "of 'b' is in 'a' (0.5 mm deep)",
        )
    ],
)
def test_parts_one_inside_another_are_refused(tmp_path: Path, parts: Parts, words: str) -> None:
    code, message = refused(tmp_path, parts, unit="mm")
    assert code == "NotInPlace"
    assert "a pair of parts overlaps" in message and words in message


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


def test_a_unit_that_is_not_known_is_refused(tmp_path: Path) -> None:
    """A product of 17 or 1.7 inches, or of 21.5 or 1.7 cm."""
    scale = 1 / 25.4
    code, message = refused(tmp_path, stool(), scale)
    assert code == "Unit"
    length = 430 * scale
    assert f"the product is {length:.4g} units long, {length:.3g} m in m" in message
    assert f"{length * 0.0254:.3g} m in inches" in message
    source = read_source(tmp_path / "parts", TEMPLATES, SourceOptions(unit="in"))
    assert max(p.solid.high[2] for p in source.parts) == pytest.approx(0.0254 * length, rel=1e-4)


def test_on_a_terminal_the_user_is_asked(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    parts = {**stool(), "knob": block((0, 0, 450), (20, 20, 470))}
    words = ("plan", folder_of(tmp_path / "parts", parts, 1.0), "-o", tmp_path / "out")
    monkeypatch.setattr("factory.apps.planning.command_line.asking.is_terminal", lambda: True)
    monkeypatch.setattr("sys.stdin", io.StringIO("n\n"))
    done = run(*words, "--no-look", "--seconds", 1)
    assert done.status == 2 and "plan them where they are?" in done.err
    assert not (tmp_path / "out").exists()
