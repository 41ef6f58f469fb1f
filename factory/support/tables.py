"""Values as tables: frozen dataclasses to JSON values and back, by the types of their fields.

A field that has its default is left out of a table. Numbers keep their last bit. Tables are not
trusted: each value must have the type of its place, or is refused with that place.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import cache
from reprlib import repr as shortened
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from factory.support.errors import InputError, did_you_mean
from factory.support.named import Named

__all__ = ["LARGE", "MISFITS", "misfit", "table_of", "value_of"]

T = TypeVar("T")

MISFITS = (
    *(ArithmeticError, AssertionError, AttributeError, LookupError),
    *(RecursionError, TypeError, ValueError),
)
"""What is raised where values of a table have the right types and do not fit each other."""


def misfit(error: BaseException) -> str:
    """The reason why values do not fit each other, without the words of Python's own errors.

    Args:
        error: what was raised when they were put together.
    """
    if type(error) is KeyError:
        return f"it has no {error}"
    return str(error) if type(error) is ValueError else "its values do not fit each other"


LARGE = 10**9
"""Upper bound on every length [m] and time [s] in a table."""

WORDS = {bool: "true or false", str: "a text", NoneType: "null"} | {
    int: "a whole number within ±2^63",
    float: f"a number within ±{LARGE:g}",
}
"""Values of simple types in words."""

SIMPLE = frozenset(WORDS)
"""The simple types."""


def table_of(value: Any) -> Any:
    """The JSON value of a value: a table for a dataclass, with the fields that differ from their
    defaults, or for a mapping; a list for a tuple or a set.

    Args:
        value: a dataclass, mapping, tuple, set, text or number.
    """
    kind: Any = type(value)
    if kind in SIMPLE:
        return value
    if held := fields_of(kind):
        pairs = [(field, getattr(value, field.name)) for field in held]
        return {f.name: table_of(v) for f, v in pairs if not _is_default(f, v)}
    if isinstance(value, Mapping):
        return {key: table_of(item) for key, item in value.items()}
    if isinstance(value, frozenset):
        return sorted(value)
    return [*map(table_of, value)] if isinstance(value, tuple) else value


@cache
def fields_of(kind: Any) -> tuple[Field[Any], ...]:
    """The fields of a dataclass; none of another type."""
    return fields(kind) if is_dataclass(kind) else ()


def value_of(kind: type[T], table: Any, place: str = "") -> T:
    """The value of a type that a table holds: the inverse of `table_of`.

    Args:
        kind: the type.
        table: the JSON value.
        place: its place within a document, for messages.

    Raises ValueError, which names the place, and says what was found and what would have been
    valid.
    """
    made: T = _value(kind, table, place)
    return made


def _value(kind: Any, table: Any, place: str) -> Any:
    kind = getattr(kind, "__supertype__", kind)
    origin, kinds = get_origin(kind), get_args(kind)
    if is_dataclass(kind):
        return _record(kind, table, place)
    if origin in (Union, UnionType):
        return _one_of(kinds, table, place)
    if origin is Literal:
        if any(type(table) is type(word) and table == word for word in kinds):
            return table
        raise _wrong(place, f"one of {', '.join(map(str, kinds))}", table)
    if isinstance(kind, type) and issubclass(kind, Named):
        if table in kind.all:
            return kind.all[table]
        raise _wrong(place, f"one of {', '.join(kind.all)}", table)
    if origin is tuple:
        return _tuple(kinds, table, place)
    if origin is frozenset:
        return frozenset(_tuple((kinds[0], Ellipsis), table, place))
    if origin is Mapping:
        if not isinstance(table, dict):
            raise _wrong(place, "a table", table)
        return {key: _value(kinds[1], item, f"{place}.{key}") for key, item in table.items()}
    if kind is Any:
        return table
    number = type(table) in (int, float)
    if kind is float and number and abs(table) <= LARGE:
        return float(table)
    if kind is float or type(table) is not kind or (number and abs(table) >= 2**63):
        raise _wrong(place, WORDS[kind], table)
    return table


def _record(kind: Any, table: Any, place: str) -> Any:
    """A dataclass; an error of its own gets the place."""
    if not isinstance(table, dict):
        raise _wrong(place, "a table", table)
    valid = {field.name: field for field in fields(kind)}
    for name in table:
        if name not in valid:
            hint = did_you_mean(str(name), [*valid], "keys")
            raise ValueError(f"{_named(place)} has no key {shortened(name)}: {hint}")
    for name, field in valid.items():
        if name not in table and field.default is field.default_factory is MISSING:
            raise ValueError(f"{_named(place)} lacks the key '{name}'")
    kinds, start = _types(kind), f"{place}." if place else ""
    values = {name: _value(kinds[name], table[name], start + name) for name in table}
    try:
        return kind(**values)
    except ValueError as error:
        raise ValueError(f"{_named(place)}: {error}") from error
    except InputError as error:
        raise ValueError(f"{_named(place)}: {error.diagnostics[0].message}") from error


def _one_of(kinds: tuple[Any, ...], table: Any, place: str) -> Any:
    """A value of a union: None if that is valid, else of the first type that fits."""
    others = [kind for kind in kinds if kind is not NoneType]
    if table is None and len(others) < len(kinds):
        return None
    for kind in others[:-1]:
        try:
            return _value(kind, table, place)
        except ValueError:
            continue
    return _value(others[-1], table, place)


def _tuple(kinds: tuple[Any, ...], table: Any, place: str) -> Any:
    if not isinstance(table, list):
        raise _wrong(place, "a list", table)
    if kinds[-1] is Ellipsis:
        kinds = kinds[:1] * len(table)
    if len(table) != len(kinds):
        raise _wrong(place, f"a list of {len(kinds)}", table)
    pairs = enumerate(zip(kinds, table, strict=True))
    return tuple(_value(kind, item, f"{place}[{n}]") for n, (kind, item) in pairs)


def _is_default(field: Field[Any], value: Any) -> bool:
    if field.default_factory is not MISSING:
        return bool(value == field.default_factory())
    return field.default is not MISSING and bool(value == field.default)


@cache
def _types(kind: Any) -> dict[str, Any]:
    return get_type_hints(kind)


def _named(place: str) -> str:
    return f"'{place}'" if place else "the table"


def _wrong(place: str, wanted: str, table: Any) -> ValueError:
    return ValueError(f"{_named(place)} must be {wanted}, not {shortened(table)}")
