"""Runs docs/reference/python.ipynb and writes docs/reference/python.md with its pictures, docs/images/python_*.png.

Needs the package flexbody, scipy, matplotlib, nbconvert and ipykernel in the same Python.
"""

from pathlib import Path

import nbformat
from nbconvert.exporters import MarkdownExporter
from nbconvert.preprocessors import ExecutePreprocessor

DOCS = Path(__file__).resolve().parents[2] / "docs"
FOLDER = DOCS / "reference"
HEAD = "<!-- Made from docs/reference/python.ipynb: ./scripts/make.sh pages python -->\n\n"


def main() -> None:
    notebook = nbformat.read(FOLDER / "python.ipynb", as_version=4)
    ExecutePreprocessor(timeout=600).preprocess(notebook, {"metadata": {"path": str(FOLDER)}})
    resources = {"unique_key": "python", "output_files_dir": "images"}
    text, resources = MarkdownExporter().from_notebook_node(notebook, resources)
    for number, (name, picture) in enumerate(sorted(resources["outputs"].items(), key=lambda one: text.index(one[0])), 1):
        own = f"images/python_{number}.png"
        (DOCS / own).write_bytes(picture)
        text = text.replace(name, f"../{own}")
    # Executions leave blanks at line ends and several empty lines; the page has neither.
    lines = [line.rstrip() for line in text.strip().splitlines()]
    kept = [line for at, line in enumerate(lines) if line or (at and lines[at - 1])]
    (FOLDER / "python.md").write_text(HEAD + "\n".join(kept) + "\n")


if __name__ == "__main__":
    main()
