#!/usr/bin/env python3
"""Bodies that flexbody exports, in MBDyn: its modal joint moves as `flexbody simulate` says, or as equations written out in numpy.

`rows` is called by suite.py. MBDyn: the variable MBDYN or the PATH; it is built from its sources, of 2024 or later (record group 19). A scene is written once, in
the words of flexbody and of MBDyn:

* tumbling: a free body with a spin near its middle axis and bent modes;
* damping: the same with modal damping in record group 13, and with the origin of the model, where the centre of mass is not;
* force: a spinning body with an oscillating force at an interface; couple: with a couple too;
* led: a blade is brought to speed by a joint, forces at its interfaces, with geometric stiffness;
* let go: the same blade is let go at speed, with forces and a couple.

The blade has geometric stiffness for spin and acceleration; that for angular acceleration, a force and a moment is made here by element code. Two things of second
order are in flexbody and not in MBDyn: the reaction of the geometric stiffness on the frame and on the place of an interface (theory 7.4, 7.5), and the axes on which
a couple does work, which flexbody turns by a finite angle. `couple` and `let go` are therefore also integrated here, by equations without these two, with which MBDyn
must agree, and with them, with which flexbody must. Where a joint leads the frame, and where forces act alone, flexbody and MBDyn solve the same equations.

Differences are the largest over all recorded instants: of places over the radius of gyration, of direction cosines, of modal amplitudes over the
largest. With half the step they must fall by the order of the method, until rounding is reached.
"""

import gzip
import re
import shutil
import sys
from dataclasses import dataclass, field

import h5py
import numpy as np
import scipy
import scipy.io
from scipy.integrate import solve_ivp

import common
from common import ROOT, Absent, Row, run

sys.path.insert(0, str(ROOT / "evidence/programs"))
from geometric_elements import Element, Part  # noqa: E402

SOURCE = "sources at www.mbdyn.org, of 2024 or later"
MODES, INSTANTS = 6, 20
# A diagonally implicit Runge-Kutta method of MBDyn, its order, steps in a scene. Joints constrain velocities: with positions the order falls to 2.
METHOD, ORDER, STEPS = "DIRK54", 4, 800
ROUNDING = 2e-11
# Largest differences with half the step, twice what was measured or so.
LIMITS = {
    "tumbling": {"place": 1e-13, "axes": 1e-10, "q": 4e-8},
    "damping": {"place": 1e-11, "axes": 1e-11, "q": 3e-9},
    "force": {"place": 1e-13, "axes": 6e-11, "q": 3e-8, "interface": 2e-9},
    "couple": {"axes": 6e-11, "q": 3e-8, "interface": 2e-9, "apart": 2e-4},
    "led": {"axes": 2e-12, "q": 2e-7, "blind": 0.0},
    "let go": {"axes": 2e-11, "q": 1e-8, "interface": 3e-10, "apart": 2e-3},
}
# Of the modal amplitudes, which are the worst, between two integrations to all digits.
EXPLAINED = 2e-11
DECK = """
begin: data; problem: initial value; end: data;
begin: initial value;
    initial time: 0.; final time: {end!r}; time step: {step!r};
    method: {method}; linear solver: naive, colamd; tolerance: 1e-6; max iterations: 30, at most;
    derivatives tolerance: 1e-3; derivatives max iterations: 30; derivatives coefficient: {coefficient!r};
end: initial value;
begin: control data;
    structural nodes: {nodes}; joints: {joints}; forces: {forces}; skip initial joint assembly; {differentiation}
    default orientation: orientation matrix; output precision: 17; output meter: meter, 0., forever, steps, {every};
end: control data;
begin: nodes;
{node_lines}
end: nodes;
begin: elements;
{element_lines}
end: elements;
"""
DAMPING = """
[damping]
bands = [{ to_hz = 6000.0, ratio = 0.02 }, { ratio = 0.05 }]
"""
# Loads of the blade besides those that the fixture has matrices for.
GEOMETRIC = """
[[geometric_stiffness]]
file = "turn.mtx"
angular_acceleration = "z"
[[geometric_stiffness]]
file = "force.mtx"
force = "y"
interface = "tip"
[[geometric_stiffness]]
file = "moment.mtx"
moment = "x"
interface = "root"
"""


