"""Products of our own with true clearances: a chest of drawers, of which everything slides, and a
gearbox, which needs the lift. Nothing of them touches, on the way or when finished, in the engine's
own eyes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from tests.paths import ROOT, files_in

EXAMPLES = ROOT / "examples"
OWN = ["chest", "gearbox"]


def test_the_generator_writes_the_same_bytes(tmp_path: Path) -> None:
    subprocess.run([sys.executable, EXAMPLES / "make_meshes.py", tmp_path], check=True)
    made = files_in(tmp_path)
    kept = {f"{name}/{k}" for name in [*OWN, "peg"] for k in files_in(EXAMPLES / name)}
    assert len(made) == len(kept) > 0
    for path in tmp_path.rglob("*.obj"):
        assert path.read_bytes() == (EXAMPLES / path.relative_to(tmp_path)).read_bytes(), path.name
