#!/usr/bin/env python3
"""Writes evidence/pages/seeds.md: how large the invariants and the terms of the equations of motion are on six bodies, and motions with and without terms.

    python3 -m venv target/peers && target/peers/bin/pip install exudyn==1.13.6 h5py numpy scipy
    cargo build --release --locked
    target/peers/bin/python evidence/programs/make_seeds.py

Bodies are converted by the program, the sizes of the terms are those of `flexbody select --json`; what numpy adds is arithmetic on the arrays of the files.
"""

import argparse
import itertools
import json
import os
import subprocess
import tempfile
from pathlib import Path

import h5py
import numpy as np

import seeds_claims
import seeds_flywheel
import seeds_mbdyn
import seeds_mechanism
import seeds_slider_crank
import seeds_text
from make_cutoff import hexahedra, save

ROOT = Path(__file__).resolve().parents[2]
MODES = 20
# Largest displacement in the first mode over the extent of the body.
DEFLECTION = 0.01
# For the guidelines: deflections, speeds over the first circular frequency, and the part of what stands beside it below which a term is left out.
DEFLECTIONS = (0.001, DEFLECTION)
SPEEDS = (0.002, 0.02, 0.1)
NEGLIGIBLE = 0.05
# Entries smaller than this beside the largest of their array are zeros that the precision of the modes has changed.
ROUNDING = 1e-6
# Modes of Table 4, each of which moves a node by DEFLECTION.
EQUAL_MODES = 10
BODIES = [
    ("rod", "connecting_rod", "connecting rod, quadratic tetrahedra"),
    ("car body", "car_frame", "space frame of a car body, beams"),
    ("slender beam", None, "1 x 0.02 x 0.01 m, 24 hexahedra with 20 nodes"),
    ("plate", "conveyor_plate", "plate of an apron conveyor"),
    ("structure 1", "satellite", "satellite with booms"),
    ("structure 2", "robot_link", "link of a robot"),
]
BEAM_CELLS, BEAM_SIZE = (24, 1, 1), (1.0, 0.02, 0.01)
GUIDELINES = [("I", ()), ("II", ("II",)), ("III", ("II", "III")), ("III, free", ("II", "III", "III, free slender bodies"))]
# Terms of `select`, as the tables call them. Its last one is a bound of the Coriolis torque across all axes; `Body.coriolis_torque`
# takes its place.
NAMES = {
    "linear inertia W1 Q": "W1 Q", "quadratic inertia Q'W2 Q": "Q'W2 Q", "inertia coupling Q'W3": "Q'W3", "constant centrifugal load W1'w w / 2": "W1'w w / 2",
    "centrifugal load that grows with q, W2 Q w w": "W2 Q w w", "Coriolis force on modes 2 W3' Qd w": "2 W3'Qd w", "Euler force on modes Q'W3 alpha": "W3(alpha)'q",
}
TORQUE = "Coriolis torque"
# What a prescribed rotation does not ask about: inertia of the rotation itself.
OF_ROTATION = ("W1 Q", "Q'W2 Q", "Q'W3", TORQUE)


def write_beam(folder, size=BEAM_SIZE, cells=BEAM_CELLS):
    """Writes a beam along x as a model with both ends as interfaces; returns its manifest."""
    x, k, m = hexahedra(cells, lambda lattice: lattice / np.array(cells) * np.array(size))
    save(folder / "K.mtx", k)
    save(folder / "M.mtx", np.kron(m, np.eye(3)))
    (folder / "nodes.csv").write_text("node,x,y,z\n" + "".join(f"{i + 1},{a!r},{b!r},{c!r}\n" for i, (a, b, c) in enumerate(x.tolist())))
    ends = {"left": x[:, 0] < 1e-9, "right": x[:, 0] > size[0] - 1e-9}
    lines = ['[model]\nname = "slender_beam"\n[model.units]\nlength = "m"\nmass = "kg"\ntime = "s"', '[files]\nstiffness = "K.mtx"\nmass = "M.mtx"\nnodes = "nodes.csv"']
    lines += [f'[[interface]]\nname = "{name}"\nnodes = {(np.flatnonzero(among) + 1).tolist()}' for name, among in ends.items()]
    (folder / "model.toml").write_text("\n".join(lines) + "\n")
    return folder / "model.toml"


