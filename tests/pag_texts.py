"""Texts for tests: PAGs, the paper's example and others, compiled and laid out; a template."""

from __future__ import annotations

from collections.abc import Callable

from factory.floor.layout.layout import Layout
from factory.pipeline import Project, all_templates
from factory.support.errors import InputError
from factory.theory.compiler.compiler import compile_pag
from factory.theory.lang import read_pag, read_template
from factory.theory.plant.factory import Factory
from factory.theory.problem.robot_types import Catalogue, load_catalogue

PAPER = """6 parts; root = sub3; sub3 = mate ( sub2, part3 ); sub2 = weld ( sub1 );
sub1 = mate ( part1, part2 ); part1 = atomic(); part2 = atomic(); part3 = atomic()"""
UNARY = """root = c; c = glue(b, dwell = 0.1); b = weld(a, dwell = 0.2);
a = press(p, dwell = 0.1); p = atomic()"""
KARY = """root = s; s = mate(a, b, c, t, dd); t = mate(e, f); dd = inspect(d, dwell = 0.2);
a = atomic(); b = atomic(); c = atomic(); d = atomic(); e = atomic(); f = atomic()"""
CHAIN = """root = s4; s4 = mate(s3, e); s3 = mate(d, s2); s2 = mate(s1, c); s1 = mate(a, b);
a = atomic(); b = atomic(); c = atomic(); d = atomic(); e = atomic()"""
OVERLAP = """root = s; s = mate(u, v);  u = mate(a, b); v = mate(c, d);
a = atomic(box = (0.2, 0.02, 0.05)); b = atomic(box = (0.02, 0.2, 0.06), pos = (0, 0.13, 0));
c = atomic(cylinder = (0.03, 0.06), pos = (0.2, 0.1, 0));
d = atomic(sphere = 0.04, pos = (-0.1, 0.1, 0.01))"""
LONE = "root = p; p = atomic()"

PRODUCTS = {
    "paper": PAPER,
    "unary": UNARY,
    "kary": KARY,
    "chain": CHAIN,
    "overlap": OVERLAP,
    "lone": LONE,
}

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


def read_or_refused(read: Callable[[str], object], text: str) -> None:
    """Check that a reader accepts a text, or refuses it by an InputError with places and hints."""
    try:
        read(text)
    except InputError as error:
        for diagnostic in error.diagnostics:
            assert diagnostic.hint
            assert diagnostic.position
            assert "\n" not in diagnostic.message
            str(diagnostic).encode()
