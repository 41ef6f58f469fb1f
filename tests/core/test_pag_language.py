"""The PAG language: accepted texts, their values, and the errors of all others."""

from __future__ import annotations

import math
import re
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.support.errors import Diagnostic, InputError
from factory.theory.lang import load_pag, load_templates, read_pag, write_pag
from factory.theory.lang import pag_syntax as syntax
from factory.theory.lang.recovery import Stuck, drive
from factory.theory.problem.pag import PAG, Assembly, Parameter
from tests.pag_texts import read_or_refused
from tests.paths import TESTS
from tests.strategies import mutations, pags, random_pag_text
from tests.work import counted

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


# What is accepted


def test_the_papers_example_is_read_as_it_stands() -> None:
    pag = read(PAPER)
    assert (pag.root, pag.count, len(pag)) == ("sub3", 6, 6)
    assert [node.label for node in pag.nodes] == ["sub3", "sub2", "sub1", "part1", "part2", "part3"]
    assert pag["sub3"].inputs == ("sub2", "part3")
    assert [node.label for node in pag.parts()] == ["part1", "part2", "part3"]


def test_everything_knows_where_it_came_from() -> None:
    node = read(PAPER)["sub3"]
    assert str(node.position) == "test.pag:3:1"
    assert [at.column for at in node.input_positions] == [15, 21]
    assert node.position is not None
    assert node.position.text.startswith("sub3 = mate ( sub2, part3 ); // how")
    (pos, mass) = part("pos = ( 0, 0, 1 ), mass = 2")
    assert (pos.position.column, mass.position.column) == (30, 50)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    "text",
    [
        "\ufeff" + PAPER,
        PAPER.replace("\n", "\r\n"),
        "\ufeff" + PAPER.replace("\n", "\r"),
        PAPER + ";",
        PAPER + " // the end",
        ";;" + PAPER + ";\n;",
        "\n".join(reversed(PAPER.replace("atomic()", "atomic();").replace(";;", ";").split("\n"))),
        PAPER.replace(" ", "").replace("6parts", "6 parts"),
        re.sub(" +", "\t \n", re.sub("//.*", "", PAPER)),
        PAPER.replace(" ", "\u00a0"),
    ],
)
def test_layout_does_not_matter(text: str) -> None:
    assert {node.label: node for node in read(text).nodes} == read(PAPER).by_label


def test_a_text_may_be_one_line() -> None:
    text = "root = a; a = mate ( b, c ); b = atomic(); c = atomic(); 3 parts"
    assert read(text).count == 3
    assert read(text.replace("; 3 parts", "")).count is None


@pytest.mark.parametrize(
    "label",
    ["1", "3001", "1.5", "-", "1e5", "über", "零件", "भाग", "e\u0301", "Root", "part", "a.b-c_d"],
)
def test_labels(label: str) -> None:
    pag = read(f"root = {label}; {label} = mate ( 2, x ); 2 = atomic(); x = atomic()")
    assert pag.root == label


def test_zeros_before_the_number_of_parts_do_not_matter() -> None:
    assert read(f"{'0' * 5000}1 parts; root = a; a = atomic()").count == 1


def test_labels_that_look_like_keywords_of_templates() -> None:
    assert read("root = R; R = mate ( where, within ); where = atomic(); within = atomic()")


@pytest.mark.parametrize(
    ("written", "value"),
    [
        ("1", 1.0),
        ("+1.5", 1.5),
        (".5", 0.5),
        ("5.", 5.0),
        ("1e-3", 1e-3),
        ("1.5E+3", 1500.0),
        ("007", 7.0),
    ],
)
def test_numbers(written: str, value: float) -> None:
    assert part(f"mass = {written}") == (Parameter("mass", value),)


def test_vectors_on_one_line_and_on_several() -> None:
    wanted = (Parameter("pos", (1.0, -2.0, 0.5)),)
    assert part("pos = (1,-2,.5)") == part("pos = ( 1 ,\n -2, // y\n .5 )") == wanted
    assert part("pos=(\t1 , -2,.5 )") == wanted


