#!/usr/bin/env python3
"""Cost of the equations of motion beside Exudyn's ObjectFFRFreducedOrder and dense matrices; writes evidence/pages/dynamics.md.

    python3 -m venv target/peers && target/peers/bin/pip install exudyn==1.13.6 h5py numpy scipy
    cargo build --release --locked
    target/peers/bin/python benches/dynamics.py            a minute or two

The same free body, modes and start in both programs: steps of the classical Runge-Kutta method, four evaluations each. Both take turns; CPU
seconds are differences of a long and a short run, so that reading and set-up do not count. The ratio of every turn is formed by itself, and
medians are told. Exits with 1, and writes nothing, when the trajectories differ by more than they should.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
import warnings
from importlib.metadata import version
from pathlib import Path
from statistics import median

import h5py
import numpy as np

sys.path.append(str(Path(__file__).resolve().parent / "peers"))
from measure import node_order, read_model  # noqa: E402

warnings.filterwarnings("ignore", category=DeprecationWarning)  # settings of Exudyn under their older names
import exudyn as exu  # noqa: E402
from exudyn.FEM import FEMinterface, ObjectFFRFreducedOrderInterface  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
BODIES = ["bracket_hex20", "connecting_rod"]
MODES = [20, 90]
STEPS = {20: 1500, 90: 150}  # of Exudyn in one turn
MORE = {20: 30, 90: 60}  # times as many of ours
TURNS = 5
AGREEMENT = 1e-9  # of places, axes and amplitudes, relative
EVALUATIONS = 4  # of a step


def bench(name):
    """The program that cargo makes of a bench."""
    command = ["cargo", "bench", "--bench", name, "--no-run", "--message-format=json"]
    made = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
    found = [m["executable"] for m in map(json.loads, made.splitlines()) if m.get("executable") and m["target"]["name"] == name]
    return found[-1]


class Start:
    """A body on disk, and a spin and deformation that suit it; a step at which the fastest mode is resolved."""

    def __init__(self, flexbody, name, modes, folder):
        self.name, self.modes, self.path = name, modes, folder / f"{name}-{modes}.flex.h5"
        model = ROOT / "fixtures/models" / name
        subprocess.run([flexbody, "convert", model / "model.toml", "--modes", str(modes), "--lumped", "none", "--quiet",
                        "-o", self.path], check=True, stdout=subprocess.DEVNULL)
        _, self.mass, _ = read_model(model)
        with h5py.File(self.path) as f:
            # The body's nodes have another order than the rows of M.
            place = {node: i for i, node in enumerate(f["nodes/id"][()])}
            order = [place[node] for node in node_order(model)]
            self.positions, shapes = f["nodes/position"][()][order], f["modes/shape"][()][:, order]
            self.lam, inertia, mass = f["modes/eigenvalue"][()], f["invariants/I0"][()], f["invariants/mass"][0]
        self.shapes = shapes.reshape(modes, -1).T.copy()
        first, self.size = np.sqrt(self.lam[0]), np.sqrt(np.linalg.norm(inertia))
        self.length = self.size / np.sqrt(mass)
        self.step = 0.1 / np.sqrt(self.lam[-1])
        self.omega = np.array([0.1, 1.0, 0.05]) * 0.2 * first
        self.velocity = np.array([0.1, 0.2, -0.1]) * 0.2 * first * self.length
        self.q = 0.05 * self.size * self.lam[0] / self.lam


class Ours:
    def __init__(self, program, start, scratch):
        self.program, self.start, self.file = program, start, scratch / "start.json"

    def run(self, steps, repeats, factor=1.0):
        """CPU seconds of the whole process, and the last state."""
        s = self.start
        self.file.write_text(json.dumps({
            "body": str(s.path), "step": s.step * factor, "steps": steps, "repeats": repeats, "velocity": list(s.velocity),
            "omega": list(s.omega), "q": list(s.q), "qd": [0.0] * s.modes}))
        process = subprocess.Popen([self.program, self.file, "--bench"], stdout=subprocess.PIPE)
        text = process.stdout.read()
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        assert process.returncode == 0
        return used.ru_utime + used.ru_stime, json.loads(text)

    def per_step(self, steps):
        many = MORE[self.start.modes]
        return (self.run(steps, many + 1)[0] - self.run(steps, 1)[0]) / (steps * many)


class Exudyn:
    """Rotation vector, integrated on its Lie group: Euler parameters come with a constraint that explicit methods cannot take."""

    def __init__(self, start):
        self.start = start
        fem = FEMinterface()
        # M = Ms kron I in body axes as well as in those of the model. K is not used: its place is taken by the eigenvalues.
        fem.nodes, fem.massMatrix, fem.stiffnessMatrix = {"Position": start.positions}, start.mass, start.mass
        fem.modeBasis = {"matrix": start.shapes, "type": "NormalModes"}
        self.body = ObjectFFRFreducedOrderInterface(fem, rigidBodyNodeType="NodeType.RotationRotationVector")
        self.body.stiffnessMatrixReduced = np.diag(start.lam)

    def run(self, steps, solver, factor=1.0):
        container = exu.SystemContainer()
        system = container.AddSystem()
        made = self.body.AddObjectFFRFreducedOrderWithUserFunctions(
            exu, system, initialVelocity=list(self.start.velocity), initialAngularVelocity=list(self.start.omega))
        system.SetNodeParameter(made["nGenericODE2"], "initialCoordinates", list(self.start.q))
        system.Assemble()
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps = steps
        settings.timeIntegration.endTime = steps * self.start.step * factor
        settings.solutionSettings.writeSolutionToFile = False
        settings.solutionSettings.sensorsWritePeriod = 1e9
        settings.linearSolverType = solver
        began = time.process_time()
        system.SolveDynamic(settings, solverType=exu.DynamicSolverType.RK44)
        seconds = time.process_time() - began
        read = lambda what: np.array(system.GetNodeOutput(made["nRigidBody"], what))
        return seconds, {"origin": read(exu.OutputVariableType.Position),
                         "axes": read(exu.OutputVariableType.RotationMatrix).reshape(3, 3),
                         "q": np.array(system.GetNodeOutput(made["nGenericODE2"], exu.OutputVariableType.Coordinates))}

    def per_step(self, steps, solver):
        return (self.run(steps + steps // 10, solver)[0] - self.run(steps // 10, solver)[0]) / steps


def difference(start, a, b):
    scale = {"origin": start.length, "axes": 1.0, "q": np.linalg.norm(start.q)}
    return max(float(np.abs(np.array(a[key]) - np.array(b[key])).max()) / size for key, size in scale.items())


SOLVERS = {"dense": exu.LinearSolverType.EXUdense, "sparse": exu.LinearSolverType.EigenSparse}


def compare(flexbody, steps_program, name, modes, scratch):
    start = Start(flexbody, name, modes, scratch)
    ours, theirs, steps = Ours(steps_program, start, scratch), Exudyn(start), STEPS[modes]
    # The same span with half the step: the error of the method falls to a sixteenth, a difference of the equations stays.
    differences = [difference(start, ours.run(n, 1, f)[1], theirs.run(n, SOLVERS["sparse"], f)[1])
                   for n, f in [(steps, 1.0), (2 * steps, 0.5)]]
    turns = [(ours.per_step(steps), {k: theirs.per_step(steps, v) for k, v in SOLVERS.items()}) for _ in range(TURNS)]
    fastest = min(SOLVERS, key=lambda k: median(their[k] for _, their in turns))
    micro = lambda values: median(values) / EVALUATIONS * 1e6
    span = steps * start.step * np.sqrt(start.lam[0]) / (2 * np.pi)
    found = {"body": name, "modes": modes, "nodes": len(start.positions), "ours": micro(own for own, _ in turns),
             "theirs": micro(their[fastest] for _, their in turns), "solver": fastest,
             "ratios": sorted(their[fastest] / own for own, their in turns), "differences": differences, "periods": float(span)}
    print(found, file=sys.stderr, flush=True)
    return found


PAGE = """\
<!-- Written by benches/dynamics.py; edit that -->

