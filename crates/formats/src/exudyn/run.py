#!/usr/bin/env python3
"""Simulates the flexible body beside this file in Exudyn: a joint at each interface, one of them driven.

Written by flexbody beside BODY.hdf5 as BODY_exudyn.py; change it as you like. Needs exudyn, h5py, scipy and numpy.

    python BODY_exudyn.py                                 # drives the first interface, bushings at the others
    python BODY_exudyn.py --drive crank --fix bearing     # by name; --bushing, --free as well
    python BODY_exudyn.py --spin 0 0 50                   # a free body that turns
    python BODY_exudyn.py --damping 0.02 --csv run.csv    # 2 % of critical damping; the motion as a table

The table is the one that `flexbody recover BODY.flex.h5 --history run.csv` and `flexbody measure` read. Or in a model of your own:

    import BODY_exudyn
    body = BODY_exudyn.add_body(mbs, gravity=[0, 0, -9.81])
    marker = BODY_exudyn.add_marker(mbs, body, "crank")   # a marker for joints, springs and loads

`add_body` gives the object the damping of the file, which Exudyn's own loader leaves out.

Numbers are in the units of the body, which `flexbody inspect` tells. Axes are those of the body frame.
"""

import argparse
import functools
from pathlib import Path

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from exudyn.FEM import ObjectFFRFreducedOrderInterface
from exudyn.advancedUtilities import LoadDictFromHDF5
from exudyn.rigidBodyUtilities import RigidBodyInertia, RotationMatrix2EulerParameters

HERE = Path(__file__).resolve()
FILE = HERE.with_name(HERE.name.removesuffix("_exudyn.py") + ".hdf5")
# Part of the mass and of the inertia of the body that a carrier of a reference point has.
WEIGHTLESS = 1e-8
KINDS = ("driven", "fixed", "bushing", "free")


@functools.cache
def contents():
    """Content of the file."""
    if not FILE.exists():
        raise SystemExit(f"{FILE} is not there: keep this program beside the file that flexbody export wrote, named BODY.hdf5")
    try:
        return LoadDictFromHDF5(str(FILE))
    except ImportError:
        raise SystemExit(f"h5py and scipy are needed to read {FILE.name}: pip install h5py scipy") from None


def interfaces():
    """Interfaces by name: mesh nodes (from 0), their numbers in the FE model, weights, reference point, offset, kind of marker."""
    return {entry["name"]: entry for _, entry in sorted(contents().get("interfaces", {}).items())}


def add_body(mbs, damping=None, **options):
    """Adds the body; `options` are those of AddObjectFFRFreducedOrder (gravity, positionRef, initialAngularVelocity, ...).

    `damping` is a damping ratio for all modes (0.02: 2 % of the critical damping) that replaces the damping of the file.

    Returns its dictionary (`oFFRFreducedOrder`, `nRigidBody`, `nGenericODE2`, ...) with the loaded file under `cms` and the options.
    """
    contents()
    cms = ObjectFFRFreducedOrderInterface()
    cms.LoadFromFile(str(FILE))
    body = {**cms.AddObjectFFRFreducedOrder(mbs, **options), "cms": cms, "options": options}
    matrix = contents().get("dampingMatrixReduced") if damping is None else modal_damping(cms, damping)
    if matrix is not None:
        # AddObjectFFRFreducedOrder has set its own Rayleigh damping, which is zero unless the options state it.
        cms.dampingMatrixReduced = cms.dampingMatrixReduced + matrix
        container = exu.MatrixContainer()
        container.SetWithDenseMatrix(cms.dampingMatrixReduced, useDenseMatrix=False)
        mbs.SetObjectParameter(body["oFFRFreducedOrder"], "dampingMatrixReduced", container)
    return body


def modal_damping(cms, ratio):
    """Damping matrix with the damping ratio in every mode: M V diag(2 ratio omega) V' M with K V = M V omega^2 and V' M V = 1.

    The eigenvectors V are those of the reduced matrices, so the columns of the basis need not be modes of their own.
    """
    mass, stiffness = np.array(cms.massMatrixReduced), np.array(cms.stiffnessMatrixReduced)
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    squares, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.T)
    weighted = mass @ inverse.T @ vectors
    return weighted @ np.diag(2 * ratio * np.sqrt(np.maximum(squares, 0))) @ weighted.T


