"""What no hand can hold is told, with the nearest misses and what is in their way, and drawn."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from shutil import copytree
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from factory.floor.layout.hands.in_the_way import IN_THE_WAY
from factory.floor.layout.hands.misses import THERE, NoGrip
from factory.pipeline import read
from tests.paths import ROOT

GEARBOX = ROOT / "examples" / "gearbox.pag"


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


@pytest.mark.parametrize("name", ["output"])
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


def test_every_obstacle_of_a_hand_has_words() -> None:
    assert {*THERE} == {*IN_THE_WAY}
