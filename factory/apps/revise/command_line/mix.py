"""The command `mix`."""

from __future__ import annotations

from pathlib import Path

import click

from factory.api import Diagnostic, InputError
from factory.commands.options import OUT, OUTPUT, PATH, TEMPLATES, pag_files
from factory.commands.outputs import writable
from factory.commands.requests import OutputOptions
from factory.support.console import emit, say
from factory.support.settings import MOST_UNITS


@click.command()
@click.argument("one", type=PATH, shell_complete=pag_files)
@click.argument("other", type=PATH, shell_complete=pag_files)
@TEMPLATES
@click.option("--count", default="1:1", help="Units of each product in a period, for example 3:1.")
@click.option("-o", "output", type=OUT, required=True, help="The file to write.")
@OUTPUT
def mix(
    one: Path,
    other: Path,
    folders: tuple[Path, ...],
    count: str,
    output: Path,
    out: OutputOptions,
) -> int:
    """Write two products as one family.

    What ONE.pag and OTHER.pag have in common is written once.
    """
    from factory.api import all_templates, load_pag, write_pag
    from factory.apps.revise.family import family
    from factory.support.files import write_all

    writable(output)
    templates, counts = all_templates(folders), _counts(count)
    pags = [load_pag(file, templates) for file in (one, other)]
    made = family(pags[0], pags[1], counts, output.parent)
    write_all({output: write_pag(made.pag).encode()})
    products, shift = made.pag.products, made.matching.shift
    alone = [len(pags[0]) - len(made.common), len(pags[1]) - len(made.common)]
    if out.as_json:
        document = {"products": [*products], "common": [*made.common], "renamed": made.renamed}
        emit({**document, "names": made.names, "moved_by_m": [*shift], "file": str(output)})
        return 0
    say(
        f"{output}: {counts[0]} {products[0]} and {counts[1]} {products[1]};"
        f" {len(made.common)} labels are common, {alone[0]} of {products[0]} alone,"
        f" {alone[1]} of {products[1]} alone"
    )
    for old, new in made.renamed.items() if out.verbose else ():
        say(f"  {old} is {new}")
    if any(shift):
        x, y, z = (1000 * v for v in shift)
        say(f"{products[1]} was ({x:g}, {y:g}, {z:g}) mm away from {products[0]}")
    return 0


def _counts(text: str) -> tuple[int, int]:
    """`3:1` as two numbers. Raises InputError (BadValue)."""
    words = text.split(":")
    if len(words) == 2 and all(w.isascii() and w.isdecimal() and len(w) <= 2 for w in words):
        first, second = map(int, words)
        if first and second and first + second <= MOST_UNITS:
            return first, second
    message = f"--count takes two numbers from 1, together at most {MOST_UNITS}, not '{text}'"
    raise InputError(Diagnostic("BadValue", message, None, "for example --count 3:1"))
