"""Runs of a body of a trade study in two other programs: Exudyn, with the body as `export --to exudyn` writes it, and a program in C around the header
of `export --to embedded`.

Error and seconds are those of the same run. The number of steps is the smallest found for which the error of the run against the reference of the study
(`flexbody measure`) is within what the tolerances leave. Exudyn integrates with generalised alpha, implicit, the C program with the classical Runge-Kutta
method of order 4, explicit.
"""

import csv
import json
import re
import subprocess
import time

import h5py
import numpy as np

from trade_guidelines import history, skew

# Steps per period of the highest frequency that the scene asks about (`[band]`), with which the search for the number of steps begins.
PER_PERIOD = 20
# Smallest number of steps that is tried, and largest number of instants that are compared.
FEWEST, INSTANTS = 40, 20_000
# Runs of the search; its result has at most this many times the steps that would be enough.
TRIALS, CLOSE = 5, 1.3
# Ratio of error to tolerance that the integration may add where a body exceeds the tolerances anyway, relative to the error of the body.
SHARE = 0.1
# Change of the error with the steps, relative to it, below which the integration no longer matters.
SETTLED = 0.02
# A scene that names no such frequency is followed up to this many times the first one of the body.
WITHOUT_BAND = 5
# The Runge-Kutta method of order 4 is stable up to 2.83 / omega.
STABLE = 2.5
TURNS = 3


def rotation(vector):
    """The rotation matrix of a rotation vector."""
    angle = np.linalg.norm(vector)
    if angle == 0.0:
        return np.eye(3)
    axis = skew(vector / angle)
    return np.eye(3) + np.sin(angle) * axis + (1 - np.cos(angle)) * axis @ axis


class Task:
    """A body in a scene, along the axes of the frame of its file."""

    def __init__(self, path, scene, start):
        with h5py.File(path) as file:
            self.axes = file["frame/axes"][()]
            self.eigenvalue = file["modes/eigenvalue"][()]
            self.interfaces = list(file.get("interfaces", {}))
            self.mass = float(np.ravel(file["invariants/mass"][()])[0])
            self.is_stiffened = len(file.get("geometric_stiffness", ())) > 0
        self.path, self.scene, self.nf = path, scene, len(self.eigenvalue)
        self.duration = scene["run"]["duration"]
        self.ratio = scene.get("damping", {}).get("ratio", 0.0)
        self.gravity = np.array(scene.get("gravity", [0, 0, 0]), float)
        first = scene.get("initial", {})
        self.attitude = rotation(np.array(first.get("rotation", [0, 0, 0]), float)) @ self.axes
        self.velocity = np.array(first.get("velocity", [0, 0, 0]), float)
        self.omega = self.in_body(first.get("angular_velocity", [0, 0, 0]), first.get("axes", "model"))
        self.q, self.qd = start
        spin = scene.get("spin")
        self.spin = None
        if spin is not None:
            axis = self.in_body(spin["axis"], spin.get("axes", "model"))
            self.spin = axis / np.linalg.norm(axis), history(spin["rate"]), bool(spin.get("hold"))
            self.omega = self.spin[0] * self.spin[1](0.0)[0]
        self.loads = self.grouped()
        first = np.sqrt(self.eigenvalue.min()) / (2 * np.pi)
        frequency = scene.get("band", {}).get("frequency", WITHOUT_BAND * first)
        wanted = PER_PERIOD * frequency * self.duration
        self.first_steps = int(max(np.ceil(wanted), FEWEST))

    def in_body(self, vector, axes):
        """Components along the axes of the frame of a vector that turns with the body."""
        vector = np.array(vector, float)
        return vector if axes == "body" else self.axes.T @ vector

    def grouped(self):
        """Loads by the place where they act and by whether they keep their direction in the world: [(place, in world, [(force, torque, history)])]."""
        groups = {}
        for load in self.scene.get("load", []):
            axes = load.get("axes", "world")
            place = ("node", load["node"]) if "node" in load else ("interface", load["interface"])
            vectors = [np.array(load.get(name, [0, 0, 0]), float) for name in ("force", "torque")]
            if axes != "world":
                vectors = [self.in_body(vector, axes) for vector in vectors]
            groups.setdefault((place, axes == "world"), []).append((*vectors, load.get("history", 1.0)))
        return [(place, world, members) for (place, world), members in groups.items()]

    def force_and_torque(self, members, instants):
        """Sums of the loads of a group at the instants (n x 6)."""
        total = np.zeros((len(instants), 6))
        for force, torque, value in members:
            factor = history(value)
            total += np.outer([factor(t)[0] for t in instants], np.concatenate([force, torque]))
        return total

    def angles(self, instants):
        """Integral of the rate of the spin, by Gauss points in every interval."""
        rate = self.spin[1]
        points, weights = np.polynomial.legendre.leggauss(4)
        total = [0.0]
        for a, b in zip(instants[:-1], instants[1:]):
            total.append(total[-1] + 0.5 * (b - a) * sum(w * rate(0.5 * (a + b + (b - a) * x))[0] for x, w in zip(points, weights)))
        return np.array(total)


