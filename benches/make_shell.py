#!/usr/bin/env python3
"""Writes a panel of flat shell rectangles, folded into an arc, for benches: K, a general M with nodal rotations, node and DOF tables, manifest.

    pip install numpy
    python benches/make_shell.py /tmp/shell200k --dofs 200000

An arc of 120 degrees, as long as it is wide, of strips that each lie in a plane: membrane, bending and drilling are
coupled in every node. The elements are those of fixtures/make/elements.py; isotropic, SI units.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "fixtures/make"))

from elements import shell_rectangle
from nodal_model import write_model

RADIUS, ANGLE = 1.0, 2 * np.pi / 3


def panel(cells, thickness):
    """Nodes along the arc first, and strips: nodes of their elements, stiffness and mass of one."""
    angles = np.linspace(-ANGLE / 2, ANGLE / 2, cells + 1)
    arc = RADIUS * np.column_stack([np.sin(angles), np.cos(angles)])
    width = RADIUS * ANGLE / cells
    x, y = np.meshgrid(np.arange(cells + 1), np.arange(cells + 1))
    points = np.column_stack([arc[x.ravel(), 0], y.ravel() * width, arc[x.ravel(), 1]])
    strips = []
    for i in range(cells):
        chord = arc[i + 1] - arc[i]
        length = np.linalg.norm(chord)
        along = np.array([chord[0], 0.0, chord[1]]) / length
        across = np.array([0.0, 1.0, 0.0])
        axes = np.array([along, across, np.cross(along, across)])
        matrices = shell_rectangle((length, width), axes, thickness, (2.1e11, 0.3, 7850.0))
        first = i + (cells + 1) * np.arange(cells)
        nodes = np.stack([first, first + 1, first + cells + 2, first + cells + 1], axis=1)
        strips.append((nodes, *matrices))
    return points, strips


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--dofs", type=int, default=6000, help="about this many degrees of freedom")
    parser.add_argument("--thickness", type=float, default=0.005, help="in metres; the radius is one")
    args = parser.parse_args()
    began = time.perf_counter()
    points, strips = panel(max(1, round((args.dofs / 6) ** 0.5) - 1), args.thickness)
    write_model(args.folder, points, strips, began)


if __name__ == "__main__":
    main()
