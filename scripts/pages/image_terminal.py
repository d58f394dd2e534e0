#!/usr/bin/env python3
"""Draws docs/images/terminal.svg: the command of scripts/quickstart.sh and what it really prints.

    cargo build --release --locked && python3 scripts/pages/image_terminal.py

Only times, memory and the number of threads differ from run to run. Needs nothing but Python.
"""

import argparse
import html
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MODEL = "fixtures/models/connecting_rod/model.toml"
FOLDER = "target/quickstart"
ARGUMENTS = ["convert", MODEL, "-o", f"{FOLDER}/connecting_rod.flex.h5", "--report", f"{FOLDER}/connecting_rod.html"]
SHOWN = [
    f"$ flexbody convert {MODEL} \\",
    f"    -o {FOLDER}/connecting_rod.flex.h5 \\",
    f"    --report {FOLDER}/connecting_rod.html",
]
COLUMNS = 82
ADVANCE, LEADING, MARGIN, BAR = 8.4, 19, 18, 34  # pixels: column, line, border, title bar
BACKGROUND, TITLE, TEXT, DIM, LABEL = "#1b1f27", "#2a303c", "#d8dee9", "#8f9bb3", "#88c0d0"
GOOD, WARNING = "#a3be8c", "#ebcb8b"
FONT = "ui-monospace, 'DejaVu Sans Mono', Menlo, Consolas, monospace"


def run(program):
    (ROOT / FOLDER).mkdir(parents=True, exist_ok=True)
    done = subprocess.run([program, *ARGUMENTS], cwd=ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{program} ended with {done.returncode}:\n{done.stderr}")
    return done.stdout.splitlines()


def spans(line):
    """Pieces of a line as (column, text, colour): the label of an entry stands in the first twelve columns."""
    if line in SHOWN:
        return [(0, line, TEXT)]
    label, text = line[:12].rstrip(), line[12:]
    tone = GOOD if label == "proved" else WARNING if "NEGATIVE" in text or label == "warnings" else LABEL
    return [piece for piece in ((0, label, tone), (12, text, TEXT)) if piece[1].strip()]


def piece(x, y, text, colour):
    text = text.rstrip()
    start = len(text) - len(text.lstrip())
    text = text.lstrip()
    # A stated length keeps the columns aligned whatever the font.
    return (f'<text x="{x + start * ADVANCE:.1f}" y="{y}" textLength="{len(text) * ADVANCE:.1f}" '
            f'fill="{colour}">{html.escape(text, quote=False)}</text>')


def draw(lines):
    width, height = MARGIN * 2 + COLUMNS * ADVANCE, BAR + MARGIN + len(lines) * LEADING + MARGIN // 2
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height}" '
        f'viewBox="0 0 {width:.0f} {height}" font-family="{FONT}" font-size="14" xml:space="preserve" role="img">',
        "<title>flexbody convert on the connecting rod of the fixtures</title>",
        f'<rect width="{width:.0f}" height="{height}" rx="8" fill="{BACKGROUND}"/>',
        f'<path d="M0 {BAR}V8a8 8 0 0 1 8-8H{width - 8:.0f}a8 8 0 0 1 8 8V{BAR}z" fill="{TITLE}"/>',
        *(f'<circle cx="{20 + 20 * i}" cy="{BAR // 2}" r="6" fill="{c}"/>' for i, c in enumerate(("#bf616a", "#ebcb8b", "#a3be8c"))),
        f'<text x="{width / 2:.0f}" y="{BAR // 2 + 5}" fill="{DIM}" text-anchor="middle" font-size="13">flexbody</text>',
    ]
    for row, line in enumerate(lines):
        y = BAR + MARGIN + row * LEADING + 6
        out += [piece(MARGIN + column * ADVANCE, y, text, colour) for column, text, colour in spans(line)]
    return "\n".join(out + ["</svg>", ""])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    parser.add_argument("--program", default=str(target / "release" / "flexbody"), help="flexbody (default: the release build)")
    parser.add_argument("--output", type=Path, default=ROOT / "docs/images/terminal.svg")
    args = parser.parse_args()
    lines = SHOWN + run(args.program)
    longest = max(map(len, lines))
    if longest > COLUMNS:
        sys.exit(f"a line has {longest} columns, room is for {COLUMNS}")
    args.output.write_text(draw(lines), encoding="utf-8")
    print(f"{args.output}: {len(lines)} lines")


if __name__ == "__main__":
    main()