def test_numbers_stay_as_they_are_written() -> None:
    assert part("quat = ( 2, 0, 0, 0 )") == (Parameter("quat", (2.0, 0.0, 0.0, 0.0)),)
    half = 0.707106781
    assert part("turn = ( 0, 0, -90 )") == (Parameter("quat", (half, 0.0, 0.0, -half)),)
    assert part("turn = ( 90, 0, 90 )") == (Parameter("quat", (0.5, 0.5, 0.5, 0.5)),)


def test_meshes_lie_beside_the_file() -> None:
    assert part('mesh = "bricks/3001.obj", scale = 0.5')
    assert part(f'mesh = "{BROKEN}/bricks/../bricks/3001.obj"')
    assert codes('root = p; p = atomic ( mesh = "3001.obj" )') == ["BadMesh"]


def test_a_quote_in_a_text_is_doubled(tmp_path: Path) -> None:
    (tmp_path / 'a "b" \\ c.OBJ').touch()
    pag = read('root = p; p = atomic ( mesh = "a ""b"" \\ c.OBJ" )', tmp_path)
    assert pag["p"].parameter("mesh") == 'a "b" \\ c.OBJ'
    assert read(write_pag(pag), tmp_path) == pag


def test_mate_takes_two_or_more_and_insert_two() -> None:
    parts = "; ".join(f"p{i} = atomic()" for i in range(8))
    inputs = ", ".join(f"p{i}" for i in range(8))
    assert len(read(f"root = a; a = mate ( {inputs} ); {parts}")["a"].inputs) == 8
    assert read("root = a; a = insert ( b, c ); b = atomic(); c = atomic()")
    assert codes(f"root = a; a = insert ( {inputs} ); {parts}") == ["WrongInputs"]


# Units, colours, copies

SCREWS = """unit = mm; root = all; all = mate ( plate, screw ); plate = atomic ( box = (6, 6, 4) );
screw[2] = atomic ( cylinder = (1.5, 10), quat = (2, 0, 0, 0), mass = 3 ) at ( 10, -7, 0.3 ),
  ( 1e1, 7, 7 )"""


def test_lengths_are_in_the_unit_and_as_exact_as_in_metres() -> None:
    metres = """root = all; all = mate ( plate, screw1, screw2 );
    plate = atomic ( box = (0.006, 0.006, 0.004) );
    screw1 = atomic ( cylinder = (0.0015, 0.01), quat = (2, 0, 0, 0), mass = 3,
      pos = (0.01, -0.007, 0.0003) );
    screw2 = atomic ( cylinder = (0.0015, 0.01), quat = (2, 0, 0, 0), mass = 3,
      pos = (0.01, 0.007, 0.007) )"""
    assert read(SCREWS) == read(metres) == read(write_pag(read(SCREWS)))
    first, rest = SCREWS.split(";", 1)
    assert read(f"{rest}; {first}") == read(SCREWS)
    assert read(SCREWS.replace("mm", "m")) != read(SCREWS)


@pytest.mark.parametrize(("unit", "one"), [("m", 1), ("cm", 0.01), ("mm", 0.001), ("in", 0.0254)])
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


@pytest.mark.parametrize("word", ["red", "RED", '"red"', '"#ff0000"', "( 1, 0, 0, 1 )"])
def test_colours_have_names(word: str) -> None:
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


# The writer


def test_the_canonical_text_of_the_papers_example() -> None:
    without = [line.split(" //")[0].rstrip(";") + ";" for line in PAPER.split("\n")]
    assert write_pag(read(PAPER)) == "\n".join(without) + "\n"


@given(pags(20, meshes=("bricks/3001.obj",)))
def test_read_after_write_is_the_identity(pag: PAG) -> None:
    text = write_pag(pag)
    again = read(text)
    assert again == pag
    assert write_pag(again) == text


@given(st.integers(1, 200), st.integers(0, 10))
def test_random_texts_are_right(labels: int, seed: int) -> None:
    assert len(read(random_pag_text(labels, seed))) == labels


def test_a_text_of_several_lines_cannot_be_written() -> None:
    pag = read('root = p; p = atomic ( mesh = "bricks/3001.obj" )')
    node = pag.nodes[0]
    with pytest.raises(ValueError, match="one line"):
        write_pag(PAG("p", (type(node)("p", "atomic", (), (Parameter("mesh", "a\nb"),)),)))


