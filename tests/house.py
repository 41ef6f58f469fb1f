"""The laws of the house, as functions from a source tree to its breaches.

A tree is a folder that holds the package `factory`; so a law can be tried on a planted breach.
"""

from __future__ import annotations

import ast
import graphlib
import re
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import chain
from pathlib import Path

from tests.paths import ROOT

MOST = 100
"""How many names the interface may have."""

MOST_TOOLS = 128
"""How many tools `support` may have."""

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
            case ast.Assign(targets=[target]) if name in {
                one.id for one in ast.walk(target) if isinstance(one, ast.Name)
            }:
                text = after.value if isinstance(after, ast.Expr) else None
                return "", text.value if isinstance(text, ast.Constant) else "", []
    return "", ast.get_docstring(module.tree) or "", []


def fields(node: ast.ClassDef) -> list[str]:
    """The public attributes that a class declares."""
    declared = (one for one in node.body if isinstance(one, ast.AnnAssign))
    targets = (one.target for one in declared if "ClassVar" not in ast.unparse(one.annotation))
    names = [one.id for one in targets if isinstance(one, ast.Name)]
    return [name for name in names if not name.startswith("_")]


WORDS = {
    "deviations": r"deviations?|disturb\w*",
    "recovery": r"recover\w*|undo\w*|undone|spares?|scrap\w*",
    "monitor": r"monitor\w*",
    "live": r"interven\w*|browser",
    "log": r"logs?|logged|logging",
    "report": r"html",
    "plc": r"plc|opcua|opc",
    "relay": r"relay\w*",
    "platen": r"platens?|tiles?|tiled",
    "few robots": r"tees?|stems?",
    "revise": r"revis\w*",
    "studies": r"pareto|sweeps? of|fidelity",
    "mixes": r"mix\w*",
    "demand": r"demands?|demanded|wip",
    "manipulators": r"manipulat\w*",
}
"""What each app or feature is called, as an expression that a word of it matches whole."""

KEPT = "named_in_core.toml"
"""The modules that still name one, by its name."""

WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
"""A word of a name or of a text: `with_tees` has two, `MonitorSubject` too."""


def named(house: House) -> dict[str, set[str]]:
    """The modules of the core that name each app or feature, in names or in texts."""
    rooms = {room for floor in FLOORS for room in floor}
    patterns = {name: re.compile(pattern) for name, pattern in WORDS.items()}
    there: dict[str, set[str]] = {name: set() for name in WORDS}
    for module in house.modules.values():
        if module.room in rooms:
            words = {word.lower() for word in WORD.findall(module.text)}
            for name, pattern in patterns.items():
                if any(pattern.fullmatch(word) for word in words):
                    there[name].add(module.name)
    return there


def listed(root: Path) -> dict[str, set[str]]:
    """The list that is kept."""
    path = root / "tests" / KEPT
    kept = tomllib.loads(path.read_text("utf-8")) if path.exists() else {}
    return {name: {*modules} for name, modules in kept.items()}


def named_apps(house: House) -> Iterator[str]:
    """Modules of the core that name an app and are not in the list, and lines of the list that
    nothing needs."""
    kept = listed(house.root)
    for name, modules in named(house).items():
        known = kept.get(name, set())
        yield from (f"{module} names {name}" for module in sorted(modules - known))
        yield from (f"{module} no longer names {name}" for module in sorted(known - modules))


FLOORS = (
    ("support",),
    ("theory.problem",),
    ("theory.lang", "theory.nets", "theory.control"),
    ("theory.plant",),
    ("theory.compiler",),
    ("floor.geometry", "floor.robots"),
    ("floor.mating",),
    ("floor.layout",),
    ("floor.modes",),
    ("engine.mjcf",),
    ("engine.timing",),
    ("engine.record",),
    ("engine.simulation",),
    ("pipeline",),
    ("film",),
    ("api",),
)
"""Rooms of the core from the ground up. A room imports itself and the floors below it, nothing
beside it. Above them are the apps, then the commands."""

