"""Manipulators: a part that is presented turned is taken from above, turned back and lowered."""

from __future__ import annotations

from pathlib import Path

import pytest

from factory.apps.exports import stock
from factory.apps.exports.ways import ways
from factory.engine.mjcf.loading import load
from factory.engine.mjcf.model import build_model
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.embedding import lay_out
from factory.floor.layout.layout import Layout
from factory.floor.layout.request import Ground
from factory.floor.robots.catalogue import load_catalogue
from factory.pipeline import read
from factory.support.errors import InputError
from factory.support.settings import Settings
from tests.clearance_values import check
from tests.command_line import Terminal
from tests.paths import ROOT

PEG = ROOT / "examples" / "peg.pag"


@pytest.fixture(scope="module")
def cell() -> Layout:
    return read(PEG).layout


def written(folder: Path, text: str) -> Path:
    path = folder / "p.pag"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("statement", "code", "words"),
    [
        ("mate ( base, held ); held = relay ( peg )", "NeedsTurn", "'mate' turns nothing"),
        ("place ( peg, base )", "NeedsTurn", "'place' turns nothing"),
    ],
)
def test_what_is_presented_turned_has_to_be_turned(
    statement: str, code: str, words: str, tmp_path: Path
) -> None:
    text = PEG.read_text().replace("place ( base, peg )", statement)
    text = text.replace('mesh = "peg/base.obj", scale = 0.001', "box = (0.08, 0.08, 0.01)")
    with pytest.raises(InputError) as refused:
        _ = read(written(tmp_path, text)).factory
    found = {d.code: d.message for d in refused.value.diagnostics}
    assert words in found[code]


def test_what_is_placed_comes_from_above(tmp_path: Path) -> None:
    """A roof over its place, or no shapes at all."""
    parts = "box = (0.08, 0.08, 0.02), pos = (0, 0, 0.06)", "box = (0.04, 0.02, 0.03)"
    for base, peg in (parts, ("", "")):
        text = f"root = c; c = place ( a, b ); a = atomic ( {base} ); b = atomic ( {peg} )"
        with pytest.raises(InputError, match="cannot be lowered") as refused:
            _ = read(written(tmp_path, text)).factory
        assert [d.code for d in refused.value.diagnostics] == ["Blocked"]


def test_a_manipulator_goes_no_way_that_can_be_relayed(cell: Layout) -> None:
    assert read(PEG).with_ground(Ground(relay=True)).layout.factory == cell.factory


def test_a_manipulator_needs_a_hand(cell: Layout) -> None:
    layout = lay_out(cell.factory, cell.product)
    with pytest.raises(InputError, match="NoGrip r2 has no hand to turn 'peg/pick' with"):
        Simulation(layout, RunRequest())


def test_the_net_keeps_who_brings_and_who_takes_away_apart(cell: Layout) -> None:
    """The robot that brings the peg, and the carrier under the same tool: a checker that knows only
    MJCF, ways and circuits finds nothing, and finds the pair where its circuits are left out."""
    copies = {leaf.label: 1 for leaf in cell.factory.leaves}
    settings = Settings(timestep=0.002)
    model = build_model(cell, load_catalogue(), copies, settings, finish=stock.write)
    assert cell.certificate is not None
    m, machines, clearance = load(model), ways(model), cell.certificate.as_json()
    assert check(m, machines, clearance) == []
    assert {order["place"].split(":")[-1] for order in clearance["orders"]} >= {"peg/pick", "cell"}
    kept = [pair for pair in clearance["excluded"] if {*pair["machines"]} != {"r1", "r3"}]
    assert len(kept) < len(clearance["excluded"])
    faults = check(m, machines, {**clearance, "excluded": kept})
    assert any("part/base" in fault and "r3/" in fault for fault in faults), faults


def test_a_manipulator_is_exported(run: Terminal, tmp_path: Path) -> None:
    for form in ("urdf", "dxf", "st"):
        assert run("export", PEG, "--format", form, "-o", tmp_path / form).status == 0
