"""The PAG language: accepted texts, their values, and the errors of all others."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from hypothesis import given

from factory.support.errors import Diagnostic, InputError
from factory.theory.lang import load_pag, load_templates, read_pag, write_pag
from factory.theory.problem.pag import PAG, Parameter
from tests.paths import TESTS
from tests.strategies import pags

HERE = TESTS
BROKEN = HERE / "broken"
TEMPLATES = load_templates([HERE.parent / "templates"])
PAPER = """6 parts; // the number of subassemblies
root = sub3; // the finished product
sub3 = mate ( sub2, part3 ); // how to make the subassemblies
sub2 = weld ( sub1 );
sub1 = mate ( part1, part2 );
part1 = atomic(); // these are the actual parts
part2 = atomic();
part3 = atomic()"""


def read(text: str, folder: str | Path = BROKEN) -> PAG:
    return read_pag(text, TEMPLATES, "test.pag", str(folder))


def errors(text: str) -> tuple[Diagnostic, ...]:
    with pytest.raises(InputError) as caught:
        read(text)
    return caught.value.diagnostics


def codes(text: str) -> list[str]:
    return [diagnostic.code for diagnostic in errors(text)]


def part(arguments: str) -> tuple[Parameter, ...]:
    """The parameters of a part with these arguments."""
    return read(f"root = p; p = atomic ( {arguments} )")["p"].parameters


def test_mate_takes_two_or_more_and_insert_two() -> None:
    parts = "; ".join(f"p{i} = atomic()" for i in range(8))
    inputs = ", ".join(f"p{i}" for i in range(8))
    assert len(read(f"root = a; a = mate ( {inputs} ); {parts}")["a"].inputs) == 8
    assert read("root = a; a = insert ( b, c ); b = atomic(); c = atomic()")
    assert codes(f"root = a; a = insert ( {inputs} ); {parts}") == ["WrongInputs"]


SCREWS = """unit = mm; root = all; all = mate ( plate, screw ); plate = atomic ( box = (6, 6, 4) );
screw[2] = atomic ( cylinder = (1.5, 10), quat = (2, 0, 0, 0), mass = 3 ) at ( 10, -7, 0.3 ),
  ( 1e1, 7, 7 )"""


@pytest.mark.parametrize(("unit", "one"), [("cm", 0.01)])
def test_a_mesh_is_in_the_unit(unit: str, one: float) -> None:
    mesh = 'root = p; p = atomic ( mesh = "bricks/3001.obj"{} )'
    bare = read(f"unit = {unit};{mesh.format('')}")["p"]
    assert bare.parameter("scale", 1.0) == one
    half = read(f"unit = {unit};{mesh.format(', scale = 0.5')}")["p"]
    assert half.parameter("scale") == pytest.approx(one / 2, rel=1e-15)


def test_a_label_may_still_be_called_unit() -> None:
    assert read("unit = cm; root = unit; unit = atomic ( sphere = 2 )")["unit"].parameter(
        "sphere"
    ) == pytest.approx(0.02)
    assert "unit = mm;" in errors("unit = Millimetres; root = a; a = atomic()")[0].hint
    assert codes("root = unit; unit = atomic; ") == ["UndefinedLabel", "BadValue"]
    assert codes("unit = mm; unit = cm; root = a; a = atomic()") == ["BadValue"]
    for text in ('unit = "mm";', "unit = 1 mm;", "unit mm;", "units = mm;", "unit =;"):
        (found,) = errors(f"{text} root = a; a = atomic()")
        assert found.code == "Syntax" and "unit = mm;" in found.hint, text


def test_colours_have_names() -> None:
    word = '"#ff0000"'
    assert part(f"rgba = {word}") == (Parameter("rgba", (1.0, 0.0, 0.0, 1.0)),)
    (found,) = errors("root = p; p = atomic ( rgba = stealblue )")
    assert found.code == "BadValue" and "'steelblue'" in found.hint


def test_copies_are_parts_of_their_own() -> None:
    pag = read(SCREWS)
    assert pag["all"].inputs == ("plate", "screw1", "screw2")
    assert [str(at) for at in pag["all"].input_positions[1:]] == ["test.pag:1:44"] * 2
    places = [
        next(p.position for p in pag[f"screw{n}"].parameters if p.name == "pos") for n in "12"
    ]
    assert [str(place) for place in places] == ["test.pag:2:78", "test.pag:3:3"]
    assert len(read("4 parts; root = a; a = mate ( b ); b[3] = atomic()")) == 4
    assert read("root = p; p = atomic() at ( 0, 0, 1 )") == read(
        "root = p; p = atomic ( pos = ( 0, 0, 1 ) )"
    )
    for inputs in ("b2, b1", "b[2], b[ 1 ]", "b2, b[1]"):
        pag = read(f"root = a; a = mate ( {inputs} ); b [ 2 ] = atomic()")
        assert pag["a"].inputs == ("b2", "b1")
    (found,) = errors("root = a; a = mate ( b, b[3] ); b[2] = atomic()")
    assert found.message == "'b3' is not defined"
    (found,) = errors("root = a; a = mate ( b, b ); b[2] = atomic()")
    assert "name it once" in found.hint


@given(pags(20, meshes=("bricks/3001.obj",)))
def test_read_after_write_is_the_identity(pag: PAG) -> None:
    text = write_pag(pag)
    again = read(text)
    assert again == pag
    assert write_pag(again) == text


def test_a_text_of_several_lines_cannot_be_written() -> None:
    pag = read('root = p; p = atomic ( mesh = "bricks/3001.obj" )')
    node = pag.nodes[0]
    with pytest.raises(ValueError, match="one line"):
        write_pag(PAG("p", (type(node)("p", "atomic", (), (Parameter("mesh", "a\nb"),)),)))


@pytest.mark.parametrize("path", sorted(BROKEN.glob("*.pag")), ids=lambda path: path.stem)
def test_broken_files(path: Path, golden: Callable[[str, str], None]) -> None:
    with pytest.raises(InputError) as caught:
        read_pag(path.read_bytes().decode(), TEMPLATES, path.name, str(BROKEN))
    for diagnostic in caught.value.diagnostics:
        assert diagnostic.position is not None
        assert diagnostic.position.line >= 1
        assert diagnostic.hint
        assert diagnostic.position.column <= len(diagnostic.position.text) + 1
    golden(f"broken/{path.name}.txt", f"{caught.value}\n")


def test_no_golden_file_is_left_over() -> None:
    kept = {path.name for path in (HERE / "golden" / "broken").glob("*.txt")}
    assert kept == {f"{path.name}.txt" for path in BROKEN.iterdir() if path.is_file()}


@pytest.mark.parametrize(
    "name", ["mesh", "scale", "pos", "quat", "density", "mass", "rgba", "box", "cylinder", "sphere"]
)
@pytest.mark.parametrize("bad", ["x", '"x"', "nan", "inf", "1e999", "( 1 )", "( 1, nan, 0.5, 1 )"])
def test_bad_geometry_is_found_at_the_value(name: str, bad: str) -> None:
    found = errors(f"root = p; p = atomic ( {name} = {bad} )")
    assert len(found) == 1
    assert found[0].code == ("BadMesh" if (name, bad) == ("mesh", '"x"') else "BadValue")
    start = len(f"root = p; p = atomic ( {name} = ") + 1
    assert found[0].position is not None
    assert start <= found[0].position.column < start + len(bad)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "product.pag").write_text(PAPER)
    assert load_pag(tmp_path / "product.pag", TEMPLATES) == read(PAPER)
    for name in ("produkt.pag", "product.pag/x", "", "a\0b", "x" * 5000):
        with pytest.raises(InputError) as caught:
            load_pag(str(tmp_path) + "/" + name, TEMPLATES)
        assert caught.value.diagnostics[0].code == "BadFile"
        assert caught.value.diagnostics[0].hint
    with pytest.raises(InputError, match=r"did you mean '.*product.pag'"):
        load_pag(tmp_path / "produkt.pag", TEMPLATES)


def test_templates_of_the_session(templates: Mapping[str, object]) -> None:
    assert dict(templates) == dict(TEMPLATES)


def test_a_part_has_one_rotation() -> None:
    (error,) = errors("root = p; p = atomic ( turn = ( 0, 0, 90 ), quat = ( 1, 0, 0, 0 ) )")
    assert error.code == "BadValue" and "one rotation" in error.message
    assert "keep one of turn, quat" in error.hint
    (error,) = errors("root = p; p = atomic ( rotation = ( 0, 0, 90 ) )")
    assert "did you mean 'turn'?" in error.hint
