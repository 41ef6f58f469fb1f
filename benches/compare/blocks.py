"""WorkBenchMark's block products: not in reach, said so."""

from __future__ import annotations

from typing import Any


def measure(quick: bool = False) -> dict[str, Any]:
    """Nothing."""
    return {"data": False}


def section(results: dict[str, Any]) -> str:
    """The report."""
    return f"## Blocks\n\n{TEXT}"


TEXT = """\
WorkBenchMark has 400 tasks of 2 to 12 and more DUPLO bricks in four tiers (W. Ma, D. Swoboda, M.
Tschesche, T. Hofmann, 2026, [arXiv 2606.19358](https://arxiv.org/abs/2606.19358),
[data](https://github.com/WorkBenchMark/dataset)). **Its data was not in reach** where this was
written, so there is no figure. A comparison would have to say: the benchmark asks a robot to
perceive bricks that lie about, grasp them and press studs together; here poses are given, bricks
are boxes without studs, and robots come to feeders. What can be compared is the order of assembly
and the exactness of the product, not perception or grasping."""
