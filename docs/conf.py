"""The manual: Sphinx with MyST. `make docs` builds it; warnings are errors."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_tools"))

import docstrings  # noqa: E402
import gallery  # noqa: E402
import magshell  # noqa: E402

project = "magshell"
author = "The magshell developers"
copyright = author
version = release = magshell.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc"]
myst_heading_anchors = 3
myst_enable_extensions = ["html_image"]
exclude_patterns = ["_build", "_tools", "ruff.toml", "_gallery/*.txt"]
suppress_warnings = ["myst.header"]

html_theme = "furo"
html_title = f"magshell {version}"
html_copy_source = False
html_scaled_image_link = False  # pictures lead to the pages of their examples
html_static_path: list[str] = []
html_theme_options = {"navigation_with_keys": True}

autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_class_signature = "mixed"
autodoc_preserve_defaults = True
autodoc_inherit_docstrings = False


def setup(app) -> None:
    app.connect("autodoc-process-docstring", docstrings.process)
    app.connect("autodoc-skip-member", docstrings.skip)
    app.connect("builder-inited", gallery.make)
