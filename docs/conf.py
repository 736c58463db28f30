"""Sphinx's configuration. `./run docs` builds the site strictly: every warning is an error (`-W -n`).

Sphinx with MyST and Furo was chosen over MkDocs because it is maintained, checks every reference between pages and into
the Python API itself, and needs no further plugins for the API reference or the search. MyST-NB runs the notebooks of
`examples/notebooks` in the build.
"""

from __future__ import annotations

import sys
from importlib.metadata import version as installed_version
from pathlib import Path

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS / "_ext"), str(DOCS.parent)]

project = "gear"
author = "The gear authors"
project_copyright = author
version = release = installed_version("mujoco-gear")

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx_copybutton", "gear_site"]
exclude_patterns = ["_build", "_ext", "mjcf-conventions.md"]
html_theme = "furo"
html_title = "gear"
html_show_sourcelink = False
templates_path: list[str] = []

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

# Notebooks are committed without outputs: the build runs them, in a temporary folder, and an error fails the build.
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_timeout = 3600
nb_execution_raise_on_error = True

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_default_options = {"members": True, "show-inheritance": True}
autodoc_preserve_defaults = True
add_module_names = False
python_use_unqualified_type_names = True

# Docstrings in gear are written in Markdown's way: `name` is code. In reStructuredText single backquotes are a role.
default_role = "code"
# The words of a shell prompt are not copied.
copybutton_prompt_text = "$ "

# Types of other libraries, type variables and gear's internal modules have no page on this site.
nitpick_ignore_regex = [
    ("py:.*", r"(np|npt|numpy|torch|nn|mujoco)\..*"),
    ("py:.*", r"(pathlib|collections|typing|argparse|dataclasses|importlib|pluggy|pytest|abc)\..*"),
    ("py:.*", r"(Tensor|Path|Any|Self|Literal|Iterator|Iterable|Sequence|Mapping|Callable|Generator)"),
    ("py:.*", r"(Mapping\[int|Vec3|UInt8Image|Bools|Prepared|BaseCompositor|Cache)"),
    ("py:.*", r".*(_co|_contra|T)$"),
    ("py:.*", r"gear\.(?!contracts|values|testing|readers\.\w+$).*"),
]
