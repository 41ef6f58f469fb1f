"""Bills of materials, as spreadsheets export them (CSV with a header), to drafts."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import isfinite
from types import MappingProxyType

from factory.api import Diagnostic, InputError, Value
from factory.apps.importing.bill_header import Header, HeaderReader
from factory.apps.importing.draft import MATE, MOST_NODES, PART, DraftNode, ImportFaults, too_many
from factory.apps.importing.part_maker import PartMaker, Placement
from factory.apps.importing.tree_file import mesh_name
from factory.support.decimals import number
from factory.support.errors import Position
from factory.support.texts import Source, quoted
from factory.theory.problem.parameters import ParameterKind

MOST_COPIES = 10_000
"""The greatest quantity of a row."""


@dataclass(slots=True)
class BillRow:
    """A row of the bill: its cells and their positions by column. `parent`: the index of the row
    that it belongs to, -1 for none."""

    cells: dict[str, str]
    places: dict[str, Position]
    position: Position
    parent: int = -1
    quantity: int = 1

    def at(self, column: str) -> Position:
        """The position of a column's cell."""
        return self.places.get(column, self.position)


class BillTable:
    """Reads a bill row by row, the first by a reader of headers."""

    def __init__(self, source: Source, header: HeaderReader) -> None:
        self.source, self._reader = source, header
        first = next((line for line in source.lines if line.strip()), "")
        self.delimiter = max(",;\t", key=first.count)
        self.header = Header({}, {})

    def rows(self) -> list[BillRow]:
        """All rows below the header. Raises InputError if the text is not CSV, or the header lacks
        a column (Syntax, BadLevel, MissingPart)."""
        rows = []
        for cells, at in self._lines():
            starts = self._starts(at.text)
            if not self.header.columns:
                places = [_place(at, starts, index) for index in range(len(cells))]
                self.header = self._reader.read(cells, at, places)
                continue
            columns = self.header.columns.items()
            row = {name: cells[i].strip() for name, i in columns if i < len(cells)}
            rows.append(BillRow(row, {name: _place(at, starts, i) for name, i in columns}, at))
        return rows

    def _lines(self) -> Iterator[tuple[list[str], Position]]:
        """The cells of each non-empty line, and its position."""
        reader = csv.reader(self.source.text.split("\n"), delimiter=self.delimiter, strict=True)
        while True:
            line = reader.line_num + 1
            try:
                cells = next(reader, None)
            except csv.Error as error:
                hint = "cells are separated by commas; a cell with a comma is in double quotes"
                fault = Diagnostic("Syntax", f"invalid CSV: {error}", self._line(line), hint)
                raise InputError(fault) from None
            if cells is None:
                return
            if any(cell.strip() for cell in cells):
                yield cells, self._line(line)

    def _line(self, line: int) -> Position:
        line = min(line, len(self.source.lines))
        return Position(self.source.file, line, 1, self.source.lines[line - 1])

    def _starts(self, line: str) -> list[int]:
        """The start of each cell of a line, from 0; a quoted cell may contain delimiters."""
        starts, quotes = [0], False
        for index, character in enumerate(line):
            quotes ^= character == '"'
            if character == self.delimiter and not quotes:
                starts.append(index + 1)
        return starts


def _place(at: Position, starts: list[int], index: int) -> Position:
    start = starts[index] if index < len(starts) else len(at.text)
    return replace(at, column=start + 1)


