#!/usr/bin/env python3
"""Geometric stiffness from the stresses of CalculiX and from the deck beside element code, a blade under spin beside CalculiX, struts, beams and
discs beside their equations: writes evidence/pages/geometric_stiffness.md.

    apt install calculix-ccx; pip install numpy scipy h5py
    cargo build --release --locked
    python3 evidence/programs/make_geometric_stiffness.py
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from geometric_closed_forms import BEAM, DISC, STRUT, Body, rotating_beam, rotating_disc, struts
from geometric_elements import Part, by_element_code, full, given, of_elements, run, with_stresses

ROOT = Path(__file__).resolve().parents[2]
KINDS = ["C3D4", "C3D8", "C3D10", "C3D20"]
# Radius of the root, and spin of the rotor over the first frequency of the blade at rest.
HUB, SPIN_RATIO = 0.2, 0.83
MODES = 5
HEAD = """<!-- Written by evidence/programs/make_geometric_stiffness.py -->

# Geometric stiffness beside element code and CalculiX

Written by `./scripts/make.sh pages geometric_stiffness` with CalculiX {calculix}, by the steps of [geometric stiffness from CalculiX](../../docs/how_to/geometric_stiffness.md).

## Rows of K_geo

A twisted block with two interfaces, 18 loads: six products of spin rates, forces and moments at both ends, balanced by inertia. The difference is that of any entry from element code in numpy, relative to the largest entry of its load.

| elements | attitude and units | nodes | loads | largest difference |
|---|---|---|---|---|
"""

DECK = """
## From the deck

The same parts: 6 modes of `flexbody convert model.toml --geometric-stiffness spin,interfaces`, which takes the elements of the deck, beside the steps with CalculiX and the element code. The difference is that of any entry of K_geo in
these modes, relative to the largest entry of its load. C3D10 has 4 points in all three.

| elements | attitude and units | from the deck less CalculiX | CalculiX less element code | from the deck less element code |
|---|---|---|---|---|
"""
BUCKLING = """
## Buckling of a strut

A strut of 30 x 2 x 2 C3D20, {size} mm, without lateral contraction, under opposite forces at its ends that keep their directions. Body: K of element code with 17 digits, and K_geo of the forces along x at both ends; the critical force is the lowest at which
K_ff and K_geo, with the supports and, if both ends are pinned, the rotation of `/rotated_stiffness`, are singular. Pinned: 24 free modes with residual vectors of the interfaces; otherwise 24 modes of Craig-Bampton with the frame on the root. Beam: energies
E I t'^2 + k G A (w' - t)^2 (Timoshenko, k = 5/6) less F (w'^2 + t'^2 I / A), by Rayleigh and Ritz with polynomials. Euler: pi^2 E I / L^2 and its multiples, without shear.

| supports | bends along | body, N | beam, N | body less beam | body less Euler |
|---|---|---|---|---|---|
"""
ROTATING_BEAM = """
## Rotating beams

A beam of 30 x 2 x 2 C3D20, {size} mm, without lateral contraction, held at its root on a hub, at a rate about the axis of its thin side. Body: 30 modes of Craig-Bampton with the frame on the root. Beam: Timoshenko's with the
centrifugal force, by Rayleigh and Ritz with polynomials; Southwell's stiffening follows from it. Frequencies and rates are in sqrt(E I / (rho A L^4)) of the bending out of the plane; no gyroscopic terms. Wright and others (1982) have tables of such
beams; no value is taken from them.

| hub radius over length | rate | out of the plane 1, body | less beam | 2 | less beam | 3 | less beam | in the plane 1 | less beam | 2 | less beam |
|---|---|---|---|---|---|---|---|---|---|---|---|
"""
ROTATING_DISC = """
## A rotating disc

