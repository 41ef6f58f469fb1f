"""The machines of a model: the kinematic trees that its joints move, and the parts that welds join
to them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

from factory.support.engine import mujoco

FREE = int(mujoco.mjtJoint.mjJNT_FREE)
LEVEL = 1e-6
"""An axis is level that rises no more."""

FED, TAKEN_AWAY = "feed/", "hold/"
"""How welds are named by which a part comes into the factory, and by which it leaves it."""

WELD = int(mujoco.mjtEq.mjEQ_WELD)


class Machines:
    """The trees of a model, each by its topmost body that has a joint (`root`)."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.m = model
        self.bodies = {model.body(n).name: n for n in range(1, model.nbody)}
        self.joints = {
            model.joint(n).name: n for n in range(model.njnt) if model.jnt_type[n] != FREE
        }
        self.welds = {
            model.equality(n).name: n for n in range(model.neq) if model.eq_type[n] == WELD
        }

    def root(self, body: int) -> int:
        """The topmost body with a joint that carries a body; 0 where nothing moves it."""
        return next((b for b in reversed([*self.above(body)]) if self.m.body_jntnum[b]), 0)

    def above(self, body: int) -> Iterator[int]:
        """A body and those that carry it."""
        while body:
            yield body
            body = int(self.m.body_parentid[body])

    @cached_property
    def joints_of(self) -> dict[int, tuple[str, ...]]:
        """The joints of each tree."""
        of = dict[int, tuple[str, ...]]()
        for name, joint in self.joints.items():
            root = self.root(int(self.m.jnt_bodyid[joint]))
            of[root] = (*of.get(root, ()), name)
        return of

    @cached_property
    def holders(self) -> dict[str, int]:
        """By the welds that join a part to a tree: the tree."""
        held = dict[str, int]()
        for name, weld in self.welds.items():
            root, part = self.root(int(self.m.eq_obj1id[weld])), int(self.m.eq_obj2id[weld])
            if root in self.joints_of and self.is_part(part):
                held[name] = root
        return held

    def carriages(self) -> frozenset[str]:
        """The joints that go over the floor, but for those of the machine that takes products
        away: it has come to its end before it is given the next."""
        away = {root for weld, root in self.holders.items() if weld.startswith(TAKEN_AWAY)}
        return frozenset(
            joint
            for root, joints in self.joints_of.items()
            for joint in joints
            if root not in away and abs(self.m.jnt_axis[self.joints[joint]][2]) < LEVEL
        )

    def bodies_of(self, root: int) -> Iterator[str]:
        """The bodies of a tree that collide with something."""
        for name, body in self.bodies.items():
            if self.root(body) == root and self.solid(body):
                yield name

    def is_part(self, body: int) -> bool:
        """Whether a body is free."""
        joint = int(self.m.body_jntadr[body])
        return joint >= 0 and int(self.m.jnt_type[joint]) == FREE

    def part(self, weld: str) -> int:
        """The body that a weld joins to a machine."""
        return int(self.m.eq_obj2id[self.welds[weld]])

    def geoms(self, body: int) -> range:
        """The geoms of a body."""
        first = int(self.m.body_geomadr[body])
        return range(first, first + int(self.m.body_geomnum[body]))

    def solid(self, body: int) -> list[int]:
        """The geoms of a body that collide with something."""
        masks = self.m.geom_contype, self.m.geom_conaffinity
        return [g for g in self.geoms(body) if masks[0][g] or masks[1][g]]

    def name(self, body: int) -> str:
        """The name of a body."""
        return str(self.m.body(body).name)
