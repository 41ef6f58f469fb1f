"""Tables as HTML, on pages and in notebooks, and as data frames."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING

from factory.support.version import optional

if TYPE_CHECKING:
    from pandas import DataFrame


class Tabular(ABC):
    """A value that is a table, and gives it as a data frame."""

    __slots__ = ()

    @abstractmethod
    def records(self) -> Sequence[Mapping[str, object]]:
        """The rows of the table: figures by their names in `--json`."""

    def to_frame(self) -> DataFrame:
        """The table as a data frame of pandas: a row for each of `records`, a column for each of
        their names, with its unit; NaN for a figure that is None. Raises MissingError without
        pandas."""
        pandas = optional("pandas", "pandas", "a data frame", "pandas")
        return pandas.DataFrame.from_records([dict(record) for record in self.records()])


def table(columns: Sequence[str], rows: str) -> str:
    """A table of these columns with these rows, which are HTML."""
    head = "".join(f"<th>{name}</th>" for name in columns)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


def titled(title: str, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table of texts and figures below its title, as a notebook shows a value."""
    lines = "".join(
        f"<tr>{''.join(f'<td>{escape(shown(cell))}</td>' for cell in row)}</tr>" for row in rows
    )
    return f"<p>{escape(title)}</p>{table([*map(escape, columns)], lines)}"


def shown(cell: object) -> str:
    """A cell: a number in four digits, nothing for None."""
    if cell is None:
        return ""
    return f"{cell:.4g}" if isinstance(cell, float) else str(cell)


def differing(rows: Sequence[Sequence[str]]) -> list[int]:
    """The columns in which rows of cells differ; all where there is one row."""
    columns = enumerate(zip(*rows, strict=True))
    return [number for number, cells in columns if len(rows) == 1 or len({*cells}) > 1]


def alike(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """What stands in the other columns, in words: `tools 3, relays none`."""
    shown = {*differing(rows)}
    return ", ".join(
        f"{name.lower()} {cell}"
        for n, (name, cell) in enumerate(zip(columns, rows[0] if rows else (), strict=False))
        if n not in shown
    )