def export(program, path, kind, target, *options):
    done = subprocess.run([program, "export", path, "--to", kind, "-o", target, "--allow-loss", "--quiet", *options], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(done.stderr)


# Exudyn


class InExudyn:
    """The body in Exudyn, made again for every run since a run changes it."""

    order = 2
    most = 20_000

    def __init__(self, program, task, folder):
        import exudyn
        from exudyn.FEM import ObjectFFRFreducedOrderInterface

        exudyn.SetWriteToConsole(False)
        self.task, self.file = task, folder / "body.hdf5"
        points = [str(name) for (kind, name), *_ in task.loads if kind == "node"]
        # Markers look at six nodes of an interface instead of all.
        export(program, task.path, "exudyn", self.file, "--points", ",".join(["interfaces", *points]) if task.interfaces else ",".join(points) or "nodes")
        self.body = ObjectFFRFreducedOrderInterface()
        self.body.LoadFromFile(str(self.file))
        with h5py.File(self.file) as file:
            self.places = {}
            self.numbers = file["nodeNumbers"][()]
            for group in file.get("interfaces", {}).values():
                name = group["name"][()]
                self.places[name.decode()] = (group["meshNodeNumbers"][()].tolist(), group["weights"][()].tolist(), group["marker"][()] == b"rigid")
        self.fewest = FEWEST

    def marker(self, system, made, place):
        from exudyn import itemInterface as items

        kind, name = place
        if kind == "node":
            node = int(np.flatnonzero(self.numbers == name)[0])
            return system.AddMarker(items.MarkerSuperElementPosition(bodyNumber=made["oFFRFreducedOrder"], meshNodeNumbers=[node], weightingFactors=[1.0])), False
        nodes, weights, turns = self.places[name]
        whole = {"bodyNumber": made["oFFRFreducedOrder"], "meshNodeNumbers": nodes, "weightingFactors": weights}
        if not turns:
            return system.AddMarker(items.MarkerSuperElementPosition(**whole)), False
        return system.AddMarker(items.MarkerSuperElementRigid(**whole, useAlternativeApproach=True)), True

    def system(self, steps):
        """The multibody system, and the sensors of the modes and of the attitude."""
        import exudyn
        from exudyn import itemInterface as items

        task = self.task
        self.steps, self.instants = steps, np.linspace(0.0, task.duration, steps + 1)
        container = exudyn.SystemContainer()
        system = container.AddSystem()
        self.body.rigidBodyNodeType = exudyn.NodeType.RotationEulerParameters
        omega = task.attitude @ task.omega
        made = self.body.AddObjectFFRFreducedOrder(system, initialVelocity=list(task.velocity), rotationMatrixRef=task.attitude, initialAngularVelocity=list(omega), gravity=list(task.gravity))
        system.SetNodeParameter(made["nGenericODE2"], "initialCoordinates", list(task.q))
        system.SetNodeParameter(made["nGenericODE2"], "initialCoordinates_t", list(task.qd))
        if task.ratio > 0:
            damping = exudyn.MatrixContainer()
            damping.SetWithDenseMatrix(np.diag(2 * task.ratio * np.sqrt(task.eigenvalue)), useDenseMatrix=False)
            system.SetObjectParameter(made["oFFRFreducedOrder"], "dampingMatrixReduced", damping)
        changing = self.loads(system, made) + self.driven(system, made)
        system.SetPreStepUserFunction(self.before_step(changing))
        sensor = system.AddSensor(items.SensorNode(nodeNumber=made["nGenericODE2"], outputVariableType=exudyn.OutputVariableType.Coordinates, storeInternal=True))
        turned = system.AddSensor(items.SensorNode(nodeNumber=made["nRigidBody"], outputVariableType=exudyn.OutputVariableType.RotationMatrix, storeInternal=True))
        system.Assemble()
        return container, system, sensor, turned

    def loads(self, system, made):
        """[(set a value of the system, values at the ends of the steps)]"""
        from exudyn import itemInterface as items

        changing = []
        for place, world, members in self.task.loads:
            values = self.task.force_and_torque(members, self.instants)
            marker, turns = self.marker(system, made, place)
            for part, kind in ((values[:, :3], items.LoadForceVector), (values[:, 3:], items.LoadTorqueVector)):
                if not part.any():
                    continue
                # A force at a single node that turns with the body has no form in Exudyn: it is given the axes of the start, turned by the spin.
                fixed = turns and not world
                load = system.AddLoad(kind(markerNumber=marker, loadVector=list(part[0]), bodyFixed=fixed))
                rows = part if world or turns else self.turned(part)
                changing.append((lambda value, load=load: system.SetLoadParameter(load, "loadVector", value), rows.tolist()))
        return changing

    def turned(self, vectors):
        axis = self.task.spin[0]
        return np.array([self.task.attitude @ rotation(angle * axis) @ vector for angle, vector in zip(self.task.angles(self.instants), vectors)])

    def driven(self, system, made):
        """The joint that gives the frame its rotation."""
        from exudyn import itemInterface as items

        task = self.task
        if task.spin is None:
            return []
        axis, _, hold = task.spin
        ground = system.AddObject(items.ObjectGround())
        markers = [system.AddMarker(items.MarkerBodyRigid(bodyNumber=ground)), system.AddMarker(items.MarkerNodeRigid(nodeNumber=made["nRigidBody"]))]
        joint = system.AddObject(items.GenericJoint(markerNumbers=markers, constrainedAxes=[int(hold)] * 3 + [1] * 3, rotationMarker0=task.attitude))
        rotations = [task.attitude @ rotation(angle * axis) for angle in task.angles(self.instants)]
        return [(lambda value: system.SetObjectParameter(joint, "rotationMarker0", value), rotations)]

    def before_step(self, changing):
        """What sets the values for the end of a step."""
        width, last = self.task.duration / self.steps, self.steps

        def set_values(system, t):
            at = min(int(t / width + 0.5), last)
            for give, values in changing:
                give(values[at])
            return True

        return set_values

    def run(self, steps):
        """A run with this number of steps."""
        import exudyn

        container, system, sensor, turned = self.system(steps)
        settings = exudyn.SimulationSettings()
        integration = settings.timeIntegration
        integration.numberOfSteps, integration.endTime = steps, self.task.duration
        integration.verboseMode, integration.adaptiveStep = 0, False
        integration.generalizedAlpha.spectralRadius = 0.9
        integration.newton.useModifiedNewton = True
        settings.solutionSettings.writeSolutionToFile = False
        every = max(1, steps // INSTANTS)
        settings.solutionSettings.sensorsWritePeriod = (every - 0.5) * self.task.duration / steps
        begin = time.process_time()
        system.SolveDynamic(settings)
        seconds = time.process_time() - begin
        modes, axes = system.GetSensorStoredData(sensor), system.GetSensorStoredData(turned)
        if modes[-1, 0] < (1 - 1e-9) * self.task.duration:
            raise RuntimeError("Exudyn stopped before the end")
        return Run(steps, seconds, modes[:, 0], modes[:, 1:], axes[:, 1:].reshape(-1, 3, 3))


# C

DRIVER = """
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "body.h"

enum { NF = FLEXBODY_BODY_MODES, NV = FLEXBODY_BODY_VELOCITIES, RIGID = NV - NF, SIZE = 4 + RIGID + 2 * NF };
static flexbody_body_evaluation e;
static const double gravity[3] = {@GRAVITY@};
static const double damping[NF] = {@DAMPING@};

static double ramp(double t, double from, double to, double start, double duration)
{
    double x = (t - start) / duration;
    x = x < 0 ? 0 : x > 1 ? 1 : x;
    return from + (to - from) * (x - sin(2 * M_PI * x) / (2 * M_PI));
}

static double ramp_rate(double t, double from, double to, double start, double duration)
{
    double x = (t - start) / duration;
    return x < 0 || x > 1 ? 0 : (to - from) * (1 - cos(2 * M_PI * x)) / duration;
}

static double table(double t, int n, const double *times, const double *values)
{
    int i = 0;
    if (t < times[0]) return values[0];
    while (i + 2 < n && t >= times[i + 1]) i++;
    if (n < 2 || t >= times[n - 1]) return values[n - 1];
    return values[i] + (values[i + 1] - values[i]) * (t - times[i]) / (times[i + 1] - times[i]);
}

/* The axes of the world along those of the body: world = A body. */
static void axes_of(const double *p, double A[3][3])
{
    double n = 1 / sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
    double a = n * p[0], x = n * p[1], y = n * p[2], z = n * p[3];
    A[0][0] = 1 - 2 * (y * y + z * z); A[0][1] = 2 * (x * y - a * z); A[0][2] = 2 * (x * z + a * y);
    A[1][0] = 2 * (x * y + a * z); A[1][1] = 1 - 2 * (x * x + z * z); A[1][2] = 2 * (y * z - a * x);
    A[2][0] = 2 * (x * z - a * y); A[2][1] = 2 * (y * z + a * x); A[2][2] = 1 - 2 * (x * x + y * y);
}

static void into_body(double A[3][3], const double *v, double *out)
{
    for (int k = 0; k < 3; k++) out[k] = A[0][k] * v[0] + A[1][k] * v[1] + A[2][k] * v[2];
}

/* State: Euler parameters, V and omega along the axes of the body, qd, q. */
static int rates(double t, const double *y, double *d)
{
    double nu[NV], applied[NV] = {0}, A[3][3], v[3];
    const double *p = y, *q = y + 4 + NV;
    memcpy(nu, y + 4, sizeof nu);
@SPIN@
    axes_of(p, A);
    flexbody_body_set(&e, q, nu);
    into_body(A, gravity, v);
    flexbody_body_add_gravity(&e, v, applied);
    for (int j = 0; j < NF; j++) applied[RIGID + j] -= damping[j] * nu[RIGID + j];
@LOADS@
    const double *w = nu + 3;
    d[0] = -0.5 * (p[1] * w[0] + p[2] * w[1] + p[3] * w[2]);
    d[1] = 0.5 * (p[0] * w[0] + p[2] * w[2] - p[3] * w[1]);
    d[2] = 0.5 * (p[0] * w[1] + p[3] * w[0] - p[1] * w[2]);
    d[3] = 0.5 * (p[0] * w[2] + p[1] * w[1] - p[2] * w[0]);
    memcpy(d + 4 + NV, nu + RIGID, NF * sizeof(double));
@SOLVE@
}

static void sample(double *row, double t, const double *y)
{
    row[0] = t;
    memcpy(row + 1, y, 4 * sizeof(double));
    memcpy(row + 5, y + 4 + NV, NF * sizeof(double));
}

/* Arguments: the body, the number of steps, the number of steps between two samples, the file of the samples. */
int main(int argc, char **argv)
{
    long steps = atol(argv[2]), every = atol(argv[3]), count = 0;
    double *samples = malloc(sizeof(double) * (5 + NF) * (size_t)(steps / every + 2));
    double h = @DURATION@ / (double)steps, y[SIZE] = {@START@}, k[4][SIZE], s[SIZE];
    FILE *file = fopen(argv[1], "rb");
    static _Alignas(64) unsigned char data[FLEXBODY_BODY_BYTES];
    if (argc < 5 || !samples || !file || fread(data, 1, sizeof data, file) != sizeof data || flexbody_body_open(&e, data, sizeof data)) return 2;
    clock_t begin = clock();
    for (long i = 0; i < steps; i++) {
        double t = h * (double)i;
        if (i % every == 0) sample(samples + (5 + NF) * count++, t, y);
        if (rates(t, y, k[0])) return 3;
        for (int j = 0; j < SIZE; j++) s[j] = y[j] + 0.5 * h * k[0][j];
        if (rates(t + 0.5 * h, s, k[1])) return 3;
        for (int j = 0; j < SIZE; j++) s[j] = y[j] + 0.5 * h * k[1][j];
        if (rates(t + 0.5 * h, s, k[2])) return 3;
        for (int j = 0; j < SIZE; j++) s[j] = y[j] + h * k[2][j];
        if (rates(t + h, s, k[3])) return 3;
        for (int j = 0; j < SIZE; j++) y[j] += h / 6 * (k[0][j] + 2 * k[1][j] + 2 * k[2][j] + k[3][j]);
    }
    sample(samples + (5 + NF) * count++, h * (double)steps, y);
    printf("%.9g\\n", (double)(clock() - begin) / CLOCKS_PER_SEC);
    file = fopen(argv[4], "wb");
    return !file || fwrite(samples, sizeof(double) * (5 + NF), (size_t)count, file) != (size_t)count || fclose(file) ? 4 : 0;
}
"""


def numbers(values):
    return ", ".join(repr(float(value)) for value in np.ravel(values))


def in_c(value, rate=False):
    """A history of a scene, or its rate, as an expression of t."""
    if isinstance(value, (int, float)):
        return "0.0" if rate else repr(float(value))
    if "times" in value:
        assert not rate, "a spin by a table"
        count = len(value["times"])
        return f"table(t, {count}, (const double[]){{{numbers(value['times'])}}}, (const double[]){{{numbers(value['values'])}}})"
    if "amplitude" in value:
        omega, phase = 2 * np.pi * value["frequency"], value.get("phase", 0.0)
        size, shape = (value["amplitude"] * omega, "cos") if rate else (value["amplitude"], "sin")
        return f"{size!r} * {shape}({omega!r} * t + {float(phase)!r})"
    arguments = [value.get("from", 0.0), value["to"], value.get("start", 0.0), value["duration"]]
    return f"{'ramp_rate' if rate else 'ramp'}(t, {numbers(arguments)})"


class InC:
    """The body in a C program that is compiled for it."""

    order = 4
    most = 500_000

    def __init__(self, program, task, folder):
        self.task, self.folder = task, folder
        points = [str(name) for (kind, name), *_ in task.loads if kind == "node"]
        # The header has the name of the model, which is put aside for one that all bodies share.
        options = ["--points", ",".join(["interfaces", *points]) if task.interfaces else ",".join(points)] if points else []
        export(program, task.path, "embedded", folder / "body.bin", *options)
        self.source()
        done = subprocess.run(["cc", "-O3", "-march=native", "-std=gnu11", "driver.c", "-o", "driver", "-lm"], cwd=folder, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(done.stderr)
        highest = np.sqrt(task.eigenvalue.max())
        self.fewest = max(FEWEST, int(np.ceil(task.duration * highest / STABLE)))

    def source(self):
        header = (self.folder / "body.h").read_text()
        prefix = re.search(r"\b(flexbody_\w+)_evaluation\b", header).group(1)
        header = header.replace(prefix, "flexbody_body").replace(prefix.upper(), "FLEXBODY_BODY")
        (self.folder / "body.h").write_text(header)
        size = (self.folder / "body.bin").stat().st_size
        text = DRIVER.replace("FLEXBODY_BODY_BYTES", str(size))
        task = self.task
        parameters = euler_parameters(task.attitude)
        start = np.concatenate([parameters, task.attitude.T @ task.velocity, task.omega, task.qd, task.q])
        parts = {
            "GRAVITY": numbers(task.gravity), "DAMPING": numbers(2 * task.ratio * np.sqrt(task.eigenvalue)), "START": numbers(start),
            "DURATION": repr(float(task.duration)), "LOADS": self.loads(header), "SPIN": self.spin(), "SOLVE": self.solve(),
        }
        for name, value in parts.items():
            text = text.replace(f"@{name}@", value)
        (self.folder / "driver.c").write_text(text)

    def loads(self, header):
        lines = []
        for (kind, name), world, members in self.task.loads:
            frame = f"FLEXBODY_BODY_FRAME_{str(name).upper()}" if kind == "interface" else f"flexbody_body_frame(&e, {name})"
            assert kind == "node" or frame in header, frame
            parts = [("force", 0), ("torque", 1)]
            lines.append("    {")
            lines += [f"        const double c{i} = {in_c(value)};" for i, (_, _, value) in enumerate(members)]
            for part, at in parts:
                if not any(member[at].any() for member in members):
                    continue
                sums = [" + ".join(f"c{i} * {float(member[at][k])!r}" for i, member in enumerate(members) if member[at][k] != 0.0) or "0.0" for k in range(3)]
                lines.append(f"        const double {part}[3] = {{{', '.join(sums)}}};")
                lines.append(f"        into_body(A, {part}, v);" if world else f"        memcpy(v, {part}, sizeof v);")
                lines.append(f"        flexbody_body_add_{part}(&e, {frame}, v, applied);")
            lines.append("    }")
        return "\n".join(lines)

    def spin(self):
        if self.task.spin is None:
            return ""
        axis, _, hold = self.task.spin
        rate = in_c(self.task.scene["spin"]["rate"])
        lines = [f"    const double axis[3] = {{{numbers(axis)}}}, rate = {rate};", "    for (int k = 0; k < 3; k++) nu[3 + k] = rate * axis[k];"]
        if hold:
            lines.append("    nu[0] = nu[1] = nu[2] = 0;")
        return "\n".join(lines)

    def solve(self):
        if self.task.spin is None:
            return "    return flexbody_body_accelerations(&e, applied, d + 4) != FLEXBODY_BODY_OK;"
        # The modal mass is the identity, and free modes do not move the centre of mass: what is driven takes no part in the solution.
        slope = in_c(self.task.scene["spin"]["rate"], rate=True)
        # The centre of mass accelerates by the loads unless it is held: geometric stiffness depends on it.
        pushed = "" if self.task.spin[2] else f"    for (int k = 0; k < 3; k++) prescribed[k] = applied[k] / {self.task.mass!r};\n"
        return f"""    double prescribed[NV] = {{0}}, force[NV];
{pushed}    for (int k = 0; k < 3; k++) prescribed[3 + k] = axis[k] * ({slope});
    flexbody_body_balance(&e, prescribed, force);
    memset(d + 4, 0, RIGID * sizeof(double));
    for (int j = 0; j < NF; j++) d[4 + RIGID + j] = applied[RIGID + j] - force[RIGID + j];
    return 0;"""

    def run(self, steps):
        """A run with this number of steps."""
        every = max(1, steps // INSTANTS)
        done = subprocess.run(["./driver", "body.bin", str(steps), str(every), "samples.bin"], cwd=self.folder, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"the C program ended with {done.returncode}")
        rows = np.fromfile(self.folder / "samples.bin").reshape(-1, 5 + self.task.nf)
        axes = np.array([axes_of(row) for row in rows[:, 1:5]])
        return Run(steps, float(done.stdout), rows[:, 0], rows[:, 5:], axes)


class Run:
    """A run of another program: its number of steps, its seconds, and its motion at its instants. `attitude` has the axes of the frame of the body in
    the world."""

    def __init__(self, steps, seconds, instants, q, attitude):
        self.steps, self.seconds, self.instants, self.q, self.attitude = steps, seconds, instants, q, attitude

    def error(self, measure, task, path):
        """Ratio of error to tolerance against the reference of the study."""
        if not np.isfinite(self.q).all() or not np.isfinite(self.attitude).all():
            return np.inf
        with open(path, "w", newline="") as file:
            rows = csv.writer(file)
            rows.writerow(["time", *(f"attitude_{k}" for k in range(4)), *(f"q_{j + 1}" for j in range(task.nf))])
            for t, axes, q in zip(self.instants, self.attitude, self.q):
                rows.writerow([repr(float(value)) for value in (t, *euler_parameters(axes @ task.axes.T), *q)])
        return measure(task.path, path)


class Measure:
    """`flexbody measure` against the reference of a study."""

    def __init__(self, program, scene, reference, model):
        self.words, self.against = [program, "measure"], ["--scene", scene, "--reference", reference, "--model", model, "--json"]

    def __call__(self, body, history):
        words = [*self.words, body, *self.against, "--history", history]
        done = subprocess.run(list(map(str, words)), capture_output=True, text=True)
        if done.returncode not in (0, 1):
            raise self.refused(done, history)
        return json.loads(done.stdout)["results"]["worst"]

    @staticmethod
    def refused(done, history):
        """The error of `measure`: a `ValueError` if no run of the body can be measured, because scene or body are refused and not the run."""
        told = json.loads(done.stdout)["diagnostics"] if done.stdout else []
        message = next((one["message"] for one in told if one["severity"] == "error"), done.stderr)
        of_run = not told or any(one["file"] == str(history) for one in told)
        return RuntimeError(message) if of_run else ValueError(f"not measured: {message}")


def cheapest(program, measure, task, worst, most, folder):
    """The run with the fewest steps found whose error is within `most` times the tolerance, and that error, for a body with the error `worst`.

    Steps are increased until the error of the integration, which is proportional to a power of the step, is small enough, and then reduced as long as it
    leaves room. If no number of steps is enough, the run with the smallest error; the third value then is False. `None` if no run comes to its end.
    """
    allowed = most if worst <= most else (1 + SHARE) * worst
    room = max(allowed - worst, SHARE * allowed)
    steps, best, too_few, last = max(task.first_steps, program.fewest), None, program.fewest - 1, np.inf
    closest = None
    for _ in range(TRIALS):
        try:
            run = program.run(steps)
            error = run.error(measure, task, folder / "run.csv")
        except RuntimeError:
            run, error = None, np.inf
        if np.isfinite(error) and (closest is None or error < closest[1]):
            closest = run, error
        if error <= allowed:
            best = run, error
        else:
            too_few = max(too_few, steps)
        if error > allowed and abs(error - last) < SETTLED * error:
            # More steps change nothing: the program lacks a term of the body.
            break
        last = error
        added = abs(error - worst) if np.isfinite(error) else np.inf
        factor = np.clip((added / room) ** (1 / program.order) * 1.1, 0.25, 4.0)
        wanted = int(np.ceil(steps * factor))
        most_steps = best[0].steps if best else program.most
        wanted = int(np.clip(wanted, too_few + 1, most_steps))
        if best and (wanted * CLOSE >= best[0].steps or best[0].steps <= program.fewest):
            break
        if steps == wanted:
            break
        steps = wanted
    return (*best, True) if best else closest and (*closest, False)


def axes_of(parameters):
    """The rotation matrix of Euler parameters."""
    a, x, y, z = parameters / np.linalg.norm(parameters)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - a * z), 2 * (x * z + a * y)],
                     [2 * (x * y + a * z), 1 - 2 * (x * x + z * z), 2 * (y * z - a * x)],
                     [2 * (x * z - a * y), 2 * (y * z + a * x), 1 - 2 * (x * x + y * y)]])


def euler_parameters(a):
    """Of a rotation matrix, by its largest parameter."""
    squares = 0.25 * np.array([1 + a[0, 0] + a[1, 1] + a[2, 2], 1 + a[0, 0] - a[1, 1] - a[2, 2], 1 - a[0, 0] + a[1, 1] - a[2, 2], 1 - a[0, 0] - a[1, 1] + a[2, 2]])
    largest = int(np.argmax(squares))
    p = np.zeros(4)
    p[largest] = np.sqrt(squares[largest])
    skew_part = [a[2, 1] - a[1, 2], a[0, 2] - a[2, 0], a[1, 0] - a[0, 1]]
    if largest == 0:
        p[1:] = np.array(skew_part) / (4 * p[0])
        return p
    k = largest - 1
    p[0] = skew_part[k] / (4 * p[largest])
    for other in range(3):
        if other != k:
            p[1 + other] = (a[k, other] + a[other, k]) / (4 * p[largest])
    return p
