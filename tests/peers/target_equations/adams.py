"""Adams/Flex: the nine invariants with the signs of its manual, put into the mass matrix of its Lagrange equations (*Theoretical background* of Adams/Flex).

    M_tt = I1, M_tr = -[I2 + I3 q]~, M_tm = I3, M_rr = I7 - (I8_j + I8_j') q_j - I9_jk q_j q_k, M_rm = I4 + I5_j q_j, M_mm = I6

and M x'' + M' x' - (dM/dx x')' x' / 2 + K q + D q' = Q. A force and a moment act through translation and (small) rotation of a frame.
"""

import json
import re

import numpy as np

from .equations import Equations, Place, assemble, lagrange


def values(entry):
    return np.array(entry["values"], float).reshape(entry["shape"])


class Adams(Equations):
    ARRAYS = {"i1": "m", "i2": "mL", "i3": "s", "i4": "sL", "i5": "1", "i6": "1", "i7": "mL2", "i8": "sL", "i9": "1", "k": "own", "d": "own"}

    def __init__(self, path):
        document = json.loads(path.read_text())
        get = {entry["name"]: values(entry) for entry in document["quantities"] if entry["values"] is not None}
        self.load(get)
        frames = document["frames"]
        self.places = {}
        for i, one in enumerate(frames):
            rotation = one.get("rotation")
            self.places[i] = Place(np.array(one["position"]), np.array(one["translation"]), None if rotation is None else np.array(rotation))
        self.finish([one["node"] for one in frames])

    def load(self, get):
        self.i1, self.i2, self.i3, self.i4, self.i5 = float(np.squeeze(get["I1"])), get["I2"], get["I3"], get["I4"], get["I5"]
        self.i6, self.i7, self.i8, self.i9 = get["I6"], get["I7"], get["I8"], get["I9"]
        self.k, self.modes = get["K"], len(get["K"])
        self.d = get.get("D", np.zeros_like(self.k))

    def finish(self, nodes):
        self.ids = np.array(nodes)
        places = list(self.places.values())
        self.positions = np.array([place.position for place in places])
        self.shape = np.array([place.translation for place in places])
        still = np.zeros((3, self.modes))
        self.rotation = np.array([still if place.rotation is None else place.rotation for place in places])

    def mass(self, q):
        eight = np.einsum("jab,j->ab", self.i8, q)
        inertia = self.i7 - eight - eight.T - np.einsum("jkab,j,k->ab", self.i9, q, q)
        return assemble(self.i1, self.i2 + self.i3 @ q, self.i3, inertia, self.i4 + np.einsum("jak,j->ak", self.i5, q), self.i6)

    def velocity_forces(self, q, w, qd):
        return lagrange(self.mass, q, w, qd, np.sqrt(np.trace(self.i7)))

    def elastic(self, q, qd):
        return self.k @ q + self.d @ qd

    def gravity(self, q, g):
        return np.concatenate([self.i1 * g, np.cross(self.i2 + self.i3 @ q, g), self.i3.T @ g])


class AdamsText(Adams):
    """The dialect `text` has a line with name and extents before the numbers of each quantity."""

    def __init__(self, path):
        get, places, nodes, target = {}, {}, [], None
        for line in path.read_text().splitlines():
            words = line.split()
            if not words or line.startswith("#"):
                continue
            if re.fullmatch(r"(I[1-9]|K|D|translation|rotation)( \d+)+", line.strip()):
                target = [], tuple(int(word) for word in words[1:])
                if words[0] in ("translation", "rotation"):
                    setattr(places[len(nodes) - 1], words[0], target)
                else:
                    get[words[0]] = target
            elif words[0] == "frame":
                nodes.append(int(words[1]))
                places[len(nodes) - 1] = Place(np.array(words[2:5], float), None)
            elif words != ["none"]:
                target[0].extend(float(word) for word in words)
        whole = lambda target: None if target is None else np.array(target[0]).reshape(target[1])
        self.load({name: whole(target) for name, target in get.items()})
        for place in places.values():
            place.translation, place.rotation = whole(place.translation), whole(place.rotation)
        self.places = places
        self.finish(nodes)
