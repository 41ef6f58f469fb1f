"""From PAG or template to its canonical text, such that read ∘ write is the identity."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from factory.theory.lang.turns import quaternion_of, turn_of
from factory.theory.problem.pag import (
    PAG,
    RESERVED,
    AllowedOverlap,
    Assembly,
    Mix,
    Parameter,
    Value,
    is_label,
)
from factory.theory.problem.template import LOST, Failure, Law, Template


def write_pag(pag: PAG) -> str:
    """The canonical text of a PAG: one statement a line, numbers at full precision; parts that are
    copies of each other are one statement. `read_pag` of it gives the same PAG.

    Args:
        pag: the PAG.
    """
    count = [] if pag.count is None else [f"{pag.count} parts;"]
    allowed = map(write_allowance, pag.allowed)
    products = f"root = {pag.root};" if pag.mix is None else write_mix(pag.mix)
    lines = [*count, products, *allowed, *map(write_copies, rows_of_copies(pag))]
    return "\n".join(lines) + "\n"


def rows_of_copies(pag: PAG) -> Iterator[Sequence[Assembly]]:
    """The nodes of a PAG, copies together: parts that follow each other, `screw1`, `screw2`, ...,
    and differ in nothing but their places, which are their last parameters."""
    row: list[Assembly] = []
    for node in pag.nodes:
        following = f"{_shared_name(row[0])}{len(row) + 1}" if row else ""
        if node.label != following or _but_for_place(node) != _but_for_place(row[0]):
            yield from _parted(row, pag)
            row = []
        row.append(node)
    yield from _parted(row, pag)


def _parted(row: list[Assembly], pag: PAG) -> Iterator[Sequence[Assembly]]:
    """A row as it is if it can be one statement, else each node for itself."""
    name = _shared_name(row[0]) if row else ""
    if len(row) > 1 and is_label(name) and name not in (*RESERVED, *pag.by_label):
        yield row
    else:
        yield from ([node] for node in row)


def _shared_name(node: Assembly) -> str:
    """The name of copies of which a part is the first; "" for any other."""
    placed = not node.inputs and node.parameters and node.parameters[-1].name == "pos"
    return node.label[:-1] if placed and node.label.endswith("1") else ""


def _but_for_place(node: Assembly) -> tuple[object, ...]:
    """What copies have in common."""
    last = node.parameters[-1].name if node.parameters else ""
    return last, node.operation, node.inputs, node.parameters[:-1]


def write_copies(row: Sequence[Assembly]) -> str:
    """One statement: `screw[2] = atomic ( parameters ) at ( 0, 0, 0 ), ( 0, 0, 0.1 );`."""
    if len(row) == 1:
        return write_assembly(row[0])
    first = replace(
        row[0], label=f"{_shared_name(row[0])}[{len(row)}]", parameters=row[0].parameters[:-1]
    )
    places = ", ".join(write_value(node.parameters[-1].value) for node in row)
    return f"{write_assembly(first).removesuffix(';')} at {places};"


def write_mix(mix: Mix) -> str:
    """One statement: `mix = 3 truck, 1 van;` or, in order, `mix = truck, van, truck;`."""
    counts = (f"{count} {label}" for label, count in mix.counts)
    return f"mix = {', '.join(mix.sequence or counts)};"


def write_allowance(allowed: AllowedOverlap) -> str:
    """One statement: `allow ( peg, frame, 0.0005 );`."""
    return f"allow ( {', '.join([*allowed.parts, write_number(allowed.depth)])} );"


def write_assembly(node: Assembly) -> str:
    """One statement: `label = operation ( inputs, parameters );`."""
    arguments = [*node.inputs, *map(write_parameter, node.parameters)]
    inside = f" ( {', '.join(arguments)} )" if arguments else "()"
    return f"{node.label} = {node.operation}{inside};"


def write_parameter(parameter: Parameter) -> str:
    """One argument: `dwell = 2`; a rotation that is one in whole tenths of degrees as these."""
    name, value = parameter.name, parameter.value
    if name == "quat" and isinstance(value, tuple):
        turn = turn_of(value)
        if turn is not None and any(turn) and quaternion_of(turn) == value:
            name, value = "turn", turn
    return f"{name} = {write_value(value)}"


def write_value(value: Value) -> str:
    """A value as the language writes it. Raises ValueError for a text of several lines."""
    if isinstance(value, tuple):
        return f"( {', '.join(map(write_number, value))} )"
    return write_text(value) if isinstance(value, str) else write_number(value)


def write_number(value: float) -> str:
    """The shortest number that reads back as the same: 2 for 2.0, else Python's repr."""
    return repr(float(value)).removesuffix(".0")


def write_text(text: str) -> str:
    """A text in double quotes, a quote in it doubled."""
    if "\n" in text or "\r" in text:
        raise ValueError(f"a text of a PAG is one line, not {text!r}")
    return '"' + text.replace('"', '""') + '"'


def write_template(template: Template) -> str:
    """The canonical text of a template: one clause a line, written as the paper does.

    Args:
        template: the template.
    """
    failures = [*map(write_failure, template.failures)]
    defaults = ", ".join(f"{name} = {write_value(value)}" for name, value in template.parameters)
    parameters = ["geometry"] * template.geometry + [f"( {defaults} )"] * bool(defaults)
    optional = {
        "further": template.further,
        "instead": template.instead,
        "brought": template.brought,
        "failure": "" if template.failures == LOST else _braces(failures),
        "parameters": " and ".join(parameters),
    }
    clauses = [
        f"R = < {', '.join(template.robots)} >",
        f"j = {template.carrier}",
        f"~ = {_braces([' = '.join(map(str, c)) for c in template.identifications])}",
        f"<a; b> = < {', '.join(template.before)}; {', '.join(template.after)} >",
        f"F = {_law(template.law)}",
        *(f"{name} = {content}" for name, content in optional.items() if content),
    ]
    lines = [f"{template.name} = (R, j, ~, <a; b>, F) where", *(f"  {c};" for c in clauses)]
    return "\n".join(lines) + "\n"


def _braces(items: list[str]) -> str:
    return "{ " + ", ".join(items) + " }" if items else "{}"


def _law(law: Law) -> str:
    eps = law.eps if isinstance(law.eps, str) else write_number(law.eps)
    goals = ", ".join(map(str, law.goals))
    text = f"{law.name} on W to ( {goals} ) within {eps}"
    if law.dwell is None:
        return text
    return f"{text} for {law.dwell if isinstance(law.dwell, str) else write_number(law.dwell)}"


def write_failure(failure: Failure) -> str:
    """One failure: `residual > 0.0005 : again 2 then scrap`."""
    limit = "" if failure.limit is None else f" > {write_number(failure.limit)}"
    return f"{failure.test}{limit} : {' then '.join(map(str, failure.responses))}"