# What is refused: the corpus


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
    "name",
    ["mesh", "scale", "pos", "quat", "density", "mass", "rgba", "box", "cylinder", "sphere"],
)
@pytest.mark.parametrize("bad", ["x", '"x"', "nan", "inf", "1e999", "( 1 )", "( 1, nan, 0.5, 1 )"])
def test_bad_geometry_is_found_at_the_value(name: str, bad: str) -> None:
    found = errors(f"root = p; p = atomic ( {name} = {bad} )")
    assert len(found) == 1
    assert found[0].code == ("BadMesh" if (name, bad) == ("mesh", '"x"') else "BadValue")
    start = len(f"root = p; p = atomic ( {name} = ") + 1
    assert found[0].position is not None
    assert start <= found[0].position.column < start + len(bad)


@pytest.mark.parametrize("name", ["scale", "density", "mass", "sphere"])
@pytest.mark.parametrize("bad", ["0", "-1", "-0.0", "1e-999"])
def test_what_has_to_be_positive(name: str, bad: str) -> None:
    assert codes(f"root = p; p = atomic ( {name} = {bad} )") == ["BadValue"]


def test_a_tool_dwells_for_no_negative_time() -> None:
    assert read("root = a; a = weld ( b, dwell = 0 ); b = atomic()")
    assert codes("root = a; a = weld ( b, dwell = -1 ); b = atomic()") == ["BadValue"]


# What is refused: files


@pytest.mark.parametrize(
    ("name", "data", "code", "place"),
    [
        ("latin.pag", b"root = a;\na = \xe4;", "Syntax", "2:5"),
        ("utf16.pag", "root = a; a = atomic()".encode("utf-16"), "Syntax", "1:1"),
        ("mark.pag", "\ufeffroot = ä".encode()[:-1], "Syntax", "1:8"),
        ("binary.pag", bytes(range(256)), "Syntax", "3:115"),
    ],
)
def test_files_that_are_no_text(
    tmp_path: Path, name: str, data: bytes, code: str, place: str
) -> None:
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError) as caught:
        load_pag(tmp_path / name, TEMPLATES)
    (found,) = caught.value.diagnostics
    assert found.code == code
    assert str(found.position) == f"{tmp_path / name}:{place}"
    assert "UTF" in found.hint
    assert bool(found.position.text) == (name in ("latin.pag", "mark.pag")), "binary is not shown"


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


def test_load_pag_knows_its_folder() -> None:
    pag = load_pag(BROKEN / ".." / "broken" / "../../examples/../tests/right.pag", TEMPLATES)
    assert Path(pag.folder).resolve() == HERE
    assert pag.file.endswith("right.pag")


# No text whatever gives anything but an InputError


def survives(text: str) -> None:
    read_or_refused(read, text)


@given(st.text())
def test_any_text(text: str) -> None:
    survives(text)


WORDS = 'a b root parts 1 -1 = ( ) , ; "x" " // \n + & mate atomic [2] at unit mm'


@given(st.lists(st.sampled_from(WORDS.split(" "))))
def test_any_words(words: list[str]) -> None:
    survives(" ".join(words))


@settings(max_examples=300)
@given(mutations(PAPER + '; part4 = atomic ( mesh = "x.obj", pos = ( 0, 1, 2 ), mass = 1 )'))
def test_any_damage(text: str) -> None:
    survives(text)


def test_every_way_to_get_stuck_has_its_own_words() -> None:
    signs = ["w", "=", "(", ")", ",", ";", '"s"', "[2]", None]
    queue = deque([""])
    while queue:
        lawful = queue.popleft()
        for sign in signs:
            text = lawful if sign is None else f"{lawful} {sign}".strip()
            tokens = syntax._lex(text)
            stuck = drive(syntax._lark(), "statement", tokens)
            if isinstance(stuck, Stuck) and (sign is None or stuck.index < len(tokens)):
                known = (stuck.state, stuck.token.type) in syntax._lessons()
                outside = text.endswith(";") and text.count("(") <= text.count(")")
                assert known or not text or outside, text
            elif sign is not None and len(tokens) < 13:
                queue.append(text)


# Size


def test_a_chain_takes_linear_work_and_no_recursion() -> None:
    work = []
    for size in (1_000, 4_000, 30_000):
        links = [f"a{i} = weld ( a{i + 1} );" for i in range(size)]
        text = "root = a0;" + " ".join(links) + f"a{size} = atomic()"
        calls, pag = counted(read, text) if size < 30_000 else (0, read(text))
        work.append(calls)
        assert len(pag) == sum(1 for _ in pag.postorder()) == size + 1
    assert work[1] < 5 * work[0]


