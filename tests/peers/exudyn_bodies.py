#!/usr/bin/env python3
"""Bodies that flexbody exports, in Exudyn: the same invariants as Exudyn's own reduction, and the same motion as `flexbody simulate`.

Optional, about a minute: needs Python with exudyn, h5py, numpy and scipy; not part of `cargo test`.

    python3 -m venv target/peers && target/peers/bin/pip install exudyn==1.13.6 h5py numpy scipy
    cargo build --release
    target/peers/bin/python tests/peers/exudyn_bodies.py

For each body: Exudyn loads the export with `ObjectFFRFreducedOrderInterface.LoadFromFile`. Beside it stands the interface that Exudyn makes of
K, M and the same modes (`FEMinterface`), matrices turned into the body frame. Both simulate

* tumbling: a free body with a spin near a principal axis and bent modes; the classical Runge-Kutta method, rotation vector;
* rotor: the frame is brought to a spin about its z axis by a joint; Euler parameters as in the file, generalized-alpha method;
* loads: a force at an interface (equal weights of its nodes) and a couple, two opposite forces at nodes of it, rise along fixed axes of the world
  at the body, which is free and spins. (From rest Exudyn's rotation vector loses digits as long as it turns by very little in a step.)

Differences are the largest over all recorded instants: of places over the radius of gyration, of direction cosines, of modal amplitudes over the
largest. `flexbody simulate` runs at a tolerance of 1e-12. With half the step the difference must fall by the order of the method: what is left is the
error of the integration in Exudyn. Exits with 1 when a number is worse than its limit.
"""

import sys
import warnings
from pathlib import Path

import h5py
import numpy as np
import scipy.sparse as sp
from scipy.spatial.transform import Rotation

sys.path += [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parents[2] / "benches/peers")]
import common  # noqa: E402
from common import ROOT, Row, compare_alone, run  # noqa: E402
from measure import node_order, read_model  # noqa: E402

warnings.filterwarnings("ignore", category=DeprecationWarning)
import exudyn as exu  # noqa: E402
import exudyn.itemInterface as eii  # noqa: E402
from exudyn.FEM import FEMinterface, ObjectFFRFreducedOrderInterface  # noqa: E402

BODIES = ["bracket_hex20", "connecting_rod"]
MODES = 8
INSTANTS = 40
INVARIANTS = 1e-11  # relative to Cauchy-Schwarz bounds
OWN = 1e-9  # of the two interfaces in the same scene and with the same steps
# Steps in the scene, order of the method, largest difference to flexbody with half the step.
SCENES = {"tumbling": (4000, 4, 1e-9), "rotor": (4000, 2, 1e-4), "loads": (4000, 4, 1e-9)}
# Interface that is loaded.
LOADED = {"bracket_hex20": "bolt_wall", "connecting_rod": "small_end"}


