"""What all tests share: golden files, the shipped templates, hypothesis without deadlines.

What needs commands or an app is imported by its fixture alone: tests of the core need neither."""

from __future__ import annotations

import os
import shutil
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import HealthCheck, settings

from factory.theory.lang import load_templates
from factory.theory.problem.template import Template
from tests.once import ANEW, Stages, stages_once
from tests.paths import ROOT, TESTS

if TYPE_CHECKING:
    from factory.apps.sweep import Recipe
    from factory.apps.sweep.grid import Point
    from factory.apps.sweep.work import Outcome
    from tests.command_line import Terminal

collect_ignore_glob = ["oracles/*"]
"""Scripts for environments of their own."""

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # as in what a shell starts with `&`
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile(
    "factory", deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True
)
settings.load_profile("factory")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden",
        action="store_true",
        help="write what was found to tests/golden instead of comparing it",
    )


@pytest.fixture(scope="session")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of all processes of a session."""
    folder = tmp_path_factory.getbasetemp()
    return folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder


@pytest.fixture(scope="session", autouse=True)
def _a_cache_of_its_own(shared: Path) -> Iterator[None]:
    """Tests leave the user's cache alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(shared / "cache"))
        yield


@pytest.fixture(scope="session")
def stages(shared: Path) -> Iterator[Stages]:
    """The stages that tests of a session share."""
    (shared / "stages").mkdir(exist_ok=True)
    with stages_once(shared / "stages") as stages:
        yield stages


@pytest.fixture(autouse=True)
def _stages_are_used(request: pytest.FixtureRequest, stages: Stages) -> None:
    """By tests that are not about a stage."""
    stages.on = request.node.path.stem not in ANEW


@pytest.fixture
def monkeypatch(stages: Stages) -> Iterator[pytest.MonkeyPatch]:
    """As pytest's; from the first attribute that a test replaces it computes its stages itself,
    since a stage under a planted fault is another one."""
    with pytest.MonkeyPatch.context() as patch:
        replaced = patch.setattr

        def setattr_(*words: Any, **options: Any) -> None:
            stages.on = False
            replaced(*words, **options)

        patch.setattr = setattr_  # type: ignore[method-assign]
        yield patch


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Callable[[str, str], None]:
    """`golden(name, text)` compares a text with the file tests/golden/NAME, or updates that."""
    update = bool(request.config.getoption("--update-golden"))

    def compare(name: str, text: str) -> None:
        path = TESTS / "golden" / name
        if update:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8", newline="\n")
        assert path.is_file(), f"{path} is missing: run pytest --update-golden and look at it"
        assert text == path.read_text(encoding="utf-8")

    return compare


@pytest.fixture(scope="session")
def templates() -> Mapping[str, Template]:
    """The shipped templates."""
    return load_templates([ROOT / "templates"])


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Terminal:
    """`run("check", file, "--json")` runs a command of the command line in this process."""
    from tests.command_line import Terminal

    return Terminal(capsys)


@pytest.fixture(scope="session")
def opencascade() -> Iterator[Any]:
    """Converts STEP files, and has loaded OpenCASCADE once."""
    pytest.importorskip("cascadio")
    from tests.step_reader import loaded

    with loaded() as reader:
        yield reader


@pytest.fixture
def steps(opencascade: Any) -> Iterator[None]:
    """STEP files are read without loading OpenCASCADE for each."""
    from factory.apps.importing import scene_file

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scene_file, "subprocess", opencascade)
        yield


@pytest.fixture
def here() -> Iterator[None]:
    """Runs of a sweep are done in this process, which starts at once."""
    from factory.apps.sweep import sweeping
    from factory.apps.sweep.work import Runner

    def run_here(
        recipe: Recipe, wanted: Sequence[Point], jobs: int, on: str | None
    ) -> Iterator[Outcome]:
        yield from map(Runner(recipe), wanted)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sweeping, "outcomes_of", run_here)
        yield


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """A folder for what is written, that stays empty when something is wrong."""
    folder = tmp_path / "out"
    folder.mkdir()
    return folder


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """A browser without a screen, that draws in software."""
    reason = "pip install 'klavins-factory[browser]'"
    playwright = pytest.importorskip("playwright.sync_api", reason=reason)
    names = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    program = next(filter(None, map(shutil.which, names)), None)
    if program is None:
        pytest.skip("no chromium: apt-get install chromium")
    flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with playwright.sync_playwright() as started:
        found = started.chromium.launch(executable_path=program, args=flags)
        yield found
        found.close()
