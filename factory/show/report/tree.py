"""The assembly tree of a report: nested lists, each label with room for its picture."""

from __future__ import annotations

from html import escape

from factory.problem.pag import PAG


def assembly_tree(pag: PAG, labels: dict[str, int]) -> str:
    """The tree, the product first."""
    made: dict[str, str] = {}
    for node in pag.postorder():
        inside = "".join(made.pop(label) for label in node.inputs)
        below = f"<ul>{inside}</ul>" if inside else ""
        made[node.label] = (
            f"<li>{_row(node.label, node.operation, labels, bool(inside))}{below}</li>"
        )
    return f'<ul class="tree">{made[pag.root]}</ul>'


def _row(label: str, operation: str, labels: dict[str, int], whole: bool) -> str:
    kind = "whole" if whole else "part"
    number = labels[label]
    return (
        f'<button class="node {kind}" data-label="{number}"><span class="picture"'
        f' data-picture="{number}"></span><span class="words"><b>{escape(label)}</b>'
        f"<small>{escape(operation)}</small></span></button>"
    )
