#!/usr/bin/env python3
"""Stresses of bodies beside those of CalculiX for all nodes: writes evidence/pages/recovery.md.

    apt install calculix-ccx; pip install numpy scipy h5py
    cargo build --release --locked
    python3 evidence/programs/make_recovery.py
"""

import argparse
import csv
import gzip
import io
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np
import scipy.io

ROOT = Path(__file__).resolve().parents[2]
# Model, modes, digits of the answers.
MODELS = [("bracket_hex20", 10, 15), ("bracket_hex20", 10, 7), ("bracket_hex20", 10, 6), ("robot_link", 10, 15), ("connecting_rod", 10, 15)]
SPIN = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
# Model, modes of its body, and the scenes that are tried: with the frequency of the load and the rate of the spin over the first frequency.
SELECTED = [("bracket_hex20", 40), ("robot_link", 40)]
SCENES = [("load at 0.1 f1", 0.1, 0.0), ("load at 0.4 f1", 0.4, 0.0), ("load at 0.8 f1", 0.8, 0.0), ("load at 0.4 f1, spin at 0.002 f1", 0.4, 0.002)]
LIMITS = [
    ("elastic energy", "stress = 0.01"),
    ("stresses of modes and static columns", "recovery = { all = 0.01 }"),
    ("stresses of modes alone", "recovery = { all = { limit = 0.01, static_columns = false } }"),
]
HEAD = """<!-- Written by evidence/programs/make_recovery.py -->

# Stresses beside CalculiX

Stresses of bodies with 10 modes whose recovery was made by [one run of CalculiX {calculix}](../../docs/how_to/stresses_from_calculix.md), beside static runs of CalculiX with all nodes.
Written by `./scripts/make.sh pages recovery`. The error is the largest difference of a component at any node, relative to the largest component. Digits: those of the answers of CalculiX to the shapes.
Modes follow the load statically; the bodies spin about the principal axis of their largest moment of inertia.
"""
SELECTION = """
## Modes that 1 % takes

Modes that `select` keeps of bodies with {modes} modes, for an error of 1 % at any instant in the estimate by elastic energy or in the von Mises stress at any node ([limits of recoveries](../../docs/reference/recovery.md#limits-of-the-error)). A sine of
two periods of the first frequency f1 acts at one interface in all directions, from equilibrium; no variations. The reference is the body with all its modes and static columns; "more" than that: the modes alone do not reach 1 %.

"""
# The table between the marks is written by `cargo test --test study stresses_in_motion`.
MARKS = ("<!-- motion -->\n", "<!-- end of motion -->\n")
MOTION = """
## In motion

Bodies of bricks beside the equations of motion of all nodes, of which the modes are the lowest free ones (`crates/study/tests/study/stresses_in_motion.rs`). The error is the largest von Mises stress of the difference of two stresses, at any element and
instant, relative to the largest von Mises stress. f1 is the first frequency of the free body; the loads act at one interface; the bracket that tumbles is deflected by 1.6 % of its size. The last column has `deformed_inertia = true`
([forces of motion](../../docs/reference/recovery.md#forces-of-motion)).

"""
TAIL = """
## Limits of each figure

* In motion the dynamic response of the modes that were left out remains, which more modes reduce, and the inertia of the deformation by the static columns. Neither more modes nor shorter steps reduce the 1.5e-5 of the slender arm.
* With 15 digits the rounding of both programs remains, with 6 or 7 that of the answers.
* CENTRIF on elements C3D10 is not the load of their mass matrix: CalculiX integrates the two with different points. The forces then do not balance, and the supports of the static run carry the rest. The body has the load of M, which the next row compares.
* Stresses at a node are means over its elements, on both sides.
"""


def run(*words, cwd=None):
    done = subprocess.run([str(word) for word in words], cwd=cwd, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))} ended with {done.returncode}:\n{done.stderr}{done.stdout}")
    return done.stdout


