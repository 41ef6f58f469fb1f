"""Mutants of the package: what tests notice of small changes in its decisions.

`python -m benches.mutants draw --seed S --count N [ROOM…]` draws changes by lines and adds them to
the list, `benches/mutants.toml`. `python -m benches.mutants run [ROOM…] --tests PATH…` applies each
change of the rooms to a copy of the project, runs the tests there, and prints which test failed
first (`--all`: every test that fails); `--write then` and `--write now` keep that in the list.
A room is a folder, as in `factory/floor/mating`, or a file. Without `--tests` the tests are those
that the list names for the room. A mutant that changes nothing that can be told has the
reason in the list, `equivalent`, and is not run."""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
LIST = ROOT / "benches" / "mutants.toml"
LEFT = (".*", "__pycache__", "_build", "build", "dist", "renders")
"""What no test needs a copy of."""

COLUMNS = ("then", "now")
"""What the list keeps of runs: which test failed first, "" if none did."""

ASIDE = ("annotation", "returns", "decorator_list")
"""Fields of nodes in which nothing is decided."""

Mutant = dict[str, Any]
Change = tuple[int, str, str]
"""The number of a line, the line, and what it becomes, both without indentation."""

Spot = tuple[int, int, int, str]
"""A line, the bytes of it from here to there, and what replaces them."""

