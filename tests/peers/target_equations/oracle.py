"""Equations of motion of all nodes of an FE model, from K, M and the positions of the nodes.

This module shares no code with flexbody or with a reader of a format. A node with rotations is a point and three directors, vectors that turn with it (docs/theory.md, section 6); a node
without rotations is a point. Points and directors have a constant mass `E`, one number for each pair. With the places z(q) of points and directors in the body frame, the
acceleration of each along body axes is

    gamma = a + alpha x z + w x (w x z) + 2 w x z' + z''        (without a for directors)

and the forces that a motion (a, alpha, q'') takes are the projections of E gamma: the sum over the points, the moments z x E gamma, and z_q' E gamma. For a
solid z = x + Psi q, and these equations are exact at any q. Directors are taken to the second order of their rotation.

What a consistent mass matrix of beams and shells holds beside E (`rest`) does not turn: it is multiplied by the velocities of the rows along body axes, (6.1) of the theory.
Arrays are about the origin and along the axes of the body frame. `a` is the acceleration of its origin: no velocity of translation enters.
"""

import copy
import gzip
from dataclasses import dataclass

import numpy as np
import scipy.io
import scipy.sparse as sp
import scipy.sparse.linalg as spl


def skew(v):
    """Returns the matrix of the cross product with v, or a stack of them for a stack of vectors."""
    v = np.asarray(v, float)
    zero = np.zeros(v.shape[:-1])
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    return np.stack([np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1), np.stack([-y, x, zero], -1)], -2)


def matrix(path):
    """Reads a sparse matrix from a Matrix Market file, compressed or not."""
    if path.suffix == ".gz":
        with gzip.open(path) as file:
            return scipy.io.mmread(file).tocsr()
    return scipy.io.mmread(path).tocsr()


@dataclass
class Interface:
    """An interface: its nodes follow the reference point (`rigid`), or the reference point follows their mean motion (`averaging`). The point is in model axes."""

    name: str
    coupling: str
    nodes: list
    reference: np.ndarray


@dataclass
class Damping:
    """Coefficients of Rayleigh damping, alpha M + beta K."""

    alpha: float = 0.0
    beta: float = 0.0


