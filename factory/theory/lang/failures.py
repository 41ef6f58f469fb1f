"""The clause `failure` of a template: tests of an operation, and responses to a failed test.

A failed operation is repeated a limited number of times; then its inputs are scrapped or the
run stops. So the retries of one operation on one sub-assembly are bounded.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import get_args

from lark import Token

from factory.support.decimals import number
from factory.support.errors import did_you_mean
from factory.support.texts import Findings, quoted
from factory.theory.lang.template_syntax import FailureCase, Words
from factory.theory.problem.template import Failure, Kind, Response, Test

TIMES = 1000
"""The most times on end that an operation may be done again."""

LIMITS: Mapping[str, str] = MappingProxyType({"residual": "5e-4", "misplaced": "5e-4"})
"""The tests that have a limit, with a usual one [m]."""

TESTS: Mapping[str, Test] = MappingProxyType({test: test for test in get_args(Test)})
KINDS: Mapping[str, Kind] = MappingProxyType({kind: kind for kind in get_args(Kind)})
_FORM = "again 2 then scrap"


@dataclass(frozen=True, slots=True)
class FailureReader:
    """Reads the cases of a template; errors (BadFailure) go to the findings. `takes`: whether it
    takes sub-assemblies, or else makes a part; `tools`: whether it has tools."""

    findings: Findings
    takes: bool
    tools: bool

    def read(self, cases: Sequence[FailureCase]) -> tuple[Failure, ...]:
        """The failures of the cases, in their order, each test once."""
        failures: dict[str, Failure] = {}
        for case in cases:
            word = case.test[0]
            if word in failures:
                self._bad(f"{quoted(word)} is tested twice", word, "remove one of the two")
                continue
            failure = self._failure(case)
            if failure is not None:
                failures[failure.test] = failure
        return tuple(failures.values())

    def _bad(self, message: str, at: Token, hint: str) -> None:
        self.findings.add("BadFailure", message, at, hint)

    def _failure(self, case: FailureCase) -> Failure | None:
        word = case.test[0]
        test = TESTS.get(word)
        responses = self._responses(case.responses)
        if test is None:
            hint = did_you_mean(word, list(TESTS), "tests")
            self._bad(f"there is no test {quoted(word)}", word, hint)
            return None
        limit = self._limit(case.test)
        self._check_place(test, word)
        if responses:
            self._check_responses(test, responses, case)
        if not responses or (limit is None and test in LIMITS):
            return None
        return Failure(test, limit, responses, self.findings.source.at(word))

    def _limit(self, words: Words) -> float | None:
        """Limit of a test [m], above 0; None for a test without one, or after an error."""
        test, usual = words[0], LIMITS.get(words[0])
        if len(words) == 1:
            if usual:
                hint = f"say from how many metres on it fails: {test} > {usual}"
                self._bad(f"{quoted(test)} has no limit", test, hint)
            return None
        limit = words[1]
        value = number(limit)
        if usual is None:
            self._bad(f"{quoted(test)} takes no limit", limit, f"write it alone: {test} : scrap")
            return None
        if value is None or value <= 0:
            hint = f"a limit is a positive number of metres: {test} > {usual}"
            self._bad(f"{quoted(limit)} is no limit", limit, hint)
            return None
        return value

    def _check_place(self, test: Test, at: Token) -> None:
        """Note a test of something that the operation does not have."""
        if test == "misplaced" and self.takes:
            hint = "leave it out, or test residual; misplaced is for what makes a part"
            self._bad("no part comes from a feeder here", at, hint)
        if test == "rejected" and not self.tools:
            hint = "leave it out: rejected is for operations with a tool, as inspect"
            self._bad("no tool is here that could reject something", at, hint)

    def _responses(self, words: Words) -> tuple[Response, ...]:
        """The responses between `then`s: one `again` at most, then a `scrap` or a `stop`, which is
        added where there is none. () after an error."""
        made: list[Response] = []
        for first, *more in _steps(words):
            kind = KINDS.get(first)
            if made and made[-1].kind != "again":
                hint = f"leave out what follows it; again comes first: {_FORM}"
                self._bad(f"nothing is left to do after {made[-1]}", first, hint)
                return ()
            if kind is None:
                hint = did_you_mean(first, list(KINDS), "responses")
                if first == "then":
                    hint = f"responses are joined by one 'then': {_FORM}"
                self._bad(f"there is no response {quoted(first)}", first, hint)
                return ()
            if kind == "again" and made:
                hint = f"write one number: again {made[-1].times} then scrap"
                self._bad("'again' is said twice", first, hint)
                return ()
            response = self._response(kind, first, more)
            if response is None:
                return ()
            made.append(response)
        if made[-1].kind == "again":
            made.append(Response("stop"))
        return tuple(made)

    def _response(self, kind: Kind, first: Token, more: Words) -> Response | None:
        counted = kind == "again"
        if counted and not more:
            hint = f"say how often, at most: {_FORM}"
            self._bad("'again' has no number", first, hint)
            return None
        if len(more) > counted:
            hint = f"responses are joined by 'then': {_FORM}"
            self._bad(f"{quoted(more[counted])} does not belong to '{kind}'", more[counted], hint)
            return None
        if not counted:
            return Response(kind)
        times = int(more[0]) if re.fullmatch("[0-9]{1,6}", more[0]) else 0
        if not 1 <= times <= TIMES:
            hint = f"write a whole number from 1 to {TIMES}, or leave 'again' out"
            self._bad(f"'again {more[0]}' is no number of times", more[0], hint)
            return None
        return Response("again", times)

    def _check_responses(
        self, test: Test, responses: Sequence[Response], case: FailureCase
    ) -> None:
        """Note responses that the operation cannot carry out."""
        kinds = {response.kind for response in responses}
        at = {str(word): word for word in reversed(case.responses)}
        if test == "jammed" and not self.takes and "scrap" in kinds:
            hint = "write again, or stop: the robot still comes for the part"
            self._bad("there is nothing to scrap: the hands are empty", at["scrap"], hint)
        if test == "lost" and self.takes and "again" in kinds:
            hint = "write scrap, or stop: what was lost is not there any more"
            self._bad("there is nothing to do it again with", at["again"], hint)


def _steps(words: Words) -> Iterator[Words]:
    """The words between `then`s; a `then` without words before or behind it is a step itself."""
    step: list[Token] = []
    for word in words:
        if word != "then":
            step.append(word)
            continue
        yield step or [word]
        step = []
    yield step or [words[-1]]