def add_marker(mbs, body, name):
    """A marker at the reference point of an interface, with rotations where its nodes determine them."""
    entry = interfaces()[name]
    nodes, weights = [int(node) for node in entry["meshNodeNumbers"]], list(entry["weights"])
    number = body["oFFRFreducedOrder"]
    if entry["marker"] != "rigid":
        # Nodes on a line, or one alone: a place without a direction, for spherical joints and forces.
        return mbs.AddMarker(eii.MarkerSuperElementPosition(
            name=name, bodyNumber=number, meshNodeNumbers=nodes, weightingFactors=weights))
    mean = mbs.AddMarker(eii.MarkerSuperElementRigid(
        name=name, bodyNumber=number, meshNodeNumbers=nodes, weightingFactors=weights, useAlternativeApproach=True))
    if np.linalg.norm(entry["offset"]) <= 1e-9 * np.linalg.norm(np.ptp(body["cms"].xRef.reshape(-1, 3), axis=0)):
        return mean
    return add_carrier(mbs, body, mean, entry)


def add_carrier(mbs, body, mean, entry):
    """A marker at a reference point that is not the mean of the nodes: on a rigid body without noticeable mass that the mean carries.

    The parameter `offset` of the marker would not do: Exudyn (1.13.6) turns it with the frame of the body, but not with the interface.
    """
    cms, given = body["cms"], body["options"]
    turn = np.array(given.get("rotationMatrixRef", np.eye(3)))
    turn = turn.reshape(3, 3) if turn.size else np.eye(3)
    arm = turn @ entry["referencePoint"]
    omega = np.array(given.get("initialAngularVelocity", [0, 0, 0]))
    carrier = mbs.CreateRigidBody(
        referencePosition=np.array(given.get("positionRef", [0, 0, 0])) + arm, referenceRotationMatrix=turn,
        initialVelocity=np.array(given.get("initialVelocity", [0, 0, 0])) + np.cross(omega, arm), initialAngularVelocity=omega,
        inertia=RigidBodyInertia(mass=WEIGHTLESS * cms.totalMass, inertiaTensor=WEIGHTLESS * np.trace(cms.inertiaLocal) / 3 * np.eye(3)))
    inside = mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=carrier, localPosition=list(-entry["offset"])))
    mbs.AddObject(eii.GenericJoint(markerNumbers=[mean, inside], constrainedAxes=[1] * 6))
    return mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=carrier))


def period(body):
    """Of the first mode."""
    lowest = body["cms"].stiffnessMatrixReduced[0, 0] / body["cms"].massMatrixReduced[0, 0]
    return 2 * np.pi / np.sqrt(lowest)


def motion(t, size, duration):
    """Displacements and rotations of the driven interface: it moves along x by `size` in `duration` and stays there."""
    s = min(t / duration, 1.0)
    return [size * s**3 * (10 - 15 * s + 6 * s**2), 0, 0, 0, 0, 0]


def add_joint(mbs, body, name, kind, drive=None):
    """A joint of the interface `name` to the ground where it stands; `drive(t)` gives the motion of a driven one."""
    entry, ground = interfaces()[name], mbs.variables["ground"]
    marker = add_marker(mbs, body, name)
    place = mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=ground, localPosition=list(entry["referencePoint"])))
    rigid = entry["marker"] == "rigid"
    if kind == "free":
        return marker, None
    if kind == "bushing":
        # As soft as the body itself.
        stiffness = body["cms"].totalMass * (2 * np.pi / period(body)) ** 2
        if not rigid:
            return marker, mbs.AddObject(eii.CartesianSpringDamper(markerNumbers=[place, marker], stiffness=[stiffness] * 3))
        turning = stiffness * np.trace(body["cms"].inertiaLocal) / body["cms"].totalMass
        return marker, mbs.AddObject(eii.RigidBodySpringDamper(
            markerNumbers=[place, marker], stiffness=np.diag([stiffness] * 3 + [turning] * 3), damping=np.zeros((6, 6))))
    moving = (lambda mbs, t, number, offset: drive(t)) if kind == "driven" else 0
    if rigid:
        return marker, mbs.AddObject(eii.GenericJoint(
            markerNumbers=[place, marker], constrainedAxes=[1] * 6, offsetUserFunction=moving))
    if kind == "driven":
        raise SystemExit(f"the nodes of {name!r} determine no rotation: drive another interface")
    return marker, mbs.AddObject(eii.SphericalJoint(markerNumbers=[place, marker]))


