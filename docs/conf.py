"""Settings of the documentation site: make docs."""

from __future__ import annotations

import sys
from pathlib import Path

import spem

sys.path.insert(0, str(Path(__file__).parent / "_extensions"))

project = "spem"
author = "The spem developers"
copyright = "the spem developers"
version = release = spem.__version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "myst_parser",
    "sphinx_design",
    "sphinx_copybutton",
    "mathml",
    "names",
    "bars",
    "commands",
    "drawings",
    "wide",
    "reproduction",
]
exclude_patterns = ["_*", "images", "drawn", "results"]
templates_path = ["_templates"]
suppress_warnings = ["myst.strikethrough"]
default_role = "py:obj"
nitpick_ignore_regex = [
    ("py:obj", ".*"),  # single backticks stand for parameters and values too
]

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "attrs_block"]
myst_heading_anchors = 3
myst_links_external_new_tab = False

napoleon_google_docstring = False
napoleon_use_rtype = False
autosummary_generate = True
autosummary_ignore_module_all = False
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
autodoc_class_signature = "mixed"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88
toc_object_entries = False

copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

html_theme = "furo"
html_title = "spem"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False
html_theme_options = {
    "top_of_page_buttons": [],
    "light_css_variables": {"color-brand-primary": "#00588c", "color-brand-content": "#00588c"},
    "dark_css_variables": {"color-brand-primary": "#62b4ec", "color-brand-content": "#62b4ec"},
}
