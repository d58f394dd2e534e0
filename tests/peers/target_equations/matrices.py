"""Chrono and Simscape: K, M and damping in the motions of the interfaces and the amplitudes of internal coordinates. Both are equations of small motions.

Chrono: `ChModalAssembly` (src/chrono_modal/ChModalAssembly.cpp) reduces boundary and internal nodes once more (`ApplyModeAccelerationTransformation`, CRAIG_BAMPTON without static
correction): Psi_S = -K_II^-1 K_IB, and the lowest modes Psi_D of the internal nodes, as many as are requested. Its automatic gravity (`IntLoadResidual_F`, step 4, on by default) puts g on the
first three coordinates of every node of six, internal ones too, and keeps the first three rows of M g for every node. Forces on internal nodes act on the boundary through Psi_S and on the
modes through Psi_D (step 5).

Simscape: *Reduced Order Flexible Solid*, K, M, C in the six coordinates of each interface frame and the modes. Gravity acts as an acceleration of the frames: M times the rigid translation.
"""

import csv
import json
import re

import h5py
import numpy as np
import scipy.io
import scipy.linalg

from .oracle import skew


class Matrices:
    """K, M and damping. The first coordinates are six for each interface, whose reference points in the body frame are `points`."""

    def __init__(self, k, m, d, points):
        self.k, self.m, self.d, self.points = k, m, d, points
        self.boundary = 6 * len(points)

    def rigid(self):
        """Returns the six rigid motions about the origin of the body frame in the coordinates of the interfaces."""
        out = np.zeros((self.boundary, 6))
        for i, point in enumerate(self.points):
            out[6 * i : 6 * i + 3, :3] = np.eye(3)
            out[6 * i : 6 * i + 3, 3:] = -skew(point)
            out[6 * i + 3 : 6 * i + 6, 3:] = np.eye(3)
        return out

    def gravity_rigid(self, g):
        """Returns force and moment of gravity about the origin: its generalised forces on rigid motions of the interfaces."""
        return self.rigid().T @ self.gravity(g)[: self.boundary]

    def static(self, held, load):
        """Returns the motion of all interfaces under a load on all coordinates with interface number `held` fixed."""
        free = [i for i in range(len(self.k)) if not 6 * held <= i < 6 * held + 6]
        out = np.zeros_like(load)
        out[free] = np.linalg.solve(self.k[np.ix_(free, free)], load[free])
        return out[: self.boundary]

    def compliance(self, held, loaded):
        """Returns the motion of interface `loaded` under unit loads there with interface `held` fixed."""
        load = np.zeros((len(self.k), 6))
        load[6 * loaded : 6 * loaded + 6] = np.eye(6)
        return self.static(held, load)[6 * loaded : 6 * loaded + 6]


class Chrono(Matrices):
    def __init__(self, path):
        read = lambda name: np.asarray(scipy.io.mmread(path.with_suffix(f".{name}.mtx")).todense())
        # M, K and R of boundary and internal nodes.
        self.file_k, self.file_m = read("K"), read("M")
        self.file_d = read("R") if path.with_suffix(".R.mtx").exists() else None
        lines = path.read_text().splitlines()
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
        self.names = [row["name"] for row in rows]
        self.points = np.array([[row[axis] for axis in "xyz"] for row in rows], float)
        self.requested = int(re.search(r"modes to request: (\d+)", "".join(lines))[1])
        self.assemble()

    def assemble(self):
        """Reduces the matrices as Chrono does."""
        b = 6 * len(self.points)
        k, m = self.file_k, self.file_m
        follow = -np.linalg.solve(k[b:, b:], k[b:, :b])
        # Largest reciprocal eigenvalues: coordinates may have no mass.
        _, modes = scipy.linalg.eigh((m[b:, b:] + m[b:, b:].T) / 2, (k[b:, b:] + k[b:, b:].T) / 2)
        modes = modes[:, ::-1][:, : self.requested]
        self.reduction = np.block([[np.eye(b), np.zeros((b, self.requested))], [follow, modes]])
        reduced = lambda matrix: None if matrix is None else self.reduction.T @ matrix @ self.reduction
        super().__init__(reduced(k), reduced(m), reduced(self.file_d), self.points)

    def gravity(self, g):
        """Returns the generalised forces of gravity on boundary coordinates and modes, as IntLoadResidual_F collects them."""
        size = len(self.file_m)
        moved = np.where(np.arange(size) % 6 < 3, np.tile(np.concatenate([g, np.zeros(3)]), size // 6), 0.0)
        whole = self.file_m @ moved
        return self.reduction.T @ np.where(np.arange(size) % 6 < 3, whole, 0.0)


class Simscape(Matrices):
    def __init__(self, path):
        if path.suffix == ".mat":
            get = scipy.io.loadmat(path)
            names = [str(name).rstrip() for name in get["frames"]]
            self.axes, self.origin = get["axes"], get["origin"][0]
        else:
            with h5py.File(path) as file:
                get = {name: file[name][()] for name in file if name in ("K", "M", "C", "P0", "axes", "origin")}
                names = json.loads(file["frames"].asstr()[()])
            self.axes, self.origin = get["axes"], get["origin"].ravel()
        self.names = names
        super().__init__(get["K"], get["M"], get.get("C"), get["P0"])

    def gravity(self, g):
        """Returns M times the rigid translation by g."""
        motion = np.zeros(len(self.m))
        for i in range(len(self.points)):
            motion[6 * i : 6 * i + 3] = g
        return self.m @ motion
