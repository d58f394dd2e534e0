"""A slider-crank with a flexible crank, a flexible rod and a rigid block in Exudyn, with and without groups of terms; for make_seeds.py.

Both flexible bodies are reduced to the same groups by `flexbody reduce --terms` and exported. Each run is also made by `flexbody simulate`: the rod with the
same groups, driven by the attitude and the joint forces of this run, has to find the same deflections.
"""

import itertools
import resource
import warnings

import h5py
import numpy as np

from seeds_mechanism import CRANK, DAMPING, ROD, WHEEL, apart, integrated, settled

warnings.filterwarnings("ignore", category=DeprecationWarning)  # settings of Exudyn under their older names

CRANK_SIZE, CRANK_CELLS = (CRANK, 0.02, 0.02), (6, 1, 1)
MODES = {"crank": 8, "rod": 16}
BLOCK = 1.0  # kg
SETS = ("none", "W1", "W2", "W3", "W1,W2", "W1,W3", "W2,W3", "all")
SPEEDS = (60.0, 120.0)  # rad/s
TURNS, STEPS, RUNS = 1.0, 1000, 3


class Part:
    """A flexible body of the mechanism with some groups of terms: its export, and the arrays that the results need."""

    def __init__(self, program, whole, name, terms, folder):
        self.path = folder / f"{name} {terms}.flex.h5"
        self.export = self.path.with_suffix(".hdf5")
        program.run("reduce", whole, "--terms", terms, "-o", self.path, "--quiet")
        program.run("export", self.path, "--to", "exudyn", "-o", self.export, "--allow-loss", "--quiet", "--points", "interfaces")
        with h5py.File(self.path) as file:
            self.eigenvalue, positions, shape = file["modes/eigenvalue"][()], file["nodes/position"][()], file["modes/shape"][()]
            middle = int(np.argmin(np.linalg.norm(positions - [0.0, *positions.max(axis=0)[1:]], axis=1)))
            self.middle, self.shape = int(file["nodes/id"][middle]), shape[:, middle, :]
        with h5py.File(self.export) as file:
            self.ends = {group["name"][()].decode(): (group["meshNodeNumbers"][()].tolist(), group["weights"][()].tolist()) for group in file["interfaces"].values()}


def added(system, part, **start):
    """Adds a flexible body with modal damping to a system of Exudyn."""
    import exudyn as exu
    from exudyn.FEM import ObjectFFRFreducedOrderInterface

    body = ObjectFFRFreducedOrderInterface()
    body.LoadFromFile(str(part.export))
    body.rigidBodyNodeType = exu.NodeType.RotationEulerParameters
    made = body.AddObjectFFRFreducedOrder(system, rotationMatrixRef=np.eye(3), **start)
    damping = exu.MatrixContainer()
    damping.SetWithDenseMatrix(np.diag(2 * DAMPING * np.sqrt(part.eigenvalue)), useDenseMatrix=False)
    system.SetObjectParameter(made["oFFRFreducedOrder"], "dampingMatrixReduced", damping)
    return made


