"""Arms of users: any MJCF of one chain with a site `tool`."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from factory.api import InputError
from factory.apps.arms.body import Stand, standing
from factory.apps.arms.certifying import uncertified
from factory.apps.arms.model import KINDS, ArmModel
from factory.apps.arms.reach import ring_of
from tests.arm_models import random_way, shipped

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


def test_a_ring_is_where_the_tool_comes_to_all_heights() -> None:
    """The SCARA has to stand higher, and comes to no heights farther apart than its slide."""
    six, scara = shipped("six"), shipped("scara")
    ring = ring_of(six, 0.1, 0.3)
    assert ring is not None and ring.base == 0.10
    assert 0.1 < ring.inner < ring.at(0.41) < ring.outer < 1.0
    broad = ring_of(six, 0.1, 0.3, 0.1)
    assert broad is not None and broad.at(0.0) == broad.inner + 0.1
    assert broad.at(1.0) == broad.outer - 0.1
    low = ring_of(scara, 0.02, 0.15)
    assert low is None or low.base > 0.1 or low.outer < 0.6
    assert ring_of(scara, 0.1, 0.1 + 0.3) is None


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
