"""What the peer scripts share: reading a model folder, timing phases, peak memory, residuals, one JSON object as result."""

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
    """K, M (CSR, rows node by node, x y z) and node positions (n x 3), in the order of dofs.csv."""
    folder = Path(folder)
    files = tomllib.loads((folder / "model.toml").read_text())["files"]
    stiffness, mass = read_matrix(folder, files["stiffness"]), read_matrix(folder, files["mass"])
    with open(folder / files["nodes"]) as table:
        position = {int(r["node"]): (float(r["x"]), float(r["y"]), float(r["z"])) for r in csv.DictReader(table)}
    with open(folder / files["dofs"]) as table:
        labels = [(int(r["node"]), int(r["dir"])) for r in csv.DictReader(table)]
    nodes = list(dict.fromkeys(node for node, _ in labels))
    assert labels == [(n, d) for n in nodes for d in (1, 2, 3)], "rows must run node by node, x y z"
    return stiffness, mass, np.array([position[n] for n in nodes])


def residual(stiffness, mass, values, vectors):
    """Largest ||K v - lambda M v|| / (||K v|| + lambda ||M v||)."""
    elastic, inertial = stiffness @ vectors, (mass @ vectors) * values
    norms = [np.linalg.norm(x, axis=0) for x in (elastic - inertial, elastic, inertial)]
    return float((norms[0] / (norms[1] + norms[2])).max())


def report(program, versions, folder, stiffness, modes, phases, peak, values, worst):
    total = sum(p["cpu_s"] for p in phases.found.values())
    print(json.dumps({
        "program": program, "versions": versions, "python": platform.python_version(), "model": str(folder),
        "dofs": stiffness.shape[0], "stiffness_entries": int(stiffness.nnz), "modes": modes,
        "cores": len(os.sched_getaffinity(0)), "omp_num_threads": os.environ.get("OMP_NUM_THREADS"),
        "phases": phases.found, "cpu_s": round(total, 3), "peak_rss_mib": round(peak, 1),
        "frequencies_hz": [round(float(f), 9) for f in np.sqrt(np.maximum(values, 0)) / (2 * np.pi)],
        "residual_max": worst,
    }, indent=1))