class Body:
    """A body of flexbody, its export as Exudyn loads it, and Exudyn's own reduction."""

    def __init__(self, flexbody, name, folder):
        model = ROOT / "fixtures/models" / name
        self.path, export = folder / f"{name}.flex.h5", folder / f"{name}.hdf5"
        self.flexbody = flexbody
        common.body(flexbody, name, self.path, "--modes", MODES)
        common.export(flexbody, self.path, "exudyn", export)
        with h5py.File(self.path) as f:
            self.ids, self.positions, shapes = f["nodes/id"][()], f["nodes/position"][()], f["modes/shape"][()]
            self.axes, self.origin, self.lam = f["frame/axes"][()], f["frame/origin"][()], f["modes/eigenvalue"][()]
            self.inertia, self.mass = f["invariants/I0"][()], f["invariants/mass"][0]
            self.interface = LOADED[name]
            self.loaded_ids = f[f"interfaces/{self.interface}/node_id"][()]
        # The two nodes of the interface that are farthest apart along the axis of its largest extent.
        among = self.positions[np.isin(self.ids, self.loaded_ids)]
        ids = self.ids[np.isin(self.ids, self.loaded_ids)]
        along = among[:, np.argmax(np.ptp(among, axis=0))]
        self.pair = [(int(ids[np.argmin(along)]), 1.0), (int(ids[np.argmax(along)]), -1.0)]
        self.shapes = shapes.reshape(MODES, -1).T.copy()
        self.loaded = ObjectFFRFreducedOrderInterface()
        self.loaded.LoadFromFile(str(export))
        self.own = self.reduced(model)
        self.first, self.length = np.sqrt(self.lam[0]), np.sqrt(np.trace(self.inertia) / 2 / self.mass)

    def reduced(self, model):
        stiffness, mass, _ = read_model(model)
        place = {node: i for i, node in enumerate(self.ids)}
        rows = np.array([3 * place[node] + k for node in node_order(model) for k in range(3)])
        order = np.argsort(rows)
        turn = sp.kron(sp.identity(len(self.ids)), self.axes, format="csr")
        fem = FEMinterface()
        fem.nodes = {"Position": self.positions}
        fem.massMatrix, fem.stiffnessMatrix = [(turn.T @ a[order][:, order] @ turn).tocsr() for a in (mass, stiffness)]
        fem.modeBasis = {"matrix": self.shapes, "type": "NormalModes"}
        return ObjectFFRFreducedOrderInterface(fem, roundMassMatrix=0, roundStiffnessMatrix=0)

    def invariants(self):
        """Largest difference of each entry of the file to Exudyn's own, relative to its Cauchy-Schwarz bound."""
        a, b, nf = self.loaded, self.own, MODES
        root = np.sqrt(self.mass)
        size = np.sqrt(np.trace(self.inertia) / 2)  # bound of x: the square root of the trace of the second moment
        omega = np.sqrt(self.lam)
        bounds = {
            "totalMass": self.mass, "Mtt": self.mass, "chiU": size / root, "chiUtilde": size / root, "inertiaLocal": size**2,
            "massMatrixReduced": 1.0, "stiffnessMatrixReduced": np.outer(omega, omega), "mPhitTPsi": root, "mPhitTPsiTilde": root,
            "mXRefTildePsi": size, "mXRefTildePsiTilde": size, "mPsiTildePsi": 1.0, "mPsiTildePsiTilde": 1.0, "xRef": self.length,
            "modeBasis": 1 / root,
        }
        shapes = {"mPsiTildePsi": (3 * nf, nf), "mPsiTildePsiTilde": (3 * nf, 3 * nf), "mXRefTildePsiTilde": (3, 3 * nf)}
        for name, shape in shapes.items():
            assert np.shape(getattr(a, name)) == shape, name
        return {name: float(np.max(np.abs(np.asarray(getattr(a, name)) - np.asarray(getattr(b, name))) / bound))
                for name, bound in bounds.items()}


