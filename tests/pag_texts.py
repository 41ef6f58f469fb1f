"""Texts for tests: PAGs, the paper's example and others, compiled and laid out; a template."""

from __future__ import annotations

from factory.floor.layout.layout import Layout
from factory.floor.robots.catalogue import load_catalogue
from factory.pipeline import Project
from factory.theory.compiler.compiler import compile_pag
from factory.theory.lang import read_pag, read_template
from factory.theory.lang.template_reader import all_templates
from factory.theory.plant.factory import Factory
from factory.theory.problem.robot_types import Catalogue

PAPER = """6 parts; root = sub3; sub3 = mate ( sub2, part3 ); sub2 = weld ( sub1 );
sub1 = mate ( part1, part2 ); part1 = atomic(); part2 = atomic(); part3 = atomic()"""


MATE = """mate = (R, j, ~, <a; b>, F) where
  R = < dot, dot, dot >;
  j = 3;
  ~ = { A1 = A2 = B3 };
  <a; b> = < LAB1, LAB2, nopart; nopart, nopart, LAB3 >;
  F = navigation on W to ( A1 + 2r, A2 + 2r, B3 ) within eps;
  further = insert;
"""
"""The paper's template for `mate`."""

TEMPLATES = all_templates()


def compiled(text: str, *templates: str, catalogue: Catalogue | None = None) -> Factory:
    """The factory of a PAG text, with the shipped templates and these texts of templates."""
    table = dict(TEMPLATES) | {t.name: t for t in map(read_template, templates)}
    return compile_pag(read_pag(text, table), table, catalogue or load_catalogue())


def laid_out(text: str) -> Layout:
    """The layout of that factory, as `factory.lay_out` makes it."""
    return Project.of_made(compiled(text)).layout
