"""The model of a run: a layout as one XML with its mesh files. What is written of it for others
follows from it (`stock.py`).

Guarantees: every weld that a run can switch is there, with its nominal frame compiled from nest and
product pose; robots come before parts; nothing depends on hashing, so the same factory gives the
same bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import ceil
from pathlib import Path
from types import MappingProxyType
from typing import ClassVar, TypeAlias
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from factory.engine.mjcf import names
from factory.engine.mjcf.bins import add_bins
from factory.engine.mjcf.driving import (
    GRAVITY,
    HOIST_STIFFNESS,
    drive_for,
    driven_axes,
)
from factory.engine.mjcf.feeders import SLIDER_MASS, add_feeders
from factory.engine.mjcf.insets import Insets, insets_of
from factory.engine.mjcf.jaws import add_jaws
from factory.engine.mjcf.outfeed import SHUTTER_MASS, TRAY_MASS, add_outfeed
from factory.engine.mjcf.parts import HIDDEN, add_meshes, add_parts, add_wholes
from factory.engine.mjcf.reservations import reservations_of
from factory.engine.mjcf.robot_bodies import add_robots
from factory.engine.mjcf.robots import MOTOR, Drive, add_paints
from factory.engine.mjcf.scene import add_scene
from factory.engine.mjcf.unseen import leave_out_what_is_shown
from factory.engine.mjcf.welds import add_exclusions, add_welds
from factory.floor.geometry.fused_bodies import FusedBodies, Inside, bodies_of
from factory.floor.layout.bins import Bin
from factory.floor.layout.feeding import outlets_of
from factory.floor.layout.hanging import Hanging
from factory.floor.layout.layout import Layout
from factory.support.errors import Diagnostic
from factory.support.settings import Settings
from factory.support.xml_writer import fill
from factory.theory.control.profile import SpeedProfile
from factory.theory.plant.approaches import Pair
from factory.theory.plant.factory import Factory
from factory.theory.problem.robot_types import Catalogue

SKELETON = Path(__file__).with_name("skeleton.xml")
"""What every model has, whatever the factory."""

MOST_BODIES = 8000
"""A pool of parts has at most so many bodies, unless told how many units may be inside: the engine
takes minutes to compile more."""

ARENA = 64
"""The engine's memory for contacts and constraints [MiB], without that for pairs of bodies."""


