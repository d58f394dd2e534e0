#!/usr/bin/env python3
"""Draws docs/images/response.svg: a plot out of the report of the first command of docs/reference/response.md.

    cargo build --release --locked && python3 scripts/pages/image_response.py

Needs nothing but Python.
"""

import argparse
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "target/response"
TITLE = "interface bolt_wall to interface bolt_base: z for z"
COMMAND = (
    "response fixtures/models/bracket_hex20/model.toml --modes 8 --band 100..20000 --from bolt_wall:z "
    "--to bolt_base:z --damping 0.01 --report"
)
STYLE = (
    "text { font: 12px system-ui, sans-serif; fill: #1a1d21; } .tick { fill: #5a6370; } .grid { stroke: #d5dae1; } "
    "polyline { fill: none; stroke-width: 1.4; } .l0 { stroke: #1f5fa8; } .l1 { stroke: #b4560d; stroke-dasharray: 7 3; } "
    ".l2 { stroke: #4f7a28; stroke-dasharray: 2 3; } .s1 { fill: #b4560d; }"
)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", default=str(ROOT / "target/release/flexbody"))
    program = parser.parse_args().program
    FOLDER.mkdir(parents=True, exist_ok=True)
    report = FOLDER / "response.html"
    done = subprocess.run([program, *COMMAND.split(), str(report)], cwd=ROOT, capture_output=True, text=True)
    # 1: the errors are above the tolerance, which is what the figure shows.
    if done.returncode not in (0, 1):
        sys.exit(f"{program} ended with {done.returncode}:\n{done.stderr}")
    print(done.stdout)
    figures = re.findall(r"<figcaption>(.*?)</figcaption>\s*<svg viewBox=\"0 0 (\d+) (\d+)\"[^>]*>(.*?)</svg>", report.read_text(), re.S)
    width, height, plot = next(figure[1:] for figure in figures if figure[0] == TITLE)
    (ROOT / "docs/images/response.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" role="img">\n'
        f'<style>{STYLE}</style><rect width="{width}" height="{height}" fill="#fff"/>\n{plot.strip()}\n</svg>\n'
    )


if __name__ == "__main__":
    main()
