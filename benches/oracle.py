"""Hashes of what commands give: a rearrangement of the code leaves every one as it was.

`python -m benches.oracle` compares the outputs of this checkout with those kept in
`benches/oracle.json` and names each that differs; `--write` keeps them anew, and a commit that does
so says which changed, and why.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from factory.commands import run_command

ROOT = Path(__file__).resolve().parent.parent
KEPT = ROOT / "benches" / "oracle.json"
EXAMPLES = ROOT / "examples"
PRODUCTS = tuple(sorted(path.stem for path in EXAMPLES.glob("*.pag")))

CLOCKS = re.compile(r"(wall_time|physics_time|supervisor_time|monitor_time|compile|realtime)\w*")
"""Keys of documents whose values are those of a clock."""

ENGINE_FILES = (".mjb", ".seal")
"""Files that the engine writes in a format of its own."""

FAULTS = """
[[fault]]
kind = "bad_part"
label = "part1"
unit = 1

[[fault]]
kind = "drop"
label = "part2"
unit = 2
"""

FORMATS = ("pnml", "dot", "st", "plcopen", "urdf", "gltf", "svg", "stl")
"""Formats of the exports that are hashed, each of the paper's example."""


@dataclass(frozen=True)
class Case:
    """Commands whose outputs are hashed.

    Attributes:
        name: of the case, unique.
        commands: the words of each, run in order in a folder of the case's own.
        between: what is done after the first command, if anything.
    """

    name: str
    commands: tuple[tuple[str, ...], ...]
    between: Callable[[Path], None] | None = None


def example(name: str) -> str:
    return str(EXAMPLES / f"{name}.pag")


def cut(folder: Path) -> None:
    """Cuts a log at three fifths of its length, as a run that is killed leaves it."""
    log = folder / "run.log"
    log.write_bytes(log.read_bytes()[: log.stat().st_size * 3 // 5])


def faults(folder: Path) -> None:
    (folder / "faults.toml").write_text(FAULTS, "utf-8")


def longer(folder: Path) -> None:
    """Writes the truck with a longer bed."""
    text = Path(example("truck")).read_text("utf-8")
    (folder / "longer.pag").write_text(text.replace("box = (0.17,", "box = (0.18,"), "utf-8")


def cases() -> Iterator[Case]:
    """All cases: some two minutes on two cores."""
    for name in PRODUCTS:
        yield Case(f"check {name}", (("check", example(name), "--json"),))
        yield Case(f"build {name}", (("build", example(name), "-o", "out", "--json"),))
        for world in ("ideal", "mujoco"):
            words = ("run", example(name), "--units", "2", "--world", world, "--json")
            yield Case(f"run {name} {world}", (words,))
    jitter = ("run", example("paper"), "--units", "6", "--jitter", "0.3", "--seed", "5", "--json")
    yield Case("jitter", (jitter,))
    yield Case("distributed", ((*jitter, "--distributed"),))
    yield Case("demand", (("run", example("family"), "--units", "4", "--demand", "3", "--json"),))
    struck = ("run", example("paper"), "--units", "3", "--faults", "faults.toml", "--json")
    yield Case("faults", (("check", example("paper"), "--json"), struck), faults)
    revised = ("revise", example("truck"), "longer.pag", "-o", "out", "--json")
    yield Case("revise", (("check", example("truck"), "--json"), revised), longer)
    tee = (example("paper"), "--parallel", "part3=2")
    tee_run = ("run", *tee, "--units", "3", "--json")
    yield Case("tee", (("build", *tee, "-o", "out", "--json"), tee_run))
    platen = (example("lamp"), "--platen")
    yield Case("platen", (("build", *platen, "-o", "out"), ("run", *platen, "--json")))
    few = (example("stool"), "--robots", "least", "--effort", "2")
    yield Case("few robots", (("build", *few, "-o", "out", "--json"),))
    yield Case("relay", (("build", example("stool"), "--relay", "-o", "out", "--json"),))
    logged = ("run", example("paper"), "--units", "4", "--log", "run.log", "--json")
    after = (("monitor", "run.log", "--json"), ("report", "run.log", "-o", "page.html"))
    yield Case("log", (logged, *after))
    yield Case("resume", (logged, ("run", "run.log", "--resume", "--json")), cut)
    yield Case("analyze", (("analyze", example("paper"), "--json"),))
    yield Case("programs", (("programs", example("truck")),))
    for form in FORMATS:
        words = ("export", example("paper"), "--format", form, "-o", f"out.{form}")
        yield Case(f"export {form}", (words,))
    drawn = ("export", example("peg"), "--format", "gltf", "-o", "peg.glb")
    yield Case("plan", (drawn, ("plan", "peg.glb", "-o", "out")))


def outputs(case: Case) -> dict[str, str]:
    """The hash of each file that a case writes, and of what its commands print."""
    with TemporaryDirectory() as name:
        folder, printed = Path(name).resolve(), list[str]()
        os.chdir(folder)
        for count, words in enumerate(case.commands):
            if count == 1 and case.between:
                case.between(folder)
            with redirect_stdout(StringIO()) as out, redirect_stderr(StringIO()):
                status = run_command(list(words))
            if status != 0:
                print(f"{case.name}: {words[0]} has status {status}", file=sys.stderr)
            printed.append(f"{words[0]} {status}\n{timeless(out.getvalue())}")
        os.chdir(ROOT)
        made = {"printed": "\n".join(printed).replace(str(folder), "").encode()}
        for path in sorted(folder.rglob("*")):
            if path.is_file() and not path.name.endswith((*ENGINE_FILES, ".log", ".toml")):
                made[str(path.relative_to(folder))] = path.read_bytes()
    return {
        key: hashlib.sha256(value.replace(str(ROOT).encode(), b"")).hexdigest()[:16]
        for key, value in made.items()
    }


def timeless(text: str) -> str:
    """A document without what a clock says; other text as it is."""
    if not text.startswith("{"):
        return text

    def bare(value: Any) -> Any:
        if isinstance(value, dict):
            return {k: bare(v) for k, v in value.items() if not CLOCKS.match(k)}
        return [bare(one) for one in value] if isinstance(value, list) else value

    return json.dumps(bare(json.loads(text)), indent=0)


def differences(kept: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """A line for each output that differs, is missing or is new."""
    for name in sorted({*kept, *now}):
        before, after = kept.get(name, {}), now.get(name, {})
        for key in sorted({*before, *after}):
            if before.get(key) != after.get(key):
                what = "missing" if key not in after else "new" if key not in before else "differs"
                yield f"{name}: {key} {what}"


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benches.oracle", description=__doc__)
    parser.add_argument("--write", action="store_true", help="keep the hashes of this checkout")
    parser.add_argument("names", nargs="*", help="cases whose names begin so (default: all)")
    given = parser.parse_args()
    chosen = [
        case for case in cases() if not given.names or case.name.startswith(tuple(given.names))
    ]
    now = {}
    for case in chosen:
        print(case.name, file=sys.stderr)
        now[case.name] = outputs(case)
    kept = json.loads(KEPT.read_text("utf-8")) if KEPT.exists() else {}
    if given.write:
        KEPT.write_text(json.dumps({**kept, **now}, indent=1, sort_keys=True) + "\n", "utf-8")
        return 0
    lines = [*differences({case.name: kept.get(case.name, {}) for case in chosen}, now)]
    print("\n".join(lines) or f"{sum(map(len, now.values()))} outputs as they were")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
