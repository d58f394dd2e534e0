"""What the peer scripts share: reading a model folder, timing phases, peak memory, shift, residuals, one JSON object as result."""

import contextlib
import csv
import gzip
import json
import os
import platform
import resource
import time
import tomllib
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse as sp

PACKED = "peers.npz"


class Phases:
    """CPU seconds (user + system, children included) and wall seconds of each named phase."""

    def __init__(self):
        self.found = {}

    @contextlib.contextmanager
    def phase(self, name):
        cpu, wall = cpu_seconds(), time.perf_counter()
        yield
        self.found[name] = {"cpu_s": round(cpu_seconds() - cpu, 3), "wall_s": round(time.perf_counter() - wall, 3)}


def cpu_seconds():
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in used)


def peak_mib():
    """Largest resident size so far: VmHWM, as ru_maxrss also counts the process that started this one."""
    with contextlib.suppress(OSError):
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def read_matrix(folder, name):
    if ".h5:" in name:
        import h5py
        file, group = name.split(":")
        with h5py.File(folder / file) as store:
            stored = store[group]
            arrays = stored["data"][:], stored["indices"][:], stored["indptr"][:]
            return sp.csc_matrix(arrays, shape=tuple(stored["shape"][:])).tocsr()
    opened = gzip.open(folder / name) if name.endswith(".gz") else folder / name
    return sp.csr_matrix(scipy.io.mmread(opened))


def read_model(folder):
    """K, M (CSR, rows node by node, x y z) and node positions (n x 3), in the order of dofs.csv; from peers.npz where pack.py made it."""
    folder = Path(folder)
    if (folder / PACKED).exists():
        with np.load(folder / PACKED) as stored:
            matrices = [sp.csr_matrix(tuple(stored[f"{name}_{part}"] for part in ("data", "indices", "indptr"))) for name in "KM"]
            return *matrices, stored["positions"]
    files = tomllib.loads((folder / "model.toml").read_text())["files"]
    stiffness, mass = read_matrix(folder, files["stiffness"]), read_matrix(folder, files["mass"])
    with open(folder / files["nodes"]) as table:
        position = {int(r["node"]): (float(r["x"]), float(r["y"]), float(r["z"])) for r in csv.DictReader(table)}
    return stiffness, mass, np.array([position[n] for n in node_order(folder)])


def node_order(folder):
    """Node numbers in the order of the matrix rows."""
    files = tomllib.loads((Path(folder) / "model.toml").read_text())["files"]
    with open(Path(folder) / files["dofs"]) as table:
        labels = [(int(r["node"]), int(r["dir"])) for r in csv.DictReader(table)]
    nodes = list(dict.fromkeys(node for node, _ in labels))
    assert labels == [(n, d) for n in nodes for d in (1, 2, 3)], "rows must run node by node, x y z"
    return nodes


def shift_estimate(stiffness, mass, positions):
    """-0.3 times an upper bound of the first flexible eigenvalue: the best Rayleigh quotient of nine simple deformations.

    Stretch along each axis, and bending of each axis a into another one b (u_b = a^2, u_a = -2 a b), less their rigid part.
    """
    r = positions - positions.mean(axis=0)
    trials, rigid = [], []
    for a in range(3):
        stretch, shift, turn = np.zeros_like(r), np.zeros_like(r), np.zeros_like(r)
        b, c = (a + 1) % 3, (a + 2) % 3
        stretch[:, a], shift[:, a], turn[:, b], turn[:, c] = r[:, a], 1.0, -r[:, c], r[:, b]
        trials.append(stretch)
        rigid += [shift, turn]
        for across in (b, c):
            bend = np.zeros_like(r)
            bend[:, across], bend[:, a] = r[:, a] ** 2, -2 * r[:, a] * r[:, across]
            trials.append(bend)
    trials, rigid = [np.array(v).reshape(len(v), -1).T for v in (trials, rigid)]
    trials = trials - rigid @ np.linalg.solve(rigid.T @ (mass @ rigid), rigid.T @ (mass @ trials))
    quotients = np.sum(trials * (stiffness @ trials), axis=0) / np.sum(trials * (mass @ trials), axis=0)
    return -0.3 * quotients.min()


def residual(stiffness, mass, values, vectors):
    """Largest ||K v - lambda M v|| / ||K v||, and what rounding K v alone can make of it: eps || |K| |v| || / ||K v||."""
    elastic = stiffness @ vectors
    scale = np.linalg.norm(elastic, axis=0)
    left = np.linalg.norm(elastic - (mass @ vectors) * values, axis=0)
    rounding = np.finfo(float).eps * np.linalg.norm(abs(stiffness) @ abs(vectors), axis=0)
    return {"residual_max": float((left / scale).max()), "residual_floor": float((rounding / scale).max())}


def report(program, versions, folder, stiffness, modes, phases, peak, values, residuals):
    total = sum(p["cpu_s"] for p in phases.found.values())
    print(json.dumps({
        "program": program, "versions": versions, "python": platform.python_version(), "model": str(folder),
        "dofs": stiffness.shape[0], "stiffness_entries": int(stiffness.nnz), "modes": modes,
        "cores": len(os.sched_getaffinity(0)), "omp_num_threads": os.environ.get("OMP_NUM_THREADS"),
        "phases": phases.found, "cpu_s": round(total, 3), "peak_rss_mib": round(peak, 1),
        "frequencies_hz": [float(f) for f in np.sqrt(np.maximum(values, 0)) / (2 * np.pi)],
        **residuals,
    }, indent=1))
