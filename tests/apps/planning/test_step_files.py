"""STEP files by OpenCASCADE 7.9 (`data/step`) and by the writer of these tests: read as drawn."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from factory.apps.planning.source import read_source
from factory.support.meshes.triangles import volume_of
from factory.theory.lang.template_reader import all_templates
from tests.command_line import Terminal
from tests.paths import ROOT
from tests.step_boxes import Box, Vector, step_of

pytest.importorskip("cascadio")

TEMPLATES = all_templates(())
DATA = ROOT / "tests" / "data" / "step"

RED, BLUE, GREEN, GREY = (1.0, 0.0, 0.0), (0.2, 0.4, 0.8), (0.1, 0.7, 0.2), (0.5, 0.5, 0.5)
Part = tuple[tuple[float, ...], float | None, Vector | None]
"""A part as drawn: its box, low and high [mm], its volume [mm³], None where it is that of the box,
and its colour, None for none."""

FILES: Mapping[str, Mapping[str, Part]] = {
    "face_colour": {
        "lower": ((0, 0, 0, 40, 40, 20), None, BLUE),
        "upper": ((0, 0, 20, 40, 40, 30), None, GREY),
    },
    "touching_solids": {
        "pair-1": ((0, 0, 0, 30, 30, 10), None, BLUE),
        "pair-2": ((30, 0, 0, 60, 30, 10), None, BLUE),
        "hollow": ((0, 0, 10, 30, 30, 40), 30**3 - 20**3, GREY),
    },
    "nested_assembly": {
        "plate": ((-30, -20, 0, 30, 20, 10), 24000 - 2 * np.pi * 250, BLUE),
        "left-pin": ((-24.9, -4.9, 0, -15.1, 4.9, 30), np.pi * 4.9**2 * 30, RED),
        "right-pin": ((15.1, -4.9, 0, 24.9, 4.9, 30), np.pi * 4.9**2 * 30, RED),
        "cap": ((-30, -20, 30, 30, 20, 35), None, None),
    },
    "inches": {
        "base": ((0, 0, 0, 101.6, 50.8, 12.7), None, BLUE),
        "top": ((0, 0, 12.7, 101.6, 50.8, 38.1), None, GREY),
    },
}
"""What OpenCASCADE was told to write."""

LOWER, UPPER = ((0, 0, 0), (40, 40, 20)), ((0, 0, 20), (40, 40, 30))
BESIDE: Box = ((40, 0, 0), (80, 40, 20))
OWN: Mapping[str, tuple[str, Mapping[str, Part]]] = {
    "two colours": (
        step_of(
            {"pair": [LOWER, BESIDE], "upper": UPPER},
            colours={"pair": {-1: BLUE, -2: RED, 4: GREEN}},
        ),
        {
            "pair-1": ((0, 0, 0, 40, 40, 20), None, BLUE),
            "pair-2": ((40, 0, 0, 80, 40, 20), None, RED),
            "upper": ((0, 0, 20, 40, 40, 30), None, None),
        },
    )
}
"""What our writer is told to write."""


def assert_read(path: Path, drawn: Mapping[str, Part]) -> None:
    source = read_source(path, TEMPLATES)
    assert sorted(part.label for part in source.parts) == sorted(drawn)
    assert not [w for w in source.warnings if "is not convex" not in w.message]
    for part in source.parts:
        box, volume, colour = drawn[part.label]
        assert 1e3 * np.concatenate([part.solid.low, part.solid.high]) == pytest.approx(
            box, abs=0.012
        )
        whole = np.prod(np.subtract(box[3:], box[:3])) if volume is None else volume
        found = 1e9 * volume_of(part.vertices, part.faces)
        assert found == pytest.approx(whole, rel=1e-5 if volume in (None, 6000) else 5e-3)
        *stated, opacity = part.node.parameter("rgba")  # type: ignore[misc]
        assert opacity == 1
        if colour is not None:
            assert stated == pytest.approx(colour, abs=2e-3)
    several = {name for name in drawn if name.endswith(("-1", "-1-1")) and name[0] in "ptP"}
    assert any("one part each" in note for note in source.notes) or not several


@pytest.mark.usefixtures("steps")
@pytest.mark.parametrize("name", FILES)
def test_what_opencascade_wrote_is_read_as_it_was_drawn(name: str) -> None:
    assert_read(DATA / f"{name}.step", FILES[name])


@pytest.mark.usefixtures("steps")
@pytest.mark.parametrize("name", OWN)
def test_what_another_writer_wrote_is_read_as_it_was_drawn(tmp_path: Path, name: str) -> None:
    text, drawn = OWN[name]
    (tmp_path / "a.step").write_text(text)
    assert_read(tmp_path / "a.step", drawn)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"no STEP at all", "it is not a STEP file"),
        (b"ISO-10303-21;\nHEADER;\n", "OpenCASCADE finds no faces in it"),
    ],
)
def test_what_is_no_step_file_is_told(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, content: bytes, words: str
) -> None:
    (tmp_path / "a.step").write_bytes(content)
    done = Terminal(capsys)("plan", tmp_path / "a.step", "-o", tmp_path / "out", "--json")
    assert (done.status, done.codes) == (2, ["BadMesh"])
    assert words in done.json["errors"][0]["message"]


def test_a_file_that_ends_its_reader_ends_no_more(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What makes OpenCASCADE crash, here an abort in its place, is told with the status."""
    monkeypatch.setattr(
        "factory.apps.importing.scene_file.CONVERT", "import os; print('x'); os.abort()"
    )
    (tmp_path / "a.step").write_text(step_of({"a": LOWER}))
    done = Terminal(capsys)("plan", tmp_path / "a.step", "-o", tmp_path / "out", "--json")
    assert (done.status, done.codes) == (2, ["BadMesh"])
    assert "it ended with status -6" in done.json["errors"][0]["message"]


@pytest.mark.usefixtures("steps")
def test_a_fault_of_ours_is_no_fault_of_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def wrong(*_: object) -> None:
        raise IndexError("ours")

    (tmp_path / "a.step").write_text(step_of({"a": LOWER}))
    monkeypatch.setattr("factory.apps.importing.scene_file._body", wrong)
    with pytest.raises(IndexError):
        read_source(tmp_path / "a.step", TEMPLATES)
