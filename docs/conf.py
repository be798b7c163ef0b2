"""The site: Sphinx with Markdown pages; `make docs` builds it, warnings are errors.

Two kinds of pages are written anew at every build, from the code itself, and kept out of git:
`environments/gnm-*.md` and `reference/*.rst` (see `extensions/`).
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "extensions"), str(HERE.parent)]

import gnm_env  # noqa: E402

project = "gnm-env"
author = "The gnm-env contributors"
copyright = "The gnm-env contributors, MIT licence"
release = gnm_env.__version__
version = release

extensions = [
    "markdown_docstrings",
    "generated_pages",
    "public_names",
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = [
    "_build",
    "extensions",
    "league",
    "reproduction/*/stores",
    "findings/*/stores",
    "tutorials/scripts",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}

# "cost" in the text is a string of Python: its quotes stay as they are.
smartquotes = False

myst_enable_extensions = ["attrs_inline", "colon_fence", "deflist", "fieldlist"]
myst_heading_anchors = 4
# Gallery pages hold links with a scheme; everything else without one is a page or a file of ours.
myst_url_schemes = ["http", "https", "mailto"]

# Two classes may have a field of one name, such as `channels`: its mention is no link then.
suppress_warnings = ["ref.python"]

autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
autodoc_class_signature = "mixed"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88
add_module_names = True
toc_object_entries_show_parents = "hide"
maximum_signature_line_length = 88

sphinx_gallery_conf = {
    "examples_dirs": ["tutorials/scripts"],
    "gallery_dirs": ["tutorials/gallery"],
    "filename_pattern": r"/tutorial_",
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_signature": False,
    "show_memory": False,
    "min_reported_time": 1e9,
    "capture_repr": (),
    "write_computation_times": False,
    "remove_config_comments": True,
    "notebook_extensions": set(),
}

html_theme = "furo"
html_title = f"gnm-env {release}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_last_updated_fmt = None
html_theme_options = {
    "navigation_with_keys": True,
    "light_css_variables": {"color-brand-primary": "#00629b", "color-brand-content": "#00629b"},
    "dark_css_variables": {"color-brand-primary": "#6cc0f5", "color-brand-content": "#6cc0f5"},
}
# Prompts are not copied with a command.
copybutton_prompt_text = r"\$ |>>> "
copybutton_prompt_is_regexp = True
