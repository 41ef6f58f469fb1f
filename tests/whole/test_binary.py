"""The engine's model, kept beside the MJCF: it is what was compiled, to the bit, or is replaced."""

from __future__ import annotations

from pathlib import Path

from factory.apps.exports.binary import beside


def test_no_binary_lies_beside_a_device_or_upon_the_mjcf(tmp_path: Path) -> None:
    assert beside(Path("/dev/null")) is None
    assert beside(tmp_path) is None
    assert beside(tmp_path / "m.xml") == tmp_path / "m.mjb"
    assert beside(tmp_path / "m.mjb") == tmp_path / "m.mjb.mjb"
