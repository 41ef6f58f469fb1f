"""Relays: where a guidepath is shared by several robots the net is proved and the layout certified
as before, everything goes where it went, and the pace no longer depends on the factory's size."""

from __future__ import annotations

from factory.apps.relay import relayed
from factory.support.resources import templates_folder
from factory.support.settings import Settings
from factory.theory.compiler.compiler import compile_pag
from factory.theory.compiler.expanding import expand, nodes_of
from factory.theory.lang.template_reader import load_templates
from factory.theory.problem.plan import Plan
from factory.theory.problem.robot_types import load_catalogue
from tests.layout_values import paper_layout, row_of_inserts

SETTINGS = Settings()




def test_piles_and_the_product_are_handed_over() -> None:
    pag, templates = row_of_inserts(5).factory.pag, load_templates([templates_folder()])
    plan = Plan(relays={"x/3": 1, "x": 2})
    nodes = expand(pag, templates, plan)
    assert {x: (node.template.name, node.inputs) for x, node in nodes.items() if node.inputs} == {
        "x/2": ("mate", ("p0", "p1")),
        "x/3": ("insert", ("x/2", "p2")),
        "x/3/relay1": ("relay", ("x/3",)),
        "x/4": ("insert", ("x/3/relay1", "p3")),
        "x": ("insert", ("x/4", "p4")),
        "x/relay1": ("relay", ("x",)),
        "x/relay2": ("relay", ("x/relay1",)),
    }
    made = compile_pag(pag, templates, load_catalogue(), plan=plan)
    assert made.products == ("x/relay2",)
    assert nodes_of(made) == nodes


def test_where_nothing_is_gained_nothing_is_changed() -> None:
    layout = paper_layout()
    assert relayed(layout, SETTINGS) is layout
