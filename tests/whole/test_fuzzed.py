"""Mangled files of others, by the thousand: nets in PNML, bills of materials, trees, scenes of
parts, plans, what is written into a plant. Each is read, or refused with a diagnosis."""

from __future__ import annotations

import io
import json
import struct
import zipfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
import trimesh

import factory
from factory.apps.exports import exporters
from factory.apps.exports.subject import Subject
from factory.apps.foreign_nets.discover import discover
from factory.apps.foreign_nets.pnml_reader import load_net
from factory.apps.importing import Options, import_product
from factory.apps.importing.loose import bodies_in, loose_product
from factory.apps.log import plan_file
from factory.apps.log.plan_file import plan_files
from factory.apps.plc.signals import Commands
from factory.commands.checking import check_net
from factory.pipeline import read
from factory.support.errors import FactoryError
from factory.theory.lang.template_reader import all_templates
from factory.theory.nets.gears import GearNet
from tests.paths import ROOT
from tests.step_boxes import step_of

WORDS = (
    *("", " ", "\0", "\ufeff", "\ud7ff", "é", "日本", "\u202e", "\x1b[31m", "\\", '"', "'"),
    *("<", ">"),
    *("&amp;", "&x;", "&#0;", "<!DOCTYPE x>", "<![CDATA[", "]]>", "<!--", "<a/>", "</net>"),
    *("0", "-0", "-1", "2", "1e308", "-1e999", "nan", "inf", "1_0", "١", "1,5", "0x10", "9" * 30),
    *(",", ";", "\t", "\n", "\r", '",', "../x", "/", "level", "item", "name", "=1+1", "%s", "{0}"),
)

PNML_WORDS = ("<place", "id=", "p1", "t1", "arc", "source", "target", "initialMarking", "<text>")

TEMPLATES = all_templates()

BILLS = (
    "level,name,quantity,mesh,x [mm],Mass [g]\n0,table,,,,\n1,frame,1,,0,12\n2,leg,4,,3,0.5\n",
    "item;Bezeichnung;Menge;Dichte [g/cm³]\n1;axle;2;7,8\n1.1;wheel;2;1\n2;body;1;2\n",
    "Pos.\tDésignation\tNombre\tX / cm\n1\taxe\t1\t3\n1.1\troue\t2\t4\n2\tcorps\t1\t0\n",
)

TREES = (
    '{"name": "a", "children": [{"part": true}, {"box": [1, 1, 1], "at": [0, 0, 1]}]}',
    '{"name": "a", "do": "mate", "children": [{"part": true, "mass": 1}, {"sphere": 1}]}',
)


def mangled(text: str, draw: Random, words: tuple[str, ...]) -> bytes:
    """A text with one to four changes: pieces that are removed, repeated, moved or replaced, and
    now and then a byte."""
    for _ in range(draw.randint(1, 4)):
        start = draw.randrange(len(text) + 1)
        end = min(len(text), start + int(draw.expovariate(1 / 12)))
        other = draw.randrange(len(text) + 1)
        piece = text[start:end]
        text = draw.choice(
            (
                text[:start] + text[end:],
                text[:start] + draw.choice(words) + text[end:],
                text[:start] + draw.choice(words) + text[start:],
                text[:other] + piece + text[other:],
                text[:start] + piece * draw.choice((2, 50)) + text[end:],
                text[:start],
            )
        )
    content = bytearray(text.encode("utf-8", "surrogatepass"))
    if content and draw.random() < 0.1:
        content[draw.randrange(len(content))] = draw.randrange(256)
    return bytes(content)


@cache
def nets() -> tuple[str, ...]:
    """The net of an example, and a marked graph without gears."""
    whole = factory.export(ROOT / "examples" / "paper.pag", "pnml")
    body = "".join(
        f'<place id="p{n}"><initialMarking><text>{int(not n)}</text></initialMarking></place>'
        f'<transition id="t{n}"/><arc id="a{n}" source="p{n}" target="t{n}"/>'
        f'<arc id="b{n}" source="t{n}" target="p{(n + 1) % 3}"/>'
        for n in range(3)
    )
    plain = f'<pnml><net id="n" type="x/ptnet"><page id="g">{body}</page></net></pnml>'
    assert isinstance(whole, str)
    return whole, plain, f'<?xml version="1.0" encoding="utf-8"?>{plain}'


