"""Parts as MJCF: free bodies with explicit mass and inertia, whose origin is their centre of
mass."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree.ElementTree import Element

from factory.geometry import Mesh, Product, Solid
from factory.layout.dimensions import PAYLOAD
from factory.layout.plan import Layout, Point2
from factory.mjcf.elements import add, exact, numbers
from factory.mjcf.mesh_files import mesh_file, piece_files
from factory.mjcf.names import part, piece

PARKED = -0.6
"""Height at which the first spare copy of a part is kept, under the floor [m]."""


def place_in(
    product: Product, label: str, middle: Point2, elevation: float = 0.0
) -> tuple[float, float, float]:
    """Where a part's centre of mass is when the product's middle is there, z0 and `elevation` [m]
    under its lowest point."""
    centre = product.solids[label].centre
    x, y, _ = product.middle
    return (
        float(middle[0] + centre[0] - x),
        float(middle[1] + centre[1] - y),
        float(PAYLOAD + elevation + centre[2] - product.low[2]),
    )


def feeder_middle(layout: Layout, label: str) -> Point2:
    """The product's middle for a robot at the feeder of a part."""
    operation = layout.factory.by_label[label]
    path = layout.guidepaths[operation.carrier]
    return path.middle(layout.goal(operation.index, operation.template.carrier - 1))


def presented_at(layout: Layout, label: str) -> tuple[float, float, float]:
    """Where a part's centre of mass is in its feeder."""
    carrier = layout.factory.by_label[label].carrier
    middle = feeder_middle(layout, label)
    return place_in(layout.product, label, middle, layout.elevations[carrier])


def parked_at(layout: Layout, label: str, number: int) -> tuple[float, float, float]:
    """Where a spare copy is kept: under its feeder, out of sight."""
    x, y = feeder_middle(layout, label)
    return x, y, PARKED - 0.4 * (number - 1)


def add_parts(world: Element, layout: Layout, copies: Mapping[str, int]) -> None:
    """All copies of all parts; the first of each in its feeder, the others parked."""
    for operation in layout.factory.leaves:
        label = operation.label
        solid = layout.product.solids[label]
        home = presented_at(layout, label)
        for number in range(1, copies[label] + 1):
            at = home if number == 1 else parked_at(layout, label, number)
            _add_part(world, solid, number, at)


def _add_part(world: Element, solid: Solid, number: int, at: tuple[float, float, float]) -> None:
    name = part(solid.label, number)
    body = add(world, "body", name=name, pos=at)
    add(body, "freejoint", name=name)
    i = solid.inertia
    add(
        body,
        "inertial",
        pos="0 0 0",
        mass=exact([solid.mass]),
        fullinertia=exact([i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]),
    )
    collides = {} if number == 1 else {"contype": 0, "conaffinity": 0}
    place = {
        "pos": numbers(solid.position - solid.centre),
        "quat": numbers(solid.quaternion),
    }
    pieces = solid.mesh.pieces if solid.mesh else ()
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
        **({} if pieces else collides),
    )
    # What is drawn of a part of several pieces has class `shown`, thus no contacts; its pieces,
    # group 3, are not drawn. Of a part's body the only geom collides, or those of group 3: contact
    # masks are written to these.
    for n in range(1, len(pieces) + 1):
        add(
            body,
            "geom",
            name=piece(name, n),
            class_="part",
            type="mesh",
            mesh=f"mesh/{solid.mesh.name}.{n}" if solid.mesh else None,
            group=3,
            **place,
            **collides,
        )


def add_meshes(asset: Element, product: Product) -> dict[str, bytes]:
    """The meshes and their pieces as assets, and the content of their files by name."""
    files: dict[str, bytes] = {}
    for mesh in used_meshes(product):
        for file, content in (mesh_file(mesh), *piece_files(mesh)):
            name = file.rpartition(".")[0]
            add(asset, "mesh", name=f"mesh/{name}", file=file, inertia="convex")
            files[file] = content
    return files


def used_meshes(product: Product) -> list[Mesh]:
    """Each mesh once, in the order in which the parts use them."""
    found = {s.mesh.name: s.mesh for s in product.solids.values() if s.mesh is not None}
    return list(found.values())
