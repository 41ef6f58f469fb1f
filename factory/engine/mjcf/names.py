"""The names in a model, made and read in one place: they carry meaning, parts by `/`."""

from __future__ import annotations

from factory.theory.plant.axes import Axis
from factory.theory.plant.robot import Robot


def carriage(robot: str) -> str:
    """The body of a robot, `r3/carriage`."""
    return f"{robot}/carriage"


def joint(axis: Axis) -> str:
    """The joint of an axis, the first of several: `r3/slide`, `r3/lift`, `r3/turn`."""
    first = axis.joint.moves[0][0] if axis.joint.moves else axis.joint.joint
    return f"{axis.robot.name}/{first}"


def first_axis(robot: Robot) -> str:
    """The joint of a robot's first axis, the first of several: `r3/slide`, `r3/turn`."""
    moves = robot.body.first.moves
    return f"{robot.name}/{moves[0][0] if moves else robot.body.first.joint}"


def actuator(axis: Axis) -> str:
    """The actuator of an axis, the first of several: `r3/drive`, `r3/hoist`."""
    first = axis.joint.moves[0][1] if axis.joint.moves else axis.motion.drive
    return f"{axis.robot.name}/{first}"


def moved(axis: Axis) -> str:
    """The body that an axis moves: `r3/carriage`, `r3/head`, `r3/tool`."""
    return f"{axis.robot.name}/{axis.motion.body}"


def slide(robot: str) -> str:
    """The joint of a robot along its guidepath, `r3/slide`."""
    return f"{robot}/slide"


def drive(robot: str) -> str:
    """The actuator of a robot's first axis, `r3/drive`."""
    return f"{robot}/drive"


def slide_across(robot: str) -> str:
    """The joint of a robot across its heading, where its guidepath has bends,
    `r3/slide_across`."""
    return f"{robot}/slide_across"


def drive_across(robot: str) -> str:
    """The actuator of that joint, `r3/drive_across`."""
    return f"{robot}/drive_across"


def moved_along(robot: Robot) -> tuple[tuple[str, str], ...]:
    """The joints, and their actuators, that the first axis of a robot moves: of a chain, or where
    its guidepath has bends."""
    name, moves = robot.name, robot.body.first.moves
    if moves:
        return tuple((f"{name}/{joint}", f"{name}/{drive}") for joint, drive in moves)
    return along_bends(name)


def along_bends(robot: str) -> tuple[tuple[str, str], ...]:
    """The joints, and their actuators, of a robot whose guidepath has bends."""
    return (slide(robot), drive(robot)), (slide_across(robot), drive_across(robot))


def head(robot: str) -> str:
    """The body of a robot that its lift moves, and that holds its payload, `r3/head`."""
    return f"{robot}/head"


def tool(robot: str) -> str:
    """The body of a fixed robot that turns, and that holds its payload, `r3/tool`."""
    return f"{robot}/tool"


def jaw(robot: str, name: str) -> str:
    """The body of a robot's jaw, its joint and its actuator: `r3/left`."""
    return f"{robot}/{name}"


def jaw_face(robot: str, name: str) -> str:
    """The geom of a robot's jaw: `r3/left/jaw`."""
    return f"{robot}/{name}/jaw"


def copy(label: str, number: int) -> str:
    """The name of a part's copy, counted from 1: `part1#2`."""
    return f"{label}#{number}"


def part(label: str, number: int) -> str:
    """The body of a part's copy, `part/part1#2`."""
    return f"part/{copy(label, number)}"


def piece(body: str, number: int) -> str:
    """The geom of a part's convex piece, counted from 1: `part/part1#2/3`."""
    return f"{body}/{number}"


SHELL = "shell"
"""What the names of bodies begin with that hold one part's geoms in a fused body."""


def solid(label: str, number: int, part_inside: str) -> str:
    """The body that has the geoms of a part in a body's copy: that copy, or where the body is a
    fused one the part's shell, `shell/sub1#2/part1`."""
    if label == part_inside:
        return part(label, number)
    return f"{SHELL}/{copy(label, number)}/{part_inside}"


