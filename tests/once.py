"""Stages computed once for all tests of a process: layouts, and how the inputs of operations come
together.

A stage is a function from value to value: equal inputs give equal results. A stage under a planted
fault is another function: a test computes its stages itself from the first attribute on that it
replaces by `monkeypatch`. So do the modules in `ANEW`, which are about these stages."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from hashlib import sha256
from types import MappingProxyType
from typing import Any

import pytest

from factory.compiler.mating import mating
from factory.layout.request import Ground
from factory.study.pool import pickle_locked_mappings

ANEW = ("test_cold_and_warm", "test_layout_optimised", "test_progress", "test_reproducible")


class Stages:
    """Results of stages by a digest of their inputs. `on`: whether they are used."""

    def __init__(self) -> None:
        self.on = True
        self._results: dict[bytes, Any] = {}

    def once(self, stage: Callable[..., Any]) -> Callable[..., Any]:
        """The stage, computed once for equal inputs."""

        def result(*inputs: Any) -> Any:
            if not self.on:
                return stage(*inputs)
            key = sha256(pickle.dumps((stage.__qualname__, inputs))).digest()
            if key not in self._results:
                self._results[key] = stage(*inputs)
            return self._results[key]

        return result


@contextmanager
def stages_once() -> Iterator[Stages]:
    """The stages of the package, computed once in this block."""
    pickle_locked_mappings()
    stages, lay_out, matings = Stages(), Ground.lay_out, mating.matings

    @stages.once
    def laid_out(ground, factory, product, settings, chosen, catalogue):
        return lay_out(ground, factory, product, settings, None, catalogue)

    def of_ground(ground, factory, product, settings, hands=None, catalogue=None, draft=None):
        """Hands are those of the factory, unless layouts have made them others, or a draft has."""
        others = hands is not None and (hands.factory.robots != factory.robots or hands.travels)
        if draft is not None or others:
            return lay_out(ground, factory, product, settings, hands, catalogue, draft)
        return laid_out(ground, factory, product, settings, hands is not None, catalogue)

    def of_nodes(nodes, product, lifts=True, lowered=MappingProxyType({})):
        return judged(nodes, product, lifts, lowered)

    judged = stages.once(matings)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Ground, "lay_out", of_ground)
        patch.setattr(mating, "matings", of_nodes)
        yield stages