def in_exudyn(crank, rod, speed, steps):
    """Returns the seconds of the processor, and the recorded values at the ends of the steps by their names; raises an error where Exudyn stops."""
    import exudyn as exu
    import exudyn.itemInterface as item

    exu.SetWriteToConsole(False)
    container = exu.SystemContainer()
    system = container.AddSystem()
    ground = system.AddMarker(item.MarkerBodyRigid(bodyNumber=system.AddObject(item.ObjectGround())))

    def rigid_body(mass, inertia, place, spin):
        node = system.AddNode(item.NodeRigidBodyEP(referenceCoordinates=[*place, 1, 0, 0, 0], initialVelocities=[0, 0, 0, 0, 0, 0, 0.5 * spin]))
        body = system.AddObject(item.ObjectRigidBody(physicsMass=mass, physicsInertia=[inertia] * 3 + [0] * 3, nodeNumber=node))
        return system.AddMarker(item.MarkerBodyRigid(bodyNumber=body))

    # At the start all parts lie along x and are undeformed: the pin rises, the block is at rest.
    wheel, block = rigid_body(1.0, WHEEL, [0, 0, 0], speed), rigid_body(BLOCK, 1.0, [CRANK + ROD, 0, 0], 0.0)
    made_crank = added(system, crank, positionRef=[CRANK / 2, 0, 0], initialVelocity=[0, CRANK / 2 * speed, 0], initialAngularVelocity=[0, 0, speed])
    made_rod = added(system, rod, positionRef=[CRANK + ROD / 2, 0, 0], initialVelocity=[0, CRANK / 2 * speed, 0], initialAngularVelocity=[0, 0, -CRANK / ROD * speed])

    def end(kind, made, part, name, **more):
        nodes, weights = part.ends[name]
        return system.AddMarker(kind(bodyNumber=made["oFFRFreducedOrder"], meshNodeNumbers=nodes, weightingFactors=weights, **more))

    root = end(item.MarkerSuperElementRigid, made_crank, crank, "left", useAlternativeApproach=True)
    pin = end(item.MarkerSuperElementPosition, made_crank, crank, "right")
    near, far = (end(item.MarkerSuperElementPosition, made_rod, rod, name) for name in ("left", "right"))
    system.AddObject(item.GenericJoint(markerNumbers=[ground, wheel], constrainedAxes=[1, 1, 1, 1, 1, 0]))
    system.AddObject(item.GenericJoint(markerNumbers=[wheel, root], constrainedAxes=[1] * 6))
    system.AddObject(item.GenericJoint(markerNumbers=[ground, block], constrainedAxes=[0, 1, 1, 1, 1, 1]))
    # The pin leaves only the rotation about z: a slender rod between two ball joints may start to spin about its own axis.
    turning = [end(item.MarkerSuperElementRigid, made, part, name, useAlternativeApproach=True) for made, part, name in ((made_crank, crank, "right"), (made_rod, rod, "left"))]
    system.AddObject(item.GenericJoint(markerNumbers=turning, constrainedAxes=[0, 0, 0, 1, 1, 0]))
    # A joint's force acts on its first marker; the rod is the second.
    joints = {name: system.AddObject(item.ObjectJointSpherical(markerNumbers=pair)) for name, pair in (("pin force", [pin, near]), ("block force", [block, far]))}
    kinds = exu.OutputVariableType
    sensors = {name: item.SensorObject(objectNumber=joint, outputVariableType=kinds.Force, storeInternal=True) for name, joint in joints.items()}
    coordinates = {"attitude": made_rod["nRigidBody"], "rod": made_rod["nGenericODE2"], "crank": made_crank["nGenericODE2"]}
    sensors |= {name: item.SensorNode(nodeNumber=node, outputVariableType=kinds.Coordinates, storeInternal=True) for name, node in coordinates.items()}
    sensors = {name: system.AddSensor(sensor) for name, sensor in sensors.items()}
    system.Assemble()
    seconds = integrated(system, steps, TURNS * 2 * np.pi / speed)
    return seconds, {name: system.GetSensorStoredData(sensor) for name, sensor in sensors.items()}


