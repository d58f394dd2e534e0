"""The documentation as a site; `scripts/site.sh` builds it of README.md, ARCHITECTURE.md, CHANGELOG.md and docs/."""

from pathlib import Path

project = "flexbody"
author = "the flexbody developers"
extensions = ["myst_parser", "sphinx.ext.mathjax"]
root_doc = "README"
include_patterns = ["README.md", "ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md", "fixtures/README.md", "fixtures/cases/README.md", "python/README.md", "docs/*.md", "docs/how_to/*.md", "docs/formats/*.md"]
# Headings are link targets and formulas stand between dollars, as where the sources are read.
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = ["math"]
html_theme = "furo"
html_title = "flexbody"
html_copy_source = False

# What the side bar has: its groups, and the pages of each in the order of reading.
CONTENTS = {
    "Use": ["docs/tutorial", "docs/how_to/rotor", "docs/how_to/robot_link", "docs/how_to/vehicle_frame", "docs/how_to/satellite", "docs/fe_programs", "docs/recipes", "docs/python", "docs/input", "docs/simulate", "docs/select", "docs/response", "docs/export", "docs/audit", "docs/view", "docs/reference", "docs/codes"],
    "Theory": ["docs/theory", "docs/plausibility", "docs/craig_bampton", "docs/cutoff"],
    "Measured": ["docs/accuracy", "docs/trade", "docs/verdicts", "docs/seeds", "docs/stability", "docs/performance", "docs/dynamics"],
    "Files": ["docs/format", "docs/formats/*"],
    "Project": ["docs/releases", "python/README", "ARCHITECTURE", "fixtures/README", "fixtures/cases/README", "CONTRIBUTING", "CHANGELOG"],
}


def contents():
    """The side bar, as the directives that Sphinx makes it of. Pages that no group names come last."""
    root = Path(__file__).resolve().parents[2]
    named = {page for pages in CONTENTS.values() for page in pages}
    rest = sorted(f"docs/{page.stem}" for page in root.glob("docs/*.md") if f"docs/{page.stem}" not in named)
    groups = {**CONTENTS, "Further": rest} if rest else CONTENTS
    options = ":hidden:\n:glob:\n"
    return "".join(f"\n```{{toctree}}\n{options}:caption: {caption}\n\n" + "\n".join(pages) + "\n```\n" for caption, pages in groups.items())


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
