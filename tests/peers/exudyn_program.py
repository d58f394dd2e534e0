#!/usr/bin/env python3
"""The program that is written beside the file of Exudyn: its damping, and its table of the motion in `flexbody recover`.

Optional, seconds: needs Python with exudyn, h5py and numpy; not part of `cargo test`.

    python3 -m venv target/peers && target/peers/bin/pip install exudyn==1.13.6 h5py numpy
    cargo build --release
    target/peers/bin/python tests/peers/exudyn_program.py

* damping: a body with the damping ratio of its manifest turns freely, in Exudyn and in `flexbody simulate`; a body without damping, with the
  option `--damping` in both; a body whose damping matrix is not diagonal. What is left is the integration in Exudyn, which falls with the steps.
* recovery: `flexbody recover --history` of the table of Exudyn beside `flexbody simulate --rows`: section forces of the spinning body.
* loads: impulse and angular impulse of the joints in the table are the changes of the momenta of the driven body.
"""

import sys

import h5py
import numpy as np
from common import ROOT, Row, compare_alone, run

# Relative to the largest value of each quantity over the run: errors of the integration at STEPS steps, and of the sums of the impulses, which
# nearly cancel between two fixed ends.
STEPS, PERIODS = 4000, 8
LIMITS = {"damping": 2e-3, "recovery": 4e-3, "loads": 2e-2}
# The share of the vibration that damping of 3 % takes over the run is large against these limits.
RATIO = 0.03


class Case:
    """A body with a recovery of section forces, exported with its program."""

    def __init__(self, flexbody, folder, name, damping, *options):
        self.flexbody, self.folder = flexbody, folder / name
        self.folder.mkdir()
        model = ROOT / "fixtures/models/bracket_hex20"
        text = (model / "model.toml").read_text()
        for file in ("K.mtx.gz", "M.mtx.gz", "nodes.csv", "dofs.csv", "matrices.inp.gz"):
            text = text.replace(f'"{file}', f'"{model}/{file}')
        positions = np.genfromtxt(model / "nodes.csv", delimiter=",", skip_header=1)[:, 1:4]
        low, high = positions.min(axis=0) - 1, positions.max(axis=0) + 1
        high[0] = positions[:, 0].mean()
        text += f'\n[[recovery]]\nname = "section"\nbox = {{ min = {low.tolist()}, max = {high.tolist()} }}\ndeformed_inertia = true\n{damping}'
        (self.folder / "model.toml").write_text(text)
        self.body = self.folder / "b.flex.h5"
        run(flexbody, "convert", self.folder / "model.toml", "--lumped", "none", "--quiet", "-o", self.body, *options)
        run(flexbody, "export", self.body, "--to", "exudyn", "--points", "interfaces", "--quiet", "-o", self.folder / "b.hdf5")
        with h5py.File(self.body) as file:
            eigenvalue = file["modes/eigenvalue"][()]
            self.axes = file["frame/axes"][()]
        self.period = float(2 * np.pi / np.sqrt(eigenvalue[0]))

    def program(self, *options):
        """The table of the program: names of the columns and values."""
        table = self.folder / "run.csv"
        run(sys.executable, self.folder / "b_exudyn.py", "--steps", STEPS, "--periods", PERIODS, "--csv", table, *options)
        return read(table)

    def simulated(self, spin, damping=""):
        """The same motion by `flexbody simulate` at the same instants, and its recovery."""
        scene = self.folder / "spin.toml"
        duration = PERIODS * self.period
        world = self.axes @ spin
        scene.write_text(f"[run]\nduration = {duration!r}\noutputs = {STEPS}\ntolerance = 1e-10\n[initial]\nangular_velocity = {world.tolist()}\n{damping}")
        run(self.flexbody, "simulate", self.body, "--scene", scene, "--csv", self.folder / "own.csv", "--rows", self.folder / "own_rows.csv")
        return read(self.folder / "own.csv")

    def recovered(self):
        run(self.flexbody, "recover", self.body, "--history", self.folder / "run.csv", "-o", self.folder / "rows.csv")
        return [read(self.folder / name)[1][:, 1:] for name in ("rows.csv", "own_rows.csv")]


def read(table):
    with open(table, encoding="utf-8") as file:
        names = file.readline().strip().split(",")
    return names, np.loadtxt(table, delimiter=",", skiprows=1)


def columns(table, *prefixes):
    names, values = table
    return values[:, [k for k, name in enumerate(names) if name.startswith(prefixes)]]


