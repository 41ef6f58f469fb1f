"""A report of sections: each measured by a module of its own and kept as JSON, the whole written
from what is kept, so that sections can be renewed one by one."""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import platform
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from time import perf_counter
from types import ModuleType

ROOT = Path(__file__).resolve().parent.parent

DOCS = ROOT / "docs"

ORACLE = ROOT / "benches" / "oracle.json"
"""Hashes of what commands give, kept by `benches.oracle`."""

PHYSICAL = ("mujoco", "jitter", "faults")
"""Last words of the oracle's cases that run in MuJoCo."""


@dataclass(frozen=True)
class Report:
    """`package`: where the modules called like the `sections` are, each with `measure` and
    `section`, in the order of the report; `head`: what stands before them; `path`: where the report
    is, beside the folder of the same name with the results; `versions` of which packages it
    tells."""

    package: str
    head: str
    sections: tuple[str, ...]
    path: Path
    versions: tuple[str, ...]

    @property
    def folder(self) -> Path:
        """Where results are kept."""
        return self.path.with_suffix("")

    def module(self, name: str) -> ModuleType:
        """That of a section."""
        return import_module(f"{self.package}.{name}")

    def parser(self, words: str | None) -> argparse.ArgumentParser:
        """What every report's command line takes."""
        parser = argparse.ArgumentParser(prog=f"python -m {self.package}", description=words)
        parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(self.sections))
        parser.add_argument("--quick", action="store_true", help="a taste of each, in seconds")
        parser.add_argument(
            "--write", action="store_true", help="measure nothing, write the report anew"
        )
        return parser

    def chosen(self, parser: argparse.ArgumentParser, given: argparse.Namespace) -> Sequence[str]:
        """The sections that are named, all where none is; ends the program where one is not
        there. None where the report is to be written alone, which is done."""
        names: Sequence[str] = given.names
        if given.write:
            self.write()
            return ()
        if unknown := set(names) - set(self.sections):
            there = ", ".join(self.sections)
            parser.error(f"no section {', '.join(sorted(unknown))}; there are {there}")
        return names or self.sections

    def measure(
        self, name: str, quick: bool, only: Sequence[str] = (), goes_on: bool = False
    ) -> None:
        """Measure a section and keep what it found at once: one that takes long yields all that it
        has found so far, again and again. With `only` it measures these products, and the others
        that are kept stay as they are; one that `goes_on` measures what is not kept yet."""
        begin, setting = perf_counter(), self._setting()
        measure = self.module(name).measure
        file = self.folder / f"{name}.json"
        before = json.loads(file.read_text()) if (only or goes_on) and file.is_file() else {}
        kept = before.get("results")
        if goes_on:
            begin -= before.get("seconds", 0.0)
            found = measure(quick, kept)
        else:
            found = measure(quick, only, kept) if only else measure(quick)
        for results in [found] if isinstance(found, dict) else found:
            document = {
                "section": name,
                "quick": quick,
                "seconds": round(perf_counter() - begin, 1),
                **setting,
                "physics": before.get("physics", "") if only else setting["physics"],
                "results": results,
            }
            self.folder.mkdir(parents=True, exist_ok=True)
            file.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n")

    def text(self) -> str:
        """The report on all that is kept. Its top names the sections whose figures are older than
        the physics that they describe."""
        parts, old, now = list[str](), list[str](), physics()
        for name in self.sections:
            file = self.folder / f"{name}.json"
            if file.is_file():
                kept = json.loads(file.read_text())
                section = self.module(name).section(kept["results"])
                parts += [section, _foot(kept)]
                if kept.get("physics") != now:
                    old.append(section.partition("\n")[0].removeprefix("## "))
        head = [self.head, *([OLD.format(", ".join(old))] if old else [])]
        return "\n\n".join([*head, *parts]) + "\n"

    def write(self) -> None:
        """Write it."""
        self.path.write_text(self.text())

    def _setting(self) -> dict[str, str]:
        """What it is measured on, when, at which commit, and how busy the machine is with other
        work before."""
        packages = [f"{name} {version(name)}" for name in self.versions]
        return {
            "date": datetime.now(UTC).strftime("%Y-%m-%d"),
            "machine": f"{os.cpu_count()} cores of {_processor()}, {platform.system()}",
            "commit": _commit(),
            "physics": physics(),
            "load": f"{os.getloadavg()[0]:.1f}",
            "versions": ", ".join([f"Python {platform.python_version()}", *packages]),
        }


OLD = "**Out of date** (models or runs of the examples have changed since they were measured): {}."


def physics(oracle: Path = ORACLE) -> str:
    """A digest of the models and of the runs of the examples in MuJoCo.

    It is that of their hashes in the oracle, so it changes with what runs do and not with how the
    code is written.
    """
    kept = json.loads(oracle.read_text())
    models = [
        files[file] for files in kept.values() for file in sorted(files) if file.endswith(".xml")
    ]
    runs = [files["printed"] for name, files in kept.items() if name.endswith(PHYSICAL)]
    return hashlib.sha256("\n".join([*models, *runs]).encode()).hexdigest()[:16]


def _commit() -> str:
    """The commit that is checked out, "" where there is none."""
    words = ["git", "rev-parse", "--short", "HEAD"]
    done = subprocess.run(words, cwd=DOCS.parent, capture_output=True, text=True)
    return done.stdout.strip()


def _processor() -> str:
    """What kind of processor this is, as well as the system says."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.machine())


def _foot(kept: Mapping[str, object]) -> str:
    quick = ", the quick version" if kept["quick"] else ""
    commit = f" at commit {kept['commit']}" if kept.get("commit") else ", at no known commit,"
    load = f", load average {kept['load']}" if kept.get("load") else ""
    return (
        f"*Measured on {kept['date']}{commit} in {kept['seconds']} s{quick}: {kept['versions']};"
        f" {kept['machine']}{load}.*"
    )