class Body:
    """The arrays of a flex-body file, in kg, m, s, along the axes of its frame."""

    def __init__(self, name, what, path):
        self.name, self.what, self.path = name, what, path
        with h5py.File(path) as file:
            length, mass, time = (SI[file.attrs[f"units_{kind}"]] for kind in ("length", "mass", "time"))
            read = lambda entry: file[f"invariants/{entry}"][()]
            root = np.sqrt(mass)
            self.mass = float(np.ravel(read("mass"))[0]) * mass
            self.I0 = read("I0") * mass * length**2
            self.W1, self.W2, self.W3 = read("W1") * root * length, read("W2"), read("W3")
            self.S = read("S")
            self.rate = np.sqrt(file["modes/eigenvalue"][()]) / time
            self.shape = file["modes/shape"][()] / root
            positions = file["nodes/position"][()] * length
            self.units = length, time
        self.nf = len(self.rate)
        self.extent = float(np.ptp(positions, axis=0).max())
        self.largest = np.linalg.norm(self.shape, axis=2).max(axis=1)
        # Amplitudes: the first mode moves a node by DEFLECTION of the extent, the others by lambda_1 / lambda_p of its amplitude ([WP19] 5.2).
        self.amplitude = DEFLECTION * self.extent / self.largest[0] * (self.rate[0] / self.rate) ** 2

    def diagonal(self, array, k):
        """Block (k, k) of W1 (nf) or W2 (nf x nf)."""
        if array is self.W1:
            return array[k].reshape(3, self.nf)[k]
        return array.reshape(3, self.nf, 3, self.nf)[k, :, k, :]

    def linear(self):
        """(27): 2 of the integral of u0l ufl + u0m ufm over that of u0l^2 + u0m^2, largest over the axes, for every mode."""
        return max_over_axes(lambda k: np.abs(self.diagonal(self.W1, k)) * self.amplitude / self.I0[k, k])

    def quadratic(self):
        """(28): integral of ufl^2 + ufm^2 over that of u0l^2 + u0m^2."""
        return max_over_axes(lambda k: np.diag(self.diagonal(self.W2, k)) * self.amplitude**2 / self.I0[k, k])

    def coupling(self):
        """(36): the block Q'W3 beside the diagonal blocks I0 and I of the mass matrix, all modes being bent with the signs that are worst."""
        return max_over_axes(lambda k: self.coupling_rows()[k] / np.sqrt(self.I0[k, k]))

    def coupling_rows(self):
        """|Q|'|W3| (3 x nf)."""
        return np.einsum("kij,i->kj", np.abs(self.W3.reshape(3, self.nf, self.nf)), self.amplitude)

    def deformed_inertia(self):
        """The largest entries of W1 Q and Q'W2 Q (3 x 3) with the amplitudes of all modes, and the signs of their shapes."""
        linear = np.einsum("abj,j->ab", self.W1.reshape(3, 3, self.nf), self.amplitude)
        quadratic = np.einsum("i,aibj,j->ab", self.amplitude, self.W2.reshape(3, self.nf, 3, self.nf), self.amplitude)
        return np.abs(linear).max(), np.abs(quadratic).max()

    def table_4(self):
        """Means of the terms of an entry of W1 Q and of Q'W2 Q that are not zero, times their numbers n and n^2, with n modes that each move a node by DEFLECTION."""
        n = EQUAL_MODES
        amplitude = DEFLECTION * self.extent / self.largest[:n]
        linear = self.W1.reshape(3, 3, self.nf)[:, :, :n] * amplitude
        quadratic = np.einsum("i,aibj,j->aibj", amplitude, self.W2.reshape(3, self.nf, 3, self.nf)[:, :n, :, :n], amplitude)
        return n * nonzero(linear).mean(), n**2 * nonzero(quadratic).mean()

    def coupled(self):
        """(37) to (39): what the modal mass 1 of every mode loses by the Schur complement, all modes being bent with one sign each that is worst."""
        return (self.coupling_rows()**2 / np.diag(self.I0)[:, None]).sum(axis=0)

    def coriolis_torque(self, scale):
        """(W1 Qd + Q'W2 Qd + Qd'W2 Q) w beside I0 w Omega_1, whatever the signs: the rate at which the inertia changes, largest over the axes; with `scale` times the amplitudes."""
        amplitude = scale * self.amplitude
        rates = amplitude * self.rate / self.rate[0]

        def about(k):
            quadratic = self.diagonal(self.W2, k)
            return (np.abs(self.diagonal(self.W1, k)) @ rates + amplitude @ np.abs(quadratic + quadratic.T) @ rates) / self.I0[k, k]

        return max(about(k) for k in range(3))

    def coupling_bound(self):
        """(40): the squares of all amplitudes over the moments."""
        return float((self.amplitude @ self.amplitude / np.diag(self.I0)).sum())

    def averaged(self):
        """(19) to (22) relative to the largest displacement: root mean square over the mass of a mode, and its parts along x, y, z."""
        parts = np.array([np.diag(self.S[k, k]) for k in range(3)])
        return np.sqrt(parts.sum(axis=0) / self.mass) / self.largest, np.sqrt(parts.clip(min=0) / self.mass) / self.largest


