"""The files of a clearance certificate, read and of the documented form."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from factory.api import Diagnostic, InputError, MarkedNet, read_text
from factory.apps.foreign_nets.pnml_reader import read_pnml
from factory.apps.log.content import LARGE
from factory.support.engine import mujoco, unwarned
from factory.support.files import NET, read_bytes

ENDINGS = ("xml", "coordinated.pnml", "ways.json", "clearance.json")
"""The ends of the names of the four files; the first is that of the model."""

HINT = "`factory build FILE.pag -o DIR` writes the four files of a certificate"

FINITE = 1e9
"""A number that is read is less than this."""

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class MachineWay:
    """A machine while places of the net are marked.

    Attributes:
        machine: its name.
        places: the places, all of which are marked then.
        bodies: its bodies in the model.
        joints: their joints.
        welds: the welds by which it holds parts.
        spans: the intervals of the joints, one after the other for each group [m or rad].
    """

    machine: str
    places: tuple[str, ...]
    bodies: tuple[str, ...]
    joints: tuple[str, ...]
    welds: tuple[str, ...]
    spans: tuple[tuple[Interval, ...], ...]

    def __str__(self) -> str:
        return f"{self.machine} in {' and '.join(self.places)}"


@dataclass(frozen=True, slots=True)
class ExcludedPair:
    """Two machines that come near in two places, and a circuit of the net through both."""

    machines: tuple[str, ...]
    places: tuple[str, ...]
    circuit: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Row:
    """A place of the net: the transitions that mark and unmark it, and its tokens at the start."""

    before: str
    after: str
    tokens: int


@dataclass(frozen=True)
class ClearanceProof:
    """What the four files say.

    Attributes:
        model: the engine's model.
        net: the places of the net in PNML, by name.
        places: those that the ways refer to, with their names.
        ways: the ways of the machines.
        excluded: the pairs that come near.
        clearance: what is claimed of machines that do not work together [m].
    """

    model: mujoco.MjModel
    net: dict[str, Row]
    places: tuple[tuple[str, Row], ...]
    ways: tuple[MachineWay, ...]
    excluded: tuple[ExcludedPair, ...]
    clearance: float

    @property
    def by_machine(self) -> dict[str, list[MachineWay]]:
        """The ways of each machine, by its name."""
        ways = dict[str, list[MachineWay]]()
        for way in self.ways:
            ways.setdefault(way.machine, []).append(way)
        return ways


def read_folder(folder: Path) -> ClearanceProof:
    """The certificate in a folder. Raises InputError (BadProof) where a file is missing or broken,
    and where it holds those of several builds."""
    paths = _paths(folder)
    net = net_of(read_text(paths["coordinated.pnml"], NET), paths["coordinated.pnml"])
    ways, clearance = (_json(paths[end]) for end in ENDINGS[2:])
    return proof_of(_model(paths["xml"]), net, ways, clearance)


def proof_of(
    model: mujoco.MjModel, net: dict[str, Row], ways: DocumentReader, clearance: DocumentReader
) -> ClearanceProof:
    """The certificate of a model and three documents. Raises InputError (BadProof)."""
    excluded, metres = _excluded(clearance), clearance["clearance_m"].number
    return ClearanceProof(model, net, *_ways(ways), excluded, metres)


def _paths(folder: Path) -> dict[str, Path]:
    last = f".{ENDINGS[-1]}"
    try:
        names = sorted(path.name for path in folder.iterdir() if path.name.endswith(last))
    except OSError as error:
        raise _bad(folder, f"it cannot be read: {error.strerror}") from error
    if len(names) != 1:
        listed = f"those of {len(names)} builds: {', '.join(names[:3])}" if names else "none"
        raise _bad(folder, f"a folder with one NAME{last} is needed; it has {listed}")
    name = names[0].removesuffix(last)
    paths = {end: folder / f"{name}.{end}" for end in ENDINGS}
    missing = [path.name for path in paths.values() if not path.exists()]
    if missing:
        raise _bad(folder, f"it lacks {', '.join(missing)}")
    return paths


def _bad(path: Path, what: str) -> InputError:
    return InputError(
        Diagnostic("BadProof", f"'{path}' is no clearance certificate: {what}", None, HINT)
    )


def _model(path: Path) -> mujoco.MjModel:
    try:
        read_bytes(path, LARGE)
        with unwarned():
            return mujoco.MjModel.from_xml_path(str(path))
    except OSError as error:
        raise _bad(path, f"it cannot be read: {error.strerror}") from error
    except ValueError as error:
        words = " ".join(str(error).split())
        raise _bad(path, f"the engine refuses it: {words}") from None


def net_of(text: str, path: Path = Path()) -> dict[str, Row]:
    """The places of a net in PNML, by name. Raises InputError."""
    net: MarkedNet = MarkedNet.of(read_pnml(text, str(path)))
    rows, events = dict[str, Row](), net.net.transitions
    for place, tokens in zip(net.net.places, net.tokens, strict=True):
        if len(place.left) != 1 or len(place.right) != 1:
            raise _bad(path, f"place '{place.name}' has not one transition before and one after it")
        if place.name in rows:
            raise _bad(path, f"two places are called '{place.name}'")
        rows[place.name] = Row(events[place.left[0]].name, events[place.right[0]].name, tokens)
    return rows


def _json(path: Path) -> DocumentReader:
    try:
        document = json.loads(read_bytes(path, NET).decode("utf-8-sig"))
    except OSError as error:
        raise _bad(path, f"it cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError):
        raise _bad(path, "its content is no JSON in UTF-8") from None
    return DocumentReader(path, document)


@dataclass(frozen=True, slots=True)
class DocumentReader:
    """A value in a document, and where it is there."""

    path: Path
    value: Any
    at: str = ""

    def __getitem__(self, key: str) -> DocumentReader:
        where = f"{self.at}.{key}".strip(".")
        if not isinstance(self.value, dict) or key not in self.value:
            raise _bad(self.path, f"it lacks '{where}'")
        return DocumentReader(self.path, self.value[key], where)

    def __iter__(self) -> Iterator[DocumentReader]:
        for number, value in enumerate(self._of(list, "a list")):
            yield DocumentReader(self.path, value, f"{self.at}[{number}]")

    def _of(self, kind: type, words: str) -> Any:
        if type(self.value) is not kind:
            shown = json.dumps(self.value)[:40]
            raise _bad(self.path, f"'{self.at}' has to be {words}; found {shown}")
        return self.value

    @property
    def text(self) -> str:
        """The value, a text."""
        text: str = self._of(str, "a text")
        return text

    @property
    def texts(self) -> tuple[str, ...]:
        """The value, a list of texts."""
        return tuple(each.text for each in self)

    @property
    def count(self) -> int:
        """The value, a number of things."""
        number: int = self._of(int, "a whole number")
        return number

    @property
    def number(self) -> float:
        """The value, a finite number."""
        if type(self.value) not in (int, float) or not abs(self.value) < FINITE:
            shown = json.dumps(self.value)[:40]
            raise _bad(self.path, f"'{self.at}' has to be a number; found {shown}")
        return float(self.value)

    @property
    def interval(self) -> Interval:
        """The value, the two ends of an interval, the lower first."""
        ends = self._of(list, "a list of two numbers")
        numbers = [end for end in ends if type(end) in (int, float) and abs(end) < FINITE]
        if len(ends) != 2 or len(numbers) != 2 or numbers[0] > numbers[1]:
            shown = json.dumps(self.value)[:40]
            raise _bad(self.path, f"'{self.at}' has to be [low, high]; found {shown}")
        return float(numbers[0]), float(numbers[1])


def _ways(document: DocumentReader) -> tuple[tuple[tuple[str, Row], ...], tuple[MachineWay, ...]]:
    places = tuple(
        (row["place"].text, Row(row["before"].text, row["after"].text, row["tokens"].count))
        for row in document["places"]
    )
    ways = tuple(
        MachineWay(
            way["machine"].text,
            way["places"].texts,
            way["bodies"].texts,
            way["joints"].texts,
            way["welds"].texts,
            tuple(tuple(span.interval for span in group) for group in way["spans"]),
        )
        for way in document["ways"]
    )
    return places, ways


def _excluded(document: DocumentReader) -> tuple[ExcludedPair, ...]:
    return tuple(
        ExcludedPair(*(pair[key].texts for key in ("machines", "places", "circuit")))
        for pair in document["excluded"]
    )
