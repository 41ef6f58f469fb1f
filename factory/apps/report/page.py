"""The page of a report, about a run that is made for it or is in a log: one HTML file that refers
to nothing outside itself."""

from __future__ import annotations

import hashlib
import json
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from factory.api import Factory, Project, Run
from factory.apps.report.approaches import approaches_section
from factory.apps.report.drawings import data, floor_plan, labels_of, net_drawing
from factory.apps.report.failures import failures_data, failures_section
from factory.apps.report.frames import frames
from factory.apps.report.pace import fidelity, measured, predicted
from factory.apps.report.recording import Recording, recording_of
from factory.apps.report.scene import DrawnFactory, Pack, scene
from factory.apps.report.sections import (
    assembly_tree,
    ending,
    fidelity_words,
    heading,
    made_how,
    pace,
    proof_words,
    utilisation,
)
from factory.apps.report.words import proof
from factory.apps.runs.executing import Tell
from factory.apps.runs.options import RunOptions
from factory.apps.runs.running import run_project

SCRIPTS = (
    "report/three.min.js",
    "report/data.js",
    "report/selection.js",
    "report/views.js",
    "report/gantt.js",
    "report/replay.js",
    "report/wiring.js",
    "report/report.js",
)
"""In the order in which they run."""

STYLES = ("report/report.css",)

FAILURES = "report/failures.js", "report/failures.css"
"""The additional script and style of a run that recovers from failures."""


def page(recording: Recording) -> str:
    """The text of the page, the same for the same recording."""
    labels = labels_of(recording.factory)
    run, plan = measured(recording), predicted(recording)
    proved = proof(recording.factory)
    pack = Pack()
    document = {
        **data(recording.factory),
        "name": recording.name,
        "end": round(recording.end, 6),
        "roles": list(recording.stage.roles),
        "start": list(recording.start),
        "fired": recording.log.fired.tolist(),
        "times": [round(t, 4) for t in recording.log.fired_t.tolist()],
        "scene": scene(recording.stage, labels, pack),
        "frames": frames(recording, pack),
        **failures_data(recording),
        "arrays": pack.index,
    }
    fields = {
        "name": escape(recording.name, quote=True),
        "counts": escape(counts(recording.factory)),
        "ending": ending(recording.log.cut_off),
        "heading": heading(recording, run, plan, proved),
        "tree": assembly_tree(recording.factory.pag, labels),
        "floor": floor_plan(recording.stage, labels),
        "net": net_drawing(recording.factory, recording.stage.roles),
        "paints": paints(recording.stage),
        "approaches": approaches_section(recording, labels),
        "failures": failures_section(recording),
        "pace": pace(recording, run, plan),
        "utilisation": utilisation(recording, run, plan),
        "proof": proof_words(proved),
        "fidelity": fidelity_words(recording, fidelity(recording)),
        "how": made_how(recording),
        "options": options(document),
    }
    fields["certificate"] = json_inside(proved.document)
    scripts: tuple[str, ...] = SCRIPTS
    styles: tuple[str, ...] = STYLES
    if recording.log.failures is not None:
        script, style = FAILURES
        scripts, styles = (*SCRIPTS[:-1], script, SCRIPTS[-1]), (*STYLES, style)
    return filled("report/report.html", fields, document, pack.text(), scripts, styles)


def paints(stage: DrawnFactory) -> str:
    """The colours of roles as properties of a style sheet."""
    return f":root {{ {' '.join(f'--paint-{k}: {v};' for k, v in stage.paints.items())} }}\n"


def counts(factory: Factory) -> str:
    """The sizes of a factory and its net."""
    net = factory.net.threaded
    return (
        f"{len(factory.leaves)} parts, {len(factory.robots)} robots, {len(net.places)} places, "
        f"{len(net.transitions)} transitions"
    )


def options(document: dict[str, Any]) -> str:
    """The options of the search field."""
    kinds = (("robot", "robots"), ("part", "labels"), ("transition", "transitions"))
    return "".join(
        f'<option value="{escape(f"{kind} {name}", quote=True)}"></option>'
        for kind, key in kinds
        for name in document[key]
    )


def json_inside(value: Any) -> str:
    """JSON for a `<script>`: nothing in it ends the script or begins a comment."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def filled(
    template: str,
    fields: Mapping[str, str],
    document: object,
    packed: str,
    scripts: Sequence[str],
    styles: Sequence[str],
    connects: str = "",
) -> str:
    """A template with its fields filled in, in one pass, so that the values are not scanned again.
    Templates, scripts and styles are named like `report/report.css`; `connects`: the
    addresses that its content security policy lets the page connect to."""
    texts = [_asset(name) for name in scripts]
    values = {
        **fields,
        "policy": _policy(texts, connects),
        "style": "".join(map(_asset, styles)),
        "data": json_inside(document),
        "packed": packed,
        "scripts": "\n".join(f"<script>{script}</script>" for script in texts),
        "licence": escape(_asset("report/three.LICENSE.txt")),
    }
    pieces = _asset(template).split("%%")
    return "".join(values[piece] if n % 2 else piece for n, piece in enumerate(pieces))


def _policy(scripts: list[str], connects: str) -> str:
    """A content security policy under which only these scripts run and nothing is fetched."""
    digests = (b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts)
    allowed = " ".join(f"'sha256-{digest}'" for digest in digests)
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; "
        + (f"connect-src {connects}; " if connects else "")
        + "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )


def _asset(name: str) -> str:
    room, _, file = name.partition("/")
    return (files(f"factory.apps.{room}") / "assets" / file).read_text("utf-8")


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
