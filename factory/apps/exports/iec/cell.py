"""What a controller of a factory is given: types, a function block a robot, and the program.

The program's inputs are sensors of the plant and its outputs are commands to it. The plant has the
drives, which go to their targets and stay there, the magazines and the tray: `Ready` is theirs.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from factory.api import Diagnostic, Factory, InputError, Layout, Settings, Timing
from factory.apps.exports.iec import declarations as iec
from factory.apps.exports.iec.robots import COMPLETED, RobotBlocks
from factory.apps.exports.subject import Subject

SCAN = 10
"""Default period of the task [ms]."""

LONGEST_SCAN = 1000
"""Greatest period of the task [ms]."""


def declarations(subject: Subject) -> iec.Declarations:
    """The programs of a factory's robots, scanned as often as the subject's choice says. Raises
    InputError (Usage), and where a mode cannot be entered."""
    project = subject.project
    return cell(project.layout, project.settings, subject.stem, scan_time(subject.of))


def scan_time(text: str) -> int:
    """The period of a task [ms] in a text such as `20ms`, SCAN for none. Raises InputError
    (Usage)."""
    match = re.fullmatch(r"(\d{1,9}) ?ms", text) if text else None
    scan = int(match[1]) if match else 0
    if not text:
        return SCAN
    if 1 <= scan <= LONGEST_SCAN:
        return scan
    hint = f"give whole milliseconds from 1ms to {LONGEST_SCAN}ms, such as {SCAN}ms"
    raise InputError(Diagnostic("Usage", f"--of '{text}' is no scan time", None, hint))


def stations(factory: Factory) -> dict[int, int]:
    """The number of the station where an operation (index) takes a part or drops a product off:
    the feeders' from 1 in the order of their operations, then the outfeed's."""
    feeders: dict[int, int] = {
        leaf.index: number for number, leaf in enumerate(factory.leaves, start=1)
    }
    return feeders | {dropoff.index: len(feeders) + 1 for dropoff in factory.dropoffs}


def cell(layout: Layout, settings: Settings, name: str, scan: int = SCAN) -> iec.Declarations:
    """All that is declared for a layout, of a product with a name; its task has a period `scan`
    [ms]. Raises InputError where a mode cannot be entered."""
    factory = layout.factory
    blocks = RobotBlocks(Timing(layout, settings), stations(factory))
    units = [blocks.block(robot.index) for robot in factory.robots]
    return iec.Declarations(
        f"{name}: the programs of {len(units)} robots",
        tuple(_operations(factory)),
        tuple(_types(layout)),
        (_completed(), *units, _program(layout)),
        iec.Configuration("Plant", "Controller", "Scan", scan, "Production", "FACTORY"),
    )


def _operations(factory: Factory) -> Iterator[str]:
    """A remark for each operation: its number, by which jobs and what robots carry are told."""
    for operation in factory.operations:
        names = " ".join(dict.fromkeys((operation.template.name, operation.label)))
        robots = ", ".join(factory.robots[robot].name for robot in operation.robots)
        yield f"operation {operation.index + 1}: {names}, by {robots}"


def _types(layout: Layout) -> Iterator[iec.DataType]:
    factory = layout.factory
    robots, axes = len(factory.robots), len(factory.axes)
    outfeed = max(stations(factory).values())
    yield iec.Structure(
        "CELL",
        (
            iec.Variable(
                "Carries", "UINT", "the operation that made what it brings, 0 for nothing"
            ),
            iec.Variable("Entered", "UDINT", "operations, since the start"),
            iec.Variable("Finished", "UDINT", "operations, since the start"),
        ),
        "what a robot shows to all others",
    )
    yield iec.Structure(
        "AXIS",
        (
            iec.Variable(
                "Position", "LREAL", "arc length of a carriage from A, height of a lift; m"
            ),
            iec.Variable("Speed", "LREAL", "m/s"),
            iec.Variable("Target", "LREAL", "where the drive is to go and stay; m"),
        ),
    )
    yield iec.ArrayType("CELL_LIST", robots, "CELL")
    yield iec.ArrayType("AXIS_LIST", axes, "AXIS", _order(layout))
    yield iec.ArrayType("REAL_LIST", axes, "LREAL", "of axes")
    yield iec.ArrayType("GRIP_LIST", robots, "BOOL", "of robots")
    yield iec.ArrayType("JOB_LIST", robots, "UINT", "of robots")
    feeders = ", ".join(f"{n} {leaf.label}" for n, leaf in enumerate(factory.leaves, start=1))
    yield iec.ArrayType("READY_LIST", outfeed, "BOOL", f"feeders: {feeders}; outfeed: {outfeed}")


def _order(layout: Layout) -> str:
    factory = layout.factory
    robots, more = factory.robots, factory.axes[len(factory.robots) :]
    tools = (f"[{r.index + 1}] the tool of {r.name}, an angle" for r in robots if not r.travels)
    lifts = (f"{axis.joint.joint} of {axis.robot.name}" for axis in more)
    return "; ".join((", ".join(("carriages of the robots", *tools)), *lifts))


def _completed() -> iec.OrganizationUnit:
    """The function that says how often a robot has come past an operation of its loop."""
    turns = (
        iec.Variable("Turn", "UDINT", "operations that a robot has come past"),
        iec.Variable("Place", "UDINT", "place of the operation in its loop, from 0"),
        iec.Variable("Length", "UDINT", "operations in its loop"),
    )
    body = (f"{COMPLETED} := (Turn + Length - 1 - Place) / Length;",)
    return iec.OrganizationUnit("FUNCTION", COMPLETED, (("VAR_INPUT", turns),), body, "UDINT")


def _program(layout: Layout) -> iec.OrganizationUnit:
    factory = layout.factory
    axes = len(factory.axes)
    inputs = (
        iec.Variable("Position", "REAL_LIST", "m"),
        iec.Variable("Speed", "REAL_LIST", "m/s"),
        iec.Variable("Held", "GRIP_LIST", "sensors: a grip is closed on something"),
        iec.Variable("Ready", "READY_LIST", "a feeder shows a part; the outfeed is free"),
    )
    outputs = (
        iec.Variable("Target", "REAL_LIST", "m"),
        iec.Variable("Grip", "GRIP_LIST", "close the grip"),
        iec.Variable("Job", "JOB_LIST", "operation that a robot is in, 0 for none"),
        iec.Variable("Carries", "JOB_LIST", "operation that made what a robot brings"),
    )
    robots = factory.robots
    inside = (
        iec.Variable("Cells", "CELL_LIST"),
        iec.Variable("Axes", "AXIS_LIST"),
        *(iec.Variable(robot.name, f"ROBOT_{robot.name}") for robot in robots),
        iec.Variable("Begun", "BOOL"),
        iec.Variable("Index", "INT"),
    )
    body = [
        f"FOR Index := 1 TO {axes} DO",
        "    Axes[Index].Position := Position[Index];",
        "    Axes[Index].Speed := Speed[Index];",
        "    IF NOT Begun THEN",
        "        Axes[Index].Target := Position[Index];",
        "    END_IF;",
        "END_FOR;",
        "Begun := TRUE;",
    ]
    for robot in robots:
        name, number = robot.name, robot.index + 1
        body += [
            f"{name}(Held := Held[{number}], Ready := Ready, Cells := Cells, Axes := Axes);",
            f"Grip[{number}] := {name}.Grip;",
            f"Job[{number}] := {name}.Job;",
            f"Carries[{number}] := Cells[{number}].Carries;",
        ]
    body += [
        f"FOR Index := 1 TO {axes} DO",
        "    Target[Index] := Axes[Index].Target;",
        "END_FOR;",
    ]
    sections = (("VAR_INPUT", inputs), ("VAR_OUTPUT", outputs), ("VAR", inside))
    return iec.OrganizationUnit("PROGRAM", "FACTORY", sections, tuple(body))
