"""The change of a what-if question: faster robots, shorter ways, second robots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from factory.plant.factory import Factory
from factory.support.errors import Diagnostic, InputError, did_you_mean, usage_error
from factory.timing.timing import Change

MOST: Mapping[str, float] = {"faster": 1e6, "shorter": 100.0}
"""The most that a robot is faster, and its ways are shorter [percent]."""


def change_of(
    factory: Factory,
    second: Sequence[str] = (),
    faster: Mapping[str, float] | None = None,
    shorter: Mapping[str, float] | None = None,
) -> tuple[str, Change] | None:
    """The change in which each robot named in `second` has one more beside it, and those of
    `faster` and `shorter` are faster or have shorter ways by so many percent, with its description;
    None without any. Raises InputError: Usage for a name that no robot has, BadValue for a
    number."""
    robots = {robot.name: robot.index for robot in factory.robots}
    for name in (*second, *(faster or {}), *(shorter or {})):
        if name not in robots:
            hint = did_you_mean(name, list(robots), "robots")
            raise usage_error(f"there is no robot '{name}'", hint)
    copies = {robots[name]: 1 + second.count(name) for name in second}
    speed, way = _shares("faster", faster), _shares("shorter", shorter)
    words = [f"{count} × {factory.robots[r].name}" for r, count in copies.items()]
    words += [f"{name} {100 * share:g} % faster" for name, share in speed.items()]
    words += [f"ways of {name} {100 * share:g} % shorter" for name, share in way.items()]
    if not words:
        return None
    change = Change(
        speed={robots[name]: 1 + share for name, share in speed.items()},
        way={robots[name]: 1 - share for name, share in way.items()},
        copies=copies,
    )
    return ", ".join(words), change


def _shares(kind: str, percents: Mapping[str, float] | None) -> dict[str, float]:
    """Percent as shares. Raises InputError (BadValue)."""
    for name, percent in (percents or {}).items():
        if not 0 < percent <= MOST[kind]:
            most, text = f"{MOST[kind]:g}", f"{name}={percent:g}"
            message = f"{kind} takes a robot and percent above 0, at most {most}, not '{text}'"
            raise InputError(Diagnostic("BadValue", message, None, f"for example {name}=20"))
    return {name: percent / 100 for name, percent in (percents or {}).items()}
