"""A build is left out if and only if nothing has changed since the one before."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from factory.support.extensions import extensions
from factory.support.files import user_cache
from tests.command_line import Terminal
from tests.paths import PAPER, ROOT, files_in
from tests.plug_in import write_package

MESHED = """root = a;
a = mate(b, c);
b = atomic(mesh = "wing.stl", pos = (0, 0, 0.05));
c = atomic(box = (0.1, 0.1, 0.05), pos = (0, 0, 0.2))
"""


def lines(run: Terminal, *words: object) -> str:
    done = run("build", *words)
    assert done.status == 0, done.err
    return done.out


def again(text: str) -> bool:
    return "up to date" in text


@pytest.fixture
def product(tmp_path: Path) -> Path:
    """A product with a mesh of its own."""
    import trimesh

    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "wing.stl")
    (tmp_path / "p.pag").write_text(MESHED)
    return tmp_path / "p.pag"


def test_the_second_build_says_the_same_and_writes_nothing(run: Terminal, out: Path) -> None:
    first = run("build", PAPER, "-o", out / "x", "--json").json
    times = {path: path.stat().st_mtime_ns for path in (out / "x").rglob("*")}
    written = files_in(out)
    second = run("build", PAPER, "-o", out / "x", "--json").json
    assert {**first, "compile_s": 0} == {**second, "compile_s": 0}
    assert files_in(out) == written
    assert times == {path: path.stat().st_mtime_ns for path in (out / "x").rglob("*")}
    assert again(lines(run, PAPER, "-o", out / "x"))


@pytest.mark.parametrize("what", ["changed", "cut short", "gone"])
def test_a_file_that_is_not_as_it_was_is_built_again(run: Terminal, out: Path, what: str) -> None:
    mjcf = out / "m.xml"
    lines(run, PAPER, "--mjcf", mjcf)
    content = mjcf.read_bytes()
    if what == "gone":
        mjcf.unlink()
    else:
        mjcf.write_bytes(content[:-1] if what == "cut short" else content + b" ")
    assert not again(lines(run, PAPER, "--mjcf", mjcf))
    assert mjcf.read_bytes() == content
    assert again(lines(run, PAPER, "--mjcf", mjcf))


def test_another_factory_toml_is_another_build(run: Terminal, product: Path) -> None:
    """Whatever it says: branches, lines, arms."""
    mjcf = product.parent / "m.xml"
    lines(run, product, "--mjcf", mjcf)
    (product.parent / "factory.toml").write_text("[parallel]\nb = 2\n")
    assert not again(lines(run, product, "--mjcf", mjcf))
    (product.parent / "factory.toml").unlink()
    assert not again(lines(run, product, "--mjcf", mjcf))


def test_other_settings_are_another_build(run: Terminal, out: Path) -> None:
    lines(run, PAPER, "-o", out / "x")
    for words in (["--floor", "9x9"], ["--units", "2"], ["--wip", "1"], ["--force", "4"]):
        assert not again(lines(run, PAPER, "-o", out / "x", *words)), words
    assert not again(lines(run, PAPER, "-o", out / "x")), "the last one wrote other files"


def test_a_product_that_changed_is_built(run: Terminal, out: Path, product: Path) -> None:
    import trimesh

    lines(run, product, "-o", out / "x")
    assert again(lines(run, product, "-o", out / "x"))
    trimesh.creation.box((0.1, 0.1, 0.12)).export(product.with_name("wing.stl"))
    assert not again(lines(run, product, "-o", out / "x"))
    product.write_text(MESHED.replace("0.2)", "0.3)"))
    assert not again(lines(run, product, "-o", out / "x"))
    assert again(lines(run, product, "-o", out / "x"))


def test_a_template_that_changed_or_came_is_seen(run: Terminal, out: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    words = (PAPER, "-o", out / "x", "--templates", mine)
    lines(run, *words)
    assert again(lines(run, *words))
    text = (ROOT / "templates" / "weld.op").read_text()
    (mine / "weld.op").write_text(text)
    assert not again(lines(run, *words))
    (mine / "weld.op").write_text(text + "\n")
    assert not again(lines(run, *words))


@pytest.mark.parametrize("content", [b"", b"{}"])
def test_a_damaged_receipt_costs_a_build(
    run: Terminal, out: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: bytes
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    lines(run, PAPER, "-o", out / "x")
    (receipt,) = (user_cache() / "builds").iterdir()
    receipt.write_bytes(content)
    assert not again(lines(run, PAPER, "-o", out / "x"))
    assert again(lines(run, PAPER, "-o", out / "x"))


def test_warnings_are_given_again(run: Terminal, out: Path, tmp_path: Path) -> None:
    text = "root = a; a = mate(b, c); b = atomic(box = (6, 1, 1)); c = atomic()"
    (tmp_path / "p.pag").write_text(text.replace(";", ";\n"))
    first, second = (run("build", tmp_path / "p.pag", "-o", out / "x") for _ in range(2))
    assert again(second.out)
    assert first.err == second.err
    assert "warning" in first.err


def test_names_count_from_where_they_are_given(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In another folder the same arguments name other files and templates."""
    (tmp_path / "p.pag").write_bytes(PAPER.read_bytes())
    weld = (ROOT / "templates" / "weld.op").read_text()
    cycles = []
    for name, dwell in (("one", "1"), ("other", "9")):
        (tmp_path / name / "ops").mkdir(parents=True)
        text, count = re.subn(r"dwell = [0-9.]+", f"dwell = {dwell}", weld)
        assert count == 1
        (tmp_path / name / "ops" / "weld.op").write_text(text)
        monkeypatch.chdir(tmp_path / name)
        for words in (["-o", "out"], ["--templates", "ops", "-o", tmp_path / "same"]):
            assert not again(lines(run, "../p.pag", *words))
            assert again(lines(run, "../p.pag", *words))
        assert {"p.xml", "p.mjb", "p.svg"} <= files_in(tmp_path / name / "out").keys()
        done = run("build", "../p.pag", "--templates", "ops", "-o", tmp_path / "same", "--json")
        cycles.append(done.json["layout"]["predicted_cycle_time_s"])
    assert cycles[1] > cycles[0] + 7


