#!/usr/bin/env python3
"""Writes evidence/pages/cutoff.md: what modes up to a frequency miss of the centrifugal response of a curved plate, and what residual vectors leave.

    pip install numpy scipy
    cargo build --release --locked
    python3 evidence/programs/make_cutoff.py
"""

import argparse
import itertools
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import scipy.linalg
import scipy.sparse

ROOT = Path(__file__).resolve().parents[2]
CELLS = (8, 6, 1)
COUNTS = (5, 10, 20, 50)
NODES = [s for s in itertools.product((-1, 0, 1), repeat=3) if s.count(0) <= 1]  # of a 20-node hexahedron
SPINS = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)]
HEAD = """<!-- Written by evidence/programs/make_cutoff.py -->

# Frequency cut-off and residual vectors

A free steel plate of 1 x 0.75 x 0.01 m, bent to an arc of 0.8 rad along its long side: {cells} hexahedra with 20 nodes, {dofs:,} degrees of
freedom, modes from {first:.0f} Hz. It spins about the axes of the model: x along the arc, y straight, z across the plate in its middle. The response is
mostly bending, which the first modes contain, and to about a tenth in-plane stretching, which none of the first fifty modes contains.

Errors (8.13) of the static response to the centrifugal loads in the norm of K, of [theory](../../docs/theory.md#8-modes) section 8. `flexbody` {version}
computes the modes; the exact response is a dense solve by scipy. Written by `./scripts/make.sh pages cutoff`; `crates/body/tests/body/residual_vectors.rs` tests the figures.

"""
TAIL = """
More modes do not help until the first one that stretches the plate; six residual vectors beside ten modes (`--modes 10 --residual-vectors
centrifugal`) remove the whole error, down to the rounding of K in a solution ({floor:.0e}). Errors in products of two spin rates (xy, yz, xz) are of
the same kind: {products}.

`convert` reports the same errors, without and with residual vectors; they agree with those above to {agree:.0e}.
"""


def shapes(xi):
    """Shape functions of the 20 nodes and their gradients."""
    values, gradients = [], []
    for s in NODES:
        f = [(1 - x * x, -2 * x) if a == 0 else ((1 + a * x) / 2, a / 2) for a, x in zip(s, xi)]
        value = f[0][0] * f[1][0] * f[2][0]
        gradient = np.array([f[0][1] * f[1][0] * f[2][0], f[0][0] * f[1][1] * f[2][0], f[0][0] * f[1][0] * f[2][1]])
        if 0 not in s:
            bubble = np.dot(s, xi) - 2
            value, gradient = value * bubble, gradient * bubble + value * np.array(s)
        values.append(value)
        gradients.append(gradient)
    return np.array(values), np.array(gradients)


def hexahedra(cells, place, young=210e9, poisson=0.3, density=7850.0, is_filled=lambda cell: True):
    """Positions, K (dense) and scalar mass of a body of steel; `place` takes points of the lattice (n x 3, in elements) to where they are, `is_filled` is true for the cells of the body."""
    filled = filter(is_filled, itertools.product(*map(range, cells)))
    elements = [[tuple(2 * c + 1 + s for c, s in zip(cell, node)) for node in NODES] for cell in filled]
    number = {place: i for i, place in enumerate(sorted({place for element in elements for place in element}))}
    lattice = np.array(sorted(number)) / 2
    x = place(lattice)
    lame, shear = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
    elastic = np.diag([shear] * 6)
    elastic[:3, :3] = lame + 2 * shear * np.eye(3)
    line = [(-np.sqrt(0.6), 5 / 9), (0.0, 8 / 9), (np.sqrt(0.6), 5 / 9)]
    rule = [(shapes([p[0] for p in points]), np.prod([p[1] for p in points])) for points in itertools.product(line, repeat=3)]
    k, m = np.zeros((3 * len(x), 3 * len(x))), np.zeros((len(x), len(x)))
    for element in elements:
        own = np.array([number[place] for place in element])
        rows = (3 * own[:, None] + np.arange(3)).ravel()
        for (values, reference), weight in rule:
            jacobian = x[own].T @ reference
            weight = weight * np.linalg.det(jacobian)
            gradient = reference @ np.linalg.inv(jacobian)
            strain = np.zeros((6, 60))
            for a in range(3):
                strain[a, a::3] = gradient[:, a]
            for row, (a, b) in enumerate([(0, 1), (1, 2), (2, 0)], start=3):
                strain[row, a::3], strain[row, b::3] = gradient[:, b], gradient[:, a]
            k[np.ix_(rows, rows)] += strain.T @ elastic @ strain * weight
            m[np.ix_(own, own)] += np.outer(values, values) * density * weight
    return x, (k + k.T) / 2, (m + m.T) / 2