SI = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "kg": 1.0, "g": 1e-3, "t": 1e3, "tonne": 1e3, "s": 1.0, "ms": 1e-3, "us": 1e-6}


def nonzero(array):
    """The magnitudes above the rounding of the largest."""
    magnitudes = np.abs(array).ravel()
    return magnitudes[magnitudes > ROUNDING * magnitudes.max()]


def max_over_axes(of_axis):
    return np.max([of_axis(k) for k in range(3)], axis=0)


class Program:
    """flexbody, whose failures are shown."""

    def __init__(self, path):
        self.path = str(Path(path).resolve())

    def run(self, *words, codes=(0,)):
        done = subprocess.run([self.path, *map(str, words)], capture_output=True, text=True)
        if done.returncode not in codes:
            raise RuntimeError(f"{' '.join(map(str, words))} ended with {done.returncode}:\n{done.stderr}")
        return done.stdout

    def convert(self, model, path, modes, *options):
        frame = () if "--frame" in options else ("--frame", "principal")
        self.run("convert", model, "--modes", modes, "--lumped", "none", "--quiet", "-o", path, *frame, *options)

    def significance(self, body, deflection, speed, folder):
        """Sizes of the terms at `speed` times the first circular frequency and such a deflection over the extent."""
        length, time = body.units
        scene = folder / "range.toml"
        scene.write_text(f"[motion]\nangular_velocity = {float(speed * body.rate[0] * time)!r}\n[limits]\ndeflection = {float(deflection * body.extent / length)!r}\n")
        told = json.loads(self.run("select", body.path, "--scene", scene, "--json", codes=(0, 1)))["results"]["significance"]
        sizes = {NAMES[one["term"]]: (one["tier_1"], one["guideline"]) for one in told if one["term"] in NAMES}
        assert len(sizes) == len(NAMES), told
        return {**sizes, TORQUE: (body.coriolis_torque(deflection / DEFLECTION), "IV")}


def number(value):
    return f"{value:.3g}" if value == 0 or 1e-3 <= abs(value) < 1e4 else f"{value:.1e}"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows]) + "\n"


def invariants(bodies):
    """Tables 2 and 3."""
    rows = []
    for body in bodies:
        for name in ("I0", "W1", "W2", "W3"):
            a = getattr(body, name)
            rows.append([body.name if name == "I0" else "", name, number(np.abs(a).max()), number(nonzero(a).mean()), number(np.linalg.norm(a)), number(nonzero(a).size / a.size), number(np.mean(np.abs(a) > 0.01 * np.abs(a).max()))])
    return table(["body", "array", "largest entry", "mean of the nonzero entries", "Frobenius norm", "part that is not zero", "part of the entries above 1 % of the largest"], rows)


def ratios(bodies, sizes):
    """Tables 4 and 5: a row for every term."""
    head = ["term", "guideline"] + [body.name for body in bodies]
    rows = []
    for term, (_, guideline) in sizes[bodies[0].name].items():
        rows.append([term, guideline] + [number(sizes[body.name][term][0]) for body in bodies])
    return table(head, rows)


def linear_and_quadratic(bodies):
    """Table 4: the quadratic inertia beside the linear one."""
    rows = []
    for body in bodies:
        equal, falling = body.table_4(), body.deformed_inertia()
        rows.append([body.name, *map(number, (*equal, equal[1] / equal[0], *falling, falling[1] / falling[0]))])
    return table(["body", "Table 4: W1 Q", "Q'W2 Q", "ratio", "falling amplitudes: W1 Q", "Q'W2 Q", "ratio"], rows)


def averaged(bodies):
    rows = []
    for body in bodies:
        mean, parts = body.averaged()
        first = ", ".join(number(part) for part in parts[:, 0])
        rows.append([body.name, number(mean[0]), first, number(np.median(mean)), f"{number(mean.min())} (mode {mean.argmin() + 1})", number(mean.max())])
    return table(["body", "(19): mode 1", "(20) to (22): mode 1 along x, y, z", "median of 20 modes", "least", "most"], rows)