def read_net(folder: Path, draw: Random) -> None:
    """A net is read, proved, explored and exported as `check` and `export` do."""
    file = folder / "x.pnml"
    file.write_bytes(mangled(draw.choice(nets()), draw, WORDS + PNML_WORDS))
    made = load_net(file)
    if not isinstance(made, GearNet):
        discover(made)
    check_net(file)
    for form in ("pnml", "dot", "svg"):
        exporters()[form].export(Subject(file, made))


def read_bill(folder: Path, draw: Random) -> None:
    file = folder / draw.choice(("x.csv", "x.tsv"))
    file.write_bytes(mangled(draw.choice(BILLS), draw, WORDS))
    chosen = {"name": draw.choice(WORDS)} if draw.random() < 0.1 else {}
    assert import_product(file, TEMPLATES, Options(columns=chosen)).files


def read_tree(folder: Path, draw: Random) -> None:
    file = folder / "x.json"
    file.write_bytes(mangled(draw.choice(TREES), draw, WORDS))
    assert import_product(file, TEMPLATES).files


STEP_WORDS = ("#", "#1", "=", "(", ")", "$", "*", ".T.", "DIRECTION('',(0.,0.,0.))", "ENDSEC;")
GLTF_WORDS = (*"[]{}:", '"mesh":', '"matrix":[0]', '"bufferView":9', '"scale":[0,0,0]')
MODEL_WORDS = ("<vertex", 'x="', "<component", 'objectid="1"', "<triangle", "</mesh>")


@cache
def scene(kind: str) -> bytes:
    """Two named boxes that touch."""
    if kind == "step":
        return step_of({"low": ((0, 0, 0), (9, 9, 9)), "high": ((0, 0, 9), (9, 9, 19))}).encode()
    made = trimesh.Scene()
    for name, height in (("low", 0.5), ("high", 1.5)):
        box = trimesh.creation.box((1, 1, 1))
        made.add_geometry(box.apply_translation((0, 0, height)), node_name=name, geom_name=name)
    content = made.export(file_type=kind)
    assert isinstance(content, bytes)
    return content


def mangled_glb(draw: Random) -> bytes:
    """A GLB file whose text is mangled, its lengths as they should be, or its bytes."""
    content = scene("glb")
    (length,) = struct.unpack_from("<I", content, 12)
    text, rest = content[20 : 20 + length].decode(), content[20 + length :]
    changed = (
        mangled(text, draw, WORDS + GLTF_WORDS) if draw.random() < 0.5 else replaced(text, draw)
    )
    changed += b" " * (-len(changed) % 4)
    if draw.random() < 0.3:
        rest = bytes(byte ^ (draw.random() < 0.02) << draw.randrange(8) for byte in rest)
    head = struct.pack(
        "<4sIIII", b"glTF", 2, 20 + len(changed) + len(rest), len(changed), 0x4E4F534A
    )
    return head + changed + rest


def mangled_3mf(draw: Random) -> bytes:
    """A 3MF file in which the text of one of its files is mangled."""
    made = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(scene("3mf"))) as given, zipfile.ZipFile(made, "w") as out:
        names = given.namelist()
        chosen = draw.choice(names[-1:] * 8 + names)
        for name in names:
            text = given.read(name)
            if name == chosen:
                text = mangled(text.decode(), draw, WORDS + MODEL_WORDS)
            out.writestr(name, text)
    content = bytearray(made.getvalue())
    if draw.random() < 0.1:
        content[draw.randrange(len(content))] ^= 1 << draw.randrange(8)
    return bytes(content)


def read_scene(folder: Path, draw: Random) -> None:
    kind = draw.choice(("glb", "3mf"))
    file = folder / f"x.{kind}"
    file.write_bytes(mangled_glb(draw) if kind == "glb" else mangled_3mf(draw))
    assert loose_product(file, bodies_in(file), None).files


def read_step(folder: Path, draw: Random) -> None:
    pytest.importorskip("cascadio", reason="the extra `step` is not installed")
    file = folder / "x.step"
    file.write_bytes(mangled(scene("step").decode(), draw, WORDS + STEP_WORDS))
    assert loose_product(file, bodies_in(file), None).files


@cache
def plan_text() -> str:
    """The plan.json of an example."""
    file = ROOT / "examples" / "paper.pag"
    files = plan_files(read(file), Path("x"), file.read_text(), laid=False)
    return files[Path("x/plan.json")].decode()