A disc of 12 x 32 x 1 C3D20R, {size} mm (inner radius, outer radius, thickness), held at its inner edge, in the rotating frame. Body: 100 modes of Craig-Bampton with the frame on the inner edge. Plate: Kirchhoff's with the plane stress of the spin in closed form, by Rayleigh and
Ritz with polynomials. Lower bound, by Rayleigh's principle: the root of the sum of the squares of the frequencies of the plate at rest and of the spinning membrane without bending stiffness, the two parts that Lamb and Southwell (1921) divide the problem into.

| rate over the first frequency at rest | nodal diameters | first, body, Hz | less plate | second, body, Hz | less plate | lower bound of the first, Hz |
|---|---|---|---|---|---|---|
"""

def turned():
    """A rotation about no axis of the model."""
    a, b = np.cos(0.7), np.sin(0.7)
    c, d = np.cos(-0.4), np.sin(-0.4)
    return np.array([[a, -b, 0], [b, a, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -d], [0, d, c]])


def block(x, y, z):
    angle = 0.3 * x
    y, z = 0.1 * (y - 0.5) * (1 - 0.2 * x), 0.08 * (z - 0.4)
    return np.array([0.3 * x + 0.05 * y, y * np.cos(angle) - z * np.sin(angle), y * np.sin(angle) + z * np.cos(angle)])


def blade(x, y, z):
    """A twisted and tapered blade along x from the hub; the rotor axis is z through the origin."""
    angle, width, thickness = 0.3 + 0.5 * x, 0.04 - 0.01 * x, 0.012 - 0.004 * x
    y, z = width * (y - 0.5), thickness * (z - 0.5)
    return np.array([HUB + 0.3 * x, y * np.cos(angle) - z * np.sin(angle), y * np.sin(angle) + z * np.cos(angle)])


def rows_of_kinds(flexbody, ccx, folder):
    for kind in KINDS:
        for name, units, turn in (("as built, m", "m", np.eye(3)), ("turned, mm", "mm", turned())):
            part = Part(kind, (3, 2, 2), block, units, turn)
            place = folder / f"{kind}_{units}"
            part.write(place, "averaging")
            with_stresses(flexbody, ccx, part, place)
            worst, count = by_element_code(part, place)
            # The program accepts every load, and the geometric stiffness is that of its files.
            told = run(flexbody, "convert", "stressed.toml", "--modes", 6, "--lumped", "none", "-o", "body.flex.h5", cwd=place)
            assert "FB451" in told and "FB442" not in told, told
            run(flexbody, "convert", "model.toml", "--geometric-stiffness", "spin,interfaces", "--modes", 6, "--lumped", "none", "-o", "deck.flex.h5", cwd=place)
            yield kind, name, len(part.ids), count, worst, *from_the_deck(part, place)


def from_the_deck(part, folder):
    """Largest differences of K_geo in the modes, relative to the largest entry of each load: of deck.flex.h5 from body.flex.h5, and of
    both from element code."""
    loads, matrices = of_elements(part, folder), []
    for name in ("body", "deck"):
        with h5py.File(folder / f"{name}.flex.h5") as file:
            own = {load: group["stiffness"][()] for load, group in file["geometric_stiffness"].items()}
            modes = file["modes/shape"][()]
            axes = file["frame/axes"][()]
        assert own.keys() == {name for name, _ in loads(axes)}
        matrices.append((own, modes, axes))
    (recipe, modes, axes), (deck, same, _) = matrices
    assert (modes == same).all()
    worst = np.zeros(3)
    for name, by_nodes in loads(axes):
        expected = np.einsum("ink,nm,jmk->ij", modes, by_nodes.toarray(), modes, optimize=True)
        for at, (found, wanted) in enumerate(((deck[name], recipe[name]), (recipe[name], expected), (deck[name], expected))):
            worst[at] = max(worst[at], abs(found - wanted).max() / abs(expected).max())
    return worst


class Blade:
    """The blade of C3D20 on its rotor: frequencies of CalculiX, of all nodes with our K_geo, and of the body."""

    def __init__(self, flexbody, ccx, folder, units="m", turn=np.eye(3), cells=(8, 2, 1)):
        self.part, self.folder, self.ccx, self.flexbody = Part("C3D20", cells, blade, units, turn), folder, ccx, flexbody
        self.axis = turn @ np.array([0.0, 0.0, 1.0])
        self.part.write(folder, "rigid")
        options = ("--basis", "craig-bampton", "--frame", "interface=root")
        with_stresses(flexbody, ccx, self.part, folder, options)
        run(flexbody, "convert", "stressed.toml", *options, "--modes", 24, "--lumped", "none", "-o", "body.flex.h5", cwd=folder)
        rest = self.calculix("rest", "")
        self.rate = SPIN_RATIO * 2 * np.pi * rest[0]
        self.rest = rest

    def calculix(self, job, load):
        """Frequencies of the blade held at its root, after a static step with large displacements."""
        static = f"*STEP, NLGEOM\n*STATIC\n*DLOAD\nEALL, CENTRIF, {load}\n*END STEP\n*STEP, PERTURBATION\n" if load else "*STEP\n"
        text = self.part.mesh() + f"*BOUNDARY\nROOT, 1, 3\n{static}*FREQUENCY\n{MODES}\n*END STEP\n"
        (self.folder / f"{job}.inp").write_text(text)
        run(self.ccx, "-i", job, cwd=self.folder)
        return printed_frequencies(self.folder / f"{job}.dat")

    def spinning(self):
        axis = ", ".join(f"{value:.15g}" for value in self.axis)
        return self.calculix("spin", f"{self.rate**2:.15g}, 0., 0., 0., {axis}")

    def squared(self):
        """w (w x): the matrix of w x (w x x)."""
        x, y, z = self.rate * self.axis
        skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        return skew @ skew

    def all_nodes(self, stiffened=True):
        """Frequencies of the held nodal equations with K_geo of all loads and the softening of the mass."""
        part = self.part
        k = part.matrices(self.folder)
        m = full(self.folder / "job.mas", *part.rows(self.folder / "job.dof"))
        turn = self.squared()
        # The reaction at the root, about its reference point.
        force = m @ (part.points @ turn.T).ravel()
        reaction = part.rigid(part.reference("root")).T @ force
        stiffness = k + m @ sp.kron(sp.identity(len(part.ids)), turn)
        if stiffened:
            w = self.rate * self.axis
            for kind, axis, interface, matrix in given(part, self.folder):
                if kind == "spin":
                    a, b = ("xyz".index(letter) for letter in axis)
                    stiffness = stiffness + w[a] * w[b] * matrix
                elif interface == "root":
                    stiffness = stiffness + reaction["xyz".index(axis) + (3 if kind == "moment" else 0)] * matrix
        held = np.zeros(3 * len(part.ids), bool)
        held[(3 * part.ends["root"][:, None] + np.arange(3)).ravel()] = True
        return frequencies(stiffness.tocsr()[~held][:, ~held].toarray(), m[~held][:, ~held].toarray())

    def body(self, stiffened=True):
        """Frequencies of the body on its rotor: K_ff with the geometric stiffness of spin and reaction, less W2 (theory 7.1 and 7.6)."""
        body = Body(self.folder / "body.flex.h5")
        return frequencies(body.spinning(self.rate * self.axis, stiffened=stiffened), body.modal_mass)

    def compliance(self, body):
        """Deflection of the tip along the rotor axis under a unit force there, on the spinning blade: by simulate, from static equilibrium."""
        deflections = []
        for force in (0.0, 1.0):
            vector = ", ".join(f"{value:.15g}" for value in force * self.axis)
            axis = ", ".join(f"{value:.15g}" for value in self.axis)
            scene = f"""[run]
