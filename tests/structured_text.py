"""An interpreter of the Structured Text that is exported, for tests: a compiler of our subset of
IEC 61131-3 to Python. It is as strict as compilers of PLCs are: names that differ by case only or
are keywords, names that are not declared, arrays of no named type, types that do not fit and whole
numbers that overflow are errors.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
from lark import Lark, Token, Tree

from factory.apps.plc.signals import Commands, Sensed

GRAMMAR = r"""
start: (data_type | function | block | program | configuration)*
data_type: "TYPE" NAME ":" (structure | array) ";" "END_TYPE"
structure: "STRUCT" declaration+ "END_STRUCT"
array: "ARRAY" "[" WHOLE ".." WHOLE "]" "OF" NAME
declaration: NAME ":" NAME ";"
function: "FUNCTION" NAME ":" NAME section* body "END_FUNCTION"
block: "FUNCTION_BLOCK" NAME section* body "END_FUNCTION_BLOCK"
program: "PROGRAM" NAME section* body "END_PROGRAM"
section: SECTION declaration+ "END_VAR"
configuration: "CONFIGURATION" NAME "RESOURCE" NAME "ON" "PLC" task instance "END_RESOURCE" END
task: "TASK" NAME "(" "INTERVAL" ":=" DURATION "," "PRIORITY" ":=" WHOLE ")" ";"
instance: "PROGRAM" NAME "WITH" NAME ":" NAME ";"
END: "END_CONFIGURATION"

body: statement*
?statement: assignment | call | branch | loop | selection
assignment: place ":=" expression ";"
call: NAME "(" arguments ")" ";"
arguments: argument ("," argument)*
argument: NAME ":=" expression
branch: "IF" expression "THEN" body ["ELSE" body] "END_IF" ";"
loop: "FOR" NAME ":=" WHOLE "TO" WHOLE "DO" body "END_FOR" ";"
selection: "CASE" NAME "OF" case+ "END_CASE" ";"
case: WHOLE ":" statement+

?expression: conjunction | conjunction ("OR" conjunction)+ -> either
?conjunction: relation | relation ("AND" relation)+ -> both
?relation: sum | sum RELATION sum -> compared
?sum: product | sum ADDED product -> computed
?product: unary | product TIMES unary -> computed
?unary: atom | "NOT" unary -> negated
?atom: place | applied | "(" expression ")"
    | REAL -> real | WHOLE -> whole | DURATION -> duration | TRUTH -> truth
applied: NAME "(" (arguments | expression) ")"
place: NAME step*
?step: "[" expression "]" -> item | "." NAME -> element