def add_sensors(mbs, body, joints, kinds):
    """Sensors of everything that the table of the motion has: `joints` gives the joint of each interface, or None, `kinds` its kind."""
    what = exu.OutputVariableType

    def of_node(key, kind):
        return mbs.AddSensor(eii.SensorNode(nodeNumber=body[key], storeInternal=True, outputVariableType=kind))

    def of_joint(joint, name, kind):
        return mbs.AddSensor(eii.SensorObject(objectNumber=joint, storeInternal=True, outputVariableType=kind))

    rigid, modal = "nRigidBody", "nGenericODE2"
    sensors = {
        "origin": of_node(rigid, what.Position), "turn": of_node(rigid, what.RotationMatrix),
        "velocity": of_node(rigid, what.Velocity), "omega": of_node(rigid, what.AngularVelocityLocal),
        "alpha": of_node(rigid, what.AngularAcceleration), "qdd": of_node(modal, what.Coordinates_tt),
        "q": of_node(modal, what.Coordinates), "qd": of_node(modal, what.Coordinates_t), "loads": {},
        "bushings": [name for name, kind in kinds.items() if kind == "bushing"]}
    for name, joint in joints.items():
        if joint is None:
            continue
        # The ground does not turn, so local axes of its marker are those of the world.
        turns = interfaces()[name]["marker"] == "rigid"
        kinds = [what.ForceLocal, what.TorqueLocal] if turns else [what.Force]
        sensors["loads"][name] = [of_joint(joint, name, kind) for kind in kinds]
    return sensors


def table_of(mbs, sensors):
    """Names and values of the columns of the motion, one row for each instant, as `flexbody recover --history` reads them.

    The axes are those of the FE model: attitude, angular velocity and loads of the body refer to them and not to the body frame.
    """
    def stored(sensor):
        return mbs.GetSensorStoredData(sensor)[:, 1:]

    axes = np.array(contents().get("frameAxes", np.eye(3)))
    time = mbs.GetSensorStoredData(sensors["origin"])[:, :1]
    turns = stored(sensors["turn"]).reshape(-1, 3, 3)
    attitude = np.array([np.ravel(RotationMatrix2EulerParameters(turn @ axes.T)) for turn in turns])
    parts = [
        (["time"], time), (xyz("origin"), stored(sensors["origin"])), ([f"attitude_{k}" for k in range(4)], attitude),
        (xyz("velocity"), stored(sensors["velocity"])), (xyz("angular_velocity"), stored(sensors["omega"]) @ axes.T),
        (xyz("angular_acceleration"), np.einsum("tji,tj->ti", turns, stored(sensors["alpha"])) @ axes.T)]
    for name in ("q", "qd", "qdd"):
        values = stored(sensors[name])
        parts.append(([f"{name}_{j + 1}" for j in range(values.shape[1])], values))
    for name, found in sensors["loads"].items():
        # The force is that on the ground, the first marker; the body takes the opposite. The torque of a GenericJoint has the other sign
        # (Exudyn 1.13.6). Along body axes, then along those of the model. A marker without rotation is at the mean of the nodes.
        force, *torque = [-np.einsum("tji,tj->ti", turns, stored(sensor)) for sensor in found]
        if torque:
            torque = torque[0] if name in sensors["bushings"] else -torque[0]
        else:
            torque = np.cross(-np.array(interfaces()[name]["offset"]), force)
        parts += [(xyz(f"{name} force"), force @ axes.T), (xyz(f"{name} torque"), torque @ axes.T)]
    return [name for names, _ in parts for name in names], np.hstack([values for _, values in parts])


def xyz(name):
    """Names of the columns of a vector."""
    return [f"{name}_{axis}" for axis in "xyz"]


def settings_of(duration, steps, force):
    """Settings of the integration; `force` is the size of the forces of the motion, which tolerances refer to."""
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = duration
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    # From rest there are no forces yet to which tolerances could be relative.
    settings.timeIntegration.newton.absoluteTolerance = 1e-8 * force
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = duration / steps
    return settings


