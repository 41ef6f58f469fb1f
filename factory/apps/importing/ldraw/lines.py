"""The lines of LDraw files as values, and LDraw's colours."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise

from factory.apps.importing.draft import ImportFaults
from factory.support.decimals import number
from factory.support.errors import Position
from factory.support.texts import Source, quoted

FURTHEST = 1e7
"""The largest number of a line [LDU]: 4 km."""

Triangle = tuple[float, ...]
Colours = dict[int, tuple[float, float, float, float]]

INHERITED = (16, 24)
"""The colour of the line that refers to this file."""

_DIRECT = 0x2000000

_COMMON = """
0 1B2A34  1 1E5AA8  2 00852B  3 069D9F  4 B40000  5 D3359D  6 543324  7 8A928D  8 545955
9 97CBD9  10 58AB41  11 00AAA4  12 F06D61  13 F6A9BB  14 FAC80A  15 F4F4F4  17 ADD9A8
18 FFD67F  19 D7BA8C  20 AFBED6  22 671F81  23 0E3E9A  25 D67923  26 901F76  27 A5CA18
28 897D62  29 FF9ECD  30 A06EB9  31 CDA4DE  70 5F3109  71 969696  72 646464  73 7396C8
85 441A91  191 FCAC00  212 9DC3F7  226 FFEC6C  272 19325A  288 00451A  308 352100
320 720012  378 708E7C  379 70819A  484 91501C
"""
_CLEAR = """
33 0020A0  34 237841  35 56E646  36 C91A09  40 635F52  41 559AB7  42 C0FF00  43 AEE9EF
46 F5CD2F  47 FCFCFC  57 F08F1C
"""
"""Codes and values of LDraw's LDConfig.ldr; a library with its own replaces them."""

_WORD = re.compile(r"\S+")
_PART = re.compile(r"(Unofficial_)?(Part|Subpart|Primitive|8_Primitive|48_Primitive|Shortcut)\b")


@dataclass(frozen=True, slots=True)
class Reference:
    """A line of type 1: a file placed by x y z and a matrix a..i [LDU], with a colour. `inverted`:
    whether its surfaces are inside out."""

    colour: int
    place: tuple[float, ...]
    file: str
    position: Position
    inverted: bool = False


@dataclass(slots=True)
class LDrawFile:
    """A file, or one `0 FILE` section of a file: references by building step, its own triangles
    (nine numbers each [LDU], counterclockwise), and the colours that it defines."""

    name: str
    position: Position
    steps: list[list[Reference]] = field(default_factory=lambda: [[]])
    triangles: list[Triangle] = field(default_factory=list)
    colours: Colours = field(default_factory=dict)
    declared: str = ""

    @property
    def references(self) -> Iterator[Reference]:
        return (reference for step in self.steps for reference in step)

    @property
    def is_part(self) -> bool:
        """Whether the file is the shape of a part, not a model made of parts."""
        if self.declared:
            return self.declared == "part"
        return self.name.lower().endswith(".dat") or (bool(self.triangles) and not any(self.steps))


def key_of(name: str) -> str:
    """The key of a file name, independent of case and slashes."""
    return name.replace("\\", "/").strip().lower()


def read_lines(source: Source, name: str, faults: ImportFaults) -> list[LDrawFile]:
    """The files in a text, the main one first; errors go to `faults`."""
    reader = _Reader(source, name, faults)
    for line, text in enumerate(source.lines, 1):
        reader.line(line, text)
    return reader.files


