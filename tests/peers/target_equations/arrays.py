"""npz and json: the arrays of the flex-body file, with the equations of docs/theory.md: (3.1) to (3.5) of a solid, (6.2), (6.3) and (7.4) of any other mass."""

import json

import numpy as np

from .equations import Equations, Place, assemble, lagrange

SPIN = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "yz": (1, 2), "xz": (0, 2)}


class Arrays(Equations):
    """`arrays` maps paths to arrays, `attributes` groups to their attributes."""

    ARRAYS = {"m": "m", "c": "mL", "i0": "mL2", "c1": "s", "c2": "sL", "w1": "sL", "w2": "1", "w3": "1", "mff": "1", "kff": "own", "d": "own"}

    def __init__(self, arrays, attributes):
        get = self.arrays = arrays
        self.general = attributes["source"]["mass_structure"] == "general"
        self.m, self.c, self.i0 = float(get["invariants/mass"][0]), get["invariants/first_moment"], get["invariants/I0"]
        self.c1, self.c2, self.mff, self.kff = (get[f"invariants/{name}"] for name in ("C1", "C2", "modal_mass", "modal_stiffness"))
        nf = self.modes = len(self.mff)
        # Axis, axis, mode, ...: W1[a, b, j], W2[a, b, i, j], W3[a, i, j].
        self.w1 = get["invariants/W1"].reshape(3, 3, nf)
        self.w2 = get["invariants/W2"].reshape(3, nf, 3, nf).transpose(0, 2, 1, 3)
        self.w3 = get["invariants/W3"].reshape(3, nf, nf)
        self.d = get.get("invariants/modal_damping", np.zeros((nf, nf)))
        self.shape = get["modes/shape"].transpose(1, 2, 0)
        rotation = get.get("modes/rotation")
        self.rotation = None if rotation is None else rotation.transpose(1, 2, 0)
        self.ids, self.positions = get["nodes/id"], get["nodes/position"]
        self.places = {}
        for name in sorted({path.split("/")[1] for path in get if path.startswith("interfaces/")}):
            at = lambda what: get.get(f"interfaces/{name}/{what}")
            self.places[name] = Place(at("reference"), at("translation"), at("rotation"))
        # Matrices of inertia and of stress act alike: (6.2b) and (7.4).
        self.stiffening = [(path.split("/")[1], get[path]) for path in get if path.startswith(("inertia_stiffness/", "geometric_stiffness/"))]
        self.order = "first" if self.general else "exact"

    def blocks(self, q):
        s, inertia, coupling = self.c + self.c1 @ q, self.i0 + self.w1 @ q + np.einsum("i,abij,j->ab", q, self.w2, q), self.c2 + np.einsum("i,aij->aj", q, self.w3)
        inertia, c1 = (inertia + inertia.T) / 2, self.c1.copy()
        for name, k in self.stiffening:
            kind, axis = name.rsplit("_", 1)
            if kind == "acceleration":
                s["xyz".index(axis)] += q @ k @ q / 2
                c1["xyz".index(axis)] += q @ k
            elif kind == "angular_acceleration":
                coupling["xyz".index(axis)] += q @ k
            else:
                a, b = SPIN[axis]
                inertia[a, b] -= q @ k @ q / (1 if a == b else 2)
                inertia[b, a] = inertia[a, b]
        return s, c1, inertia, coupling

    def mass(self, q):
        s, c1, inertia, coupling = self.blocks(q)
        return assemble(self.m, s, c1, inertia, coupling, self.mff)

    def velocity_forces(self, q, w, qd):
        if self.general or self.stiffening:
            return lagrange(self.mass, q, w, qd, np.sqrt(np.trace(self.i0)))
        s, _, inertia, coupling = self.blocks(q)
        cross = np.cross
        h_r = cross(w, cross(w, s)) + 2 * cross(w, self.c1 @ qd)
        rate = self.w1 @ qd + np.einsum("i,abij,j->ab", q, self.w2, qd) + np.einsum("i,abij,j->ab", qd, self.w2, q)
        h_t = cross(w, inertia @ w) + rate @ w + cross(w, coupling @ qd)
        h_f = -np.einsum("a,abj,b->j", w, self.w1, w) / 2 - np.einsum("a,abij,j,b->i", w, self.w2, q, w) + 2 * np.einsum("aij,i,a->j", self.w3, qd, w)
        return np.concatenate([h_r, h_t, h_f])

    def elastic(self, q, qd):
        return self.kff @ q + self.d @ qd

    def gravity(self, q, g):
        s, c1, _, _ = self.blocks(q)
        return np.concatenate([self.m * g, np.cross(s, g), c1.T @ g])


def npz(path):
    with np.load(path, allow_pickle=False) as archive:
        about = json.loads(archive["metadata"].item())
        return Arrays({name: archive[name] for name in archive.files if name != "metadata"}, about["attributes"])


def read_json(path):
    document = json.loads(path.read_text())
    return Arrays({name: np.array(entry["values"]).reshape(entry["shape"]) for name, entry in document["arrays"].items()}, document["attributes"])
