"""The file of a plan: JSON with the PAG that it is of, which lies where the file says."""

from __future__ import annotations

import json
from hashlib import sha256
from pathlib import Path
from typing import Any

from factory.problem.plan import Plan
from factory.support.errors import Diagnostic, InputError, Position
from factory.support.files import TABLE, read_bytes

PLAN_NAME = "plan.json"

SCHEMA = "factory.plan.1"

AGAIN = "write it again: `factory build FILE.pag -o DIR`"


def plan_table(pag: str, text: str, plan: Plan) -> dict[str, Any]:
    """The table of a plan; `pag`: where the PAG lies from its folder, with its `text`."""
    digest = sha256(text.encode()).hexdigest()
    return {"schema": SCHEMA, "pag": pag, "sha256": digest, **plan.as_json()}


def read_plan(path: Path) -> tuple[Path, Plan]:
    """The PAG and the plan in a file. Raises InputError: BadFile where it or the PAG cannot be
    read, BadPlan where it is no plan, or that of another PAG."""
    try:
        table = json.loads(read_bytes(path, TABLE))
        if table["schema"] != SCHEMA:
            raise ValueError(f"its schema is {table['schema']!r}, not {SCHEMA!r}")
        pag, plan = path.parent / str(table["pag"]), Plan.of_json(table)
    except OSError as error:
        raise InputError(_fault("BadFile", path, f"cannot be read: {error.strerror}")) from error
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        words = f"has no {error}" if isinstance(error, KeyError) else f"is not right: {error}"
        raise InputError(_fault("BadPlan", path, words)) from error
    try:
        digest = sha256(read_bytes(pag, TABLE)).hexdigest()
    except OSError as error:
        raise InputError(_fault("BadFile", pag, f"cannot be read: {error.strerror}")) from error
    if digest != table["sha256"]:
        raise InputError(_fault("BadPlan", path, f"is of another version of '{pag}'"))
    return pag, plan


def _fault(code: str, path: Path, words: str) -> Diagnostic:
    return Diagnostic(code, f"'{path}' {words}", Position(str(path), 1, 1), AGAIN)
