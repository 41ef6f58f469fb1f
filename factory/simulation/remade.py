"""The model of a logged run, built again from its PAG: the model in a log is not trusted."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from typing import Any

from factory.layout.layout import Layout
from factory.plant.demand import Demand
from factory.record.log import Log
from factory.record.log.writer import packed, versions
from factory.record.monitor.subject import subject_of_run
from factory.record.project_table import project_of, settings_of
from factory.record.verdict import FAULTS
from factory.simulation.request import RunRequest
from factory.simulation.simulation import Simulation
from factory.support.errors import Diagnostic, FactoryError
from factory.support.tables import value_of

TAG = re.compile(r"<[^>]+>")

BROKEN = (
    *(ValueError, KeyError, IndexError, TypeError, AttributeError),
    *(OverflowError, RecursionError, AssertionError, MemoryError),
)
"""What the header of a log raises that is not what it should be."""

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
    """Defects of the model in a log of a MuJoCo run in the folder `beside`: it differs from what
    its PAG gives (Record), or its product has faults that the log does not mention; and the reason
    why the two cannot be compared, "" if they can. `layout`: if known."""
    try:
        if log.header["versions"] != {**log.header["versions"], **versions()}:
            return (), "the log was kept with other versions"
        layout = layout or project_of(log.header, beside).layout
        request = request_of(log.header)
        made = Simulation(layout, request)
        if subject_of_run(made).as_json()["goals"] != log.header["monitor"]["goals"]:
            return (), "the run was in another layout than the one that its PAG gets now"
    except FactoryError as error:
        first = error.diagnostics[0]
        if first.code == "BadPlan":
            return (Diagnostic("Record", first.message),), ""
        return (), first.message
    except BROKEN as error:
        return (), str(error)
    assert made.model is not None
    said = [*map(tuple, (log.figures or {}).get(FAULTS, []))]
    faults = [f for f in made.model.overlaps if (f.code, f.message) not in said]
    if faults and log.figures is not None:
        faults.insert(0, Diagnostic("Record", f"the log does not say: {faults[0].message}"))
    files = {f"mesh/{name}": content for name, content in log.files.items()}
    kept = {"xml": log.xml.encode(), **files}
    words = _difference(packed(made.model), kept)
    if words and kept != packed(Simulation(layout, replace(request, shown=False)).model):
        faults.append(Diagnostic("Record", f"the log's model is not that of its PAG: {words}"))
    return tuple(faults), ""


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
