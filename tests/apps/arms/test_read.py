"""Arms from MJCF: what is read is what the engine compiles; what is no arm is refused by name."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from factory.api import InputError
from factory.apps.arms.body import Stand, standing
from factory.apps.arms.certifying import uncertified
from factory.apps.arms.model import KINDS, MODELS, ArmModel
from tests.arm_models import chain_in, random_way, shipped

LIMITS = (
    '<custom><numeric name="speed" data="1 2"/><numeric name="acceleration" data="3 4"/></custom>'
)
LINK = '<body pos="0 0 0.2">{}<geom size="0.05"/>'
FIRST = '<joint name="pan" axis="0 0 1" range="-90 90"/>'
SECOND = '<joint name="wrist" axis="0 1 0" range="-90 90"/>'
SITE = '<site name="tool" pos="0.1 0 0"/>'


def arm(
    first: str = FIRST,
    second: str = SECOND,
    site: str = SITE,
    beside: str = "",
    head: str = LIMITS,
    after: str = "",
) -> str:
    links = LINK.format(first) + LINK.format(second) + site + "</body>" + beside + "</body>"
    return f"<mujoco>{head}<worldbody>{links}</worldbody>{after}</mujoco>"


BAD = {
    "has no site 'tool'": arm(site='<site name="tip"/>'),
    "is not one chain: joint 'finger' is not between base and tool": arm(
        beside=LINK.format('<joint name="finger" range="0 9"/>') + "</body>"
    ),
    "says no speed of its joints": arm(head=""),
    "is a ball joint": arm(second='<joint name="wrist" type="ball" range="0 90"/>'),
    "has no joints": arm(first="", second=""),
    "joint 'wrist' has no limits": arm(second='<joint name="wrist" axis="0 1 0"/>'),
    "joint 'wrist' has a spring": arm(second=SECOND.replace("/>", ' stiffness="3"/>')),
    "has equality constraints or tendons": arm(
        after='<equality><joint joint1="pan" joint2="wrist"/></equality>'
    ),
    "has the acceleration [3.0, -4.0]": arm(head=LIMITS.replace("3 4", "3 -4")),
    "the engine cannot compile it: ": "<mujoco><arm/></mujoco>",
}
"""What is said of texts that are no arms."""


@pytest.mark.parametrize("words", BAD)
def test_what_is_no_arm_is_refused_by_name(words: str) -> None:
    with pytest.raises(InputError) as caught:
        chain_in(BAD[words], "ur.xml")
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.code == "BadArm" and words in diagnostic.message
    assert diagnostic.hint and str(diagnostic.position).startswith("ur.xml:")


def test_hints_say_what_would_be_valid() -> None:
    def hint(words: str) -> str:
        with pytest.raises(InputError) as caught:
            chain_in(BAD[words])
        return caught.value.diagnostics[0].hint

    assert hint("has no site 'tool'") == ('add <site name="tool"/> at the tool (its sites are tip)')
    assert hint("says no speed of its joints").startswith("speed = [...], 2 numbers above 0")
    assert "fingers" in hint("is not one chain: joint 'finger' is not between base and tool")


def test_torque_is_the_least_of_what_joint_and_drive_allow() -> None:
    drives = (
        '<actuator><position joint="pan" kp="1" forcerange="-9 7"/>'
        '<motor joint="wrist" gear="3" ctrlrange="-2 2"/></actuator>'
    )
    assert chain_in(arm(after=drives)).limits.torque.tolist() == [7.0, 6.0]
    weak = FIRST.replace("/>", ' actuatorfrcrange="-5 6"/>')
    assert chain_in(arm(first=weak, after=drives)).limits.torque.tolist() == [5.0, 6.0]


def surface(m: mujoco.MjModel, geom: int, ways: np.ndarray) -> np.ndarray:
    """The extent of a geom in directions in its own frame (k,), from its definition."""
    size, kind = m.geom_size[geom], m.geom_type[geom]
    flat = np.hypot(ways[:, 0], ways[:, 1])
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return np.full(len(ways), size[0])
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return np.asarray(size[0] + size[1] * np.abs(ways[:, 2]))
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return np.asarray(size[0] * flat + size[1] * np.abs(ways[:, 2]))
    if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        return np.linalg.norm(ways * size, axis=1)
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        start = m.mesh_vertadr[m.geom_dataid[geom]]
        count = m.mesh_vertnum[m.geom_dataid[geom]]
        return np.asarray((ways @ m.mesh_vert[start : start + count].T).max(axis=1))
    return np.asarray(np.abs(ways) @ size)


def geoms(wrist: str) -> str:
    rows = [
        'type="box" size="0.1 0.05 0.02"',
        'type="capsule" size="0.03" fromto="0 0 0 0.1 0.2 0.3"',
        'type="cylinder" size="0.04 0.1" euler="10 20 30"',
        'type="sphere" size="0.05" pos="0.1 0 0"',
        'type="ellipsoid" size="0.05 0.03 0.02"',
        'type="mesh" mesh="rock" pos="0 0.1 0" euler="5 6 7"',
    ]
    text = "".join(f'<geom name="g{k}" {row}/>' for k, row in enumerate(rows))
    points = np.random.default_rng(0).normal(size=(40, 3)) * 0.05
    vertices = " ".join(map(str, points.ravel().tolist()))
    asset = f'<asset><mesh name="rock" vertex="{vertices}"/></asset>'
    return arm(second=wrist + text, head=LIMITS + asset)


def test_bodies_contain_their_geoms_and_hardly_more() -> None:
    """In 500 directions, for each kind of geom; a cylinder's prism is 2 % wider."""
    text = geoms(SECOND)
    chain, m = chain_in(text), mujoco.MjModel.from_xml_string(text)
    d = mujoco.MjData(m)
    rng = np.random.default_rng(1)
    q = np.array([0.4, -0.7])
    d.qpos[:] = q
    mujoco.mj_forward(m, d)
    place, turn = chain.frames(q)
    for body in chain.bodies:
        geom = m.geom(body.name).id if body.name in ("g0", "g1", "g2", "g3", "g4", "g5") else -1
        if geom < 0:
            continue
        ways = rng.normal(size=(500, 3))
        ways /= np.linalg.norm(ways, axis=1)[:, None]
        points = place[body.frame] + body.points @ turn[body.frame].T
        extent = (ways @ points.T).max(axis=1) + body.radius - ways @ d.geom_xpos[geom]
        exact = surface(m, geom, ways @ d.geom_xmat[geom].reshape(3, 3))
        assert (extent >= exact - 1e-6).all(), body.name
        loose = {"g2": 1.025, "g4": 2.0}.get(body.name, 1.0 + 1e-5)
        assert (extent <= exact * loose + 1e-6).all(), body.name
    assert len(chain.bodies) == 8


