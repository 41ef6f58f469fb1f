"""The beginning of a logged run, made again from its PAG: the model, the header and the figures in
a log are not trusted."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from factory.api import (
    Demand,
    Diagnostic,
    FactoryError,
    Layout,
    MonitorSubject,
    RunRequest,
    RunVerdict,
    Simulation,
    State,
)
from factory.apps.log import Log
from factory.apps.log.checks import HEADER
from factory.apps.log.project_table import project_of, settings_of
from factory.apps.log.reader import digest_of
from factory.apps.log.writer import packed, versions
from factory.support.tables import misfit, value_of

TAG = re.compile(r"<[^>]+>")

BROKEN = (
    *(ValueError, KeyError, IndexError, TypeError, AttributeError),
    *(OverflowError, RecursionError, AssertionError, MemoryError),
)
"""What the header of a log raises that is not what it should be."""

REPEATED = 1.0
"""At most so much of a logged run is repeated [s]."""

SAME = 1e-8
"""Coordinates of a run that is repeated differ by no more on another machine [m, or a quaternion's
part]; another seed moves robots by some micrometres at once."""

OF_MODEL = ("Overlap", "Blocked")
"""The codes of what is said of the product of a model."""

WIDTH = 120
"""So many characters of an element are said."""


def request_of(header: Mapping[str, Any]) -> RunRequest:
    """The request of a recorded run."""
    return RunRequest(
        header["world"],
        header["units"],
        header["seed"],
        header["jitter"],
        settings_of(header),
        frozenset(header["start"]),
        header["wip"],
        header["distributed"],
        header["fuse"],
        recovers="faults" in header,
        demand=value_of(Demand, header["demand"]) if "demand" in header else None,
    )


def model_faults(
    log: Log, beside: Path, layout: Layout | None = None
) -> tuple[tuple[Diagnostic, ...], str]:
    """Defects of a log of a MuJoCo run in the folder `beside`: its model, what it says of that, or
    its beginning differ from what its PAG and header give (Record); its header is not the one that
    it was ended with (Record); its product has faults; or it was kept with other versions than
    those that would judge it (NotJudged). And the reason why it cannot be compared with its PAG, ""
    if it can. `layout`: if known."""
    if words := other_versions(log):
        return (Diagnostic("NotJudged", words, None, "judge it with those versions"),), words
    if not len(log):
        return (), "it has no states"
    said = (log.figures or {}).get(HEADER, "")
    if log.complete and log.figures is not None and said != digest_of(log.header):
        words = "the header of the log is not the one that it was ended with"
        return (Diagnostic("Record", words),), ""
    try:
        layout = layout or project_of(log.header, beside).layout
        request = request_of(log.header)
        made = Simulation(layout, request)
        if MonitorSubject.of_run(made).as_json()["goals"] != log.header["monitor"]["goals"]:
            return (), "the run was in another layout than the one that its PAG gets now"
    except FactoryError as error:
        first = error.diagnostics[0]
        if first.code == "BadPlan":
            return (Diagnostic("Record", first.message),), ""
        return (), first.message
    except BROKEN as error:
        return (), misfit(error)
    if made.model is None:
        return (), "a run in the ideal world has no model"
    faults = _unsaid(log, made)
    files = {f"mesh/{name}": content for name, content in log.files.items()}
    kept = {"xml": log.xml.encode(), **files}
    words = _difference(packed(made.model), kept)
    if words and kept != packed(Simulation(layout, replace(request, shown=False)).model):
        faults.append(Diagnostic("Record", f"the log's model is not that of its PAG: {words}"))
    elif words := _unlike(log, made):
        faults.append(Diagnostic("Record", words))
    return tuple(faults), ""


def other_versions(log: Log) -> str:
    """The versions with which a log was kept and that are others here, in words; "" for none."""
    then, here = log.header["versions"], versions()
    other = [name for name in here if then.get(name) != here[name]]
    kept = ", ".join(f"{name} {then.get(name, 'unknown')}" for name in other)
    return f"the log was kept with {kept}; here: {_listed(here, other)}" if other else ""


def _listed(versions: Mapping[str, str], names: Iterable[str]) -> str:
    return ", ".join(f"{name} {versions[name]}" for name in names)


def forged(faults: Iterable[Diagnostic]) -> bool:
    """Whether a log with these faults of its model is not worth judging from its states."""
    return any(fault.code in ("Record", "NotJudged") for fault in faults)


def _unsaid(log: Log, made: Simulation) -> list[Diagnostic]:
    """The faults of the product that a log does not mention; those that it makes up, and what it
    does not say of its model."""
    assert made.model is not None
    kept = log.figures or {}
    said = [tuple(fault) for fault in kept.get(RunVerdict.FAULTS, [])]
    faults = [f for f in made.model.overlaps if (f.code, f.message) not in said]
    if log.figures is None:
        return faults
    right = [(fault.code, fault.message) for fault in made.model.overlaps]
    doubts = [*made.model.reservations]
    unlike = [f"the log does not say: {fault.message}" for fault in faults[:1]]
    unlike += [
        f"the log says what is not so: {words}"
        for code, words in said
        if code in OF_MODEL and (code, words) not in right
    ]
    if (left := kept.get(RunVerdict.RESERVATIONS, [])) != doubts:
        never = "does not say what its run leaves open"
        falsely = "says that its run leaves open what it does not"
        unlike.append(f"the log {never if doubts else falsely}: {'; '.join(doubts or left)}")
    return [*(Diagnostic("Record", words) for words in unlike), *faults]


def _unlike(log: Log, made: Simulation) -> str:
    """Where a logged run, up to its first end of a joining operation, is not what its header makes,
    in words; "" if it is. Runs with failures are not repeated."""
    if made.request.recovers or log.ctrl is None:
        return ""
    factory, unlike = made.layout.factory, list[str]()
    joining = {operation.end for operation in factory.operations if len(operation.robots) > 1}
    ends = (
        float(t)
        for t, event in zip(log.fired_t, log.fired.tolist(), strict=True)
        if event in joining
    )
    until = min(REPEATED, float(log.time[-1]), next(ends, REPEATED))

    def compare(state: State) -> None:
        row = log.row_at(state.time)
        if unlike or row >= len(log) or state.time >= until:
            return
        far = float(np.abs(log.qpos[row] - state.observation.qpos).max(initial=0.0))
        if not far <= SAME:
            unlike.append(
                "the log is not of the run that its header makes (seed, jitter), or something took"
                f" part in it that a log does not keep: at {state.time:.3f} s it is {far:.2g} off"
            )

    made.run([compare], until)
    return unlike[0] if unlike else ""


def _difference(wanted: Mapping[str, bytes], kept: Mapping[str, bytes]) -> str:
    """The first difference of a kept model, in words; "" for none."""
    for name in sorted({*wanted, *kept}, key=lambda name: name != "xml"):
        if wanted.get(name) == kept.get(name):
            continue
        if name != "xml":
            return f"its {name} is another"
        tags = (TAG.findall(model[name].decode()) for model in (kept, wanted))
        pairs = zip_longest(*tags, fillvalue="nothing more")
        one, other = next((pair for pair in pairs if len({*pair}) > 1), ("text", "other text"))
        return f"{one:.{WIDTH}} in place of {other:.{WIDTH}}"
    return ""