@dataclass
class Load:
    """A force and a couple along axes of the world, oscillating."""

    interface: str
    tone: float
    force: np.ndarray
    torque: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def history(self, time):
        return np.sin(2 * np.pi * self.tone * time)


@dataclass
class Scene:
    """What the body is to do."""

    name: str
    duration: float
    omega: np.ndarray = field(default_factory=lambda: np.zeros(3))
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    q: np.ndarray = field(default_factory=lambda: np.zeros(MODES))
    loads: list = field(default_factory=list)
    rate: float = 0.0  # to which a joint brings it, about z

    def toml(self):
        modes = ", ".join(f"{{ number = {j + 1}, amplitude = {float(q)!r} }}" for j, q in enumerate(self.q) if q)
        lines = [f"[run]\nduration = {self.duration!r}\noutputs = {INSTANTS}\ntolerance = 1e-12"]
        if self.rate:
            lines += [f"[spin]\naxis = [0, 0, 1]\nrate = {{ to = {self.rate!r}, duration = {self.duration!r} }}\nhold = true"]
        else:
            lines += [f"[initial]\nvelocity = {self.velocity.tolist()}\nangular_velocity = {self.omega.tolist()}\nmode = [{modes}]"]
        for load in self.loads:
            lines += [f'[[load]]\ninterface = "{load.interface}"\nforce = {load.force.tolist()}\ntorque = {load.torque.tolist()}']
            lines += [f'history = {{ amplitude = 1, frequency = {load.tone!r} }}\n[[watch]]\ninterface = "{load.interface}"']
        return "\n".join(lines) + "\n"


class Body:
    """A body of a fixture, with additions to its manifest, and its export."""

    def __init__(self, flexbody, folder, model, extra="", frame="com"):
        self.flexbody, self.folder = flexbody, folder
        source = folder / f"{model} {frame}"
        shutil.copytree(ROOT / "fixtures/models" / model, source)
        if extra == GEOMETRIC:
            made(source)
        with open(source / "model.toml", "a") as manifest:
            manifest.write(extra)
        self.path = source / "body.flex.h5"
        # World, model and body axes are the same at the start.
        run(flexbody, "convert", source / "model.toml", "--frame", frame, "--lumped", "none", "--modes", MODES, "--quiet", "-o", self.path)
        self.fem = common.export(flexbody, self.path, "mbdyn", source / "body.fem")
        with h5py.File(self.path) as f:
            self.lam, self.inertia, self.mass = f["modes/eigenvalue"][()], f["invariants/I0"][()], float(f["invariants/mass"][0])
            self.centre, self.damped = f["invariants/first_moment"][()] / self.mass, "modal_damping" in f["invariants"]
        self.first, self.length = np.sqrt(self.lam[0]), np.sqrt(np.trace(self.inertia) / 2 / self.mass)
        self.interfaces = places(self.fem)

    def ours(self, scene):
        """Places (from that of the centre of mass at the start), axes and amplitudes by `flexbody simulate`."""
        text, motion = self.folder / "scene.toml", self.folder / "motion.h5"
        text.write_text(scene.toml())
        run(self.flexbody, "simulate", self.path, "--scene", text, "--quiet", "-o", motion)
        with h5py.File(motion) as f:
            start = f["frame/origin"][0]
            found = {"place": f["frame/origin"][()] - start, "axes": attitudes(f["frame/attitude"][()]), "q": f["modes/q"][()]}
            for load in scene.loads[:1]:
                found["interface"] = f[f"points/interface {load.interface}/place"][()] - start
        return found


class Blade(Part):
    """The mesh of the blade, of its deck."""

    def __init__(self, folder):
        deck = gzip.open(folder / "matrices.inp.gz", "rt").read()
        words = lambda keyword: re.sub(r",?\s+", ",", re.search(rf"\*{keyword}.*\n((?:[^*].*\n)+)", deck).group(1).strip()).split(",")
        nodes = np.array(words("NODE"), float).reshape(-1, 4)
        self.ids, self.points = nodes[:, 0].astype(int), nodes[:, 1:]
        self.element, self.elements = Element("C3D20"), np.searchsorted(self.ids, np.array(words("ELEMENT"), int).reshape(-1, 21)[:, 1:])
        self.young, self.poisson = map(float, words("ELASTIC"))
        self.ends = {name: np.searchsorted(self.ids, np.array(words(f"NSET, NSET={name.upper()}"), int)) for name in ("root", "tip")}


