"""The arms of a cell: of which kind they are, their names, and which parts each places.

`--arm six=2` says a kind and a number; the table `[arms]` of `factory.toml` says more, arm by arm.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from factory.api import Diagnostic, Factory, InputError
from factory.apps.arms.cell_arm import CellArm
from factory.apps.arms.model import KINDS, ArmModel, own_arm
from factory.support.errors import did_you_mean, usage_error

KEYS = "type", "mjcf", "tool", "speed", "acceleration", "labels"
"""What is said of an arm; all but its labels is the same for all arms of a cell."""

RAILS = "leave out --arm: rails make it"

EXAMPLE = 'left = { type = "six", labels = ["lid"] }'


def asked_arms(asked: str) -> tuple[ArmModel, tuple[CellArm, ...]]:
    """The kind and the arms of `--arm`: a kind that is shipped, or the path of an MJCF file, with
    `=2` for two of them. Raises InputError: Usage for an unknown kind, BadArm."""
    name, _, number = asked.partition("=")
    if number not in ("", "1", "2"):
        raise usage_error(f"--arm {asked}: a cell has one arm or two", f"--arm {name}=2")
    return ArmModel.of(name), (CellArm(),) * int(number or 1)


def arms_in(
    table: Mapping[str, Mapping[str, Any]], folder: Path
) -> tuple[ArmModel, tuple[CellArm, ...]]:
    """The kind and the arms of a table `[arms]`, each by its name; files are beside `folder`.
    Raises InputError: BadValue where the table is not valid, BadArm."""
    if len(table) > 2:
        raise _bad(f"[arms] has {len(table)} arms", "a cell has one arm or two")
    arms, kinds = list[CellArm](), list[dict[str, Any]]()
    for name, row in table.items():
        for key in row:
            if key not in KEYS:
                hint = did_you_mean(key, KEYS, "keys")
                raise _bad(f"[arms] {name}: there is no key '{key}'", hint)
        kinds.append({key: row[key] for key in KEYS[:-1] if key in row})
        labels = row.get("labels", [])
        if not isinstance(labels, list) or not all(isinstance(one, str) for one in labels):
            raise _bad(f"[arms] {name}: labels must be a list of texts", EXAMPLE)
        arms.append(CellArm(name, tuple(labels)))
    if kinds[1:] and kinds[0] != kinds[1]:
        raise _bad("[arms]: both arms of a cell are of one kind", "the same keys but for labels")
    return _kind(kinds[0], folder), tuple(arms)


def _kind(row: Mapping[str, Any], folder: Path) -> ArmModel:
    """The kind of arm that a row says. Raises InputError."""
    texts = {key: row[key] for key in ("type", "mjcf", "tool") if key in row}
    values = {key: row[key] for key in ("speed", "acceleration") if key in row}
    if ("type" in row) == ("mjcf" in row) or not all(isinstance(v, str) for v in texts.values()):
        hint = f"type = one of {', '.join(KINDS)}, or mjcf = the path of an MJCF file"
        raise _bad("[arms]: an arm has either a type or an mjcf, as texts", hint)
    if not all(map(_is_row, values.values())):
        raise _bad("[arms]: speed and acceleration must be lists of numbers", "speed = [2.0, 2.0]")
    if "type" in row:
        if values or "tool" in row:
            hint = "give its MJCF as mjcf, with these keys"
            raise _bad("[arms]: a type has its tool, speed and acceleration", hint)
        if row["type"] not in KINDS:
            hint = did_you_mean(row["type"], KINDS, "types")
            raise _bad(f"[arms]: there is no type '{row['type']}'", hint)
        return ArmModel.of(row["type"])
    file = folder / row["mjcf"]
    if file.suffix != ".xml" or not file.is_file():
        raise _bad(f"[arms]: there is no file '{file}'", "mjcf = the path of an MJCF file")
    return own_arm(file, row.get("tool", "tool"), values)


def _is_row(row: object) -> bool:
    return isinstance(row, list) and all(type(value) in (int, float) for value in row)


def _bad(message: str, hint: str) -> InputError:
    return InputError(Diagnostic("BadValue", message, None, hint))


def dealt(factory: Factory, kind: str, arms: Sequence[CellArm]) -> Iterator[int]:
    """The robot (index) that does the tour of each robot of a factory: carriers and tools their
    own, arms what they are said to place; of the rest the first takes all that has to do with
    sub-assemblies, which are built where it stands, others come in equal shares, by turns.

    Raises InputError (NoCell) where an arm has nothing to place, or not what it is said to place.
    """
    others = [robot.index for robot in factory.robots if robot.type != kind]
    placing = [robot for robot in factory.robots if robot.type == kind]
    order = sorted(placing, key=lambda robot: factory.postorder[robot.operations[-1]])
    ends = [[factory.operations[n] for n in robot.operations] for robot in order]
    labels = [takes.label.partition("/")[0] for takes, *_ in ends]
    first = [bool(takes.inputs or joins.carrier) for takes, *_, joins in ends]
    said = _said(arms, labels, first)
    free = [n for n, arm in enumerate(arms) if not arm.labels] or [*range(len(arms))]
    fixed = [
        0 if is_first else said.get(label) for label, is_first in zip(labels, first, strict=True)
    ]
    shares, last, turn = [fixed.count(arm) for arm in range(len(arms))], -1, dict[int, int]()
    for robot, arm in zip(order, fixed, strict=True):
        if arm is None:
            arm = min(free, key=lambda one: (shares[one], one == last))
            shares[arm] += 1
        turn[robot.index] = last = arm
    if not all(shares):
        why = "all that is placed has to do with sub-assemblies, which one arm does"
        message = f"{len(arms)} arms: {why if all(first) else 'nothing is left for one of them'}"
        raise InputError(Diagnostic("NoCell", message, None, f"one arm: --arm {kind}; {RAILS}"))
    for robot in factory.robots:
        if robot.index in turn:
            yield len(others) + turn[robot.index]
        else:
            yield others.index(robot.index)


def _said(arms: Sequence[CellArm], labels: Sequence[str], first: Sequence[bool]) -> dict[str, int]:
    """The arm that is said to place each label. Raises InputError (NoCell)."""
    said = dict[str, int]()
    bound = {label for label, is_first in zip(labels, first, strict=True) if is_first}
    for number, arm in enumerate(arms):
        for label in arm.labels:
            if label not in labels:
                hint = did_you_mean(label, labels, "parts")
                message = f"no arm places '{label}', as {arm.name or 'one'} is to"
                raise InputError(Diagnostic("NoCell", message, None, hint))
            if number and label in bound:
                message = f"{arm.name} cannot place '{label}', which has to do with a sub-assembly"
                hint = f"give it to {arms[0].name}, beside which sub-assemblies are built"
                raise InputError(Diagnostic("NoCell", message, None, hint))
            if said.setdefault(label, number) != number:
                message = f"both arms are to place '{label}'"
                raise InputError(Diagnostic("NoCell", message, None, "give it to one of them"))
    return said