def curved(lattice):
    """The plate of the page: an arc along x."""
    angle, radius = 0.8 * (lattice[:, 0] / CELLS[0] - 0.5), 1.25 + 0.01 * (lattice[:, 2] - 0.5)
    return np.column_stack([radius * np.sin(angle), 0.75 * lattice[:, 1] / CELLS[1], radius * np.cos(angle)])


def centrifugal(x, m):
    loads = []
    for a, b in SPINS:
        outward = np.zeros_like(x)
        if a == b:
            outward[:] = x
            outward[:, a] = 0
        else:
            outward[:, a], outward[:, b] = -x[:, b], -x[:, a]
        loads.append((m @ outward).ravel())
    return np.array(loads).T


def save(path, matrix):
    lower = scipy.sparse.coo_matrix(np.tril(matrix))
    with open(path, "w", encoding="ascii") as file:
        print("%%MatrixMarket matrix coordinate real symmetric", file=file)
        print(*matrix.shape, lower.nnz, file=file)
        for i, j, value in zip(lower.row, lower.col, lower.data):
            print(i + 1, j + 1, repr(float(value)), file=file)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    parser.add_argument("--program", default=str(target / "release" / "flexbody"), help="flexbody (default: the release build)")
    parser.add_argument("--output", type=Path, default=ROOT / "evidence/pages/cutoff.md")
    args = parser.parse_args()
    args.program = str(Path(args.program).resolve())  # it runs in another folder
    version = subprocess.run([args.program, "--version"], capture_output=True, text=True, check=True).stdout.split()[-1]
    x, k, m = hexahedra(CELLS, curved)
    x = x - m.sum(axis=0) @ x / m.sum()
    mass = np.kron(m, np.eye(3))
    values, vectors = scipy.linalg.eigh(k, mass)
    flexible, rigid = values[6:], vectors[:, :6]
    loads = centrifugal(x, m)
    balanced = loads - mass @ rigid @ (rigid.T @ loads)
    raised = scipy.linalg.cho_factor(k + flexible[0] * mass @ rigid @ (rigid.T @ mass))
    response = scipy.linalg.cho_solve(raised, balanced)
    energy = (balanced * response).sum(axis=0)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        save(folder / "K.mtx", k)
        save(folder / "M.mtx", mass)
        (folder / "nodes.csv").write_text("node,x,y,z\n" + "".join(f"{i + 1},{a!r},{b!r},{c!r}\n" for i, (a, b, c) in enumerate(x.tolist())))
        errors, after, agree = {}, None, 0.0
        for count in COUNTS:
            command = [args.program, "convert", "--stiffness", "K.mtx", "--mass", "M.mtx", "--nodes", "nodes.csv", "-o", "plate.flex.h5",
                       "--modes", str(count), "--residual-vectors", "centrifugal", "--json"]
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
            if done.returncode != 0:
                sys.exit(f"{' '.join(command)} ended with {done.returncode}:\n{done.stderr}")
            told = json.loads(done.stdout)["results"]["modes"]["truncation"]
            # The first modes are those of scipy: their part of the response.
            modes = vectors[:, 6:6 + count]
            had = ((modes.T @ loads) ** 2 / flexible[:count, None]).sum(axis=0)
            errors[count] = np.sqrt(1 - had / energy)
            agree = max(agree, *(abs(t["before"] / e - 1) for t, e in zip(told, errors[count])))
            if count == 10:
                after = [t["after"] for t in told]
    floor = np.finfo(float).eps * values[-1] / flexible[0]
    lines = ["| modes | residual vectors | spin about x | about y | about z |", "|---|---|---|---|---|"]
    lines += [f"| {count} | | " + " | ".join(f"{100 * e:.1f} %" for e in errors[count][:3]) + " |" for count in COUNTS]
    lines.append("| 10 | 6 | " + " | ".join(f"{e:.0e}" for e in after[:3]) + " |")
    products = "; ".join(f"{count} modes {', '.join(f'{100 * e:.0f} %' for e in errors[count][3:])}" for count in COUNTS)
    products += f"; 10 modes and 6 vectors at most {max(after[3:]):.0e}"
    cells = " x ".join(map(str, CELLS))
    first = np.sqrt(flexible[0]) / (2 * np.pi)
    text = HEAD.format(cells=cells, dofs=len(k), first=first, version=version) + "\n".join(lines) + "\n"
    args.output.write_text(text + TAIL.format(floor=floor, products=products, agree=10.0 ** np.ceil(np.log10(agree))), encoding="utf-8")
    print(args.output)


if __name__ == "__main__":
    main()
