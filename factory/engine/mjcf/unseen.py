"""The model of a run that is not shown: without what is only there to be seen.

The engine places every geom of all that does not sleep in every step, seen or not. Left out are
geoms of classes that say of themselves that they weigh nothing and touch nothing, pads aside, and
bodies that have nothing else; whatever moves, moves the same to the last bit.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element

from factory.engine.mjcf.names import pad_of

SHOWN = {"contype": "0", "conaffinity": "0", "mass": "0", "group": "1"}
"""What a class of geoms that are only shown says of them."""


def leave_out_what_is_shown(root: Element) -> None:
    """Take geoms that are only shown out of an MJCF, bodies that are nothing else, and meshes that
    are of nothing else."""
    classes = {
        default.get("class")
        for default in root.iter("default")
        if any(SHOWN.items() <= geom.attrib.items() for geom in default.findall("geom"))
    }
    for world in root.findall("worldbody"):
        _leave_out(world, classes)
        used = {geom.get("mesh") for geom in world.iter("geom")}
    for asset in root.findall("asset"):
        for mesh in asset.findall("mesh"):
            if mesh.get("name") not in used:
                asset.remove(mesh)


def _leave_out(body: Element, classes: set[str | None]) -> None:
    for child in list(body):
        is_pad = bool(pad_of(child.get("name") or ""))  # from which distances are measured
        if child.tag == "body":
            _leave_out(child, classes)
            if not len(child):
                body.remove(child)
        elif child.get("class") in classes and not (SHOWN.keys() & child.keys() or is_pad):
            body.remove(child)
