"""Parts as MJCF: free bodies with explicit mass and inertia, whose origin is their centre of
mass."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from xml.etree.ElementTree import Element

from factory.engine.mjcf.insets import Insets
from factory.engine.mjcf.mesh_files import inset_file, inset_name, mesh_file, piece_files
from factory.engine.mjcf.names import part, piece
from factory.engine.mjcf.names import solid as solid_name
from factory.floor.geometry.fused_bodies import FusedBodies, Inside
from factory.floor.geometry.solids import Product, Solid
from factory.floor.layout.dimensions import PAYLOAD
from factory.floor.layout.hanging import Hanging
from factory.floor.layout.layout import Layout
from factory.support.arrays import Array
from factory.support.boxes import Point2
from factory.support.rotations import upright
from factory.support.xml_writer import add, exact, numbers

PARKED = -0.6
"""Height at which the first spare copy of a part is kept, under the floor [m]."""

HIDDEN = PARKED / 2
"""A body lower than this is a spare one, out of sight [m]."""


def place_in(
    product: Product, centre: Array, middle: Point2, elevation: float = 0.0
) -> tuple[float, float, float]:
    """Where the centre of mass of a body (3,) is when the product's middle is there, z0 and
    `elevation` [m] under its lowest point."""
    x, y, _ = product.middle
    return (
        float(middle[0] + centre[0] - x),
        float(middle[1] + centre[1] - y),
        float(PAYLOAD + elevation + centre[2] - product.low[2]),
    )


def presented_at(layout: Layout, label: str) -> tuple[float, float, float]:
    """Where a part's centre of mass is in its feeder."""
    operation = layout.factory.by_label[label]
    centre = layout.product.solids[label].presented().centre
    elevation = layout.visits[operation.index, operation.carrier].elevation
    return place_in(layout.product, centre, layout.meeting(operation), elevation)


def parked_at(layout: Layout, label: str, number: int) -> tuple[float, float, float]:
    """Where a spare copy is kept: under the place where it is made, out of sight."""
    x, y = layout.meeting(layout.factory.by_label[label])
    return x, y, PARKED - 0.4 * (number - 1)


def add_parts(
    world: Element, layout: Layout, hanging: Hanging, copies: Mapping[str, int], insets: Insets
) -> None:
    """All copies of all parts; the first that hangs from each slider there, the others parked."""
    for operation in layout.factory.leaves:
        label = operation.label
        solid = layout.product.solids[label]
        home = presented_at(layout, label)
        for number in range(1, copies[label] + 1):
            shown = number == 1 and label in hanging.places
            at = home if shown else parked_at(layout, label, number)
            name = part(label, number)
            body = _add_body(world, name, at, solid.mass, solid.inertia)
            if solid.fed:
                body.set("quat", numbers(upright(solid.fed)))
            _add_geoms(body, name, solid, solid.centre, insets.of(label), shown)


def add_wholes(
    world: Element,
    layout: Layout,
    bodies: FusedBodies,
    copies: Mapping[str, int],
    insets: Insets,
    shells: Collection[Inside],
) -> None:
    """The bodies that sub-assemblies become, parked: each has the geoms of all its parts; those of
    a part that is among the `shells` are in a body of their own."""
    solids = layout.product.solids
    for label, whole in bodies.wholes.items():
        for number in range(1, copies[label] + 1):
            name = part(label, number)
            at = parked_at(layout, label, number)
            body = _add_body(world, name, at, whole.mass, whole.inertia)
            for inside in whole.parts:
                inner = body
                if (label, inside) in shells:
                    inner = add(body, "body", name=solid_name(label, number, inside))
                    add(inner, "inertial", pos="0 0 0", mass=0, diaginertia="0 0 0")
                solid, faces = solids[inside], insets.of(inside)
                _add_geoms(inner, f"{name}/{inside}", solid, whole.centre, faces, False)


def _add_body(
    world: Element, name: str, at: tuple[float, float, float], mass: float, inertia: Array
) -> Element:
    """A free body whose origin is its centre of mass."""
    body = add(world, "body", name=name, pos=at)
    add(body, "freejoint", name=name)
    i = inertia
    add(
        body,
        "inertial",
        pos="0 0 0",
        mass=exact([mass]),
        fullinertia=exact([i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]),
    )
    return body


def _add_geoms(
    body: Element,
    name: str,
    solid: Solid,
    centre: Array,
    faces: Mapping[int, float],
    collides: bool,
) -> None:
    """A part's geoms in a body with that centre of mass. What is drawn of a part of several pieces,
    or of one whose faces recede by `faces` [m], has class `shown`, thus no contacts; its pieces,
    group 3, are not drawn. A part collides with all its geoms but those: contact masks are written
    to these."""
    masks = {} if collides else {"contype": 0, "conaffinity": 0}
    place = {"pos": numbers(solid.position - centre), "quat": numbers(solid.quaternion)}
    pieces = len(solid.mesh.pieces) if solid.mesh else 0
    pieces = pieces or bool(faces)
    add(
        body,
        "geom",
        name=name,
        class_="shown" if pieces else "part",
        type=solid.kind,
        mesh=f"mesh/{solid.mesh.name}" if solid.mesh else None,
        size=None if solid.mesh else solid.size,
        **place,
        rgba=solid.rgba,
        **({} if pieces else masks),
    )
    for n in range(pieces):
        depth = faces.get(n, 0.0)
        add(
            body,
            "geom",
            name=piece(name, n + 1),
            class_="part",
            type=solid.kind,
            mesh=f"mesh/{inset_name(solid.mesh, n, depth)}" if solid.mesh else None,
            size=None if solid.mesh else tuple(half - depth for half in solid.size),
            group=3,
            user=depth or None,
            **place,
            **masks,
        )


def add_meshes(asset: Element, product: Product, insets: Insets) -> dict[str, bytes]:
    """The meshes and their pieces as assets, and the content of their files by name."""
    files: dict[str, bytes] = {}
    receded: dict[str, set[tuple[int, float]]] = {}
    for label, solid in product.solids.items():
        if solid.mesh is not None:
            receded.setdefault(solid.mesh.name, set()).update(insets.of(label).items())
    meshes = {s.mesh.name: s.mesh for s in product.solids.values() if s.mesh is not None}
    for mesh in meshes.values():
        written = [mesh_file(mesh), *piece_files(mesh)]
        written += (inset_file(mesh, *at) for at in sorted(receded[mesh.name]))
        for file, content in written:
            name = file.rpartition(".")[0]
            add(asset, "mesh", name=f"mesh/{name}", file=file, inertia="convex")
            files[file] = content
    return files
