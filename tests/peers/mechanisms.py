#!/usr/bin/env python3
"""Motion of two flexible bodies in Exudyn: a double pendulum and a slider-crank; writes tests/program/motion/mechanisms.json.

Optional, some minutes: needs Python with exudyn, h5py, numpy and scipy; not part of `cargo test`, which reads the result.

    python3 -m venv target/peers && target/peers/bin/pip install exudyn==1.13.6 h5py numpy scipy
    cargo build --release
    target/peers/bin/python tests/peers/mechanisms.py

Two objects ObjectFFRFreducedOrder with modes of flexbody, joints at the mean place of the nodes of an interface, trapezoidal rule with constraints
of index 2. Places are extrapolated from three step sizes to step zero; what the last extrapolation changed stands beside them.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import warnings
from importlib.metadata import version
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "benches/peers"))
from measure import node_order, read_model  # noqa: E402

warnings.filterwarnings("ignore", category=DeprecationWarning)  # settings of Exudyn under their older names
import exudyn as exu  # noqa: E402
import exudyn.itemInterface as item  # noqa: E402
from exudyn.FEM import FEMinterface, ObjectFFRFreducedOrderInterface  # noqa: E402

MODES = 8
INSTANTS = 8
STEPS = [4000, 8000, 16000]


class Body:
    """A body of fixtures/models with its modes; vectors in body axes."""

    def __init__(self, flexbody, name, scratch):
        self.name, path = name, scratch / f"{name}.flex.h5"
        folder = ROOT / "fixtures/models" / name
        command = [flexbody, "convert", folder / "model.toml", "--modes", str(MODES), "--lumped", "none", "--quiet", "-o", path]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        _, mass, _ = read_model(folder)
        with h5py.File(path) as f:
            # The body's nodes have another order than the rows of M.
            place = {node: i for i, node in enumerate(f["nodes/id"][()])}
            self.ids = node_order(folder)
            order = [place[node] for node in self.ids]
            self.positions, shapes = f["nodes/position"][()][order], f["modes/shape"][()][:, order]
            lam = f["modes/eigenvalue"][()]
            self.interfaces = {name: [self.ids.index(i) for i in group["node_id"][()]] for name, group in f["interfaces"].items()}
        self.rate = np.sqrt(lam[0])
        fem = FEMinterface()
        # M = Ms kron I in body axes as well as in those of the model. K is not used: its place is taken by the eigenvalues.
        fem.nodes, fem.massMatrix, fem.stiffnessMatrix = {"Position": self.positions}, mass, mass
        fem.modeBasis = {"matrix": shapes.reshape(MODES, -1).T.copy(), "type": "NormalModes"}
        self.reduced = ObjectFFRFreducedOrderInterface(fem)
        self.reduced.stiffnessMatrixReduced = np.diag(lam)

    def nodes(self, end):
        return self.interfaces[end] if isinstance(end, str) else [self.ids.index(end)]

    def point(self, end):
        return self.positions[self.nodes(end)].mean(axis=0)


def aligned(along, about=(0, 0, 1.0)):
    """Rotation that takes the first vector of body axes to x and the second as near to z as may be."""
    x = np.array(along) / np.linalg.norm(along)
    z = np.array(about) - x * (x @ about)
    z /= np.linalg.norm(z)
    return np.array([x, np.cross(z, x), z])


def turned(axis, angle):
    axis = np.array(axis) / np.linalg.norm(axis)
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew


def double_pendulum(make):
    """Two rods, each end a ball; released at rest, out of any plane."""
    rods = [make("connecting_rod"), make("connecting_rod")]
    first, second = (rods[0].point(end) for end in ("big_end", "small_end"))
    axes = [turned([0.2, 0.3, 1], 0.4), turned([0.5, -1, 0.4], -1.1)]
    origin = -axes[0] @ first
    joint = origin + axes[0] @ second
    length = np.linalg.norm(second - first)
    return {
        "bodies": rods, "axes": axes, "origins": [origin, joint - axes[1] @ first],
        "joints": [([0, "big_end"], [0.0, 0.0, 0.0], [1, 1, 1]), ([1, "big_end"], [0, "small_end"], [1, 1, 1])],
        "shown": [[0, "small_end"], [1, "small_end"]],
        # The swing is slow beside the first mode by a factor of about thirty.
        "gravity": np.array([0.1, -1.0, 0.2]) * (0.03 * rods[0].rate) ** 2 * length,
        "duration": 2 * np.pi / (0.03 * rods[0].rate),
    }


def slider_crank(make):
    """A crank that turns about z, held at an interface and at a node beside it, a rod, and the end of it on the axis x; released at rest."""
    crank, rod = make("bracket_hex20"), make("connecting_rod")
    held, pin = crank.point("bolt_base"), crank.point("bolt_wall")
    # The node that is farthest from the interface across the crank: the hinge goes through both.
    across = np.cross(pin - held, [0, 1.0, 0])
    beside = int(np.argmax(np.abs((crank.positions - held) @ np.array([0, 1.0, 0])) - 0.5 * np.abs((crank.positions - held) @ across)
                           / np.linalg.norm(across) - 0.5 * np.abs((crank.positions - held) @ (pin - held)) / np.linalg.norm(pin - held)))
    hinge = crank.positions[beside] - held
    frame = aligned(pin - held - hinge * ((pin - held) @ hinge) / (hinge @ hinge), hinge)
    axes = [turned([0, 0, 1], 1.0) @ frame]
    origins = [-axes[0] @ held]
    joint = origins[0] + axes[0] @ pin
    own = rod.point("small_end") - rod.point("big_end")
    length = np.linalg.norm(own)
    end = np.array([joint[0] + np.sqrt(length**2 - joint[1] ** 2 - joint[2] ** 2), 0.0, 0.0])
    # Body axes of the rod to the direction that it has.
    to = aligned(end - joint).T @ aligned(own)
    axes.append(to)
    origins.append(joint - to @ rod.point("big_end"))
    return {
        "bodies": [crank, rod], "axes": axes, "origins": origins,
        "joints": [([0, "bolt_base"], [0.0, 0.0, 0.0], [1, 1, 1]),
                   ([0, int(crank.ids[beside])], [float(v) for v in axes[0] @ hinge], [1, 1, 0]),
                   ([1, "big_end"], [0, "bolt_wall"], [1, 1, 1]),
                   ([1, "small_end"], [0.0, 0.0, 0.0], [0, 1, 1])],
        "shown": [[0, "bolt_wall"], [1, "small_end"]],
        "gravity": np.array([0.3, -1.0, 0.0]) * (0.03 * rod.rate) ** 2 * length,
        "duration": 2 * np.pi / (0.03 * rod.rate),
    }


def simulate(mechanism, steps):
    """Places of origins and shown points in the world (instants x points x 3)."""
    container = exu.SystemContainer()
    system = container.AddSystem()
    ground = system.AddObject(item.ObjectGround())
    made = [body.reduced.AddObjectFFRFreducedOrderWithUserFunctions(
        exu, system, positionRef=list(origin), rotationMatrixRef=axes, gravity=list(mechanism["gravity"]))
        for body, origin, axes in zip(mechanism["bodies"], mechanism["origins"], mechanism["axes"])]

    def marker(end):
        if not isinstance(end[1], (str, int)):
            return system.AddMarker(item.MarkerBodyPosition(bodyNumber=ground, localPosition=end))
        nodes = mechanism["bodies"][end[0]].nodes(end[1])
        return system.AddMarker(item.MarkerSuperElementPosition(
            bodyNumber=made[end[0]]["oFFRFreducedOrder"], meshNodeNumbers=nodes, weightingFactors=[1 / len(nodes)] * len(nodes)))

    for a, b, axes in mechanism["joints"]:
        system.AddObject(item.ObjectJointSpherical(markerNumbers=[marker(b), marker(a)], constrainedAxes=axes))
    position = exu.OutputVariableType.Position
    sensors = [system.AddSensor(item.SensorNode(nodeNumber=one["nRigidBody"], storeInternal=True, outputVariableType=position)) for one in made]
    sensors += [system.AddSensor(item.SensorMarker(markerNumber=marker(end), storeInternal=True, outputVariableType=position))
                for end in mechanism["shown"]]
    system.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.endTime = mechanism["duration"]
    settings.timeIntegration.generalizedAlpha.spectralRadius = 1
    settings.timeIntegration.generalizedAlpha.useIndex2Constraints = True
    settings.timeIntegration.generalizedAlpha.useNewmark = True
    settings.timeIntegration.newton.relativeTolerance = 1e-10
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = mechanism["duration"] / INSTANTS
    settings.linearSolverType = exu.LinearSolverType.EXUdense
    system.SolveDynamic(settings)
    stored = np.array([system.GetSensorStoredData(sensor) for sensor in sensors])
    assert stored.shape == (len(sensors), INSTANTS + 1, 4), stored.shape
    return stored[:, 1:, 1:].transpose(1, 0, 2)


def extrapolated(mechanism):
    """Errors are even in the step: extrapolated twice from three step sizes; what the second time changed; errors of the steps."""
    rows = [simulate(mechanism, steps) for steps in STEPS]
    once = [b + (b - a) / 3 for a, b in zip(rows, rows[1:])]
    twice = once[1] + (once[1] - once[0]) / 15
    return twice, float(np.abs(twice - once[1]).max()), [float(np.abs(r - twice).max()) for r in rows]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flexbody", type=Path, default=ROOT / "target/release/flexbody")
    args = parser.parse_args()
    result = {"made_by": "tests/peers/mechanisms.py", "exudyn": version("exudyn")}
    with tempfile.TemporaryDirectory() as scratch:
        make = lambda name: Body(args.flexbody, name, Path(scratch))
        for mechanism in (double_pendulum, slider_crank):
            m = mechanism(make)
            places, error, orders = extrapolated(m)
            print(mechanism.__name__, "extrapolation", error, "of", np.abs(np.diff(places, axis=0)).max(), "steps", orders, flush=True)
            say = lambda end: {"ground": list(end)} if not isinstance(end[1], (str, int)) else {
                "body": end[0], **({"interface": end[1]} if isinstance(end[1], str) else {"node": end[1]})}
            result[mechanism.__name__] = {
                "bodies": [{"model": b.name, "modes": MODES, "origin": list(o), "axes": a.tolist()}
                           for b, o, a in zip(m["bodies"], m["origins"], m["axes"])],
                "joints": [{"ends": [say(a), say(b)], "axes": [bool(v) for v in axes]} for a, b, axes in m["joints"]],
                "shown": [say(end) for end in m["shown"]], "gravity": list(m["gravity"]),
                "duration": m["duration"], "error": error, "places": places.tolist()}
    (ROOT / "tests/program/motion/mechanisms.json").write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
