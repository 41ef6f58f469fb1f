"""An analysis as one JSON document: the keys of `analyze --json`."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from factory.apps.analyze.analysing import Analysis
from factory.apps.analyze.measured import ComparedFigure, Comparison


def document(analysis: Analysis) -> dict[str, Any]:
    """The document, with times in seconds; null for what does not apply."""
    timing, net, flow = analysis.timing, analysis.net, analysis.flow
    return {
        "product": timing.factory.pag.root,
        "world": timing.world,
        "units": flow.units,
        "seed": timing.seed,
        "jitter": timing.jitter,
        "wip": analysis.wip,
        "cycle_time_s": net.pace,
        "products_per_hour": 3600 / net.pace if net.pace else None,
        "bottlenecks": list(analysis.bottlenecks),
        "by_product_s": analysis.by_product,
        "first_product_s": flow.first,
        "last_product_s": flow.last,
        "circuits": _circuits(analysis),
        "operations": [
            {"label": o.label, "operation": o.template.name, "delay_s": delay, "slack_s": slack}
            for o, delay, slack in zip(
                timing.factory.operations, net.seconds, analysis.slack, strict=False
            )
        ],
        "robots": analysis.records(),
        "least_wip": analysis.least_wip,
        "scenarios": [
            {
                "change": s.words,
                "cycle_time_s": s.pace,
                "gain_s": net.pace - s.pace,
                "bottlenecks": list(s.then),
            }
            for s in (analysis.asked,)
            if s is not None
        ],
        "measured": None if analysis.measured is None else _measured(analysis, analysis.measured),
    }


def _circuits(analysis: Analysis) -> list[dict[str, Any]]:
    places = analysis.net.net.net.places
    return [
        {
            "name": circuit.name,
            "seconds": circuit.seconds,
            "tokens": circuit.tokens,
            "pace_s": circuit.pace,
            "slack_s": analysis.net.slack(circuit),
            "places": [places[p].name for p in circuit.places],
        }
        for circuit in analysis.net.circuits
    ]


def _measured(analysis: Analysis, run: Comparison) -> dict[str, Any]:
    return {
        "source": run.source,
        "units": run.units,
        "cycle_time_s": _pair(run.cycle),
        "first_product_s": _pair(run.first),
        "last_product_s": _pair(run.last),
        "durations": [
            {
                "label": d.label,
                **_pair(d.time),
                "least": d.least,
                "greatest": d.greatest,
                "count": d.count,
            }
            for d in run.durations
        ],
        "busy": [
            {"robot": robot.name, **_pair(pair)}
            for robot, pair in zip(analysis.timing.factory.robots, run.busy, strict=True)
        ],
    }


def _pair(pair: ComparedFigure) -> dict[str, Any]:
    return {**asdict(pair), "error": pair.error}