def per_mode(bodies):
    head = ["body", "measure"] + [f"{j}" for j in range(1, 9)] + ["largest of 9 to 20", "bound (40)"]
    rows = []
    for body in bodies:
        measures = (("(27), linear", body.linear()), ("(28), quadratic", body.quadratic()), ("(36), coupling", body.coupling()), ("(38), (39), loss of modal mass", body.coupled()))
        for name, values in measures:
            coupling = name.startswith("(38)")
            assert not coupling or values.max() <= body.coupling_bound(), body.name
            rows.append([body.name if name.startswith("(27)") else "", name] + [number(v) if v > 1e-9 else "0" for v in values[:8]] + [number(values[8:].max()), number(body.coupling_bound()) if coupling else ""])
    return table(head, rows)


def qualifying(sizes, driven):
    """The first guideline that leaves out nothing above NEGLIGIBLE, and the largest term that decides: of the guideline before it, or of what I leaves out."""
    counted = {term: value for term, value in sizes.items() if not (driven and term in OF_ROTATION)}
    before = None
    for name, labels in GUIDELINES:
        out = {term: size for term, (size, label) in counted.items() if label not in labels}
        term = max(out, key=out.get)
        decides = f"{term} {number(out[term])}"
        if out[term] < NEGLIGIBLE:
            return name, before or decides
        before = decides
    return "IV", before


def guidelines(bodies, sizes):
    """A row for every body, deflection and kind of rotation; how many bodies qualify for what."""
    rows, count = [], {}
    for body in bodies:
        for deflection in DEFLECTIONS:
            for driven in (True, False):
                found = [qualifying(sizes[body.name, deflection, speed], driven) for speed in SPEEDS]
                for speed, (name, _) in zip(SPEEDS, found):
                    count.setdefault((driven, deflection, speed), []).append(name)
                first = driven and deflection == DEFLECTIONS[0]
                rows.append([body.name if first else "", f"{100 * deflection:g} %" if driven else "", "given" if driven else "free"] + [f"**{name}**: {decides}" for name, decides in found])
    return table(["body", "deflection", "rotation"] + [f"speed {speed:g} Omega_1" for speed in SPEEDS], rows), count


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    parser.add_argument("--program", default=str(target / "release" / "flexbody"), help="flexbody (default: the release build)")
    parser.add_argument("--output", type=Path, default=ROOT / "evidence/pages/seeds.md")
    parser.add_argument("--mbdyn", help="MBDyn of 2024 or later: the slider-crank is run in it too")
    args = parser.parse_args()
    program = Program(args.program)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        beam = write_beam(folder)
        bodies, sizes = [], {}
        for at, (name, model, what) in enumerate(BODIES):
            path = folder / f"body{at}.flex.h5"
            program.convert(beam if model is None else ROOT / "fixtures/models" / model / "model.toml", path, MODES)
            bodies.append(Body(name, what if model is None else f"`{model}`: {what}", path))
            for deflection, speed in itertools.product(DEFLECTIONS, SPEEDS):
                sizes[name, deflection, speed] = program.significance(bodies[-1], deflection, speed, folder)
            sizes[name] = sizes[name, DEFLECTION, SPEEDS[-1]]
        mechanism = seeds_mechanism.Study(program, beam, folder)
        (folder / "crank").mkdir()
        crank = write_beam(folder / "crank", seeds_slider_crank.CRANK_SIZE, seeds_slider_crank.CRANK_CELLS)
        terms = seeds_slider_crank.Study(program, {"rod": beam, "crank": crank}, folder)
        in_mbdyn = seeds_mbdyn.Study(args.mbdyn, program, terms.parts, folder) if args.mbdyn else None
        wheels = seeds_flywheel.Study(program, folder)
    version = program.run("--version").split()[-1]
    chosen, count = guidelines(bodies, sizes)
    settings = {"DEFLECTION": f"{100 * DEFLECTION:g} %", "NEGLIGIBLE": f"{100 * NEGLIGIBLE:g} %", "SPEED": SPEEDS[-1], "ROUNDING": f"{ROUNDING:g}", "EQUAL": EQUAL_MODES}
    tables = {"INVARIANTS": invariants(bodies), "RATIOS": ratios(bodies, sizes), "AVERAGED": averaged(bodies), "MODES": per_mode(bodies), "GUIDELINES": chosen, "QUADRATIC": linear_and_quadratic(bodies)}
    motions = seeds_claims.words(bodies, sizes, wheels, terms, in_mbdyn)
    args.output.write_text(seeds_text.page(bodies, sizes, {**tables, **motions}, count, mechanism, seeds_mechanism, settings, version), encoding="utf-8")
    print(args.output)


if __name__ == "__main__":
    main()