class Run:
    """The mechanism with one set of groups at one speed."""

    def __init__(self, parts, terms, speed):
        self.parts, self.terms, self.speed, self.seconds, self.simulating = parts, terms, speed, [], []

    def once(self, steps=STEPS):
        """Runs once more; keeps the results if the number of steps is that of the study. `stops` is true if Exudyn finds no solution."""
        import exudyn as exu

        try:
            seconds, recorded = in_exudyn(self.parts["crank"], self.parts["rod"], self.speed, steps)
        except exu.SolverError:
            self.stops = True
            return None
        self.stops = False
        if steps == STEPS:
            self.seconds.append(seconds)
            self.recorded = recorded
            self.deflections = {name: recorded[name][:, 1:] @ part.shape for name, part in self.parts.items()}
        return recorded

    def differences(self, reference):
        """Largest differences of the deflections of rod and crank, and the root mean square of those of the pin force after the shock of the start."""
        deflections = [apart(self.deflections[name], reference.deflections[name]) for name in ("rod", "crank")]
        return [*deflections, settled(self.recorded["pin force"][:, 1:], reference.recorded["pin force"][:, 1:])]

    def simulated_seconds(self):
        return float(np.median(self.simulating))

    def simulate(self, program, folder):
        """Drives the rod by the attitude and the joint forces of this run in `flexbody simulate`: sets the distance of the deflections and notes the seconds of the processor."""
        recorded, rod = self.recorded, self.parts["rod"]
        rows = np.column_stack([recorded["attitude"][:, 0], recorded["attitude"][:, 4:8] + [1, 0, 0, 0], -recorded["pin force"][:, 1:], -recorded["block force"][:, 1:]])
        rows[:, 1:5] /= np.linalg.norm(rows[:, 1:5], axis=1)[:, None]
        np.savetxt(folder / "run.csv", rows, delimiter=",", header="t,p0,p1,p2,p3,ax,ay,az,bx,by,bz", comments="", fmt="%.17g")
        end = float(rows[-1, 0])
        force = '[[load]]\ninterface = "{}"\nforce_from = {{ file = "run.csv", time = "t", columns = {}, interpolation = "cubic" }}'
        lines = [f'[run]\nduration = {end!r}\noutputs = {len(rows) - 1}\nmethod = "conserving"\nstep = {end / STEPS!r}', f"[damping]\nratio = {DAMPING}",
                 '[spin]\nattitude_from = { file = "run.csv", time = "t", columns = ["p0", "p1", "p2", "p3"] }',
                 force.format("left", '["ax", "ay", "az"]'), force.format("right", '["bx", "by", "bz"]'), f"[[watch]]\nnode = {rod.middle}"]
        (folder / "run.toml").write_text("\n".join(lines) + "\n")
        begin = resource.getrusage(resource.RUSAGE_CHILDREN)
        program.run("simulate", rod.path, "--scene", folder / "run.toml", "-o", folder / "run.h5", "--quiet")
        end = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.simulating.append(end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime)
        with h5py.File(folder / "run.h5") as file:
            self.simulated = apart(file[f"points/node {rod.middle}/deflection"][()], self.deflections["rod"])


class Study:
    """All sets of groups at all speeds; the last set has all terms, and is what the others are compared with."""

    def __init__(self, program, manifests, folder):
        whole = {name: folder / f"{name}.flex.h5" for name in MODES}
        for name, path in whole.items():
            program.convert(manifests[name], path, MODES[name], "--frame", "com")
        parts = {terms: {name: Part(program, path, name, terms, folder) for name, path in whole.items()} for terms in SETS}
        self.runs = {speed: [Run(parts[terms], terms, speed) for terms in SETS] for speed in SPEEDS}
        for _ in range(RUNS):
            for run in itertools.chain(*self.runs.values()):
                run.once()
        for _ in range(RUNS):
            for run in self.runs[SPEEDS[0]]:
                run.simulate(program, folder)
        slow = self.runs[SPEEDS[0]][-1]
        halved = slow.once(2 * STEPS)
        at = np.searchsorted(halved["rod"][:, 0], slow.recorded["rod"][:, 0] - 1e-12).clip(max=len(halved["rod"]) - 1)
        self.parts = parts
        self.halved = apart((halved["rod"][:, 1:] @ slow.parts["rod"].shape)[at], slow.deflections["rod"])
        self.coupled = {speed: coupled_moment(whole["rod"], runs[-1].recorded["rod"][:, 1:]) for speed, runs in self.runs.items()}
        self.first = {name: float(np.sqrt(part.eigenvalue[0]) / (2 * np.pi)) for name, part in parts["all"].items()}


def coupled_moment(path, q):
    """The largest moment about x that the inertia coupling Q'W3 takes from the rotation, (Q'W3 W3'Q)_xx, over (I0)_xx: above 1 the mass matrix without Q'W2 Q is not positive definite."""
    with h5py.File(path) as file:
        inertia, w3 = file["invariants/I0"][()], file["invariants/W3"][()]
    rows = q @ w3[: q.shape[1]]
    return float((rows**2).sum(axis=1).max() / inertia[0, 0])