duration = 1e-9
outputs = 1
[initial]
deformation = "static"
[carried]
interface = "root"
[carried.spin]
axis = [{axis}]
through = [0, 0, 0]
rate = {self.rate:.15g}
[[load]]
interface = "tip"
force = [{vector}]
axes = "model"
[[watch]]
interface = "tip"
"""
            (self.folder / "scene.toml").write_text(scene)
            told = run(self.flexbody, "simulate", body, "--scene", "scene.toml", "-o", "run.h5", cwd=self.folder)
            assert "FB547" not in told and ("FB542" in told) == (body != "body.flex.h5"), told
            with h5py.File(self.folder / "run.h5") as file:
                deflections.append(file["points/interface tip/deflection"][0] @ self.axis)
        return deflections[1] - deflections[0]

    def compliance_of_calculix(self):
        """The same by CalculiX with large displacements."""
        deflections = []
        axis = ", ".join(f"{value:.15g}" for value in self.axis)
        distribution = self.part.at("tip")[:, :3] @ self.axis
        for force in (0.0, 1.0):
            load = "".join(f"{self.part.ids[row // 3]}, {row % 3 + 1}, {force * value:.13e}\n" for row, value in enumerate(distribution) if abs(value) > 1e-12)
            text = self.part.mesh() + f"*BOUNDARY\nROOT, 1, 3\n*STEP, NLGEOM\n*STATIC\n*DLOAD\nEALL, CENTRIF, {self.rate**2:.15g}, 0., 0., 0., {axis}\n"
            text += f"*CLOAD\n{load}*NODE PRINT, NSET=TIP\nU\n*END STEP\n"
            (self.folder / "pushed.inp").write_text(text)
            run(self.ccx, "-i", "pushed", cwd=self.folder)
            table = (self.folder / "pushed.dat").read_text().split("displacements")[-1].splitlines()[1:]
            moved = {int(words[0]): np.array([float(word) for word in words[1:4]]) for words in map(str.split, table) if len(words) == 4}
            mean = np.mean([moved[self.part.ids[node]] for node in self.part.ends["tip"]], axis=0)
            deflections.append(mean @ self.axis)
        return deflections[1] - deflections[0]


class Plate:
    """A free plate with a stress that its middle was welded with: frequencies by the steps of the page on preload, and of CalculiX with large displacements."""

    SIZE = (0.2, 0.15, 0.004)

    def __init__(self, flexbody, ccx, folder):
        self.flexbody, self.ccx, self.folder = flexbody, ccx, folder
        self.part = Part("C3D20", (6, 4, 1), lambda x, y, z: np.array([x, y, z - 0.5]) * self.SIZE)
        self.part.write(folder, "averaging")
        middle = [e for e, nodes in enumerate(self.part.elements, 1) if (abs(self.part.lattice[nodes].mean(axis=0)[:2] - 0.5) < (0.34, 0.26)).all()]
        self.stress = "*INITIAL CONDITIONS, TYPE=STRESS\n" + "".join(f"{e}, {point}, 60e6, 60e6, 0., 0., 0., 0.\n" for e in middle for point in range(1, 28))
        a, b, c = (self.part.ids[np.argmin(((self.part.points - np.multiply(at, self.SIZE)) ** 2).sum(axis=1))] for at in ((0, 0, -0.5), (1, 0, -0.5), (0, 1, -0.5)))
        self.supports = f"*BOUNDARY\n{a}, 1, 3\n{b}, 2, 3\n{c}, 3, 3\n"

    def run(self, job, text):
        (self.folder / f"{job}.inp").write_text(self.part.mesh() + text)
        run(self.ccx, "-i", job, cwd=self.folder)

    def body(self):
        """Frequencies of the body whose stiffness has the stress in equilibrium, and of the body without."""
        self.run("equilibrium", f"{self.stress}{self.supports}*STEP\n*STATIC\n*EL PRINT, ELSET=EALL, GLOBAL=YES\nS\n*END STEP\n")
        printed = [line.split() for line in (self.folder / "equilibrium.dat").read_text().splitlines()]
        points = "".join(", ".join(words) + "\n" for words in printed if len(words) == 8 and words[0].isdigit())
        held = "*STEP\n*STATIC\n*BOUNDARY\nNALL, 1, 3\n*END STEP\n*STEP, PERTURBATION\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n4\n*BOUNDARY, OP=NEW\n*END STEP\n"
        self.run("preloaded", f"*INITIAL CONDITIONS, TYPE=STRESS\n{points}{held}")
        self.run("job", "*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n4\n*END STEP\n")
        found = []
        for job in ("preloaded", "job"):
            run(self.flexbody, "convert", f"{job}.inp", "--units", "m,kg,s", "--modes", MODES, "--lumped", "none", "-o", f"{job}.flex.h5", cwd=self.folder)
            with h5py.File(self.folder / f"{job}.flex.h5") as file:
                found.append(np.sqrt(file["modes/eigenvalue"][()]) / 2 / np.pi)
        return found

    def calculix(self):
        self.run("large", f"{self.stress}{self.supports}*STEP, NLGEOM\n*STATIC\n*END STEP\n*STEP, PERTURBATION\n*FREQUENCY\n{MODES + 6}\n*BOUNDARY, OP=NEW\n*END STEP\n")
        return printed_frequencies(self.folder / "large.dat")[6:]


def printed_frequencies(path):
    """Frequencies of the last table of CalculiX."""
    lines = path.read_text().split("E I G E N V A L U E   O U T P U T")[-1].splitlines()
    table = [line.split() for line in lines if len(line.split()) == 5 and line.split()[0].isdigit()]
    count = next((at for at, row in enumerate(table) if int(row[0]) != at + 1), len(table))
    return np.array([float(row[3]) for row in table[:count]])


def frequencies(stiffness, mass):
    values = la.eigh((stiffness + stiffness.T) / 2, (mass + mass.T) / 2, eigvals_only=True, subset_by_index=[0, MODES - 1])
    return np.sqrt(np.maximum(values, 0)) / (2 * np.pi)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--program", default=os.environ.get("FLEXBODY", ROOT / "target/release/flexbody"), type=Path)
    options.add_argument("--output", default=ROOT / "evidence/pages/geometric_stiffness.md", type=Path)
    chosen = options.parse_args()
    ccx = shutil.which(os.environ.get("CCX", "ccx")) or sys.exit("CalculiX (ccx) is not found: apt install calculix-ccx")
    version = subprocess.run([ccx, "-v"], capture_output=True, text=True).stdout.split()[-1]
    with tempfile.TemporaryDirectory() as folder:
        text = page(chosen.program.resolve(), ccx, Path(folder)).replace("{calculix}", version)
    chosen.output.write_text(text)


def page(flexbody, ccx, folder):
    out, reduced = HEAD, ""
    for kind, name, nodes, count, worst, beside, recipe, deck in rows_of_kinds(flexbody, ccx, folder):
        out += f"| {kind} | {name} | {nodes} | {count} | {worst:.1e} |\n"
        reduced += f"| {kind} | {name} | {beside:.1e} | {recipe:.1e} | {deck:.1e} |\n"
    out += DECK + reduced
    built = Blade(flexbody, ccx, folder / "blade")
    theirs, nodal = built.spinning(), built.all_nodes()
    body, without = built.body(), built.body(stiffened=False)
    moved = Blade(flexbody, ccx, folder / "moved", "mm", turned())
    assert abs(moved.body() / body - 1).max() < 1e-5, (moved.body(), body)
    out += f"""
