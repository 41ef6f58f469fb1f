"""Links: the elements that are highlighted with each robot, label, transition and place."""

from __future__ import annotations

from typing import Any

from factory.plant.factory import Factory, Operation

Link = dict[str, list[int]]
"""Numbers of `robots`, `labels`, `transitions`, `places` and `operations`; `solids` are the labels
whose bodies are meant."""


def labels_of(factory: Factory) -> dict[str, int]:
    """The number of each label: parts first, each sub-assembly after its inputs."""
    return {node.label: number for number, node in enumerate(factory.pag.postorder())}


def about(labels: dict[str, int], label: str) -> str:
    """The label of the PAG that a label of the net belongs to: itself, or, for a stage such as
    `shelf/2`, or a further unit of a period, `shelf@3`, `shelf`; "" for none."""
    first = label.rpartition("@")[0]
    named = (label, label.partition("/")[0], first, first.partition("/")[0])
    return next((name for name in named if name in labels), "")


def links(factory: Factory) -> dict[str, list[Link]]:
    """The links of every robot, label, transition and place, in the order of their numbers."""
    labels = labels_of(factory)
    operations = factory.operations
    return {
        "robot": [_of_robot(factory, labels, r.index) for r in factory.robots],
        "label": [_of_label(factory, labels, label) for label in labels],
        "transition": [
            {**_of_operation(factory, labels, operations[t // 2]), "transitions": [t]}
            for t in range(2 * len(operations))
        ],
        "place": [_of_place(factory, labels, p) for p in range(len(factory.net.threaded.places))],
    }


def _of_robot(factory: Factory, labels: dict[str, int], robot: int) -> Link:
    gear = factory.net.gears[robot]
    owned = factory.robots[robot].operations
    made = [about(labels, factory.operations[o].label) for o in owned]
    return {
        "robots": [robot],
        "labels": sorted({labels[label] for label in made if label}),
        "transitions": sorted({t for t in gear.transitions if t >= 0}),
        "places": sorted(set(gear.places)),
        "operations": sorted(set(owned)),
        "solids": [],
    }


def _of_operation(factory: Factory, labels: dict[str, int], operation: Operation) -> Link:
    made = about(labels, factory.result(operation)) or factory.pag.root
    return {
        "robots": sorted(set(operation.robots)),
        "labels": [labels[made]],
        "transitions": [operation.start, operation.end],
        "places": [operation.place],
        "operations": [operation.index],
        "solids": _solids(factory, labels, made),
    }


def _of_label(factory: Factory, labels: dict[str, int], label: str) -> Link:
    places = factory.net.threaded.places
    links = [
        _of_operation(factory, labels, operation)
        for operation in factory.operations
        if about(labels, operation.label) == label
    ]
    return {
        **{key: sorted({n for link in links for n in link[key]}) for key in links[0]},
        "places": [p for p, place in enumerate(places) if about(labels, place.label) == label],
    }


def _of_place(factory: Factory, labels: dict[str, int], place: int) -> Link:
    if place < len(factory.operations):
        link = _of_operation(factory, labels, factory.operations[place])
        return {**link, "transitions": [], "places": [place]}
    label = about(labels, factory.net.threaded.places[place].label)
    return {
        "robots": [r for r, gear in enumerate(factory.net.gears) if place in gear.places],
        "labels": [labels[label]] if label else [],
        "transitions": [],
        "places": [place],
        "operations": [],
        "solids": _solids(factory, labels, label) if label else [],
    }


def _solids(factory: Factory, labels: dict[str, int], label: str) -> list[int]:
    """The labels of the bodies in a sub-assembly: its own, and those of all its inputs."""
    solids, stack = [], [label]
    while stack:
        name = stack.pop()
        solids.append(labels[name])
        stack += factory.pag[name].inputs
    return sorted(solids)


def words_of(operation: Operation) -> str:
    """The name of an operation on the page: `mate sub1`, `dropoff`."""
    name, label = operation.template.name, operation.label
    return name if name == label else f"{name} {label}"


def data(factory: Factory) -> dict[str, Any]:
    """The names of everything by number, for the page."""
    labels, net = labels_of(factory), factory.net.threaded
    return {
        "robots": [robot.name for robot in factory.robots],
        "labels": list(labels),
        "transitions": [t.name for t in net.transitions],
        "places": [f"{p.mode} {p.label}".strip() or p.name for p in net.places],
        "operations": [
            {"name": words_of(o), "label": o.label, "robots": list(o.robots)}
            for o in factory.operations
        ],
        "left": [list(p.left) for p in net.places],
        "right": [list(p.right) for p in net.places],
        "links": links(factory),
    }
