"""Contact masks of parts by holder, and excluded pairs of parts.

Parts in the same hands are joined and do not collide; everything else does: see `mjcf/masks.py`.
Masks are written on geoms *and* bodies, since the broad phase reads those of bodies.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.engine.mjcf import names
from factory.engine.mjcf.masks import loose_code, masks_of
from factory.engine.mjcf.pads import trunks
from factory.engine.simulation.mujoco.model_arrays import ModelArrays
from factory.floor.geometry.fused_bodies import Inside
from factory.support.arrays import Index, Truth
from factory.support.engine import mujoco

SOFT = 0.02
"""Time constant of contacts of parts, the engine's own [s]."""

STIFF = 2.0
"""The same of parts that nothing holds, in timesteps: the least that the engine allows. Those that
fall on each other press in by what they go in this time."""

LAST = 2**32 - 1
"""The greatest of all signatures, which no pair has."""


def of_one_robot(m: mujoco.MjModel, signature: int) -> bool:
    """Whether both bodies of an excluded pair are of one robot, whose file leaves them out of
    contact."""
    one, other = m.body(signature >> 16).name, m.body(signature & 0xFFFF).name
    robots = {names.kind(one), names.kind(other)} == {"robot"}
    return robots and names.holder(one) == names.holder(other)


class ContactMasks:
    """The contact masks of a model's parts, by their holders.

    Args:
        arrays: the arrays of the model.
        bodies: by label, the bodies of its copies (copies,).
        apart: pairs of parts, each with the body that it is of, that do not collide where they
            are of one unit.

    Attributes:
        code: the holder of each part's body, or the code of a holder itself (`own`) (nbody,).
        unit: the unit that a part belongs to, -1 for none (nbody,).
        trunk: the body that a shell is of (nbody,).
        solid: by body, the geoms that collide, also of its shells.
        fresh: holders that have been given something.
    """

    def __init__(
        self,
        arrays: ModelArrays,
        bodies: Mapping[str, Index],
        apart: Sequence[tuple[Inside, Inside]],
    ) -> None:
        m = arrays.m
        self.code, self.unit = np.zeros(m.nbody, np.int64), np.full(m.nbody, -1)
        self.trunk = trunks(m)
        self._arrays, self._of = arrays, bodies
        self._masks = np.array([m.body_contype, m.body_conaffinity])
        self._own = {int(b): np.array([b]) for ids in bodies.values() for b in ids}
        for shell in np.flatnonzero(self.trunk != np.arange(m.nbody)).tolist():
            trunk = int(self.trunk[shell])
            self._own[trunk] = np.append(self._own[trunk], shell)
        self.solid = {
            body: self._solid_geoms(with_shells) for body, with_shells in self._own.items()
        }
        self._with_geoms = {body: ids[m.body_geomnum[ids] > 0] for body, ids in self._own.items()}
        self._partners: dict[str, list[tuple[str, Inside]]] = {}
        for one, other in apart:
            self._partners.setdefault(one[0], []).append((one[1], other))
            self._partners.setdefault(other[0], []).append((other[1], one))
        self._of_part = {
            (int(body), part): m.body(names.solid(label, number, part)).id
            for label, part in {inside for both in apart for inside in both}
            for number, body in enumerate(bodies[label], 1)
        }
        self.fresh: set[int] = set()
        listed = m.exclude_signature.view(np.uint32)
        self._signatures = {
            pair for pair in listed[listed != LAST].tolist() if of_one_robot(m, pair)
        }

    def _solid_geoms(self, bodies: Index) -> Index:
        """The geoms of bodies that collide: all except group 1, which convex pieces replace."""
        m = self._arrays.m
        first, count = m.body_geomadr[bodies], m.body_geomnum[bodies]
        geoms = np.concatenate([at + np.arange(n) for at, n in zip(first, count, strict=True)])
        return np.asarray(geoms[m.geom_group[geoms] != 1])

    def own(self, trees: Mapping[int, int], last: int) -> int:
        """Assign codes to everything that collides and is not a part: one for each kinematic tree,
        and one after `last` for each body fixed to the floor. Returns the greatest code."""
        for body in np.flatnonzero(self._masks.any(axis=0)).tolist():
            if self.trunk[body] not in self.solid:
                tree = int(self._arrays.m.body_treeid[body])
                last += tree not in trees
                self.code[body] = trees.get(tree, last)
        return last

    def look(self, seen: Truth) -> None:
        """Exclude the bodies of all holders from the broad phase except those `seen` (holders,), by
        code."""
        shown = seen[self.code]
        self._mask("body", np.arange(len(shown)), self._masks * shown)

    def hold(self, holders: Mapping[int, int]) -> None:
        """Put parts into the hands of holders, by code."""
        for body, holder in holders.items():
            self.code[self._own[body]] = holder
        self._cover(holders, SOFT)

    def let_go(self, bodies: Iterable[int]) -> None:
        """Let parts that nothing holds any more collide with each other, too. They still count as
        those of their last holder."""
        loose = {body: loose_code(body) for body in bodies}
        self._cover(loose, STIFF * self._arrays.m.opt.timestep)

    def _cover(self, codes: Mapping[int, int], softness: float) -> None:
        """Give the bodies of parts, with their shells, the masks of codes, and contacts of a time
        constant [s]."""
        if not codes:
            return
        self.fresh.update(self.code[[*codes]].tolist())
        masks = np.array([masks_of(code) for code in codes.values()]).T
        for kind, of in (("body", self._with_geoms), ("geom", self.solid)):
            each = [of[body] for body in codes]
            at, wanted = np.concatenate(each), np.repeat(masks, [*map(len, each)], axis=1)
            self._mask(kind, at, wanted)
            if kind == "body":
                self._masks[:, at] = wanted
        self._arrays["geom_solref"][at, 0] = softness

    def _mask(self, kind: str, at: Index, masks: NDArray[Any]) -> None:
        """Write the contypes and conaffinities (2,) or (2, n) of bodies or geoms."""
        for name, mask in zip(("contype", "conaffinity"), masks, strict=True):
            self._arrays[f"{kind}_{name}"][at] = mask

    def enter(self, label: str, unit: int, body: int) -> None:
        """A body enters the factory, for a unit."""
        self.unit[self._own[body]] = unit
        self._exclude(label, unit, body, True)

    def leave(self, label: str, body: int) -> None:
        """A body leaves the factory."""
        self._exclude(label, int(self.unit[body]), body, False)
        self.unit[self._own[body]] = -1

    def _exclude(self, label: str, unit: int, body: int, now: bool) -> None:
        """Exclude the pairs of a part with the present parts of its unit, or include them again.
        The engine merges the exclusions, a sorted list of unsigned numbers, with its sorted pairs;
        free slots are at its end."""
        beside = (
            (part, other, theirs)
            for part, (partner, theirs) in self._partners.get(label, ())
            for other in self._of[partner][self.unit[self._of[partner]] == unit].tolist()
        )
        pairs = [
            sorted((self._of_part[body, part], self._of_part[other, theirs]))
            for part, other, theirs in beside
        ]
        for low, high in pairs:
            (self._signatures.add if now else self._signatures.discard)((low << 16) + high)
        if pairs:
            left_out = self._arrays["exclude_signature"]
            listed = np.full(len(left_out.now), LAST, np.uint32)
            listed[: len(self._signatures)] = sorted(self._signatures)
            left_out[:] = listed.view(left_out.now.dtype)
