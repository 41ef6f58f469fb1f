"""Paths on the command line: those that are read, and those that are written."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from factory.support.guard import reading

OUT = click.Path(path_type=Path, readable=False)
"""A path to write to, or to a folder. It is not checked here: `outputs` reports its faults."""


class _InputPath(click.Path):
    """A path that is read, which no output may write over."""

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        reading(path)
        return path


PATH = _InputPath(path_type=Path, readable=False)
"""A path to read from. It is not checked here: the stage that opens it reports its faults."""


def pag_files(ctx: click.Context, param: click.Parameter, begun: str) -> list[CompletionItem]:
    """Completions of FILE in a shell: PAG files, plans and folders; if there are no such files, any
    path."""
    folder, start = os.path.split(begun)
    try:
        names = sorted(n for n in os.listdir(folder or ".") if n.startswith(start))
    except OSError:
        names = []
    shown = [os.path.join(folder, n) for n in names if start or not n.startswith(".")]
    files = [name for name in shown if name.endswith((".pag", "plan.json"))]
    if not files:
        return [CompletionItem(begun, type="file")]
    folders = [f"{name}/" for name in shown if os.path.isdir(name)]
    return [CompletionItem(name) for name in (*files, *folders)]
