"""The two languages, PAGs and operation templates: text to value and value to canonical text."""

from factory.theory.lang.pag_reader import load_pag, read_pag
from factory.theory.lang.template_reader import load_templates, read_template
from factory.theory.lang.writer import write_pag, write_template

__all__ = [
    "load_pag",
    "load_templates",
    "read_pag",
    "read_template",
    "write_pag",
    "write_template",
]