## A blade under spin

A twisted and tapered blade of C3D20, {len(built.part.ids)} nodes, 0.3 m long on a hub of 0.2 m radius, held at its root, at {built.rate / 2 / np.pi:.1f} Hz, {SPIN_RATIO} of its first frequency at rest. CalculiX: `*STEP, NLGEOM` with `*DLOAD`, CENTRIF, then
`*STEP, PERTURBATION` with `*FREQUENCY`. All nodes: K, the geometric stiffness of the script for spin and reaction, less the softening of M, held at the root. Body: 24 modes of Craig-Bampton, with the frame on the root. Neither has gyroscopic terms.

| mode | at rest, Hz | CalculiX, Hz | body, Hz | body less CalculiX | body less all nodes | without geometric stiffness |
|---|---|---|---|---|---|---|
"""
    for mode in range(MODES):
        apart = [f"{100 * (value / theirs[mode] - 1):+.2f} %" for value in (body[mode], without[mode])]
        out += f"| {mode + 1} | {built.rest[mode]:.2f} | {theirs[mode]:.2f} | {body[mode]:.2f} | {apart[0]} | {body[mode] / nodal[mode] - 1:.1e} | {apart[1]} |\n"
    run(flexbody, "convert", "model.toml", "--basis", "craig-bampton", "--frame", "interface=root", "--modes", 24, "--lumped", "none", "-o", "soft.flex.h5", cwd=built.folder)
    stiff, soft, wanted = built.compliance("body.flex.h5"), built.compliance("soft.flex.h5"), built.compliance_of_calculix()
    out += f"""
