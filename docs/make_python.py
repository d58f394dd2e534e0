"""Runs docs/python.ipynb and writes docs/python.md with its pictures, docs/images/python_*.png.

Needs the package flexbody, scipy, matplotlib, nbconvert and ipykernel in the same Python.
"""

from pathlib import Path

import nbformat
from nbconvert.exporters import MarkdownExporter
from nbconvert.preprocessors import ExecutePreprocessor

DOCS = Path(__file__).resolve().parent
HEAD = "<!-- Made from docs/python.ipynb: python3 docs/make_python.py -->\n\n"


def main() -> None:
    notebook = nbformat.read(DOCS / "python.ipynb", as_version=4)
    ExecutePreprocessor(timeout=600).preprocess(notebook, {"metadata": {"path": str(DOCS)}})
    resources = {"unique_key": "python", "output_files_dir": "images"}
    text, resources = MarkdownExporter().from_notebook_node(notebook, resources)
    for number, (name, picture) in enumerate(sorted(resources["outputs"].items(), key=lambda one: text.index(one[0])), 1):
        own = f"images/python_{number}.png"
        (DOCS / own).write_bytes(picture)
        text = text.replace(name, own)
    # What executions leave in a page that is kept: blanks at line ends and several empty lines.
    lines = [line.rstrip() for line in text.strip().splitlines()]
    kept = [line for at, line in enumerate(lines) if line or (at and lines[at - 1])]
    (DOCS / "python.md").write_text(HEAD + "\n".join(kept) + "\n")


if __name__ == "__main__":
    main()
