"""The drawn model: that of a run, in which what it is made of is seen.

What collides keeps its place and is drawn no more; in its stead there are skins without mass or
contact. Bodies, joints and constraints have the same numbers, so the positions of a run are those
of its drawn model, which nothing ever steps. An old log is drawn as a new one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import atan2, radians
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.replica import SHOWN, Geoms
from factory.film import housings, outfits
from factory.film.look import CLASSIC_FLOOR, PART, FloorPaint, Surface, paint
from factory.film.outfits import Half, Layer, Outfit
from factory.film.skins import Skin
from factory.support.arrays import Array
from factory.support.engine import mujoco
from factory.support.xml_writer import add, numbers

LEAST = 4e-4
"""Half the side of the thinnest box that is dressed [m]."""

LEAST_CUP = 2e-3
"""Radius of the smallest suction cup that has bellows [m]."""

SHED = ("roof", "back", "wall1", "wall-1")
MAGAZINE = ("lid", "end-1", "end1", "wall-1", "wall1")
"""The solids of a housing that are drawn as one."""

NARROWEST = 0.02
"""Width of the narrowest belt that has rails [m]."""

BESIDE = 6.5e-3
"""How far the rails beside a belt stand out of it [m]."""


@dataclass(frozen=True, slots=True)
class DressedGeom:
    """A geom of the run's model: its place in its body, its half sides, and its material."""

    name: str
    element: Element
    shape: int
    at: Array
    quat: Array
    half: Half
    material: str

    @property
    def last(self) -> str:
        """The last word of its name: what it is of its body."""
        return self.name.rpartition("/")[2]


def dressed(xml: str, m: mujoco.MjModel, facing: float, floor: FloorPaint = CLASSIC_FLOOR) -> str:
    """The MJCF of the drawn model of a run's model `m`, whose MJCF this is; it has the same mesh
    files. What is written on it can be read from an azimuth `facing` [degrees]."""
    root = ElementTree.fromstring(xml)
    paint(root, floor)
    Dress(root, m, radians(facing)).put_on()
    return ElementTree.tostring(root, encoding="unicode")


