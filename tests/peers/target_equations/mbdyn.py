"""MBDyn: `Modal::AssRes` (mbdyn/struct/modal.cc) and, for record group 19, `ModalAd::AssRes` (modalad.cc), from the .fem file that the modal joint reads.

Groups 14 to 18 are read row by row. Forces and moments act through the constraints of the interface nodes: the moment on small rotations PHIr q.
"""

import numpy as np

from .equations import Equations, Place, assemble
from .oracle import skew

# Products of angular velocities that indices 1 to 6 of group 19 belong to.
SQUARES = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)]


def groups(text):
    """Returns the words of every record group without comment lines."""
    found, number = {}, None
    for line in text.splitlines():
        if line.startswith("** RECORD GROUP"):
            number = int(line.split()[3].rstrip(","))
            found[number] = []
        elif not line.startswith("**") and number is not None:
            found[number] += line.split()
    return found


class Mbdyn(Equations):
    ARRAYS = {"m": "m", "inv2": "mL", "inv7": "mL2", "inv3": "s", "inv4": "sL", "inv5": "1", "inv8": "sL", "inv9": "1", "mff": "1", "kff": "own", "d": "own"}

    def __init__(self, path):
        record = groups(path.read_text())
        n, nf = int(record[1][1]), sum(int(word) for word in record[1][2:5])
        self.modes = nf
        get = lambda number: np.array(record[number], float)
        self.labels = record[2]
        self.positions = np.stack([get(5), get(6), get(7)], 1)
        modes = get(8).reshape(nf, n, 6)
        self.shape, self.rotation = modes[:, :, :3].transpose(1, 2, 0), modes[:, :, 3:].transpose(1, 2, 0)
        self.mff, self.kff = get(9).reshape(nf, nf), get(10).reshape(nf, nf)
        self.d = get(13).reshape(nf, nf) if 13 in record else np.zeros((nf, nf))
        inertia = get(12)
        self.m, centre = inertia[0], inertia[1:4]
        self.inv2 = self.m * centre
        # JTmp = JTmpIn - XTmpIn~ XTmpIn~ dMass: about the origin.
        self.inv7 = inertia[4:].reshape(3, 3) - self.m * skew(centre) @ skew(centre)
        zeros = lambda *shape: np.zeros(shape)
        # Without groups 14 to 18 rigid motion and modes are not coupled: small motions of a body that does not spin.
        self.order = "exact" if 14 in record else "small"
        if 14 not in record:
            self.ARRAYS = {name: kind for name, kind in self.ARRAYS.items() if name not in ("inv5", "inv8", "inv9")}
        self.inv3 = get(14).reshape(3, nf) if 14 in record else zeros(3, nf)
        self.inv4 = get(15).reshape(3, nf) if 15 in record else zeros(3, nf)
        # Axis, mode, axis; axis, mode, mode; axis, mode, mode, axis.
        self.inv8 = get(16).reshape(3, nf, 3) if 16 in record else zeros(3, nf, 3)
        self.inv5 = get(17).reshape(3, nf, nf) if 17 in record else zeros(3, nf, nf)
        self.inv9 = get(18).reshape(3, nf, nf, 3) if 18 in record else zeros(3, nf, nf, 3)
        self.stiffening = {}
        if 19 in record:
            words = record[19]
            for i in range(int(words[0])):
                at = 1 + i * (1 + nf * nf)
                self.stiffening[int(words[at])] = np.array(words[at + 1 : at + 1 + nf * nf], float).reshape(nf, nf)
        turn = lambda i: self.rotation[i] if np.abs(self.rotation[i]).max() > 0 else None
        self.places = {label: Place(self.positions[i], self.shape[i], turn(i)) for i, label in enumerate(self.labels)}
        self.ids = np.array([int(label) if label.isdigit() else -1 for label in self.labels])

    def blocks(self, q):
        eight = np.einsum("ajb,j->ab", self.inv8, q)
        inertia = self.inv7 + eight + eight.T - np.einsum("ajkb,j,k->ab", self.inv9, q, q)
        return self.inv2 + self.inv3 @ q, inertia, self.inv4 + np.einsum("ajk,j->ak", self.inv5, q)

    def softening(self, indices, q):
        """Returns the matrices of group 19 with the given indices, times q."""
        zero = np.zeros(self.modes)
        return np.array([self.stiffening[i] @ q if i in self.stiffening else zero for i in indices])

    def mass(self, q):
        s, inertia, coupling = self.blocks(q)
        out = assemble(self.m, s, self.inv3, inertia, coupling, self.mff)
        # Stiffness of inertia and geometric stiffness act in the equations of the modes only.
        out[6:, 3:6] += self.softening((7, 8, 9), q).T
        out[6:, :3] += self.softening((10, 11, 12), q).T
        return out

    def velocity_forces(self, q, w, qd):
        s, inertia, _ = self.blocks(q)
        force = np.cross(w, np.cross(w, s)) + 2 * np.cross(w, self.inv3 @ qd)
        rate = np.einsum("ajb,j->ab", self.inv8, qd) - np.einsum("ajkb,j,k->ab", self.inv9, q, qd)
        moment = np.cross(w, inertia @ w) + 2 * rate @ w
        coriolis = 2 * np.einsum("ajk,j,a->k", self.inv5, qd, w)
        # Inv8' and Inv9 of the mode.
        spin = np.einsum("bja,a,b->j", self.inv8, w, w) - np.einsum("ajkb,k,a,b->j", self.inv9, q, w, w)
        products = np.array([w[a] * w[b] for a, b in SQUARES])
        modal = coriolis - spin + products @ self.softening(range(1, 7), q)
        return np.concatenate([force, moment, modal])

    def elastic(self, q, qd):
        return self.kff @ q + self.d @ qd

    def gravity(self, q, g):
        modal = self.inv3.T @ g + g @ self.softening((10, 11, 12), q)
        return np.concatenate([self.m * g, np.cross(self.inv2 + self.inv3 @ q, g), modal])
