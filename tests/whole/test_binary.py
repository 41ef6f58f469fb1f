"""The engine's model, kept beside the MJCF: it is what was compiled, to the bit, or is replaced."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benches.fidelity.products import layout
from factory.apps.exports import binary
from factory.apps.exports.binary import beside, kept, key_of, packed, seal_of, sealed
from factory.engine.mjcf import loading
from factory.engine.mjcf.model import Model
from factory.engine.simulation.modelling import physical_model
from tests.command_line import Terminal
from tests.paths import PAPER, files_in

KEY = "k"
CONTENT = bytes(range(256)) * 4


@pytest.fixture(scope="module")
def model() -> Model:
    """The paper's example, for three products."""
    return physical_model(layout("paper"), 3)


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[Model]:
    """The models that the engine compiles from now on."""
    seen: list[Model] = []
    real = loading.load

    def watched(model: Model) -> mujoco.MjModel:
        seen.append(model)
        return real(model)

    monkeypatch.setattr(loading, "load", watched)
    return seen


def write(files: dict[Path, bytes]) -> None:
    for path, content in files.items():
        path.write_bytes(content)


def flip(path: Path, at: int) -> None:
    """Change one byte of a file."""
    content = bytearray(path.read_bytes())
    content[at] ^= 1
    path.write_bytes(content)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("sealed")


@given(st.data(), st.binary(max_size=300))
def test_only_what_was_sealed_is_read(folder: Path, data: st.DataObject, content: bytes) -> None:
    path = folder / "m.mjb"
    files = sealed(path, KEY, content)
    write(files)
    assert kept(path, KEY) == content
    assert kept(path, KEY + "x") is None
    damaged = data.draw(st.sampled_from(sorted(files)).filter(lambda file: files[file]))
    at = data.draw(st.integers(0, len(files[damaged]) - 1))
    flip(damaged, at)
    assert kept(path, KEY) is None
    damaged.write_bytes(files[damaged][:at])
    assert kept(path, KEY) is None
    damaged.write_bytes(files[damaged] + b"\n")
    assert kept(path, KEY) is None


def test_half_of_a_pair_is_nothing(tmp_path: Path) -> None:
    path = tmp_path / "m.mjb"
    for missing in (path, seal_of(path)):
        write(sealed(path, KEY, CONTENT))
        missing.unlink()
        assert kept(path, KEY) is None


def test_the_key_tells_models_engines_and_machines_apart(
    model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    keys = [
        key_of(replace(model, xml=model.xml + " ")),
        key_of(replace(model, files={"a.stl": b"1"})),
        key_of(replace(model, files={"a.stl": b"2"})),
        key_of(replace(model, files={"b.stl": b"1"})),
        key_of(replace(model, files={"a.stl": b"", "b.stl": b"1"})),
    ]
    assert key_of(replace(model)) == key_of(model)
    monkeypatch.setattr(binary, "version", lambda name: "4.0.1")
    keys.append(key_of(model))
    monkeypatch.setattr(binary.platform, "machine", lambda: "another")
    keys.append(key_of(model))
    monkeypatch.undo()
    assert len({*keys, key_of(model)}) == len(keys) + 1


def built(run: Terminal, file: Path, *words: object) -> dict[str, object]:
    """What `build` says, but for the time it took."""
    document = run("build", PAPER, "--mjcf", file, *words, "--json").json
    assert document.pop("compile_s") > 0
    return document


def test_the_second_build_leaves_the_engine_alone(
    run: Terminal, compiled: list[Model], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    document = built(run, tmp_path / "m.xml")
    assert [Path(name).name for name in document["files"]] == ["m.xml", "m.mjb", "m.mjb.seal"]
    files = files_in(tmp_path)
    assert len(compiled) == 1
    monkeypatch.setattr(loading, "load", None)
    assert built(run, tmp_path / "m.xml") == document
    assert files_in(tmp_path) == files


def test_stock_mujoco_loads_the_binary(run: Terminal, tmp_path: Path) -> None:
    built(run, tmp_path / "m.xml")
    one = mujoco.MjModel.from_binary_path(str(tmp_path / "m.mjb"))
    other = mujoco.MjModel.from_xml_path(str(tmp_path / "m.xml"))
    assert packed(one) == packed(other)


def test_a_changed_product_or_setting_is_compiled_again(
    run: Terminal, compiled: list[Model], tmp_path: Path
) -> None:
    for number, words in enumerate([[], ["--units", 1], ["--acceleration", 1], []], 1):
        built(run, tmp_path / "m.xml", *words)
        assert len(compiled) == number


@pytest.mark.parametrize("name", ["m.mjb", "m.mjb.seal"])
def test_a_damaged_binary_is_mended(
    run: Terminal, compiled: list[Model], tmp_path: Path, name: str
) -> None:
    built(run, tmp_path / "m.xml")
    files = files_in(tmp_path)
    flip(tmp_path / name, len(files[name]) // 2)
    built(run, tmp_path / "m.xml")
    assert files_in(tmp_path) == files
    assert len(compiled) == 2


def test_no_binary_lies_beside_a_device_or_upon_the_mjcf(tmp_path: Path) -> None:
    assert beside(Path("/dev/null")) is None
    assert beside(tmp_path) is None
    assert beside(tmp_path / "m.xml") == tmp_path / "m.mjb"
    assert beside(tmp_path / "m.mjb") == tmp_path / "m.mjb.mjb"


def test_the_reading_of_pieces_warns_of_nothing(capfd, recwarn, monkeypatch) -> None:
    monkeypatch.setattr(loading, "MANY", 0)
    loading.load(physical_model(layout("gearbox"), 2))
    assert capfd.readouterr() == ("", "") and not list(recwarn)