APPS = (
    ("drawing",),
    ("arms", "foreign_nets", "importing", "few_robots", "relay", "platen", "deviations"),
    ("log",),
    ("monitor", "recovery", "planning", "analyze", "exports"),
    ("runs", "resume", "revise"),
    ("sweep",),
    ("fidelity",),
    ("report",),
    ("pareto", "live"),
    ("plc",),
    ("environment",),
    ("making",),
)
"""The apps, from those that use no other app up. An app imports `factory.api`, itself, and the apps
below it."""

ENTRANCES = (
    *("commands", "apps.*.command_line"),
    *("stages", "studies", "views", "notebook", "__init__", "__main__"),
)
"""Above the core and the apps, from the lowest up: the command line, the commands that apps give,
the functions that a user calls, how values are shown."""

ENGINE_ROOMS = (
    *("support", "engine/mjcf", "engine/record", "engine/simulation/mujoco", "film", "apps"),
)
"""Rooms, or parts of rooms, that may import the engine."""

VAGUE = frozenset({"found", "told", "given", "known", "own"})
"""Names that do not say what a variable is."""

ENGINE_WRITERS = (
    *("engine/simulation/mujoco", "engine/mjcf", "apps/deviations", "apps/recovery"),
    *("apps/fidelity/solid", "apps/arms/scene"),
)
"""Where the engine's model and data are written: those of a run, and those of a replica that no run
uses."""

ENGINE_FIELDS = frozenset(
    {
        *("qpos", "qvel", "qacc_warmstart", "act", "ctrl", "history", "eq_active"),
        *("xfrc_applied", "qfrc_applied", "mocap_pos", "mocap_quat", "exclude_signature"),
        *("eq_obj1id", "eq_obj2id", "eq_data", "eq_solref", "eq_solimp", "tree_sleep_policy"),
        *("body_mass", "body_inertia", "body_contype", "body_conaffinity"),
        *("geom_contype", "geom_conaffinity", "dof_armature", "dof_frictionloss", "dof_damping"),
        *("actuator_biasprm", "actuator_gainprm", "actuator_forcerange"),
    }
)
"""Fields of MjModel and MjData that a run may write."""

VARIANTS = re.compile(r"(^|_)(fold(s|ed|ing)?|relay(s|ed|ing)?|parallel|forms?)(_|$)")
"""What variants of a factory are called, in identifiers of small letters."""

VARIANT_ROOMS = ("theory/compiler", "theory/problem/plan", "apps/relay", "apps/few_robots")
"""Where variants are made. All others know the factory that was made."""

VARIANT_MARKS = {
    **{"commands": 31, "theory.lang": 28, "apps.pareto": 23, "apps.planning": 17, "pipeline": 11},
    **{"stages": 8, "apps.exports": 7, "floor.layout": 7, "floor.mating": 5},
    **{"support": 5, "apps.foreign_nets": 4, "engine.timing": 3, "theory.plant": 2},
    **{"apps.sweep": 1},
}
"""How many identifiers of other rooms may still name a variant; the command lines of apps count as
`commands`. A mark may fall, and never rises: what needs it is told by the plan, or by what the
factory is."""

STOREYS = ("theory", "floor", "engine", "apps")
"""Folders whose folders are rooms."""

MOST_LINES = 350

BESIDE = ("tests", "benches")
"""Folders beside the package whose modules import it."""


@dataclass(frozen=True)
class Module:
    """A module of the package: its name below `factory` (dotted, "" for the package itself), its
    text and syntax."""

    name: str
    text: str

    @property
    def room(self) -> str:
        """Its room, with the storey where that has several: `theory.nets`; the command line of an
        app is one of its own."""
        first, *rest = self.name.split(".")
        if first in STOREYS and rest:
            return ".".join([first, rest[0], *(n for n in rest[1:2] if n == "command_line")])
        return first or "__init__"

    @cached_property
    def tree(self) -> ast.Module:
        return ast.parse(self.text)

    @cached_property
    def imports(self) -> list[str]:
        """All that it imports by absolute names: at run time, inside functions, for typing."""
        names: list[str] = []
        for node in ast.walk(self.tree):
            if isinstance(node, ast.Import):
                names += [a.name for a in node.names]
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                names += [f"{node.module}.{a.name}" for a in node.names]
        return names

    def within(self, folders: Iterable[str]) -> bool:
        """Whether it lies in one of these folders (`simulation/mujoco`)."""
        path = self.name.replace(".", "/") + "/"
        return any(path.startswith(f"{folder}/") for folder in folders)


