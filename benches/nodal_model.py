"""Models of elements with nodal rotations, assembled and written: K, a general M, node and DOF tables, manifest.

Elements come in groups of equal ones: (nodes, stiffness, mass), a row of nodes for each element and six rows of its matrices for each
of them (ux, uy, uz, rx, ry, rz). Values carry 17 significant digits.
"""

import json
import time

import numpy as np

from make_block import write_manifest
from make_tet10 import write_lower


def assembled(groups, which, size):
    """Rows, columns and values of the sum of the elements' matrices: 0 the stiffness, 1 the mass."""
    keys, values = [], []
    for nodes, *matrices in groups:
        matrix = matrices[which]
        rows = (6 * nodes[:, :, None] + np.arange(6)).reshape(len(nodes), len(matrix))
        keys.append((rows[:, None, :] * size + rows[:, :, None]).ravel())
        values.append(np.broadcast_to(matrix, (len(nodes), *matrix.shape)).ravel())
    keys, values = np.concatenate(keys), np.concatenate(values)
    order = np.argsort(keys, kind="stable")
    keys, starts = np.unique(keys[order], return_index=True)
    return keys % size, keys // size, np.add.reduceat(values[order], starts)


def write_model(folder, points, groups, began):
    """Writes the model into `folder` and prints what it holds, and the seconds since `began`."""
    size = 6 * len(points)
    folder.mkdir(parents=True, exist_ok=True)
    name = folder.resolve().name
    entries = [write_lower(folder / f"{letter}.mtx", size, f"{what} of {name}", *assembled(groups, which, size))
               for which, (letter, what) in enumerate([("K", "stiffness"), ("M", "consistent mass")])]
    numbers = range(1, len(points) + 1)
    (folder / "nodes.csv").write_text("node,x,y,z\n" + "".join([f"{n},{x!r},{y!r},{z!r}\n" for n, (x, y, z) in zip(numbers, points.tolist())]))
    (folder / "dofs.csv").write_text("node,dir\n" + "".join([f"{n},{d}\n" for n in numbers for d in range(1, 7)]))
    write_manifest(folder, name, "K.mtx", "M.mtx")
    print(json.dumps({"folder": str(folder), "nodes": len(points), "dofs": size, "elements": sum(len(group[0]) for group in groups), "stiffness_entries": 2 * entries[0] - size,
                      "mass_entries": 2 * entries[1] - size, "seconds": round(time.perf_counter() - began, 2)}))