class Dress:
    """Puts outfits on the bodies of a model; skins of one make are one mesh."""

    def __init__(self, root: Element, m: mujoco.MjModel, facing: float) -> None:
        self.root, self.m, self.facing = root, m, facing
        self.asset = next(root.iter("asset"))
        self.product = root.get("model") or ""
        self.meshes: dict[Skin, str] = {}
        self.paints: dict[Surface, str] = {}

    def put_on(self) -> None:
        """Dress all bodies."""
        for world in self.root.iter("worldbody"):
            for body in [world, *world.iter("body")]:
                self._dress(body)

    def _dress(self, body: Element) -> None:
        name = body.get("name") or ""
        if name in (names.COMPASS, "ground"):  # far away, or far too large: they blow up shadows
            for geom in body.findall("geom"):
                body.remove(geom)
            add(body, "inertial", pos="0 0 0", mass=1, diaginertia="1 1 1")
            return
        solids = {s.name.removeprefix(f"{name}/"): s for s in self._solids(body)}
        if name == "outfeed":
            self._outfeed(body, solids)
        elif "lid" in solids:
            walls = [solids.pop(part) for part in MAGAZINE]
            label = name.partition("/")[2]
            self._enclose(body, f"{name}/housing", walls, housings.magazine, label)
        for solid in solids.values():
            self._wear(body, solid, names.kind(name))

    def _solids(self, body: Element) -> Iterator[DressedGeom]:
        """The geoms of a body that are drawn, but for planes."""
        for element in body.findall("geom"):
            name = element.get("name") or ""
            number = mujoco.mj_name2id(self.m, mujoco.mjtObj.mjOBJ_GEOM.value, name)
            if number < 0 or self.m.geom_group[number] >= SHOWN:
                continue
            geom = self.m.geom(number)
            shape, material = int(geom.type[0]), int(geom.matid[0])
            if shape != mujoco.mjtGeom.mjGEOM_PLANE:
                of = self.m.material(material).name if material >= 0 else ""
                x, y, z = geom.size.tolist()
                yield DressedGeom(name, element, shape, geom.pos, geom.quat, (x, y, z), of)

    def _wear(self, body: Element, solid: DressedGeom, kind: str) -> None:
        """Draw a solid in its outfit, if it has one."""
        is_part = kind in ("part", names.SHELL)
        material = self._colour(solid) if is_part or not solid.material else solid.material
        outfit = self._part(solid) if is_part else self._machine(body, solid)
        if outfit is None:
            solid.element.set("material", material)
            solid.element.attrib.pop("rgba", None)
            return
        _hide(solid.element)
        for layer in outfit:
            self._add(body, solid.name, replace(layer, material=layer.material or material), solid)

    def _part(self, solid: DressedGeom) -> Outfit | None:
        """The outfit of a part's geom."""
        made = {mujoco.mjtGeom.mjGEOM_BOX: outfits.part_block}
        made[mujoco.mjtGeom.mjGEOM_CYLINDER] = outfits.part_disc
        make = made.get(mujoco.mjtGeom(solid.shape))
        return make(solid.half) if make else None

    def _machine(self, body: Element, solid: DressedGeom) -> Outfit | None:
        """The outfit of a geom of a machine: by its name, else that of its shape."""
        if solid.shape == mujoco.mjtGeom.mjGEOM_CYLINDER:
            soft = solid.last == "pad" and solid.half[0] >= LEAST_CUP
            return outfits.cup(solid.half) if soft and self._is_rubber(solid) else None
        if solid.shape == mujoco.mjtGeom.mjGEOM_MESH:
            return () if solid.last == "number" else None
        if solid.shape != mujoco.mjtGeom.mjGEOM_BOX:
            return None
        if solid.last == "carriage":
            robot = solid.name.partition("/")[0]
            return outfits.carriage(solid.half, robot, self._seen(body))
        by_name: dict[str, Callable[[Half], Outfit]] = {
            "rail": outfits.rail,
            "post": outfits.post,
            "shutter": housings.door,
            "stripe": _nothing,
            "cap": _nothing,
        }
        kind = "rail" if "/rail/" in solid.name else solid.last
        if kind not in by_name and min(solid.half) < LEAST:
            return None
        return by_name.get(kind, outfits.block)(solid.half)

    def _is_rubber(self, solid: DressedGeom) -> bool:
        return solid.material.endswith("rubber") or float(self._rgba(solid)[:3].max()) < 0.3

    def _rgba(self, solid: DressedGeom) -> Array:
        return Geoms(self.m).colour(self.m.geom(solid.name).id)

    def _colour(self, solid: DressedGeom) -> str:
        """The material of a part: one for each colour."""
        red, green, blue, opacity = self._rgba(solid).round(4).tolist()
        surface = replace(PART, colour=(red, green, blue), opacity=opacity)
        if surface not in self.paints:
            self.paints[surface] = f"part/{len(self.paints) + 1}"
            surface.coat(add(self.asset, "material", name=self.paints[surface]))
        return self.paints[surface]

    def _seen(self, body: Element) -> float:
        """The azimuth of the camera in a body's frame [rad], to a hundredth."""
        w, _, _, z = self.m.body(body.get("name") or "").quat.tolist()
        return round(self.facing - 2 * atan2(z, w), 2)

    def _enclose(
        self,
        body: Element,
        name: str,
        walls: list[DressedGeom],
        make: Callable[[Half, str, float], Outfit],
        label: str,
    ) -> None:
        """Draw walls as one housing."""
        low = np.min([wall.at - wall.half for wall in walls], axis=0)
        high = np.max([wall.at + wall.half for wall in walls], axis=0)
        x, y, z = ((high - low) / 2).round(7).tolist()
        for wall in walls:
            _hide(wall.element)
        at = replace(walls[0], at=(low + high) / 2, quat=np.array([1.0, 0.0, 0.0, 0.0]))
        for layer in make((x, y, z), label, self._seen(body)):
            self._add(body, name, layer, at)

    def _outfeed(self, body: Element, solids: dict[str, DressedGeom]) -> None:
        """The shed, and the conveyor of a belt between two rails that leads into it."""
        belts = [solid for name, solid in solids.items() if name.startswith("belt")]
        low = np.min([belt.at - belt.half for belt in belts], axis=0)
        high = np.max([belt.at + belt.half for belt in belts], axis=0)
        if "wall1" not in solids or high[1] - low[1] < NARROWEST:
            return
        walls = [solids.pop(part) for part in SHED]
        mouth = float(walls[-1].at[0] - walls[-1].half[0])
        self._enclose(body, "outfeed/housing", walls, housings.shed, self.product)
        half = (mouth - float(low[0])) / 2, 3e-3, belts[0].half[2]
        bar = outfits.block(half)[0].skin
        sides = bar.moved(y=low[1] - BESIDE + 3e-3) + bar.moved(y=high[1] + BESIDE - 3e-3)
        at = replace(belts[0], at=np.array([(mouth + low[0]) / 2, 0.0, high[2] - half[2]]))
        self._add(body, "outfeed/sides", Layer("skin", sides, "frame"), at)

    def _add(self, body: Element, name: str, layer: Layer, at: DressedGeom) -> None:
        """A skin as a geom of a body, in the frame of a solid."""
        if layer.skin not in self.meshes:
            self.meshes[layer.skin] = f"skin/{len(self.meshes) + 1}"
            skin = layer.skin
            places, ways = (
                " ".join(f"{v:.5g}" for v in values.ravel().tolist())
                for values in (skin.at, skin.normal)
            )
            made = {"vertex": places, "normal": ways, "face": numbers(skin.face.ravel().tolist())}
            add(self.asset, "mesh", name=self.meshes[skin], inertia="shell", **made)
        add(
            body,
            "geom",
            name=f"{name}/{layer.what}",
            type="mesh",
            mesh=self.meshes[layer.skin],
            pos=tuple(at.at.tolist()),
            quat=tuple(at.quat.tolist()),
            material=layer.material or None,
            contype=0,
            conaffinity=0,
            mass=0,
            group=1,
        )


def _nothing(_: Half) -> Outfit:
    return ()


def _hide(geom: Element) -> None:
    geom.set("group", str(SHOWN))
