"""What runs of a layout share that differ in seed and jitter alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from factory.engine.simulation.modelling import modelled
from factory.engine.simulation.request import RunRequest
from factory.floor.layout.layout import Layout
from factory.floor.modes.modes import operation_modes
from factory.theory.control.mode import Mode

if TYPE_CHECKING:
    from factory.engine.mjcf.loading import EngineModel
    from factory.engine.mjcf.model import Model


@dataclass(frozen=True)
class Compiled:
    """What runs share that differ in seed and jitter alone: the mode of each operation and, in
    MuJoCo, the model and the engine's model `loaded` of it, of which a run takes a copy."""

    modes: tuple[Mode, ...]
    model: Model | None = None
    loaded: EngineModel | None = None

    @classmethod
    def of(cls, layout: Layout, request: RunRequest) -> Compiled:
        """What runs share whose requests differ in seed and jitter alone, and that begin at the
        beginning. Raises InputError as `Simulation` does."""
        modes = operation_modes(layout, request.settings.eps)
        if request.world == "ideal":
            return cls(modes)
        from factory.engine.mjcf.loading import load

        model = modelled(layout, request, {})
        return cls(modes, model, load(model))