COMPARED = {
    **{ast.Lt: "<=", ast.LtE: "<", ast.Gt: ">=", ast.GtE: ">", ast.Eq: "!=", ast.NotEq: "=="},
    **{ast.Is: "is not", ast.IsNot: "is", ast.In: "not in", ast.NotIn: "in"},
}
COMPUTED = {ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*")}
CALLED = {"min": "max", "max": "min", "any": "all", "all": "any"}


def changes(source: str) -> dict[int, list[Change]]:
    """What may be changed in a source, by lines."""
    lines, found = [line.encode() for line in source.splitlines()], dict[int, list[Change]]()
    for row, start, end, text in spots(ast.parse(source), lines):
        line = lines[row - 1]
        after = line[:start] + text.encode() + line[end:]
        change = (row, line.decode().strip(), after.decode().strip())
        found.setdefault(row, []).append(change)
    return found


def spots(node: Any, lines: list[bytes]) -> Iterator[Spot]:
    """The places in a node where a decision can be changed; what texts show is none."""
    if isinstance(node, ast.JoinedStr):
        return
    for name, value in ast.iter_fields(node):
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and name not in ASIDE:
                yield from spots(child, lines)
    row = getattr(node, "lineno", 0)
    if row and row == node.end_lineno:
        yield from ((row, *one) for one in replacements(node, lines[row - 1]))
    if isinstance(node, ast.If | ast.IfExp | ast.While):
        test = node.test
        if test.lineno == test.end_lineno:
            start, end = test.col_offset, test.end_col_offset or 0
            said = lines[test.lineno - 1][start:end].decode()
            yield test.lineno, start, end, f"(not ({said}))"


def replacements(node: ast.AST, line: bytes) -> Iterator[tuple[int, int, str]]:
    """What can stand for a node, or for a part of it, that lies in one line."""
    match node:
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in COMPARED:
            yield left.end_col_offset or 0, right.col_offset, f" {COMPARED[type(op)]} "
        case ast.BinOp(left=left, op=op, right=right) if type(op) in COMPUTED:
            start, end = left.end_col_offset or 0, right.col_offset
            between, (sign, other) = line[start:end].decode(), COMPUTED[type(op)]
            if not any("'" in ast.unparse(side) for side in (left, right)):
                yield start, end, between.replace(sign, other)
        case ast.BoolOp(op=op, values=[left, right, *_]):
            start, end = left.end_col_offset or 0, right.col_offset
            words = ("and", "or") if isinstance(op, ast.And) else ("or", "and")
            yield start, end, line[start:end].decode().replace(*words)
        case ast.Constant(value=bool(value)):
            yield node.col_offset, node.end_col_offset or 0, str(not value)
        case ast.Constant(value=int() | float() as value):
            more = value + 1 if isinstance(value, int) or not value else 2 * value
            yield node.col_offset, node.end_col_offset or 0, repr(more)
        case ast.Name(id=name) if name in CALLED and line[node.end_col_offset :][:1] == b"(":
            yield node.col_offset, node.end_col_offset or 0, CALLED[name]
        case ast.Return(value=ast.expr() as value) if ast.unparse(value) != "None":
            yield node.col_offset, node.end_col_offset or 0, "return None"
        case ast.Continue() | ast.Break() | ast.AugAssign() | ast.Expr(value=ast.Call()):
            yield node.col_offset, node.end_col_offset or 0, "pass"


def within(file: str, rooms: Sequence[str]) -> bool:
    return any(file == room or file.startswith(room.rstrip("/") + "/") for room in rooms)


def drawn(rooms: Sequence[str], seed: int, count: int) -> list[Mutant]:
    """Mutants of so many lines: each line that decides something is as likely as another."""
    rng, every = random.Random(seed), list[tuple[str, list[Change]]]()
    for file in sorted(path.relative_to(ROOT).as_posix() for path in ROOT.glob("factory/**/*.py")):
        if rooms and not within(file, rooms):
            continue
        by_line = changes((ROOT / file).read_text(encoding="utf-8"))
        every += [(file, by_line[row]) for row in sorted(by_line)]
    found = list[Mutant]()
    for file, choices in rng.sample(every, count):
        line, before, after = rng.choice(choices)
        found.append({"file": file, "line": line, "before": before, "after": after})
    return sorted(found, key=lambda one: (one["file"], one["line"]))


def mutated(source: str, mutant: Mutant) -> str | None:
    """The source with a change, at the line nearest to where it was drawn; None where that is
    gone."""
    lines = source.splitlines(keepends=True)
    rows = [row for row, line in enumerate(lines, 1) if line.strip() == mutant["before"]]
    if not rows:
        return None
    row = min(rows, key=lambda row: abs(row - mutant["line"])) - 1
    lines[row] = lines[row].replace(mutant["before"], mutant["after"])
    return "".join(lines)


def failing(copy: Path, tests: Sequence[str], limit: float, every: bool) -> list[str]:
    """The tests that fail in a copy of the project."""
    words = [sys.executable, "-m", "pytest", "-q", "--tb=no", "-p", "no:cacheprovider"]
    words += ["-m", "not slow", *([] if every else ["-x"]), *tests]
    options = {"capture_output": True, "text": True, "check": False, "timeout": limit}
    try:
        done = subprocess.run(words, cwd=copy, env=os.environ | {"PYTHONPATH": ""}, **options)
    except subprocess.TimeoutExpired:
        return ["no end"]
    names = re.findall(r"^(?:FAILED|ERROR) (.*?)(?: - .*)?$", done.stdout, re.M)
    return names or ([] if done.returncode == 0 else [f"status {done.returncode}"])


def wanted_of(mutants: Sequence[Mutant], rooms: Sequence[str]) -> list[Mutant]:
    """The mutants of some rooms, of all where none is named, that change what can be told."""
    return [
        one
        for one in mutants
        if "equivalent" not in one and (not rooms or within(one["file"], rooms))
    ]


def run(kept: dict[str, Any], asked: argparse.Namespace) -> None:
    """Each mutant of the rooms in turn, and how many were killed."""
    wanted = wanted_of(kept["mutant"], asked.rooms)
    killed = 0
    with tempfile.TemporaryDirectory() as folder:
        copy = shutil.copytree(ROOT, Path(folder) / "copy", ignore=shutil.ignore_patterns(*LEFT))
        for one in wanted:
            path, names = copy / one["file"], ["gone"]
            source = path.read_text(encoding="utf-8")
            room = max((room for room in kept["tests"] if within(one["file"], [room])), key=len)
            if (text := mutated(source, one)) is not None:
                path.write_text(text, encoding="utf-8")
                names = failing(copy, asked.tests or kept["tests"][room], asked.limit, asked.all)
                path.write_text(source, encoding="utf-8")
            killed += names not in ([], ["gone"])
            told = f"{one['file']}:{one['line']} {one['after']}\n    {names or 'survives'}"
            print(told, flush=True)
            if asked.write:
                one[asked.write] = names[0] if names else ""
                LIST.write_text(written(kept), encoding="utf-8")
    print(f"{killed} of {len(wanted)} killed")


def written(kept: dict[str, Any]) -> str:
    """The list as a file."""
    tables = [("[tests]", kept["tests"]), *(("[[mutant]]", one) for one in kept["mutant"])]
    return "\n".join(head + "\n" + "".join(map(_row, table.items())) for head, table in tables)


def _row(entry: tuple[str, Any]) -> str:
    key, value = entry
    name = key if key.isidentifier() else json.dumps(key)
    return f"{name} = {json.dumps(value, ensure_ascii=False)}\n"


def main(words: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m benches.mutants", description=__doc__)
    parser.add_argument("what", choices=["draw", "run"])
    parser.add_argument("rooms", nargs="*", metavar="ROOM")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--tests", nargs="+", metavar="PATH")
    parser.add_argument("--limit", type=float, default=600.0, help="seconds for each mutant")
    parser.add_argument("--all", action="store_true", help="print every test that fails")
    parser.add_argument("--write", choices=COLUMNS, help="keep what was found in the list")
    asked = parser.parse_args(words)
    kept = tomllib.loads(LIST.read_text(encoding="utf-8")) if LIST.exists() else {}
    kept.setdefault("tests", {}), kept.setdefault("mutant", [])
    if asked.what == "run":
        return run(kept, asked)
    kept["mutant"] += drawn(asked.rooms, asked.seed, asked.count)
    LIST.write_text(written(kept), encoding="utf-8")


if __name__ == "__main__":
    main()