def test_a_link_that_leads_elsewhere_is_another_product(run: Terminal, out: Path) -> None:
    for name, file in (("a", "paper"), ("b", "lamp")):
        (out / f"{name}.pag").write_bytes((ROOT / "examples" / f"{file}.pag").read_bytes())
    link = out / "link.pag"
    for name in ("a", "b"):
        link.unlink(missing_ok=True)
        link.symlink_to(out / f"{name}.pag")
        assert not again(lines(run, link, "-o", out / "x"))
        assert again(lines(run, link, "-o", out / "x"))
    link.with_name("c.pag").symlink_to(out / "b.pag")
    assert not again(lines(run, out / "c.pag", "-o", out / "x"))
    assert (out / "x" / "c.xml").exists()


def test_a_name_that_is_no_text_has_a_receipt(run: Terminal, out: Path) -> None:
    file = out / "n\udcff.pag"
    file.write_bytes(PAPER.read_bytes())
    times = []
    for _ in range(2):
        assert run("build", file, "-o", out / "x", "--json").status == 0
        times.append([path.stat().st_mtime_ns for path in sorted((out / "x").iterdir())])
    assert times[0] == times[1]


def test_a_package_that_changed_is_built_with(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    """One that is installed: its operation, its law, its robot type."""
    write_package(tmp_path, installed=True, name="gluing2")
    monkeypatch.syspath_prepend(tmp_path)
    request.addfinalizer(extensions.cache_clear)
    assert not again(lines(run, PAPER, "-o", tmp_path / "x"))
    for name in ("dab.op", "laws.py", "dabber.xml", "catalogue.toml"):
        assert again(lines(run, PAPER, "-o", tmp_path / "x"))
        (file,) = (tmp_path / "gluing2").rglob(name)
        file.write_text(file.read_text() + "\n")
        assert not again(lines(run, PAPER, "-o", tmp_path / "x")), name
