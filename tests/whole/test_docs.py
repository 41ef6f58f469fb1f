"""The documentation: what the tutorial shows is what the commands print, the reference is complete,
pages and pictures that are linked are there, and the site is built without warnings."""

from __future__ import annotations

import ast
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from benches import drawing
from factory.api import HOMES
from factory.apps.exports import exporters
from factory.commands import commands
from factory.floor.robots.catalogue import load_catalogue
from factory.support.explanations import codes
from factory.support.settings import Settings
from factory.theory.lang.template_reader import all_templates
from factory.theory.problem.parameters import GEOMETRY
from tests.command_line import Terminal
from tests.paths import ROOT
from tests.slow import slow_but

DOCS = ROOT / "docs"
PAGES = [p for p in sorted(DOCS.rglob("*.md")) if "_build" not in p.parts]
WRITTEN = [p for p in PAGES if p.parent.name != "reference" or p.name == "index.md"]
EXAMPLES = sorted(path.stem for path in (ROOT / "examples").glob("*.pag"))

FENCE = re.compile(
    r"^```(\{code-block\} text|console)\n(?::caption: (\S+)\n)?(.*?)^```$", re.M | re.S
)


def shown(page: str) -> Iterator[tuple[str, str]]:
    """The blocks of a page to be carried out, in order: a file's name and its text, or "" and a
    session in the shell."""
    for kind, caption, text in FENCE.findall((DOCS / page).read_text("utf-8")):
        if kind == "console" or caption:
            yield caption, text


STATUS = re.compile(r"# exit status (\d)$")
"""What a page says of a command that fails, after it."""


def session(text: str) -> Iterator[tuple[list[str], int, list[str]]]:
    """The commands of a session, each with its exit status and the lines that it is said to
    print."""
    for block in re.split(r"^\$ ", text, flags=re.M)[1:]:
        first, *lines = block.splitlines()
        command, fails = shlex.split(first, comments=True), STATUS.search(first)
        status = int(fails[1]) if fails else 2 * ("broken" in command)
        yield command, status, [line for line in lines if line.strip()]


FIGURE = re.compile(r"\d+\.\d+|\d+(?= %)")
TIMED = re.compile(r"\d+\.\d+(?= times real time)")
"""A figure; and one that depends on how busy the machine is."""


def words(line: str) -> str:
    """A line with single blanks and without figures."""
    return " ".join(FIGURE.sub("#", line).split())


def is_said(line: str, printed: list[str]) -> bool:
    """Whether a line is printed, with figures that differ by no more than 2 %, or by 2 in the last
    digit: a machine may round in another way."""
    known = FIGURE.findall(TIMED.sub("#", line))
    return any(
        all(map(close, known, FIGURE.findall(TIMED.sub("#", other))))
        for other in printed
        if words(other) == words(line)
    )


def close(said: str, printed: str) -> bool:
    digits = len(said.partition(".")[2])
    return abs(float(said) - float(printed)) <= max(0.02 * float(said), 2.01 * 10**-digits)


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, here: None) -> Path:
    """A folder with the examples, in which pictures are small; sweeps need no further process.
    Pages
    show what is printed without the extra `decompose`."""
    for module in ("decomposition", "drawn_solids"):
        monkeypatch.setattr(f"factory.floor.geometry.{module}.can_decompose", lambda: False)
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("FACTORY_SIZE", "64x48")
    monkeypatch.setenv("FACTORY_FPS", "2")
    return tmp_path


def follow(page: str, run: Terminal, monkeypatch: pytest.MonkeyPatch) -> int:
    """Does what a page says; how many commands of ours that were."""
    done = 0
    for name, text in shown(page):
        if name:
            Path(name).parent.mkdir(exist_ok=True)
            Path(name).write_text(text, "utf-8")
            continue
        for command, status, lines in session(text):
            if command[0] == "cd":
                monkeypatch.chdir(command[1])
                continue
            assert command[0] == "factory", command
            ended = run(*command[1:])
            printed = (ended.out + ended.err).splitlines()
            missing = [line for line in lines if not is_said(line, printed)]
            assert not missing, f"{shlex.join(command)} does not print {missing}"
            assert ended.status == status, shlex.join(command)
            done += 1
    return done