class Model:
    """The FE model: K, M, nodes, interfaces and damping, in model axes."""

    def __init__(self, folder, interfaces, damping, stresses=()):
        """`stresses` has the geometric stiffness: tuples of the kind of load ("acceleration", "angular_acceleration" or "spin"), its axis and the name of the matrix.

        Loads are along model axes and about the centre of mass.
        """
        self.stresses = [(kind, axis, matrix(folder / name)) for kind, axis, name in stresses]
        self.k, self.m = matrix(folder / "K.mtx.gz"), matrix(folder / "M.mtx.gz")
        table = np.genfromtxt(folder / "nodes.csv", delimiter=",", names=True)
        self.ids = table["node"].astype(int)
        self.x = np.stack([table["x"], table["y"], table["z"]], 1)
        rows = np.genfromtxt(folder / "dofs.csv", delimiter=",", names=True)
        self.index = {node: i for i, node in enumerate(self.ids)}
        self.row = {(self.index[int(node)], int(axis) - 1): i for i, (node, axis) in enumerate(zip(rows["node"], rows["dir"]))}
        self.interfaces, self.damping = interfaces, damping
        # Compliances by the names of the held and the loaded interface.
        self.solved = {}
        self.split()

    def scaled(self, length, mass):
        """Returns the model of a solid in other units: one unit of length and mass of this model is `length` and `mass` units of the new one."""
        assert not self.turning, "rows of rotations would need units of their own"
        other = object.__new__(Model)
        other.__dict__.update(self.__dict__)
        other.solved = {}
        other.x, other.k, other.m = length * self.x, mass * self.k, mass * self.m
        other.interfaces = [Interface(i.name, i.coupling, i.nodes, length * i.reference) for i in self.interfaces]
        other.split()
        return other

    def split(self):
        """Splits M into the mass `e` of points and directors and the `rest`.

        The `rest` has the symmetric parts of blocks that couple displacements and rotations, and the parts of mass blocks that differ by direction.
        """
        n = len(self.ids)
        self.turning = sorted({i for i, axis in self.row if axis > 2})
        director = {i: n + 3 * k for k, i in enumerate(self.turning)}
        self.size = n + 3 * len(self.turning)
        place = {at: row for row, at in self.row.items()}
        blocks, coo = {}, self.m.tocoo()
        for row, column, value in zip(coo.row, coo.col, coo.data):
            (i, a), (j, b) = place[row], place[column]
            blocks.setdefault((i, j, a > 2, b > 2), np.zeros((3, 3)))[a % 3, b % 3] += value
        rows, columns, values, rest = [], [], [], {}

        def add(i, j, value):
            rows.append(i), columns.append(j), values.append(value)

        for (i, j, left, right), block in blocks.items():
            if not left and not right:
                mean = np.trace(block) / 3
                add(i, j, mean)
                block = block - mean * np.eye(3)
            elif left and right:
                second = np.trace(block) / 2 * np.eye(3) - block.T
                for a in range(3):
                    for b in range(3):
                        add(director[i] + a, director[j] + b, second[a, b])
                block = np.zeros((3, 3))
            else:
                # Rows of displacements, columns of rotations: -h~ + N.
                upright = block if right else block.T
                odd = (upright - upright.T) / 2
                first = -np.array([odd[2, 1], odd[0, 2], odd[1, 0]])
                for a in range(3):
                    if right:
                        add(i, director[j] + a, first[a])
                    else:
                        add(director[i] + a, j, first[a])
                block = (block + block.T) / 2
            rest[i, j, left, right] = block
        self.e = sp.csr_matrix((values, (rows, columns)), (self.size, self.size))
        largest = max(np.abs(block).max() for (_, _, left, right), block in blocks.items() if not left and not right)
        self.rest = {at: block for at, block in rest.items() if np.abs(block).max() > 1e-11 * largest}

    def rest_matrix(self):
        """Returns `rest` as a matrix whose rows are the displacements of all nodes (3 i + a), then their rotations."""
        n = len(self.ids)
        at = lambda i, rotation: 3 * i + (3 * n if rotation else 0)
        rows, columns, values = [], [], []
        for (i, j, left, right), block in self.rest.items():
            for (a, b), value in np.ndenumerate(block):
                rows.append(at(i, left) + a), columns.append(at(j, right) + b), values.append(value)
        return sp.csr_matrix((values, (rows, columns)), (6 * n, 6 * n))

    def fit(self, interface):
        """Returns the matrix rows of an interface and their displacements under the six motions of its reference point (R of theory 5.3)."""
        rows, motions = [], []
        for node in interface.nodes:
            i = self.index[node]
            lever = self.x[i] - interface.reference
            for a in range(3):
                rows.append(self.row[i, a])
                motions.append(np.concatenate([np.eye(3)[a], np.cross(np.eye(3), lever)[:, a]]))
            if i in self.turning and (len(interface.nodes) == 1 or interface.coupling == "rigid"):
                for a in range(3):
                    rows.append(self.row[i, 3 + a])
                    motions.append(np.concatenate([np.zeros(3), np.eye(3)[a]]))
        r = np.array(motions)
        return np.array(rows), r

    def weights(self, interface):
        """Returns the matrix rows of an interface and the weights A = R (R'R)^-1: the motion of its reference point is A' u (theory 5.3)."""
        rows, r = self.fit(interface)
        return rows, r @ np.linalg.inv(r.T @ r)

    def compliance(self, held, loaded):
        """Returns the motion (6 x 6, model axes) of the reference point of `loaded` under unit forces and moments there with the point of `held` fixed. No modes are involved."""
        key = held.name, loaded.name
        if key not in self.solved:
            self.solved[key] = self.static(held, loaded, np.eye(6), None)
        return self.solved[key]

    def sag(self, held, watched, gravity):
        """Returns the motion (6, model axes) of the reference point of `watched` under gravity with the point of `held` fixed. No modes are involved."""
        return self.static(held, watched, np.zeros((6, 1)), gravity)

    def static(self, held, loaded, forces, gravity):
        """Solves the static equations of all nodes. Rigid interfaces are eliminated; the held one, where it is averaging, is fixed by multipliers."""
        n = self.k.shape[0]
        taken, columns = set(), []
        for interface in self.interfaces:
            if interface.coupling == "rigid":
                rows, r = self.fit(interface)
                taken |= set(rows)
                columns.append((interface, rows, r))
        free = [row for row in range(n) if row not in taken]
        t = sp.lil_matrix((n, len(free) + 6 * len(columns)))
        for k, row in enumerate(free):
            t[row, k] = 1
        first = {}
        for k, (interface, rows, r) in enumerate(columns):
            first[interface.name] = len(free) + 6 * k
            for row, motion in zip(rows, r):
                t[row, len(free) + 6 * k : len(free) + 6 * k + 6] = motion
        t = t.tocsr()
        # Rows that pick the motion of a reference point out of the unknowns.
        pick = {}
        for interface in (held, loaded):
            if interface.coupling == "rigid":
                at = first[interface.name]
                pick[interface.name] = sp.csr_matrix((np.ones(6), (range(6), range(at, at + 6))), (6, t.shape[1]))
            else:
                rows, weights = self.weights(interface)
                pick[interface.name] = sp.csr_matrix(weights.T) @ t[rows]
        k = (t.T @ self.k @ t).tocsr()
        scale = abs(k).max()
        condition = scale * pick[held.name]
        load = pick[loaded.name].T @ forces
        if gravity is not None:
            load = load + (t.T @ (self.m @ self.rigid(np.zeros(3))[:, :3] @ gravity)).reshape(-1, 1)
        system = sp.bmat([[k, condition.T], [condition, None]]).tocsc()
        solved = spl.splu(system).solve(np.vstack([load, np.zeros((6, load.shape[1]))]))
        return pick[loaded.name] @ solved[: t.shape[1]]

    def rigid(self, origin):
        """Returns the six rigid motions about a point at all matrix rows, in model axes."""
        r = np.zeros((self.k.shape[0], 6))
        for (i, axis), row in self.row.items():
            if axis < 3:
                r[row, axis] = 1
                r[row, 3:] = np.cross(np.eye(3), self.x[i] - origin)[:, axis]
            else:
                r[row, axis] = 1
        return r