def test_a_long_line_is_shared_by_its_positions() -> None:
    pag = read(random_pag_text(1000, 0).replace("\n", " "))
    assert len({id(node.position.text) for node in pag.nodes if node.position}) == 1


@pytest.mark.parametrize("damage", ["= mate ( sub", "mate (", ";", "= mate"])
def test_many_errors_take_linear_work(damage: str) -> None:
    work = []
    for size in (1_000, 4_000):
        text = random_pag_text(size, 0)
        text = text.replace(damage, damage.replace("sub", "x").replace("e", "3"))
        text = text.replace("\n", " ") if damage != ";" else text.replace(";", "")
        calls, diagnostics = counted(errors, text)
        assert len(diagnostics) > size / 10
        work.append(calls)
    assert work[1] < 5 * work[0]


def test_templates_of_the_session(templates: Mapping[str, object]) -> None:
    assert dict(templates) == dict(TEMPLATES)


@given(st.tuples(*[st.integers(-1800, 1800)] * 3))
def test_a_turn_in_tenths_of_degrees_is_written_as_it_was_read(tenths: tuple[int, ...]) -> None:
    """It is the rotation about x, then y, then z, and the same quaternion is read again."""
    turn = ", ".join(f"{n / 10:g}" for n in tenths)
    pag = read(f"root = p; p = atomic ( turn = ( {turn} ) )")
    (quat,) = (parameter.value for parameter in pag["p"].parameters)
    assert isinstance(quat, tuple)
    w, x, y, z = quat
    a, b, c = (math.radians(n / 10) for n in tenths)
    assert 2 * (w * y - x * z) == pytest.approx(
        math.sin(b), abs=1e-8
    )  # minus the z of where x goes
    assert 2 * (y * z + w * x) == pytest.approx(math.cos(b) * math.sin(a), abs=1e-8)
    assert 2 * (x * y + w * z) == pytest.approx(math.cos(b) * math.sin(c), abs=1e-8)
    text = write_pag(pag)
    assert ("turn = " in text) == (quat != (1, 0, 0, 0))
    assert read(text) == pag


def test_a_part_has_one_rotation() -> None:
    (error,) = errors("root = p; p = atomic ( turn = ( 0, 0, 90 ), quat = ( 1, 0, 0, 0 ) )")
    assert error.code == "BadValue" and "one rotation" in error.message
    assert "keep one of turn, quat" in error.hint
    (error,) = errors("root = p; p = atomic ( rotation = ( 0, 0, 90 ) )")
    assert "did you mean 'turn'?" in error.hint


def test_copies_are_written_as_they_are_read() -> None:
    """Only what is numbered from one and differs in its place alone; the name is no other label."""
    text = (
        "root = all; all = mate ( plate, screw, odd1, odd3, x1, x2, y1, y2 );\n"
        "plate = atomic();\n"
        "screw[3] = atomic ( cylinder = ( 1, 9 ) ) at ( 0, 0, 0 ), ( 5, 0, 0 ), ( 9, 0, 0 );\n"
        "odd1 = atomic ( pos = ( 1, 0, 0 ) ); odd3 = atomic ( pos = ( 2, 0, 0 ) );\n"
        "x1 = atomic ( mass = 1, pos = ( 1, 0, 0 ) );\n"
        "x2 = atomic ( mass = 2, pos = ( 2, 0, 0 ) );\n"
        "y1 = atomic ( pos = ( 1, 0, 0 ) ); y2 = atomic ( pos = ( 2, 0, 0 ), mass = 1 );\n"
    )
    pag = read(text)
    written = write_pag(pag)
    assert read(written) == pag and len(pag) == 11
    assert [line.partition(" = ")[0] for line in written.splitlines()[2:]] == [
        "plate", "screw[3]", "odd1", "odd3", "x1", "x2", "y1", "y2"
    ]  # fmt: skip
    both = PAG("all", (*pag.nodes[1:5], Assembly("screw", "mate", ("screw1", "screw2"))))
    assert "screw[" not in write_pag(both)