# Cost of the equations of motion

`benches/dynamics.py` wrote this page on {machine}; Python {python}, exudyn {exudyn}, numpy {numpy}. One thread each.

## Compared with Exudyn's `ObjectFFRFreducedOrder`

The same free body, tumbling and bent: the same modes and mass matrix (Exudyn forms its own invariants from them), start and step, the
classical Runge-Kutta method in both programs (Exudyn: `RK44` with the rotation vector on its Lie group, as Euler parameters bring a constraint that
explicit methods cannot take, and the faster of its dense and sparse solvers). Microseconds of CPU time per evaluation of the accelerations, a quarter of
a step, overhead of either integrator included: medians of {turns} turns; the ratio is formed in every turn.

| body | nodes | modes | flexbody (us) | Exudyn (us) | ratio, median (least to most) |
|---|---|---|---|---|---|
{peers}

The trajectories: largest difference of place (over the radius of gyration), direction cosines and amplitudes (over |q| at the start) at the
end, with this step and with half of it.

| body | modes | steps | periods of the first mode | difference | with half the step |
|---|---|---|---|---|---|
{trajectories}

## One evaluation

`cargo bench --bench dynamics`: state in, accelerations of the free body out; microseconds of processor time, best of several. *Dense matrices* is theory section 6 as it is
printed, in matrices of nalgebra. bracket_hex20 is a solid, shell_folded has a general mass matrix.