class _Reader:
    """Reads line by line; winding and inversion apply to the following lines."""

    def __init__(self, source: Source, name: str, faults: ImportFaults) -> None:
        self.file, self.faults = source.file, faults
        self.files = [LDrawFile(name, source.start())]
        self.current: LDrawFile | None = self.files[0]
        self.opened: dict[str, Position] = {}
        self.clockwise = self.inverted = False

    def line(self, number: int, text: str) -> None:
        words = list(_WORD.finditer(text))
        if not words:
            return
        at = Position(self.file, number, words[0].start() + 1, text)
        kind = words[0][0]
        if kind == "0":
            self._meta([word[0] for word in words[1:]], text, at)
        elif kind not in ("1", "2", "3", "4", "5"):
            hint = "a line starts with its type, 0 to 5: https://www.ldraw.org/article/218.html"
            self.faults.add("Syntax", f"there is no line type {quoted(kind)}", at, hint)
        elif self.current is not None and kind == "1":
            self._reference(self.current, words, text, at)
        elif self.current is not None and kind in "34":
            self._facet(self.current, words, int(kind), at)

    def _meta(self, words: list[str], text: str, at: Position) -> None:
        match words:
            case ["FILE", _, *_]:
                self._open(text.split(None, 2)[2].strip(), at)
            case ["FILE"]:
                self.faults.add("Syntax", "0 FILE has no name", at, "write: 0 FILE wing.ldr")
            case ["NOFILE"] | ["!DATA", *_]:
                self.current = None
            case ["STEP"] | ["ROTSTEP", *_] if self.current is not None:
                self.current.steps.append([])
            case ["BFC", *settings]:
                self.clockwise = (self.clockwise or "CW" in settings) and "CCW" not in settings
                self.inverted = "INVERTNEXT" in settings
            case ["!LDRAW_ORG" | "LDRAW_ORG", kind, *_] if self.current is not None:
                self.current.declared = "part" if _PART.match(kind) else "model"
            case ["!COLOUR", *_] if self.current is not None:
                self._colour(self.current, words)

    def _open(self, name: str, at: Position) -> None:
        """Begin another file."""
        self.clockwise = self.inverted = False
        if not self.opened and not (self.files[0].triangles or any(self.files[0].steps)):
            self.files = []
        first = self.opened.setdefault(key_of(name), at)
        if first is not at:
            message = f"the file {quoted(name)} appears twice, first in line {first.line}"
            self.faults.add("DuplicateLabel", message, at, "give each 0 FILE a name of its own")
        self.current = LDrawFile(name, at)
        self.files.append(self.current)

    def _reference(
        self, file: LDrawFile, words: list[re.Match[str]], text: str, at: Position
    ) -> None:
        inverted, self.inverted = self.inverted, False
        if len(words) < 15:
            message = f"a line of type 1 has 13 numbers and a file; here are {len(words) - 1} words"
            hint = "write: 1 COLOUR x y z a b c d e f g h i FILE"
            self.faults.add("Syntax", message, at, hint)
            return
        colour, numbers = self._colour_code(words[1], at), self._numbers(words[2:14], at)
        if colour is None or numbers is None:
            return
        name = text[words[14].start() :].strip()
        place = replace(at, column=words[14].start() + 1)
        file.steps[-1].append(Reference(colour, numbers, name, place, inverted))

    def _facet(
        self, file: LDrawFile, words: list[re.Match[str]], corners: int, at: Position
    ) -> None:
        if len(words) < 2 + 3 * corners:
            message = f"a line of type {corners} has {1 + 3 * corners} numbers"
            hint = f"write: {corners} COLOUR, then x y z of each of {corners} corners"
            self.faults.add("Syntax", f"{message}; here are {len(words) - 1}", at, hint)
            return
        numbers = self._numbers(words[2 : 2 + 3 * corners], at)
        if numbers is None:
            return
        points = [numbers[n : n + 3] for n in range(0, len(numbers), 3)]
        if self.clockwise:
            points.reverse()
        for n in range(2, corners):
            file.triangles.append((*points[0], *points[n - 1], *points[n]))

    def _numbers(self, words: list[re.Match[str]], at: Position) -> tuple[float, ...] | None:
        values = []
        for word in words:
            value = number(word[0])
            if value is None or abs(value) > FURTHEST:
                message = f"{quoted(word[0])} is not a number from {-FURTHEST:g} to {FURTHEST:g}"
                here = replace(at, column=word.start() + 1)
                self.faults.add("BadValue", message, here, "lengths are in LDU of 0.4 mm")
                return None
            values.append(value)
        return tuple(values)

    def _colour_code(self, word: re.Match[str], at: Position) -> int | None:
        code = _integer(word[0])
        if code is None:
            here = replace(at, column=word.start() + 1)
            hint = "a colour is a whole number, or 0x2RRGGBB; 16 is that of the model above"
            self.faults.add("BadValue", f"{quoted(word[0])} is not a colour", here, hint)
        return code

    def _colour(self, file: LDrawFile, words: list[str]) -> None:
        """`0 !COLOUR Red CODE 4 VALUE #B40000 EDGE #333333 ALPHA 128`; an invalid definition is
        ignored."""
        settings = dict(pairwise(words))
        code = _integer(settings.get("CODE", ""))
        alpha = _integer(settings.get("ALPHA", "255"))
        value = re.fullmatch(r"(?:#|0x)([0-9A-Fa-f]{6})", settings.get("VALUE", ""))
        if code is not None and value and alpha is not None:
            file.colours[code] = rgba_of(int(value[1], 16), min(alpha, 255))


def _integer(word: str) -> int | None:
    if re.fullmatch(r"0[xX][0-9A-Fa-f]{1,8}", word):
        return int(word, 16)
    return int(word) if re.fullmatch(r"[0-9]{1,10}", word) else None


def rgba_of(rgb: int, alpha: int = 255) -> tuple[float, float, float, float]:
    """0xRRGGBB and an opacity of 255 as numbers from 0 to 1."""
    red, green, blue = (round((rgb >> shift & 255) / 255, 3) for shift in (16, 8, 0))
    return (red, green, blue, round(alpha / 255, 3))


def common_colours() -> Colours:
    """The colours that models use without a library."""
    colours: Colours = {}
    for words, alpha in ((_COMMON.split(), 255), (_CLEAR.split(), 128)):
        for code, value in zip(words[::2], words[1::2], strict=True):
            colours[int(code)] = rgba_of(int(value, 16), alpha)
    return colours


def direct_colour(code: int) -> tuple[float, float, float, float] | None:
    """The colour of a code 0x2RRGGBB, or of 0x3RRGGBB, which is half transparent."""
    if code >> 24 not in (2, 3):
        return None
    return rgba_of(code & 0xFFFFFF, 255 if code < _DIRECT + 0x1000000 else 128)