def stresses(path):
    """Nodes, and stresses xx yy zz xy yz xz of the last step of a .frd with 64-bit numbers."""
    data = path.read_bytes()
    at = data.rindex(b" -4  STRESS")
    head = data.rindex(b"  100C", 0, at)
    count = int(data[head + 24 : head + 36])
    start = data.index(b"\n", data.index(b"SZX", at)) + 1
    records = [struct.unpack_from("<i6d", data, start + 52 * k) for k in range(count)]
    return [record[0] for record in records], np.array([record[1:] for record in records])


class Case:
    """A model with its deck, its body and the recovery of all nodes."""

    def __init__(self, program, ccx, name, modes, folder, digits=15):
        self.ccx, self.folder = ccx, folder
        shutil.copytree(ROOT / "fixtures/models" / name, folder, dirs_exist_ok=True)
        text = gzip.decompress((folder / "matrices.inp.gz").read_bytes()).decode()
        (folder / "part.inp").write_text(text)
        self.model = text[: text.index("*STEP")]
        options = ["--modes", modes, "--frame", "com", "--lumped", "none", "--quiet"]
        run(program, "convert", "model.toml", *options, "-o", "plain.flex.h5", cwd=folder)
        run(program, "shapes", "plain.flex.h5", "--model", "model.toml", "--deck", "part.inp", "--nodes", "all", "-o", "ask.inp", cwd=folder)
        ask = folder / "ask.inp"
        ask.write_text(with_digits(ask.read_text(), digits))
        run(ccx, "-i", "ask", cwd=folder)
        with (folder / "model.toml").open("a") as manifest:
            manifest.write('\n[[recovery]]\nname = "all"\nshapes = "ask.frd"\n')
        run(program, "convert", "model.toml", *options, "-o", "body.flex.h5", cwd=folder)
        with h5py.File(folder / "body.flex.h5") as body:
            self.ids = [int(node) for node in body["nodes/id"][()]]
            self.x = body["nodes/position"][()]
            self.shape = body["modes/shape"][()]
            self.stiffness = body["invariants/modal_stiffness"][()]
            self.w1 = body["invariants/W1"][()]
            self.inertia = body["invariants/I0"][()]
            self.origin = body["frame/origin"][()]
            recovery = body["recovery/all"]
            self.modes, self.spin = recovery["modes"][()], recovery["spin"][()]
            names = json.loads(recovery.attrs.get("loaded_interfaces", "[]"))
            self.loads = dict(zip(names, recovery["loads"][()])) if names else {}
            sets = {name: body["interfaces"][name] for name in names}
            self.sets = {name: (one["node_id"][()].tolist(), one["reference"][()]) for name, one in sets.items()}
            rows = [row["node"] for row in json.loads(recovery.attrs["rows"])]
            assert rows == [node for node in self.ids for _ in range(6)]

    def static(self, name, loads):
        """Stresses of CalculiX under balanced loads, with six supports that carry nothing."""
        supports = "".join(f"{node}, {k}, {k}\n" for node, k in self.supports())
        text = self.model + f"*BOUNDARY\n{supports}*STEP\n*STATIC, SOLVER=SPOOLES\n{loads}*NODE OUTPUT, DOUBLE\nU\n*ELEMENT OUTPUT, DOUBLE\nS\n*END STEP\n"
        (self.folder / f"{name}.inp").write_text(text)
        run(self.ccx, "-i", name, cwd=self.folder)
        nodes, found = stresses(self.folder / f"{name}.frd")
        place = {node: at for at, node in enumerate(nodes)}
        return found[[place[node] for node in self.ids]]

    def selected(self, program, swing, spin, tolerance):
        """Number of modes that `select` keeps; None if all of them are too few."""
        with h5py.File(self.folder / "body.flex.h5") as body:
            first = float(np.sqrt(body["modes/eigenvalue"][0]) / (2 * np.pi))
        point = list(self.sets)[-1]
        scene = f"""variation = []
[run]
duration = {2 / first!r}
[initial]
deformation = "static"
angular_velocity = [0, {2 * np.pi * spin * first!r}, {np.pi * spin * first!r}]
[[load]]
interface = "{point}"
force = [1.0, 2.0, 3.0]
history = {{ amplitude = 1e-3, frequency = {swing * first!r} }}
[tolerance]
attitude = 10.0
deflection = 10.0
least_deflection = 1e-12
{tolerance}
"""
        (self.folder / "scene.toml").write_text(scene)
        words = [program, "select", "body.flex.h5", "--scene", "scene.toml", "--json"]
        done = subprocess.run([str(word) for word in words], cwd=self.folder, capture_output=True, text=True)
        if done.returncode > 1:
            sys.exit(done.stdout + done.stderr)
        results = json.loads(done.stdout)["results"]
        return len(results["modes"]["kept"]) if results["chosen"]["passed"] else None

    def supports(self):
        """Node and direction of six supports that hold the body as far from each other as possible: the pivots of the rigid motions."""
        n = len(self.ids)
        size = np.abs(self.x).max()
        rigid = np.zeros((3 * n, 6))
        for k in range(3):
            rigid[k::3, k] = 1.0
            rigid[:, 3 + k] = np.cross(np.eye(3)[k], self.x / size).ravel()
        rows = []
        left = rigid.copy()
        for _ in range(6):
            row = int(np.argmax((left**2).sum(axis=1)))
            rows.append(row)
            pivot = left[row] / np.linalg.norm(left[row])
            left = left - np.outer(left @ pivot, pivot)
        return [(self.ids[row // 3], row % 3 + 1) for row in rows]

    def of_motion(self, q, w=(0, 0, 0), loads=(), columns=True):
        y = self.modes @ q
        if columns:
            y = y + self.spin @ np.array([w[k] * w[l] for k, l in SPIN])
            for name, load in loads:
                y = y + self.loads[name] @ load
        return y.reshape(-1, 6)

    def spinning(self):
        """A steady spin about the principal axis of the largest moment of inertia, as CENTRIF and as the nodal forces of M: for each the error of modes alone, and
        with columns; and the distance of the two loads."""
        axis = np.linalg.eigh(self.inertia)[1][:, -1]
        rate = 100.0
        w, nf = rate * axis, len(self.stiffness)
        load = np.zeros(nf)
        for k, l in SPIN:
            of_mode = self.w1[k, l * nf : (l + 1) * nf] * (0.5 if k == l else 1.0)
            load += of_mode * w[k] * w[l]
        q = np.linalg.solve(self.stiffness, load)
        point = ", ".join(f"{value:.15g}" for value in [*self.origin, *axis])
        nodal = self.times_mass(rate**2 * (self.x - np.outer(self.x @ axis, axis)))
        found = []
        for name, loads in (("centrif", f"*DLOAD\nEALL, CENTRIF, {rate**2:.15g}, {point}\n"), ("spin", self.forces(nodal))):
            theirs = self.static(name, loads)
            found.append([worst(self.of_motion(q, w, columns=c), theirs) for c in (False, True)])
        return found

    def times_mass(self, field):
        mass = scipy.io.mmread(io.BytesIO(gzip.decompress((self.folder / "M.mtx.gz").read_bytes()))).tocsr()
        with (self.folder / "dofs.csv").open() as table:
            dofs = [(self.ids.index(int(row["node"])), int(row["dir"]) - 1) for row in csv.DictReader(table)]
        product = mass @ np.array([field[dof] for dof in dofs])
        nodal = np.zeros_like(field)
        for dof, value in zip(dofs, product, strict=True):
            nodal[dof] = value
        return nodal

    def forces(self, nodal):
        lines = [f"{self.ids[n]}, {k + 1}, {nodal[n, k]:.13e}\n" for n in range(len(self.ids)) for k in range(3) if nodal[n, k]]
        return "*CLOAD\n" + "".join(lines)

    def loaded(self, first, second):
        """Opposite forces at two interfaces, with the couple that balances them."""
        force = np.array([1.0, -2.0, 3.0])
        a, b = self.sets[first][1], self.sets[second][1]
        at_a, at_b = np.concatenate([force, np.zeros(3)]), np.concatenate([-force, -np.cross(a - b, force)])
        nodal = np.zeros((len(self.ids), 3))
        for name, load, reference in ((first, at_a, a), (second, at_b, b)):
            members = [self.ids.index(node) for node in self.sets[name][0]]
            rigid = np.zeros((3 * len(members), 6))
            for at, node in enumerate(members):
                r = self.x[node] - reference
                rigid[3 * at : 3 * at + 3, :3] = np.eye(3)
                rigid[3 * at : 3 * at + 3, 3:] = -np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
            nodal[members] += (rigid @ np.linalg.solve(rigid.T @ rigid, load)).reshape(-1, 3)
        q = np.linalg.solve(self.stiffness, np.einsum("jnk,nk->j", self.shape, nodal))
        theirs = self.static("load", self.forces(nodal))
        return [worst(self.of_motion(q, loads=[(first, at_a), (second, at_b)], columns=c), theirs) for c in (False, True)]


def with_digits(deck, digits):
    """A deck with results as 64-bit numbers (15 digits), 32-bit numbers (7) or text (6)."""
    if digits == 6:
        deck = deck.replace("*NODE OUTPUT", "*NODE FILE").replace("*ELEMENT OUTPUT", "*EL FILE")
    return deck if digits == 15 else deck.replace(", DOUBLE", "")


def worst(ours, theirs):
    return float(np.abs(ours - theirs).max() / np.abs(theirs).max())


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--program", default=os.environ.get("FLEXBODY", ROOT / "target/release/flexbody"), type=Path)
    options.add_argument("--output", default=ROOT / "evidence/pages/recovery.md", type=Path)
    given = options.parse_args()
    ccx = shutil.which(os.environ.get("CCX", "ccx")) or sys.exit("CalculiX (ccx) is not found: apt install calculix-ccx")
    version = subprocess.run([ccx, "-v"], capture_output=True, text=True).stdout.split()[-1]
    rows = []
    for name, modes, digits in MODELS:
        with tempfile.TemporaryDirectory() as folder:
            case = Case(given.program.resolve(), ccx, name, modes, Path(folder), digits)
            name = f"{name} | {digits}"
            centrif, spin = case.spinning()
            rows.append((name, len(case.ids), "steady spin, `*DLOAD` with CENTRIF", *centrif))
            rows.append((name, len(case.ids), "steady spin, nodal forces of M", *spin))
            first, second = list(case.loads)[:2]
            rows.append((name, len(case.ids), f"balanced forces at {first} and {second}, `*STATIC`", *case.loaded(first, second)))
        print(*rows[-3:], sep="\n")
    table = "| model | digits | nodes | load | modes alone | with static columns |\n|---|---|---|---|---|---|\n"
    table += "".join(f"| {name} | {nodes} | {what} | {100 * alone:.2g} % | {both:.1e} |\n" for name, nodes, what, alone, both in rows)
    chosen = "| model | scene | " + " | ".join(name for name, _ in LIMITS) + " |\n|---|---|" + "---|" * len(LIMITS) + "\n"
    for name, modes in SELECTED:
        with tempfile.TemporaryDirectory() as folder:
            case = Case(given.program.resolve(), ccx, name, modes, Path(folder))
            for scene, swing, spin in SCENES:
                counts = [case.selected(given.program.resolve(), swing, spin, tolerance) for _, tolerance in LIMITS]
                words = " | ".join("more" if count is None else str(count) for count in counts)
                chosen += f"| {name} | {scene} | {words} |\n"
                print(name, scene, counts)
    counts = " and ".join(sorted({str(modes) for _, modes in SELECTED}))
    known = given.output.read_text() if given.output.exists() else "".join(MARKS)
    motion = MARKS[0] + known.split(MARKS[0])[1].split(MARKS[1])[0] + MARKS[1]
    given.output.write_text(HEAD.format(calculix=version) + "\n" + table + MOTION + motion + SELECTION.format(modes=counts) + chosen + TAIL)


if __name__ == "__main__":
    main()