SECTION.2: /VAR(_INPUT|_OUTPUT|_IN_OUT)?\b/
TRUTH.2: /(TRUE|FALSE)\b/
RELATION: "<>" | "<=" | ">=" | "<" | ">" | "="
ADDED: "+" | "-"
TIMES: "*" | "/"
DURATION.2: /T#\d+ms/
REAL: /\d+\.\d+/
WHOLE: /\d+(?!\.\d)/
NAME: /[A-Za-z](_?[A-Za-z0-9])*/
%ignore /\s+/
%ignore /\(\*[\s\S]*?\*\)/
"""

PARSER = Lark(GRAMMAR, parser="lalr", maybe_placeholders=True)

KEYWORDS = re.compile(
    "ACTION|ARRAY|AT|BY|CASE|CONFIGURATION|CONSTANT|DO|ELSE|ELSIF|EXIT|FALSE|FOR|FROM|FUNCTION|IF|"
    "INTERVAL|MOD|NOT|OF|ON|OR|PRIORITY|PROGRAM|READ|REPEAT|RESOURCE|RETAIN|RETURN|SINGLE|STEP|"
    "STRUCT|TASK|THEN|TO|TRANSITION|TRUE|TYPE|UNTIL|VAR|WHILE|WITH|WRITE|XOR"
)
BOUNDS = {"INT": (-(2**15), 2**15 - 1), "UINT": (0, 2**16 - 1), "UDINT": (0, 2**32 - 1)}
INITIAL = {"BOOL": False, "LREAL": 0.0, "TIME": 0.0, **dict.fromkeys(BOUNDS, 0)}
TIMER = {"IN": "BOOL", "PT": "TIME", "Q": "BOOL"}


def fit(kind: str, value: int) -> int:
    """A whole number that a type has room for."""
    low, high = BOUNDS[kind]
    if not low <= value <= high:
        raise OverflowError(f"{value} is no {kind}")
    return value


def ton(my: SimpleNamespace, now: float) -> None:
    """The timer TON of the standard: Q once IN has been true for PT."""
    if not my.IN:
        my.since = None
    elif my.since is None:
        my.since = now
    my.Q = my.since is not None and now - my.since >= my.PT - 1e-9


@dataclass
class Block:
    """A program organization unit: its variables with their types, the section of each, and the
    statements in Python."""

    name: str
    types: dict[str, str] = field(default_factory=dict)
    section: dict[str, str] = field(default_factory=dict)
    python: list[str] = field(default_factory=list)
    returns: str = ""


class Compiler:
    """Compiles a text: `blocks` by name, `structures` and `arrays` by name, the `interval` of the
    task [s] and the `program` that it runs."""

    def __init__(self, text: str) -> None:
        self.blocks: dict[str, Block] = {}
        self.structures: dict[str, dict[str, str]] = {"TON": TIMER}
        self.arrays: dict[str, tuple[int, str]] = {}
        self.interval, self.program = 0.0, ""
        self._spelt: dict[str, str] = {}
        for tree in PARSER.parse(text).children:
            getattr(self, f"_{tree.data}")(*tree.children)

    def _declare(self, name: Token) -> str:
        if KEYWORDS.fullmatch(name.upper()):
            raise SyntaxError(f"line {name.line}: {name} is a keyword")
        if self._spelt.setdefault(name.upper(), str(name)) != name:
            other = self._spelt[name.upper()]
            raise SyntaxError(f"line {name.line}: {name} differs from {other} by case only")
        return str(name)

    def _known(self, kind: Token) -> str:
        if kind in INITIAL or kind in self.structures or kind in self.arrays or kind in self.blocks:
            return str(kind)
        raise SyntaxError(f"line {kind.line}: no type {kind}")

    # declarations

    def _data_type(self, name: Token, made: Tree[Token]) -> None:
        if made.data == "array":
            low, high, of = made.children
            assert low == "1", made
            self.arrays[self._declare(name)] = int(high), self._known(of)
            return
        elements = [d.children for d in made.children]
        self.structures[self._declare(name)] = {
            self._declare(element): self._known(kind) for element, kind in elements
        }

    def _function(self, name: Token, returns: Token, *rest: Tree[Token]) -> None:
        self._unit(name, rest, self._known(returns))

    def _block(self, name: Token, *rest: Tree[Token]) -> None:
        self._unit(name, rest)

    def _program(self, name: Token, *rest: Tree[Token]) -> None:
        self._unit(name, rest)

    def _unit(self, name: Token, rest: Any, returns: str = "") -> None:
        *sections, body = rest
        made = self.blocks[self._declare(name)] = Block(str(name), returns=returns)
        if returns:
            made.types[made.name] = returns
        for section in sections:
            kind, *declarations = section.children
            for declaration in declarations:
                variable, of = declaration.children
                made.types[self._declare(variable)] = self._known(of)
                made.section[variable] = str(kind)
        made.python = [*Statements(self, made).lines(body.children, 1)]

    def _configuration(
        self, name: Token, resource: Token, task: Tree[Token], instance: Tree[Token], _: Token
    ) -> None:
        self._declare(name)
        self._declare(resource)
        called, interval, _ = task.children
        self._declare(called)
        of, by, program = instance.children
        self._declare(of)
        assert by == called
        assert program in self.blocks
        self.interval, self.program = int(interval[2:-2]) / 1000, str(program)

    def initial(self, kind: str) -> Any:
        """A new value of a type."""
        if kind in INITIAL:
            return INITIAL[kind]
        if kind in self.arrays:
            size, of = self.arrays[kind]
            return [None, *(self.initial(of) for _ in range(size))]
        if kind in self.structures:
            made = {name: self.initial(of) for name, of in self.structures[kind].items()}
            return SimpleNamespace(**made, **({"since": None} if kind == "TON" else {}))
        types = self.blocks[kind].types
        return SimpleNamespace(**{name: self.initial(of) for name, of in types.items()})

    def python(self) -> str:
        """All units as Python functions."""
        lines = []
        for made in self.blocks.values():
            lines += [f"def {made.name}(my, now):", *(made.python or ["    pass"])]
            lines += [f"    return my.{made.name}"] if made.returns else []
        return "\n".join(lines)


@dataclass
class Statements:
    """Compiles the statements of a unit."""

    all: Compiler
    unit: Block

    def lines(self, statements: Any, depth: int) -> Iterator[str]:
        for statement in statements:
            for line in getattr(self, f"_{statement.data}")(*statement.children):
                yield "    " * depth + line

    def _within(self, statements: Any) -> Iterator[str]:
        yield from self.lines(statements, 1)
        yield "    pass"

    def _assignment(self, place: Tree[Token], value: Any) -> Iterator[str]:
        (to, kind), (python, of) = self._place(*place.children), self.expression(value)
        root = place.children[0]
        if self.unit.section.get(root) == "VAR_INPUT" or kind not in INITIAL:
            raise SyntaxError(f"{root} of type {kind} is not assigned to")
        fits(kind, of, to)
        yield f"{to} = fit({kind!r}, {python})" if kind in BOUNDS else f"{to} = {python}"

    def _call(self, name: Token, arguments: Tree[Token]) -> Iterator[str]:
        kind = self.unit.types[name]
        yield from self._passed(f"my.{name}", kind, arguments)
        yield f"{'ton' if kind == 'TON' else kind}(my.{name}, now)"

    def _passed(self, memory: str, kind: str, arguments: Tree[Token]) -> Iterator[str]:
        """The arguments of a call, which are inputs or, all of them, in-outs."""
        called = self.all.blocks.get(kind)
        types = TIMER if called is None else called.types
        passed = set()
        for argument in arguments.children:
            name, value = argument.children
            python, of = self.expression(value)
            if called and called.section[name] not in ("VAR_INPUT", "VAR_IN_OUT"):
                raise SyntaxError(f"{name} is no input of {kind}")
            fits(types[name], of, name)
            passed.add(str(name))
            yield f"{memory}.{name} = {python}"
        shared = {n for n, s in called.section.items() if s == "VAR_IN_OUT"} if called else set()
        if not shared <= passed:
            raise SyntaxError(f"{kind} is called without {shared - passed}")

    def _branch(self, condition: Any, then: Tree[Token], otherwise: Any) -> Iterator[str]:
        python, kind = self.expression(condition)
        fits("BOOL", kind, "IF")
        yield f"if {python}:"
        yield from self._within(then.children)
        if otherwise is not None:
            yield "else:"
            yield from self._within(otherwise.children)

    def _loop(self, name: Token, first: Token, last: Token, body: Tree[Token]) -> Iterator[str]:
        fits(self.unit.types[name], "whole", name)
        yield f"for my.{name} in range({first}, {last} + 1):"
        yield from self._within(body.children)

    def _selection(self, name: Token, *cases: Tree[Token]) -> Iterator[str]:
        fits(self.unit.types[name], "whole", name)
        yield f"case = my.{name}"
        labels = [str(case.children[0]) for case in cases]
        if len({*labels}) < len(labels):
            raise SyntaxError(f"{self.unit.name}: a case is there twice")
        for number, case in enumerate(cases):
            yield f"{'el' if number else ''}if case == {case.children[0]}:"
            yield from self._within(case.children[1:])

    # expressions, each with its type

    def expression(self, tree: Any) -> tuple[str, str]:
        return getattr(self, f"_{tree.data}")(*tree.children)  # type: ignore[no-any-return]

    def _real(self, text: Token) -> tuple[str, str]:
        return str(text), "LREAL"

    def _whole(self, text: Token) -> tuple[str, str]:
        return str(int(text)), "whole"

    def _duration(self, text: Token) -> tuple[str, str]:
        return f"{int(text[2:-2]) / 1000}", "TIME"

    def _truth(self, text: Token) -> tuple[str, str]:
        return str(text).capitalize(), "BOOL"

    def _place(self, name: Token, *steps: Tree[Token]) -> tuple[str, str]:
        if name not in self.unit.types:
            raise SyntaxError(f"line {name.line}: {name} is not declared in {self.unit.name}")
        python, kind = f"my.{name}", self.unit.types[name]
        for step in steps:
            (inner,) = step.children
            if step.data == "element":
                block = self.all.blocks.get(kind)
                if block and block.section[inner] != "VAR_OUTPUT":
                    raise SyntaxError(f"{name}.{inner} is no output")
                kind = (block.types if block else self.all.structures[kind])[inner]
                python += f".{inner}"
                continue
            size, kind = self.all.arrays[kind]
            index, of = self.expression(inner)
            fits("INT", of, name)
            if of == "whole" and not 1 <= int(index) <= size:
                raise IndexError(f"line {name.line}: {name}[{index}] of {size}")
            python += f"[{index}]"
        return python, kind

    def _applied(self, name: Token, given: Tree[Token]) -> tuple[str, str]:
        if name == "ABS":
            python, kind = self.expression(given)
            return f"abs({python})", kind
        made = self.all.blocks[name]
        lines = [*self._passed("my", str(name), given)]
        inputs = ", ".join(line.removeprefix("my.").replace(" = ", "=", 1) for line in lines)
        return f"{name}(SimpleNamespace({inputs}), now)", made.returns

    def _negated(self, value: Any) -> tuple[str, str]:
        python, kind = self.expression(value)
        fits("BOOL", kind, "NOT")
        return f"(not {python})", "BOOL"

    def _joined(self, word: str, *values: Any) -> tuple[str, str]:
        made = [self.expression(value) for value in values]
        for _, kind in made:
            fits("BOOL", kind, word)
        return f"({f' {word} '.join(python for python, _ in made)})", "BOOL"

    def _either(self, *values: Any) -> tuple[str, str]:
        return self._joined("or", *values)

    def _both(self, *values: Any) -> tuple[str, str]:
        return self._joined("and", *values)

    def _compared(self, left: Any, relation: Token, right: Any) -> tuple[str, str]:
        (one, first), (other, second) = self.expression(left), self.expression(right)
        same(first, second, relation)
        python = {"<>": "!=", "=": "=="}.get(str(relation), str(relation))
        return f"({one} {python} {other})", "BOOL"

    def _computed(self, left: Any, sign: Token, right: Any) -> tuple[str, str]:
        (one, first), (other, second) = self.expression(left), self.expression(right)
        kind = same(first, second, sign)
        python = "//" if sign == "/" and kind != "LREAL" else str(sign)
        return f"({one} {python} {other})", kind


def same(one: str, other: str, where: str) -> str:
    """The type of two operands, which is the same, or that of the one which is no literal."""
    kind = other if one == "whole" else one
    if {one, other} - {kind, "whole"} or (kind not in BOUNDS and one != other):
        raise TypeError(f"{one} {where} {other}")
    return kind


def fits(kind: str, of: str, where: str) -> None:
    """Refuse a value of a type `of` where one of another is needed."""
    if of != kind and not (of == "whole" and kind in BOUNDS):
        raise TypeError(f"{where}: {of} where {kind} is needed")


class Plc:
    """A controller that runs an exported text, as it stands, on its own clock: a scan of the
    program for each call. `memory`: that of the program."""

    def __init__(self, text: str) -> None:
        made = self.compiled = Compiler(text)
        scope: dict[str, Any] = {"SimpleNamespace": SimpleNamespace, "fit": fit, "ton": ton}
        exec(compile(made.python(), "<structured text>", "exec"), scope)
        self.memory = made.initial(made.program)
        self._run = partial(scope[made.program], self.memory)

    @property
    def interval(self) -> float:
        """The period of its task [s]."""
        return self.compiled.interval

    def scan(self, sensed: Sensed) -> Commands:
        """One scan: inputs, program, outputs."""
        my = self.memory
        my.Position, my.Speed = [None, *sensed.position.tolist()], [None, *sensed.speed.tolist()]
        my.Held, my.Ready = [None, *sensed.held], [None, *sensed.ready]
        self._run(sensed.time)
        return Commands(np.array(my.Target[1:]), tuple(my.Grip[1:]), tuple(my.Job[1:]))
