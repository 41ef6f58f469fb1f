"""Logs of cells: judged, shown and continued from the file alone, which takes nothing from any
other file."""

from __future__ import annotations

from pathlib import Path

from tests.apps.arms.test_own_arm import BOX, own
from tests.command_line import Terminal

__all__ = ["own"]


def test_an_arm_of_a_user_is_in_the_log(own: Path, tmp_path: Path, run: Terminal) -> None:
    """With its meshes, and with what it leaves out of contact."""
    file, log = tmp_path / "box.pag", tmp_path / "box.log"
    file.write_text(BOX)
    done = run("run", file, "--arm", own, "--units", "1", "--log", log, "--json")
    assert done.status == 0, done.err
    for path in (own, tmp_path / "shapes" / "link.stl"):
        path.unlink()
    judged = run("monitor", log, "--json")
    assert judged.status == 0 and judged.json["verdict"]["succeeded"], judged.err