Turned in space and in mm, tonne, s the body has the same frequencies within {abs(moved.body() / body - 1).max():.0e}.

Deflection of the tip along the rotor axis per force there, on the spinning blade, by `flexbody simulate` from static equilibrium: {100 * (stiff / wanted - 1):+.2f} % from CalculiX with large displacements, {100 * (soft / wanted - 1):+.1f} % without geometric
stiffness.

## A plate with preload

A free plate of C3D20, {1000 * Plate.SIZE[0]:.0f} x {1000 * Plate.SIZE[1]:.0f} x {1000 * Plate.SIZE[2]:.0f} mm, whose middle has an initial stress of 60 MPa along both sides, by the steps of [parts with a preload](../../docs/how_to/geometric_stiffness.md#parts-with-a-preload). CalculiX:
`*STEP, NLGEOM` with `*STATIC`, then `*STEP, PERTURBATION` with `*FREQUENCY`.

| mode | without preload, Hz | CalculiX, Hz | body, Hz | body less CalculiX |
|---|---|---|---|---|
"""
    plate = Plate(flexbody, ccx, folder / "plate")
    (loaded, plain), theirs = plate.body(), plate.calculix()
    for mode in range(MODES):
        out += f"| {mode + 1} | {plain[mode]:.2f} | {theirs[mode]:.2f} | {loaded[mode]:.2f} | {100 * (loaded[mode] / theirs[mode] - 1):+.3f} % |\n"
    return out + closed_forms(flexbody, ccx, folder)


def closed_forms(flexbody, ccx, folder):
    """Sections of parts with equations of their own."""
    size = lambda lengths: " x ".join(f"{1000 * length:g}" for length in lengths)
    out = BUCKLING.format(size=size(STRUT))
    for plane, name, body, beam, euler in struts(flexbody, ccx, folder / "strut"):
        out += f"| {name} | {plane} | {body:.1f} | {beam:.1f} | {body / beam - 1:+.1e} | {body / euler - 1:+.1e} |\n"
    out += ROTATING_BEAM.format(size=size(BEAM))
    for hub, rate, *found in rotating_beam(flexbody, ccx, folder / "beam"):
        pairs = [f"{body:.4f} | {body / beam - 1:+.1e}" for bodies, beams in (found[:2], found[2:]) for body, beam in zip(bodies, beams)]
        out += f"| {hub:g} | {rate:g} | {' | '.join(pairs)} |\n"
    out += ROTATING_DISC.format(size=size(DISC))
    for rate, diameters, body, plate, least in rotating_disc(flexbody, ccx, folder / "disc"):
        pairs = [f"{value:.2f} | {value / beside - 1:+.1e}" for value, beside in zip(body, plate)]
        out += f"| {rate:g} | {diameters} | {' | '.join(pairs)} | {least:.2f} |\n"
    return out


if __name__ == "__main__":
    main()
