"""The statement of a mix: `mix = 3 truck, 1 van`, how many units of each product a period has, or
`mix = truck, truck, van`, their sequence."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from lark import Token

from factory.support.settings import MOST_UNITS
from factory.support.texts import Findings, quoted, where
from factory.theory.lang.statements import MixStatement, Statements
from factory.theory.problem.pag import Assembly, Mix

BOTH_WAYS = "write how many of each: mix = 3 truck, 1 van; or their order: mix = truck, truck, van;"


def mix_of(statements: Statements, findings: Findings) -> Mix | None:
    """The mix of a text, None for one product. Errors (BadMix) go to the findings. The products are
    the roots of the statements from here on."""
    if not statements.mixes:
        return None
    mix, at = statements.mixes[0], findings.source.at
    for again in statements.mixes[1:]:
        message = f"the mix is given twice, first {where(at(mix.word), at(again.word))}"
        findings.add("BadMix", message, again.word, "remove one of the two")
    for root in statements.roots:
        message = f"there are a root and a mix, {where(at(mix.word), at(root))}"
        findings.add("BadMix", message, root, "the products of a mix are its roots: remove this")
    labels = [amount[-1] for amount in mix.amounts]
    statements.roots[:] = {str(label): label for label in reversed(labels)}.values()
    statements.roots.reverse()
    counts = _counts(mix, findings)
    if len(counts) < 2:
        return None
    counted = any(len(amount) > 1 for amount in mix.amounts)
    return Mix(tuple(counts.items()), () if counted else tuple(map(str, labels)))


def _counts(mix: MixStatement, findings: Findings) -> Counter[str]:
    """How many units of each product a period has."""
    counts, counted = Counter[str](), any(len(amount) > 1 for amount in mix.amounts)
    for *number, label in mix.amounts:
        if counted and not number:
            findings.add(
                "BadMix", f"{quoted(label)} is not counted, and others are", label, BOTH_WAYS
            )
        elif counted and label in counts:
            message = f"{quoted(label)} is counted twice"
            findings.add("BadMix", message, label, "give one number for each product")
        elif number and _whole(number[0]) not in range(1, MOST_UNITS + 1):
            message = f"{quoted(number[0])} is no number of units from 1 to {MOST_UNITS}"
            findings.add("BadMix", message, number[0], BOTH_WAYS)
        counts[str(label)] += _whole(number[0]) if number else 1
    if counts.total() > MOST_UNITS and max(counts.values()) <= MOST_UNITS:
        message = f"a period of {counts.total()} units; {MOST_UNITS} are the most"
        findings.add("BadMix", message, mix.word, "take smaller numbers of the same ratio")
    return counts


def _whole(word: Token) -> int:
    digits = word.lstrip("0") or "0"
    return int(digits) if digits.isdecimal() and digits.isascii() and len(digits) < 9 else 0


def check_mix(roots: Sequence[Token], defined: Mapping[str, Assembly], findings: Findings) -> None:
    """Note what one product of a mix uses twice (PagNotTree), and a product that is part of another
    (BadMix)."""
    for root in (root for root in roots if root in defined):
        users: dict[str, tuple[Assembly, int]] = {}
        stack = [str(root)]
        while stack:
            node = defined[stack.pop()]
            for index, label in enumerate(node.inputs):
                if label in users:
                    _used_twice(str(root), label, users[label], (node, index), findings)
                elif label in defined and label != node.label:
                    users[label] = node, index
                    stack.append(label)
        for inner in (label for label in roots if label in users):
            message = f"the product {quoted(inner)} is part of the product {quoted(root)}"
            hint = "to sell a spare, define it once more with a label of its own"
            findings.add("BadMix", message, inner, hint)


def _used_twice(
    root: str,
    label: str,
    first: tuple[Assembly, int],
    again: tuple[Assembly, int],
    findings: Findings,
) -> None:
    (before, at), (now, place) = first, again
    one, other = sorted(
        (before.input_positions[at], now.input_positions[place]), key=lambda p: (p.line, p.column)
    )
    message = f"{quoted(label)} is used twice in {quoted(root)}, first {where(one, other)}"
    hint = f"products may share a label, but each uses it once: define a second one, {label}-2"
    findings.add("PagNotTree", message, other, hint)
