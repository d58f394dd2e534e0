"""OpenRadioss: the data file of `/FXBODY` as `FXBODFP1`, `FXBODFP2` and `FXBMAJP2` (engine, fxbodfp.F) and `FXBODVP1` (fxbodvp.F) use it.

Unknown are the accelerations of the ends of the body axes and of their origin (rigid modes) and q'': (global mass) p'' + MC(A) q'' = forces. What ties the four points to
one rigid frame (`FXLINK`) is taken here as p_I'' = a + alpha x e_I + w x (w x e_I). The engine has no terms of w with q or q' at all: its equations are those of the
body at q = q' = 0. Gravity acts on masses that the deck gives to the nodes, which are not in the file.
"""

import re

import numpy as np

from .equations import Equations, Place


def numbers(lines):
    """Returns the numbers of fields of 16 columns. Exponents may lack their letter."""
    found = []
    for line in lines:
        for at in range(0, len(line.rstrip("\n")), 16):
            field = line[at : at + 16].strip()
            if field:
                found.append(float(re.sub(r"(?<=[\d.])([+-]\d)", r"e\1", field.replace("D", "e").replace("E", "e"))))
    return found


class OpenRadioss(Equations):
    order = "rest"
    has_gravity = False

    ARRAYS = {"axes": "1", "alpha": "own", "beta": "own", "lm": "1", "ls": "own", "glm": "m", "cpm": "s", "cps": "own"}

    def __init__(self, path):
        lines = [line for line in path.read_text().splitlines() if line.strip() and not line.startswith(("#", "$"))]
        head = [int(word) for word in lines[0].split()]
        nf, static, n, turning, damped, blocked = head[:6]
        assert static == 0 and blocked == 0
        self.modes = nf
        at = 1 + -(-n // 10)
        self.ids = np.array([int(line[k : k + 8]) for line in lines[1:at] for k in range(0, len(line.rstrip()), 8)])

        def take(count, record=5):
            nonlocal at
            found = []
            while len(found) < count:
                found += numbers([lines[at]])
                at += 1
            assert len(found) == count, (len(found), count)
            return np.array(found)

        axes = take(10)
        self.axes = axes[:9].reshape(3, 3)
        self.alpha, self.beta = take(2) if damped else (0.0, 0.0)
        self.nme = 15 if turning else 12
        rigid = take(self.nme * n * 6).reshape(self.nme, n, 6)
        local = take(nf * n * 6).reshape(nf, n, 6)
        self.lm, self.ls = take(nf), take(nf)
        self.glm = np.zeros((self.nme, self.nme))
        self.glm[np.triu_indices(self.nme)] = take(self.nme * (self.nme + 1) // 2)
        self.glm += np.triu(self.glm, 1).T
        self.cpm = take(9 * self.nme * nf).reshape(3, 3, self.nme, nf)
        self.cps = take(9 * self.nme * nf).reshape(3, 3, self.nme, nf)
        # The place of a node in the body frame: its rigid modes 3 (I - 1) + 1 move it by x_I along the first axis.
        self.positions = rigid[0:9:3, :, 0].T
        self.rigid = rigid
        self.shape, self.rotation = local[:, :, :3].transpose(1, 2, 0), local[:, :, 3:].transpose(1, 2, 0)
        turn = lambda i: self.rotation[i] if np.abs(self.rotation[i]).max() > 0 else None
        self.places = {number: Place(self.positions[i], self.shape[i], turn(i)) for i, number in enumerate(self.ids)}

    def tie(self):
        """Returns the accelerations of the rigid modes, along axes of the model, for (a, alpha) along body axes."""
        out = np.zeros((self.nme, 6))
        for i in range(3):
            out[3 * i : 3 * i + 3, :3] = self.axes
            out[3 * i : 3 * i + 3, 3:] = self.axes @ np.cross(np.eye(3), np.eye(3)[i]).T
        out[9:12, :3] = self.axes
        if self.nme == 15:
            out[12:15, 3:] = self.axes
        return out

    def mass(self, q):
        coupling = np.einsum("ab,abrm->rm", self.axes, self.cpm)
        tie = self.tie()
        return np.block([[tie.T @ self.glm @ tie, tie.T @ coupling], [coupling.T @ tie, np.diag(self.lm)]])

    def velocity_forces(self, q, w, qd):
        bent = np.zeros(self.nme)
        for i in range(3):
            bent[3 * i : 3 * i + 3] = self.axes @ np.cross(w, np.cross(w, np.eye(3)[i]))
        coupling = np.einsum("ab,abrm->rm", self.axes, self.cpm)
        # RC: stiffness that couples rigid and local modes, by the transposed matrix of the axes (TMROT).
        held = np.einsum("ab,barm->rm", self.axes, self.cps)
        return np.concatenate([self.tie().T @ (self.glm @ bent + held @ q), coupling.T @ bent])

    def elastic(self, q, qd):
        return self.ls * q + (self.alpha * self.lm + self.beta * self.ls) * qd

    def force(self, place, q, force):
        """Returns `MFEXT`: the force times the rows of the rigid and local modes of the node, at its undeformed place."""
        rows = next(self.rigid[:, i] for i, number in enumerate(self.ids) if self.places[number] is place)
        return np.concatenate([self.tie().T @ (rows[:, :3] @ (self.axes @ force)), place.translation.T @ force])

    def moment(self, place, q, moment):
        if place.rotation is None:
            return None
        rows = next(self.rigid[:, i] for i, number in enumerate(self.ids) if self.places[number] is place)
        return np.concatenate([self.tie().T @ (rows[:, 3:] @ (self.axes @ moment)), place.rotation.T @ moment])
