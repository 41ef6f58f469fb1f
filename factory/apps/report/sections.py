"""The text and figures of a report, as HTML, in which the texts of user files are escaped."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from math import comb

from factory.api import PAG, CutOff, Diagnostic, Factory, Run
from factory.apps.drawing.tables import table
from factory.apps.fidelity.record import QUANTITIES
from factory.apps.report.drawings import words_of
from factory.apps.report.pace import MeasuredPace, Predicted, excluded
from factory.apps.report.recording import Recording
from factory.apps.report.words import Proof
from factory.apps.resume.remade import forged

SIGNS = {True: "✓", False: "✗", None: "?"}

LISTED = 8
"""Number of failures that are listed even where their codes are listed already."""


def ending(cut: CutOff | None) -> str:
    """The notice of a run that was cut off; nothing of a whole one."""
    if cut is None:
        return ""
    words = escape(cut.with_cause, quote=True)
    return f'<p class="notice bad" role="note">{words[0].upper()}{words[1:]}.</p>'


def heading(
    recording: Recording,
    run: MeasuredPace,
    plan: Predicted | None,
    proof: Proof,
) -> str:
    """The key figures, as cards."""
    robots = recording.factory.robots
    units = int(recording.log.header["units"])
    products = f"in {recording.end:.2f} s of simulated time"
    cards = [("Products", f"{len(run.dropoffs)} <small>of {units}</small>", products)]
    if cycle := run.cycle or (plan and plan.cycle):
        foretold = f", predicted {plan.cycle:.3f} s" if plan else ""
        how = f"measured{foretold}" if run.cycle else "predicted"
        hourly = f"{_figure(_per_hour(cycle))} products an hour"
        cards.append(("Cycle time", f"{cycle:.3f} <small>s</small>", f"{how}; {hourly}"))
    if plan is not None:
        names = escape(", ".join(plan.critical[:3]))
        note = f"measured: gear of {robots[run.critical].name}" if run.dropoffs else "predicted"
        cards.append(("Sets the pace", names, note))
    cards.append(("Net", *_verdict(proof.holds, "proved", "not proved"), "live, safe, reversible"))
    held, monitor = recording.verdict.follows, recording.monitor
    judge = "record only" if monitor is None else "record and monitor agree"
    cut = recording.log.cut_off
    if not recording.verdict.judged:
        trouble = recording.verdict.failures[0]
        cards.append(("Run", *_verdict(False, "", "not judged"), trouble.message))
    elif held and cut:
        judge = f"follows the net up to there; {judge}"
        cards.append(("Run", *_verdict(False, "", f"cut off at {cut.t:.2f} s"), judge))
    else:
        follows = recording.verdict.refines and (not monitor or monitor.refines_net)
        wrong = "bodies differ" if follows else "does not follow the net"
        cards.append(("Run", *_verdict(held, "follows the net", wrong), judge))
    if doubts := recording.verdict.qualified:
        noun = f"reservation{'s' * (len(doubts) > 1)}"
        value = f'<span class="doubt">{len(doubts)} <small>{noun}</small></span>'
        cards.append(("But", value, "; ".join(doubts)))
    return "".join(_card(*card) for card in cards)


def _verdict(holds: bool, yes: str, no: str) -> tuple[str]:
    style = "good" if holds else "bad"
    return (f'<span class="{style}">{SIGNS[holds]} {yes if holds else no}</span>',)


def _card(name: str, value: str, note: str) -> str:
    note = escape(note, quote=True)
    return f'<div class="card"><h3>{name}</h3><p class="value">{value}</p><p>{note}</p></div>'


def _per_hour(cycle: float | None) -> float | None:
    return 3600 / cycle if cycle else None


def pace(recording: Recording, run: MeasuredPace, plan: Predicted | None) -> str:
    """Cycle time, throughput and the critical gear, predicted and measured."""
    first = run.dropoffs[0] if run.dropoffs else None
    last = run.dropoffs[-1] if run.dropoffs else None
    count = len(run.dropoffs)
    guess = (plan.cycle, plan.first, plan.last) if plan else (None, None, None)
    rows = [
        ("Cycle time", guess[0], run.cycle, "s"),
        ("Throughput", _per_hour(guess[0]), _per_hour(run.cycle), "per hour"),
        ("First product", guess[1], first, "s"),
        (f"Product {count}", guess[2], last, "s"),
    ]
    body = "".join(
        f"<tr><th>{name}</th><td>{_figure(a)}</td><td>{_figure(b)}</td><td>{_error(a, b)}</td>"
        f"<td>{unit}</td></tr>"
        for name, a, b, unit in rows
    )
    names = ("", "predicted", "measured", "error", "")
    note = ""
    if plan is None:
        note = f'<p class="doubt">No prediction: {escape(recording.missing)}.</p>'
    elif run.cycle is None:
        least = Run.steady_from(recording.factory.period)
        note = f'<p class="note">A cycle time is measured from {least} products on.</p>'
    return table(names, body) + note + _gears(recording, run, plan)


def _gears(recording: Recording, run: MeasuredPace, plan: Predicted | None) -> str:
    """The critical gear as a chain of its operations, as predicted and as measured."""
    factory = recording.factory
    names = {robot.name: robot.index for robot in factory.robots}
    chains = [("measured", run.critical, run.durations)]
    note = ""
    if plan is not None:
        critical = [names[name] for name in plan.critical if name in names]
        if not critical:
            note = f"<p>The pace is set by {escape(', '.join(plan.critical))}, not by a robot.</p>"
        chains[:0] = [("predicted", robot, plan.durations) for robot in critical[:1]]
    longest = max((_sum(factory, r, times) for _, r, times in chains), default=1.0) or 1.0
    bars = "".join(_chain(factory, *row, longest) for row in chains)
    return f"<h3>Critical gear</h3>{note}<div class='chains'>{bars}</div>"


def _sum(factory: Factory, robot: int, times: Iterable[float | None]) -> float:
    seconds = list(times)
    return sum(seconds[o] or 0.0 for o in factory.robots[robot].operations)


def _chain(
    factory: Factory, how: str, robot: int, times: tuple[float | None, ...], longest: float
) -> str:
    pieces = []
    for number in factory.robots[robot].operations:
        seconds, operation = times[number] or 0.0, factory.operations[number]
        if seconds <= 0:
            continue
        words = escape(words_of(operation), quote=True)
        width = 100 * seconds / longest
        pieces.append(
            f'<button class="piece" data-operation="{number}" style="width:{width:.2f}%"'
            f' title="{words}: {seconds:.3f} s"><b>{seconds:.2f}</b> {words}</button>'
        )
    total = _sum(factory, robot, times)
    name = escape(factory.robots[robot].name)
    return (
        f'<div class="chain"><span>{how}: <button class="link" data-robot="{robot}">{name}</button>'
        f" {total:.3f} s</span><div>{''.join(pieces)}</div></div>"
    )


def utilisation(recording: Recording, run: MeasuredPace, plan: Predicted | None) -> str:
    """A bar for each robot, the busiest first, with a mark where it was predicted."""
    rows, roles = [], recording.stage.roles
    for robot in sorted(recording.factory.robots, key=lambda r: -run.busy[r.index]):
        share, role = 100 * run.busy[robot.index], escape(roles[robot.index], quote=True)
        mark, words = "", f"{share:.0f} % measured"
        if plan is not None:
            guess = min(100.0, 100 * plan.busy[robot.index])
            mark = f'<i style="left:{guess:.2f}%"></i>'
            words += f", {guess:.0f} % predicted"
        rows.append(
            f'<button class="use" data-robot="{robot.index}" title="{words}">'
            f"<span>{escape(robot.name)}</span><span class='bar'>"
            f'<b class="{role}" style="width:{min(share, 100):.2f}%"></b>{mark}</span>'
            f"<span>{share:.0f} %</span></button>"
        )
    legend = "bar: measured share of the run in operations; line: predicted for this run"
    note = f'<p class="note">{legend}.</p>' if plan else ""
    return f'<div class="uses">{"".join(rows)}</div>{note}'


def assembly_tree(pag: PAG, labels: dict[str, int]) -> str:
    """The assembly tree as nested lists, the product first, or that of each product of a mix; each
    label has room for its picture."""
    made: dict[str, str] = {}
    take = made.pop if pag.mix is None else made.__getitem__
    for node in pag.postorder():
        inside = "".join(map(take, node.inputs))
        below = f"<ul>{inside}</ul>" if inside else ""
        made[node.label] = (
            f"<li>{_node(node.label, node.operation, labels, bool(inside))}{below}</li>"
        )
    return f'<ul class="tree">{"".join(made[label] for label in pag.products)}</ul>'


def _node(label: str, operation: str, labels: dict[str, int], whole: bool) -> str:
    kind = "whole" if whole else "part"
    number = labels[label]
    return (
        f'<button class="node {kind}" data-label="{number}"><span class="picture"'
        f' data-picture="{number}"></span><span class="words"><b>{escape(label)}</b>'
        f"<small>{escape(operation)}</small></span></button>"
    )


def proof_words(proof: Proof) -> str:
    """The proof, claim by claim."""
    items = "".join(
        f'<li class="{"good" if claim.holds else "bad"}"><span class="sign">{SIGNS[claim.holds]}'
        f"</span><div><b>{claim.name}</b>: {escape(claim.means)}."
        f"<p>{escape(claim.why)}</p></div></li>"
        for claim in proof.claims
    )
    if proof.faults:
        result = f"The checker refuses the certificate: {escape('; '.join(proof.faults[:3]))}."
    else:
        result = "An independent checker accepts the certificate of these claims."
    digest = f'<p class="note">{result} SHA-256 <code>{escape(proof.digest)}</code> '
    save = '<button class="link" id="save-certificate">Save the certificate</button></p>'
    return f'<ul class="claims">{items}</ul>{digest}{save}'


def fidelity_words(recording: Recording, figures: Mapping[str, float | None]) -> str:
    """The figures in a table, and the verdict of the monitor."""
    rows = "".join(
        f'<tr class="{"bad" if QUANTITIES[key].exceeded(value) else ""}">'
        f"<th>{escape(_title(key))}<p>{escape(QUANTITIES[key].definition)}</p></th>"
        f"<td>{_shown(value)}</td><td>{_shown(QUANTITIES[key].limit)}</td>"
        f"<td>{escape(QUANTITIES[key].unit)}</td></tr>"
        for key, value in figures.items()
    )
    figures_table = table(("", "measured", "limit", ""), rows)
    return "".join(_judged(recording)) + _excluded(recording) + figures_table


def _excluded(recording: Recording) -> str:
    """The pairs of parts that were not checked for collisions, since they overlap as drawn."""
    pairs = excluded(recording)
    if not pairs:
        return ""
    count = f"{len(pairs)} of {comb(len(recording.factory.leaves), 2)} pairs of parts"
    listed = "".join(f"<li>{escape(' - '.join(pair))}</li>" for pair in pairs)
    summary = f"<summary>{count} were not checked for collisions.</summary>"
    return f"<details>{summary}<ul>{listed}</ul></details>"


def _judged(recording: Recording) -> Iterator[str]:
    verdict, report = recording.verdict, recording.monitor
    yield "<p>The record of firings " + ("refines" if verdict.refines else "does not refine")
    yield " the net. "
    if not verdict.judged:
        yield f"Its states are not judged: {escape(verdict.failures[0].message)}.</p>"
        return
    if report is None:
        why = "is not that of its PAG" if forged(recording.faults) else "has no states for it"
        yield f"There is no report of a monitor: the log {why}.</p>"
        yield from _listed(verdict.bodies)
        return
    yield f"The monitor, from states of the engine alone, observed {len(report.seen)} firings and "
    yield f"inferred {len(report.inferred)}; "
    if not report.refines_net:
        yield "violations:</p>"
    else:
        yield "consistent with the net"
        yield " up to the end of the log.</p>" if recording.log.cut_off else ".</p>"
    yield from _listed(verdict.bodies)


def _listed(failures: Sequence[Diagnostic]) -> Iterator[str]:
    """The failures of the bodies of a run: the first LISTED, the first of each code, and the number
    of others."""
    if failures:
        first = {failure.code: failure for failure in reversed(failures)}.values()
        chosen = [f for n, f in enumerate(failures) if n < LISTED or f in first]
        words = [escape(str(failure)) for failure in chosen]
        if len(failures) > len(chosen):
            words.append(f"and {len(failures) - len(chosen)} more")
        yield "<ul class='violations'>" + "".join(f"<li>{w}</li>" for w in words) + "</ul>"


def _title(key: str) -> str:
    """The key of a figure as words, without its unit."""
    for unit in ("_mm", "_s", "_deg"):
        key = key.removesuffix(unit)
    return key.replace("_", " ").capitalize()


def made_how(recording: Recording) -> str:
    """The inputs of the run: files, world, settings, versions."""
    header = recording.log.header
    numbers = {k: v for k, v in header["settings"].items() if isinstance(v, int | float)}
    settings = ", ".join(f"{k} {v:g}" for k, v in numbers.items())
    versions = ", ".join(f"{k} {v}" for k, v in header.get("versions", {}).items())
    file = header["pag"]["file"].replace("\\", "/").rpartition("/")[2]
    rows = [
        ("PAG", f"{file}, SHA-256 {header['pag']['sha256'][:16]}…"),
        ("World", f"{header['world']}, seed {header['seed']}, jitter {header['jitter']:g}"),
        ("Settings", settings),
        ("Versions", versions),
    ]
    if recording.log.cut_off:
        rows.append(("Log", recording.log.cut_off.with_cause))
    body = "".join(f"<dt>{name}</dt><dd>{escape(str(words))}</dd>" for name, words in rows)
    return f"<dl>{body}</dl>"


def _figure(value: float | None) -> str:
    if value is None:
        return "–"
    return f"{value:.3f}" if abs(value) < 100 else f"{value:.0f}"


def _shown(value: float | None) -> str:
    """A figure in three digits, or a bound where it is very small."""
    if value is None:
        return "–"
    return f"{value:.3g}" if not value or abs(value) >= 1e-4 else "&lt; 0.0001"


def _error(predicted: float | None, measured: float | None) -> str:
    if not predicted or not measured:
        return ""
    error = round(100 * (predicted / measured - 1), 1)
    return f"{error:+.1f} %" if error else "0.0 %"
