#!/usr/bin/env python3
"""Simulates the flexible body beside this file in Exudyn: a joint at each interface, one of them driven.

Written by flexbody beside BODY.hdf5 as BODY_exudyn.py; change it as you like. Needs exudyn, h5py and numpy.

    python BODY_exudyn.py                                 # drives the first interface, bushings at the others
    python BODY_exudyn.py --drive crank --fix bearing     # by name; --bushing, --free as well

Or in a model of your own:

    import BODY_exudyn
    body = BODY_exudyn.add_body(mbs, gravity=[0, 0, -9.81])
    marker = BODY_exudyn.add_marker(mbs, body, "crank")   # a marker for joints, springs and loads

Numbers are in the units of the body, which `flexbody inspect` tells. Axes are those of the body frame.
"""

import argparse
from pathlib import Path

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from exudyn.FEM import ObjectFFRFreducedOrderInterface
from exudyn.advancedUtilities import LoadDictFromHDF5
from exudyn.rigidBodyUtilities import RigidBodyInertia

HERE = Path(__file__).resolve()
FILE = HERE.with_name(HERE.name.removesuffix("_exudyn.py") + ".hdf5")
# Part of the mass and of the inertia of the body that a carrier of a reference point has.
WEIGHTLESS = 1e-8


def interfaces():
    """Interfaces by name: mesh nodes (from 0), their numbers in the FE model, weights, reference point, offset, kind of marker."""
    entries = LoadDictFromHDF5(str(FILE))["interfaces"]
    return {entry["name"]: entry for _, entry in sorted(entries.items())}


def add_body(mbs, **options):
    """Adds the body; `options` are those of AddObjectFFRFreducedOrder (gravity, positionRef, initialAngularVelocity, ...).

    Returns its dictionary (`oFFRFreducedOrder`, `nRigidBody`, `nGenericODE2`, ...) with the loaded file under `cms` and the options.
    """
    if not FILE.exists():
        raise SystemExit(f"{FILE} is not there: keep this program beside the file that flexbody export wrote, named BODY.hdf5")
    cms = ObjectFFRFreducedOrderInterface()
    cms.LoadFromFile(str(FILE))
    return {**cms.AddObjectFFRFreducedOrder(mbs, **options), "cms": cms, "options": options}


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


def simulate(kinds, size=None, periods=10, steps=1000):
    """A simulation with a joint of a kind at each interface, from rest.

    Prints and returns for each interface the displacement at the end and the largest, and the largest force of a rigid joint.
    """
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    body = add_body(mbs)
    extent = np.ptp(body["cms"].xRef.reshape(-1, 3), axis=0).max()
    size = 1e-3 * extent if size is None else size
    duration = periods * period(body)
    mbs.variables["ground"] = mbs.AddObject(eii.ObjectGround())
    sensors = {}
    for name, kind in kinds.items():
        marker, joint = add_joint(mbs, body, name, kind, lambda t: motion(t, size, duration / 2))
        place = mbs.AddSensor(eii.SensorMarker(markerNumber=marker, storeInternal=True, outputVariableType=exu.OutputVariableType.Position))
        force = None
        if joint is not None and kind in ("driven", "fixed"):
            local = exu.OutputVariableType.ForceLocal if interfaces()[name]["marker"] == "rigid" else exu.OutputVariableType.Force
            force = mbs.AddSensor(eii.SensorObject(objectNumber=joint, storeInternal=True, outputVariableType=local))
        sensors[name] = place, force
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = duration
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    # Of the forces that the motion takes: from rest there are none yet to which tolerances could be relative.
    forces = body["cms"].totalMass * size * (2 * np.pi / period(body)) ** 2
    settings.timeIntegration.newton.absoluteTolerance = 1e-8 * forces
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = duration / steps
    mbs.SolveDynamic(settings, showHints=True)
    found = {}
    for name, (place, force) in sensors.items():
        moved = mbs.GetSensorStoredData(place)[:, 1:] - interfaces()[name]["referencePoint"]
        found[name] = {"displacement": moved[-1], "largest": np.linalg.norm(moved, axis=1).max()}
        text = f"{name} ({kinds[name]}): moved by {np.array2string(moved[-1], precision=6)}, at most {found[name]['largest']:.6g}"
        if force is not None:
            found[name]["force"] = np.linalg.norm(mbs.GetSensorStoredData(force)[:, 1:], axis=1).max()
            text += f"; force up to {found[name]['force']:.6g}"
        print(text)
    return found


def main():
    names = list(interfaces())
    parser = argparse.ArgumentParser(description="simulates the body in Exudyn", epilog=f"interfaces: {', '.join(names)}")
    for kind in ("drive", "fix", "bushing", "free"):
        parser.add_argument(f"--{kind}", action="append", default=[], metavar="NAME", choices=names)
    arguments = parser.parse_args()
    given = {"driven": arguments.drive, "fixed": arguments.fix, "bushing": arguments.bushing, "free": arguments.free}
    kinds = {name: kind for kind, of in given.items() for name in of}
    if "driven" not in kinds.values():
        first = next((n for n in names if n not in kinds and interfaces()[n]["marker"] == "rigid"), None)
        if first is not None:
            kinds[first] = "driven"
    simulate({name: kinds.get(name, "bushing") for name in names})


if __name__ == "__main__":
    main()
