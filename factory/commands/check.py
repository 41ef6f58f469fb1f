"""The command `check`."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from factory.commands.allowing import ALLOW
from factory.commands.defaults import with_defaults
from factory.commands.grouped import Grouped
from factory.commands.options import (
    OUT,
    OUTPUT,
    PATH,
    PROJECT,
    RELAY,
    TEMPLATES,
    WIP,
    options,
)
from factory.commands.outputs import for_a_pag, without_others, writable, writable_folder
from factory.commands.paths import pag_files
from factory.commands.requests import OutputOptions, ProjectOptions
from factory.commands.warnings import announced, say_allowed
from factory.support.collector import collector_paused
from factory.support.console import emit, say, table
from factory.support.errors import Diagnostic, RunError, usage_error
from factory.support.files import is_net
from factory.support.progress import Waiting

if TYPE_CHECKING:
    from factory.commands.checking import Checked
    from factory.floor.mating.findings import Matings
    from factory.theory.nets.coordinated import CoordinatedNet
    from factory.theory.nets.verdict import Witness
    from factory.theory.problem.pag import AllowedOverlap

SHOWN = 16
"""The most robots that are printed, unless `-v` asks for all."""

MODES = 8
"""The most modes of a gear that are printed, unless `-v` asks for all."""

NOUNS = ("robot", "place", "transition", "token")
"""What is counted of a net."""

PICTURES = "Folder for pictures of blocked operations and of parts that no hand can hold."
"""The help of `--clashes`."""

PROOF = "Check the clearance certificate in a folder that build -o wrote, without FILE."
"""The help of `--clearance`."""

SOURCE = options(
    click.argument("file", type=PATH, required=False, default=Path(), shell_complete=pag_files),
    TEMPLATES,
    PROJECT,
)

AGAINST = 3
"""The most that is printed against one property, unless `-v` asks for all."""

POOLED = 8
"""The most parts whose copies are printed."""


@with_defaults
@click.command(cls=Grouped)
@SOURCE
@click.option("--certificate", type=OUT, help="Write the proof to this file.")
@click.option("--against", type=PATH, help="Check a proof written by --certificate.")
@click.option("--clearance", "folder", type=PATH, help=PROOF)
@WIP
@ALLOW
@click.option("--clashes", type=OUT, help=PICTURES)
@RELAY
@OUTPUT
@collector_paused()
def check(
    options: ProjectOptions,
    out: OutputOptions,
    certificate: Path | None,
    against: Path | None,
    folder: Path | None,
    wip: int | None,
    clashes: Path | None,
) -> int:
    """Compile FILE.pag and prove it live, or check a certificate.

    FILE may be a net in PNML.
    """
    if folder is not None:
        without_others("folder", f"--clearance '{folder}'")
        return _check_clearance(folder, out)
    if options.file == Path():
        raise usage_error("Missing argument 'FILE'.", "see factory check --help")
    from factory.commands.checking import check_net, check_project
    from factory.support.files import own_names, write_all, write_text

    file = options.file
    if is_net(file):
        for_a_pag(file, "a net in PNML", "certificate", "against")
    writable(certificate)
    writable_folder(clashes)
    project = None if is_net(file) else options.project(out.silent)
    with Waiting("reading the shapes and proving", out.silent):
        checked = check_project(project, wip, out.verbose) if project else check_net(file)
    announced(checked.warnings, out)
    if project is not None and not out.silent:
        say_allowed(project)
    proved = None if against is None else _proved(against, checked)
    if clashes is not None:
        files = _pictures(checked, clashes)
        own_names(clashes, files)
        write_all(files)
    if certificate is not None:
        from factory.apps.exports.certificate.writer import certificate as document

        proof = document(checked.net, checked.verdict)
        write_text(certificate, json.dumps(proof, ensure_ascii=False) + "\n")
    if out.as_json:
        certified = {"certificate": {"file": str(against), **proved}} if proved else {}
        emit({**checked.as_json(), **certified})
    else:
        _describe(checked, out.verbose, project.pag.allowed if project else ())
        if proved:
            say(f"{against} is a certificate of this net: {_claims(proved)}")
    return 0 if checked.verdict.holds else 1


def _check_clearance(folder: Path, out: OutputOptions) -> int:
    """Check the clearance certificate in a folder. Raises InputError, or RunError (BadProof) with
    everything that is wrong with it."""
    from factory.apps.exports.clearance.checking import faults_of
    from factory.apps.exports.clearance.documents import read_folder

    with Waiting("checking that machines never meet", out.silent):
        proof = read_folder(folder)
        faults = faults_of(proof)
    counts = {"machines": len(proof.by_machine), "ways": len(proof.ways)}
    counts |= {"pairs": len(proof.excluded), "places": len(proof.net)}
    if out.as_json:
        emit({"clearance": str(folder), "holds": not faults, **counts, "faults": faults})
        return 1 if faults else 0
    if faults:
        hint = "build it again: `factory build FILE.pag -o DIR`"
        raise RunError(
            Diagnostic("BadProof", fault, None, "" if n else hint) for n, fault in enumerate(faults)
        )
    listed = ", ".join(f"{count} {name}" for name, count in counts.items())
    say(f"{folder}: no two machines ever meet: {listed}")
    return 0


def _proved(certificate: Path, checked: Checked) -> dict[str, bool | None]:
    """The claims of a certificate of the checked net: each property proved (True), said to fail
    (False) or open (None). Raises InputError, or RunError if the certificate is refused."""
    from factory.apps.exports.certificate.listing import CLAIMS, TRAIN
    from factory.apps.exports.certificate.proof_file import check_against

    document = check_against(certificate, checked.net, checked.verdict)
    claims = (*CLAIMS, TRAIN) if TRAIN in document else CLAIMS
    return {claim: document[claim]["holds"] for claim in claims}


def _claims(proved: dict[str, bool | None]) -> str:
    """The claims of a certificate in words."""
    words = {True: "proves", False: "gives a reason against", None: "leaves open"}
    shown = {c: v for c, v in proved.items() if c != "gear_net" or not proved.get("gear_train")}
    said = {how: [c.replace("_", " ") for c, v in shown.items() if v is how] for how in words}
    return "; ".join(
        f"it {words[how]} {', '.join(claims)}" for how, claims in said.items() if claims
    )


def _pictures(checked: Checked, folder: Path) -> dict[Path, bytes]:
    """The files of `--clashes`: a picture of each blocked operation, and of each sub-assembly that
    no hand can hold."""
    from factory.apps.exports import clash_picture, grip_picture

    drawn: dict[Path, bytes] = {}
    if checked.product is None:
        return drawn
    if checked.matings is not None:
        drawn |= clash_picture.pictures(folder, checked.matings, checked.product)
    if checked.no_grips:
        drawn |= grip_picture.pictures(folder, checked.no_grips, checked.product)
    return drawn


def _describe(checked: Checked, verbose: bool, allowed: Sequence[AllowedOverlap]) -> None:
    """Print the gears, the counts and the verdict."""
    from factory.support.texts import counted

    counts, gears = checked.counts(), checked.verdict.gears
    shown = [*checked.gears(None if verbose else SHOWN)]
    rows = (
        (g["robot"], g["type"], _modes(g["places"], len(g["places"]) if verbose else MODES))
        for g in shown
    )
    if gears:
        table("", ("robot", "type", "gear"), rows)
    if len(shown) < len(gears):
        say(f"... and {len(gears) - len(shown)} more robots (-v shows all)")
    made = checked.factory.pag.title if checked.factory else checked.name
    say(
        f"{made}: {', '.join(counted(counts[f'{noun}s'], noun) for noun in NOUNS)},"
        f" largest mode {counts['largest_mode']}"
    )
    words = {True: "yes", False: "NO", None: "undecided"}
    holds = {name: getattr(checked.verdict, name) for name in checked.verdict.properties}
    say(", ".join(f"{name.replace('_', ' ')}: {words[holding]}" for name, holding in holds.items()))
    for alike in _by_property(checked.verdict.faults):
        for witness in alike if verbose else alike[:AGAINST]:
            say(f"  {witness}")
        if not verbose and len(alike) > AGAINST:
            name = alike[0].property.replace("_", " ")
            say(f"  not {name}: and {len(alike) - AGAINST} more (-v shows all)")
    if checked.coordinated is not None:
        _describe_coordinated(checked.coordinated, checked.machines, verbose)
    if checked.pool:
        most = sorted(checked.pool.items(), key=lambda item: -item[1])[:POOLED]
        listed = ", ".join(f"{label} {count}" for label, count in most)
        more = ", ..." if len(checked.pool) > POOLED else ""
        say(f"copies of each part inside at once: {listed}{more}")
    if checked.matings is not None:
        _describe_approaches(checked.matings, allowed)


def _modes(places: Sequence[Mapping[str, str]], most: int) -> str:
    """The modes of a gear in words: all, or the first ones and how many more."""
    words = [f"{place['mode']} {place['label']}".strip() for place in places]
    more = [f"{len(words) - most} more"] if len(words) > most else []
    return " · ".join([*words[:most], *more])


def _describe_coordinated(coordinated: CoordinatedNet, machines: str, verbose: bool) -> None:
    """Print the size of the net that is coordinated with machines and whether it is live; its order
    places if asked for all."""
    net = coordinated.net
    live = "NO" if coordinated.deadlock else "yes"
    say(
        f"coordinated with {machines}: {len(net.tokens)} places,"
        f" {len(net.net.transitions)} transitions, live: {live}"
    )
    places = zip(net.net.places, net.tokens, strict=True)
    rows = [(p.name, str(n)) for p, n in places if verbose and p.mode == "order"]
    if rows:
        table("", ("order place", "tokens"), rows)


def _by_property(faults: Sequence[Witness]) -> list[list[Witness]]:
    """Witnesses grouped by the property that they refute; those of the gear structure last."""
    grouped: dict[str, list[Witness]] = {}
    for witness in faults:
        grouped.setdefault(witness.property, []).append(witness)
    return [grouped[name] for name in sorted(grouped, key=lambda name: name.startswith("gear"))]


def _describe_approaches(matings: Matings, allowed: Sequence[AllowedOverlap]) -> None:
    """Print how many operations can be approached, and how; those whose parts are allowed to pass
    through each other are not blocked."""
    strict, no_deeper, left_out = (matings.count(level) for level in (3, 2, 1))
    lowered, blocked = len(matings.of_kind("lower")), len(matings.faults(allowed))
    passing = len(matings.of_kind("blocked")) - blocked
    every = len(matings.all)
    clear = f"{left_out} of {every} operations clear"
    if not strict == no_deeper == left_out:
        clear += (
            f" ({no_deeper} with no overlap deeper than in the finished product,"
            f" {strict} with no overlap)"
        )
    say(
        f"approach: {clear}; {lowered} lowered"
        f"{f', {passing} allowed to pass through each other' if passing else ''},"
        f" {blocked} blocked{' (--clashes DIR draws each)' if blocked else ''}"
    )
