"""The engine's model, kept: what is read back is what was compiled, to the bit, or is not used."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import mujoco
import pytest
from hypothesis import given
from hypothesis import strategies as st

from factory.mjcf import binary, loading
from factory.mjcf.binary import beside, kept, key_of, packed, seal_of, sealed
from factory.mjcf.model import Model
from factory.record.log import LogWriter
from factory.simulation.request import RunRequest
from factory.simulation.simulation import Simulation, physical_model
from tests.command_line import PAPER, ROOT, Terminal, files_in
from tests.fidelity.products import layout

KEY = "k"
CONTENT = bytes(range(256)) * 4


@pytest.fixture(scope="module")
def model() -> Model:
    """The paper's example, for three products."""
    return physical_model(layout("paper"), 3)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache that takes models of any size."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(binary, "LEAST", 0)
    return tmp_path / "cache" / "klavins-factory" / "models"


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[Model]:
    """The models that the engine compiles from now on."""
    seen: list[Model] = []
    real = loading._compiled

    def watched(model: Model) -> mujoco.MjModel:
        seen.append(model)
        return real(model)

    monkeypatch.setattr(loading, "_compiled", watched)
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


def test_a_kept_model_is_the_compiled_one(cache: Path, compiled: list[Model], model: Model) -> None:
    first, second = loading.load(model), loading.load(model)
    assert compiled == [model]
    assert packed(first) == packed(second) == packed(loading._compiled(model))
    assert len(files_in(cache)) == 2


def test_small_models_are_not_kept(
    cache: Path, model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(binary, "LEAST", len(model.xml) + 1)
    loading.load(model)
    assert not cache.exists()


@pytest.mark.parametrize(
    "where", ["start", "header", "body", "end", "cut", "empty", "seal", "text"]
)
def test_a_damaged_model_is_compiled_again(
    cache: Path, compiled: list[Model], model: Model, where: str
) -> None:
    """The engine would end the process over some of these."""
    right = packed(loading.load(model))
    (path,) = cache.glob("*.mjb")
    size = len(right)
    places = {"start": 0, "header": 17, "body": size // 2, "end": size - 1}
    if where in places:
        flip(path, places[where])
    elif where == "seal":
        flip(seal_of(path), 10)
    else:
        path.write_bytes({"cut": right[:-1], "empty": b"", "text": b"<mujoco/>"}[where])
    assert packed(loading.load(model)) == right
    assert len(compiled) == 2
    assert path.read_bytes() == right
    assert packed(loading.load(model)) == right
    assert len(compiled) == 2


def test_another_version_of_the_engine_compiles_for_itself(
    cache: Path, compiled: list[Model], model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    loading.load(model)
    monkeypatch.setattr(binary, "version", lambda name: "4.0.1")
    loading.load(model)
    assert len(compiled) == 2


def test_what_the_engine_refuses_is_compiled_again(
    cache: Path, compiled: list[Model], model: Model
) -> None:
    """A right seal on something that is no model."""
    cache.mkdir(parents=True)
    write(sealed(cache / f"{key_of(model)}.mjb", key_of(model), b""))
    assert packed(loading.load(model)) == packed(loading._compiled(model))
    assert len(compiled) == 2


def test_a_cache_that_cannot_be_written_is_no_error(
    cache: Path, compiled: list[Model], model: Model
) -> None:
    cache.parent.parent.write_text("no folder")
    loading.load(model)
    loading.load(model)
    assert len(compiled) == 2


def test_the_cache_is_bounded(
    cache: Path, compiled: list[Model], model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was not used for longest goes first; what is too large on its own is not kept."""
    models = [replace(model, xml=f"{model.xml}{' ' * n}") for n in range(4)]
    size = len(packed(loading.load(models[0])))
    monkeypatch.setattr(binary, "MOST", 3 * size + size // 2)
    for n in (1, 2):
        loading.load(models[n])
    for path in cache.iterdir():
        long_ago = next(n for n in (0, 1, 2) if path.name.startswith(key_of(models[n])))
        os.utime(path, (long_ago, long_ago))
    for n in (0, 3):
        loading.load(models[n])
    names = {path.name for path in cache.glob("*.mjb")}
    assert names == {f"{key_of(models[n])}.mjb" for n in (0, 2, 3)}
    assert len(compiled) == 4
    monkeypatch.setattr(binary, "MOST", size - 1)
    loading.load(replace(model, xml=f"{model.xml}\n"))
    assert {path.name for path in cache.glob("*.mjb")} == names


def test_the_same_run_with_and_without_the_cache(
    cache: Path, compiled: list[Model], tmp_path: Path
) -> None:
    """Event by event and state by state: the logs are equal, byte by byte."""
    logs = []
    for number in range(2):
        made = Simulation(layout("paper"), RunRequest(units=2, seed=3, jitter=0.2))
        with LogWriter(tmp_path / f"{number}.log", made, command=["factory"]) as log:
            run = made.run([log.observe])
        logs.append((run.events, (tmp_path / f"{number}.log").read_bytes()))
    assert len(compiled) == 1
    assert logs[0] == logs[1]


KEEP = """
import sys
from factory.mjcf import binary
from factory.simulation.simulation import physical_model
from factory.mjcf.loading import load
from tests.fidelity.products import layout
binary.LEAST = 0
model = physical_model(layout("paper"), 3)
for _ in range(20):
    binary.keep(model, load(model))
"""


def test_processes_share_the_cache(cache: Path, compiled: list[Model], model: Model) -> None:
    """Four at once: whatever one finds is right, and what is left is."""
    words = [sys.executable, "-c", KEEP]
    others = [subprocess.Popen(words, cwd=ROOT) for _ in range(4)]
    assert [process.wait(120) for process in others] == [0] * 4
    assert sorted(files_in(cache)) == [f"{key_of(model)}.mjb", f"{key_of(model)}.mjb.seal"]
    loading.load(model)
    assert compiled == []


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
