"""What a client of OPC UA has written into a variable, checked: anybody may write anything that the
protocol can carry."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Any

import numpy as np

from factory.apps.plc.signals import Commands

WATCHDOG = 0.5
"""All axes stand when the heartbeat has not changed for so long [s]."""

LONGEST = 60
"""Most characters of a value that are shown."""


class Unfit(ValueError):
    """A written value that is none of its variable."""


class WrittenCommands:
    """The commands that a client writes, beginning with those `kept`. `ua`: the package that serves
    OPC UA; `unfit`: why what is written now is no command, "" if it is."""

    def __init__(self, ua: Any, kept: Commands) -> None:
        self._kinds, self.kept, self.unfit = ua.ua.VariantType, kept, ""
        self._beat, self._alive = 0, -WATCHDOG

    def take(self, written: Callable[[str], Any], now: float) -> Commands:
        """The commands at a time [s], of what is `written` into a variable: the last ones where
        something does not fit, or the heartbeat has stopped, and then all axes stop."""
        try:
            beat = number_of("Heartbeat", written("Heartbeat"), self._kinds.UInt32)
            commands = self._read(written)
        except Unfit as unfit:
            self.unfit = str(unfit)
        else:
            self.unfit = ""
            if beat != self._beat:
                self._beat, self._alive = beat, now
            if now - self._alive <= WATCHDOG:
                self.kept = commands
        stop = bool(self.unfit) or now - self._alive > WATCHDOG
        return Commands(self.kept.target, self.kept.grip, self.kept.job, stop)

    def _read(self, written: Callable[[str], Any]) -> Commands:
        """What is written, as commands. Raises Unfit."""
        kinds, axes, robots = self._kinds, len(self.kept.target), len(self.kept.grip)
        target = list_of("Target", written("Target"), kinds.Double, float, axes)
        grip = list_of("Grip", written("Grip"), kinds.Boolean, bool, robots)
        job = list_of("Job", written("Job"), kinds.UInt16, int, robots)
        return Commands(np.array(target), tuple(grip), tuple(job))


def list_of(name: str, written: Any, kind: Any, of: type[float], count: int) -> list[Any]:
    """The values of an array variable, by its `name`, in what was `written`, an
    `asyncua.ua.DataValue`. Raises Unfit for anything but `count` finite values of a `kind`, an
    `asyncua.ua.VariantType`, which is the type `of` in Python."""
    asked = f"a list of {count} finite values of type {kind.name}"
    values = _value(name, written, kind, asked)
    flat = isinstance(values, list) and len(values) == count
    if not flat or not all(type(value) is of and isfinite(value) for value in values):
        raise Unfit(f"{name} is {_shown(values)}: not {asked}")
    return list(values)


def number_of(name: str, written: Any, kind: Any) -> int:
    """The same for a variable that holds one whole number."""
    asked = f"a number of type {kind.name}"
    value = _value(name, written, kind, asked)
    if type(value) is not int:
        raise Unfit(f"{name} is {_shown(value)}: not {asked}")
    return value


def _value(name: str, written: Any, kind: Any, asked: str) -> Any:
    status, variant = written.StatusCode, written.Value
    if status is not None and not status.is_good():
        raise Unfit(f"{name} was written with the status {status.name}: not {asked}")
    if variant is None or variant.Value is None:
        raise Unfit(f"{name} is null: not {asked}")
    if variant.VariantType != kind:
        other = getattr(variant.VariantType, "name", "unknown")
        raise Unfit(f"{name} is of type {other}: not {asked}")
    return variant.Value


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."
