"""The approaches of the inputs of each operation, as HTML."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

import numpy as np

from factory.api import Approach, Finder, Node, Operation, Product
from factory.apps.drawing.tables import alike, differing, table
from factory.apps.report.recording import Recording

COLUMNS = ("Operation", "Inputs", "Approach", "Clearance on approach", "Excluded")

LEGEND = (
    "Clearance: the least distance between the moving and the standing parts during the approach, "
    "except in its last millimetre. Excluded: pairs of parts that overlap or touch there, and so "
    "are excluded from contact in the run."
)

NAMED = 100
"""Upper bound on the listed pairs of an operation."""


def approaches_section(recording: Recording, labels: Mapping[str, int]) -> str:
    """The section on approaches; empty for a product of default boxes, which has none."""
    operations = [o for o in recording.factory.operations if o.approach is not None]
    if not operations:
        return ""
    chosen = {o.label: _taken(recording, o) for o in operations}
    room = _rooms(recording, chosen)
    made = [_cells(o, chosen[o.label], room.get(o.label), labels) for o in operations]
    shown = [0, *(n for n in differing(made) if n > 0)]
    rows = "".join(
        f"<tr{_mark(chosen[o.label])}>{''.join(f'<td>{cells[n]}</td>' for n in shown)}</tr>"
        for o, cells in zip(operations, made, strict=True)
    )
    same, listed = alike(COLUMNS, made), table([COLUMNS[n] for n in shown], rows)
    note = f"<p class='note'>In all of them: {same}.</p>" if same else ""
    return (
        '\n<section class="panel wide approaches" aria-labelledby="h-approaches">\n'
        '<div class="bar"><h2 id="h-approaches">How parts come together</h2></div>'
        f'<div class="text"><div class="scroll">{listed}</div>{note}'
        f"<p class='note'>{LEGEND}</p></div>\n</section>"
    )


def _taken(recording: Recording, operation: Operation) -> Approach:
    """The approach of an operation, from the side chosen by its layout where there is one."""
    approach = operation.approach
    assert approach is not None
    if recording.layout is None or approach.kind == "lower" or not any(approach.overlaps):
        return approach
    return approach.on(recording.layout.side(operation))


def _rooms(recording: Recording, chosen: Mapping[str, Approach]) -> Mapping[str, float]:
    """The clearance on each approach by label; empty where the meshes are missing."""
    if recording.layout is None:
        return {}
    return rooms(Node.of_factory(recording.factory), recording.layout.product, chosen)


def _cells(
    o: Operation, approach: Approach, room: float | None, labels: Mapping[str, int]
) -> tuple[str, ...]:
    pairs = {overlap.parts for side in approach.overlaps for overlap in side}
    name, number = escape(o.label), labels.get(o.label)
    if number is not None:
        name = f'<button class="link" data-label="{number}">{name}</button>'
    joined = escape(" + ".join(o.inputs))
    return name, joined, escape(approach.told), _room(room), _left_out(pairs)


def _mark(approach: Approach) -> str:
    return ' class="bad"' if approach.kind == "blocked" else ""


def _room(room: float | None) -> str:
    """A clearance in words [mm]."""
    if room is None:
        return "–"
    if room == float("inf"):
        return f"more than {1e3 * Finder.AMPLE:g} mm"
    millimetres = round(1e3 * room, 2)
    if millimetres >= 0:
        return f"{abs(millimetres):.2f} mm"
    return f"overlap of {-millimetres:.2f} mm as drawn"


def _left_out(pairs: set[tuple[str, str]]) -> str:
    """The number of pairs, and a list."""
    if not pairs:
        return "none"
    named = [escape(f"{one} - {other}") for one, other in sorted(pairs)[:NAMED]]
    more = [f"and {len(pairs) - NAMED} more"] if len(pairs) > NAMED else []
    listed = "".join(f"<li>{words}</li>" for words in (*named, *more))
    return f"<details><summary>{len(pairs)}</summary><ul>{listed}</ul></details>"


def rooms(
    nodes: Mapping[str, Node], product: Product, chosen: Mapping[str, Approach]
) -> Mapping[str, float]:
    """The least room [m] between the inputs of each operation on the way that was chosen for it
    (from all of its `sides`), by its label: less than 0 where parts overlap, infinite where it is
    ample. But for the last millimetre: finished parts may touch."""
    finder = Finder.of(product, nodes)
    met = finder.meetings
    ways = [_way(meeting.inputs[-1], chosen.get(meeting.label)) for meeting in met.all]
    least = np.full(len(met.all), np.inf)
    for axis in range(3):
        wanted = np.array([way == axis for way, _ in ways])
        if not wanted.any():
            continue
        other, one, room = finder.rooms(axis)
        meeting = met.of(one, other)
        rows = np.flatnonzero(wanted[meeting] & (other >= met.splits[meeting]))
        sides = np.array([sides for _, sides in ways])[meeting[rows]]
        np.minimum.at(least, meeting[rows], np.where(sides, room[rows], np.inf).min(axis=1))
    labels = [meeting.label for meeting in met.all]
    return {label: float(r) for label, r in zip(labels, least, strict=True) if label in chosen}


def _way(last: str, approach: Approach | None) -> tuple[int, tuple[bool, bool]]:
    """The axis, -1 for none, and the sides from which the `last` input comes. A lowered input comes
    from above; if that is another input, the last one comes from below."""
    if approach is None:
        return -1, (False, False)
    if approach.kind == "lower":
        above = approach.lowered == last
        return Finder.UPRIGHT, (not above, above)
    return approach.axis, (-1 in approach.sides, +1 in approach.sides)
