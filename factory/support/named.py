"""Objects that are known by their names, in code, tables and messages."""

from __future__ import annotations

from typing import Any, ClassVar, Self

__all__: list[str] = []


class Named(str):
    """A text that names one of a few objects, and is that object: it is written as its name, and
    found by it. A direct subclass is such a set of objects.

    Attributes:
        all: the objects of the set, by name.
    """

    __slots__ = ()
    all: ClassVar[dict[str, Any]]

    def __init_subclass__(cls) -> None:
        if Named in cls.__bases__:
            cls.all = {}

    def __new__(cls, name: str) -> Self:
        made: Self = cls.all.setdefault(name, super().__new__(cls, name))
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        return _named, (_set_of(type(self)), str(self))


def _set_of(cls: type[Named]) -> type[Named]:
    return next(base for base in cls.__mro__ if Named in base.__bases__)


def _named(of: type[Named], name: str) -> Any:
    return of.all[name]
