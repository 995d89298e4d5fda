"""What Sphinx builds the site from: these pages, every public docstring, and pictures of the gallery. ``make docs``."""

import warnings

import matplotlib as mpl

import tvident

mpl.use("agg")

project = "tvident"
author = copyright = "The tvident developers"  # noqa: A001 - Sphinx's name
version = release = tvident.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["README.md", "gallery/*", "templates/*", "site/*"]
templates_path = ["templates"]
root_doc = "index"

myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4

autosummary_generate = True
autodoc_typehints = "none"
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

sphinx_gallery_conf = {
    "examples_dirs": ["gallery"],
    "gallery_dirs": ["shown"],
    "within_subsection_order": "FileNameSortKey",
    "filename_pattern": r"/plot_",
    "image_scrapers": ("matplotlib",),
    "download_all_examples": False,
    "show_memory": False,
    "min_reported_time": 1e9,
    "show_signature": False,
    "abort_on_example_error": True,
}
# Figures that are closed by the gallery are nobody's loss.
warnings.filterwarnings("ignore", message=".*non-GUI backend.*", category=UserWarning)

html_theme = "pydata_sphinx_theme"
html_title = "tvident"
html_static_path = ["style"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_theme_options = {
    "navigation_with_keys": False,
    "header_links_before_dropdown": 6,
    "show_toc_level": 2,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}
# Pages of the first level have nothing below them to list.
html_sidebars: dict[str, list[str]] = {"*": []}

# Pages link to files of the repository that are no pages of the site; the tests follow these links.
suppress_warnings = ["myst.xref_missing"]