def made(folder):
    """Matrices for the loads of `GEOMETRIC`, by element code: of the stress that a load causes with what balances it, inertia or the moment at the root that turns the blade."""
    blade = Blade(folder)
    k, m = (scipy.io.mmread(folder / f"{name}.mtx.gz").tocsr() for name in "KM")
    mass = blade.rigid().T @ m @ blade.rigid()
    rigid = blade.rigid(np.array([mass[5, 1], mass[3, 2], mass[4, 0]]) / mass[0, 0])
    inertia, root = m @ rigid, blade.at("root")
    loads = {"turn": (-inertia[:, 5], root), "force": (blade.at("tip")[:, 1], inertia), "moment": (root[:, 3], inertia)}
    flexibility = np.linalg.pinv(k.toarray(), rcond=1e-11, hermitian=True)
    for name, (load, balance) in loads.items():
        balanced = load - balance @ np.linalg.solve(rigid.T @ balance, rigid.T @ load)
        scipy.io.mmwrite(folder / f"{name}.mtx", blade.stress_stiffness(flexibility @ balanced), symmetry="general", precision=17)


def places(fem):
    """Labels and coordinates of the nodes of the file, in its order."""
    groups, number = {}, None
    for line in fem.read_text().splitlines():
        if line.startswith("** RECORD GROUP"):
            number = int(line.split()[3].rstrip(","))
        elif not line.startswith("**"):
            groups.setdefault(number, []).append(line.strip())
    return {label: np.array([float(groups[k][i]) for k in (5, 6, 7)]) for i, label in enumerate(groups[2])}


def attitudes(parameters):
    """Matrices of Euler parameters."""
    e, v = parameters[:, 0], parameters[:, 1:]
    cross = np.cross(v[:, None, :], np.eye(3)).transpose(0, 2, 1)
    return (2 * e * e - 1)[:, None, None] * np.eye(3) + 2 * v[:, :, None] * v[:, None, :] + 2 * e[:, None, None] * cross


def vector(values):
    return ", ".join(repr(float(value)) for value in values)


def interface_nodes(body, scene):
    """Nodes without mass, the first number 11, that the joint ties to the interfaces, in the order of the file; their names in the joint; the loads on them."""
    nodes, names, forces = [], [], []
    speed = scene.velocity - np.cross(scene.omega, body.centre)
    for number, (label, place) in enumerate(body.interfaces.items(), 11):
        moving = speed + np.cross(scene.omega, place)
        nodes.append(f"structural: {number}, static, {vector(place)}, eye, {vector(moving)}, {vector(scene.omega)};")
        names.append(f'"{label}", {number}, null')
        for load in scene.loads:
            if load.interface == label:
                sine = f'string, "sin({2 * np.pi * load.tone!r}*Time)"'
                forces.append(f"force: {len(forces) + 1}, absolute, {number}, position, null, {vector(load.force)}, {sine};")
                forces.append(f"couple: {len(forces) + 1}, absolute, {number}, {vector(load.torque)}, {sine};")
    return nodes, names, forces


def lead(scene):
    """A joint that holds the frame and turns it about z; it constrains velocities."""
    held, duration = "velocity, velocity, velocity", scene.duration
    rate = f"{scene.rate!r}*(Time/{duration!r} - sin({2 * np.pi / duration!r}*Time)/{2 * np.pi!r})"
    turned = held.replace("velocity", "angular velocity")
    return f'joint: 2, total pin joint, 10, position constraint, {held}, null, orientation constraint, {turned}, single, 0., 0., 1., string, "{rate}";'


def deck(body, scene, steps, differentiation):
    """The input of MBDyn. Node 10 is the frame of the body; its origin is that of the world at the start."""
    speed = scene.velocity - np.cross(scene.omega, body.centre)
    frame = f"structural: 10, modal, null, eye, {vector(speed)}, {vector(scene.omega)};"
    # Nodes at the interfaces stand where they are undeformed: only where the modes are at rest.
    nodes, names, forces = interface_nodes(body, scene) if scene.loads else ([], [], [])
    initial = "".join(f"mode, {j + 1}, {float(q)!r}, 0., " for j, q in enumerate(scene.q) if q)
    damping = "damping from file" if body.damped else "no damping"
    head = f"joint: 1, modal, 10, {MODES}, {'initial value, ' if initial else ''}{initial}from file, {damping}, \"{body.fem}\", {len(names)}"
    joints = [", ".join([head, *names]) + ";"] + ([lead(scene)] if scene.rate else [])
    step = scene.duration / steps
    return DECK.format(
        end=scene.duration - step / 2, step=step, method=METHOD, coefficient=1e-3 * step, every=steps // INSTANTS,
        differentiation="use automatic differentiation;" if differentiation else "", nodes=1 + len(nodes), joints=len(joints), forces=len(forces),
        node_lines="\n".join([frame, *nodes]), element_lines="\n".join(joints + forces))


