"""The documentation as a site; `scripts/site.sh` builds it of README.md, ARCHITECTURE.md, CHANGELOG.md, docs/ and evidence/."""

from pathlib import Path

project = "flexbody"
author = "the flexbody developers"
# MathJax is part of the site, so that formulas appear without a network.
extensions = ["myst_parser", "sphinx.ext.mathjax", "sphinx-mathjax-offline"]
root_doc = "README"
include_patterns = ["README.md", "ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md", "fixtures/README.md", "fixtures/cases/README.md", "python/README.md", "docs/*.md", "docs/**/*.md", "evidence/*.md", "evidence/**/*.md"]
# Headings are link targets and formulas stand between dollars, as where the sources are read.
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = ["math"]
html_theme = "furo"
html_title = "flexbody"
html_copy_source = False
html_static_path = ["static"]
html_css_files = ["site.css"]

# Groups of the side bar, with the pages of each in the order of reading.
CONTENTS = {
    "Start": ["docs/start/tour", "docs/start/tutorial", "docs/start/accuracy", "docs/start/basis"],
    "Parts": ["docs/how_to/rotor", "docs/how_to/robot_link", "docs/how_to/frame", "docs/how_to/satellite"],
    "From FE programs": ["docs/how_to/from_fe_programs", "docs/how_to/from_calculix", "docs/how_to/from_abaqus", "docs/how_to/from_ansys", "docs/how_to/from_nastran", "docs/how_to/from_open_codes", "docs/how_to/import_modes", "docs/how_to/stresses_from_calculix", "docs/how_to/geometric_stiffness"],
    "To other programs": ["docs/how_to/known_error", "docs/reference/exports", "docs/reference/formats/*", "docs/how_to/read_the_file"],
    "Many bodies": ["docs/how_to/batch", "docs/how_to/cluster", "docs/how_to/ci"],
    "Reference": ["docs/reference/commands", "docs/reference/runs", "docs/reference/codes", "docs/reference/input", "docs/reference/scenes", "docs/reference/simulate", "docs/reference/select", "docs/reference/trade", "docs/reference/advise", "docs/reference/response", "docs/reference/recovery", "docs/reference/report", "docs/reference/view", "docs/reference/audit", "docs/reference/file_format", "docs/reference/python", "docs/reference/rust", "docs/reference/versions"],
    "Theory": ["docs/theory"],
    "Validation": ["docs/validation/index"],
    "Project": ["docs/decisions", "python/README", "ARCHITECTURE", "fixtures/README", "fixtures/cases/README", "CONTRIBUTING", "CHANGELOG"],
    "Evidence": ["evidence/README", "evidence/pages/*"],
}


def contents():
    """Returns the side bar as directives of Sphinx. A page that no group names is a warning, hence an error of scripts/site.sh."""
    options = ":hidden:\n:glob:\n"
    return "".join(f"\n```{{toctree}}\n{options}:caption: {caption}\n\n" + "\n".join(pages) + "\n```\n" for caption, pages in CONTENTS.items())


def with_contents(_app, name, source):
    if name == root_doc:
        source[0] += contents()


def with_index(app, failed):
    """The page that a web server shows first."""
    if not failed:
        Path(app.outdir, "index.html").write_text(f'<!DOCTYPE html>\n<meta http-equiv="refresh" content="0; url={root_doc}.html">\n')


def setup(app):
    app.connect("source-read", with_contents)
    app.connect("build-finished", with_index)
