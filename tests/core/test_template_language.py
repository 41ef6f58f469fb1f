"""The language of templates: accepted texts, their values, and the errors of all others."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given

from factory.support.errors import Diagnostic, InputError
from factory.theory.lang import load_templates, read_template, write_template
from factory.theory.problem.template import Failure, Law, Point, Response, Template
from tests.pag_texts import MATE
from tests.paths import TESTS
from tests.strategies import templates as random_templates

HERE = TESTS
BROKEN = HERE / "broken"
SHIPPED = HERE.parent / "templates"
TEMPLATES = load_templates([SHIPPED])


def errors(text: str) -> tuple[Diagnostic, ...]:
    with pytest.raises(InputError) as caught:
        read_template(text, "test.op")
    return caught.value.diagnostics


def codes(text: str) -> list[str]:
    return [diagnostic.code for diagnostic in errors(text)]


@pytest.mark.parametrize(
    "text",
    [
        "// the beginning\n"
        + MATE.replace("j = 3;", "; // the carrier\n").replace("further", "j = 3; further")
    ],
)
def test_layout_does_not_matter(text: str) -> None:
    text = text.replace(")within eps", ") within eps").replace(")withineps", ") within eps")
    assert read_template(text) == read_template(MATE)


@pytest.mark.parametrize(("written", "point"), [("B1 - r", Point("B", 1, -1.0))])
def test_points(written: str, point: Point) -> None:
    text = """x = (R, j, ~, <a; b>, F) where R = <dot>; j = 1; ~ = {};
        <a; b> = <nopart; LAB1>; F = hold on W to %s within 0.001 for 2"""
    law = read_template(text % written).law
    assert law == Law("hold", (point,), 0.001, 2.0)
    assert read_template(text % f"( {written} )").law == law


def test_parameters() -> None:
    text = MATE.replace(
        "further = insert", 'parameters = ( dwell = 1.5, tool = "drill", at = ( 1, 2 ) )'
    ).replace("within eps", "within eps for dwell")
    template = read_template(text)
    assert template.parameters == (("dwell", 1.5), ("tool", "drill"), ("at", (1.0, 2.0)))
    assert template.law.dwell == "dwell"


def test_geometry() -> None:
    assert TEMPLATES["atomic"].geometry
    text = (SHIPPED / "atomic.op").read_text()
    both = read_template(text.replace("= geometry", "= geometry and ( age = 1 )"))
    assert (both.geometry, both.parameters) == (True, (("age", 1.0),))
    assert codes(text.replace("= geometry", "= geometry and ( mass = 1 )")) == ["BadTemplate"]


def test_failures() -> None:
    text = (
        MATE + "failure = { residual > 5e-4 : again 2 then scrap, lost : stop, jammed : again 3 };"
    )
    template = read_template(text, "mate.op")
    assert template.failures == (
        Failure("residual", 5e-4, (Response("again", 2), Response("scrap"))),
        Failure("lost", None, (Response("stop"),)),
        Failure("jammed", None, (Response("again", 3), Response("stop"))),
    )
    assert [failure.last for failure in template.failures] == ["scrap", "stop", "stop"]
    assert str(template.failures[0].position) == "mate.op:8:13"
    assert template.failure("jammed") == template.failures[2]
    assert template.failure("rejected") is None


@given(random_templates())
def test_read_after_write_is_the_identity(template: Template) -> None:
    text = write_template(template)
    again = read_template(text)
    assert again == template
    assert write_template(again) == text


def test_what_is_shipped() -> None:
    names = "atomic dropoff glue insert inspect mate pick place press relay screw weld"
    assert " ".join(TEMPLATES) == names
    assert TEMPLATES["dropoff"].result == "nopart"
    assert TEMPLATES["mate"].further == TEMPLATES["mate"].instead == "insert"
    assert (TEMPLATES["place"].further, TEMPLATES["place"].brought) == ("place", "pick")
    assert TEMPLATES["insert"].inputs == ("LAB1", "LAB2")
    dwells = {name: dict(t.parameters)["dwell"] for name, t in TEMPLATES.items() if t.parameters}
    assert dwells == {"glue": 2.0, "inspect": 0.5, "press": 1.5, "screw": 1.0, "weld": 1.0}


@pytest.mark.parametrize("path", sorted(SHIPPED.glob("*.op")), ids=lambda path: path.stem)
def test_shipped_files_say_what_they_are(path: Path) -> None:
    lines = path.read_text(encoding="utf-8").split("\n")
    comment = [line for line in lines if line.startswith("//")]
    assert 2 <= len(comment) <= 5
    assert comment[0].startswith(f"// {path.stem}: ")
    assert read_template(path.read_text(encoding="utf-8")).name == path.stem


def put(folder: Path, name: str, text: str) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(text, encoding="utf-8")
    return folder


def test_the_mapping_is_read_only() -> None:
    with pytest.raises(TypeError):
        TEMPLATES["mate"] = TEMPLATES["weld"]  # type: ignore[index]


def test_all_errors_of_all_files_come_at_once(tmp_path: Path) -> None:
    put(tmp_path, "a.op", MATE.replace("j = 3", "j = 4"))
    put(tmp_path, "b.op", MATE.replace("j = 3;", ""))
    (tmp_path / "c.op").write_bytes(b"\xff")
    (tmp_path / "d.op").mkdir()
    with pytest.raises(InputError) as caught:
        load_templates([tmp_path, tmp_path / "none", SHIPPED])
    found = [(d.code, Path(d.position.file).name) for d in caught.value.diagnostics if d.position]
    assert found == [
        ("BadTemplate", "a.op"),
        ("Syntax", "b.op"),
        ("Syntax", "c.op"),
        ("BadFile", "d.op"),
        ("BadFile", "none"),
    ]
    assert all(d.hint for d in caught.value.diagnostics)


@pytest.mark.parametrize("path", sorted(BROKEN.glob("*.op")), ids=lambda path: path.stem)
def test_broken_files(path: Path, golden: Callable[[str, str], None]) -> None:
    with pytest.raises(InputError) as caught:
        read_template(path.read_bytes().decode(), path.name)
    for diagnostic in caught.value.diagnostics:
        assert diagnostic.position is not None
        assert diagnostic.hint
    golden(f"broken/{path.name}.txt", f"{caught.value}\n")


WORDS = 'R j ~ < a ; b > F where = ( ) { } , "x" " // \n A1 + 2r on W to within for and eps LAB1 3'
WORDS += " failure : lost > again then scrap"
