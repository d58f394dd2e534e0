#!/usr/bin/env python3
"""Draws docs/images/tutorial_mode.png and tutorial_shaker.png: runs examples/from_cad/tutorial.sh.

    cargo build --release --locked && python3 scripts/pages/image_tutorial.py

Needs Gmsh and CalculiX on the PATH (GMSH, CCX), and PyVista, exudyn, h5py and matplotlib.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from image_vtk import draw

ROOT = Path(__file__).resolve().parents[2]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/flexbody")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        environment = dict(os.environ, FLEXBODY=str(arguments.program.resolve()), PYTHON=sys.executable)
        subprocess.run([ROOT / "examples/from_cad/tutorial.sh", place], check=True, env=environment)
        draw(Path(place) / "bracket.vtu", 1, ROOT / "docs/images/tutorial_mode.png", zoom=0.95)
        shutil.copy(Path(place) / "shaker.png", ROOT / "docs/images/tutorial_shaker.png")


if __name__ == "__main__":
    main()
