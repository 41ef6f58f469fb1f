"""Admits the engine's models from files that may come from anyone: MJCF as the package writes it,
and nothing else.

The engine reads any file that a model names or includes, and allocates whatever memory it asks for.
So elements and attributes that no model of a factory has are refused, counts and sizes are bounded,
and the engine reads a text that is written from the checked elements.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from factory.api import Model
from factory.support.files import MIB

LARGEST, TAGS, DEEPEST = 256 * MIB, 2_000_000, 32
"""Upper bounds on the bytes of a model's text and of its meshes, on its tags, and on how deep
elements are in each other."""

ANY = "*"
"""All attributes: none of these elements names a file or has a size."""

ELEMENTS: Mapping[str, str] = {
    "mujoco": "model",
    "compiler": "angle autolimits meshdir",
    "option": "timestep integrator cone impratio",
    "size": "memory",
    "quality": "shadowsize offsamples",
    "global": "offwidth offheight fovy azimuth elevation orthographic cameraid",
    "default": "class",
    "texture": "name type builtin mark rgb1 rgb2 markrgb width height",
    "mesh": "name class file inertia scale vertex face",
    "custom": "",
    "numeric": "name data",
    **dict.fromkeys(("visual", "asset", "worldbody", "contact", "actuator", "keyframe"), ""),
    **dict.fromkeys(("flag", "headlight", "map", "statistic", "material", "body", "inertial"), ANY),
    **dict.fromkeys(("joint", "freejoint", "geom", "site", "camera", "light"), ANY),
    **dict.fromkeys(
        ("equality", "weld", "exclude", "key", "pid", "position", "velocity", "motor"), ANY
    ),
}
"""The elements of models, each with its attributes."""

SIZES: Mapping[str, int] = {
    "shadowsize": 8192,
    "offsamples": 64,
    "offwidth": 8192,
    "offheight": 8192,
    "width": 4096,
    "height": 4096,
    "nsample": 1_000_000,
}
"""Upper bounds on numbers for which the engine or GL allocates memory."""

MOST: Mapping[str, int] = {"nsample": 10_000_000, "texture": 16, "key": 4}
"""Upper bounds on the sum of an attribute, and on the number of elements."""

MESH_NAME = re.compile(r"[^/\\]+\.(stl|obj)")
"""Names of mesh files."""

USER = 8
"""Upper bound on the numbers of a `user`: each geom gets as many as the one with the most."""

SPARE = 1024
"""Upper bound on the memory that a model asks for beyond its need [MiB]."""


def admitted(xml: str, files: Mapping[str, bytes]) -> str:
    """The checked text of a model with these mesh files. Raises ValueError for elements, attributes
    or sizes that no model of a factory has."""
    if max(len(xml), sum(map(len, files.values()))) > LARGEST or xml.count("<") > TAGS:
        raise ValueError("it is larger than any that is written")
    if "<!" in xml:
        raise ValueError("it declares a document type or entities")
    try:
        root = ElementTree.fromstring(xml)
    except ElementTree.ParseError as error:
        raise ValueError(str(error)) from error
    counts = dict.fromkeys(MOST, 0)
    for element in _elements(root):
        _check(element, files)
        counts["nsample"] += int(element.get("nsample", 0))
        if element.tag in counts:
            counts[element.tag] += 1
    for name, count in counts.items():
        if count > MOST[name]:
            raise ValueError(f"{name} comes to {count}, more than {MOST[name]}")
    _check_memory(root)
    return ElementTree.tostring(root, encoding="unicode")


def _elements(root: Element) -> Iterator[Element]:
    """All elements, each level after the one above it. Raises ValueError below DEEPEST."""
    level = [root]
    for _ in range(DEEPEST):
        yield from level
        level = [child for element in level for child in element]
    if level:
        raise ValueError(f"its elements are more than {DEEPEST} deep in each other")


def _check(element: Element, files: Mapping[str, bytes]) -> None:
    """Raises ValueError for an element that no model of a factory has."""
    allowed = ELEMENTS.get(element.tag)
    if allowed is None:
        raise ValueError(f"it has <{element.tag}>, which no model of a factory has")
    for name, value in element.attrib.items():
        if allowed != ANY and name not in allowed.split():
            raise ValueError(f"its <{element.tag}> has '{name}', as in no model of a factory")
        if name == "file" and not (value in files and MESH_NAME.fullmatch(value)):
            raise ValueError(f"its mesh '{value:.40}' is not in the log")
        if name == "meshdir" and value != "meshes":
            raise ValueError(f"its meshes are in '{value}', not in the log")
        if name in SIZES and not (value.isdecimal() and int(value) <= SIZES[name]):
            raise ValueError(f"its {name} is '{value:.40}', not a number up to {SIZES[name]}")
        if name == "user" and len(value.split()) > USER:
            raise ValueError(f"its <{element.tag}> has more than {USER} numbers of a user's")


def _check_memory(root: Element) -> None:
    """Raises ValueError where a model asks for more memory than it needs."""
    most = Model.memory_of(root) + SPARE
    for element in root.iter("size"):
        asked = element.get("memory", "0M").removesuffix("M")
        if not (asked.isdecimal() and int(asked) <= most):
            raise ValueError(f"it asks for {asked:.40} MiB, where {most} are enough")