| body | modes | dense matrices (us) | all terms (us) | ratio | without W3 (us) | W1 only (us) | I0 only (us) | all terms / I0 only |
|---|---|---|---|---|---|---|---|---|
{evaluations}

Jacobians by all coordinates and velocities and gravity, bracket_hex20:

| modes | Jacobians (us) | gravity (us) |
|---|---|---|
{others}

The unreduced equations of all nodes, state in, rates out ([theory (6.9)](../../docs/theory.md#6-mass-matrices-that-do-not-commute-with-a-rotation)):

| body | rows of K and M | all nodes (us) |
|---|---|---|
{nodal}
"""


def table(rows):
    return "\n".join("| " + " | ".join(map(str, row)) + " |" for row in rows)


def number(value):
    return f"{value:.2f}" if value < 10 else f"{value:.1f}" if value < 100 else f"{value:,.0f}"


def machine():
    models = {line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name")}
    return f"{', '.join(sorted(models)) or platform.processor()}, {len(os.sched_getaffinity(0))} cores"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flexbody", type=Path, default=ROOT / "target/release/flexbody")
    args = parser.parse_args()
    evaluation, steps = bench("dynamics"), bench("dynamics_steps")
    with tempfile.TemporaryDirectory() as scratch:
        found = [compare(args.flexbody, steps, name, modes, Path(scratch)) for modes in MODES for name in BODIES]
    told = subprocess.run([evaluation, "--bench", "--json"], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
    cost = {(f["body"], f["modes"], f["what"]): f["us"] for f in map(json.loads, told.splitlines())}
    poor = [f"{f['body']}, {f['modes']} modes: {f['differences'][1]:.1e}" for f in found if not f["differences"][1] <= AGREEMENT]
    if poor:
        sys.exit("trajectories differ: " + "; ".join(poor))
    peers = [[f["body"], f["nodes"], f["modes"], number(f["ours"]), number(f["theirs"]),
              f"{median(f['ratios']):.0f} ({f['ratios'][0]:.0f} to {f['ratios'][-1]:.0f})"] for f in found]
    trajectories = [[f["body"], f["modes"], STEPS[f["modes"]], f"{f['periods']:.1f}", *(f"{d:.1e}" for d in f["differences"])]
                    for f in found]
    evaluations = []
    for body, modes in sorted({(b, m) for b, m, what in cost if what == "dense matrices"}, key=lambda k: (k[1], k[0])):
        dense, every, no_w3, w1, i0 = (cost[body, modes, what] for what in ["dense matrices", "all terms", "without W3", "W1 only", "I0 only"])
        evaluations.append([body, modes, number(dense), number(every), f"{dense / every:.0f}", number(no_w3), number(w1), number(i0), f"{every / i0:.1f}"])
    others = [[m, number(cost["bracket_hex20", m, "Jacobians"]), number(cost["bracket_hex20", m, "gravity"])] for m in MODES]
    nodal = sorted([body, rows, number(us)] for (body, rows, what), us in cost.items() if what == "all nodes")
    page = PAGE.format(machine=machine(), python=platform.python_version(), exudyn=version("exudyn"), numpy=version("numpy"), turns=TURNS,
                       peers=table(peers), trajectories=table(trajectories), evaluations=table(evaluations), others=table(others),
                       nodal=table(nodal))
    (ROOT / "evidence/pages/dynamics.md").write_text(page)


if __name__ == "__main__":
    main()
