"""The equations of motion of one free-surface body in numpy, term by term: what guidelines I to IV of [WP19] keep, taken literally.

Written from docs/theory.md section 3 alone; nothing of the program is used but the invariants of a flex-body file of a solid.
"""

import tomllib

import h5py
import numpy as np
from scipy.integrate import solve_ivp

# Terms that each guideline keeps. Loads and forces are in the rows of the modes, torques in the rows of the rotation.
# In the normal case of IV, W1 Qd omega is the only Coriolis term in the rows of the rotation: "IV normal" keeps the Coriolis
# force on the modes beside it, "IV rotation" does not. "IV" keeps all terms, as slender free bodies need.
SOFT = {"load", "W1Q", "load W2Q"}
GUIDELINES = {
    "I": set(),
    "II": {"load"},
    "III": SOFT,
    "III free": SOFT | {"QW2Q", "QW3"},
    "IV rotation": SOFT | {"torque W1Qd"},
    "IV normal": SOFT | {"torque W1Qd", "force W3Qd"},
    "IV": SOFT | {"QW2Q", "QW3", "torque W1Qd", "torque W2Qd", "force W3Qd"},
}


def skew(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def cross(a, b):
    # numpy's own takes ten times as long.
    (a0, a1, a2), (b0, b1, b2) = a.tolist(), b.tolist()
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


class Body:
    """Invariants of a file whose frame is at the centre of mass, along the axes of the model, in which scenes are."""

    def __init__(self, path):
        with h5py.File(path) as file:
            def read(name):
                return file[f"invariants/{name}"][()]

            self.solid = file["source"].attrs["mass_structure"] != "general"
            self.prestressed = "geometric_stiffness" in file and len(file["geometric_stiffness"]) > 0
            self.I0, self.W1, self.W2, self.W3 = (read(name) for name in ("I0", "W1", "W2", "W3"))
            self.eigenvalue = file["modes/eigenvalue"][()]
            self.nodes = {int(number): i for i, number in enumerate(file["nodes/id"][()])}
            self.positions, self.shape = file["nodes/position"][()], file["modes/shape"][()]
            self.interfaces = {name: {key: group[key][()] for key in ("reference", "translation", "rotation") if key in group} for name, group in file.get("interfaces", {}).items()}
            self.axes = file["frame/axes"][()]
        self.nf = len(self.eigenvalue)
        self.turn()

    def turn(self):
        """From the axes of the file to those of the model."""
        a, nf = self.axes, self.nf
        self.I0 = a @ self.I0 @ a.T
        self.W1 = np.einsum("ac,bd,cdj->abj", a, a, self.W1.reshape(3, 3, nf)).reshape(3, 3 * nf)
        self.W2 = np.einsum("ac,bd,cidj->aibj", a, a, self.W2.reshape(3, nf, 3, nf)).reshape(3 * nf, 3 * nf)
        self.W3 = np.einsum("ac,cij->aij", a, self.W3.reshape(3, nf, nf)).reshape(3 * nf, nf)
        self.positions, self.shape = self.positions @ a.T, self.shape @ a.T
        self.interfaces = {name: {key: a @ value for key, value in own.items()} for name, own in self.interfaces.items()}

    def in_model(self, vector, axes):
        """A vector that turns with the body, along the axes of the model."""
        return self.axes @ vector if axes == "body" else vector

    def point(self, load):
        """Place, rows of translation and of rotation (3 x nf) where a load acts."""
        if "node" in load:
            i = self.nodes[load["node"]]
            return self.positions[i], self.shape[:, i, :].T, None
        own = self.interfaces[load["interface"]]
        return own["reference"], own["translation"], own.get("rotation")


def history(value):
    """A value of a scene over time, and its rate."""
    if isinstance(value, (int, float)):
        return lambda t: (float(value), 0.0)
    if "times" in value:
        times, values = np.array(value["times"], float), np.array(value["values"], float)
        slopes = np.append(np.diff(values) / np.diff(times), 0.0) if len(times) > 1 else np.zeros(1)

        def table(t):
            at = np.searchsorted(times, t, side="right") - 1
            if at < 0 or at == len(times) - 1:
                return values[max(at, 0)], 0.0
            return values[at] + slopes[at] * (t - times[at]), slopes[at]

        return table
    if "amplitude" in value:
        rate, phase = 2 * np.pi * value["frequency"], value.get("phase", 0.0)
        return lambda t: (value["amplitude"] * np.sin(rate * t + phase), value["amplitude"] * rate * np.cos(rate * t + phase))
    start, length, first = value.get("start", 0.0), value["duration"], value.get("from", 0.0)

    def ramp(t):
        x = min(max((t - start) / length, 0.0), 1.0)
        step = value["to"] - first
        return first + step * (x - np.sin(2 * np.pi * x) / (2 * np.pi)), step * (1 - np.cos(2 * np.pi * x)) / length

    return ramp


def rotation_matrix(e):
    a, v = e[0], e[1:]
    return np.eye(3) * (a * a - v @ v) + 2 * np.outer(v, v) + 2 * a * skew(v)


class Motion:
    """A body in a scene with some of the terms."""

    def __init__(self, body, scene, kept):
        self.body, self.scene, self.kept = body, scene, kept
        nf = body.nf
        # Blocks (a, b) in rows: W1 (9 x nf), W2 (9 nf x nf), W3 and its blocks transposed (3 nf x nf).
        self.w1 = body.W1.reshape(9, nf)
        self.w2 = body.W2.reshape(3, nf, 3, nf).transpose(0, 2, 1, 3).reshape(9 * nf, nf)
        self.w3 = body.W3
        self.w3_transposed = body.W3.reshape(3, nf, nf).transpose(0, 2, 1).reshape(3 * nf, nf)
        damping = scene.get("damping", {}).get("ratio", 0.0)
        self.damping = 2 * damping * np.sqrt(body.eigenvalue)
        self.loads = []
        for load in scene.get("load", []):
            axes = load.get("axes", "world")
            vectors = [body.in_model(np.array(load.get(name, [0, 0, 0]), float), axes) for name in ("force", "torque")]
            self.loads.append((*body.point(load), *vectors, axes == "world", history(load.get("history", 1.0))))
        self.kinks = sorted({float(t) for load in scene.get("load", []) for t in kinks(load.get("history", 1.0))} | {float(t) for t in kinks(scene.get("spin", {}).get("rate", 0.0))})
        spin = scene.get("spin")
        axis = None if spin is None else body.in_model(np.array(spin["axis"], float), spin.get("axes", "model"))
        self.spin = None if spin is None else (axis / np.linalg.norm(axis), history(spin["rate"]))

    def start(self):
        first = self.scene.get("initial", {})
        turn = np.array(first.get("rotation", [0, 0, 0]), float)
        angle = np.linalg.norm(turn)
        e = np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * turn / angle if angle > 0 else np.zeros(3)])
        omega = self.body.in_model(np.array(first.get("angular_velocity", [0, 0, 0]), float), first.get("axes", "model"))
        q, qd = np.zeros(self.body.nf), np.zeros(self.body.nf)
        for mode in first.get("mode", []):
            if mode["number"] <= self.body.nf:
                q[mode["number"] - 1], qd[mode["number"] - 1] = mode.get("amplitude", 0.0), mode.get("rate", 0.0)
        start = np.concatenate([e, omega, q, qd])
        return self.settled(start) if first.get("deformation") == "static" else start

    def settled(self, start):
        """The start with the deformation at which the modes are not accelerated, by all terms."""
        nf, whole = self.body.nf, Motion(self.body, self.scene, GUIDELINES["IV"])
        if self.spin is not None:
            start[4:7] = self.spin[0] * self.spin[1](0.0)[0]
        for _ in range(100):
            step = whole.rates(0.0, start)[7 + nf:] / self.body.eigenvalue
            start[7:7 + nf] += step
            if np.abs(step).max() <= 1e-13 * np.abs(start[7:7 + nf]).max():
                break
        return start

    def rates(self, t, y):
        body, kept, nf = self.body, self.kept, self.body.nf
        e, w, q, qd = y[:4], y[4:7], y[7:7 + nf], y[7 + nf:]
        alpha = None
        if self.spin is not None:
            axis, rate = self.spin
            value, slope = rate(t)
            w, alpha = axis * value, axis * slope
        w2q, squares = (self.w2 @ q).reshape(9, nf), np.outer(w, w).ravel()
        inertia, inertia_rate = body.I0.copy(), np.zeros((3, 3))
        if "W1Q" in kept:
            inertia += (self.w1 @ q).reshape(3, 3)
        if "QW2Q" in kept:
            inertia += (w2q @ q).reshape(3, 3)
        if "torque W1Qd" in kept:
            inertia_rate += (self.w1 @ qd).reshape(3, 3)
        if "torque W2Qd" in kept:
            inertia_rate += (w2q @ qd + (self.w2 @ qd).reshape(9, nf) @ q).reshape(3, 3)
        coupling = (self.w3_transposed @ q).reshape(3, nf) if "QW3" in kept else np.zeros((3, nf))  # Q'W3
        load = np.zeros(nf)
        if "load" in kept:
            load += 0.5 * squares @ self.w1
        if "load W2Q" in kept:
            load += squares @ w2q
        force = load - body.eigenvalue * q - self.damping * qd
        if "force W3Qd" in kept:
            force += 2 * w @ (self.w3 @ qd).reshape(3, nf)
        torque = np.zeros(3)
        axes = rotation_matrix(e)
        for place, translation, turn, push, twist, in_world, factor in self.loads:
            size = factor(t)[0]
            if size == 0.0:
                continue
            push, twist = (size * (axes.T @ vector if in_world else vector) for vector in (push, twist))
            force += translation.T @ push
            if twist.any():
                force += turn.T @ twist
            if alpha is None:
                torque += cross(place + translation @ q, push) + twist
        if alpha is None:
            torque -= cross(w, inertia @ w) + inertia_rate @ w + cross(w, coupling @ qd)
            # Mass-normalised modes: the Schur complement is 3 x 3.
            alpha = np.linalg.solve(inertia - coupling @ coupling.T, torque - coupling @ force)
        qdd = force - coupling.T @ alpha
        ed = 0.5 * np.concatenate([[-e[1:] @ w], e[0] * w + cross(e[1:], w)])
        return np.concatenate([ed, alpha, qd, qdd])

    def static_response(self, instants):
        """The largest modal coordinate that the loads and the spin of some instants would hold."""
        whole = Motion(self.body, self.scene, GUIDELINES["IV"])
        y = whole.start()
        y[7:] = 0.0
        return max(np.abs(whole.rates(t, y)[7 + self.body.nf:] / self.body.eigenvalue).max() for t in instants[:: max(1, len(instants) // 40)])

    def states(self, instants, tolerance):
        """(attitude, omega, q) at the instants; `None` where the integration cannot go on."""
        y, times = self.start(), []
        if self.spin is not None:
            y[4:7] = self.spin[0] * self.spin[1](0.0)[0]
        reach = max(np.abs(y[7:7 + self.body.nf]).max(), self.static_response(instants), 1e-300)
        rate = np.sqrt(self.body.eigenvalue[0])
        scale = np.concatenate([np.ones(4), np.full(3, 1e-3 * rate), np.full(self.body.nf, reach), np.full(self.body.nf, reach * rate)])
        stops = [t for t in self.kinks if 0 < t < instants[-1]] + [instants[-1]]
        at, parts = 0.0, []
        for stop in stops:
            inside = [t for t in instants if at < t <= stop or (t == 0 and at == 0)]
            found = solve_ivp(self.rates, (at, stop), y, method="DOP853", t_eval=sorted(set(inside) | {stop}), rtol=tolerance, atol=tolerance * scale)
            if not found.success or not np.isfinite(found.y).all():
                return None
            chosen = np.isin(found.t, inside)
            parts.append(found.y[:, chosen])
            times.extend(found.t[chosen])
            y, at = found.y[:, -1], stop
        out = np.concatenate(parts, axis=1)
        out[:4] /= np.linalg.norm(out[:4], axis=0)
        return out


def kinks(value):
    if isinstance(value, dict) and "times" in value:
        return value["times"]
    if isinstance(value, dict) and "to" in value:
        return [value.get("start", 0.0), value.get("start", 0.0) + value["duration"]]
    return []


def apart(body, reference, other):
    """Errors of a motion: attitude in radians, omega and modes and root of the elastic energy relative to their largest."""
    if other is None:
        return None
    nf = body.nf
    dots = np.abs((reference[:4] * other[:4]).sum(axis=0)).clip(max=1.0)
    chord = np.linalg.norm(reference[:4] - np.sign((reference[:4] * other[:4]).sum(axis=0)) * other[:4], axis=0)
    angle = np.where(dots > 0.99, 4 * np.arcsin((chord / 2).clip(max=1.0)), 2 * np.arccos(dots)).max()

    def relative(a, b):
        largest = np.linalg.norm(a, axis=0).max()
        return np.linalg.norm(a - b, axis=0).max() / largest if largest > 0 else 0.0

    root = np.sqrt(body.eigenvalue)[:, None]
    q, p = reference[7:7 + nf], other[7:7 + nf]
    return {"attitude": angle, "omega": relative(reference[4:7], other[4:7]), "modes": relative(q, p), "stress": relative(root * q, root * p)}


def read_scene(path):
    return tomllib.loads(path.read_text())


def study(body, scene, instants, tolerance=1e-7):
    """The whole motion, and the errors of each guideline."""
    everything = Motion(body, scene, GUIDELINES["IV"]).states(instants, tolerance)
    errors = {name: apart(body, everything, Motion(body, scene, kept).states(instants, tolerance)) for name, kept in GUIDELINES.items() if name != "IV"}
    return everything, errors
