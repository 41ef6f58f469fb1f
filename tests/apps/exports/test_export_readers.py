"""Every export, read back by a reader that is not ours; the table of them in docs/exports.md."""

from __future__ import annotations

from pathlib import Path

import pytest

from factory.apps.exports import exporters
from tests.export_values import LAMP, READERS, kept_log, project, table
from tests.paths import ROOT

DOCUMENT = ROOT / "docs" / "exports.md"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return kept_log(project(LAMP).layout, tmp_path_factory.mktemp("log") / "lamp.log", units=2)


@pytest.mark.parametrize("which", READERS)
def test_read_back(which: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    reader = READERS[which]
    takes_log = exporters()[reader.form].takes in ("log", "factory")
    reader.check(request.getfixturevalue("log") if takes_log else tmp_path)


def test_the_table_in_the_docs(request: pytest.FixtureRequest) -> None:
    text = DOCUMENT.read_text("utf-8")
    start, end = "<!-- readers -->\n", "<!-- end -->"
    head, _, rest = text.partition(start)
    old, _, tail = rest.partition(end)
    if request.config.getoption("--update-golden"):
        DOCUMENT.write_text(head + start + table(READERS) + end + tail, "utf-8")
        return
    assert old == table(READERS)


def test_every_format_has_a_reader_or_says_that_there_is_none() -> None:
    without = set(exporters()) - {reader.form for reader in READERS.values()}
    text = DOCUMENT.read_text("utf-8")
    for form in sorted(without):
        assert f"`{form}`: no independent reader" in text
