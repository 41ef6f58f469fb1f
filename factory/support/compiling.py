"""From MJCF to a model of the engine, in a time that is linear in its bodies."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from factory.support.engine import mujoco, unwarned
from factory.support.interruption import awaited

__all__ = ["compiled"]

MANY = 20_000
"""A model of more geoms is read in pieces."""

PIECE = 10_000
"""Elements of a piece."""

BODY = re.compile(r"^    <body .*?^    </body>\n", re.M | re.S)
"""A body of the world, with all that is in it, in a text whose levels are indented by two spaces,
as models are written here."""

SHARED = re.compile(r"^  <compiler .*?/>\n|^  <default>.*?^  </default>\n", re.M | re.S)
"""What every piece has of it, too."""


def compiled(xml: str, meshes: Mapping[str, bytes]) -> mujoco.MjModel:
    """The engine's model of an MJCF text.

    Args:
        xml: the text.
        meshes: the contents of its mesh files, by their names.

    Raises ValueError where the engine refuses it.
    """
    files = {f"meshes/{name}": content for name, content in meshes.items()}
    read = _by_pieces if xml.count("<geom") > MANY else mujoco.MjModel.from_xml_string
    return awaited(lambda: read(xml, files))


def _by_pieces(xml: str, files: Mapping[str, bytes]) -> mujoco.MjModel:
    """The same model to the last byte, read piece by piece. Each element that the engine's reader
    adds makes it list all that it has read, so that reading is quadratic in the size of a piece."""
    bodies, shared = BODY.findall(xml), "".join(SHARED.findall(xml))
    spec = mujoco.MjSpec.from_string(BODY.sub("", xml), assets=dict(files))
    with unwarned():  # that names could clash: here they are those of one model
        for some in _blocks(bodies):
            piece = f"<mujoco>{shared}<worldbody>{some}</worldbody></mujoco>"
            child = mujoco.MjSpec.from_string(piece)
            spec.attach(child, prefix="", frame=spec.worldbody.add_frame())
        return spec.compile()


def _blocks(bodies: list[str]) -> Iterator[str]:
    """Bodies with PIECE elements, or a body more, at a time; they are taken out of the list."""
    bodies.reverse()
    while bodies:
        some, size = list[str](), 0
        while bodies and size <= PIECE:
            some.append(bodies.pop())
            size += some[-1].count("<") - some[-1].count("</")
        yield "".join(some)
