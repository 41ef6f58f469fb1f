"""The laws of `factory.api`, as functions from a source tree to their breaches."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from tests.house import House, Module

MOST = 100
"""How many names the interface may have."""

ENTRY = re.compile(r"^ +(\w+(?:, \w+)*):", re.M)
"""A line of a docstring that explains names."""


def homes(house: House) -> Iterator[tuple[str, str]]:
    """The names of the interface, each with its module, as its table says."""
    for node in house.modules["api"].tree.body if "api" in house.modules else ():
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Dict):
            for home, names in ast.literal_eval(node.value).items():
                yield from ((name, home) for name in names.split())


def interface(house: House) -> Iterator[str]:
    """Names past the most that the interface may have, names that two modules give, and names that
    a type checker sees elsewhere than at run time."""
    table = [*homes(house)]
    if len(table) > MOST:
        yield f"api: {len(table)} names; at most {MOST}"
    names = [name for name, _ in table]
    yield from (f"api.{name}: twice" for name in sorted({n for n in names if names.count(n) > 1}))
    at_run = {f"{home}.{name}" for name, home in table}
    for_types = house.names(house.modules["api"]) if table else set()
    yield from (f"api: {name} is in one list only" for name in sorted(at_run ^ for_types))


def undocumented(house: House) -> Iterator[str]:
    """Names of the interface without a docstring where they are defined, and docstrings that do not
    explain each public attribute or argument under `Attributes:` or `Args:`."""
    for name, home in homes(house):
        if f"{home}.{name}" in house.modules:
            continue
        title, text, parts = documented(house.modules[home], name)
        if not text:
            yield f"api.{name}: no docstring in {home}"
        explained = {
            one
            for entry in ENTRY.finditer(text.partition(f"{title}:\n")[2])
            for one in entry[1].split(", ")
        }
        for part in parts:
            if part not in explained:
                yield f"api.{name}: '{part}' is not under {title}"


def documented(module: Module, name: str) -> tuple[str, str, list[str]]:
    """The section that a name's docstring needs, the docstring, and what that section explains.
    A name that its module only imports is explained by the module's docstring."""
    body = module.tree.body
    for node, after in zip(body, [*body[1:], None], strict=True):
        match node:
            case ast.ClassDef(name=there) if there == name:
                return "Attributes", ast.get_docstring(node) or "", fields(node)
            case ast.FunctionDef(name=there) if there == name:
                every = (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
                return "Args", ast.get_docstring(node) or "", [one.arg for one in every]
            case ast.Assign(targets=[ast.Name(id=there)]) if there == name:
                text = after.value if isinstance(after, ast.Expr) else None
                return "", text.value if isinstance(text, ast.Constant) else "", []
    return "", ast.get_docstring(module.tree) or "", []


def fields(node: ast.ClassDef) -> list[str]:
    """The public attributes that a class declares."""
    declared = (one for one in node.body if isinstance(one, ast.AnnAssign))
    targets = (one.target for one in declared if "ClassVar" not in ast.unparse(one.annotation))
    names = [one.id for one in targets if isinstance(one, ast.Name)]
    return [name for name in names if not name.startswith("_")]
