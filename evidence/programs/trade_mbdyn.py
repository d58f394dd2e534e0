"""Runs of a body of a trade study in MBDyn, with the body as `export --to mbdyn` writes it; for `make_trade.py` where MBDyn is installed.

MBDyn of 2024 or later (record group 19) is found by the variable MBDYN or on the PATH. It integrates with its diagonally implicit Runge-Kutta method of order 3,
`DIRK43`, and keeps the Jacobian matrix over several iterations. At equal error this takes a fifth of the seconds of `ms, 0.9` of order 2 for the recommended body of the
satellite that tumbles, and two thirds for that of the plate of the conveyor; `DIRK54` of order 4 takes as long.

A joint prescribes the angular velocity of the frame, loads act on massless nodes that the modal joint ties to the body. Loads that turn with a driven body are
turned by the angle of the spin; on a free body they are follower forces, which also turn with the rotation of their interface.
"""

import os
import resource
import shutil
import subprocess

import h5py
import numpy as np

from trade_guidelines import skew
from trade_seconds import FEWEST, INSTANTS, Run, export, numbers

# Instants at which the sizes of the loads are compared.
SAMPLES = 2000
# Label of the frame of the body, and of the first node at an interface.
FRAME, FIRST = 10, 11
# Residual that ends the Newton iterations of a step: over the largest force of the scene (1e-4 changes the error of the plate of the conveyor by 3 % of the
# tolerance), and over the largest angular velocity that a joint prescribes, in whose equations it is an angular velocity.
FORCE_RESIDUAL, RATE_RESIDUAL = 1e-7, 1e-6
# Record group 19 has matrices of motions up to this index, and beyond it six for each interface node of the joint.
MOTIONS = 12
DECK = """
begin: data; problem: initial value; end: data;
begin: initial value;
    initial time: 0.; final time: {end!r}; time step: {step!r};
    method: {method}; linear solver: naive, colamd; nonlinear solver: newton raphson, modified, 50, keep jacobian matrix;
    tolerance: {tolerance!r}; max iterations: 30, at most; derivatives tolerance: {of_forces!r}; derivatives max iterations: 30; derivatives coefficient: {coefficient!r};
end: initial value;
begin: control data;
    structural nodes: {nodes}; joints: {joints}; forces: {forces}; {gravity} skip initial joint assembly; {differentiation}
    default orientation: orientation matrix; output precision: 17; default output: none, structural nodes, joints; output meter: meter, 0., forever, steps, {every};
end: control data;
begin: nodes;
{node_lines}
end: nodes;
begin: elements;
{element_lines}
end: elements;
"""


def installed():
    """The path of MBDyn, or `None`."""
    return os.environ.get("MBDYN") or shutil.which("mbdyn")


def version():
    """The version that MBDyn gives itself."""
    told = subprocess.run([installed(), "-v"], capture_output=True, text=True, check=True).stdout.split("MultiBody Dynamics")
    return told[1].split()[0] if len(told) > 1 else ""


def in_mbdyn(value):
    """A history of a scene as a drive of MBDyn."""
    if isinstance(value, (int, float)):
        return f"const, {float(value)!r}"
    if "times" in value:
        if len(value["times"]) == 1:
            return in_mbdyn(value["values"][0])
        return f"piecewise linear, {len(value['times'])}, {numbers(np.column_stack([value['times'], value['values']]))}"
    if "amplitude" in value:
        return f'string, "{float(value["amplitude"])!r}*sin({2 * np.pi * value["frequency"]!r}*Time + ({float(value.get("phase", 0.0))!r}))"'
    first, fraction = float(value.get("from", 0.0)), fraction_of(value)
    return f'string, "{first!r} + ({value["to"] - first!r})*({fraction} - sin({2 * np.pi!r}*{fraction})/{2 * np.pi!r})"'


def fraction_of(ramp):
    """The part of its duration that a ramp has behind it, as an expression of time."""
    return f"min(max((Time - ({float(ramp.get('start', 0.0))!r}))/{float(ramp['duration'])!r}, 0.), 1.)"


def angle(rate):
    """The integral over time of the rate of a spin, as an expression."""
    if isinstance(rate, (int, float)):
        return f"{float(rate)!r}*Time"
    if "times" in rate:
        raise RuntimeError("not run: loads turn with a spin by a table, whose integral is no expression of MBDyn")
    if "amplitude" in rate:
        omega, phase = 2 * np.pi * rate["frequency"], float(rate.get("phase", 0.0))
        return f"{rate['amplitude'] / omega!r}*({float(np.cos(phase))!r} - cos({omega!r}*Time + ({phase!r})))"
    if rate.get("start", 0.0) < 0.0:
        raise RuntimeError("not run: loads turn with a spin whose ramp starts before the scene")
    first, duration, x = float(rate.get("from", 0.0)), float(rate["duration"]), fraction_of(rate)
    after = f"max(Time - ({float(rate.get('start', 0.0)) + duration!r}), 0.)"
    ramp = f"{duration!r}*(0.5*{x}*{x} + (cos({2 * np.pi!r}*{x}) - 1.)/{4 * np.pi**2!r}) + {after}"
    return f"{first!r}*Time + ({rate['to'] - first!r})*({ramp})"


