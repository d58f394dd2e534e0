#!/usr/bin/env python3
"""Writes a bracket of ten-node tetrahedra for benches: K, M, node and DOF tables, manifest.

    pip install numpy
    python benches/make_tet10.py /tmp/bracket100k --dofs 100000

A base plate with a hole, a wall, and a stepped rib between them, slightly bent so that no two elements are alike. Every
cell of the lattice is six straight-sided tetrahedra around its diagonal; consistent mass and stiffness are integrated
exactly, isotropic, SI units. Nodes are numbered along z, then y, then x; values carry 17 significant digits.
"""

import argparse
import itertools
import json
import math
import sys
import time
from pathlib import Path

import numpy as np

from make_block import write_manifest, write_tables

UNIT = 0.012  # edge of one coarse cell in metres
EDGES = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]  # corners on either side of nodes 4 to 9
MONOMIALS = [(i, i) for i in range(4)] + EDGES


def bracket():
    """Lower corners of the coarse cells."""
    base = {(x, y, 0) for x in range(9) for y in range(6) if not (4 <= x < 7 and 2 <= y < 4)}
    wall = {(0, y, z) for y in range(6) for z in range(1, 5)}
    rib = {(x, y, z) for x in range(1, 3) for y in (2, 3) for z in range(1, 4) if x + z < 5}
    return np.array(sorted(base | wall | rib))


def bent(lattice):
    """Lattice coordinates (in coarse cells) to metres: the wall leans, the base rises at its end, the part is tapered."""
    x, y, z = (UNIT * lattice).T
    return np.column_stack([x + 1.5 * z ** 2, (y - 3 * UNIT) * (1 - 1.8 * x), z + 0.6 * x ** 2 + 0.4 * x * y])


