"""A film or a still, of a run made for it or of its log."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import NamedTuple

from factory.pipeline import Project
from factory.record.log import Log
from factory.rendering.camerawork import When
from factory.rendering.film import Film, Still, render_log
from factory.rendering.picture import USUAL, Picture
from factory.rendering.video import FPS, check_output
from factory.simulation.executing import Tell, carry_out
from factory.simulation.options import RunOptions
from factory.simulation.run import Run
from factory.simulation.simulation import Simulation
from factory.support.errors import Diagnostic, InputError, usage_error
from factory.support.gl import probe


@dataclass(frozen=True, slots=True)
class Shot:
    """A film or, where the `output` is a PNG, a still: how each picture is taken, frames per second
    of a film, the time of a still [s], or the end, and the file of a film's best moment. Raises
    InputError: BadValue for what is not possible, Usage for a poster of a still."""

    output: Path
    picture: Picture = USUAL
    fps: float = FPS
    at: When = "end"
    poster: Path | None = None

    def __post_init__(self) -> None:
        size, at = self.picture.size, self.at
        if at != "end" and not (isinstance(at, int | float) and at >= 0 and isfinite(at)):
            message = f"the time of a still is in seconds or `end`, not '{at}'"
            raise InputError(Diagnostic("BadValue", message, None, "for example 2.5"))
        if check_output(self.output, size, self.fps, still=None) and self.poster is not None:
            raise usage_error("--poster applies to a film; this is a still", "leave out --poster")

    @property
    def is_still(self) -> bool:
        """Whether it is one picture."""
        return check_output(self.output, self.picture.size, self.fps, still=None)


class Rendered(NamedTuple):
    """The number of frames, and the run that was made for them, None for a log."""

    frames: int
    run: Run | None


def render(
    source: Log | Project,
    shot: Shot,
    asked: RunOptions = RunOptions(),  # noqa: B008 (frozen)
    silent: bool = True,
    progress: Tell | None = None,
) -> Rendered:
    """Take a film or a still: from a log, or of a run of a project as `asked`, which a still ends
    at its time. Raises InputError, MissingError without GL, StoppedError as `carry_out`."""
    probe()
    if isinstance(source, Log):
        given = shot.output, shot.picture, shot.fps, shot.at, shot.poster
        return Rendered(render_log(source, *given), None)
    made = Simulation(source.layout, asked.request(source))
    films: list[Film] = []

    def opened() -> Film | Still:
        if shot.is_still:
            return Still(made, shot.output, shot.picture, shot.at)
        films.append(Film(made, shot.output, shot.picture, shot.fps, shot.poster))
        return films[0]

    enough = shot.at if shot.is_still and shot.at != "end" else asked.max_time
    run = carry_out(made, silent, enough, [opened], progress=progress)
    return Rendered(films[0].frames if films else 1, run)