CLOCK = re.compile(r"^ *(?:from|import) (?:[^()\n]*, )?time\b", re.M)
CLOCKED = ("tests.waiting",)
"""Modules of the tests that read a clock: it waits for processes."""


class House:
    """All modules of a package `factory` below the folder `root`, by name. `beside`: those of its
    tests and benches, by their names below `root`."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.beside: dict[str, Module] = {}
        for path in sorted(chain.from_iterable((root / n).rglob("*.py") for n in BESIDE)):
            name = ".".join(path.relative_to(root).with_suffix("").parts)
            self.beside[name] = Module(name, path.read_text("utf-8"))
        self.modules: dict[str, Module] = {}
        for path in sorted((root / "factory").rglob("*.py")):
            parts = path.relative_to(root / "factory").with_suffix("").parts
            loose = len(parts) == 1 and parts[0] != "__init__"
            name = ".".join(parts if loose or parts[-1] != "__init__" else parts[:-1])
            self.modules[name] = Module(name, path.read_text("utf-8"))
        kept = root / "tests" / "reach_ins.toml"
        self.reach_ins: dict[str, dict[str, list[str]]] = (
            tomllib.loads(kept.read_text("utf-8")) if kept.exists() else {}
        )

    def names(self, module: Module) -> set[str]:
        """What a module imports of the house, at run time, inside functions, for typing: modules,
        and names of modules (`theory.nets.petri.Place`)."""
        tops = ((*name.partition("."),) for name in module.imports)
        return {inside for top, _, inside in tops if top == "factory"}

    def imports(self, module: Module) -> set[str]:
        """Modules of the house that a module imports. `from factory.room import x` is resolved to
        the module x where there is one."""
        names = self.names(module)
        return {self.home(name) for name in names} - {module.name}

    def home(self, name: str) -> str:
        """The module that a name of the house lies in, or is."""
        return name if name in self.modules else name.rpartition(".")[0]

    def needs(self, module: Module) -> set[str]:
        """Modules of the house that a test imports, itself or by the tests and benches it
        imports."""
        found, names, seen = set[str](), [module.name], set[str]()
        while names:
            name = names.pop()
            one = self.beside.get(name) or self.beside.get(name := name.rpartition(".")[0])
            if one and name not in seen:
                seen.add(name)
                found |= self.imports(one)
                names += one.imports
        return found


def floor(room: str) -> int:
    """The number of a room's floor from the ground up, of the core, the apps, the entrances."""
    room = re.sub(r"^apps\.\w+\.command_line$", "apps.*.command_line", room)
    if room in ENTRANCES:
        return len(FLOORS) + len(APPS) + ENTRANCES.index(room)
    rooms = (*FLOORS, *(tuple(f"apps.{name}" for name in names) for names in APPS))
    return next((n for n, every in enumerate(rooms) if room in every), -1)


def strangers(house: House) -> Iterator[str]:
    """Rooms and loose modules that no floor names."""
    rooms = {module.room for module in house.modules.values()} - {*ENTRANCES, *STOREYS}
    yield from (f"{room}: on no floor" for room in sorted(rooms) if floor(room) < 0)


def upward_imports(house: House) -> Iterator[str]:
    """Imports of a room on the same floor or above: of the core from an app, of an app from one
    beside or above it."""
    for module in house.modules.values():
        for other in sorted(house.imports(module)):
            room = house.modules[other].room
            if room != module.room and floor(room) >= floor(module.room):
                yield f"{module.name} imports {other or 'factory'}"


def tools(house: House) -> dict[str, list[str]]:
    """The tools of `support`, which every layer and every app may use: what `__all__` of its
    modules lists."""
    return {
        name: ast.literal_eval(node.value or ast.List([]))
        for name, module in house.modules.items()
        if module.room == "support"
        for node in module.tree.body
        if isinstance(node, ast.Assign | ast.AnnAssign)
        and ast.unparse(node.targets[0] if isinstance(node, ast.Assign) else node.target)
        == "__all__"
    }