def mbdyn(program, body, scene, steps, differentiation=True):
    """The scene by MBDyn."""
    text, out = body.folder / "scene.mbd", body.folder / "out"
    text.write_text(deck(body, scene, steps, differentiation))
    try:
        run(program, "-s", "-f", text, "-o", out)
    except RuntimeError as error:
        if "unhandled" in str(error):
            raise Absent(f"mbdyn that knows record group 19 ({SOURCE}, or MBDYN=...)") from error
        raise
    moved = np.loadtxt(out.with_suffix(".mov"), usecols=range(13))
    frame = moved[moved[:, 0] == 10]
    axes = frame[:, 4:].reshape(-1, 3, 3)
    found = {"place": frame[:, 1:4] + (axes - np.eye(3)) @ body.centre, "axes": axes}
    found["q"] = np.loadtxt(out.with_suffix(".mod"), usecols=1).reshape(-1, MODES)
    for load in scene.loads[:1]:
        number = 11 + list(body.interfaces).index(load.interface)
        found["interface"] = moved[moved[:, 0] == number, 1:4] - body.centre
    assert all(len(one) == INSTANTS + 1 for one in found.values()), {name: len(one) for name, one in found.items()}
    return found


class Equations:
    """A free body, frame in its centre of mass. As MBDyn has it, geometric stiffness acts on the modes only, a couple on small rotations; `whole` as flexbody has it.
    State: attitude, angular velocity (axes of the body), place, velocity (axes of the world), q, q'."""

    def __init__(self, arrays, scene, whole):
        get = lambda name: arrays["invariants/" + name]
        self.mass, self.inertia, self.stiffness = get("mass")[0], get("I0"), get("modal_stiffness")
        nf = len(self.stiffness)
        self.w1, self.w2, self.w3 = get("W1").reshape(3, 3, nf), get("W2").reshape(3, nf, 3, nf), get("W3").reshape(3, nf, nf)
        self.scene, self.nf, self.whole, self.arrays = scene, nf, float(whole), arrays

    def geometric(self, *names):
        """Matrices of three axes."""
        none = np.zeros((self.nf, self.nf))
        return np.array([self.arrays.get(f"geometric_stiffness/{name}/stiffness", none) for name in names])

    def interface(self, load, q):
        """Place, motion and rotation by q, angle and rotation of second order, (7.5)."""
        place, moving, turning = (self.arrays[f"interfaces/{load.interface}/{name}"] for name in ["reference", "translation", "rotation"])
        pushed, turned = (self.geometric(*(f"{kind}_{axis}_{load.interface}" for axis in "xyz")) @ q for kind in ["force", "moment"])
        angle = turning @ q - 0.5 * self.whole * turned @ q
        return place + moving @ q - 0.5 * self.whole * pushed @ q, moving - pushed, turning - turned, angle

    def loads(self, time, turn, q):
        """Force, torque and modal forces, axes of the body."""
        force, torque, modal = np.zeros(3), np.zeros(3), np.zeros(self.nf)
        for load in self.scene.loads:
            place, moving, turning, angle = self.interface(load, q)
            f, t = turn.T @ load.force * load.history(time), turn.T @ load.torque * load.history(time)
            force += f
            torque += t + np.cross(place, f)
            modal += moving.T @ f + turning.T @ tangent(self.whole * angle).T @ t
        return force, torque, modal

    def __call__(self, time, y):
        nf, on = self.nf, self.whole
        turn, w, speed, q, qd = y[:9].reshape(3, 3), y[9:12], y[15:18], y[18:18 + nf], y[18 + nf:]
        force, torque, modal = self.loads(time, turn, q)
        pull, spin, twist = (self.geometric(*(name + axis for axis in axes)) @ q for name, axes in [
            ("acceleration_", "xyz"), ("spin_", ["xx", "yy", "zz"]), ("angular_acceleration_", "xyz")])
        by_q = self.w1 + np.einsum("ajbk,k->abj", self.w2, q) + np.einsum("ajbk,j->abk", self.w2, q)
        stiffer = -2 * np.einsum("ab,aj->abj", np.eye(3), spin)
        tensor = self.inertia + self.w1 @ q + np.einsum("ajbk,j,k->ab", self.w2, q, q) - on * np.diag(spin @ q)
        bent, drift = np.einsum("ajk,j->ak", self.w3, q), np.einsum("ajk,j->ak", self.w3, qd)
        first, coupling = on * 0.5 * pull @ q, bent + on * twist
        pulled, twisted = (on * self.geometric(*(name + axis for axis in "xyz")) @ qd @ qd for name in ["acceleration_", "angular_acceleration_"])
        right = np.concatenate([
            force - np.cross(w, np.cross(w, first)) - pulled - 2 * np.cross(w, on * pull @ qd),
            torque - (by_q + on * stiffer) @ qd @ w - np.cross(w, tensor @ w + coupling @ qd) - twisted,
            modal + 0.5 * np.einsum("a,abj,b->j", w, by_q + stiffer, w) - 2 * drift.T @ w - self.stiffness @ q])
        arm = np.cross(first, np.eye(3)).T
        left = np.block([[self.mass * np.eye(3), -arm, on * pull], [arm, tensor, coupling], [pull.T, (bent + twist).T, np.eye(nf)]])
        found = np.linalg.solve(left, right)
        return np.concatenate([np.cross(turn, w).ravel(), found[3:6], speed, turn @ found[:3], qd, found[6:]])


