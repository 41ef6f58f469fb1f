"""Stages computed once for all tests of a session: layouts, what keeps their machines apart, and
how the inputs of operations come together.

A stage is a function from value to value: equal inputs give equal results. The processes of a
session share them by files. A stage under a planted fault is another function: a test computes its
stages itself from the first attribute on that it replaces by `monkeypatch`. So do the modules in
`ANEW`, which are about these stages."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import fields, is_dataclass, replace
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from factory.floor.layout import clearance, kept_layouts
from factory.floor.layout.request import Ground
from factory.floor.mating import mating
from factory.support.files import write_bytes
from tests import layout_values

ANEW = ("test_cold_and_warm", "test_layout_optimised", "test_progress", "test_reproducible")


class _Values(pickle.Pickler):
    """Pickles locked mappings."""

    def reducer_override(self, value: Any) -> Any:
        if isinstance(value, MappingProxyType):
            return _locked_mapping, (dict(value),)
        return NotImplemented


def _locked_mapping(content: dict[Any, Any]) -> MappingProxyType[Any, Any]:
    return MappingProxyType(content)


class _Digest(_Values):
    """Pickles dataclasses as their fields, sets in order: what a value has computed of itself, and
    keeps, is no part of it."""

    def reducer_override(self, value: Any) -> Any:
        if not is_dataclass(value) or isinstance(value, type):
            return super().reducer_override(value)
        told = (getattr(value, field.name) for field in fields(value) if field.init)
        return type(value), tuple(
            sorted(one, key=repr) if isinstance(one, set | frozenset) else one for one in told
        )


class _Result(_Values):
    """Pickles locked arrays so that they come back locked."""

    def reducer_override(self, value: Any) -> Any:
        if isinstance(value, np.ndarray) and not value.flags.writeable:
            return _locked, (value.copy(),)
        return super().reducer_override(value)


def _locked(array: Any) -> Any:
    array.flags.writeable = False
    return array


def _pickled(pickler: type[pickle.Pickler], value: Any) -> bytes:
    content = BytesIO()
    pickler(content).dump(value)
    return content.getvalue()


class Stages:
    """Results of stages by a digest of their inputs, in a `folder` that processes share. `on`:
    whether they are used."""

    def __init__(self, folder: Path) -> None:
        self.on, self.folder = True, folder
        self._results: dict[str, Any] = {}

    def once(self, stage: Callable[..., Any]) -> Callable[..., Any]:
        """The stage, computed once for equal inputs."""

        def result(*inputs: Any) -> Any:
            if not self.on:
                return stage(*inputs)
            key = sha256(_pickled(_Digest, (stage.__qualname__, inputs))).hexdigest()
            if key not in self._results:
                self._results[key] = self._shared(self.folder / key, stage, inputs)
            return self._results[key]

        return result

    def _shared(self, path: Path, stage: Callable[..., Any], inputs: tuple[Any, ...]) -> Any:
        if path.exists():
            return pickle.loads(path.read_bytes())
        made = stage(*inputs)
        write_bytes(path, _pickled(_Result, made))
        return made


@contextmanager
def stages_once(folder: Path) -> Iterator[Stages]:
    """The stages of the package, computed once in this block, in place of what the user's cache
    keeps of them, which knows no planted faults."""
    stages, lay_out, matings = Stages(folder), Ground.lay_out, mating.matings
    apart = stages.once(clearance.exclusions)

    @stages.once
    def laid_out(ground, factory, product, settings, chosen):
        return lay_out(ground, factory, product, settings)

    def of_ground(ground, factory, product, settings, hands=None, draft=None):
        """Hands are those of the factory, unless layouts have made them others, or a draft has."""
        others = hands is not None and (hands.factory.robots != factory.robots or hands.travels)
        if draft is not None or others:
            return lay_out(ground, factory, product, settings, hands, draft)
        return laid_out(ground, factory, product, settings, hands is not None)

    nothing = MappingProxyType({})

    def of_nodes(nodes, product, lifts=True, lowered=nothing, as_drawn=False, axes=nothing):
        return judged(nodes, product, lifts, lowered, as_drawn, axes)

    judged = stages.once(matings)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Ground, "lay_out", of_ground)
        patch.setattr(kept_layouts, "kept_or", lambda find, *_: find())
        patch.setattr(mating, "matings", of_nodes)
        patch.setattr(clearance, "exclusions", lambda at: apart(replace(at, certificate=None)))
        patch.setattr(layout_values, "lay_out", stages.once(layout_values.lay_out))
        yield stages
