"""From template to its canonical text, such that read ∘ write is the identity."""

from __future__ import annotations

from factory.lang.pag_writer import write_number, write_value
from factory.problem.template import Law, Point, Template


def write_template(template: Template) -> str:
    """The canonical text of a template: one clause a line, written as the paper does."""
    clauses = [
        f"R = < {', '.join(template.robots)} >",
        f"j = {template.carrier}",
        f"~ = {_braces([' = '.join(map(write_point, c)) for c in template.identifications])}",
        f"<a; b> = < {', '.join(template.before)}; {', '.join(template.after)} >",
        f"F = {_law(template.law)}",
        *([f"further = {template.further}"] if template.further else []),
        *_parameters(template),
    ]
    lines = [f"{template.name} = (R, j, ~, <a; b>, F) where", *(f"  {c};" for c in clauses)]
    return "\n".join(lines) + "\n"


def write_point(point: Point) -> str:
    """A point: `A1`, `A1 + 2r`."""
    if not point.multiple:
        return f"{point.end}{point.robot}"
    size = "" if abs(point.multiple) == 1 else write_number(abs(point.multiple))
    return f"{point.end}{point.robot} {'+' if point.multiple > 0 else '-'} {size}r"


def _braces(items: list[str]) -> str:
    return "{ " + ", ".join(items) + " }" if items else "{}"


def _law(law: Law) -> str:
    eps = law.eps if isinstance(law.eps, str) else write_number(law.eps)
    goals = ", ".join(map(write_point, law.goals))
    text = f"{law.name} on W to ( {goals} ) within {eps}"
    if law.dwell is None:
        return text
    return f"{text} for {law.dwell if isinstance(law.dwell, str) else write_number(law.dwell)}"


def _parameters(template: Template) -> list[str]:
    defaults = ", ".join(f"{name} = {write_value(value)}" for name, value in template.parameters)
    parts = ["geometry"] * template.geometry + [f"( {defaults} )"] * bool(defaults)
    return [f"parameters = {' and '.join(parts)}"] if parts else []
