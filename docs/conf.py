"""How Sphinx makes the documentation site, `make docs`. Pages need no network to be looked at."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_extensions"))

from factory import __version__

project = "factory"
author = "the factory authors"
copyright = author
version = release = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "factory_reference"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build", "_extensions", "fidelity", "benchmarks"]
nitpicky = False

myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3
# No highlighter knows PAGs and templates.
highlight_language = "text"

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autoclass_content = "class"
napoleon_use_ivar = True

html_theme = "furo"
html_title = "factory"
html_static_path = ["_static"]
html_css_files = ["factory.css"]
html_show_sphinx = False
html_copy_source = False
html_show_copyright = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#1f6f6b", "color-brand-content": "#1f6f6b"},
    "dark_css_variables": {"color-brand-primary": "#5cc2ba", "color-brand-content": "#5cc2ba"},
}
