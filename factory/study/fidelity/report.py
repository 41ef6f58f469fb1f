"""The report of a comparison: figures.json, and report.md with plots."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from factory.study.fidelity.convergence import Study
from factory.study.fidelity.plots import check_plots, plots
from factory.study.fidelity.quantities import QUANTITIES
from factory.study.fidelity.record import Fidelity
from factory.support.console import finite
from factory.support.errors import Diagnostic, InputError
from factory.support.files import write_all

TITLES = {
    "limits.png": "Figures that have a limit",
    "times.png": "Firing times",
    "handoffs.png": "Hand-offs",
    "product.png": "The finished product",
    "approach.png": "Closest approach",
    "convergence.png": "Convergence",
}


def document(fidelity: Fidelity, study: Study | None = None) -> dict[str, Any]:
    """The JSON document of a comparison, with the keys of `fidelity --json`."""
    unsettled = set(study.unsettled()) if study else set()
    made = fidelity.as_json()
    for key, figure in made["figures"].items():
        figure["converged"] = None if study is None else key not in unsettled
    made["convergence"] = None if study is None else study.as_json()
    return made


def check_report(path: Path | None) -> None:
    """Raises InputError (BadFile) where a report cannot be written there, MissingError where plots
    are wanted and there is no matplotlib."""
    if path is None or _is_json(path):
        return
    if path.exists() and not path.is_dir():
        message, hint = f"'{path}' is a file", "-o takes a folder, or the name of a .json file"
        raise InputError(Diagnostic("BadFile", message, None, hint))
    check_plots()


def write_report(path: Path, fidelity: Fidelity, study: Study | None = None) -> list[Path]:
    """Write a folder, or figures alone where `path` ends in .json; all files or none. Gives their
    paths."""
    text = json.dumps(finite(document(fidelity, study)), indent=1).encode() + b"\n"
    if _is_json(path):
        contents = {path: text}
    else:
        pictures = plots(fidelity, study)
        page = markdown(fidelity, study, list(pictures)).encode()
        contents = {
            path / "report.md": page,
            path / "figures.json": text,
            **{path / name: picture for name, picture in pictures.items()},
        }
    write_all(contents)
    return list(contents)


def markdown(fidelity: Fidelity, study: Study | None, pictures: list[str]) -> str:
    """The text of report.md."""
    verdict = "All runs passed." if fidelity.passed else "**Some run failed.**"
    lines = [
        f"# Fidelity of {fidelity.product}",
        "",
        f"{fidelity.robots} robots, {fidelity.runs}, jitter {fidelity.jitter:g}. {verdict}",
        "",
        "| figure | worst | mean | unit | limit | |",
        "|---|---:|---:|---|---:|---|",
        *_rows(fidelity, study),
        "",
    ]
    for record in fidelity.seeds:
        lines += [f"* seed {record.seed}: {t.code} {t.message}" for t in record.trouble]
        lines += [f"* seed {record.seed}: contact of {pair}" for pair in record.contacts]
    for name in pictures:
        lines += ["", f"## {TITLES[name]}", "", f"![{TITLES[name]}]({name})"]
    lines += ["", "## Definitions", ""]
    lines += [f"* `{q.key}` [{q.unit}]: {q.definition}" for q in QUANTITIES.values()]
    return "\n".join(lines) + "\n"


def _rows(fidelity: Fidelity, study: Study | None) -> list[str]:
    worst, mean = fidelity.worst(), fidelity.mean()
    return [
        f"| {key} | {shown(worst[key])} | {shown(mean[key])} | {q.unit} | {shown(q.limit)} | "
        f"{remark(key, worst[key], study)} |"
        for key, q in QUANTITIES.items()
    ]


def remark(key: str, value: float | None, study: Study | None) -> str:
    """Remarks on a figure: beyond its limit, not converged."""
    remarks = {
        "beyond its limit": QUANTITIES[key].exceeded(value),
        "not converged": study is not None and key in study.unsettled(),
    }
    return ", ".join(words for words, holds in remarks.items() if holds)


def shown(value: float | None) -> str:
    """A figure in few digits."""
    if value is None:
        return "–"
    return f"{value:.4g}" if abs(value) >= 1e-9 else "0"


def _is_json(path: Path) -> bool:
    return path.suffix.lower() == ".json"
