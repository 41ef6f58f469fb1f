"""Logs that a command turns into something else: it is done, with a warning, as far as they go."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from factory.support.console import warn

if TYPE_CHECKING:
    from factory.record.log import Log


def read_partly(file: Path, silent: bool) -> Log:
    """The log in a file, with a warning where its run was cut off. Raises InputError (BadLog)."""
    from factory.record.log import read_log

    log = read_log(file)
    if log.cut_off:
        warn([log.cut_off.diagnostic(file)], silent)
    return log


def cut_off(log: Log | None) -> dict[str, object]:
    """The key `cut_off` of a `--json` document about a log; nothing without one."""
    if log is None:
        return {}
    return {"cut_off": log.cut_off and log.cut_off.as_json()}
