"""The factory of a log, compiled again from the header."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from factory.compiler.assigning import shared
from factory.compiler.compiler import compile_pag
from factory.lang import read_pag, read_template
from factory.nets.history import firings
from factory.plant.factory import Factory
from factory.problem.plan import Plan
from factory.problem.robot_types import load_catalogue
from factory.support.errors import Diagnostic, InputError

AGAIN = "record it again: `factory run FILE.pag --log OUT`"


@contextmanager
def of_its_factory() -> Iterator[None]:
    """Raises InputError (BadLog) for the errors of a log that is not of the factory in its header,
    or of an older version."""
    try:
        yield
    except (ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        message = f"the log is not of the factory in its header: {error}"
        raise InputError(Diagnostic("BadLog", message, None, AGAIN)) from error


@of_its_factory()
def factory_of(header: Mapping[str, Any]) -> Factory:
    """The factory that a log's PAG and templates compile to; meshes are not read.

    Raises InputError (BadLog) where its names are not those of the header, or the run's first
    marking is not one of its own.
    """
    templates = {name: read_template(text, name) for name, text in header["templates"].items()}
    pag = read_pag(header["pag"]["text"], templates, header["pag"]["file"], None)
    catalogue = load_catalogue()
    plan = Plan.of_json(header["plan"])
    factory = shared(compile_pag(pag, templates, catalogue, {}, plan), plan, catalogue)
    net = factory.net.threaded
    made = [[x.name for x in found] for found in (net.transitions, net.places, factory.robots)]
    if made != [header["transitions"], header["places"], header["robots"]]:
        raise ValueError("its net is not that of its PAG")
    firings(factory.net, frozenset(header["start"]))
    return factory
