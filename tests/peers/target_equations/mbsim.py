"""MBSim: `GenericFlexibleFfrBody::assemble` and `updateMb` (generic_flexible_ffr_body.cc), from the integrals that `ExternalFlexibleFfrBody` reads.

Forces and moments at nodes act through Phi and Psi of the node (`updateJacobians` of nodes): the moment on small rotations.
"""

import h5py
import numpy as np

from .equations import Equations, Place, assemble


class Mbsim(Equations):
    ARRAYS = {"m": "m", "rdm": "mL", "rrdm": "mL2", "pdm": "s", "rpdm": "sL", "pp": "1", "ke": "own", "de": "own"}

    def __init__(self, path):
        with h5py.File(path) as file:
            get = lambda name: np.array(file[name][()], float)
            self.m, self.rdm, self.rrdm, self.pdm = float(np.squeeze(get("mass"))), get("position integral").ravel(), get("position position integral"), get("shape function integral")
            nf = self.modes = self.pdm.shape[1]
            self.rpdm = get("position shape function integral").reshape(3, 3, nf)
            upper = get("shape function shape function integral").reshape(6, nf, nf)
            self.ke = get("stiffness matrix")
            self.de = get("damping matrix") if "damping matrix" in file else np.zeros((nf, nf))
            self.ids = file["node numbers"][()].astype(int).ravel()
            self.positions = get("nodal relative position").reshape(-1, 3)
            self.shape = get("nodal shape matrix of translation").reshape(-1, 3, nf)
            turning = "nodal shape matrix of rotation" in file
            self.rotation = get("nodal shape matrix of rotation").reshape(-1, 3, nf) if turning else None
        # PPdm[j][i] = PPdm[i][j]' (external_flexible_ffr_body.cc).
        self.pp = np.zeros((3, 3, nf, nf))
        for (a, b), block in zip([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)], upper):
            self.pp[a, b] = block
            if a != b:
                self.pp[b, a] = block.T
        self.assemble()
        # A node that turns in no mode has no rotation.
        turn = lambda i: self.rotation[i] if turning and np.abs(self.rotation[i]).max() > 0 else None
        self.places = {number: Place(self.positions[i], self.shape[i], turn(i)) for i, number in enumerate(self.ids)}

    def assemble(self):
        pp, rp, nf = self.pp, self.rpdm, self.modes
        # `Me.ej(i, j)` and the blocks of `mmi2` with j >= i are read; the others mirror them.
        upper = lambda block: np.triu(block) + np.triu(block, 1).T
        self.me = upper(pp[0, 0] + pp[1, 1] + pp[2, 2])
        self.mmi0 = np.trace(self.rrdm) * np.eye(3) - self.rrdm
        self.mmi1 = np.zeros((3, 3, nf))
        self.gr0 = np.zeros((3, 3, nf))
        mmi2 = np.zeros((3, 3, nf, nf))
        for a in range(3):
            for b in range(3):
                others = [c for c in range(3) if c != a]
                if a == b:
                    self.mmi1[a, a] = 2 * sum(rp[c, c] for c in others)
                    self.gr0[a, a] = 2 * sum(rp[c, c] for c in others)
                    mmi2[a, a] = sum(pp[c, c] for c in others)
                else:
                    self.mmi1[a, b] = -(rp[a, b] + rp[b, a])
                    self.gr0[a, b] = -2 * rp[b, a]
                    mmi2[a, b] = -pp[b, a]
        keep = np.triu(np.ones((nf, nf)))
        lower = np.tril(np.ones((nf, nf)), -1)
        self.mmi2 = mmi2 * keep + mmi2.transpose(1, 0, 3, 2) * lower
        self.cr0 = np.array([rp[1, 2] - rp[2, 1], rp[2, 0] - rp[0, 2], rp[0, 1] - rp[1, 0]])
        self.kr = np.array([-pp[1, 2] + pp[1, 2].T, -pp[2, 0] + pp[2, 0].T, -pp[0, 1] + pp[0, 1].T])
        self.oe0 = np.array([-rp[2, 2] - rp[1, 1], -rp[2, 2] - rp[0, 0], -rp[1, 1] - rp[0, 0], rp[0, 1] + rp[1, 0], rp[1, 2] + rp[2, 1], rp[2, 0] + rp[0, 2]])
        symmetric = lambda block: block + block.T
        self.oe1 = np.array([-pp[1, 1] - pp[2, 2], -pp[2, 2] - pp[0, 0], -pp[0, 0] - pp[1, 1], symmetric(pp[0, 1]), symmetric(pp[1, 2]), symmetric(pp[2, 0])])

    def blocks(self, q):
        inertia = self.mmi0 + self.mmi1 @ q + np.einsum("abij,i,j->ab", self.mmi2, q, q)
        # `SymMat3(I2)` takes the lower triangle.
        inertia = np.tril(inertia) + np.tril(inertia, -1).T
        return self.rdm + self.pdm @ q, inertia, self.cr0 + self.kr @ q

    def mass(self, q):
        s, inertia, coupling = self.blocks(q)
        return assemble(self.m, s, self.pdm, inertia, coupling, self.me)

    def velocity_forces(self, q, w, qd):
        s, inertia, _ = self.blocks(q)
        # Gr1[j][i] = 2 mmi2[j][i]
        rate = self.gr0 @ qd + 2 * np.einsum("abji,j,i->ab", self.mmi2, q, qd)
        squares = np.array([w[0] ** 2, w[1] ** 2, w[2] ** 2, w[0] * w[1], w[1] * w[2], w[0] * w[2]])
        force = np.cross(w, np.cross(w, s)) + 2 * np.cross(w, self.pdm @ qd)
        moment = rate @ w + np.cross(w, inertia @ w)
        modal = 2 * np.einsum("aij,j,a->i", self.kr, qd, w) + (self.oe0 + self.oe1 @ q).T @ squares
        return np.concatenate([force, moment, modal])

    def elastic(self, q, qd):
        return self.ke @ q + self.de @ qd

    def gravity(self, q, g):
        s = self.rdm + self.pdm @ q
        return np.concatenate([self.m * g, np.cross(s, g), self.pdm.T @ g])
