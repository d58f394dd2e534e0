#!/usr/bin/env python3
"""Draws docs/images/simulation.svg: two plots out of the report of the simulation in docs/reference/simulate.md.

    cargo build --release --locked && python3 scripts/pages/image_simulation.py

Needs nothing but Python.
"""

import argparse
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "target/simulation"
TITLES = ("Angular velocity", "Deflection")
WIDTH, HEIGHT, CAPTION = 840, 246, 24  # pixels of a plot of the report, and of the line above it
STYLE = (
    "text { font: 12px system-ui, sans-serif; fill: #1a1d21; } .tick { fill: #5a6370; } .grid { stroke: #d5dae1; } "
    "polyline { fill: none; stroke-width: 1.4; } .l0 { stroke: #1f5fa8; } .l1 { stroke: #b4560d; stroke-dasharray: 7 3; } "
    ".l2 { stroke: #4f7a28; stroke-dasharray: 2 3; }"
)


def run(program, *arguments):
    done = subprocess.run([program, *map(str, arguments)], cwd=ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{program} ended with {done.returncode}:\n{done.stderr}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", default=str(ROOT / "target/release/flexbody"))
    program = parser.parse_args().program
    FOLDER.mkdir(parents=True, exist_ok=True)
    body, report = FOLDER / "bracket.flex.h5", FOLDER / "motion.html"
    run(program, "convert", "fixtures/models/bracket_hex20/model.toml", "--modes", 12, "-o", body)
    run(program, "simulate", body, "--scene", "fixtures/scenes/tumbling.toml", "--report", report)
    figures = re.findall(r"<figcaption>(.*?)</figcaption>\s*<svg[^>]*>(.*?)</svg>", report.read_text(), re.S)
    shown = [figure for figure in figures if figure[0].startswith(TITLES)]
    height = len(shown) * (HEIGHT + CAPTION)
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" viewBox="0 0 {WIDTH} {height}" role="img">',
        f'<style>{STYLE}</style><rect width="{WIDTH}" height="{height}" fill="#fff"/>',
    ]
    for i, (caption, plot) in enumerate(shown):
        top = i * (HEIGHT + CAPTION)
        out.append(f'<text x="8" y="{top + 16}">{caption}</text><g transform="translate(0 {top + CAPTION})">{plot}</g>')
    out.append("</svg>")
    (ROOT / "docs/images/simulation.svg").write_text("\n".join(out) + "\n")


if __name__ == "__main__":
    main()
