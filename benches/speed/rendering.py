"""Pictures a second, against the bare renderer."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from benches.speed.factories import Case, Steady, laid_out, robots_at_least, run_until
from benches.speed.processes import ROOT, fresh, interleaved, median, ratio, serve, spread
from benches.tables import table
from factory.engine.record.subject import MonitorSubject
from factory.engine.simulation.simulation import Simulation
from factory.film.action import Snapshot
from factory.film.camerawork import Camerawork, Moment, Take
from factory.film.history import History
from factory.film.picture import Picture
from factory.film.reel import Reel
from factory.support import gl
from factory.support.engine import mujoco
from factory.support.pictures.video import FPS

ROBOTS = (6, 40)
"""The paper's example, and a balanced tree."""

FRAMES = 24

SIZE = (1280, 720)


def work(robots: int, frames: int) -> dict[str, Any]:
    """Pictures a second of the same moments: the bare renderer's, ours, and ours into a video."""
    if robots == 6:
        layout = laid_out((ROOT / "examples" / "paper.pag").read_text())
    else:
        layout = laid_out(robots_at_least(robots))
    simulation = Case(robots, 0.002).simulation(layout, shown=True)
    run_until(simulation, Steady.of(layout, None).since)
    moments = recorded(simulation, frames)
    subject = MonitorSubject.of_run(simulation)
    made, picture = simulation.model, Picture(SIZE)
    assert made is not None
    drawn = simulation.physical.m, made.xml, made.files
    take = Take(*drawn, subject, "product", 1, picture, History(subject))
    return {
        "robots": len(layout.factory.robots),
        "bodies": simulation.world.m.nbody,
        "bare": frames / bare(simulation, moments),
        "picture": frames / pictures(take, moments),
        "film": frames / filmed(take, moments),
    }


def recorded(simulation: Simulation, frames: int) -> list[Moment]:
    """The states of a stretch of film, from time zero on."""
    world, found = simulation.world, []
    start = world.time
    for number in range(frames):
        run_until(simulation, start + number / FPS)
        seen = world.observe().kept()
        found.append(Moment(number / FPS, 0, Snapshot.of(seen.qpos, seen.welds)))
    return found


def bare(simulation: Simulation, moments: Sequence[Moment]) -> float:
    """Seconds of `mujoco.Renderer` with its defaults, the state put in and its geometry placed."""
    m = simulation.world.m
    m.vis.global_.offwidth, m.vis.global_.offheight = SIZE
    d = mujoco.MjData(m)
    with mujoco.Renderer(m, SIZE[1], SIZE[0], max_geom=m.ngeom + 100) as renderer:
        for moment in (moments[0], *moments):
            if moment is moments[0]:
                begin = perf_counter()
            d.qpos[:] = moment.shown.qpos
            mujoco.mj_kinematics(m, d)
            mujoco.mj_camlight(m, d)
            renderer.update_scene(d, "overview")
            seen = renderer.render()
        took = perf_counter() - begin
    assert np.ptp(seen) > 0
    return took


def pictures(take: Take, moments: Sequence[Moment]) -> float:
    """Seconds of our pictures, captions included."""
    work = Camerawork(take)
    try:
        work.picture(moments[0])
        begin = perf_counter()
        for moment in moments:
            work.picture(moment, 1 / FPS)
        return perf_counter() - begin
    finally:
        work.close()


def filmed(take: Take, moments: Sequence[Moment]) -> float:
    """Seconds of our pictures, written into a video."""
    with tempfile.TemporaryDirectory() as folder:
        reel = Reel(take, Path(folder) / "film.mp4", FPS)
        begin = perf_counter()
        for moment in moments:
            reel.until(moment)
        assert reel.frames == len(moments)
        reel.close()
        return perf_counter() - begin


def measure(quick: bool = False) -> dict[str, Any]:
    """Every size, in turns."""
    gl.prepare()  # the bare renderer chooses its GL when it is loaded, in the processes to come
    counts, frames = (ROBOTS[:2], 10) if quick else (ROBOTS, FRAMES)
    jobs = [partial(fresh, work, robots=count, frames=frames) for count in counts]
    found = interleaved(jobs, 1 if quick else 2)
    rows = [
        {
            **median(own),
            "spread": spread(own, "picture"),
            "ratio": ratio(
                [{"r": o["picture"]} for o in own], [{"r": o["bare"]} for o in own], "r"
            ),
        }
        for own in found
    ]
    return {"runs": len(found[0]), "frames": frames, "rows": rows}


def section(results: dict[str, Any]) -> str:
    """The report."""
    rows = [
        (
            row["robots"],
            row["bodies"],
            f"{row['bare']:.1f}",
            f"**{row['picture']:.1f}** ({row['spread']})",
            f"{row['ratio']:.2f}",
            f"{row['film']:.1f}",
        )
        for row in results["rows"]
    ]
    head = ("robots", "bodies", "bare renderer", "our pictures", "ours to bare", "our film")
    return "\n\n".join(
        [
            "## Pictures",
            f"Frames a second at {SIZE[0]} x {SIZE[1]}, of the same {results['frames']} states of"
            " steady production (the paper's example, then balanced trees) with the same model,"
            " one body per part, the whole pool. Bare: `mujoco.Renderer` with its defaults from the"
            " model's camera `overview`: kinematics, scene and picture. Ours: the same with our"
            " camera, welds that hold parts in place, and caption; the film also encodes H.264."
            f" Median (least–greatest) of {results['runs']} processes, all three in each.",
            table(head, rows),
        ]
    )


if __name__ == "__main__":
    serve(work)
