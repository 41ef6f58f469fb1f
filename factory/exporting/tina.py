"""The textual format `.net` of TINA, the Time Petri Net Analyzer: places with labels and tokens,
transitions with their arcs.

The grammar is that of TINA's manual page `formats`. Names that are keywords, or not of letters,
digits, primes and underscores alone, stand in braces, in which `{`, `}` and `\\` are preceded by
`\\`. A transition that has the name of a place gets a prime.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from factory.exporting.subject import Subject
from factory.nets.gears import GearNet
from factory.nets.marked import MarkedNet, marked

FORMAT, TAKES = "tina", "net"

KEYWORDS = frozenset({"net", "pl", "tr", "lb", "pr", "nt", "ls"})
"""Names that begin a declaration."""

_PLAIN = re.compile(r"[A-Za-z0-9_']+")
_SPECIAL = re.compile(r"([{}\\])")


def export(subject: Subject) -> str:
    """The net as TINA reads it."""
    return write_tina(subject.net, subject.stem)


def write_tina(net: GearNet | MarkedNet, name: str) -> str:
    """The net and its initial marking, places before transitions, as a `.net` text."""
    return "\n".join(_lines(marked(net), name)) + "\n"


def _lines(net: MarkedNet, name: str) -> Iterator[str]:
    names = [place.name for place in net.net.places]
    places, taken = [_name(name) for name in names], set(names)
    yield f"net {_name(name)}"
    for index, place in enumerate(net.net.places):
        words = f"{place.mode} {place.label}".strip()
        about = f" : {_name(words)}" if words else ""
        tokens = f" ({net.tokens[index]})" if net.tokens[index] else ""
        yield f"pl {places[index]}{about}{tokens}"
    for event, transition in enumerate(net.net.transitions):
        before = " ".join(places[p] for p in net.net.preset[event])
        after = " ".join(places[p] for p in net.net.postset[event])
        own = transition.name
        while own in taken:
            own += "'"
        taken.add(own)
        yield " ".join(filter(None, ["tr", _name(own), before, "->", after]))


def _name(text: str) -> str:
    """A name, in braces where it needs them."""
    if _PLAIN.fullmatch(text) and text not in KEYWORDS:
        return text
    shown = "".join(c if c.isprintable() else " " for c in text)
    return "{" + _SPECIAL.sub(r"\\\1", shown) + "}"