def tangent(angle):
    """Angular velocity by the rate of a rotation vector."""
    size, cross = np.linalg.norm(angle), np.cross(angle, np.eye(3)).T
    if size < 1e-4:
        return np.eye(3) + cross / 2 + cross @ cross / 6
    return np.eye(3) + (1 - np.cos(size)) / size**2 * cross + (size - np.sin(size)) / size**3 * cross @ cross


def written_out(body, scene, whole):
    """Places, axes and amplitudes by the equations above and scipy's DOP853."""
    arrays = dict(np.load(common.export(body.flexbody, body.path, "npz", body.folder / "body.npz")))
    equations = Equations(arrays, scene, whole)
    start = np.concatenate([np.eye(3).ravel(), scene.omega, np.zeros(3), scene.velocity, scene.q, np.zeros(MODES)])
    times = np.linspace(0, scene.duration, INSTANTS + 1)
    y = solve_ivp(equations, (0, scene.duration), start, "DOP853", times, rtol=3e-14, atol=1e-15).y.T
    place, turn, q = y[:, 12:15], y[:, :9].reshape(-1, 3, 3), y[:, 18:18 + MODES]
    at = np.array([equations.interface(scene.loads[0], one)[0] for one in q])
    return {"place": place, "axes": turn, "q": q, "interface": place + np.einsum("tab,tb->ta", turn, at)}


def scenes(body):
    """Of the bracket."""
    first, duration = float(body.first), float(3 * 2 * np.pi / body.first)
    rate, push = 0.25 * first, 0.02 * body.mass * body.length * first**2
    thrown = Scene("tumbling", duration, np.array([0.02, 1.0, 0.03]) * rate, np.array([0.1, 0.2, -0.1]) * 0.2 * first * body.length,
                   0.03 * np.sqrt(np.trace(body.inertia) / 2) * body.lam[0] / body.lam)
    load = Load("bolt_wall", 0.3 * first / (2 * np.pi), np.array([0.3, -0.2, 0.5]) * push)
    both = Load(load.interface, load.tone, load.force, np.array([-0.1, 0.2, 0.15]) * push * body.length)
    spun = np.array([0.3, -0.5, 1.0]) * rate
    return thrown, Scene("force", duration, spun, loads=[load]), Scene("couple", duration, spun, loads=[both])