def grip(robot: str, label: str) -> str:
    """The weld by which a robot holds a part, `grip/r3/part1`; it is aimed at the copy it holds."""
    return f"grip/{robot}/{label}"


def feed(label: str) -> str:
    """The weld by which a feeder presents a part, `feed/part1`."""
    return f"feed/{label}"


def feeder(label: str) -> str:
    """The static body of a feeder, `feeder/part1`; its geoms are `feeder/part1/post` and so on."""
    return f"feeder/{label}"


def slider(label: str) -> str:
    """The body in a feeder's housing that brings parts down, its joint and its actuator,
    `feeder/part1/slider`."""
    return f"feeder/{label}/slider"


def pad(label: str) -> str:
    """The geom from which a feeder's part hangs, `feeder/part1/pad`."""
    return f"feeder/{label}/pad"


def bin_of(robot: str) -> str:
    """The static body of a robot's bin, `bin/r3`; its geoms are `bin/r3/bottom` and so on."""
    return f"bin/{robot}"


def hold(label: str) -> str:
    """The weld by which the outfeed's tray holds a part of a finished product, `hold/part2`; it is
    aimed at the copy it holds."""
    return f"hold/{label}"


def holder(body: str) -> str:
    """What a body that holds parts is of: `r3/head` -> `r3`; itself where it is no robot's."""
    return body.partition("/")[0] if kind(body) == "robot" else body


def pad_of(geom: str) -> str:
    """The holder whose pad a geom is, on which what it holds rests, "" for none: `r3/pad` -> `r3`,
    `feeder/part1/pad` -> `feeder/part1`; the tray's own geoms are its pads."""
    owner, _, last = geom.rpartition("/")
    if geom.startswith(OUTFEED_TRAY):
        return OUTFEED_TRAY
    return holder(owner) if last == "pad" else ""


COMPASS = "compass"
"""The body that shows the engine's broad phase where the floor's longer side is."""

OUTFEED_TRAY = "outfeed/tray"
"""The body that takes a finished product away; also the name of its geom."""

OUTFEED_SLIDE = "outfeed/slide"
"""Its joint."""

OUTFEED_DRIVE = "outfeed/drive"
"""Its actuator."""

SHUTTER = "outfeed/shutter"
"""The body that closes the outfeed's shed, its geom, its joint and its actuator."""


def exclusion(one: str, other: str, number: int) -> str:
    """The exclusion of contact between two parts of one unit, `exclude/part1/part2#1`."""
    return f"exclude/{one}/{copy(other, number)}"


def excluded(name: str) -> tuple[str, str]:
    """The two parts in the name of an exclusion."""
    one, _, other = name.partition("/")[2].partition("/")
    return one, other.rpartition("#")[0]


def park(label: str, number: int) -> str:
    """The weld that keeps a spare copy out of sight, `park/part1#3`."""
    return f"park/{copy(label, number)}"


def kind(name: str) -> str:
    """`part` for a part's body, `robot` for a robot's, else the first word of the name."""
    head = name.partition("/")[0]
    return "robot" if head[:1] == "r" and head[1:].isdigit() else head


def label_of(name: str) -> str:
    """The label in a part's body name, `part/part1#2` -> `part1`."""
    return name.partition("/")[2].rpartition("#")[0]


def part_of(body: str) -> str:
    """The part whose geoms a body has: that of `part/part1#2`, or of `shell/sub1#2/part1`."""
    return body.rpartition("/")[2] if kind(body) == SHELL else label_of(body)


def without_copy(name: str) -> str:
    """The name of a geom, the same for all copies of a part and all pieces of a copy:
    `part/part1#2/3` -> `part/part1`."""
    body, _, rest = name.partition("#")
    words = rest.split("/")[1:]
    return "/".join([body, *(word for word in words if not word.isdigit())])
