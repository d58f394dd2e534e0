#!/usr/bin/env python3
"""The bracket on a shaker, in Exudyn: the table pushes both bolts along z and holds them again, the pin carries an instrument.

    python shaker.py FOLDER

FOLDER is where tutorial.sh has put bracket_cb.hdf5 and the program beside it. Needs exudyn, h5py and numpy. Prints the lowest
frequency of the vibration beside the one that stiffness and mass of the file have with the bolts held, and writes the motion of
the instrument to shaker.csv; with matplotlib also shaker.png. Units are those of the body: mm, t, s.
"""

import importlib.util
import json
import sys
from pathlib import Path

import exudyn as exu
import exudyn.itemInterface as eii
import h5py
import numpy as np
from exudyn.rigidBodyUtilities import RigidBodyInertia

BOLTS = ["bolt_a", "bolt_b"]
# A ball of 0.2 kg with a radius of 15 mm.
MASS = 2e-4
INERTIA = 0.4 * MASS * 15**2
# The way of the table, and how many periods the push and the whole run take.
WAY, PUSH, RUN = 0.05, 0.5, 60
STEPS_PER_PERIOD = 200


def table(t, duration):
    """Along z, from rest to rest."""
    x = min(t / duration, 1.0)
    return WAY * (x - np.sin(2 * np.pi * x) / (2 * np.pi))


def held_frequency(path):
    """In hertz, of the body with its bolts held and the instrument at its pin."""
    with h5py.File(path) as f:
        group = f["interface_coordinates"]
        k, m, names = group["stiffness"][()], group["mass"][()].copy(), json.loads(group.attrs["names"])
    free = [i for i, name in enumerate(names) if not name.startswith(tuple(BOLTS))]
    pin = [i for i, name in enumerate(names) if name.startswith("pin")]
    assert len(pin) == 6, names
    m[pin, pin] += [MASS] * 3 + [INERTIA] * 3
    k, m = k[np.ix_(free, free)], m[np.ix_(free, free)]
    half = np.linalg.inv(np.linalg.cholesky(m))
    return np.sqrt(np.linalg.eigvalsh(half @ k @ half.T)[0]) / (2 * np.pi)


def simulate(folder, frequency):
    """Times, and displacements of the instrument."""
    spec = importlib.util.spec_from_file_location("bracket", folder / "bracket_cb_exudyn.py")
    bracket = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(bracket)
    mbs = exu.SystemContainer().AddSystem()
    body, places = bracket.add_body(mbs), bracket.interfaces()
    ground = mbs.AddObject(eii.ObjectGround())
    push = PUSH / frequency
    for bolt in BOLTS:
        stand = mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=ground, localPosition=list(places[bolt]["referencePoint"])))
        mbs.AddObject(eii.GenericJoint(
            markerNumbers=[stand, bracket.add_marker(mbs, body, bolt)], constrainedAxes=[1] * 6,
            offsetUserFunction=lambda mbs, t, number, offset: [0, 0, table(t, push), 0, 0, 0]))
    inertia = RigidBodyInertia(mass=MASS, inertiaTensor=INERTIA * np.eye(3))
    instrument = mbs.CreateRigidBody(referencePosition=list(places["pin"]["referencePoint"]), inertia=inertia)
    fixed = [bracket.add_marker(mbs, body, "pin"), mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=instrument))]
    mbs.AddObject(eii.GenericJoint(markerNumbers=fixed, constrainedAxes=[1] * 6))
    what = exu.OutputVariableType.Displacement
    sensor = mbs.AddSensor(eii.SensorBody(bodyNumber=instrument, outputVariableType=what, storeInternal=True))
    mbs.Assemble()
    settings = exu.SimulationSettings()
    time = settings.timeIntegration
    time.endTime, time.numberOfSteps, time.verboseMode = RUN / frequency, RUN * STEPS_PER_PERIOD, 0
    time.generalizedAlpha.spectralRadius = 1.0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 0.5 * time.endTime / time.numberOfSteps
    mbs.SolveDynamic(settings)
    told = mbs.GetSensorStoredData(sensor)
    return told[:, 0], told[:, 1:]


def lowest(times, values):
    """Frequency of the highest peak of a spectrum, between its lines by a parabola."""
    wave = (values - values.mean()) * np.hanning(len(values))
    size = np.log(np.abs(np.fft.rfft(wave, 8 * len(wave))) + 1e-300)
    at = int(size[1:-1].argmax()) + 1
    left, top, right = size[at - 1 : at + 2]
    return (at + 0.5 * (left - right) / (left - 2 * top + right)) / (8 * len(wave) * (times[1] - times[0]))


def draw(times, motion, path):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(8, 3.2), constrained_layout=True)
    for values, name in zip(motion.T, "xyz"):
        axes.plot(1e3 * times, 1e3 * values, label=name, linewidth=1)
    axes.set(xlabel="ms", ylabel="displacement of the instrument, µm")
    axes.legend(loc="right")
    figure.savefig(path, dpi=110)


def main():
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    expected = held_frequency(folder / "bracket_cb.flex.h5")
    times, motion = simulate(folder, expected)
    after = times > PUSH / expected
    found = lowest(times[after], motion[after, 0])
    print(f"lowest frequency {found:.2f} Hz in Exudyn, {expected:.2f} Hz of stiffness and mass: {abs(found / expected - 1):.1e} apart")
    np.savetxt(folder / "shaker.csv", np.column_stack([times, motion]), delimiter=",", header="s,x mm,y mm,z mm", comments="")
    try:
        draw(times[times < 12 / expected], motion[times < 12 / expected], folder / "shaker.png")
    except ImportError:
        print("no matplotlib: no picture")


if __name__ == "__main__":
    main()