class Nodes:
    """The model in a body frame, restricted to rigid motion and modes given at all nodes: its equations of motion."""

    def __init__(self, model, origin, axes, translations, rotations=None):
        """`axes` has the body axes in model axes as columns. `translations` and `rotations` (nodes x 3 x modes) are along body axes, in the node order of the model."""
        self.model, self.origin, self.axes = model, np.asarray(origin), np.asarray(axes)
        n, nf = len(model.ids), translations.shape[2]
        self.nf = nf
        self.x = (model.x - self.origin) @ self.axes
        self.psi = translations
        self.theta = np.zeros((n, 3, nf)) if rotations is None else rotations
        # The directors at rest are the axes of the model along body axes: the rows of `axes`.
        self.point = np.zeros(model.size)
        self.point[:n] = 1
        rows = np.zeros((model.k.shape[0], nf))
        for (i, axis), row in model.row.items():
            shape = translations if axis < 3 else self.theta
            rows[row] = self.axes[axis % 3] @ shape[i]
        self.rows = rows
        self.stiffness, self.mass = rows.T @ (model.k @ rows), rows.T @ (model.m @ rows)
        self.damping = model.damping.alpha * self.mass + model.damping.beta * self.stiffness
        if model.rest:
            turn = sp.kron(sp.eye(2 * n), sp.csr_matrix(self.axes))
            self.rest = (turn.T @ model.rest_matrix() @ turn).tocsr()
            # First moment of `rest` at rest, and of each mode.
            whole = self.rest[:, : 3 * n] @ np.tile(np.eye(3), (n, 1))
            self.rest_modes = whole[: 3 * n].T @ translations.reshape(3 * n, nf) + whole[3 * n :].T @ self.theta.reshape(3 * n, nf)
            block = whole[: 3 * n].T @ -skew(self.x).reshape(3 * n, 3) + whole[3 * n :].T @ np.tile(np.eye(3), (n, 1))
            self.rest_first = np.array([block[1, 2] - block[2, 1], block[2, 0] - block[0, 2], block[0, 1] - block[1, 0]]) / 2
        else:
            self.rest, self.rest_first = None, np.zeros(3)
        row_sums = model.e @ self.point
        self.centre = (row_sums @ self.places(np.zeros(nf)) + self.rest_first) / row_sums[:n].sum()
        self.stresses = [(kind, axis, rows.T @ (stress @ rows)) for kind, axis, stress in model.stresses]

    def undamped(self):
        """Returns a copy without damping, for formats that have no place for damping."""
        other = copy.copy(self)
        other.damping = 0 * self.damping
        return other

    def shapes(self, q):
        """Returns z_q, the motion of points and directors in each mode. Directors are exact to first order in q."""
        turns = self.theta[self.model.turning]
        if not len(turns):
            return self.psi
        now = skew(turns @ q)
        modes = turns.transpose(0, 2, 1)[:, None]
        # Node, director, mode, axis.
        by = np.cross(modes, self.axes[None, :, None])
        second = np.einsum("nxy,najy->najx", now, by) + np.cross(modes, np.einsum("nxy,ay->nax", now, self.axes)[:, :, None])
        moved = (by + second / 2).transpose(0, 1, 3, 2)
        return np.concatenate([self.psi, moved.reshape(-1, 3, self.nf)])

    def places(self, q):
        """Returns z, the places of points and directors. Directors are exact to second order in q."""
        now = skew(self.theta[self.model.turning] @ q)
        turned = np.einsum("nxy,ay->nax", np.eye(3) + now + now @ now / 2, self.axes)
        return np.vstack([self.x + self.psi @ q, turned.reshape(-1, 3)])

    def bent(self, qd):
        """Returns z_qq [q', q'], which is zero at points."""
        rate = skew(self.theta[self.model.turning] @ qd)
        return np.vstack([np.zeros_like(self.x), np.einsum("nxy,ay->nax", rate @ rate, self.axes).reshape(-1, 3)])

    def balance(self, q, w, qd, a, alpha, qdd):
        """Returns force, moment about the origin and modal forces that a motion takes: inertia, stiffness and damping."""
        out = self.inertia(q, w, qd, a, alpha, qdd)
        out[6:] += self.stiffness @ q + self.damping @ qd + self.stiffening(w, a, alpha) @ q
        return out

    def stiffening(self, w, a, alpha):
        """Returns the geometric stiffness at a motion of the frame. Loads are accelerations of the centre of mass, angular accelerations and products of angular velocities, model axes."""
        a = a + np.cross(alpha, self.centre) + np.cross(w, np.cross(w, self.centre))
        w, a, alpha = self.axes @ w, self.axes @ a, self.axes @ alpha
        out = np.zeros((self.nf, self.nf))
        for kind, axis, stress in self.stresses:
            at = ["xyz".index(letter) for letter in axis]
            out += stress * {"acceleration": a[at[0]], "angular_acceleration": alpha[at[0]], "spin": w[at[0]] * w[at[-1]]}[kind]
        return out

    def inertia(self, q, w, qd, a, alpha, qdd):
        """Returns force, moment about the origin and modal forces of inertia."""
        z, zq = self.places(q), self.shapes(q)
        zd = zq @ qd
        gamma = np.outer(self.point, a) + np.cross(alpha, z) + np.cross(w, np.cross(w, z)) + 2 * np.cross(w, zd) + zq @ qdd + self.bent(qd)
        f = self.model.e @ gamma
        out = np.concatenate([f[: len(self.x)].sum(0), np.cross(z, f).sum(0), np.einsum("iaj,ia->j", zq, f)])
        if self.rest is not None:
            out += self.inertia_of_rest(q, w, qd, a, alpha, qdd)
        return out

    def inertia_of_rest(self, q, w, qd, a, alpha, qdd):
        """Returns the forces of inertia of `rest`: T = v' N v / 2 with the rows v = (v_i, w + theta_i') along body axes (theory, section 6).

        The equations are those of Boltzmann and Hamel about the centre of mass.
        The momentum of translation is that of the first moment s, w x s + s', so that the body does not feel its speed of flight.
        """
        about = self.x - self.centre
        a = a + np.cross(alpha, self.centre) + np.cross(w, np.cross(w, self.centre))
        n = 3 * len(self.x)
        lever = lambda u: -skew(u).reshape(n, 3)
        psi, theta, rate = self.psi.reshape(n, -1), self.theta.reshape(n, -1), lever(self.psi @ qd)
        b = np.vstack([np.hstack([lever(about + self.psi @ q), psi]), np.hstack([np.tile(np.eye(3), (n // 3, 1)), theta])])
        momentum = self.rest @ (b @ np.concatenate([w, qd]))
        moved = b @ np.concatenate([alpha, qdd])
        moved[:n] += rate @ w
        s, sd, sdd = self.rest_first + self.rest_modes @ q, self.rest_modes @ qd, self.rest_modes @ qdd
        force = np.cross(alpha, s) + sdd + 2 * np.cross(w, sd) + np.cross(w, np.cross(w, s))
        out = np.concatenate([force, b.T @ (self.rest @ moved)])
        out[3:6] += rate.T @ momentum[:n] + np.cross(w, b[:, :3].T @ momentum) + np.cross(s, a)
        # dT/dq_j: the mode carried round by w, at displacements.
        turned = np.cross(w, self.psi, axisb=1, axisc=1).reshape(n, -1)
        out[6:] += self.rest_modes.T @ a - turned.T @ momentum[:n]
        out[3:6] += np.cross(self.centre, out[:3])
        return out

    def mass_matrix(self, q):
        """Returns the mass matrix of (a, alpha, q'')."""
        zero = np.zeros(self.nf)
        return np.stack([self.inertia(q, np.zeros(3), zero, e[:3], e[3:6], e[6:]) for e in np.eye(6 + self.nf)], 1)

    def accelerations(self, q, w, qd, applied):
        """Returns (a, alpha, q'') under applied generalised forces."""
        still = self.balance(q, w, qd, np.zeros(3), np.zeros(3), np.zeros(self.nf))
        return np.linalg.solve(self.mass_matrix(q), applied - still)

    def gravity(self, q, g):
        """Returns the generalised forces of gravity g, given along body axes."""
        z, zq = self.places(q), self.shapes(q)
        f = self.model.e @ np.outer(self.point, g)
        out = np.concatenate([f[: len(self.x)].sum(0), np.cross(z, f).sum(0), np.einsum("iaj,ia->j", zq, f)])
        if self.rest is not None:
            out[3:] += np.concatenate([np.cross(self.rest_first + self.rest_modes @ q, g), self.rest_modes.T @ g])
        # Gravity is an acceleration of the frame in the other direction.
        out[6:] -= self.stiffening(np.zeros(3), -g, np.zeros(3)) @ q
        return out

    def nodal(self, q, accelerations, w, qd):
        """Returns the absolute accelerations of all nodes along body axes."""
        a, alpha, qdd = accelerations[:3], accelerations[3:6], accelerations[6:]
        r, rd = self.x + self.psi @ q, self.psi @ qd
        return a + np.cross(alpha, r) + np.cross(w, np.cross(w, r)) + 2 * np.cross(w, rd) + self.psi @ qdd

    def interface(self, name):
        """Returns the reference point of an interface and its translation and rotation in each mode, in body axes, from the displacements of its nodes."""
        interface = next(i for i in self.model.interfaces if i.name == name)
        rows, weights = self.model.weights(interface)
        motion = weights.T @ self.rows[rows]
        turn = self.axes.T
        return (interface.reference - self.origin) @ self.axes, turn @ motion[:3], turn @ motion[3:]

    def force(self, name, q, force):
        """Returns the generalised forces of a force at an interface, in body axes."""
        place, translation, _ = self.interface(name)
        return np.concatenate([force, np.cross(place + translation @ q, force), translation.T @ force])

    def moment(self, name, q, moment, finite=False):
        """Returns the generalised forces of a moment at an interface, in body axes. The moment does work on small rotations or, with `finite`, on the axes exp(theta~)."""
        _, _, rotation = self.interface(name)
        if not finite:
            return np.concatenate([np.zeros(3), moment, rotation.T @ moment])
        out = []
        for e in np.eye(self.nf):
            # Steps of a thousandth of a radian, differences of fourth order.
            h = 1e-3 / max(np.abs(rotation @ e).max(), 1e-300)
            at = lambda s: exponential(rotation @ (q + s * h * e))
            rate = (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * h) @ at(0).T
            out.append(moment @ np.array([rate[2, 1] - rate[1, 2], rate[0, 2] - rate[2, 0], rate[1, 0] - rate[0, 1]]) / 2)
        return np.concatenate([np.zeros(3), moment, out])


def exponential(theta):
    """Returns the rotation matrix of a rotation vector."""
    angle = np.linalg.norm(theta)
    k = skew(theta)
    if angle < 1e-8:
        return np.eye(3) + k + k @ k / 2
    return np.eye(3) + np.sin(angle) / angle * k + (1 - np.cos(angle)) / angle**2 * k @ k
