"""A place/transition net from PNML, for tools that don't read PNML 2009, and a clock."""

import signal
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from contextlib import contextmanager

PNML = "{http://www.pnml.org/version-2009/grammar/pnml}"


def net(path: str) -> tuple[dict[str, int], list[str], list[tuple[str, str]]]:
    """Tokens by place, transitions, arcs."""
    root = ET.parse(path).getroot()
    places = {
        p.attrib["id"]: int(p.findtext(f"{PNML}initialMarking/{PNML}text", "0"))
        for p in root.iter(f"{PNML}place")
    }
    transitions = [t.attrib["id"] for t in root.iter(f"{PNML}transition")]
    arcs = [(a.attrib["source"], a.attrib["target"]) for a in root.iter(f"{PNML}arc")]
    return places, transitions, arcs


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raises TimeoutError inside when the time is over."""

    def over(*_: object) -> None:
        raise TimeoutError

    signal.signal(signal.SIGALRM, over)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
