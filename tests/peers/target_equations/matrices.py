"""Chrono and Simscape: K, M and damping in the motions of the interfaces and the amplitudes of internal coordinates. Both are equations of small motions.

Chrono: `ChModalAssembly` (src/chrono_modal/ChModalAssembly.cpp) reduces boundary and internal nodes once more (`ApplyModeAccelerationTransformation`: Psi_S = -K_II^-1 K_IB) and has
gravity of its own (`IntLoadResidual_F`, step 4, `m_modal_automatic_gravity`, on by default): g on the first three coordinates of every node of six, internal ones too; of M g the first three
rows of every node; those of internal nodes go to the boundary by Psi_S.

Simscape: *Reduced Order Flexible Solid*, K, M, C in the six coordinates of each interface frame and the modes; it has no gravity of its own in the file: gravity acts as an
acceleration of the frames, M times the rigid translation.
"""

import csv

import h5py
import numpy as np
import scipy.io
import scipy.linalg

from .oracle import skew


class Matrices:
    """`points`: reference points of the interfaces in the body frame, six coordinates each at the head of the matrices."""

    def __init__(self, k, m, d, points):
        self.k, self.m, self.d, self.points = k, m, d, points
        self.boundary = 6 * len(points)

    def rigid(self):
        """Six rigid motions about the origin of the body frame in the coordinates of the interfaces."""
        out = np.zeros((self.boundary, 6))
        for i, point in enumerate(self.points):
            out[6 * i : 6 * i + 3, :3] = np.eye(3)
            out[6 * i : 6 * i + 3, 3:] = -skew(point)
            out[6 * i + 3 : 6 * i + 6, 3:] = np.eye(3)
        return out

    def static(self, held, load):
        """Motion of the boundary under a load on all coordinates while the interface number `held` stays."""
        free = [i for i in range(len(self.k)) if not 6 * held <= i < 6 * held + 6]
        out = np.zeros_like(load)
        out[free] = np.linalg.solve(self.k[np.ix_(free, free)], load[free])
        return out[: self.boundary]

    def compliance(self, held, loaded):
        load = np.zeros((len(self.k), 6))
        load[6 * loaded : 6 * loaded + 6] = np.eye(6)
        return self.static(held, load)[6 * loaded : 6 * loaded + 6]


class Chrono(Matrices):
    def __init__(self, path):
        read = lambda name: np.asarray(scipy.io.mmread(path.with_suffix(f".{name}.mtx")).todense())
        k, m = read("K"), read("M")
        d = read("R") if path.with_suffix(".R.mtx").exists() else None
        rows = [row for row in csv.reader(line for line in path.read_text().splitlines() if not line.startswith("#"))][1:]
        self.names = [row[0] for row in rows]
        super().__init__(k, m, d, np.array([row[-3:] for row in rows], float))

    def gravity(self, g):
        """Generalised forces on the boundary coordinates and on internal ones, as IntLoadResidual_F collects them."""
        acceleration = np.zeros(len(self.m))
        nodes = len(self.m) // 6
        for i in range(nodes):
            acceleration[6 * i : 6 * i + 3] = g
        whole, kept = self.m @ acceleration, np.zeros(len(self.m))
        for i in range(nodes):
            kept[6 * i : 6 * i + 3] = whole[6 * i : 6 * i + 3]
        return kept

    def gravity_rigid(self, g):
        """Force and moment about the origin of gravity: internal nodes by Psi_S, which follow the boundary."""
        load, b = self.gravity(g), self.boundary
        follow = -np.linalg.solve(self.k[b:, b:], self.k[b:, :b]) if len(self.k) > b else np.zeros((0, b))
        return self.rigid().T @ (load[:b] + follow.T @ load[b:])


class Simscape(Matrices):
    def __init__(self, path):
        if path.suffix == ".mat":
            get = scipy.io.loadmat(path)
            names = [str(name).rstrip() for name in get["frames"]]
            self.axes, self.origin = get["axes"], get["origin"][0]
        else:
            with h5py.File(path) as file:
                get = {name: file[name][()] for name in file if name in ("K", "M", "C", "P0", "axes", "origin")}
                import json

                names = json.loads(file["frames"].asstr()[()])
            self.axes, self.origin = get["axes"], get["origin"].ravel()
        self.names = names
        super().__init__(get["K"], get["M"], get.get("C"), get["P0"])

    def gravity(self, g):
        """M times a rigid translation: internal modes follow the frames only through M."""
        motion = np.zeros(len(self.m))
        for i in range(len(self.points)):
            motion[6 * i : 6 * i + 3] = g
        return self.m @ motion

    def gravity_rigid(self, g):
        return self.rigid().T @ self.gravity(g)[: self.boundary]
