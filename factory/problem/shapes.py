"""What the parts of a product say of their geometry, told without computing any."""

from __future__ import annotations

from factory.problem.pag import PAG

SHAPED = frozenset({"mesh", "box", "cylinder", "sphere", "pos"})
"""Parameters that give a part a shape or a place of its own."""


def is_shaped(pag: PAG) -> bool:
    """Whether some part has a shape or a place of its own. The default boxes of a product in which
    none has can always slide: each sub-assembly is an interval of a path to and fro in a lattice,
    so the next interval goes on ahead of it along x and along y."""
    return any(p.name in SHAPED for node in pag.parts() for p in node.parameters)


def is_plain(pag: PAG) -> bool:
    """Whether no part says more of its geometry than its colour: nothing can be wrong with it."""
    return all(p.name == "rgba" for node in pag.parts() for p in node.parameters)
