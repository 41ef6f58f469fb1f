"""A certificate in a file, checked against a net.

It is refused where it does not prove a property that it claims, as `check_certificate` finds from
the document alone, or where it is of another net: both are compared by the names of places,
transitions and robots, as another program may number them otherwise.
"""

from __future__ import annotations

import json
from itertools import zip_longest
from pathlib import Path
from typing import Any

from factory.api import Diagnostic, GearNet, InputError, MarkedNet, RunError, Verdict
from factory.apps.exports.certificate.check import check_certificate
from factory.apps.exports.certificate.listing import CLAIMS
from factory.apps.exports.certificate.writer import certificate
from factory.support.errors import Position
from factory.support.files import NET, read_bytes

Json = dict[str, Any]

HINT = "`factory check FILE --certificate OUT` writes the certificate of a net"


def read_certificate(path: Path) -> Json:
    """The document in a file. Raises InputError (BadProof) where there is none, or none with
    the sections of a certificate."""
    try:
        document = json.loads(read_bytes(path, NET).decode("utf-8-sig"))
    except OSError as error:
        raise InputError(_bad(path, f"it cannot be read: {error.strerror}")) from error
    except json.JSONDecodeError as error:
        at = Position(str(path), error.lineno, error.colno)
        ends = error.pos >= len(error.doc.rstrip()) or error.msg.startswith("Unterminated")
        what = "it ends too early" if ends else "no JSON from here on"
        raise InputError(_bad(path, what, at)) from None
    except (ValueError, RecursionError):
        raise InputError(_bad(path, "its content is no JSON in UTF-8")) from None
    sections = ("schema", "net", "robots", *CLAIMS, "digest")
    missing = [key for key in sections if not isinstance(document, dict) or key not in document]
    if missing:
        raise InputError(_bad(path, f"it lacks {', '.join(map(repr, missing))}"))
    certificate: Json = document
    return certificate


def check_against(path: Path, net: GearNet | MarkedNet, verdict: Verdict) -> Json:
    """The certificate in a file, which is of this net and proves what it claims.

    Raises InputError (BadProof) where it cannot be read, RunError (BadProof) with every
    reason for which it is refuted.
    """
    document = read_certificate(path)
    faults = check_certificate(document)
    if place := _differing(document, json.loads(json.dumps(certificate(net, verdict))), net):
        faults.append(f"it is of another net: they differ first in {place}")
    if faults:
        raise RunError([_bad(path, faults[0]), *(_bad(path, f, hint="") for f in faults[1:])])
    return document


def _differing(one: Json, other: Json, net: GearNet | MarkedNet) -> str:
    """The first difference of the nets in two certificates, "" where they are equal: including
    robots, gears and slots if the net has gears of its own."""
    has_gears = isinstance(net, GearNet)
    try:
        return first_difference(_named(one, has_gears), _named(other, has_gears))
    except (KeyError, TypeError, IndexError, ValueError, AttributeError, RecursionError):
        return "their form: it is not the documented one"


def _named(document: Json, has_gears: bool) -> Json:
    """The net of a certificate with names in place of numbers."""
    net, robots = document["net"], document["robots"]
    events, places = ([row["name"] for row in net[key]] for key in ("transitions", "places"))
    names = [robot["name"] for robot in robots]
    by_name: Json = {f"transition {event}": {} for event in events}
    for place in net["places"]:
        by_name[f"place {place['name']}"] = row = {
            "tokens": place["tokens"],
            "producers": sorted(events[e] for e in place["left"]),
            "consumers": sorted(events[e] for e in place["right"]),
        }
        if has_gears:
            row |= {key: place[key] for key in ("mode", "label")}
            row["robots"] = [names[slot] if slot >= 0 else None for slot in place["slots"]]
    for event in net["transitions"] if has_gears else ():
        moves = event["moves"]
        named = moves and sorted([places[p], i, places[q], j] for p, i, q, j in moves)
        by_name[f"transition {event['name']}"]["moves"] = named
    for robot in robots if has_gears else ():
        by_name[f"robot {robot['name']}"] = {
            "type": robot["type"],
            "gear": [places[p] for p in robot["places"]],
            "initial place": None if robot["initial"] is None else places[robot["initial"]],
        }
    return by_name


def first_difference(one: Any, other: Any, path: str = "") -> str:
    """Path of the first difference of two documents with their values there, as `robot r1.gear[3]:
    "a" and "b"`; "" where they are equal."""
    if isinstance(one, dict) and isinstance(other, dict):
        keys = dict.fromkeys([*other, *one])
        inside = ((f"{path}.{key}".strip("."), one.get(key), other.get(key)) for key in keys)
    elif isinstance(one, list) and isinstance(other, list):
        pairs = enumerate(zip_longest(one, other))
        inside = ((f"{path}[{i}]", a, b) for i, (a, b) in pairs)
    else:
        same = one == other and type(one) is type(other)
        return "" if same else f"{path}: {_shown(one)} and {_shown(other)}"
    return next(filter(None, (first_difference(a, b, at) for at, a, b in inside)), "")


def _shown(value: Any) -> str:
    text = "nothing" if value is None else json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _bad(path: Path, words: str, at: Position | None = None, hint: str = HINT) -> Diagnostic:
    at = at or Position(str(path), 1, 1)
    return Diagnostic("BadProof", f"the certificate is refused: {words}", at, hint)
