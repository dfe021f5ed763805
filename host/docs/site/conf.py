"""Sphinx settings of the documentation site; ``make docs`` builds it, warnings are errors.

The source folder is the repository's root, so that the pages of host, board and shared link to each other and to
files of code by their paths, on the site as in the repository.
"""

import sys
from pathlib import Path

from armtempo import __version__

sys.path.insert(0, str(Path(__file__).parent))

project = "armtempo"
author = "the armtempo authors"
project_copyright = "2026, the armtempo authors; MIT licence"
version = release = __version__
language = "en"
smartquotes = False  # "--port" keeps its hyphens

root_doc = "host/docs/index"
include_patterns = ["host/docs/**.md", "board/docs/**.md", "shared/docs/**.md"]
extensions = ["myst_parser", "sphinx.ext.autodoc", "catalogue"]

myst_enable_extensions = ["attrs_inline", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4

autodoc_typehints = "signature"
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
python_display_short_literal_types = True
python_maximum_signature_line_length = 88
autodoc_member_order = "bysource"
autodoc_type_aliases = {name: name for name in ("Array", "ArrayLike", "NDArray", "Progress", "Where", "Tell")}
nitpicky = True  # a link that leads nowhere is a warning
nitpick_ignore_regex = [("py:.*", ".*")]  # but not a type of numpy or click in a signature

html_theme = "furo"
html_title = f"armtempo {release.partition('+')[0]}"  # without the commit, which makes it two lines
html_static_path = ["style"]
html_css_files = ["pages.css"]
html_extra_path = ["extra"]  # index.html at the top leads to the first page
html_theme_options = {"navigation_with_keys": True}
html_show_sourcelink = False
