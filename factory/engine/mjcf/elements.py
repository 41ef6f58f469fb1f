"""Elements that many bodies of the MJCF have."""

from __future__ import annotations

from xml.etree.ElementTree import Element

from factory.support.xml_writer import add


def add_shown(parent: Element, name: str, shape: str, **attributes: object) -> Element:
    """A geom that is only shown. Of a body that collides the engine boxes every geom
    in every step, so what is only shown of one that stands still is not in it."""
    return add(parent, "geom", name=name, class_="shown", type=shape, **attributes)


def add_station(parent: Element, name: str, **attributes: object) -> Element:
    """A box of something that stands still, and that parts collide with."""
    return add(parent, "geom", name=name, class_="station", type="box", **attributes)
