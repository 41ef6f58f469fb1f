"""Reports: the page about a run, made for it or in a log."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

from factory.pipeline import Project
from factory.show.report.page import page
from factory.show.report.recording import Recording, recording_of
from factory.simulation.executing import Tell, run_project
from factory.simulation.options import RunOptions
from factory.simulation.run import Run

HEIGHT = 800
"""Height of a page that is shown within another [px]."""


@dataclass(frozen=True)
class RunReport:
    """The `text` of a page, the recording that it is about, and the run where it was made for
    it."""

    text: str = field(repr=False)
    recording: Recording = field(repr=False)
    run: Run | None = None

    def _repr_html_(self) -> str:
        return inline(self.text)


def inline(text: str) -> str:
    """A page as an element of another one, with scripts and styles of its own."""
    style = f"width:100%;height:{HEIGHT}px;border:1px solid #cbd2d9"
    return f'<iframe srcdoc="{escape(text)}" style="{style}"></iframe>'


def report_on(
    source: Path | Project,
    asked: RunOptions = RunOptions(),  # noqa: B008 (frozen)
    silent: bool = True,
    progress: Tell | None = None,
) -> RunReport:
    """The report on the run in a log or, of a project, on one that is made as `asked`, whose log is
    temporary; its parts are not fused, since the page follows each. Raises InputError, RunError."""
    if isinstance(source, Path):
        recording = recording_of(source)
        return RunReport(page(recording), recording)
    with TemporaryDirectory(prefix="factory-") as folder:
        log, layout = Path(folder) / "run.log", source.layout
        made = replace(asked, fuse=False)
        run = run_project(source, made, silent, log, progress=progress)
        recording = recording_of(log, layout)
    return RunReport(page(recording), recording, replace(run, log=None))
