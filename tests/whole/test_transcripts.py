"""Golden transcripts: what commands print, their statuses and the files that they leave.

A file of tests/transcripts is a list of cases. A case begins with `## title` in a folder of its
own, where `examples` is the folder of examples; its lines are

    <<< NAME            a file is written: the lines up to `>>>`
    $ NAME=VALUE words  a command, with environment variables
    $ words | KEYS      the values of these keys of its JSON document, `a.b` inside others
      text              a line on stdout that is not blank
    ! text              a line on stderr
    ? 2                 the status, where that is not 0
    + NAME, - NAME      a file that was written anew or changed, or that is gone

`pytest --update-golden tests/whole/test_transcripts.py` writes the answers anew.
"""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.command_line import Terminal
from tests.paths import ROOT

FILES = sorted((ROOT / "tests" / "transcripts").glob("*.txt"))
ASKED = re.compile(
    r"(?m)^## .*\n|^<<< (?P<name>.+)\n(?P<text>(?:.*\n)*?)^>>>\n|^\$ (?P<words>.*)\n|^#.*\n|^\n"
)
FIGURE = re.compile(r"\d+\.\d+")
CLOCKED = re.compile(r"\d+(?:\.\d+)?(?= times real time)|(?<= in )\d+\.\d+ s\b")
"""Figures that depend on how busy the machine is."""


def asked(text: str) -> Iterator[re.Match[str]]:
    """The lines of a transcript that are no answer."""
    position = 0
    while position < len(text):
        if line := ASKED.match(text, position):
            yield line
            position = line.end()
        else:
            position = text.index("\n", position) + 1


def values(document: Any, key: str) -> Any:
    """The value of a key of a document; of a list, those of all its members."""
    if not key:
        return document
    if isinstance(document, list):
        return [values(member, key) for member in document]
    name, _, rest = key.partition(".")
    return values(document[name], rest)


class Player:
    """Plays transcripts in a folder."""

    def __init__(self, run: Terminal, folder: Path, patch: pytest.MonkeyPatch) -> None:
        self.run, self.folder, self.patch, self.cases = run, folder, patch, 0
        self.place = folder

    def play(self, text: str) -> str:
        """The transcript with the answers that are given now."""
        return "".join(line for match in asked(text) for line in self._line(match))

    def _line(self, match: re.Match[str]) -> Iterator[str]:
        yield match[0]
        if match[0].startswith("## "):
            self.cases += 1
            self.place = self.folder / str(self.cases)
            self.place.mkdir()
            (self.place / "examples").symlink_to(ROOT / "examples")
            self.patch.chdir(self.place)
        elif match["name"]:
            path = self.place / match["name"]
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(match["text"], "utf-8")
        elif match["words"]:
            yield from self._command(match["words"])

    def _command(self, words: str) -> Iterator[str]:
        line, _, keys = words.partition(" | ")
        before, split = self._files(), shlex.split(line)
        with pytest.MonkeyPatch.context() as patch:
            while "=" in split[0] and split[0].partition("=")[0].isupper():
                patch.setenv(*split.pop(0).split("=", 1))
            done = self.run(*split, *(["--json"] if keys else []))
        after, out = self._files(), done.out
        if keys:
            shown = ((key, values(done.json, key)) for key in keys.split())
            out = "".join(f"{key}: {json.dumps(v, ensure_ascii=False)}\n" for key, v in shown)
        for mark, said in (("  ", out), ("! ", done.err)):
            rows = said.replace(f"{self.place}/", "").splitlines()
            yield from (f"{mark}{row}".rstrip() + "\n" for row in rows if row.strip())
        if done.status:
            yield f"? {done.status}\n"
        yield from (f"- {name}\n" for name in sorted(before.keys() - after))
        yield from (f"+ {n}\n" for n in sorted(after) if after[n] != before.get(n))

    def _files(self) -> dict[str, bytes]:
        return {
            path.relative_to(self.place).as_posix(): path.read_bytes()
            for path in self.place.rglob("*")
            if path.is_file() and path.relative_to(self.place).parts[0] != "examples"
        }


def alike(said: str, printed: str) -> bool:
    """Whether two lines are the same but for rounding: 2 in the last digit of a figure."""
    said, printed = CLOCKED.sub("#", said), CLOCKED.sub("#", printed)
    one, other = FIGURE.findall(said), FIGURE.findall(printed)
    return FIGURE.sub("#", said) == FIGURE.sub("#", printed) and all(
        abs(float(a) - float(b)) <= 2.01 * 10 ** -len(a.partition(".")[2])
        for a, b in zip(one, other, strict=True)
    )


def reconciled(text: str, now: str) -> str:
    """What was printed now, with the lines of the transcript where they are alike."""
    lines = text.splitlines(keepends=True), now.splitlines(keepends=True)
    if len(lines[0]) != len(lines[1]):
        return now
    return "".join(one if alike(one, other) else other for one, other in zip(*lines, strict=True))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_transcript_is_what_is_printed(
    file: Path,
    run: Terminal,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    text = file.read_text("utf-8")
    now = reconciled(text, Player(run, tmp_path, monkeypatch).play(text))
    if request.config.getoption("--update-golden"):
        file.write_text(now, "utf-8", newline="\n")
    assert now == file.read_text("utf-8")


PLANTED = (
    "## a status\n$ check examples/paper.pag -q\n? 1\n## a file\n$ --version\n  factory 9\n+ x\n"
)


def test_a_transcript_that_is_wrong_is_found(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = Player(run, tmp_path, monkeypatch).play(PLANTED)
    assert reconciled(PLANTED, now) != PLANTED and "? 1" not in now and "+ x" not in now
    assert alike("  at 1.20 s", "  at 1.22 s") and not alike("  at 1.20 s", "  at 1.23 s")
    assert not alike("  2 robots", "  3 robots")
