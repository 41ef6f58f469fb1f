"""Demands: orders from a CSV file, or drawn by a seed."""

from __future__ import annotations

import random
import re
from pathlib import Path

from factory.api import PAG, Demand, Diagnostic, InputError
from factory.support.errors import Position, did_you_mean
from factory.support.files import TABLE, read_bytes

MOST = 10**9
"""The latest time of an order [s], and the largest count."""

COLUMNS = ("product,time", "product,made", "product")
HINT = (
    "for example product,time and a line truck,12.5 for each order: its product, and when it is"
    " placed [s]; or product,made and truck,0 / van,6: what is asked for after so many products"
)


def demand_of(asked: str, pag: PAG, units: int) -> Demand:
    """The demand in a file, or `units` orders drawn by a seed with the frequencies of a mix. Raises
    InputError with every error of the file: BadDemand, BadFile."""
    if pag.mix is None:
        message = f"--demand is for a mix of products, and '{pag.file}' makes {pag.root} alone"
        raise InputError(Diagnostic("BadDemand", message, None, "write mix = 3 truck, 1 van;"))
    if asked.isdecimal() and asked.isascii():
        weights = [count for _, count in pag.mix.counts]
        drawn = random.Random(int(asked)).choices(pag.products, weights, k=units)
        return Demand(tuple((product, 0.0) for product in drawn))
    return read_demand(Path(asked), pag)


def read_demand(path: Path, pag: PAG) -> Demand:
    """The demand in a CSV file for the products of a mix. Raises InputError."""
    try:
        head, *rows = [
            [word.strip() for word in line.split(",")]
            for line in read_bytes(path, TABLE).decode("utf-8-sig").splitlines() or [""]
        ]
    except (OSError, UnicodeDecodeError) as error:
        message = f"'{path}' cannot be read: {getattr(error, 'strerror', 'it is not UTF-8 text')}"
        raise InputError(Diagnostic("BadFile", message, None, HINT)) from error
    columns = ",".join(head)
    orders, faults = list[tuple[str, float]](), list[Diagnostic]()

    def fault(row: int, message: str, hint: str = HINT) -> None:
        faults.append(Diagnostic("BadDemand", message, Position(str(path), row, 1), hint))

    if columns not in COLUMNS:
        fault(1, f"the columns are '{columns}', not one of: {'; '.join(COLUMNS)}")
    for row, words in enumerate(rows if not faults else (), start=2):
        product, *more = words
        if words == [""]:
            continue
        number = _number(more[0]) if more else 0.0
        if len(words) != len(head):
            fault(row, f"{len(words)} values, where there are {len(head)} columns")
        elif product not in pag.products:
            hint = did_you_mean(product, pag.products, "products")
            fault(row, f"'{product}' is no product of the mix", hint)
        elif number is None or (columns == "product,made" and number % 1):
            fault(
                row, f"'{more[0]}' is no {'time [s]' if 'time' in columns else 'count'} from 0 on"
            )
        elif orders and number < orders[-1][1]:
            fault(row, f"{more[0]} comes after {orders[-1][1]:g}: orders are in the order of time")
        else:
            orders.append((product, number))
    if not faults and not orders:
        fault(1, "there is no order")
    if not faults and columns == "product,made" and orders[0][1]:
        fault(2, f"nothing is asked for before {orders[0][1]:g} products are made; begin at 0")
    if faults:
        raise InputError(faults)
    if columns == "product,made":
        return Demand(changes=tuple((product, int(made)) for product, made in orders))
    return Demand(tuple(orders))


NUMBER = re.compile(r"([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]{1,2})?")
"""A number as people write it."""


def _number(text: str) -> float | None:
    """A non-negative number, at most MOST; None for anything else."""
    number = float(text) if NUMBER.fullmatch(text) else MOST + 1.0
    return number if number <= MOST else None
