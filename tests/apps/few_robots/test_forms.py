"""Forms: a third robot takes what two bring, or the robot of one of them keeps it. The product is
the same, the net is proved as before, and the choice is the best for what it goes by."""

from __future__ import annotations

from dataclasses import replace

import pytest

from factory.apps.few_robots.aim import Aim
from factory.apps.few_robots.forms import FormsTask, best_forms
from factory.apps.few_robots.lines import Admitted
from factory.apps.few_robots.search import allocated
from factory.floor.layout.durations import Pace
from factory.pipeline import read
from factory.support.resources import templates_folder
from factory.theory.compiler.compiler import compile_pag
from factory.theory.lang.template_reader import load_templates
from factory.theory.problem.pag import PAG
from factory.theory.problem.plan import THIRD
from factory.theory.problem.robot_types import load_catalogue
from tests.command_line import Terminal
from tests.layout_values import table_pag
from tests.pag_values import TEMPLATES as OWN
from tests.paths import EXAMPLES

TEMPLATES = {**OWN, **load_templates([templates_folder()])}
"""The shipped ones, and those that random PAGs use beside them."""


def task_of(pag: PAG, admits: dict[str, Admitted] | None = None) -> FormsTask:
    """With sub-assemblies of many sizes, that follow from their labels."""
    plain = compile_pag(pag, TEMPLATES, load_catalogue())
    boxes = {
        label: (0.0, 0.05 + sum(map(ord, label)) % 7 / 20, 0.0, 0.1) for label in plain.contents
    }
    return FormsTask(pag, TEMPLATES, admits or {}, boxes, Pace())


def test_a_form_that_is_refused_is_not_chosen() -> None:
    pag = table_pag("s", ("s", "mate", "a b", {}), *((x, "atomic", "", {}) for x in "ab"))
    task = task_of(pag, {})
    assert best_forms(task)[0]["s"] != THIRD
    refused = frozenset({("s", 0), ("s", 1)})
    assert best_forms(replace(task, refused=refused))[0] == {"s": THIRD}


def test_so_many_robots_come_before_hands_for_all_labels() -> None:
    """Where each factory with so few robots has labels that no hand can hold, one of them is given
    with a warning of that (NoGrip); among those with as few, hands come before time."""
    asked = Aim(robots=18)
    assert asked.rank(18, 9.0, bare=3) < asked.rank(28, 5.0) < asked.rank(29, 4.0)
    assert asked.rank(17, 9.0, bare=2) < asked.rank(18, 8.0, bare=3)
    least = Aim(robots="least")
    assert least.rank(28, 5.0) < least.rank(18, 9.0, bare=3)


@pytest.mark.slow
def test_forms_leave_no_robot_without_a_hand() -> None:
    project = read(EXAMPLES / "truck.pag")
    assert not project.no_grips
    found = allocated(project, Aim(robots=20, effort=20))
    assert all(grip.shared for grip in found.no_grips)
    assert len(found.plain.robots) <= 20
    certificate = found.layout.certificate
    assert certificate is not None
    assert certificate.holds


def test_hands_are_given_up_for_the_robots_that_are_asked_for(run: Terminal) -> None:
    """Where all forms that leave a hand for each label take too many robots, those of the fewest
    lines are laid out."""
    done = run("check", EXAMPLES / "chair.pag", "--robots", "7", "--effort", "2", "--json")
    assert done.status == 0, done.err
    assert done.json["robots"] == 7
    assert "NoGrip" in {warning["code"] for warning in done.json["warnings"]}
