"""The two languages, PAGs and operation templates: text to value and value to canonical text.

A PAG: `pag_reader.py` (`read_pag`) takes a text by its syntax (`pag_syntax.py`) to statements
(`statements.py`), these to nodes (`operations.py`, `values.py`), and these to one tree (`tree.py`).
A template: `template_reader.py` (`read_template`), with `template_syntax.py` and
`template_checks.py`; `failures.py` has its tests and responses. `writer.py` writes both.
"""

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
