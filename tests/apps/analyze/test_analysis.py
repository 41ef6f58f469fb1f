"""The pace of timed nets against brute force, linear programs, token games and runs."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

import factory
from factory.apps.analyze import Timing, analyse
from factory.apps.analyze.firing import slacks
from factory.support.errors import Diagnostic, RunError
from factory.theory.nets.cycle_ratio import max_cycle_ratio
from tests.command_line import Terminal
from tests.layout_values import paper_layout
from tests.net_values import net_from
from tests.paths import PAPER


def test_a_net_in_parts_has_the_pace_of_its_slowest() -> None:
    net = net_from([("a", "b", 0), ("b", "a", 2), ("b", "c", 0), ("c", "d", 0), ("d", "c", 1)])
    found = max_cycle_ratio(net, [4.0, 4.0, 9.0, 1.0, 2.0])
    assert (found.seconds, set(found.circuit)) == (4.0, {0, 1})
    assert slacks(found, [2, 3])[2].seconds == float("inf")
    assert slacks(found, [3])[3].seconds == pytest.approx(1.0)


def test_slack_where_copies_are_bounded() -> None:
    timing = Timing(paper_layout())
    found = analyse(timing, wip=1)
    assert found.bottlenecks == ("wip part1", "wip part2")
    part3 = timing.factory.by_label["part3"].index
    grown = list(found.net.seconds)
    grown[part3] += found.slack[part3]
    assert max_cycle_ratio(found.net.net, grown).seconds == pytest.approx(found.net.pace)
    grown[part3] += 0.1
    assert max_cycle_ratio(found.net.net, grown).seconds > found.net.pace + 0.01


def test_a_run_of_one_unit(run: Terminal) -> None:
    """An operation done once is compared with its first predicted duration."""
    found = run("analyze", PAPER, "--world", "ideal", "--units", 1, "--run", "--json").json
    assert found["measured"]["cycle_time_s"]["measured"] is None
    durations = found["measured"]["durations"]
    assert all(d["count"] == 1 for d in durations)
    assert all(abs(d["predicted"] - d["measured"]) < 0.03 for d in durations)


def test_the_document(run: Terminal) -> None:
    found = run("analyze", PAPER, "--second", "r4", "--faster", "r3=50", "--wip", 1, "--json").json
    assert found["bottlenecks"] == ["wip part1", "wip part2"]
    assert found["cycle_time_s"] == pytest.approx(found["circuits"][0]["pace_s"], rel=1e-12)
    assert found["circuits"][0]["slack_s"] == 0
    assert found["circuits"][0]["places"][0].startswith("wip:")
    assert found["scenarios"][0]["change"] == "2 × r4, r3 50 % faster"
    assert found["least_wip"] == 2
    assert [r["robot"] for r in found["robots"]] == ["r1", "r2", "r3", "r4", "r5", "r6"]
    assert found["measured"] is None


def test_what_people_read(run: Terminal, golden: Callable[[str, str], None]) -> None:
    """Numbers left out: they follow the layout."""
    done = run("analyze", PAPER, "--shorter", "r3=20")
    assert done.status == 0
    golden("analyze_paper.txt", re.sub(r"(?<![a-z])\d[\d.]*", "#", done.out))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--faster", "r4"), "BadValue --faster takes a robot and percent above 0"),
        (("--shorter", "x=10"), "Usage there is no robot 'x'"),
        (("--measured", PAPER), "is no log of factory"),
        (("--measured", "no.log", "--run"), "Usage --measured LOG and --run exclude each other"),
    ],
)
def test_what_is_refused(run: Terminal, words: tuple[str, ...], message: str) -> None:
    done = run("analyze", PAPER, *words)
    assert done.status == 2
    assert message in done.err
    assert done.out == ""


def test_a_net_has_no_pace(run: Terminal, tmp_path: Path) -> None:
    net = tmp_path / "net.pnml"
    assert run("export", PAPER, "--format", "pnml", "-o", net).status == 0
    done = run("analyze", net)
    assert done.status == 2 and "is a net in PNML, not the PAG of a product" in done.err


def test_a_net_that_is_not_proved_is_not_analysed(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(net: object) -> None:
        assert net is paper_layout().factory.net
        raise RunError(Diagnostic("Deadlock", "it stops", None, ""))

    monkeypatch.setattr("factory.theory.nets.verify.proved", refused)
    with pytest.raises(RunError, match="it stops"):
        factory.analyze(paper_layout())
