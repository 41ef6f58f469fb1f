"""Arms by their MJCF: those that are shipped, and the user's own.

A user's file is taken as the engine writes it again, so that angles are in radians, what it
includes is in it, and its defaults are where they are.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from factory.api import InputError
from factory.apps.arms.chain import SerialChain
from factory.apps.arms.read import bad_arm, chain_of
from factory.support.engine import mujoco
from factory.support.errors import usage_error

MODELS = Path(__file__).parent / "mjcf"
"""Where the arms of the catalogue are."""

KINDS = tuple(sorted(file.stem for file in MODELS.glob("*.xml")))
"""The arms that are shipped."""

STIFFNESS = 60.0
"""That of drives for which a file has no gains [rad/s]."""


@dataclass(frozen=True, eq=False)
class ArmModel:
    """A kind of arm.

    Attributes:
        kind: its name, as a robot type.
        file: where its MJCF is from.
        text: the MJCF.
        chain: what was read of it, to the site `tool`.
        gains: of its drives: kp, kv, greatest torque [N m/rad, N m s/rad, N m].
        files: its meshes by name.
    """

    kind: str
    file: Path
    text: str = field(repr=False)
    chain: SerialChain = field(repr=False)
    gains: tuple[tuple[float, float, float], ...] = field(repr=False)
    files: Mapping[str, bytes] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, asked: str) -> ArmModel:
        """That of a kind that is shipped, or of a file. Raises InputError: Usage where there is
        none, BadArm where it cannot be used."""
        if asked in KINDS:
            file = MODELS / f"{asked}.xml"
            return arm_model(asked, file, file.read_text("utf-8"), {})
        file = Path(asked)
        if file.suffix != ".xml" or not file.is_file():
            hint = f"arms: {', '.join(KINDS)}; or the path of an MJCF file"
            raise usage_error(f"there is no arm '{asked}'", hint)
        return own_arm(file)

    def root(self) -> Element:
        """The MJCF."""
        return ElementTree.fromstring(self.text)

    def compiled(self, root: Element) -> mujoco.MjModel:
        """The engine's model of an MJCF with this arm in it."""
        text = ElementTree.tostring(root, encoding="unicode")
        return mujoco.MjModel.from_xml_string(text, dict(self.files))


def own_arm(
    file: Path, tool: str = "tool", values: Mapping[str, Sequence[float]] | None = None
) -> ArmModel:
    """The arm of a user's file. Raises InputError (BadArm).

    Args:
        file: its MJCF.
        tool: name of the site at its flange.
        values: `speed` and `acceleration` of its joints, in place of those in the file.
    """
    kind = re.sub(r"\W", "_", file.stem, flags=re.ASCII)
    kind = kind if kind[:1].isalpha() and kind not in KINDS else f"arm_{kind}"
    try:
        spec = mujoco.MjSpec.from_file(str(file))
        m = spec.compile()
        root = ElementTree.fromstring(spec.to_xml())
    except ValueError as error:
        raise _not_compiled(str(file), error) from error
    if tool not in [site.get("name") for site in root.iter("site")]:
        chain_of(m, file.name, tool)  # which says so
    files = dict[str, bytes]()
    compiler = root.find("compiler")
    folder = file.parent / (compiler.get("meshdir", "") if compiler is not None else "")
    for mesh in root.findall("asset/mesh"):
        if (path := mesh.get("file")) is not None:
            name = f"{kind}_{len(files)}{Path(path).suffix}"
            files[name] = (folder / path).read_bytes()
            if "name" not in mesh.attrib:
                mesh.set("name", Path(path).stem)
            mesh.set("file", name)
            mesh.attrib.pop("content_type", None)
    for numeric in root.findall("custom/numeric"):
        numeric.attrib.pop("size", None)
    for name, row in (values or {}).items():
        said = root.find(f"custom/numeric[@name='{name}']")
        if said is None:
            custom = root.find("custom")
            custom = ElementTree.SubElement(root, "custom") if custom is None else custom
            said = ElementTree.SubElement(custom, "numeric", name=name)
        said.set("data", " ".join(map(repr, row)))
    if tool != "tool":
        _call_tool(root, tool)
    if compiler is not None:
        for key in ("meshdir", "texturedir", "assetdir"):
            compiler.attrib.pop(key, None)
    return arm_model(kind, file, ElementTree.tostring(root, encoding="unicode"), files)


def _call_tool(root: Element, name: str) -> None:
    """Call the site of a name `tool`, and another site of that name otherwise."""
    for site in root.iter("site"):
        if site.get("name") in (name, "tool"):
            site.set("name", "tool" if site.get("name") == name else "tool/of its file")


def _not_compiled(file: str, error: ValueError) -> InputError:
    words = " ".join(str(error).split())
    return bad_arm(file, f"the engine cannot compile it: {words}", "an arm is a file of valid MJCF")


def arm_model(kind: str, file: Path, text: str, files: Mapping[str, bytes]) -> ArmModel:
    """The arm of an MJCF as the engine writes it. Raises InputError (BadArm).

    Args:
        kind: its name, as a robot type.
        file: where it is from.
        text: the MJCF.
        files: its meshes by name.
    """
    try:
        m = mujoco.MjModel.from_xml_string(text, dict(files))
    except ValueError as error:
        raise _not_compiled(file.name, error) from error
    chain = chain_of(m, file.name)
    return ArmModel(kind, file, text, chain, tuple(_gains(m, chain)), files)


def _gains(m: mujoco.MjModel, chain: SerialChain) -> list[tuple[float, float, float]]:
    """The gains of position servos of a file; for a joint without one those of a drive that is
    critically damped with the inertia that the joint moves where the file draws it."""
    gains = list[tuple[float, float, float]]()
    servos = {
        int(m.actuator_trnid[a, 0]): a
        for a in range(m.nu)
        if m.actuator_trntype[a] == mujoco.mjtTrn.mjTRN_JOINT and m.actuator_biasprm[a, 1] < 0
    }
    for joint, torque in enumerate(chain.limits.torque.tolist()):
        force = torque if np.isfinite(torque) else 1e4
        inertia = float(m.dof_M0[m.jnt_dofadr[joint]])
        kp, kv = inertia * STIFFNESS**2, 2 * inertia * STIFFNESS
        if joint in servos:
            bias = m.actuator_biasprm[servos[joint]]
            kp, kv = -float(bias[1]), -float(bias[2]) or kv
        gains.append((kp, kv, force))
    return gains