def apart(ours, theirs):
    """The largest difference over the run, over the largest value; tables must have the same rows."""
    if ours.shape != theirs.shape:
        raise AssertionError(f"{ours.shape} {theirs.shape}")
    return float(np.abs(ours - theirs).max() / np.abs(ours).max())


def momenta(case, table):
    """Impulse and angular impulse of the joints, and the changes of the momenta of the body, about the origin of the world.

    The body moves by a thousandth of its size, so its arms are those of the undeformed body.
    """
    with h5py.File(case.folder / "b.hdf5") as file:
        mass, centre, inertia = float(file["totalMass"][()]), file["chiU"][()], file["inertiaLocal"][()]
        linear, angular = file["mPhitTPsi"][()], -file["mXRefTildePsi"][()]
        entries = [file["interfaces"][key] for key in file["interfaces"]]
        arms = {text(entry["name"][()]): case.axes @ entry["referencePoint"][()] for entry in entries}
    # Vectors along world axes, which are those of the frame at the start; columns of the table are along those of the model.
    frame = lambda values: values @ case.axes
    rate, omega, velocity = columns(table, "qd_"), frame(columns(table, "angular_velocity_")), columns(table, "velocity_")
    p = mass * (velocity + np.cross(omega, centre)) + rate @ linear.T
    moment = mass * np.cross(centre, velocity) + omega @ inertia.T + rate @ angular.T
    force, torque = np.zeros_like(p), np.zeros_like(p)
    for name, arm in arms.items():
        here = columns(table, f"{name} force_")
        if here.size:
            force += frame(here)
            torque += frame(columns(table, f"{name} torque_") + np.cross(arm, here))
    time = np.diff(table[1][:, 0])[:, None]
    total = lambda values: np.vstack([np.zeros(3), np.cumsum(0.5 * (values[1:] + values[:-1]) * time, axis=0)])
    return {"impulse": (p - p[0], total(force)), "angular impulse": (moment - moment[0], total(torque))}


def text(value):
    return value.decode() if isinstance(value, bytes) else value


def rows(flexbody, scratch):
    """Every comparison."""
    import exudyn as exu

    program, found = f"Exudyn {exu.__version__}", []
    row = lambda what, value, kind: found.append(Row(program, "exudyn", f"program: {what}", value, LIMITS[kind]))
    ratio = f"[damping]\nratio = {RATIO}\n"
    rayleigh = "[damping]\nrayleigh = { alpha = 400.0, beta = 2e-6 }\n"
    basis = ("--basis", "craig-bampton", "--modes", "4", "--frame", "model")
    cases = {
        "damping of the file": (Case(flexbody, scratch, "file", ratio, "--modes", "6"), (), ""),
        "option --damping": (Case(flexbody, scratch, "option", "", *basis), ("--damping", f"{100 * RATIO}%"), ratio),
        "damping matrix": (Case(flexbody, scratch, "matrix", rayleigh, *basis), (), ""),
    }
    for name, (case, theirs, ours) in cases.items():
        spin = np.array([0.02, 1.0, 0.03]) * 0.1 / case.period
        run_options = ("--spin", *spin, *theirs)
        there, here = case.program(*run_options), case.simulated(spin, ours)
        row(f"modal coordinates of a damped free body, {name}", apart(columns(here, "q_"), columns(there, "q_")), "damping")
        row(f"its angular velocity, {name}", apart(columns(here, "angular_velocity_"), columns(there, "angular_velocity_")), "damping")
        row(f"its attitude, {name}", apart(columns(here, "attitude_"), columns(there, "attitude_")), "damping")
        # Damping must be seen: without it, the motion is another.
        free = case.program("--spin", *spin, "--damping", 0)
        if apart(columns(here, "q_"), columns(free, "q_")) < 20 * LIMITS["damping"]:
            row(f"effect of the damping, {name}", float("inf"), "damping")
        case.program(*run_options)
        recovered, own = case.recovered()
        row(f"section forces by recover, {name}", apart(own, recovered), "recovery")
    for other in ("--bushing", "--fix", "--free"):
        for what, (change, impulse) in momenta(case, case.program("--drive", "bolt_base", other, "bolt_wall")).items():
            row(f"{what} of the joints in the table, {other[2:]}", apart(change, impulse), "loads")
    return found


if __name__ == "__main__":
    compare_alone(__doc__, rows)
