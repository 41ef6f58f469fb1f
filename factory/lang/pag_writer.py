"""From PAG to its canonical text, such that read ∘ write is the identity."""

from __future__ import annotations

from factory.problem.pag import PAG, Assembly, Value


def write_pag(pag: PAG) -> str:
    """The canonical text of a PAG: one statement a line, numbers at full precision."""
    count = [] if pag.count is None else [f"{pag.count} parts;"]
    lines = [*count, f"root = {pag.root};", *map(write_assembly, pag.nodes)]
    return "\n".join(lines) + "\n"


def write_assembly(node: Assembly) -> str:
    """One statement: `label = operation ( inputs, parameters );`."""
    arguments = [*node.inputs, *(f"{p.name} = {write_value(p.value)}" for p in node.parameters)]
    inside = f" ( {', '.join(arguments)} )" if arguments else "()"
    return f"{node.label} = {node.operation}{inside};"


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
