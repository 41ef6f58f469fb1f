"""The two things that drawings can show: the net and the assembly tree."""

from __future__ import annotations

from factory.export.subject import Subject
from factory.problem.pag import PAG
from factory.support.errors import Diagnostic, InputError

VIEWS = ["net", "tree"]


def view_of(subject: Subject) -> str:
    """Which of the two is asked for. Raises InputError (Usage) for anything else."""
    return subject.choose(VIEWS, "views")


def pag_of(subject: Subject) -> PAG:
    """The assembly tree. Raises InputError (Usage) where there is none, in a net from elsewhere."""
    if subject.kind != "a PAG":
        message = f"'{subject.file}' is {subject.kind}, in which there is no assembly tree"
        raise InputError(Diagnostic("Usage", message, None, "give a PAG, or --of net"))
    return subject.source.pag
