#!/usr/bin/env python3
"""Writes the braced steel frame of a building for benches: K, a general M with nodal rotations, node and DOF tables, manifest.

    pip install numpy
    python benches/make_frame.py /tmp/frame200k --dofs 200000

Columns, girders along both directions and a diagonal in every bay of every storey, along both directions: beams of several elements each
(`--elements`), those of fixtures/make/elements.py. With one element for each member the model is a lattice whose factor is as full as
that of a solid. Isotropic, SI units.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "fixtures/make"))

from elements import beam
from nodal_model import write_model

STEEL = (2.1e11, 0.3, 7850.0)
BAY, STOREY = 6.0, 4.0
STEPS = np.array([(0, 0, 1), (1, 0, 0), (0, 1, 0), (1, 0, 1), (0, 1, 1)])  # columns, girders, diagonals
SIDES = (0.4, 0.3, 0.3, 0.2, 0.2)  # of square sections, with walls of a twentieth


def section(side):
    """Area, torsion constant and second moments of a square tube."""
    wall = side / 20
    middle = side - wall
    return 4 * middle * wall, middle**3 * wall, 2 / 3 * middle**3 * wall, 2 / 3 * middle**3 * wall


def frame(joints, elements):
    """Joints along each axis: the points, and the groups of equal elements."""
    numbers = np.arange(np.prod(joints)).reshape(joints)
    spacing = np.array([BAY, BAY, STOREY])
    points = [np.stack(np.meshgrid(*map(np.arange, joints), indexing="ij"), axis=-1).reshape(-1, 3) * spacing]
    count, groups = len(points[0]), []
    for step, side in zip(STEPS, SIDES):
        begin = numbers[tuple(slice(0, size - ahead) for size, ahead in zip(joints, step))].ravel()
        end = numbers[tuple(slice(ahead, None) for ahead in step)].ravel()
        along = step * spacing / elements
        inner = count + np.arange(len(begin) * (elements - 1)).reshape(len(begin), elements - 1)
        points.append((points[0][begin][:, None] + along * np.arange(1, elements)[:, None]).reshape(-1, 3))
        count += inner.size
        chain = np.column_stack([begin, inner, end])
        up = np.array([1.0, 0, 0]) if step[0] == 0 else np.array([0, 1.0, 0])
        matrices = beam(np.zeros(3), along, up, section(side), STEEL)
        groups.append((np.stack([chain[:, :-1], chain[:, 1:]], axis=-1).reshape(-1, 2), *matrices))
    return np.concatenate(points), groups


def joints_for(dofs, elements):
    """As many joints along each axis, about twice as many upwards, as give about so many degrees of freedom: a joint begins five members."""
    joints = dofs / 6 / (1 + 5 * (elements - 1))
    side = max(2, round((joints / 2) ** (1 / 3)))
    return side, side, max(2, round(joints / side**2))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--dofs", type=int, default=6000, help="about this many degrees of freedom")
    parser.add_argument("--elements", type=int, default=4, help="of each member")
    args = parser.parse_args()
    began = time.perf_counter()
    write_model(args.folder, *frame(joints_for(args.dofs, args.elements), args.elements), began)


if __name__ == "__main__":
    main()
