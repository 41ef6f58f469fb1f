"""Films and stills of a log, with the same pictures as those of its run; or of a run made for
them."""

from __future__ import annotations

from base64 import b64encode
from pathlib import Path
from typing import NamedTuple

from factory.api import Project, Recorder, Run, Shot, Simulation
from factory.apps.log import Log
from factory.apps.log.model import model_of
from factory.apps.monitor.record import recorded_subject
from factory.apps.runs.executing import Tell, carry_out
from factory.apps.runs.options import RunOptions
from factory.apps.runs.watched import watched
from factory.film.film import Film
from factory.support.gl import probe


def render_log(log: Log, shot: Shot) -> int:
    """Take a film or a still from a log alone; gives the number of frames.

    Nothing is simulated again. Raises InputError for a log of the ideal world, one without a tick,
    or one that is not of the factory in its header, and for a time after its end."""
    return shot.of_states(log, lambda: (model_of(log), recorded_subject(log.header)))


class Rendered(NamedTuple):
    """The number of frames, the run that was made for them, None for a log, and the file."""

    frames: int
    run: Run | None
    file: Path

    def __repr__(self) -> str:
        what = "a still" if self.frames == 1 else f"a film of {self.frames} frames"
        return f"<Rendered: {what}, {self.file}>"

    def _repr_mimebundle_(self, **_: object) -> dict[str, object]:
        """The still itself, or the film with buttons."""
        words: dict[str, object] = {"text/plain": repr(self)}
        if not self.file.is_file():
            return words
        data = b64encode(self.file.read_bytes()).decode()
        if self.file.suffix.lower() == ".png":
            return {**words, "image/png": data}
        source = f"data:video/mp4;base64,{data}"
        return {**words, "text/html": f'<video controls width="100%" src="{source}"></video>'}


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
        return Rendered(render_log(source, shot), None, shot.output)
    made = Simulation(source.layout, asked.request(source))
    taken: list[Film] = []

    def opened() -> Recorder:
        recorder = shot.of_run(made)
        taken.extend([recorder] if isinstance(recorder, Film) else [])
        return recorder

    enough = shot.at if shot.is_still and shot.at != "end" else asked.max_time
    run = carry_out(made, silent, enough, [opened], watched, progress=progress)
    return Rendered(taken[0].frames if taken else 1, run, shot.output)
