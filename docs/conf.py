# SPDX-License-Identifier: Apache-2.0
"""Settings of the documentation site: `make docs` builds it in build/docs/html, and a warning is an error.

Everything in docs/generated and docs/gallery is made by the build. The site loads nothing from the network.
"""

import builtins
import sys
import warnings
from pathlib import Path
from typing import Any

import matplotlib as mpl

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS / "builder"))

import command_pages  # noqa: E402
import cpp_pages  # noqa: E402
import figures  # noqa: E402
import navigation  # noqa: E402
import notebook_page  # noqa: E402
import page_code  # noqa: E402
import python_pages  # noqa: E402
import site_links  # noqa: E402

import palpate  # noqa: E402

project = "palpate"
copyright = "the palpate authors, Apache-2.0"
version = release = palpate.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
    "sphinx_copybutton",
]
exclude_patterns = ["README.md", "builder"]
source_suffix = {".rst": "restructuredtext", ".md": "markdown"}
suppress_warnings = ["config.cache", "sphinx_gallery.space_in_filename"]

html_theme = "furo"
html_title = f"palpate {release}"
html_show_sourcelink = False
html_copy_source = False
html_static_path = ["static"]
html_css_files = ["site.css"]
templates_path = ["templates"]
pygments_style = "default"
copybutton_exclude = ".linenos, .gp, .go"

myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence"]

# Docstrings quote code in single backticks.
default_role = "code"
smartquotes = False  # they would change the two dashes of an option
nitpicky = True
# The network is not used, so types of other packages have no page. Names of palpate are checked.
nitpick_ignore_regex = [
    (r"py:.*", r"(?!palpate\.)\S.*"),
    # Types of signatures in a module of a package; only names that a package exports have pages.
    (r"py:.*", r"palpate\.(_\w+|\w+\.\w+)\..*"),
    (r"cpp:.*", r"(?!palpate::).*|palpate::(wire|mit|moteus|detail)\b.*"),
]
autosummary_ignore_module_all = False
# Members of the base classes of scikit-learn and Python are described in their documentation.
_FOREIGN = "BaseEstimator, RegressorMixin, MultiOutputMixin, Exception, ValueError, tuple, str, object"
autodoc_default_options = {
    "members": True,
    "inherited-members": _FOREIGN,
    "member-order": "bysource",
    "exclude-members": "set_fit_request, set_predict_request, set_score_request, get_metadata_routing",
}
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_docstring_signature = True
napoleon_google_docstring = False
napoleon_use_param = False
napoleon_use_rtype = False
napoleon_use_ivar = True
python_display_short_literal_types = True


def name_example(_settings: dict[str, Any], file: str) -> None:
    """Gives an example the name `__file__`, which sphinx-gallery does not define."""
    builtins.__file__ = str(DOCS.parent / "examples" / Path(file).name)


mpl.use("agg")
# A warning of an example is an error, like in the tests.
warnings.filterwarnings("error", category=UserWarning, module="palpate")
sphinx_gallery_conf = {
    "examples_dirs": ["../examples"],
    "gallery_dirs": ["gallery"],
    "filename_pattern": r"/\d\d_",
    "within_subsection_order": "FileNameSortKey",
    "ignore_pattern": r"__init__",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_memory": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
    "remove_config_comments": True,
    "reset_modules": ("matplotlib", name_example),
}


def setup(app: Any) -> None:
    """Makes the generated pages and pictures, and connects the changes of a page before it is read."""
    generated = DOCS / "generated"
    cpp_pages.write_pages(generated / "cpp")
    # A cached environment does not know new pages, so their files are listed.
    app.config.autosummary_generate = python_pages.write_pages(generated / "python")
    command_pages.write_pages(generated)
    security = (DOCS.parent / "SECURITY.md").read_text(encoding="utf-8")
    (generated / "security.md").write_text(security.replace("](docs/", "](../"), encoding="utf-8")
    figures.write_figures(generated / "figures")
    notebook_page.write_page(generated)
    outputs = page_code.run_pages()
    app.connect("source-read", lambda _app, name, source: page_code.show_outputs(name, source, outputs))
    # Before napoleon, which writes its own markup.
    app.connect("autodoc-process-docstring", python_pages.escape_formulas, priority=400)
    app.connect("autodoc-process-signature", python_pages.shorten_signature)
    app.connect("source-read", site_links.inside_the_site)
    # Before the theme, which makes the navigation, and behind it.
    app.connect("html-page-context", navigation.leave_out, priority=400)
    app.connect("html-page-context", navigation.add, priority=600)
