"""Hands as MJCF: the file of a kind of hand, its geoms stretched to the limbs of a robot."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import deepcopy
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from factory.floor.layout.hands.limbs import Limb
from factory.support.errors import Diagnostic, InputError, Position
from factory.support.resources import mjcf_folder
from factory.support.xml_writer import numbers

Styles = Mapping[str, Element]
"""What each limb of a kind of hand looks like, by its name without number."""


def load_hand(kind: str) -> Styles:
    """The geoms of a kind of hand, or of a tip, by name. Raises InputError (BadTemplate) where its
    file is no MJCF of one body with geoms."""
    path = mjcf_folder() / "hands" / f"{kind}.xml"
    try:
        geoms = ElementTree.parse(path).getroot().findall("worldbody/body")[0].findall("geom")
        return {geom.attrib["name"]: geom for geom in geoms}
    except (OSError, ElementTree.ParseError, IndexError, KeyError) as error:
        message = f"the file of hands {kind} is unusable: {error or 'it has no body'}"
        hint = "it needs one body with a geom for each limb, like the shipped one"
        raise InputError(
            Diagnostic("BadTemplate", message, Position(str(path), 1, 1), hint)
        ) from error


def add_hand(
    body: Element, head: Element | None, styles: Styles, robot: str, limbs: Iterable[Limb], of: str
) -> None:
    """The limbs of a robot's hand, as geoms of its carriage's body, or of its lift's `head`.
    Classes and materials are those of the robot type `of`."""
    for limb in limbs:
        geom = deepcopy(styles[limb.name.rpartition("/")[2]])
        geom.set("name", f"{robot}/{limb.name}")
        for key in ("class", "material"):
            if key in geom.attrib:
                geom.set(key, f"{of}/{geom.get(key)}")
        middle = [(a + b) / 2 for a, b in zip(limb.low, limb.high, strict=True)]
        half = [(b - a) / 2 for a, b in zip(limb.low, limb.high, strict=True)]
        if limb.round == "z":
            size = [half[0], half[2]]
        elif limb.round == "x":
            size = [half[2], half[0]]
            geom.set("zaxis", "1 0 0")
        else:
            size = half
        geom.set("type", "cylinder" if limb.round else "box")
        geom.set("size", numbers(size))
        geom.set("pos", numbers(middle))
        geom.set("mass", "0")
        (head if limb.lifted and head is not None else body).append(geom)