def unfit_tools(house: House) -> Iterator[str]:
    """Tools past the most that there may be, tools without a docstring or that no app uses, and
    imports of their modules from others: a tool knows nothing of factories."""
    table = tools(house)
    apps = [module for module in house.modules.values() if module.room.startswith("apps.")]
    used = {name for module in apps for name in house.names(module)}
    if (count := sum(map(len, table.values()))) > MOST_TOOLS:
        yield f"support: {count} tools; at most {MOST_TOOLS}"
    for home, names in table.items():
        module = house.modules[home]
        yield from (f"{home} imports {n}" for n in sorted(house.imports(module) - {*table}))
        for name in names:
            if not documented(module, name)[1]:
                yield f"{home}.{name}: no docstring"
            if f"{home}.{name}" not in used:
                yield f"{home}.{name}: no app uses it"


def reach_ins(house: House) -> Iterator[str]:
    """Imports of an app from the core past `factory.api` and the tools of `support` that
    `reach_ins.toml` does not list, and lines of that list that nothing needs. Its command line
    stands with `commands`, which use all that they print and call."""
    free = {f"{home}.{name}" for home, names in tools(house).items() for name in names}
    listed = {
        (app, f"{module}.{name}")
        for app, modules in house.reach_ins.items()
        for module, names in modules.items()
        for name in names
    }
    there = {
        (module.room.removeprefix("apps."), name)
        for module in house.modules.values()
        if re.fullmatch(r"apps\.\w+", module.room)
        for name in house.names(module)
        if not name.startswith(("api.", "apps.")) and name not in free
    }
    yield from (f"the app {app} reaches {name}" for app, name in sorted(there - listed))
    yield from (f"the app {app} no longer reaches {name}" for app, name in sorted(listed - there))


def circles(house: House) -> Iterator[str]:
    """Modules that import each other in a circle."""
    graph = {name: house.imports(module) for name, module in house.modules.items()}
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        yield " -> ".join(error.args[1])


def engine_imports(house: House) -> Iterator[str]:
    """Modules outside the engine's rooms that import `mujoco` or its door."""
    for module in house.modules.values():
        direct = {
            name.split(".")[0]
            for node in ast.walk(module.tree)
            for name in (
                [a.name for a in node.names]
                if isinstance(node, ast.Import)
                else [node.module or ""]
                if isinstance(node, ast.ImportFrom)
                else []
            )
        }
        reaches = "mujoco" in direct or "support.engine" in house.imports(module)
        if reaches and not module.within(ENGINE_ROOMS):
            yield f"{module.name} imports the engine"
        if "mujoco" in direct and module.name != "support.engine":
            yield f"{module.name} imports mujoco past support.engine"


def engine_writes(house: House) -> Iterator[str]:
    """Assignments to the engine's model or data outside the rooms that may write them."""
    for module in house.modules.values():
        if module.within(ENGINE_WRITERS):
            continue
        for node in ast.walk(module.tree):
            targets: list[ast.expr] = []
            if isinstance(node, ast.Assign):
                targets = node.targets
            elif isinstance(node, ast.AugAssign):
                targets = [node.target]
            for target in chain.from_iterable(ast.walk(t) for t in targets):
                written = target.value if isinstance(target, ast.Subscript) else None
                if isinstance(written, ast.Attribute) and written.attr in ENGINE_FIELDS:
                    yield f"{module.name}:{node.lineno} writes {ast.unparse(target)}"


def classes(house: House) -> Iterator[tuple[Module, ast.ClassDef]]:
    for module in house.modules.values():
        for node in ast.walk(module.tree):
            if isinstance(node, ast.ClassDef):
                yield module, node


def twins(house: House) -> Iterator[str]:
    """Public class names that two modules define."""
    where: dict[str, list[str]] = {}
    for module, node in classes(house):
        if not node.name.startswith("_"):
            where.setdefault(node.name, []).append(module.name)
    yield from (f"{name}: {', '.join(m)}" for name, m in where.items() if len(m) > 1)


def long_modules(house: House) -> Iterator[str]:
    """Modules longer than a module may be."""
    for module in house.modules.values():
        lines = len(module.text.splitlines())
        if lines > MOST_LINES:
            yield f"{module.name}: {lines} lines"