class BillReader:
    """Makes drafts of rows; errors go to the faults. `chosen`: titles of columns by their names,
    where the user says them."""

    def __init__(
        self,
        source: Source,
        parts: PartMaker,
        faults: ImportFaults,
        chosen: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        self.source, self.parts, self.faults = source, parts, faults
        self.table = BillTable(source, HeaderReader(faults, chosen))

    def read(self, name: str) -> list[DraftNode]:
        """The drafts of a bill; the product of several rows at the top is called `name`. Raises
        InputError with every fault."""
        rows = self.table.rows()
        if not rows:
            message, hint = "the bill has no rows", "below the header, a row is like 1,leg,4"
            raise InputError(Diagnostic("EmptyNode", message, self.source.start(), hint))
        if "item" in self.table.header.columns or any("." in _level(row) for row in rows):
            self._number_parents(rows)
        else:
            self._level_parents(rows)
        for row in rows:
            self._check(row)
        self.faults.raise_if_any()
        drafts = self._expand(rows, name)
        self.parts.check_places()
        self.faults.raise_if_any()
        return drafts

    def _level_parents(self, rows: list[BillRow]) -> None:
        """Levels 0, 1, 2: the parent of a row is the last row before it at the level above."""
        above: list[tuple[int, int]] = []
        top: int | None = None
        for index, row in enumerate(rows):
            text = _level(row)
            if not re.fullmatch(r"[0-9]{1,9}", text):
                hint = "levels are 0, 1, 2, or numbers like 1, 1.1, 1.2"
                self._bad_level(row, f"{quoted(text)} is not a level", hint)
                continue
            level = int(text)
            top = level if top is None else top
            before = above[-1][0] if above else level
            while above and above[-1][0] >= level:
                above.pop()
            if level > before + 1:
                hint = "a row is at most one level below the row before it"
                self._bad_level(row, f"level {level} comes after level {before}", hint)
            elif not above and level < top:
                hint = "the product, or its first part, comes first"
                self._bad_level(row, f"level {level} is above that of the first row", hint)
            row.parent = above[-1][1] if above else -1
            above.append((level, index))

    def _number_parents(self, rows: list[BillRow]) -> None:
        """Numbers 1, 1.1, 1.2: the parent of a row has its number without the last part."""
        seen: dict[str, int] = {}
        for index, row in enumerate(rows):
            text = _level(row).rstrip(".")
            above = text.rpartition(".")[0]
            if not re.fullmatch(r"[0-9]+(\.[0-9]+)*", text):
                self._bad_level(
                    row, f"{quoted(text)} is not a number like 1.2", "as in 1, 1.1, 1.2"
                )
            elif text in seen:
                line = rows[seen[text]].position.line
                message = f"number {text} appears twice, first in line {line}"
                hint = "give each row its own; spreadsheets make 1.10 into 1.1: write it as text"
                self._bad_level(row, message, hint)
            elif above and above not in seen:
                hint = "a sub-assembly's row comes before those of its parts"
                self._bad_level(row, f"number {text} has no row {above} above it", hint)
            row.parent = seen.get(above, -1)
            seen.setdefault(text, index)

    def _bad_level(self, row: BillRow, message: str, hint: str) -> None:
        column = "level" if "level" in row.cells else "item"
        self.faults.add("BadLevel", message, row.at(column), hint)

    def _check(self, row: BillRow) -> None:
        if not row.cells.get("name") and not row.cells.get("mesh"):
            hint = "write the name of the part, or its mesh"
            self.faults.add(
                "MissingPart", "the row has neither a name nor a mesh", row.at("name"), hint
            )
        text = row.cells.get("quantity", "") or "1"
        value = _number(text)
        if value is None or value != int(value) or not 1 <= value <= MOST_COPIES:
            message = f"the quantity {quoted(text)} is not a whole number from 1 to {MOST_COPIES}"
            hint = "how many of it one unit of the parent row has"
            self.faults.add("BadValue", message, row.at("quantity"), hint)
        else:
            row.quantity = int(value)

    def _expand(self, rows: list[BillRow], name: str) -> list[DraftNode]:
        """A draft for each copy of each row, below the draft of the product."""
        below: dict[int, list[int]] = {}
        for index, row in enumerate(rows):
            below.setdefault(row.parent, []).append(index)
        drafts = [DraftNode(name, rows[0].position)]
        stack = [(0, -1)]
        while stack:
            parent, of = stack.pop()
            for index in below.get(of, ()):
                for _ in range(rows[index].quantity):
                    if len(drafts) > MOST_NODES:
                        raise too_many(rows[index].position)
                    drafts[parent].inputs.append(len(drafts))
                    if index in below:
                        stack.append((len(drafts), index))
                    drafts.append(self._draft(rows[index], index in below))
        return drafts

    def _draft(self, row: BillRow, is_group: bool) -> DraftNode:
        mesh = row.cells.get("mesh", "")
        name = row.cells.get("name") or mesh_name(mesh)
        if is_group:
            return DraftNode(name, row.at("name"), MATE)
        values: dict[str, Value] = {"mesh": mesh} if mesh else {}
        if any(row.cells.get(axis) for axis in "xyz"):
            values["pos"] = tuple(self._length(row, axis) for axis in "xyz")
        for column in ("mass", "density"):
            value = self._value(row, column)
            if value is not None:
                unit = self.table.header.units.get(column)
                values[column] = value if unit is None else float(f"{value * unit:.12g}")
        parameters = self.parts.parameters(values, Placement(), row.at("mesh"))
        return DraftNode(name, row.at("name"), PART, [], parameters)

    def _length(self, row: BillRow, axis: str) -> float:
        """A length of a row, converted from the unit of its column to that of the bill."""
        value = self._value(row, axis) or 0.0
        unit = self.table.header.units.get(axis)
        return value if unit is None else round(value * unit / self.parts.unit, 12)

    def _value(self, row: BillRow, column: str) -> float | None:
        text = row.cells.get(column, "")
        value = _number(text)
        kind = ParameterKind.GEOMETRY.get(column)
        unit = self.table.header.units.get(column, 1.0)
        if text and (
            value is None
            or not isfinite(value * unit)
            or (kind is not None and not kind.fits((value,)))
        ):
            message = f"'{column}' takes {kind.wanted if kind else 'a number'}, not {quoted(text)}"
            self.faults.add("BadValue", message, row.at(column), "for example 0.25")
        return value


def _level(row: BillRow) -> str:
    """The level of a row, without the leading dots that some programs print."""
    return (row.cells.get("level") or row.cells.get("item", "")).lstrip(". ")


def _number(text: str) -> float | None:
    """A number, which may have a decimal comma."""
    return number(text.replace(",", "."))
