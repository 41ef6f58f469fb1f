"""The rows of a bill of materials, as spreadsheets export them: CSV with a header."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from factory.importing.draft import ImportFaults
from factory.lang.source import Source, quoted
from factory.lang.words import UNITS
from factory.support.errors import Diagnostic, InputError, Position

COLUMNS = {
    "level": ("level", "lvl", "indent"),
    "item": ("item", "item no.", "item number", "no.", "pos.", "wbs"),
    "name": ("name", "part", "part name", "part number", "part no.", "description", "component"),
    "quantity": ("quantity", "qty", "qty.", "count", "amount"),
    "mesh": ("mesh", "mesh file", "file", "cad file"),
    "x": ("x",),
    "y": ("y",),
    "z": ("z",),
    "mass": ("mass", "mass [kg]", "weight"),
    "density": ("density",),
}
"""The columns that are read, and the headers that they may have, the likeliest first."""

EXAMPLE = "level,name,quantity,mesh,x,y,z"


@dataclass(slots=True)
class BillRow:
    """A line of the bill: cells by column, and the place of each; `parent`: the index of the row
    that it is a part of, -1 for none."""

    cells: dict[str, str]
    places: dict[str, Position]
    position: Position
    parent: int = -1
    quantity: int = 1

    def at(self, column: str) -> Position:
        """Where a column's cell is."""
        return self.places.get(column, self.position)


@dataclass(frozen=True, slots=True)
class Header:
    """The index of each column that is read, and the units in headers [m]."""

    columns: dict[str, int]
    units: dict[str, float]


class BillTable:
    """Reads a bill row by row; errors go to the faults."""

    def __init__(self, source: Source, faults: ImportFaults) -> None:
        self.source, self.faults = source, faults
        header = next((line for line in source.lines if line.strip()), "")
        self.delimiter = max(",;\t", key=header.count)
        self.header = Header({}, {})

    def rows(self) -> list[BillRow]:
        """Every row below the header. Raises InputError where the text is no CSV, or the header
        lacks a column (Syntax, BadLevel, MissingPart)."""
        found = []
        for cells, at in self._lines():
            starts = self._starts(at.text)
            if not self.header.columns:
                self.header = self._read_header(cells, at, starts)
                continue
            columns = self.header.columns.items()
            row = {name: cells[i].strip() for name, i in columns if i < len(cells)}
            found.append(BillRow(row, {name: _place(at, starts, i) for name, i in columns}, at))
        return found

    def _lines(self) -> Iterator[tuple[list[str], Position]]:
        """The cells of each line that is not empty, and where it starts."""
        reader = csv.reader(self.source.text.split("\n"), delimiter=self.delimiter, strict=True)
        while True:
            line = reader.line_num + 1
            try:
                cells = next(reader, None)
            except csv.Error as error:
                hint = "cells are divided by commas; one with a comma in it is in double quotes"
                fault = Diagnostic("Syntax", f"no CSV: {error}", self._line(line), hint)
                raise InputError(fault) from None
            if cells is None:
                return
            if any(cell.strip() for cell in cells):
                yield cells, self._line(line)

    def _line(self, line: int) -> Position:
        line = min(line, len(self.source.lines))
        return Position(self.source.file, line, 1, self.source.lines[line - 1])

    def _starts(self, line: str) -> list[int]:
        """Where each cell of a line starts, from 0; a cell in quotes may have delimiters in it."""
        starts, quotes = [0], False
        for index, character in enumerate(line):
            quotes ^= character == '"'
            if character == self.delimiter and not quotes:
                starts.append(index + 1)
        return starts

    def _read_header(self, cells: list[str], at: Position, starts: list[int]) -> Header:
        known = {header: name for name, headers in COLUMNS.items() for header in headers}
        titles: list[str] = []
        columns: dict[str, int] = {}
        units: dict[str, float] = {}
        for index, cell in enumerate(cells):
            title = cell.strip().lower()
            unit = re.fullmatch(r"([xyz])\s*[\[(]?(m|cm|mm|in)[\])]?", title)
            name = unit[1] if unit else known.get(title)
            if unit:
                units[unit[1]] = UNITS[unit[2]]
            if name in columns and title in titles:
                message = f"there are two columns {quoted(cell.strip())}"
                hint = "rename the one that is not meant"
                self.faults.add("BadValue", message, _place(at, starts, index), hint)
            elif name and (name not in columns or _rank(title) < _rank(titles[columns[name]])):
                columns[name] = index
            titles.append(title)
        self._check(columns, at)
        return Header(columns, units)

    def _check(self, columns: dict[str, int], at: Position) -> None:
        hint = f"the first line names the columns, for example {EXAMPLE}"
        if not {"level", "item"} & set(columns):
            message = "there is no column 'level' (0, 1, 2) or 'item' (1, 1.1, 1.2)"
            self.faults.add("BadLevel", message, at, hint)
        if not {"name", "mesh"} & set(columns):
            message = "there is no column 'name' or 'mesh'"
            self.faults.add("MissingPart", message, at, hint)
        self.faults.raise_if_any()


def _rank(title: str) -> int:
    """The rank of a title among the headers of its column; 0 is the likeliest."""
    return next((headers.index(title) for headers in COLUMNS.values() if title in headers), 0)


def _place(at: Position, starts: list[int], index: int) -> Position:
    start = starts[index] if index < len(starts) else len(at.text)
    return replace(at, column=start + 1)