class Scene:
    """What the body is to do, in the words of flexbody and of Exudyn."""

    def __init__(self, name, body):
        self.name, self.body = name, body
        first = float(body.first)
        self.duration = 3 * 2 * np.pi / first
        self.rate = 0.25 * first
        if name == "tumbling":
            self.omega = np.array([0.02, 1.0, 0.03]) * self.rate
            self.velocity = np.array([0.1, 0.2, -0.1]) * 0.2 * first * body.length
            self.q = 0.03 * np.sqrt(np.trace(body.inertia) / 2) * body.lam[0] / body.lam
        else:
            spinning = name == "loads"
            self.omega, self.velocity, self.q = np.array([0.3, -0.5, 1.0]) * self.rate * spinning, np.zeros(3), np.zeros(MODES)
        # Such that the body turns by about a radian.
        self.force = np.array([0.3, -0.2, 0.5]) * 0.02 * body.mass * body.length * first**2
        self.pair = np.array([-0.2, 0.4, 0.3]) * 0.02 * body.mass * body.length * first**2

    def ours(self, folder):
        """Places, axes and amplitudes by `flexbody simulate`."""
        # Exudyn's world starts along the axes of the body frame, a scene along those of the model.
        turn = self.body.axes.T
        start = f"rotation = {Rotation.from_matrix(turn).as_rotvec().tolist()}\norigin = {(-turn @ self.body.origin).tolist()}"
        lines = [f"[run]\nduration = {self.duration!r}\noutputs = {INSTANTS}\ntolerance = 1e-12"]
        if self.name == "tumbling":
            modes = ", ".join(f"{{ number = {j + 1}, amplitude = {float(q)!r} }}" for j, q in enumerate(self.q))
            lines += [f"[initial]\n{start}\nvelocity = {self.velocity.tolist()}\nangular_velocity = {self.omega.tolist()}\naxes = \"body\"\nmode = [{modes}]"]
        elif self.name == "loads":
            rise = f"{{ from = 0, to = 1, duration = {self.duration / 2!r} }}"
            loads = [(f'interface = "{self.body.interface}"', self.force)]
            loads += [(f"node = {node}", sign * self.pair) for node, sign in self.body.pair]
            lines += [f"[initial]\n{start}\nangular_velocity = {self.omega.tolist()}\naxes = \"body\""]
            lines += [f'[[load]]\n{at}\nforce = {force.tolist()}\naxes = "world"\nhistory = {rise}' for at, force in loads]
        else:
            half = self.duration / 2
            lines += [f"[initial]\n{start}\n[spin]\naxis = [0, 0, 1]\naxes = \"body\"\nrate = {{ to = {float(self.rate)!r}, duration = {half!r} }}\nhold = true"]
        scene, motion = folder / "scene.toml", folder / "motion.h5"
        scene.write_text("\n".join(lines) + "\n")
        run(self.body.flexbody, "simulate", self.body.path, "--scene", scene, "-o", motion, "--quiet")
        with h5py.File(motion) as f:
            e = f["frame/attitude"][()]
            return {"place": f["frame/origin"][()], "axes": np.array([rotation(*row) for row in e]) @ self.body.axes, "q": f["modes/q"][()]}

    def rise(self, t):
        """From 0 to 1 in the first half of the scene."""
        x = min(t / (self.duration / 2), 1.0)
        return x - np.sin(2 * np.pi * x) / (2 * np.pi)

    def load(self, system, made):
        """The force at the mean of the nodes of the interface, and the couple."""
        place = {node: i for i, node in enumerate(self.body.ids)}
        grown = lambda mbs, t, vector: [self.rise(t) * v for v in vector]
        for nodes, force in [(self.body.loaded_ids, self.force)] + [([node], sign * self.pair) for node, sign in self.body.pair]:
            at = system.AddMarker(eii.MarkerSuperElementPosition(
                bodyNumber=made["oFFRFreducedOrder"], meshNodeNumbers=[place[node] for node in nodes],
                weightingFactors=[1 / len(nodes)] * len(nodes)))
            system.AddLoad(eii.LoadForceVector(markerNumber=at, loadVector=list(force), loadVectorUserFunction=grown))

    def angle(self, t):
        """Integral of the rate: a smooth rise over half the scene, then constant."""
        half = self.duration / 2
        x = min(t / half, 1.0)
        return self.rate * (half * (x * x / 2 + (np.cos(2 * np.pi * x) - 1) / (4 * np.pi**2)) + max(t - half, 0.0))

    def exudyn(self, interface, steps):
        """The same by Exudyn."""
        container = exu.SystemContainer()
        system = container.AddSystem()
        free = self.name != "rotor"
        kind = exu.NodeType.RotationRotationVector if free else exu.NodeType.RotationEulerParameters
        interface.rigidBodyNodeType = kind
        made = interface.AddObjectFFRFreducedOrder(system, initialVelocity=list(self.velocity), initialAngularVelocity=list(self.omega))
        system.SetNodeParameter(made["nGenericODE2"], "initialCoordinates", list(self.q))
        if self.name == "loads":
            self.load(system, made)
        if not free:
            ground = system.AddObject(eii.ObjectGround())
            markers = [system.AddMarker(eii.MarkerBodyRigid(bodyNumber=ground)), system.AddMarker(eii.MarkerNodeRigid(nodeNumber=made["nRigidBody"]))]
            offset = lambda mbs, t, item, parameters: [0.0, 0.0, 0.0, 0.0, 0.0, self.angle(t)]
            system.AddObject(eii.GenericJoint(markerNumbers=markers, constrainedAxes=[1] * 6, offsetUserFunction=offset))
        sensor = lambda node, what: system.AddSensor(eii.SensorNode(nodeNumber=node, outputVariableType=what, storeInternal=True))
        what = exu.OutputVariableType
        sensors = [sensor(made["nRigidBody"], what.Position), sensor(made["nRigidBody"], what.RotationMatrix),
                   sensor(made["nGenericODE2"], what.Coordinates)]
        system.Assemble()
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps = steps
        settings.timeIntegration.endTime = self.duration
        settings.timeIntegration.verboseMode, settings.timeIntegration.adaptiveStep = 0, False
        settings.timeIntegration.newton.useModifiedNewton = False
        settings.timeIntegration.newton.relativeTolerance = 1e-8
        settings.timeIntegration.newton.absoluteTolerance = 1e-10
        settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
        settings.solutionSettings.writeSolutionToFile = False
        # Every step: a longer period slips by a step where it is rounded.
        settings.solutionSettings.sensorsWritePeriod = 0.5 * self.duration / steps
        solver = exu.DynamicSolverType.RK44 if free else exu.DynamicSolverType.GeneralizedAlpha
        system.SolveDynamic(settings, solverType=solver)
        stored = [system.GetSensorStoredData(s) for s in sensors]
        assert all(len(data) == steps + 1 for data in stored), [len(data) for data in stored]
        place, axes, q = [data[:: steps // INSTANTS, 1:] for data in stored]
        return {"place": place, "axes": axes.reshape(-1, 3, 3), "q": q}

    def difference(self, a, b):
        largest = np.abs(a["q"]).max()
        scale = {"place": self.body.length, "axes": 1.0, "q": largest}
        return {key: float(np.abs(a[key] - b[key]).max() / size) for key, size in scale.items()}


def rotation(e0, e1, e2, e3):
    v = np.array([e1, e2, e3])
    cross = np.array([[0, -e3, e2], [e3, 0, -e1], [-e2, e1, 0]])
    return (2 * e0 * e0 - 1) * np.eye(3) + 2 * np.outer(v, v) + 2 * e0 * cross


def rows(flexbody, scratch):
    """Every comparison of every body."""
    exu.SetWriteToConsole(False)
    program = f"Exudyn {exu.__version__}"
    found = []
    for name in BODIES:
        body = Body(flexbody, name, scratch)
        row = lambda what, value, limit: found.append(Row(program, "exudyn", f"{name}: {what}", value, limit))
        invariants = body.invariants()
        worst = max(invariants, key=invariants.get)
        row(f"invariants as Exudyn's own reduction of K and M has them (worst: `{worst}`)", invariants[worst], INVARIANTS)
        for scene_name, (steps, order, limit) in SCENES.items():
            scene = Scene(scene_name, body)
            ours = scene.ours(scratch)
            loaded = [scene.exudyn(body.loaded, n) for n in (steps, 2 * steps)]
            own = scene.exudyn(body.own, 2 * steps)
            far, near = [scene.difference(ours, motion) for motion in loaded]
            apart = scene.difference(own, loaded[1])
            print(f"  {name} {scene_name}: with a step, with half, to Exudyn's own reduction")
            for key in far:
                print(f"  {'':10} {key:9} {far[key]:9.1e} {near[key]:9.1e}   {apart[key]:.1e}")
                # The error of the integration falls with its order; where rounding is reached nothing falls any more.
                falls = near[key] < 1e-11 or far[key] / near[key] > 0.7 * 2**order
                row(f"{scene_name}, {key}, falling with order {order}", near[key] if falls else float("inf"), limit)
            row(f"{scene_name}, to Exudyn's own reduction", max(apart.values()), OWN)
    return found


if __name__ == "__main__":
    compare_alone(__doc__, rows)
