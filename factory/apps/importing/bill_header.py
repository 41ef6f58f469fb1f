"""Headers of bills of materials: which column is which, in English, German, French or Spanish, and
in which unit its values are."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from factory.apps.importing.draft import ImportFaults
from factory.support.decimals import UNITS
from factory.support.errors import Position, did_you_mean
from factory.support.texts import quoted

TITLES: Mapping[str, str] = MappingProxyType(
    {
        "level": "level, lvl, indent, depth; ebene, stufe, gliederungsebene; niveau; nivel",
        "item": "item, item no, item number, no, pos, wbs, #, position, find no; posnr, pos-nr,"
        " pos nr, positionsnummer, lfd nr, nr; repere, rep, n°, no d'article; nº, articulo, num",
        "name": "name, part, part name, part number, part no, description, component, title;"
        " bezeichnung, benennung, teil, teilename, bauteil, teilenummer, teile-nr, artikel,"
        " artikelnummer, sachnummer, beschreibung, komponente; designation, nom, piece,"
        " nom de la piece, composant, reference, numero de piece; denominacion, nombre, pieza,"
        " descripcion, componente, referencia, nombre de la pieza, numero de pieza",
        "quantity": "quantity, qty, count, amount, number, pcs; menge, anzahl, stuckzahl, stuck,"
        " stk, stck; quantite, qte, nombre, nb; cantidad, cant, cdad, unidades",
        "mesh": "mesh, mesh file, file, cad file, model, stl; netz, datei, dateiname, cad-datei,"
        " modell; maillage, fichier, modele; malla, archivo, fichero, modelo",
        "x": "x, pos x, x position",
        "y": "y, pos y, y position",
        "z": "z, pos z, z position",
        "mass": "mass, weight, unit mass; masse, gewicht, stuckgewicht; poids; masa, peso",
        "density": "density; dichte; densite, masse volumique; densidad",
    }
)
"""The columns that are read, each with its titles, the likeliest first: those of English, German,
French and Spanish, without accents."""

MASSES = {"kg": 1.0, "g": 1e-3, "mg": 1e-6, "t": 1e3, "lb": 0.45359237, "oz": 0.028349523125}
DENSITIES = {"kg/m3": 1.0, "kg/m^3": 1.0, "g/cm3": 1e3, "g/cm^3": 1e3, "g/ml": 1e3, "kg/dm3": 1e3}
LENGTHS = {**UNITS, "inch": UNITS["in"], '"': UNITS["in"]}

MEASURES: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {"x": LENGTHS, "y": LENGTHS, "z": LENGTHS, "mass": MASSES, "density": DENSITIES}
)
"""The units of the columns that have one [m, kg, kg/m³]."""

EXAMPLE = "level,name,quantity,mesh,x,y,z"


def _plain(title: str) -> str:
    """A title in small letters, without accents, underscores, full stops and double spaces."""
    letters = unicodedata.normalize("NFKD", title.replace("³", "3").replace("°", "\0").casefold())
    kept = "".join(c for c in letters if not unicodedata.combining(c)).replace("\0", "°")
    return " ".join(kept.replace("_", " ").replace(".", " ").split())


NAMES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {name: tuple(map(_plain, re.split("[,;] ", titles))) for name, titles in TITLES.items()}
)
"""The titles of each column, as `_plain` has them."""

_BRACKETED = re.compile(r"(.+?)\s*[\[(]([^\[\]()]*)[\])]")
_SPOKEN = re.compile(r"(.+?)(?:\s*/\s*|\s+in\s+|\s+)(\S+)")


@dataclass(frozen=True, slots=True)
class Header:
    """The index of each column that is read, its unit where the title names one [m, kg, kg/m³], and
    the titles of the columns that are not used."""

    columns: Mapping[str, int]
    units: Mapping[str, float]
    unused: tuple[str, ...] = ()


class HeaderReader:
    """Reads the header of a bill; errors go to the faults. `chosen`: titles of columns that the
    user has named, by the names of columns."""

    def __init__(self, faults: ImportFaults, chosen: Mapping[str, str]) -> None:
        self._faults, self._chosen = faults, chosen

    def read(self, cells: Sequence[str], at: Position, places: Sequence[Position]) -> Header:
        """The header in a row with its cells and their places. Raises InputError with every fault:
        BadValue, BadLevel, MissingPart."""
        titles = [cell.strip() for cell in cells]
        columns = self._chosen_columns(titles, at)
        ranks = dict.fromkeys(columns, -1)
        readings = [(_reading(title), index) for index, title in enumerate(titles) if title]
        for several in (False, True):  # a title of two columns is that one which is not there
            for names, index in readings:
                if index in columns.values() or (len(names) > 1) != several:
                    continue
                for name, rank in names.items():
                    if rank < ranks.get(name, len(NAMES[name])):
                        columns[name], ranks[name] = index, rank
                        break
                    if rank == ranks[name] and _plain(titles[index]) == _plain(
                        titles[columns[name]]
                    ):
                        message = f"there are two columns {quoted(titles[index])}"
                        self._faults.add("BadValue", message, places[index], "rename one of them")
        units = {
            name: unit
            for name, index in columns.items()
            if name in MEASURES and (unit := self._unit(name, titles[index], places[index]))
        }
        self._check(columns, at)
        used = {*columns.values()}
        unused = tuple(t for index, t in enumerate(titles) if t and index not in used)
        return Header(columns, units, unused)

    def _chosen_columns(self, titles: Sequence[str], at: Position) -> dict[str, int]:
        columns = dict[str, int]()
        for name, title in self._chosen.items():
            if title in titles:
                columns[name] = titles.index(title)
                continue
            hint = did_you_mean(title, [t for t in titles if t], "columns of the bill")
            self._faults.add("BadValue", f"there is no column {quoted(title)}", at, hint)
        return columns

    def _unit(self, name: str, title: str, place: Position) -> float | None:
        """The unit in a title; None for none. One that is not known is a fault."""
        _, unit = _divided(title, MEASURES[name])
        if not unit:
            return None
        if unit not in MEASURES[name]:
            message = f"the column {quoted(title)} has an unknown unit, {quoted(unit)}"
            self._faults.add("BadValue", message, place, f"units are {', '.join(MEASURES[name])}")
        return MEASURES[name].get(unit)

    def _check(self, columns: Mapping[str, int], at: Position) -> None:
        hint = f"the first line names the columns, for example {EXAMPLE}; or: --columns name=TITLE"
        if not {"level", "item"} & set(columns):
            message = "there is no column 'level' (0, 1, 2) or 'item' (1, 1.1, 1.2)"
            self._faults.add("BadLevel", message, at, hint)
        if not {"name", "mesh"} & set(columns):
            message = "there is no column 'name' or 'mesh'"
            self._faults.add("MissingPart", message, at, hint)
        self._faults.raise_if_any()


def _divided(title: str, units: Mapping[str, float]) -> tuple[str, str]:
    """A title and the unit in it: in brackets, or one of the `units` after a slash, "in" or a
    space."""
    plain = _plain(title)
    if match := _BRACKETED.fullmatch(plain):
        return match[1], match[2].strip()
    if (match := _SPOKEN.fullmatch(plain)) and match[2] in units:
        return match[1], match[2]
    return plain, ""


def _reading(title: str) -> dict[str, int]:
    """The columns that a title may be, with its rank among the titles of each."""
    names = dict[str, int]()
    for name, titles in NAMES.items():
        bare, _ = _divided(title, MEASURES.get(name, {}))
        if bare in titles:
            names[name] = titles.index(bare)
    return names