@dataclass(frozen=True)
class Model:
    """A factory as MJCF: the XML, its files, and the numbers that a run needs.

    Attributes:
        layout: the layout.
        settings: the settings.
        carried: the bodies that robots carry.
        copies: number of copies of each.
        masses: of each label carried [kg].
        drives: of each axis.
        insets: what is taken off the shapes that collide, and the pairs of parts without contact.
        xml: the text.
        files: meshes by name.
        joints: number of joints.
        welds: number of welds that a run can switch.
        wip: the most units inside at once that the copies are enough for; None where more never
            are.
        apart: pairs of parts without contact, each part with a body that may bring it to the other.
        bins: bins for scrap.
        overlaps: diagnostics of parts that overlap in the finished product.
    """

    HIDDEN: ClassVar[float] = HIDDEN
    SKELETON: ClassVar[Path] = SKELETON

    layout: Layout
    settings: Settings
    carried: FusedBodies = field(repr=False)
    copies: Mapping[str, int]
    masses: Mapping[str, float]
    drives: tuple[Drive, ...]
    insets: Insets = field(repr=False)
    xml: str = field(repr=False)
    files: Mapping[str, bytes] = field(repr=False)
    joints: int = 0
    welds: int = 0
    wip: int | None = None
    apart: tuple[tuple[Inside, Inside], ...] = ()
    bins: tuple[Bin, ...] = ()
    overlaps: tuple[Diagnostic, ...] = ()

    def __post_init__(self) -> None:
        for name in ("copies", "masses", "files"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    @staticmethod
    def product_name(factory: Factory) -> str:
        """The name of the model: that of the PAG file, without folder and ending."""
        name = "".join(c if c.isprintable() else "?" for c in Path(factory.pag.file).stem)
        return name or "factory"

    @staticmethod
    def memory_of(root: Element) -> int:
        """The engine's memory for a model, by its root element [MiB]: ARENA, and what its broad
        phase sets aside, two arrays with four bytes for each pair of bodies. Only what is written
        to is taken from the machine's."""
        bodies = sum(1 for _ in root.iter("body")) + 1
        return ARENA + 2 * 4 * bodies * (bodies - 1) // 2 // 2**20

    def with_tree(self, root: Element) -> Model:
        """The model with the text of an element, which is indented."""
        ElementTree.indent(root)
        return replace(self, xml=ElementTree.tostring(root, encoding="unicode") + "\n")

    @property
    def reservations(self) -> tuple[str, ...]:
        """What a run of it does not show, in words."""
        return reservations_of(self.layout, self.excluded)

    @property
    def factory(self) -> Factory:
        """The factory the model is of."""
        return self.layout.factory

    @property
    def excluded(self) -> tuple[Pair, ...]:
        """The pairs of parts between which there is no contact."""
        return self.insets.excluded

    @cached_property
    def weights(self) -> Mapping[str, float]:
        """What lifts, sliders and the shutter carry at the start [N], by the names of joints."""
        hanging = (axis for axis in self.factory.axes if axis.motion.hangs)
        masses = {names.joint(axis): axis.joint.mass for axis in hanging}
        for outlet in outlets_of(self.layout):
            masses[names.slider(outlet.label)] = SLIDER_MASS + self.masses[outlet.label]
        masses[names.SHUTTER] = SHUTTER_MASS
        return {joint: mass * GRAVITY for joint, mass in masses.items()}

    @cached_property
    def bodies(self) -> int:
        """How many bodies of parts and sub-assemblies there are."""
        return sum(self.copies.values())


Finish: TypeAlias = Callable[[Model, Element], None]
"""Changes the element of a model that has no text yet."""


def part_copies(
    pool: Mapping[str, int],
    units: int | None,
    wip: int | None = None,
    under_way: Mapping[str, int] | None = None,
) -> dict[str, int]:
    """Bodies of each part: the pool and one shown at the feeder, or the units asked for if less; at
    least as many as are `under_way` where a run starts, and one."""
    copies = {}
    for label, most in pool.items():
        inside = min(most, wip) if wip else most
        wanted = inside + 1 if units is None else min(inside + 1, units)
        copies[label] = max(1, wanted, (under_way or {}).get(label, 0))
    return copies


def fitting_wip(pool: Mapping[str, int], units: int | None) -> int | None:
    """The most units that can be inside at once with at most MOST_BODIES bodies of parts, at least
    one; None where the whole pool has no more."""
    if sum(part_copies(pool, units).values()) <= MOST_BODIES:
        return None
    least, most = 1, max(pool.values())
    while most - least > 1:
        wip = (least + most) // 2
        fits = sum(part_copies(pool, units, wip).values()) <= MOST_BODIES
        least, most = (wip, most) if fits else (least, wip)
    return least


def build_model(
    layout: Layout,
    catalogue: Catalogue,
    copies: Mapping[str, int],
    settings: Settings,
    bodies: FusedBodies | None = None,
    shown: bool = True,
    wip: int | None = None,
    bins: tuple[Bin, ...] = (),
    finish: Finish | None = None,
) -> Model:
    """The model of a laid-out factory, of one body a part unless other `bodies` are given; without
    what is only there to be `shown`, if it is not; with `bins`, if parts may be scrapped; with
    what `finish` changes, if anything. The `copies` are enough for `wip` units inside at once.
    Raises InputError where the MJCF of a robot type is unusable."""
    factory, product = layout.factory, layout.product
    bodies = bodies or bodies_of(factory, product)
    masses = {
        label: sum(bodies.mass[body] for body in inner) for label, inner in bodies.carried.items()
    }
    drives = tuple(axis.drive(settings) for axis in driven_axes(layout, masses, settings))
    root = ElementTree.parse(SKELETON).getroot()
    root.set("model", Model.product_name(factory))
    section = {child.tag: child for child in root}
    world, equality, actuator = (section[tag] for tag in ("worldbody", "equality", "actuator"))
    fill(section["option"], timestep=settings.step)
    add_paints(section["asset"])
    insets = insets_of(layout, settings.overlap)
    apart = tuple(m for pair in insets.excluded for m in bodies.meeting(factory, pair))
    files = add_meshes(section["asset"], product, insets)
    add_scene(world, section["statistic"], layout)
    add_robots(layout, catalogue, drives, section)
    files |= layout.chains.files if layout.chains else {}
    load = max(masses[product] for product in factory.products)
    fast = settings.outfeed_acceleration
    tray = drive_for(TRAY_MASS, load, fast, settings)
    shutter = drive_for(
        SHUTTER_MASS + MOTOR, 0.0, settings.shutter_limits[1] + GRAVITY, settings, HOIST_STIFFNESS
    )
    add_outfeed(world, actuator, layout, tray, shutter)
    hanging = Hanging.of(layout)
    sliders = _sliders(layout, hanging, masses, settings)
    add_feeders(world, actuator, layout, hanging, sliders)
    jaws = add_jaws(world, actuator, layout, settings)
    add_bins(world, layout, bins)
    add_parts(world, layout, hanging, copies, insets)
    add_wholes(world, layout, bodies, copies, insets, {inside for both in apart for inside in both})
    add_welds(equality, layout, hanging, bodies, copies)
    add_exclusions(section["contact"], apart, copies)
    if not len(section["contact"]):
        root.remove(section["contact"])
    if not shown:
        leave_out_what_is_shown(root)
    fill(section["size"], memory=f"{Model.memory_of(root)}M")
    joints = len(factory.axes) + 2 + len(sliders) + jaws + sum(copies.values())
    made = Model(layout, settings, bodies, copies, masses, drives, insets, "", files)
    made = replace(made, joints=joints, welds=len(equality), wip=wip, apart=apart, bins=bins)
    if finish is not None:
        finish(made, root)
    return made.with_tree(root)


def _sliders(
    layout: Layout, hanging: Hanging, masses: Mapping[str, float], settings: Settings
) -> dict[str, Drive]:
    """The drives of the feeders' sliders, for the heaviest that they bring down. Their buffers hold
    the setpoints of a whole stroke of any of them, and longer than until it is seen to be over:
    what is shown of a stroke meanwhile comes after those."""
    most = settings.feeder_limits[1] + GRAVITY
    samples = (stroke_ticks(layout, settings) + 2 * settings.stride) * settings.steps + 2
    loads: dict[str, float] = {}
    for outlet in outlets_of(layout):
        slider = hanging.slider[outlet.label]
        loads[slider] = max(loads.get(slider, 0.0), masses[outlet.label])
    return {
        slider: replace(
            drive_for(SLIDER_MASS + MOTOR, load, most, settings, HOIST_STIFFNESS), samples=samples
        )
        for slider, load in loads.items()
    }


def stroke_ticks(layout: Layout, settings: Settings) -> int:
    """No stroke of a feeder's slider takes more ticks."""
    profile = SpeedProfile(*settings.feeder_limits)
    strokes = (outlet.feeder.way for outlet in outlets_of(layout))
    return ceil(profile.rest(max(strokes)) / settings.tick) + 4
