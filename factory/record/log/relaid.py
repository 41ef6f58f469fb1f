"""The project of a log, made again from the header."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from factory.lang import read_pag, read_template
from factory.layout.request import Ground
from factory.pipeline import Project
from factory.problem.pag import PAG
from factory.problem.plan import Plan
from factory.problem.template import Template
from factory.record.log.header import settings_of
from factory.support.errors import InputError


def project_of(header: Mapping[str, Any], beside: Path) -> Project:
    """The project that a log in the folder `beside` is of. Raises InputError where its PAG cannot
    be read, or meshes are missing, KeyError for a log of an older version."""
    templates = {word: read_template(text, word) for word, text in header["templates"].items()}
    pag, kept = _pag(header["pag"], templates, beside), header.get("ground", {})
    floor = kept.get("floor") and tuple(map(float, kept["floor"]))
    ground, plan = Ground(**{**kept, "floor": floor}), Plan.of_json(header["plan"])
    plan = replace(plan, relays={})
    return Project(pag, templates, settings=settings_of(header), ground=ground, plan=plan)


def _pag(kept: Mapping[str, str], templates: Mapping[str, Template], beside: Path) -> PAG:
    """The PAG in a log, with its meshes from the folder that the PAG was in or, where they are not
    there, from beside the log. Raises InputError where they are in neither."""
    file, text = kept["file"], kept["text"]
    try:
        return read_pag(text, templates, file, os.path.dirname(file) or ".")
    except InputError:
        with suppress(InputError):
            return read_pag(text, templates, file, str(beside))
        raise
