"""The layout against the engine: bodies are where the certificate says, and nothing touches."""

from __future__ import annotations

import numpy as np
import pytest

from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.certificate import KINDS, NAMES
from factory.floor.layout.layout import Box, Layout
from factory.support.settings import Settings
from tests.layout_values import STYLES, random_layout, row_of_inserts
from tests.pag_values import SHAPES

mujoco = pytest.importorskip("mujoco")


def laid_out(seed: int) -> Layout:
    """A layout of another shape and style for each seed."""
    shape, style = SHAPES[seed % len(SHAPES)], STYLES[seed % len(STYLES)]
    return random_layout(7 + seed, seed, shape, style, True)


@pytest.mark.parametrize("number", range(8))
def test_nothing_touches(number: int) -> None:
    """Two or three units, every robot with a speed and a gain of its own."""
    layout = laid_out(number)
    run = Simulation(
        layout, RunRequest("mujoco", units=2 + number % 2, seed=number, jitter=0.3)
    ).run()
    assert run.trouble is None, str(run.trouble)
    assert run.refines_net
    assert run.physics is not None
    assert run.physics.unintended_contacts == 0, run.physics.contacts


@pytest.mark.parametrize("number", range(5))
def test_bodies_are_inside_their_regions(number: int) -> None:
    """Every geom that can collide, at both ends of its robot's guidepath."""
    from factory.engine.mjcf.loading import load
    from factory.engine.mjcf.model import build_model
    from factory.theory.problem.robot_types import load_catalogue

    layout = laid_out(number) if number < 4 else row_of_inserts()
    copies = {leaf.label: 1 for leaf in layout.factory.leaves}
    m = load(build_model(layout, load_catalogue(), copies, Settings(timestep=0.002)))
    d = mujoco.MjData(m)
    looked_at = set()
    for end in (0, 1):
        for path, robot in zip(layout.guidepaths, layout.factory.robots, strict=True):
            joint = m.joint(f"{robot.name}/slide").id
            d.qpos[m.jnt_qposadr[joint]] = (path.reach, path.length)[end]
        mujoco.mj_kinematics(m, d)
        for geom in range(m.ngeom):
            name = m.geom(geom).name
            if m.geom_contype[geom] == 0 or name == "ground" or name.startswith("part/"):
                continue
            if name.endswith("/pad"):  # it is between the part and the housing
                continue
            looked_at.add(name.rpartition("/")[2])
            assert inside(layout, name, *bounds(m, d, geom)), name
    assert {"carriage", "mast", "arm", "post", "boom", "belt"} <= looked_at


def bounds(m: object, d: object, geom: int) -> tuple[Box, tuple[float, float]]:
    """Plan and z range of a box-shaped geom."""
    middle = d.geom_xpos[geom]  # type: ignore[attr-defined]
    turn = d.geom_xmat[geom].reshape(3, 3)  # type: ignore[attr-defined]
    half = np.abs(turn) @ m.geom_size[geom]  # type: ignore[attr-defined]
    low, high = middle - half, middle + half
    return (low[0], high[0], low[1], high[1]), (low[2], high[2])


def inside(layout: Layout, name: str, box: Box, z: tuple[float, float]) -> bool:
    """Whether some region of that kind holds the box; a micrometre for the engine's six digits."""
    owner, _, kind = name.rpartition("/")
    stands = {"outfeed": "shed"}.get(owner, "housing")
    own = {"belt": "outfeed", "tray": "outfeed", "shutter": "shed", "roof": "shed", "back": "shed"}
    own |= {"lid": "housing"}
    plain = kind.rstrip("-1")
    wanted = own.get(kind) or {
        "wall": stands,
        "end": "housing",
        "upright": "shed",
        "leg": "outfeed",
    }.get(plain, kind)
    slack = 2e-6
    assert layout.certificate is not None
    for region in layout.certificate.regions:
        whose = layout.factory.robots[region.robot].name
        if KINDS[region.kind] != wanted or owner not in (
            whose,
            f"feeder/{region.label}",
            "outfeed",
        ):
            continue
        plan, (low, high) = region.box, region.z
        if kind == "mast":
            low -= 0.003  # it stands in its carriage
        if (
            box[0] >= plan[0] - slack
            and box[1] <= plan[1] + slack
            and box[2] >= plan[2] - slack
            and box[3] <= plan[3] + slack
            and z[0] >= low - slack
            and z[1] <= high + slack
        ):
            return True
    return False


def test_layers_are_those_of_the_bodies() -> None:
    certificate = laid_out(0).certificate
    assert certificate is not None
    assert tuple(name for name, _, _ in certificate.layers) == NAMES
