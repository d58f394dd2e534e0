#!/usr/bin/env python3
"""Writes hexahedral models of any size for benches and scale tests: K, M, node and DOF tables, manifest.

    pip install numpy                                   (h5py too for --hdf5)
    python benches/make_block.py /tmp/block100k --dofs 100000
    python benches/make_block.py /tmp/plate --shape plate --cells 100 100 2 --gz

A cuboid with one corner in the origin: 8-node trilinear hexahedra, 2 x 2 x 2 Gauss points, consistent mass, isotropic, SI
units. All elements are alike and a node sees one of 27 neighbourhoods (first, inner or last along each axis), so every
matrix value comes from one small table and the assembly is index arithmetic. Values carry 17 significant digits; exact zeros
are dropped, those that only rounding keeps from zero stay, as an FE program leaves them.
"""

import argparse
import contextlib
import gzip
import json
import sys
import time
from pathlib import Path

import numpy as np

SHAPES = {"block": (1.0, 0.2, 0.2), "cube": (0.1, 0.1, 0.1), "plate": (1.0, 1.0, 0.01), "thin-plate": (1.0, 1.0, 0.002)}
CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
OFFSETS = np.array([(x, y, z) for z in (-1, 0, 1) for y in (-1, 0, 1) for x in (-1, 0, 1)])  # ascending node numbers


def element(size, young, poisson, density):
    """Stiffness (24 x 24) and scalar mass (8 x 8) of a brick with the given edge lengths."""
    lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    shear = young / (2 * (1 + poisson))
    elastic = np.diag([shear] * 6)
    elastic[:3, :3] = lame + 2 * shear * np.eye(3)
    stiffness, mass = np.zeros((24, 24)), np.zeros((8, 8))
    volume = np.prod(size) / 8  # of one Gauss point
    signs = 2 * CORNERS - 1
    for point in signs / np.sqrt(3):
        factors = (1 + signs * point) / 2
        shape = factors.prod(axis=1)
        gradient = np.empty((8, 3))
        for k in range(3):
            others = [a for a in range(3) if a != k]
            gradient[:, k] = signs[:, k] / size[k] * factors[:, others].prod(axis=1)
        strain = np.zeros((6, 24))
        for k in range(3):
            strain[k, k::3] = gradient[:, k]
        for row, (k, l) in enumerate([(0, 1), (1, 2), (2, 0)], start=3):
            strain[row, k::3], strain[row, l::3] = gradient[:, l], gradient[:, k]
        stiffness += strain.T @ elastic @ strain * volume
        mass += np.outer(shape, shape) * density * volume
    return (stiffness + stiffness.T) / 2, (mass + mass.T) / 2


