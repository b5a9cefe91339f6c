"""How Sphinx builds the pages: `make docs`, into build/docs."""

import os
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).absolute().parent.parent
sys.path.insert(0, str(ROOT / "docs"))
# What reads findings and holds reports to their schema is the tests'.
sys.path.append(str(ROOT / "tests"))
# Compiled kernels have no signature that could be read: as plain Python they have.
os.environ["NUMBA_DISABLE_JIT"] = "1"

with (ROOT / "pyproject.toml").open("rb") as file:
    _project = tomllib.load(file)["project"]

project = "hardwall"
author = "the hardwall project"
version = release = _project["version"]

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_reredirects",
    "from_the_program",
    "from_the_findings",
    "from_the_reports",
    "from_docstrings",
]
exclude_patterns = ["examples"]
root_doc = "index"
default_role = "code"

# ---- old addresses ---------------------------------------------------------------------------------------------------

with (ROOT / "docs/moved.toml").open("rb") as file:
    redirects = {old: f"{new}.html" for old, new in tomllib.load(file).items()}

# ---- pages in Markdown ----------------------------------------------------------------------------------------------

myst_enable_extensions = ["attrs_block", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

# ---- the model's docstrings -----------------------------------------------------------------------------------------

autodoc_default_options = {"members": True, "member-order": "bysource"}
autodoc_typehints = "none"
autodoc_class_signature = "mixed"
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
add_module_names = False

# ---- what is checked ------------------------------------------------------------------------------------------------

nitpicky = True
# What NumPy and Python are is not described here; and the fields of two classes may have one name.
nitpick_ignore_regex = [
    ("py:class", r"(numpy|collections|dataclasses|types|typing|numba)\..*"),
    ("py:class", r"[a-z_0-9]+"),
]
suppress_warnings = ["ref.python"]

# ---- how it looks ---------------------------------------------------------------------------------------------------

html_theme = "furo"
html_title = f"hardwall {release}"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_copy_source = False
html_show_sourcelink = False
html_show_copyright = False
