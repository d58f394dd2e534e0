"""A slender beam with up to 90 modes as the rod of a slider-crank in Exudyn, beside `flexbody simulate`; for make_seeds.py.

The crank is a heavy wheel that turns freely about z; the rod hangs between a ball joint on its pin and a point that slides along x. What Exudyn gives of the
motion of the rod's frame and of the forces of both joints goes into a scene of `flexbody simulate`, which has to find the same deflections.
"""

import time
import warnings

import h5py
import numpy as np

warnings.filterwarnings("ignore", category=DeprecationWarning)  # settings of Exudyn under their older names

CRANK, ROD = 0.2, 1.0  # m
SPEED = 60.0  # rad/s
TURNS = 1.0
STEPS = 1000
# A wheel that the rod does not slow down.
WHEEL = 1e4  # kg m^2
COUNTS = (4, 8, 16, 30, 60, 90)
DAMPING = 0.02
RUNS = 3


def integrated(system, steps, end_time):
    """Integrates a mechanism with sensors and returns the seconds of the processor."""
    import exudyn as exu

    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.numberOfSteps, integration.endTime = steps, end_time
    integration.verboseMode, integration.adaptiveStep = 0, False
    integration.generalizedAlpha.spectralRadius = 0.9
    integration.newton.useModifiedNewton = True
    settings.linearSolverType = exu.LinearSolverType.EXUdense
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = 0.5 * integration.endTime / steps
    begin = time.process_time()
    system.SolveDynamic(settings)
    return time.process_time() - begin


def in_exudyn(path, eigenvalue, steps=STEPS, shown=()):
    """(seconds of the processor, {name: values at the ends of the steps})"""
    import exudyn as exu
    import exudyn.itemInterface as item
    from exudyn.FEM import ObjectFFRFreducedOrderInterface

    exu.SetWriteToConsole(False)
    body = ObjectFFRFreducedOrderInterface()
    body.LoadFromFile(str(path))
    body.rigidBodyNodeType = exu.NodeType.RotationEulerParameters
    with h5py.File(path) as file:
        numbers = file["nodeNumbers"][()]
        ends = {group["name"][()].decode(): (group["meshNodeNumbers"][()].tolist(), group["weights"][()].tolist()) for group in file["interfaces"].values()}
    container = exu.SystemContainer()
    system = container.AddSystem()
    ground = system.AddObject(item.ObjectGround())
    at_ground = system.AddMarker(item.MarkerBodyRigid(bodyNumber=ground))
    wheel = system.AddNode(item.NodeRigidBodyEP(referenceCoordinates=[0, 0, 0, 1, 0, 0, 0], initialVelocities=[0, 0, 0, 0, 0, 0, 0.5 * SPEED]))
    crank = system.AddObject(item.ObjectRigidBody(physicsMass=1.0, physicsInertia=[WHEEL, WHEEL, WHEEL, 0, 0, 0], nodeNumber=wheel))
    hinge = [at_ground, system.AddMarker(item.MarkerBodyRigid(bodyNumber=crank))]
    system.AddObject(item.GenericJoint(markerNumbers=hinge, constrainedAxes=[1, 1, 1, 1, 1, 0]))
    # At the start crank and rod lie along x; the pin rises, the other end is at rest.
    made = body.AddObjectFFRFreducedOrder(
        system, positionRef=[CRANK + ROD / 2, 0, 0], initialVelocity=[0, 0.5 * CRANK * SPEED, 0], rotationMatrixRef=np.eye(3),
        initialAngularVelocity=[0, 0, -CRANK / ROD * SPEED])
    damping = exu.MatrixContainer()
    damping.SetWithDenseMatrix(np.diag(2 * DAMPING * np.sqrt(eigenvalue)), useDenseMatrix=False)
    system.SetObjectParameter(made["oFFRFreducedOrder"], "dampingMatrixReduced", damping)

    def marker(name):
        nodes, weights = ends[name] if name in ends else ([int(np.flatnonzero(numbers == name)[0])], [1.0])
        return system.AddMarker(item.MarkerSuperElementPosition(bodyNumber=made["oFFRFreducedOrder"], meshNodeNumbers=nodes, weightingFactors=weights))

    pin = system.AddMarker(item.MarkerBodyPosition(bodyNumber=crank, localPosition=[CRANK, 0, 0]))
    joints = [system.AddObject(item.ObjectJointSpherical(markerNumbers=[pin, marker("left")])),
              system.AddObject(item.ObjectJointSpherical(markerNumbers=[at_ground, marker("right")], constrainedAxes=[0, 1, 1]))]
    kinds, node = exu.OutputVariableType, made["nRigidBody"]
    sensors = {
        "attitude": item.SensorNode(nodeNumber=node, outputVariableType=kinds.Coordinates, storeInternal=True),
        "modes": item.SensorNode(nodeNumber=made["nGenericODE2"], outputVariableType=kinds.Coordinates, storeInternal=True),
        "pin force": item.SensorObject(objectNumber=joints[0], outputVariableType=kinds.Force, storeInternal=True),
        "guide force": item.SensorObject(objectNumber=joints[1], outputVariableType=kinds.Force, storeInternal=True),
    }
    sensors = {name: system.AddSensor(sensor) for name, sensor in sensors.items()}
    system.Assemble()
    seconds = integrated(system, steps, TURNS * 2 * np.pi / SPEED)
    return seconds, {name: system.GetSensorStoredData(sensor) for name, sensor in sensors.items()}