def unexplained(house: House) -> Iterator[str]:
    """Modules with code and no docstring."""
    for module in house.modules.values():
        if module.text.strip() and not ast.get_docstring(module.tree):
            yield f"{module.name}: no docstring"


def unguided(house: House) -> Iterator[str]:
    """Packages of the core of whose modules neither their docstring nor that of the package above
    names one to begin with."""
    core = {name for floor in FLOORS for room in floor for name in (room, room.partition(".")[0])}
    for name, module in house.modules.items():
        inside = [other for other in house.modules if other.startswith(f"{name}.")]
        if not inside or module.room not in core:
            continue
        above = house.modules.get(name.rpartition(".")[0])
        here = ast.get_docstring(module.tree) or ""
        there = (above and ast.get_docstring(above.tree)) or ""
        files = [f"{other.removeprefix(f'{name}.').replace('.', '/')}.py" for other in inside]
        folder = name.rpartition(".")[2]
        if not any(f"`{file}`" in here or f"`{folder}/{file}`" in there for file in files):
            yield f"{name}: names no module to begin with"


def clocks(house: House) -> Iterator[str]:
    """Test modules that import `time`: what they find must not depend on how busy a machine is."""
    for name, module in house.beside.items():
        if name.startswith("tests.") and CLOCK.search(module.text) and name not in CLOCKED:
            yield f"{name} reads a clock"


def misplaced_tests(house: House) -> Iterator[str]:
    """Tests that stand neither in tests/core, nor with an app, nor in tests/whole, and those in
    tests/core that need an app, a command or another entrance."""
    for name, module in house.beside.items():
        match name.split("."):
            case ["tests", "core", _]:
                for other in sorted(house.needs(module)):
                    if floor(house.modules[other].room) >= len(FLOORS):
                        yield f"{name} needs {other or 'factory'}"
            case ["tests", "apps", app, _] if floor(f"apps.{app}") >= 0:
                pass
            case ["tests", *folders, test] if test.startswith("test_") and folders != ["whole"]:
                yield f"{name} stands with no app, nor in core or whole"


def identifiers(module: Module) -> Iterator[str]:
    """What a module defines, uses, takes and imports, in small letters with underscores."""
    for node in ast.walk(module.tree):
        names: list[str | None] = []
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            names = [node.name]
        elif isinstance(node, ast.Name):
            names = [node.id]
        elif isinstance(node, ast.Attribute):
            names = [node.attr]
        elif isinstance(node, ast.arg | ast.keyword):
            names = [node.arg]
        elif isinstance(node, ast.ImportFrom):
            names = [*(node.module or "").split("."), *(alias.name for alias in node.names)]
        yield from (re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower() for name in names if name)


def vague(house: House) -> Iterator[str]:
    """Functions with a variable or a parameter whose name does not say what it is."""
    for module in house.modules.values():
        for node in ast.walk(module.tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                inside = [*ast.walk(node)]
                names = {one.arg for one in inside if isinstance(one, ast.arg)}
                names |= {
                    one.id
                    for one in inside
                    if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store)
                }
                for name in sorted(names & VAGUE):
                    yield f"{module.name}.{node.name}: a variable is called '{name}'"


def variants(house: House) -> Iterator[str]:
    """Rooms that name variants of a factory oftener than they may."""
    found: Counter[str] = Counter()
    for module in house.modules.values():
        if not module.within(VARIANT_ROOMS):
            room = "commands" if module.room.endswith(".command_line") else module.room
            found[room] += sum(map(bool, map(VARIANTS.search, identifiers(module))))
    for room, count in found.items():
        if count > (most := VARIANT_MARKS.get(room, 0)):
            yield f"{room}: names variants {count} times; at most {most}"


def anys(house: House, name: str) -> Iterator[str]:
    """Uses of `Any` in a module."""
    for node in ast.walk(house.modules[name].tree):
        if isinstance(node, ast.Name) and node.id == "Any":
            yield f"{name}:{node.lineno} says Any"


@cache
def this_house() -> House:
    """The source tree that these tests are in."""
    return House(ROOT)