def test_the_tutorial_shows_what_is_printed(
    run: Terminal, elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert follow("tutorial.md", run, monkeypatch) >= 15
    made = {path.name for path in elsewhere.rglob("*")}
    assert {"paper.mp4", "paper.png", "paper.xml", "results.db", "bell.log"} <= made


@pytest.mark.parametrize(
    "page",
    [
        *("index.md", "ten-minutes.md", "guide/pace.md", "guide/revise.md"),
        *slow_but([], ["guide/arms.md", "guide/products.md", "guide/faults.md", "guide/plc.md"]),
        *slow_but([], ["theory/exercises.md", "theory/lecture.md", "theory/mixes.md"]),
        *slow_but([], ["theory/tees.md"]),
    ],
)
def test_the_way_in_shows_what_is_printed(
    page: str, run: Terminal, elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert follow(page, run, monkeypatch) >= 1


QUOTED = re.compile(r"^    \$ factory (.*examples/\w+\.pag.*)\n((?:     ?.*\n)+)", re.M)
"""A command on an example, and what a page says that it prints, both indented."""


@pytest.mark.parametrize("page", ["README.md", "docs/guide/products.md"])
def test_what_a_page_quotes_is_printed(page: str, run: Terminal, elsewhere: Path) -> None:
    quoted = QUOTED.findall((ROOT / page).read_text("utf-8"))
    assert quoted
    for command, lines in quoted:
        ended = run(*shlex.split(command))
        printed = (ended.out + ended.err).splitlines()
        missing = [
            line
            for line in lines.splitlines()
            if line.strip() not in ("", "...") and not is_said(line, printed)
        ]
        assert not missing, f"{command} does not print {missing}"


@pytest.fixture(scope="module")
def reference() -> Iterator[dict[str, str]]:
    """The pages that are written from the code, by name."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(DOCS / "_extensions"))
        from factory_reference import PAGES as written

        yield {name: page() for name, page in written.items()}


def headings(page: str) -> list[str]:
    """The headings of a page under its title, code left out."""
    bare = re.sub(r"^````.*?^````$", "", page, flags=re.M | re.S)
    return re.findall(r"^## (.*)$", bare, re.M)


def test_the_reference_has_everything_there_is(reference: dict[str, str]) -> None:
    assert headings(reference["commands"]) == [f"factory {name}" for name in commands()]
    assert headings(reference["diagnostics"]) == list(codes())
    assert headings(reference["operations"]) == sorted(all_templates())
    assert headings(reference["robots"]) == [*load_catalogue().types, "The catalogue"]
    names = [name for row in HOMES.values() for name in row.split()]
    assert headings(reference["interface"]) == names and len(names) == len(set(names))
    for page, names in (
        ("settings", Settings.RANGES),
        ("language", GEOMETRY),
        ("formats", exporters()),
    ):
        rows = re.findall(r"^\| `([\w-]+)` \|", reference[page], re.M)
        assert set(names) <= set(rows), page


def test_every_option_is_told(reference: dict[str, str]) -> None:
    sections = dict(
        re.findall(r"^## factory (\S+)\n(.*?)(?=^## |\Z)", reference["commands"], re.M | re.S)
    )
    for name, command in commands().items():
        for option in command.params:
            if isinstance(option, click.Option):
                assert option.help, f"factory {name} {option.opts[-1]} has no help"
            if option.name not in ("as_json", "quiet", "verbose") and option.opts[0][0] == "-":
                assert option.opts[-1] in sections[name], f"factory {name} {option.opts[-1]}"


def test_every_page_of_the_reference_is_in_its_index(reference: dict[str, str]) -> None:
    index = (DOCS / "reference" / "index.md").read_text("utf-8")
    assert sorted(re.findall(r"^(\w+)$", index, re.M)) == sorted(reference)


def test_every_command_and_example_is_in_the_guide_or_the_gallery() -> None:
    guide, gallery = (
        (DOCS / "guide" / "commands.md").read_text("utf-8"),
        (DOCS / "gallery.md").read_text("utf-8"),
    )
    for name in commands():
        assert re.search(rf"`factory {name}\b", guide), name
    for name in EXAMPLES:
        assert f"examples/{name}.pag" in gallery, name


def test_the_readme_is_a_page_that_names_the_two_commands() -> None:
    readme = (ROOT / "README.md").read_text("utf-8")
    assert len(readme.splitlines()) <= 130
    targets = re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text("utf-8"), re.M)
    named = re.findall(r"^ {4}make ([\w-]+)", readme, re.M)
    assert named == ["demo", "test"] and set(named) <= set(targets)


WAY = re.compile(r"^\| (\d+) \| `([\w/]+\.py)` ((?:`\w+(?:\.\w+)?`(?:, )?)+) \|", re.M)
"""A row of the way from text to film: its number, a file, and functions or classes in it."""


def test_the_map_is_short() -> None:
    assert len((DOCS / "design.md").read_text("utf-8").splitlines()) <= 150


def test_the_way_from_text_to_film_is_there_and_short() -> None:
    rows = WAY.findall((DOCS / "design.md").read_text("utf-8"))
    assert [int(number) for number, _, _ in rows] == list(range(1, len(rows) + 1))
    assert 10 <= len(rows) <= 15
    package = ROOT / "factory"
    for _, file, names in rows:
        found = set(defined(ast.parse((package / file).read_text("utf-8"))))
        missing = [name for name in re.findall(r"`([\w.]+)`", names) if name not in found]
        assert not missing, f"{file} has no {missing}"


def defined(tree: ast.Module) -> Iterator[str]:
    """Functions and classes of a module, and methods, alone and as `Class.method`."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        for inner in node.body if isinstance(node, ast.ClassDef) else ():
            if isinstance(inner, ast.FunctionDef):
                yield inner.name
                yield f"{node.name}.{inner.name}"


def test_files_that_the_map_and_the_decisions_name_are_there() -> None:
    package = ROOT / "factory"
    for page in (DOCS / "design.md", *sorted((DOCS / "decisions").glob("*.md"))):
        folders = re.findall(r"`([\w]+(?:/[\w]+)*/)`", page.read_text("utf-8"))
        files = re.findall(r"`([\w]+(?:/[\w]+)+\.(?:py|op))`", page.read_text("utf-8"))
        for name in (*folders, *files):
            assert (package / name).exists() or (ROOT / name).exists(), f"{page.name}: {name}"


def test_files_that_docstrings_name_are_there() -> None:
    """Each module that a docstring names is a file, or the end of one's path; so is a folder in
    backticks whose first part is one of the package."""
    package = ROOT / "factory"
    homes = (ROOT / name for name in ("factory", "tests", "benches", "tools", "docs", "mjcf"))
    there = {f"/{p.relative_to(ROOT).as_posix()}" for home in homes for p in home.rglob("*")}
    folders = {path.name for path in package.rglob("*") if path.is_dir()}
    checked = 0
    for path in package.rglob("*.py"):
        for text in docstrings(ast.parse(path.read_text("utf-8"))):
            for name in re.findall(r"(?<![\w/.])((?:\w+/)*\w+\.py)\b", text):
                assert any(file.endswith(f"/{name}") for file in there), f"{path}: {name}"
                checked += 1
            for name in re.findall(r"`(\w+(?:/\w+)+)/?`", text):
                if name.partition("/")[0] in folders:
                    assert any(file.endswith(f"/{name}") for file in there), f"{path}: {name}"
    assert checked >= 50


def docstrings(tree: ast.Module) -> Iterator[str]:
    """All docstrings in a module, of constants too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            yield str(node.value.value)


def test_the_glossary_names_what_is_there() -> None:
    """Each term with the file of its definition, and the class or function there; and no two are
    one term."""
    page = (DOCS / "glossary.md").read_text("utf-8")
    rows = re.findall(r"^\| ([^|]+) \| .+ \| `([^`]+)`(?: `(\w+)`)? \|$", page, re.M)
    assert len(rows) >= 60
    assert len({term for term, *_ in rows}) == len(rows)
    for term, path, name in rows:
        text = (ROOT / "factory" / path).read_text("utf-8")
        assert re.search(rf"^(class|def) {name}\b" if name else "^", text, re.M), term


def test_every_decision_is_in_the_index() -> None:
    index = (DOCS / "decisions" / "index.md").read_text("utf-8")
    pages = {page.stem for page in (DOCS / "decisions").glob("*.md")} - {"index"}
    assert set(re.findall(r"\]\(([\w-]+)\.md\)", index)) == pages
    assert set(re.findall(r"^[a-z-]+$", index, re.M)) == pages
    for page in pages:
        text = (DOCS / "decisions" / f"{page}.md").read_text("utf-8")
        headings_of = re.findall(r"^## (.*)$", text, re.M)
        assert headings_of[:3] == ["Context", "Decision", "Figures"], page


@pytest.mark.parametrize(
    "page", [ROOT / "README.md", *WRITTEN], ids=lambda p: p.relative_to(ROOT).as_posix()
)
def test_links_lead_somewhere(page: Path) -> None:
    """In the repository too: none leads to a page that is made with the site."""
    text = re.sub(r"^```.*?^```$|^    .*$", "", page.read_text("utf-8"), flags=re.M | re.S)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"https?:", target):
            continue
        path, _, anchor = target.partition("#")
        found = (page.parent / path).resolve() if path else page
        assert found.exists(), f"{page.name} links to {target}"
        if anchor:
            assert anchor in anchors(found), f"{page.name} links to {target}"


def anchors(page: Path) -> set[str]:
    """What a page's headings are linked by."""
    titles = re.findall(r"^#+ (.*)$", page.read_text("utf-8"), re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_gallery_has_small_stills(name: str) -> None:
    for kind in ("factory", "product"):
        still = DOCS / "gallery" / f"{name}-{kind}.png"
        assert 5_000 < still.stat().st_size < 200_000


SHOWN = re.compile(r"literalinclude} (\S+)\n(?::[^p].*\n)*:pyobject: (\S+)")


def test_code_that_is_shown_is_there() -> None:
    """Each object of a module that a page includes."""
    found = 0
    for page in WRITTEN:
        text = page.read_text("utf-8")
        for file, name in SHOWN.findall(text):
            inside = ast.parse((page.parent / file).read_text("utf-8")).body
            for part in name.split("."):
                named = [node for node in inside if getattr(node, "name", "") == part]
                assert named, f"{page.name} shows {name} of {file}"
                inside = named[0].body
            found += 1
    assert found > 20


@pytest.mark.slow
def test_the_site_is_built_without_a_warning_and_needs_no_network(tmp_path: Path) -> None:
    pytest.importorskip("furo", reason="the extra `docs` is not installed")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-d", tmp_path / "trees"]
    done = subprocess.run([*command, DOCS, tmp_path / "site"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    for page in (tmp_path / "site").rglob("*.html"):
        loaded = re.findall(
            r'<(?:script|img|link)[^>]+(?:src|href)="(https?:[^"]+)"', page.read_text("utf-8")
        )
        assert not loaded, f"{page.name} loads {loaded}"


def test_no_picture_of_the_gallery_is_older_than_the_code_that_draws_it(tmp_path: Path) -> None:
    """`make gallery` draws them anew."""
    pictures = {path.name for path in drawing.GALLERY.iterdir() if path.suffix != ".json"}
    now = drawing.digest()
    kept = drawing.digests()
    drawn = pictures - {*drawing.BY_A_BROWSER}
    assert {name for name in drawn if kept.get(name) != now} == set()
    for folder in drawing.FOLDERS:
        shutil.copytree(drawing.ROOT / "factory" / folder, tmp_path / folder)
    changed = tmp_path / "film" / "look.py"
    changed.write_text(changed.read_text("utf-8") + "# a comment\n", "utf-8")
    assert drawing.digest(tmp_path) == now
    changed.write_text(changed.read_text("utf-8").replace("0.855", "0.955"), "utf-8")
    assert drawing.digest(tmp_path) != now