class Study:
    """Seconds and differences for every number of modes, and what `simulate` finds for the largest."""

    def __init__(self, program, manifest, folder, counts=COUNTS, steps=STEPS):
        self.rows, self.steps = [], steps
        paths = {}
        for count in counts:
            paths[count] = folder / f"rod{count}.flex.h5"
            program.convert(manifest, paths[count], count, "--frame", "com")
            program.run("export", paths[count], "--to", "exudyn", "-o", folder / f"rod{count}.hdf5", "--allow-loss", "--quiet", "--points", "interfaces")
        found = {count: self.motion(folder / f"rod{count}.hdf5", paths[count]) for count in reversed(counts)}
        whole = found[counts[-1]]
        for count in counts:
            seconds, motion, deflections, force = found[count]
            self.rows.append((count, motion["highest"], seconds, apart(deflections, whole[2]), settled(force, whole[3])))
        self.extent, self.largest = ROD, float(np.abs(whole[2]).max())
        self.halved = self.with_half_the_step(folder / f"rod{counts[-1]}.hdf5", paths[counts[-1]], whole)
        self.simulated = self.simulate(program, paths[counts[-1]], whole, folder)

    def motion(self, export, path, steps=None, runs=RUNS):
        """Median seconds, what Exudyn recorded, deflections of the nodes in the middle (instants x 3) and the pin force."""
        with h5py.File(path) as file:
            eigenvalue, positions, shape = file["modes/eigenvalue"][()], file["nodes/position"][()], file["modes/shape"][()]
        middle = int(np.argmin(np.linalg.norm(positions - [0.0, *positions.max(axis=0)[1:]], axis=1)))
        times, recorded = [], None
        for _ in range(runs):
            seconds, recorded = in_exudyn(export, eigenvalue, steps or self.steps)
            times.append(seconds)
        recorded["highest"] = float(np.sqrt(eigenvalue[-1]) / (2 * np.pi))
        recorded["middle"] = middle
        return float(np.median(times)), recorded, recorded["modes"][:, 1:] @ shape[:, middle, :], recorded["pin force"][:, 1:]

    def with_half_the_step(self, export, path, whole):
        """What half the step changes of the deflection: the error of the integration."""
        _, recorded, deflections, _ = self.motion(export, path, 2 * self.steps, 1)
        times = whole[1]["modes"][:, 0]
        at = np.searchsorted(recorded["modes"][:, 0], times - 1e-12)
        return apart(deflections[at.clip(max=len(deflections) - 1)], whole[2])

    def simulate(self, program, path, whole, folder):
        """The largest difference of the deflections in `flexbody simulate`, driven by the attitude and the joint forces of Exudyn."""
        _, recorded, deflections, _ = whole
        # A joint's force acts on its first marker; the rod is the second.
        rows = np.column_stack([recorded["attitude"][:, 0], recorded["attitude"][:, 4:8] + [1, 0, 0, 0], -recorded["pin force"][:, 1:], -recorded["guide force"][:, 1:]])
        rows[:, 1:5] /= np.linalg.norm(rows[:, 1:5], axis=1)[:, None]
        np.savetxt(folder / "run.csv", rows, delimiter=",", header="t,p0,p1,p2,p3,ax,ay,az,bx,by,bz", comments="", fmt="%.17g")
        with h5py.File(path) as file:
            node = int(file["nodes/id"][recorded["middle"]])
        column = lambda names: f'{{ file = "run.csv", time = "t", columns = {names}, interpolation = "cubic" }}'.replace("'", '"')
        lines = [f"[run]\nduration = {float(rows[-1, 0])!r}\noutputs = {len(rows) - 1}\nmethod = \"conserving\"\nstep = {float(rows[-1, 0] / self.steps)!r}", f"[damping]\nratio = {DAMPING}",
                 f'[spin]\nattitude_from = {column(["p0", "p1", "p2", "p3"])}'.replace(', interpolation = "cubic"', ""),
                 f'[[load]]\ninterface = "left"\nforce_from = {column(["ax", "ay", "az"])}', f'[[load]]\ninterface = "right"\nforce_from = {column(["bx", "by", "bz"])}', f"[[watch]]\nnode = {node}"]
        (folder / "run.toml").write_text("\n".join(lines) + "\n")
        begin = time.perf_counter()
        program.run("simulate", path, "--scene", folder / "run.toml", "-o", folder / "run.h5", "--quiet")
        self.simulated_seconds = time.perf_counter() - begin
        with h5py.File(folder / "run.h5") as file:
            return apart(file[f"points/node {node}/deflection"][()], deflections)


def settled(values, reference):
    """The root mean square difference over the second half, relative to that of the reference."""
    half = len(reference) // 2
    return float(np.linalg.norm(values[half:] - reference[half:]) / np.linalg.norm(reference[half:]))


def apart(values, reference):
    """The largest distance relative to the largest length of the reference."""
    return float(np.linalg.norm(values - reference, axis=1).max() / np.linalg.norm(reference, axis=1).max())