def blade_scenes():
    tip, root = Load("tip", 700.0, np.array([15.0, -100.0, 40.0])), Load("root", 300.0, np.array([-3000.0, 100.0, 40.0]))
    turned = Load("root", 300.0, root.force, np.array([500.0, -40.0, 60.0]))
    return Scene("led", 1e-2, rate=1000.0, loads=[tip, root]), Scene("let go", 5e-3, np.array([10.0, 20.0, 1000.0]), loads=[tip, turned])


def difference(body, a, b, keys):
    scale = {"place": body.length, "interface": body.length, "axes": 1.0, "q": np.abs(a["q"]).max()}
    return {key: float(np.abs(a[key] - b[key]).max() / scale[key]) for key in keys}


class Table:
    """Rows of one MBDyn."""

    def __init__(self):
        self.mbdyn = common.program("mbdyn", "MBDYN", SOURCE)
        told = run(self.mbdyn, "-v").split("MultiBody Dynamics")
        self.program = f"MBDyn {told[1].split()[0]}" if len(told) > 1 else "MBDyn"
        self.rows = []

    def converging(self, model, body, scene, reference, against, keys):
        """Rows that MBDyn comes close to the reference with the order of its method; its motion."""
        far, near = (mbdyn(self.mbdyn, body, scene, steps) for steps in (STEPS, 2 * STEPS))
        before, after = (difference(body, reference, motion, keys) for motion in (far, near))
        print(f"  {model} {scene.name}: with a step, with half, beside {against}")
        for key in keys:
            print(f"  {'':10} {key:9} {before[key]:9.1e} {after[key]:9.1e}")
            falls = after[key] < ROUNDING or before[key] / after[key] > 0.7 * 2**ORDER
            self.row(model, scene, f"{against}, {key}, falling with order {ORDER}", after[key] if falls else float("inf"), key)
        return near

    def apart(self, model, body, scene, motion, why):
        """Rows of what flexbody has and MBDyn has not: its size, and that nothing else is between them."""
        ours = body.ours(scene)
        size = difference(body, ours, motion, ["axes"])["axes"]
        self.row(model, scene, f"`simulate`, axes: {why}", size, "apart")
        left = difference(body, ours, written_out(body, scene, True), ["axes", "q", "interface"])
        print(f"  {'':10} {'apart':9} {size:9.1e}   explained to {max(left.values()):.1e}")
        what = f"{model}: {scene.name}, `simulate` beside numpy with what MBDyn has not"
        self.rows.append(Row(f"numpy, scipy {scipy.__version__}", "npz", what, max(left.values()), EXPLAINED))

    def row(self, model, scene, what, value, key):
        self.rows.append(Row(self.program, "mbdyn", f"{model}: {scene.name}, {what}", value, LIMITS[scene.name][key]))


def bracket_rows(table, flexbody, folder):
    model = "bracket_hex20"
    body = Body(flexbody, folder, model)
    thrown, force, couple = scenes(body)
    table.converging(model, body, thrown, body.ours(thrown), "`simulate`", ["place", "axes", "q"])
    table.converging(model, body, force, body.ours(force), "`simulate`", ["place", "axes", "q", "interface"])
    own = table.converging(model, body, couple, written_out(body, couple, False), "numpy", ["axes", "q", "interface"])
    table.apart(model, body, couple, own, "of second order, the couple works on finite angles there")
    damped = Body(flexbody, folder, model, DAMPING, "model")
    thrown.name = "damping"
    table.converging(model, damped, thrown, damped.ours(thrown), "`simulate`", ["place", "axes", "q"])


def blade_rows(table, flexbody, folder):
    model = "turbine_blade"
    body = Body(flexbody, folder, model, GEOMETRIC)
    led, free = blade_scenes()
    ours = body.ours(led)
    table.converging(model, body, led, ours, "`simulate`", ["axes", "q"])
    blind = mbdyn(table.mbdyn, body, led, STEPS, differentiation=False)
    missed = difference(body, ours, blind, ["q"])["q"]
    table.row(model, led, "`simulate`, q: another one without `use automatic differentiation` (1: no)", float(missed < 0.1), "blind")
    own = table.converging(model, body, free, written_out(body, free, False), "numpy", ["axes", "q", "interface"])
    table.apart(model, body, free, own, "of second order, geometric stiffness acts on the frame there too")


def rows(flexbody, folder):
    table = Table()
    bracket_rows(table, flexbody, folder)
    blade_rows(table, flexbody, folder)
    return table.rows