def simulate(kinds, size=None, periods=10, steps=1000, damping=None, spin=None, csv=None):
    """A simulation with a joint of a kind at each interface, from rest or with the angular velocity `spin`.

    Prints and returns for each interface the displacement at the end and the largest, and the largest force of its joint.
    Writes the motion as a table to the file `csv`.
    """
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    body = add_body(mbs, damping=damping, **({} if spin is None else {"initialAngularVelocity": list(spin)}))
    extent = np.ptp(body["cms"].xRef.reshape(-1, 3), axis=0).max()
    size = 1e-3 * extent if size is None else size
    duration = periods * period(body)
    mbs.variables["ground"] = mbs.AddObject(eii.ObjectGround())
    places, joints = {}, {}
    for name, kind in kinds.items():
        marker, joints[name] = add_joint(mbs, body, name, kind, lambda t: motion(t, size, duration / 2))
        places[name] = mbs.AddSensor(eii.SensorMarker(markerNumber=marker, storeInternal=True, outputVariableType=exu.OutputVariableType.Position))
    sensors = add_sensors(mbs, body, joints, kinds)
    mbs.Assemble()
    mass = body["cms"].totalMass
    force = mass * size * (2 * np.pi / period(body)) ** 2
    if spin is not None:
        force = max(force, mass * extent * np.dot(spin, spin))
    mbs.SolveDynamic(settings_of(duration, steps, force), showHints=True)
    names, rows = table_of(mbs, sensors)
    if csv is not None:
        np.savetxt(csv, rows, delimiter=",", header=",".join(names), comments="", fmt="%.17g")
    found = {}
    for name, place in places.items():
        moved = mbs.GetSensorStoredData(place)[:, 1:] - interfaces()[name]["referencePoint"]
        found[name] = {"displacement": moved[-1], "largest": np.linalg.norm(moved, axis=1).max()}
        text = f"{name} ({kinds[name]}): moved by {np.array2string(moved[-1], precision=6)}, at most {found[name]['largest']:.6g}"
        if joints[name] is not None:
            columns = [names.index(column) for column in xyz(f"{name} force")]
            found[name]["force"] = np.linalg.norm(rows[:, columns], axis=1).max()
            text += f"; force up to {found[name]['force']:.6g}"
        print(text)
    if not kinds or spin is not None:
        q = rows[:, [names.index(f"q_{j + 1}") for j in range(body["cms"].nModes)]]
        print(f"{rows[-1, 0]:.6g} units of time; modal coordinates up to {np.abs(q).max():.6g}")
    return found


def ratio(text):
    """A damping ratio: 0.02 or 2%."""
    value = float(text[:-1]) / 100 if text.endswith("%") else float(text)
    if not 0 <= value < 1:
        raise ValueError(text)
    return value


def parsed():
    """The command line."""
    names = list(interfaces())
    parser = argparse.ArgumentParser(
        description="Simulates the flexible body of the file beside this program in Exudyn.",
        epilog=f"interfaces: {', '.join(names) or 'none'}. Numbers are in the units of the body; axes are those of the body frame.")
    texts = {
        "drive": "interface that moves along x by --size in half of the run, and stands still then; the first one unless --drive or --spin is given",
        "fix": "interface that stands still",
        "bushing": "interface on a spring as soft as the body; all interfaces that no option names, without --spin",
        "free": "interface without a joint; with --spin all interfaces that no option names"}
    for kind, text in texts.items():
        parser.add_argument(f"--{kind}", action="append", default=[], metavar="NAME", choices=names, help=f"{text}; can be given several times")
    parser.add_argument("--size", type=float, metavar="LENGTH", help="way of the driven interface [default: a thousandth of the longest side of the box around the exported nodes]")
    parser.add_argument("--spin", type=float, nargs=3, metavar=("X", "Y", "Z"), help="angular velocity at the start, in radians per unit of time; no interface is driven then")
    parser.add_argument("--damping", type=ratio, metavar="RATIO", help="damping ratio of all modes, 0.02 or 2%%, instead of the damping of the file")
    parser.add_argument("--periods", type=float, default=10, metavar="NUMBER", help="length of the run in periods of the first mode [default: 10]")
    parser.add_argument("--steps", type=int, default=1000, metavar="NUMBER", help="steps of the integration, which are the rows of the table too [default: 1000]")
    parser.add_argument("--csv", metavar="FILE", help="writes the motion as a table: time, origin and attitude, modal coordinates, loads of the joints; flexbody recover --history reads it")
    arguments = parser.parse_args()
    if not names and arguments.spin is None:
        parser.error("the body has no interfaces that could be driven: give --spin X Y Z, or import add_body into a model of your own")
    return arguments, names


def main():
    arguments, names = parsed()
    given = dict(zip(KINDS, (arguments.drive, arguments.fix, arguments.bushing, arguments.free)))
    kinds = {name: kind for kind, of in given.items() for name in of}
    turning = arguments.spin is not None
    if "driven" not in kinds.values() and not turning:
        first = next((n for n in names if n not in kinds and interfaces()[n]["marker"] == "rigid"), None)
        if first is not None:
            kinds[first] = "driven"
    simulate(
        {name: kinds.get(name, "free" if turning else "bushing") for name in names}, size=arguments.size, periods=arguments.periods,
        steps=arguments.steps, damping=arguments.damping, spin=arguments.spin, csv=arguments.csv)


if __name__ == "__main__":
    main()
