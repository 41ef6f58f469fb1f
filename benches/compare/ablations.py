"""What happens to a factory if something is taken out of it: the waits, the order, the hands."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import factory
from benches.fidelity.products import file_of
from benches.tables import table
from factory.engine.simulation.ordering import Ordering
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.exclusions import coordinated
from factory.floor.layout.layout import Layout
from factory.support.errors import listing

NAMES, UNITS = ("paper", "lamp", "stool", "truck", "chair", "gearbox"), 4


def measure(quick: bool = False) -> Iterator[dict[str, Any]]:
    """Each product as it is, without its waits; its net with each order turned
    round."""
    rows: list[dict[str, Any]] = []
    for name in NAMES[:2] if quick else NAMES:
        layout = factory.lay_out(file_of(name))
        row: dict[str, Any] = {"product": name, "orders": orders(layout), "as it is": made(layout)}
        if row["orders"]["places"]:
            row["without waits"] = made(layout, waits=False)
        rows.append(row)
        print(".", end="", flush=True)
        yield {"rows": rows}
    print()


def made(layout: Layout, waits: bool = True) -> dict[str, Any]:
    """What becomes of a few units: of the run's verdict the first reason."""
    request = RunRequest(units=UNITS, shown=False)
    simulation = Simulation(layout, request)
    if not waits:
        simulation.supervisor.ordering = Ordering()
    run = simulation.run()
    physics, failures = run.physics, run.verdict.failures
    assert physics is not None
    return {
        "products": run.products,
        "succeeded": run.succeeded,
        "cycle_s": run.cycle_time_s,
        "contacts": physics.unintended_contacts,
        "why": failures[0].code if failures else "",
    }


def orders(layout: Layout) -> dict[str, Any]:
    """Of the order places with a token, in how many nets the circuit without token is found if that
    place has none: its robots wait for each other for ever."""
    made = coordinated(layout)
    places, tokens = made.net.net.places, made.net.tokens
    assert not made.deadlock
    wrong = [n for n, p in enumerate(places) if p.mode == "order" and tokens[n]]
    found = []
    for number in wrong:
        changed = [0 if n == number else many for n, many in enumerate(tokens)]
        found.append(replace(made, net=replace(made.net, tokens=tuple(changed))).deadlock)
    witness = listing([places[n].name for n in min(filter(None, found), key=len, default=())])
    count = sum(place.mode == "order" for place in places)
    return {"places": count, "wrong": len(wrong), "dead": sum(map(bool, found)), "why": witness}


def section(results: dict[str, Any]) -> str:
    """The report."""
    rows, nets = [], []
    for row in results["rows"]:
        for what in ("as it is", "without waits"):
            if said := row.get(what):
                rows.append(
                    (
                        *(row["product"], what, f"{said['products']} of {UNITS}", said["cycle_s"]),
                        *(said["contacts"], said["succeeded"], said["why"] or None),
                    )
                )
        found = row["orders"]
        if found["wrong"]:
            dead = f"{found['dead']} of {found['wrong']}"
            nets.append((row["product"], found["places"], dead, found["why"]))
    head = ("product", "variant", "made", "cycle [s]", "unintended contacts", "succeeds", "reason")
    net_head = ("product", "order places", "dead with a token taken out", "shortest circuit")
    return "\n\n".join(["## Ablations", TEXT, table(head, rows), NETS, table(net_head, nets)])


TEXT = f"""\
`python -m benches.compare ablations`, in MuJoCo, {UNITS} units, jitter 0. *As it is*: `factory run
FILE --units {UNITS}`. *Without waits*: the same layout; the supervisor does not keep the order
places of the [coordinated net](theory/coordinated.md), so robots do not wait until the hands of
others are gone. Products whose layout needs no such wait have no such row. The reason is
the [code](reference/index.md) that the verdict of the run gives first."""

NETS = """\
An order place with a token says which of two machines is first. Without the token each waits for
the other. `check` finds the circuit without token, in linear time and before anything is built:"""
