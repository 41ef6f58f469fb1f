"""The language of templates: accepted texts, their values, and the errors of all others."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.support.errors import Diagnostic, InputError
from factory.theory.lang import load_templates, read_template, write_template
from factory.theory.problem.template import LOST, Failure, Law, Point, Response, Template
from tests.pag_texts import MATE, read_or_refused
from tests.paths import TESTS
from tests.strategies import mutations
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


# What is accepted


def test_the_papers_template_is_read_as_it_stands() -> None:
    a1, a2, b3 = Point("A", 1), Point("A", 2), Point("B", 3)
    assert read_template(MATE) == Template(
        name="mate",
        robots=("dot", "dot", "dot"),
        carrier=3,
        identifications=((a1, a2, b3),),
        before=("LAB1", "LAB2", "nopart"),
        after=("nopart", "nopart", "LAB3"),
        law=Law("navigation", (Point("A", 1, 2.0), Point("A", 2, 2.0), b3)),
        further="insert",
    )


@pytest.mark.parametrize(
    "text",
    [
        MATE.replace("\n", " "),
        "\ufeff" + MATE.replace("\n", "\r\n"),
        MATE.replace(" ", "").replace("where", "where ").replace("onWto", " on W to "),
        MATE.replace("A1 + 2r", "A1+2 r").replace("A2 + 2r", "A2 +\n2.0r"),
        MATE.rstrip().rstrip(";") + " // the end",
        "// the beginning\n"
        + MATE.replace("j = 3;", "; // the carrier\n").replace("further", "j = 3; further"),
    ],
)
def test_layout_does_not_matter(text: str) -> None:
    text = text.replace(")within eps", ") within eps").replace(")withineps", ") within eps")
    assert read_template(text) == read_template(MATE)


def test_everything_knows_where_it_came_from() -> None:
    template = read_template(MATE, "mate.op")
    assert str(template.position) == "mate.op:1:1"
    assert str(template.further_position) == "mate.op:7:13"
    assert [str(goal.position) for goal in template.law.goals] == [
        "mate.op:6:28",
        "mate.op:6:37",
        "mate.op:6:46",
    ]


@pytest.mark.parametrize(
    ("written", "point"),
    [
        ("A1", Point("A", 1)),
        ("B1 - r", Point("B", 1, -1.0)),
        ("S1+0.5r", Point("S", 1, 0.5)),
        ("A1 - .5r", Point("A", 1, -0.5)),
        ("A1 + 1e-3r", Point("A", 1, 1e-3)),
        ("A1 + 0r", Point("A", 1)),
    ],
)
def test_points(written: str, point: Point) -> None:
    text = """x = (R, j, ~, <a; b>, F) where R = <dot>; j = 1; ~ = {};
        <a; b> = <nopart; LAB1>; F = hold on W to %s within 0.001 for 2"""
    law = read_template(text % written).law
    assert law == Law("hold", (point,), 0.001, 2.0)
    assert read_template(text % f"( {written} )").law == law


def test_parameters() -> None:
    text = MATE.replace(
        "further = insert",
        'parameters = ( dwell = 1.5, tool = "drill", at = ( 1, 2 ) )',
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


def test_words_of_the_grammar_may_be_names() -> None:
    text = MATE.replace("dot, dot, dot", "R, W, further").replace("mate =", "geometry =")
    assert read_template(text).robots == ("R", "W", "further")


# Failures


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


def test_a_template_that_says_nothing_scraps_what_is_lost() -> None:
    silent, said = read_template(MATE), read_template(MATE + "failure = { lost : scrap };")
    assert silent == said
    assert silent.failures == LOST
    assert "failure" not in write_template(silent)
    none = read_template(MATE + "failure = {};")
    assert none.failures == ()
    assert "failure = {};" in write_template(none)


# The writer


@given(random_templates())
def test_read_after_write_is_the_identity(template: Template) -> None:
    text = write_template(template)
    again = read_template(text)
    assert again == template
    assert write_template(again) == text


# The shipped templates


def test_what_is_shipped() -> None:
    assert list(TEMPLATES) == [
        "atomic",
        "dropoff",
        "glue",
        "insert",
        "inspect",
        "mate",
        "pick",
        "place",
        "press",
        "relay",
        "screw",
        "weld",
    ]
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


def test_tools_bring_and_take_nothing() -> None:
    for name in ("weld", "inspect", "press", "glue"):
        assert TEMPLATES[name].tools() == (1,)
        assert TEMPLATES[name].law.dwell == "dwell"
    assert TEMPLATES["screw"].tools() == (2,)


# Folders


def put(folder: Path, name: str, text: str) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(text, encoding="utf-8")
    return folder


def test_the_first_folder_wins_by_name(tmp_path: Path) -> None:
    mine = put(tmp_path / "mine", "zz.op", MATE.replace("j = 3", "j = 3").replace("eps", "0.5"))
    put(mine, "drill.op", (SHIPPED / "weld.op").read_text().replace("weld =", "drill ="))
    put(mine, "notes.txt", "no template")
    found = load_templates([mine, str(SHIPPED)])
    assert found["mate"].law.eps == 0.5
    assert list(found)[:2] == ["drill", "mate"]
    assert set(found) == {*TEMPLATES, "drill"}


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


# What is refused


@pytest.mark.parametrize("path", sorted(BROKEN.glob("*.op")), ids=lambda path: path.stem)
def test_broken_files(path: Path, golden: Callable[[str, str], None]) -> None:
    with pytest.raises(InputError) as caught:
        read_template(path.read_bytes().decode(), path.name)
    for diagnostic in caught.value.diagnostics:
        assert diagnostic.position is not None
        assert diagnostic.hint
    golden(f"broken/{path.name}.txt", f"{caught.value}\n")


def test_dropoff_alone_may_leave_nothing() -> None:
    text = (SHIPPED / "dropoff.op").read_text()
    assert read_template(text).result == "nopart"
    assert codes(text.replace("dropoff =", "lose =")) == ["GearNotClosed"]


# No text whatever gives anything but an InputError


def survives(text: str) -> None:
    read_or_refused(read_template, text)


@given(st.text())
def test_any_text(text: str) -> None:
    survives(text)


WORDS = 'R j ~ < a ; b > F where = ( ) { } , "x" " // \n A1 + 2r on W to within for and eps LAB1 3'
WORDS += " failure : lost > again then scrap"


@given(st.lists(st.sampled_from(WORDS.split(" "))))
def test_any_words(words: list[str]) -> None:
    survives(" ".join(words))


@settings(max_examples=300)
@given(
    mutations(
        MATE
        + 'parameters = ( dwell = 1.0, x = "y", v = ( 1, 2 ) ); failure = { jammed : again 2 };'
    )
)
def test_any_damage(text: str) -> None:
    survives(text)