def tables(stiffness, mass):
    """Node-to-node blocks by place and offset: 27 x 27 x 3 x 3 for K and M.

    The place of a node is 9 pz + 3 py + px, each 0 first, 1 inner, 2 last; entry [place, offset, a, b] couples direction b of
    the node with direction a of its neighbour. Impossible combinations stay zero.
    """
    k, m = np.zeros((27, 27, 3, 3)), np.zeros((27, 27, 3, 3))
    for place in range(27):
        p = np.array([place % 3, place // 3 % 3, place // 9])
        for own in range(8):  # the node's corner in an element that has it
            if np.any((CORNERS[own] == 1) & (p == 0)) or np.any((CORNERS[own] == 0) & (p == 2)):
                continue
            for other in range(8):
                x, y, z = CORNERS[other] - CORNERS[own]
                offset = 9 * (z + 1) + 3 * (y + 1) + x + 1
                k[place, offset] += stiffness[3 * other:3 * other + 3, 3 * own:3 * own + 3]
                m[place, offset] += mass[other, own] * np.eye(3)
    return k, m


class Grid:
    """Structured nodes, numbered from 0, x fastest."""

    def __init__(self, lengths, cells):
        self.lengths, self.cells = np.array(lengths, float), np.array(cells)
        self.counts = self.cells + 1
        self.nodes = int(self.counts.prod())

    def lattice(self, first, last):
        number = np.arange(first, last)
        x, y = number % self.counts[0], number // self.counts[0] % self.counts[1]
        return np.column_stack([x, y, number // (self.counts[0] * self.counts[1])])

    def positions(self, first, last):
        return self.lattice(first, last) * self.lengths / self.cells

    def columns(self, table, first, last, lower):
        """Column-wise entries of the nodes first..last: row, column, index into the flat table; rows ascending."""
        at = self.lattice(first, last)
        place = np.where(at == 0, 0, np.where(at == self.cells, 2, 1)) @ [1, 3, 9]
        stride = OFFSETS @ [1, self.counts[0], self.counts[0] * self.counts[1]]
        node = np.arange(first, last)[:, None, None, None]  # axes: node, b, offset, a
        a, b = np.arange(3)[None, None, None, :], np.arange(3)[None, :, None, None]
        index = ((place[:, None, None, None] * 27 + np.arange(27)[None, None, :, None]) * 3 + a) * 3 + b
        row = 3 * (node + stride[None, None, :, None]) + a
        column = np.broadcast_to(3 * node + b, row.shape[:1] + (3,) + row.shape[2:])
        row = np.broadcast_to(row, index.shape)
        keep = table.ravel()[index] != 0
        if lower:
            keep &= row >= column
        return row[keep], np.broadcast_to(column, index.shape)[keep], index[keep]

    def chunks(self, size=4096):
        return [(i, min(i + size, self.nodes)) for i in range(0, self.nodes, size)]


def count_entries(grid, table, lower):
    """Stored entries, from the number of nodes of each place."""
    inner = np.maximum(grid.counts - 2, 0)
    along = [np.array([1, inner[k], 1]) for k in range(3)]
    nodes = np.array([along[0][p % 3] * along[1][p // 3 % 3] * along[2][p // 9] for p in range(27)])
    full = int(nodes @ (table != 0).sum(axis=(1, 2, 3)))
    return (full + 3 * grid.nodes) // 2 if lower else full


def write_matrix_market(path, grid, table, comment):
    texts = np.array([f" {v:.16e}\n" for v in table.ravel()], dtype=object)
    opened = gzip.GzipFile(path, "wb", 6, mtime=0) if path.suffix == ".gz" else open(path, "wb")
    with contextlib.closing(opened) as out:
        size = 3 * grid.nodes
        out.write(f"%%MatrixMarket matrix coordinate real symmetric\n% {comment}\n"
                  f"{size} {size} {count_entries(grid, table, True)}\n".encode())
        for first, last in grid.chunks():
            row, column, index = grid.columns(table, first, last, True)
            entries = zip((row + 1).tolist(), (column + 1).tolist(), texts[index].tolist())
            out.write("".join([f"{r} {c}{v}" for r, c, v in entries]).encode())


def write_hdf5(path, grid, matrices):
    """One group per matrix, as scipy users write a CSC matrix: data, indices, indptr, shape; both triangles."""
    import h5py
    with h5py.File(path, "w") as file:
        for name, table in matrices.items():
            entries, size = count_entries(grid, table, False), 3 * grid.nodes
            group = file.create_group(name)
            group["shape"] = np.array([size, size], np.int64)
            data = group.create_dataset("data", (entries,), "f8")
            indices = group.create_dataset("indices", (entries,), "i4" if size < 2 ** 31 else "i8")
            pointer, done = np.zeros(size + 1, np.int64), 0
            for first, last in grid.chunks():
                row, column, index = grid.columns(table, first, last, False)
                data[done:done + len(row)] = table.ravel()[index]
                indices[done:done + len(row)] = row
                pointer[1 + 3 * first:1 + 3 * last] = done + np.cumsum(np.bincount(column - 3 * first, minlength=3 * (last - first)))
                done += len(row)
            group["indptr"] = pointer


def write_tables(folder, chunks, positions):
    """Nodes and DOFs, node by node; `positions(first, last)` gives those of a chunk."""
    with open(folder / "nodes.csv", "w") as nodes, open(folder / "dofs.csv", "w") as dofs:
        nodes.write("node,x,y,z\n")
        dofs.write("node,dir\n")
        for first, last in chunks:
            at = positions(first, last).tolist()
            nodes.write("".join([f"{n},{x!r},{y!r},{z!r}\n" for n, (x, y, z) in enumerate(at, first + 1)]))
            dofs.write("".join([f"{n},1\n{n},2\n{n},3\n" for n in range(first + 1, last + 1)]))


def write_manifest(folder, name, stiffness, mass):
    (folder / "model.toml").write_text(
        f'[model]\nname = "{name}"\n\n[model.units]\nlength = "m"\nmass = "kg"\ntime = "s"\n\n[files]\n'
        f'stiffness = "{stiffness}"\nmass = "{mass}"\nnodes = "nodes.csv"\ndofs = "dofs.csv"\n')


def cells_for(lengths, dofs):
    """Near-cubic cells whose grid has close to `dofs` degrees of freedom; at least two cells along each axis."""
    def cells(edge):
        return np.maximum(2, np.round(np.array(lengths) / edge)).astype(int)
    edges = np.geomspace(max(lengths), max(lengths) / 5000, 20000)
    sizes = np.array([3 * np.prod(cells(edge) + 1) for edge in edges])
    return cells(edges[np.argmin(np.abs(sizes - dofs))])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--shape", choices=SHAPES, default="block", help="lengths of the cuboid in metres: %s" % SHAPES)
    parser.add_argument("--lengths", type=float, nargs=3, metavar=("X", "Y", "Z"), help="other lengths, in metres")
    parser.add_argument("--cells", type=int, nargs=3, metavar=("NX", "NY", "NZ"), help="elements along each axis")
    parser.add_argument("--dofs", type=int, default=3000, help="about this many degrees of freedom (without --cells)")
    parser.add_argument("--young", type=float, default=2.1e11)
    parser.add_argument("--poisson", type=float, default=0.3)
    parser.add_argument("--density", type=float, default=7850.0)
    parser.add_argument("--gz", action="store_true", help="compress the matrices")
    parser.add_argument("--hdf5", action="store_true", help="write matrices.h5 (groups K and M) instead of text")
    args = parser.parse_args()
    began = time.perf_counter()
    lengths = args.lengths or SHAPES[args.shape]
    if min(lengths) <= 0 or (args.cells and min(args.cells) < 1):
        parser.error("lengths and cells must be positive")
    grid = Grid(lengths, args.cells or cells_for(lengths, args.dofs))
    k, m = tables(*element(grid.lengths / grid.cells, args.young, args.poisson, args.density))
    args.folder.mkdir(parents=True, exist_ok=True)
    name = args.folder.resolve().name
    if args.hdf5:
        write_hdf5(args.folder / "matrices.h5", grid, {"K": k, "M": m})
        write_manifest(args.folder, name, "matrices.h5:/K", "matrices.h5:/M")
    else:
        suffix = ".mtx.gz" if args.gz else ".mtx"
        write_matrix_market(args.folder / f"K{suffix}", grid, k, f"stiffness of {name}")
        write_matrix_market(args.folder / f"M{suffix}", grid, m, f"consistent mass of {name}")
        write_manifest(args.folder, name, f"K{suffix}", f"M{suffix}")
    write_tables(args.folder, grid.chunks(), grid.positions)
    json.dump({"folder": str(args.folder), "lengths": list(map(float, lengths)), "cells": grid.cells.tolist(), "nodes": grid.nodes,
               "dofs": 3 * grid.nodes, "stiffness_entries": count_entries(grid, k, False),
               "mass_entries": count_entries(grid, m, False), "mass": args.density * float(np.prod(grid.lengths)),
               "seconds": round(time.perf_counter() - began, 2)}, sys.stdout)
    print()


if __name__ == "__main__":
    main()
