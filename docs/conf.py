"""How Sphinx builds the documentation: make docs.

The sources are the pages of this repository where they are (docs, baselines and some at its root),
so that a link between two of them holds on the site as it does in a checkout.
"""

from importlib.metadata import version as version_of
from tempfile import TemporaryDirectory
from typing import Any

from jupyter_client import AsyncKernelManager
from pygments.lexers.special import TextLexer
from sphinx.highlighting import lexers

lexers["csv"] = TextLexer()

project = "softvox-gym"
author = "The softvox-gym authors"
project_copyright = author
release = version = version_of("softvox-gym")

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
]
root_doc = "docs/index"
include_patterns = ["docs/**", "baselines/**", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"]
exclude_patterns = [".*", "site", "build", "dist", "baselines/*/runs"]

# Pages
myst_enable_extensions = ["attrs_inline", "colon_fence"]
myst_heading_anchors = 4

# Notebooks: run every time, in a folder of their own; an error is a warning, which fails the build.
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_show_tb = True
nb_execution_timeout = 600  # s, of a cell, on a machine that is busy
nb_merge_streams = True
nb_render_markdown_format = "gfm"  # tables, too

# Kernels are spoken to by sockets in a folder: a free port that is chosen for one can be somebody
# else's before the kernel has started, which then dies. (traitlets takes defaults by such names.)
_sockets = TemporaryDirectory()
AsyncKernelManager._transport_default = lambda _kernel: "ipc"
AsyncKernelManager._ip_default = lambda _kernel: f"{_sockets.name}/kernel"

# Docstrings
default_role = "autolink"  # a link where the name is one of the reference's, else emphasis
autodoc_typehints = "none"  # the docstrings tell more
autodoc_member_order = "bysource"
autosummary_generate = False
napoleon_google_docstring = False
napoleon_use_param = False  # else "shape" of a type is a link to some shape
napoleon_use_rtype = False
napoleon_custom_sections = [
    ("Action space", "notes_style"),
    ("Observation space", "notes_style"),
    "Reward",
    "End of an episode",
    "Info",
    "Versions",
    "Source",
]
nitpick_ignore_regex = [("py:(class|obj|exc)", ".*")]  # types are words: ndarray, shape (n,)

# HTML
html_theme = "furo"
html_title = f"softvox-gym {version}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_additional_pages = {"index": "redirect.html"}
templates_path = ["templates"]
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}


def setup(app: Any) -> None:
    """Leave out the fields of named tuples, which their classes' docstrings tell of."""

    def skips(_app: Any, _kind: str, _name: str, value: Any, *_: Any) -> bool | None:
        return True if type(value).__name__ == "_tuplegetter" else None

    app.connect("autodoc-skip-member", skips)