class Points:
    """Labels, places, translations and rotations by the modes (points x 3 x modes) of the nodes of a file, and whether it has damping and geometric stiffness, of motions or also of loads."""

    def __init__(self, path, modes):
        groups, at = {}, None
        for line in path.read_text().splitlines():
            if line.startswith("** RECORD GROUP"):
                at = int(line.split()[3].rstrip(","))
            elif not line.startswith("**"):
                groups.setdefault(at, []).append(line)
        self.labels = [label.strip() for label in groups[2]]
        self.places = np.array([[float(value) for value in groups[k]] for k in (5, 6, 7)]).T
        shapes = np.array([line.split() for line in groups[8]], float).reshape(modes, len(self.labels), 6)
        self.translations, self.rotations = (shapes[:, :, part].transpose(1, 2, 0) for part in (slice(0, 3), slice(3, 6)))
        self.is_damped, self.is_stiffened = 13 in groups, 19 in groups
        self.has_loads = any(len(line.split()) == 1 and int(line) > MOTIONS for line in groups.get(19, []) if line.strip().isdigit())


class InMbdyn:
    """The body in MBDyn, by an input file for every run."""

    order = 3
    most = 20_000
    method = "DIRK43"

    def __init__(self, program, task, folder):
        self.task, self.folder, self.mbdyn = task, folder.resolve(), installed()
        if "bands" in task.scene.get("damping", {}):
            raise RuntimeError("not run: damping by bands of frequency")
        self.file = self.folder / "body.fem"
        points = [str(name) for (kind, name), *_ in task.loads if kind == "node"]
        export(program, task.path, "mbdyn", self.file, "--points", ",".join((["interfaces"] if task.interfaces else []) + points) or "nodes")
        self.points = Points(self.file, task.nf)
        self.fewest = FEWEST
        self.tied = self.tied_nodes()
        self.of_forces, self.of_rates = self.residuals()
        # Reading of the files takes as long in every run.
        self.start_up = self.seconds(task.first_steps, 1)

    def tied_nodes(self):
        """Numbers, in the file, of the nodes that the joint ties: those with loads, or all in their order where record group 19 has loads at them."""
        wanted = {self.number(name) for (_, name), *_ in self.task.loads}
        return list(range(len(self.points.labels))) if wanted and self.points.has_loads else sorted(wanted)

    def number(self, name):
        if str(name) not in self.points.labels:
            raise RuntimeError(f"not run: the file of MBDyn has no node for the load at {name}")
        return self.points.labels.index(str(name))

    def residuals(self):
        """Residuals that end the Newton iterations, of forces and of angular velocities. The largest force is one of: elastic and inertia forces at the start, gravity, loads, and the centrifugal force of the undeformed body."""
        task, instants = self.task, np.linspace(0.0, self.task.duration, SAMPLES + 1)
        with h5py.File(task.path) as file:
            radius = np.sqrt(np.trace(file["invariants/I0"][()]) / 2)
        rate = np.linalg.norm(task.omega) if task.spin is None else max(abs(task.spin[1](t)[0]) for t in instants)
        forces = [np.linalg.norm(task.eigenvalue * task.q), np.linalg.norm(np.sqrt(task.eigenvalue) * task.qd), np.linalg.norm(task.mass * task.gravity), radius * rate**2]
        for (_, name), _, members in task.loads:
            at, values = self.number(name), task.force_and_torque(members, instants)
            forces += [np.abs(values).max(), np.linalg.norm(values[:, :3] @ self.points.translations[at] + values[:, 3:] @ self.points.rotations[at], axis=1).max()]
        return FORCE_RESIDUAL * float(max(forces)), RATE_RESIDUAL * float(rate) if task.spin is not None and rate > 0 else np.inf

    def deck(self, steps, taken):
        """The input of MBDyn for some of the steps of the scene."""
        task, step = self.task, self.task.duration / steps
        nodes = [self.frame(), *(self.node(label, at) for label, at in enumerate(self.tied, FIRST))]
        joints, forces = [self.modal(), *self.driven()], self.forces()
        gravity = [f"gravity: uniform, {numbers(task.gravity)}, const, 1.;"] if task.gravity.any() else []
        return DECK.format(
            end=(taken - 0.5) * step, step=step, method=self.method, of_forces=self.of_forces, tolerance=min(self.of_forces, self.of_rates), coefficient=1e-3 * step, every=max(1, steps // INSTANTS),
            differentiation="use automatic differentiation;" if self.points.is_stiffened else "", gravity="gravity;" if gravity else "",
            nodes=len(nodes), joints=len(joints), forces=len(forces), node_lines="\n".join(nodes), element_lines="\n".join(joints + gravity + forces))

    def frame(self):
        task = self.task
        return f"structural: {FRAME}, modal, null, matr, {numbers(task.attitude)}, {numbers(task.velocity)}, {numbers(task.attitude @ task.omega)};"

    def node(self, label, at):
        """A node without mass where the deformed body has it at the start, with its velocity there."""
        task, points = self.task, self.points
        translation, rotation, turn = points.translations[at], points.rotations[at], task.attitude
        place = points.places[at] + translation @ task.q
        moving = task.velocity + turn @ (np.cross(task.omega, place) + translation @ task.qd)
        turning = turn @ (task.omega + rotation @ task.qd)
        # The nearest rotation to I + skew(rotation q), which the modal joint has.
        left, _, right = np.linalg.svd(np.eye(3) + skew(rotation @ task.q))
        return f"structural: {label}, static, {numbers(turn @ place)}, matr, {numbers(turn @ left @ right)}, {numbers(moving)}, {numbers(turning)}, output, no;"

    def modal(self):
        """The joint that is the body."""
        task = self.task
        initial = "".join(f"mode, {j + 1}, {float(q)!r}, {float(qd)!r}, " for j, (q, qd) in enumerate(zip(task.q, task.qd)) if q or qd)
        damping = f"single factor damping, {float(task.ratio)!r}" if task.ratio > 0 else "damping from file" if self.points.is_damped and "damping" not in task.scene else "no damping"
        tied = "".join(f', "{self.points.labels[at]}", {label}, null' for label, at in enumerate(self.tied, FIRST))
        return f'joint: 1, modal, {FRAME}, {task.nf}, {"initial value, " if initial else ""}{initial}from file, {damping}, "{self.file}", {len(self.tied)}{tied};'

    def driven(self):
        """The joint that prescribes the angular velocity of the frame, and holds it where the scene does. Constraints of velocities keep the order of the method."""
        task = self.task
        if task.spin is None:
            return []
        axis, _, hold = task.spin
        held = "position constraint, velocity, velocity, velocity, null, " if hold else ""
        turned = f"orientation constraint, angular velocity, angular velocity, angular velocity, single, {numbers(task.attitude @ axis)}, {in_mbdyn(task.scene['spin']['rate'])}"
        return [f"joint: 2, total pin joint, {FRAME}, {held}{turned}, output, no;"]

    def forces(self):
        """Forces and couples at the tied nodes."""
        lines = []
        for (_, name), world, members in self.task.loads:
            node = FIRST + self.tied.index(self.number(name))
            turns = not world and self.task.spin is None
            for at, (kind, position) in enumerate((("force", "position, null, "), ("couple", ""))):
                parts = [part for member in members if member[at].any() for part in self.parts(member[at], member[2], world)]
                if parts:
                    lines.append(f"{kind}: {len(lines) + 1}, {'follower' if turns else 'absolute'}, {node}, {position}array, {len(parts)}, {', '.join(parts)};")
        return lines

    def parts(self, vector, value, world):
        """A load as drives of vectors; one that turns with a driven body is turned about the axis of the spin."""
        task, drive = self.task, in_mbdyn(value)
        if world or task.spin is None:
            return [f"{numbers(vector)}, {drive}"]
        axis, turned = task.spin[0], angle(task.scene["spin"]["rate"])
        along = axis * (axis @ vector)
        vectors = [along, vector - along, np.cross(axis, vector)]
        factors = [drive, *(f'mult, {drive}, string, "{shape}({turned})"' for shape in ("cos", "sin"))]
        return [f"{numbers(task.attitude @ one)}, {factor}" for one, factor in zip(vectors, factors) if one.any()]

    def seconds(self, steps, taken):
        """Seconds of the processor for some of the steps of the scene, start-up included."""
        text = self.folder / "scene.mbd"
        text.write_text(self.deck(steps, taken))
        begin = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run([self.mbdyn, "-s", "-f", text, "-o", self.folder / "out"], capture_output=True, text=True)
        end = resource.getrusage(resource.RUSAGE_CHILDREN)
        if done.returncode != 0:
            raise RuntimeError(f"MBDyn ended with {done.returncode}: {'; '.join(done.stderr.strip().splitlines()[-3:])}")
        return end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime

    def run(self, steps):
        """A run with this number of steps."""
        seconds = self.seconds(steps, steps) - self.start_up
        axes = np.loadtxt(self.folder / "out.mov", usecols=range(4, 13), ndmin=2).reshape(-1, 3, 3)
        q = np.loadtxt(self.folder / "out.mod", usecols=1).reshape(-1, self.task.nf)
        every = max(1, steps // INSTANTS)
        return Run(steps, seconds, np.arange(len(q)) * every * self.task.duration / steps, q, axes)