@pytest.mark.parametrize("name", ["six", "scara"])
def test_the_shipped_arms_show_only_what_is_solid(name: str) -> None:
    """Each shown geom lies within the hull of what is solid of its link: nothing drawn sticks out
    of all that collides along any of 200 directions, and that reaches 20 mm further at most."""
    m = mujoco.MjModel.from_xml_path(str(MODELS / f"{name}.xml"))
    ways = np.random.default_rng(0).normal(size=(200, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    extents: dict[tuple[int, bool], np.ndarray] = {}
    for geom in range(m.ngeom):
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, m.geom_quat[geom])
        extent = surface(m, geom, ways @ turn.reshape(3, 3)) + ways @ m.geom_pos[geom]
        key = int(m.geom_bodyid[geom]), bool(m.geom_contype[geom])
        extents[key] = np.maximum(extents.get(key, -np.inf), extent)
    bodies = {body for body, _ in extents}
    for body in bodies:
        assert (extents[body, False] <= extents[body, True] + 1e-9).all(), m.body(body).name
        assert (extents[body, False] >= extents[body, True] - 0.02).all()


OWN = """<mujoco model="own">
  <compiler angle="degree" meshdir="shapes"/>
  <custom>
    <numeric name="speed" data="2 2 2 2 2 2 2"/>
    <numeric name="acceleration" data="16 16 16 16 16 16 16"/>
  </custom>
  <asset><mesh name="link" file="link.stl"/></asset>
  <default>
    <joint range="-170 170" armature="0.5" damping="0.2"/>
    <geom density="600" rgba="0.85 0.55 0.15 1"/>
  </default>
  <worldbody>
    <light pos="0 0 3"/>
    <body name="foot" pos="5 5 5"><geom type="cylinder" size="0.07 0.06" pos="0 0 0.06"/>
      <body name="l1" pos="0 0 0.16"><joint name="a1" axis="0 0 1"/>
        <geom type="capsule" size="0.05" fromto="0 0 0 0 0 0.14"/>
        <body name="l2" pos="0 0 0.18"><joint name="a2" axis="0 1 0" range="-120 120"/>
          <geom type="mesh" mesh="link"/>
          <body name="l3" pos="0 0 0.21"><joint name="a3" axis="0 0 1"/>
            <geom type="capsule" size="0.04" fromto="0 0 0.02 0 0 0.16"/>
            <body name="l4" pos="0 0 0.21"><joint name="a4" axis="0 1 0" range="-130 130"/>
              <geom type="capsule" size="0.04" fromto="0 0 0 0 0 0.16"/>
              <body name="l5" pos="0 0 0.2"><joint name="a5" axis="0 0 1" armature="0.15"/>
                <geom type="capsule" size="0.035" fromto="0 0 0.03 0 0 0.14"/>
                <body name="l6" pos="0 0 0.2">
                  <joint name="a6" axis="0 1 0" range="-120 120" armature="0.1"/>
                  <geom type="capsule" size="0.035" fromto="0 0 0 0 0 0.05"/>
                  <body name="tool" pos="0 0 0.1"><joint name="a7" axis="0 0 1" armature="0.1"/>
                    <geom type="cylinder" size="0.03 0.015"/>
                    <site name="tool" pos="0 0 0.02"/>
                  </body>
                </body>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <contact><exclude body1="l1" body2="l3"/></contact>
</mujoco>
"""
"""Seven axes in degrees, a link that is a mesh, a body called `tool`, and a foot that overlaps the
first link."""

BOX = """root = x;
x = mate ( a, b );
a = atomic ( box = (0.08, 0.07, 0.04), pos = (0, 0, 0.02) );
b = atomic ( box = (0.03, 0.03, 0.03), pos = (0, 0, 0.0552) )"""


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """The file of the arm."""
    (tmp_path / "shapes").mkdir()
    link = trimesh.creation.capsule(height=0.13, radius=0.045, count=[12, 12])
    link.apply_translation([0.0, 0.0, 0.03])
    link.export(tmp_path / "shapes" / "link.stl")
    path = tmp_path / "seven-axes.xml"
    path.write_text(OWN)
    return path


def test_what_a_file_leaves_out_of_contact_stays_so(own: Path) -> None:
    """And the base and the first link, which overlap."""
    root = standing(ArmModel.of(str(own)), Stand((0.0, 0.0, 0.1), 0.0, 0.008))
    pairs = {(p.get("body1"), p.get("body2")) for p in root.findall("contact/exclude")}
    assert pairs == {("l1", "l3"), ("carriage", "l1")}
    names = [body.get("name") for body in root.iter("body")]
    assert names.count("tool") == 1 and "own_tool" in names


@pytest.mark.parametrize(
    ("change", "code", "words"),
    [
        (('<numeric name="speed" data="2 2 2 2 2 2 2"/>', ""), "BadArm", "no speed"),
        (('type="mesh"', 'type="mish"'), "BadArm", "cannot compile"),
    ],
)
def test_a_file_that_is_no_arm_is_refused(
    own: Path, change: tuple[str, str], code: str, words: str
) -> None:
    own.write_text(OWN.replace(*change))
    with pytest.raises(InputError) as error:
        ArmModel.of(str(own))
    (why,) = error.value.diagnostics
    assert why.code == code and words in why.message and why.hint


def test_an_arm_that_is_not_there_is_refused(tmp_path: Path) -> None:
    for asked in ("seven", str(tmp_path / "none.xml")):
        with pytest.raises(InputError) as error:
            ArmModel.of(asked)
        (why,) = error.value.diagnostics
        assert why.code == "Usage" and all(kind in why.hint for kind in KINDS)


def test_a_way_is_certified_only_if_nothing_between_samples_is_near() -> None:
    """A needle between two samples, which those do not come near, is seen."""
    chain = shipped("six")
    way = random_way(chain, 3)
    at = 0.5137 * way.length
    needle = way.at(np.array([at]))[0][0]

    def margins(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        reach = chain.levers().max(axis=0)
        far = np.abs(q - needle) @ reach
        return far - 1e-3, np.full(len(q), 7)

    blocked = uncertified(chain, way, (0.0, way.length), chain.bodies, margins)
    assert blocked is not None and blocked.pair == 7
    clear = uncertified(chain, way, (0.0, 0.4 * way.length), chain.bodies, margins)
    assert clear is None
