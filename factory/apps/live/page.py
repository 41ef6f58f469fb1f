"""The page of a running factory: the drawings of a report, moved by the messages of a socket."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

import numpy as np

from factory.api import Model, MonitorSubject, Operation, Replica, Simulation, names
from factory.apps.live.commands import FACTORS, SPEEDS
from factory.apps.live.session import Session
from factory.apps.report.drawings import data, floor_plan, labels_of, net_drawing
from factory.apps.report.page import counts, filled, options, paints
from factory.apps.report.scene import DrawnFactory, Pack, drawn, scene, stations
from factory.apps.report.sections import assembly_tree
from factory.support.arrays import Array

SCRIPTS = (
    "report/three.min.js",
    "report/data.js",
    "report/selection.js",
    "report/views.js",
    "report/replay.js",
    "report/wiring.js",
    "live/rolling.js",
    "live/outages.js",
    "live/live.js",
)
"""In the order in which they run."""

SAMPLES = 24
"""Number of positions at which each way of a robot that moves several joints is sampled."""


def page(session: Session, command: str = "factory view FILE.pag") -> bytes:
    """The page, for as long as the session lasts; it says what `command` begins another."""
    stage, pack = stage_of(session.simulation), Pack()
    factory = stage.factory
    labels, name = labels_of(factory), factory.pag.title
    document = {
        **data(factory),
        "name": name,
        "roles": list(stage.roles),
        "parts": [o.label for o in factory.leaves],
        "factors": FACTORS,
        "fails": session.fails,
        "scene": scene(stage, labels, pack),
        "frames": {
            "parents": {},
            "moving": session.bodies.tolist(),
            "turning": session.bodies.tolist(),
            "hidden": Model.HIDDEN,
            "position": np.round(stage.position, 5).tolist(),
            "quaternion": np.round(stage.quaternion, 6).tolist(),
            "reach": np.round(stage.reach[:, session.bodies], 4).tolist(),
        },
        "arrays": pack.index,
    }
    fields = {
        "name": escape(name, quote=True),
        "counts": escape(f"{counts(factory)}, proved live"),
        "tree": assembly_tree(factory.pag, labels),
        "floor": floor_plan(stage, labels),
        "net": net_drawing(factory, stage.roles),
        "paints": paints(stage),
        "speeds": "".join(
            f'<option value="{s:g}"{" selected" * (s == 1)}>{f"{s:g}×" if s else "max"}</option>'
            for s in SPEEDS
        ),
        "options": options(document),
        "command": escape(command),
    }
    styles = ("report/report.css", "report/failures.css", "live/live.css")
    text = filled("live/live.html", fields, document, pack.text(), SCRIPTS, styles, "'self'")
    return text.encode()


def stage_of(simulation: Simulation) -> DrawnFactory:
    """What there is to be drawn of a simulation that has not begun; bodies are where they are in
    the world."""
    layout, world = simulation.layout, simulation.physical
    m, d, factory = world.m, world.d, layout.factory
    model = simulation.model
    assert model is not None
    return DrawnFactory(
        factory,
        m,
        d.xpos.copy(),
        d.xquat.copy(),
        _reach(simulation),
        MonitorSubject.of_run(simulation).as_json()["places"],
        stations(factory, m, _ends(simulation)),
        drawn(m, model.xml, model.files),
    )


def _reach(simulation: Simulation) -> Array:
    """The least and the greatest position (2, bodies, 3) to which robots bring their bodies [m]."""
    layout, world = simulation.layout, simulation.physical
    m, (at, _) = world.m, world.motion.axes.measured(world.d)
    reach = np.stack([world.d.xpos] * 2)
    for robot in layout.factory.robots:
        body, path = m.body(names.carriage(robot.name)).id, layout.guidepaths[robot.index]
        if robot.body.first.moves:  # several joints
            bodies = np.flatnonzero(m.body_rootid == m.body_rootid[body])
            places = np.array([every[bodies] for every in _along(simulation, robot.index)])
            reach[:, bodies] = places.min(axis=0), places.max(axis=0)
            continue
        ends, x = [layout.home(robot.index, o) for o in robot.operations], float(at[robot.index])
        away = np.concatenate(path.pieces(min(ends), max(ends))) - path.pieces(x, x)[0][0]
        places = world.d.xpos[body] + np.pad(away, ((0, 0), (0, 1)))
        reach[0, body] = np.minimum(reach[0, body], places.min(axis=0))
        reach[1, body] = np.maximum(reach[1, body], places.max(axis=0))
    return reach


def _along(simulation: Simulation, robot: int) -> Iterator[Array]:
    """The positions of all bodies (bodies, 3) [m] along the ways of a robot that moves several
    joints."""
    layout, world = simulation.layout, simulation.physical
    axes, replica = world.motion.axes.apart(), Replica(world.m)
    for tour in layout.factory.tours[robot]:
        ends = [layout.visits[operation, robot].at for operation in tour]
        for operation in tour:
            axes.curves.take(robot, operation)
            for x in np.linspace(min(ends), max(ends), SAMPLES):
                qpos = world.d.qpos.copy()
                axes.configure(qpos, np.array([robot]), np.array([x]))
                replica.place(qpos)
                yield replica.d.xpos.copy()


def _ends(simulation: Simulation) -> Iterator[tuple[Operation, Array]]:
    """The state of the engine with the carrier of an operation where that ends."""
    layout, world = simulation.layout, simulation.physical
    axes = world.motion.axes.apart()
    for operation in layout.factory.operations:
        qpos, carrier = world.d.qpos.copy(), operation.carrier
        stop = layout.visits[operation.index, carrier].at
        axes.configure(qpos, np.array([carrier]), np.array([stop]))
        yield operation, qpos