def replaced(text: str, draw: Random) -> bytes:
    """A JSON text in which one value is another, is gone, or is there twice."""
    table = json.loads(text)
    places: list[tuple[Any, Any]] = []

    def walk(value: Any) -> None:
        pairs = value.items() if isinstance(value, dict) else enumerate(value)
        for key, inner in pairs:
            places.append((value, key))
            if isinstance(inner, dict | list):
                walk(inner)

    walk(table)
    holder, key = draw.choice(places)
    other, where = draw.choice(places)
    values = [*WORDS, 0, 1, -1, 2**70, 1e308, 0.5, True, None, [], {}, [[]], other[where]]
    if draw.random() < 0.2:
        del holder[key]
    else:
        holder[key] = draw.choice(values)
    try:
        return json.dumps(table).encode("utf-8", "surrogatepass")
    except (ValueError, RecursionError):  # the value contains itself
        return text.encode()


def read_plan(folder: Path, draw: Random) -> None:
    """A plan is read, and its factory compiled and laid out, as by `build`."""
    file, text = folder / "plan.json", plan_text()
    file.write_bytes(replaced(text, draw) if draw.random() < 0.8 else mangled(text, draw, WORDS))
    made = plan_file.read_plan(file)
    project = made.project(made.settings, made.ground, lambda warning: None)
    assert project.plain.robots and project.layout.guidepaths


def take_written(_: Path, draw: Random) -> None:
    """Whatever is written into the variables of a plant, commands of the right form come out."""
    ua = pytest.importorskip("asyncua", reason="the extra `opcua` is not installed")
    from factory.apps.plc.written import WrittenCommands

    kinds, kept = ua.ua.VariantType, Commands(np.zeros(3), (False,) * 3, (0,) * 3)
    taken = WrittenCommands(ua, kept)
    values = [0, 1, -1, 2**40, 1e308, -1e308, float("nan"), float("inf"), "x", b"x", None, True]
    values += [[], [[1.0] * 3] * 3, [0.1] * 3, [None] * 3, [True] * 3, [1, 2, 65535], [[], [], []]]
    values += [["a"] * 3, [float("nan")] * 3, (0.1, 0.2, 0.3), {"a": 1}, object()]
    wanted = {"Target": kinds.Double, "Grip": kinds.Boolean, "Job": kinds.UInt16}

    class Thing:
        """A variant of any value and type, as a decoder might leave it."""

        def __init__(self, value: Any, kind: Any) -> None:
            self.Value, self.VariantType = value, kind

    def written(name: str) -> Any:
        kind = wanted.get(name, kinds.UInt32)
        kind = kind if draw.random() < 0.8 else draw.choice([*kinds])
        status = draw.choice([None, ua.ua.StatusCode(), ua.ua.StatusCode(draw.randrange(2**32))])
        value = draw.choice(values) if draw.random() < 0.7 else [0.1, 0.2, 0.3]
        cell = ua.ua.DataValue(StatusCode=status)
        object.__setattr__(cell, "Value", draw.choice([None, *[Thing(value, kind)] * 9]))
        return cell

    for now in range(5):
        made = taken.take(written, float(now))
        assert made.target.shape == (3,) and np.isfinite(made.target).all()
        assert [*map(type, made.grip)] == [bool] * 3
        assert [*map(type, made.job)] == [int] * 3
        assert bool(taken.unfit) <= made.stop


READ: dict[str, Callable[[Path, Random], None]] = {
    "net": read_net,
    "bill": read_bill,
    "tree": read_tree,
    "scene": read_scene,
    "step": read_step,
    "plan": read_plan,
    "written": take_written,
}


def tried(read: Callable[[Path, Random], None], folder: Path, seeds: range) -> int:
    """How many of the inputs were read, none having ended in anything but a diagnosis."""
    read_well = 0
    for seed in seeds:
        try:
            read(folder, Random(seed))
            read_well += 1
        except FactoryError as error:
            assert error.exit_status in (2, 3), (seed, error)
        except Exception as error:
            raise AssertionError(f"seed {seed}: {error!r}") from error
    return read_well


SLOW_READERS = {"step": 40, "plan": 2}
"""How many times fewer files of these kinds are tried."""


@pytest.mark.parametrize("kind", READ)
def test_mangled_input_is_read_or_refused(kind: str, tmp_path: Path) -> None:
    count = 150 // SLOW_READERS.get(kind, 1)
    assert tried(READ[kind], tmp_path, range(count)) > 0


@pytest.mark.slow
@pytest.mark.parametrize("kind", READ)
def test_ten_thousand_mangled_inputs_are_read_or_refused(kind: str, tmp_path: Path) -> None:
    count = 2500 // SLOW_READERS.get(kind, 1)
    assert tried(READ[kind], tmp_path, range(1000, 1000 + count)) > 0
