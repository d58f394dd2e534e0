#!/usr/bin/env python3
"""Interfaces of exported bodies in Exudyn, beside `flexbody simulate`: the program that is written beside the file, and its markers.

Optional, about a minute: needs Python with exudyn, h5py and numpy; not part of `cargo test`.

    python3 -m venv target/peers && target/peers/bin/pip install exudyn==1.13.6 h5py numpy
    cargo build --release
    target/peers/bin/python tests/peers/exudyn_interfaces.py

For each body with Craig-Bampton modes, in the axes of its model:

* program: `BODY_exudyn.py` as it was written, run as a user would, and its answer: the driven interface goes where it is told;
* flight: a free body that turns, and bends as it does; where its interfaces are, the first about a point beside its nodes;
* force: a free body pushed at the reference point of an interface.

Both as the body is exported with all its nodes, and with six nodes for each interface (`--points interfaces`).

Exudyn's markers take their place from the mesh nodes, `flexbody simulate` from the shapes of the interface. Differences are the largest over all
recorded instants, over the extent of the body (flight) or the largest displacement (force). What is left is mostly the integration in Exudyn, of second order.
Exits with 1 when a number is worse than its limit.
"""

import argparse
import importlib.util
import subprocess
import sys
import tempfile
from pathlib import Path

import exudyn as exu
import exudyn.itemInterface as eii
import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
BODIES = ["bracket_hex20", "connecting_rod"]
MODES = 4
INSTANTS = 20
STEPS = 4000
REFERENCE = [30.0, 12.0, 9.0]
LIMITS = {"flight": 1e-6, "force": 1e-4}


def run(*words):
    subprocess.run([*map(str, words)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def with_reference_point(model):
    """The manifest with the reference point of the first interface away from the mean of its nodes."""
    text = (model / "model.toml").read_text()
    for file in ("K.mtx", "M.mtx", "nodes.csv", "dofs.csv"):
        text = text.replace(f'"{file}', f'"{model}/{file}')
    head, interface = text.split("[[interface]]\n", 1)
    return f"{head}[[interface]]\nreference = {REFERENCE}\n{interface}"


class Body:
    def __init__(self, flexbody, name, folder, points):
        self.flexbody, self.folder = flexbody, folder
        self.path = folder / f"{name}.flex.h5"
        manifest = folder / f"{name}.toml"
        manifest.write_text(with_reference_point(ROOT / "fixtures/models" / name))
        run(flexbody, "convert", manifest, "--basis", "craig-bampton", "--modes", MODES, "--frame", "model", "--lumped", "none", "-o", self.path)
        run(flexbody, "export", self.path, "--to", "exudyn", "--points", points, "-o", folder / f"{name}.hdf5")
        self.program = folder / f"{name}_exudyn.py"
        spec = importlib.util.spec_from_file_location(name, self.program)
        self.module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(self.module)
        with h5py.File(self.path) as f:
            self.lam, self.mass = f["modes/eigenvalue"][()], float(f["invariants/mass"][0])
            self.extent = float(np.ptp(f["nodes/position"][()], axis=0).max())
            self.interfaces = list(self.module.interfaces())
        self.period = float(2 * np.pi / np.sqrt(self.lam[0]))

    def ours(self, scene):
        path, motion = self.folder / "scene.toml", self.folder / "motion.h5"
        watched = "".join(f'[[watch]]\ninterface = "{name}"\n' for name in self.interfaces)
        path.write_text(scene + watched)
        run(self.flexbody, "simulate", self.path, "--scene", path, "-o", motion)
        with h5py.File(motion) as f:
            names = {name: next(g for g in f["points"] if g.endswith(name)) for name in self.interfaces}
            return {name: f[f"points/{group}/place"][()] for name, group in names.items()}

    def exudyn(self, duration, push=None, **options):
        container = exu.SystemContainer()
        mbs = container.AddSystem()
        body = self.module.add_body(mbs, **options)
        markers = {name: self.module.add_marker(mbs, body, name) for name in self.interfaces}
        if push is not None:
            name, force = push
            mbs.AddLoad(eii.LoadForceVector(markerNumber=markers[name], loadVector=list(force)))
        what = exu.OutputVariableType.Position
        sensors = {name: mbs.AddSensor(eii.SensorMarker(markerNumber=m, outputVariableType=what, storeInternal=True)) for name, m in markers.items()}
        mbs.Assemble()
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps, settings.timeIntegration.endTime = STEPS, duration
        settings.timeIntegration.verboseMode, settings.timeIntegration.adaptiveStep = 0, False
        settings.timeIntegration.newton.useModifiedNewton = False
        settings.timeIntegration.generalizedAlpha.spectralRadius = 1.0
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = 0.5 * duration / STEPS
        mbs.SolveDynamic(settings)
        return {name: mbs.GetSensorStoredData(s)[:: STEPS // INSTANTS, 1:] for name, s in sensors.items()}

    def flight(self):
        duration = 3 * self.period
        omega = np.array([0.02, 1.0, 0.03]) * 0.2 / self.period
        scene = f"[run]\nduration = {duration!r}\noutputs = {INSTANTS}\ntolerance = 1e-12\n[initial]\nangular_velocity = {omega.tolist()}\n"
        theirs = self.exudyn(duration, initialAngularVelocity=list(omega))
        ours = self.ours(scene)
        return max(float(np.abs(ours[n] - theirs[n]).max()) for n in self.interfaces) / self.extent

    def force(self):
        # From rest, for so long that the body bends but does not yet turn.
        duration, name = 2 * self.period, self.interfaces[0]
        force = 1e-6 * self.mass * self.extent / self.period**2 * np.array([1.0, -0.5, 0.7])
        scene = f"[run]\nduration = {duration!r}\noutputs = {INSTANTS}\ntolerance = 1e-12\n[[load]]\ninterface = \"{name}\"\nforce = {force.tolist()}\naxes = \"world\"\n"
        theirs, ours = self.exudyn(duration, push=(name, force)), self.ours(scene)
        largest = max(float(np.abs(ours[n] - ours[n][0]).max()) for n in self.interfaces)
        return max(float(np.abs(ours[n] - theirs[n]).max()) for n in self.interfaces) / largest

    def program_runs(self):
        done = subprocess.run([sys.executable, self.program], capture_output=True, text=True)
        print(done.stdout.strip(), done.stderr.strip()[-2000:])
        found = self.module.simulate({self.interfaces[0]: "driven", **{name: "bushing" for name in self.interfaces[1:]}})
        goal = 1e-3 * self.extent
        moved = found[self.interfaces[0]]["displacement"]
        return done.returncode == 0 and abs(moved[0] - goal) < 1e-6 * goal and found[self.interfaces[0]]["force"] > 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flexbody", type=Path, default=ROOT / "target/release/flexbody")
    args = parser.parse_args()
    exu.SetWriteToConsole(False)
    wrong = []
    for name, points in [(name, points) for name in BODIES for points in ("nodes", "interfaces")]:
        with tempfile.TemporaryDirectory() as scratch:
            body = Body(args.flexbody, name, Path(scratch), points)
            print(f"\n{name}, {points}, {MODES} fixed-interface modes, {len(body.lam)} in all; exudyn {exu.__version__}")
            if not body.program_runs():
                wrong.append(f"{name}, {points}: the program")
            for what, limit in LIMITS.items():
                difference = getattr(body, what)()
                print(f"{what}: {difference:.1e}")
                if not difference <= limit:
                    wrong.append(f"{name}, {points}: {what}")
    sys.exit(f"worse than the limits: {wrong}" if wrong else 0)


if __name__ == "__main__":
    main()