class Mesh:
    """Nodes (n x 3) and ten-node elements of the bracket with `fine` lattice cells to a coarse cell along each axis."""

    def __init__(self, fine):
        fine = np.array(fine)
        inside = np.array(list(itertools.product(*map(range, fine))))
        cells = (bracket()[:, None, :] * fine + inside).reshape(-1, 3)
        paths = np.array([np.vstack([np.zeros(3, int), np.cumsum(np.eye(3, dtype=int)[list(order)], axis=0)])
                          for order in itertools.permutations(range(3))])  # corners of the six tetrahedra, along the diagonal
        for path in paths:  # half of them are left-handed: swap two corners
            if np.linalg.det(path[1:] - path[0]) < 0:
                path[[2, 3]] = path[[3, 2]]
        corners = 2 * (cells[:, None, None, :] + paths)  # on the half-integer lattice, where mid-edge nodes have a place
        corners = corners.reshape(-1, 4, 3)
        middles = np.stack([(corners[:, i] + corners[:, j]) // 2 for i, j in EDGES], axis=1)
        points = np.concatenate([corners, middles], axis=1)
        width = points.max() + 1
        keys, numbers = np.unique(points @ [width ** 2, width, 1], return_inverse=True)
        self.elements = numbers.reshape(-1, 10)
        lattice = np.column_stack([keys // width ** 2, keys // width % width, keys % width])
        self.nodes = bent(lattice / (2.0 * fine))
        for k, (i, j) in enumerate(EDGES, start=4):  # straight edges
            self.nodes[self.elements[:, k]] = (self.nodes[self.elements[:, i]] + self.nodes[self.elements[:, j]]) / 2


def shape_functions():
    """Coefficients (10 x 10) of the shape functions in the products L_i L_j of barycentric coordinates."""
    found = np.zeros((10, 10))
    for i in range(4):  # L_i (2 L_i - 1) with 1 = sum of L
        found[i, i] = 1.0
        for k, edge in enumerate(EDGES, start=4):
            if i in edge:
                found[i, k] = -1.0
    found[range(4, 10), range(4, 10)] = 4.0
    return found


def unit_mass():
    """Integral of N_a N_b over a tetrahedron of volume 1: L^p integrates to 3! p! / (|p| + 3)!."""
    integrals = np.empty((10, 10))
    for (a, one), (b, other) in itertools.product(enumerate(MONOMIALS), repeat=2):
        powers = np.bincount(one + other, minlength=4)
        integrals[a, b] = 6 * math.prod(map(math.factorial, powers.tolist())) / math.factorial(7)
    shapes = shape_functions()
    return shapes @ integrals @ shapes.T


def derivatives():
    """dN_a/dL_i (4 points x 10 x 4) at the points of the rule that is exact to degree 2, and so for K."""
    inner, outer = (5 - math.sqrt(5)) / 20, (5 + 3 * math.sqrt(5)) / 20
    shapes, found = shape_functions(), np.zeros((4, 10, 4))
    for point in range(4):
        at = np.where(np.arange(4) == point, outer, inner)
        for m, (i, j) in enumerate(MONOMIALS):
            found[point, :, i] += shapes[:, m] * at[j]
            found[point, :, j] += shapes[:, m] * at[i]
    return found


def assemble(mesh, young, poisson, density, chunk=4000):
    """Node pairs (row, column), their 3 x 3 blocks of K and their masses."""
    lame, shear = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
    steps, mass = derivatives(), unit_mass()
    keys, blocks, masses = [], [], []
    for first in range(0, len(mesh.elements), chunk):
        nodes = mesh.elements[first:first + chunk]
        corner = mesh.nodes[nodes[:, :4]]
        edges = corner[:, 1:] - corner[:, :1]
        volume = np.linalg.det(edges) / 6
        assert volume.min() > 0, "the map turns a tetrahedron over"
        inverse = np.linalg.inv(edges).transpose(0, 2, 1)  # rows: gradients of L_1, L_2, L_3
        gradient = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)
        k = np.zeros((len(nodes), 10, 10, 3, 3))
        for step in steps:
            g = step @ gradient
            outer = np.einsum("eai,ebj->eabij", g, g) * (volume / 4)[:, None, None, None, None]
            k += lame * outer + shear * outer.swapaxes(3, 4)
            k += (shear * np.trace(outer, axis1=3, axis2=4))[..., None, None] * np.eye(3)
        keys.append((nodes[:, None, :] * len(mesh.nodes) + nodes[:, :, None]).ravel())  # column * n + row
        blocks.append(k.reshape(-1, 9))
        masses.append((density * volume[:, None, None] * mass).ravel())
    keys = np.concatenate(keys)
    order = np.argsort(keys, kind="stable")
    keys, starts = np.unique(keys[order], return_index=True)
    blocks = np.add.reduceat(np.concatenate(blocks)[order], starts, axis=0).reshape(-1, 3, 3)
    return keys % len(mesh.nodes), keys // len(mesh.nodes), blocks, np.add.reduceat(np.concatenate(masses)[order], starts)


def write_lower(path, size, comment, row, column, value):
    """Matrix Market, lower triangle, column by column; exact zeros dropped."""
    keep = (row >= column) & (value != 0)
    row, column, value = row[keep], column[keep], value[keep]
    order = np.lexsort((row, column))
    with open(path, "w") as out:
        out.write(f"%%MatrixMarket matrix coordinate real symmetric\n% {comment}\n{size} {size} {len(order)}\n")
        for first in range(0, len(order), 100000):
            part = order[first:first + 100000]
            entries = zip((row[part] + 1).tolist(), (column[part] + 1).tolist(), value[part].tolist())
            out.write("".join([f"{r} {c} {v:.16e}\n" for r, c, v in entries]))
    return len(order)


def mesh_for(dofs):
    """The mesh of nearly cubic cells whose size is closest to `dofs`."""
    top = max(1, round((dofs / 1500) ** (1 / 3))) + 1
    choices = [fine for fine in itertools.product(range(1, top + 1), repeat=3) if max(fine) - min(fine) <= 1]
    cells = len(bracket())
    likely = sorted(choices, key=lambda f: abs(24 * cells * math.prod(f) * 1.15 - dofs))[:6]
    return min((Mesh(fine) for fine in likely), key=lambda mesh: abs(3 * len(mesh.nodes) - dofs))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--dofs", type=int, default=6000, help="about this many degrees of freedom")
    parser.add_argument("--young", type=float, default=2.1e11)
    parser.add_argument("--poisson", type=float, default=0.3)
    parser.add_argument("--density", type=float, default=7850.0)
    args = parser.parse_args()
    began = time.perf_counter()
    mesh = mesh_for(args.dofs)
    row, column, blocks, masses = assemble(mesh, args.young, args.poisson, args.density)
    args.folder.mkdir(parents=True, exist_ok=True)
    name, count, size = args.folder.resolve().name, len(mesh.nodes), 3 * len(mesh.nodes)
    direction = np.arange(3)
    rows, columns = [np.broadcast_to(x, blocks.shape).ravel() for x in
                     (3 * row[:, None, None] + direction[:, None], 3 * column[:, None, None] + direction)]
    stiffness = write_lower(args.folder / "K.mtx", size, f"stiffness of {name}", rows, columns, blocks.ravel())
    rows, columns = [(3 * x[:, None] + direction).ravel() for x in (row, column)]
    mass = write_lower(args.folder / "M.mtx", size, f"consistent mass of {name}", rows, columns, np.repeat(masses, 3))
    write_tables(args.folder, [(i, min(i + 4096, count)) for i in range(0, count, 4096)], lambda i, j: mesh.nodes[i:j])
    write_manifest(args.folder, name, "K.mtx", "M.mtx")
    json.dump({"folder": str(args.folder), "nodes": count, "elements": len(mesh.elements), "dofs": size,
               "stiffness_entries": 2 * stiffness - size, "mass_entries": 2 * mass - size, "mass": float(masses.sum()),
               "seconds": round(time.perf_counter() - began, 2)}, sys.stdout)
    print()


if __name__ == "__main__":
    main()
