#!/usr/bin/env python3
"""Craig-Bampton bases of flexbody beside Exudyn's, and pyYeti's checks of the reduced matrices; writes evidence/pages/craig_bampton.md.

Optional, some seconds: needs Python with exudyn, pyyeti, h5py, numpy and scipy; not part of `cargo test`.

    python3 -m venv target/peers && target/peers/bin/pip install exudyn==1.13.6 pyyeti==1.4.7 h5py numpy scipy
    cargo build --release
    target/peers/bin/python tests/peers/craig_bampton.py

Exits with 1 when a number is worse than its limit; the page is written only when none is.
"""

import argparse
import csv
import io
import json
import subprocess
import sys
import tempfile
import tomllib
from importlib.metadata import version
from pathlib import Path

import h5py
import numpy as np
import scipy.io
import scipy.linalg as la
import scipy.sparse as sp
from exudyn.FEM import FEMinterface, HCBstaticModeSelection
from pyyeti import cb
from pyyeti.nastran import n2p

ROOT = Path(__file__).resolve().parents[2]
BODIES = ["bracket_hex20", "connecting_rod"]
MODES = 12
# Name, largest allowed.
LIMITS = {
    "angle": 1e-6,
    "eigenvalues": 1e-8,
    "grounding": 1e-12,
    "geometry": 1e-8,
    "mass": 1e-12,
    "fixed": 1e-8,
}


class Model:
    """K and M in node-major order, nodes and interfaces of a folder of fixtures/models."""

    def __init__(self, folder):
        self.folder = folder
        self.manifest = tomllib.loads((folder / "model.toml").read_text())
        files = self.manifest["files"]
        with open(folder / files["nodes"]) as f:
            nodes = [(int(row["node"]), [float(row[c]) for c in "xyz"]) for row in csv.DictReader(f)]
        self.place = {node: i for i, (node, _) in enumerate(nodes)}
        self.positions = np.array([x for _, x in nodes])
        with open(folder / files["dofs"]) as f:
            rows = [3 * self.place[int(r["node"])] + int(r["dir"]) - 1 for r in csv.DictReader(f)]
        order = np.argsort(rows)
        assert sorted(rows) == list(range(3 * len(nodes))), "every node has three displacements"
        read = lambda name: sp.csr_matrix(scipy.io.mmread(folder / files[name]))[order][:, order]
        self.stiffness, self.mass = read("stiffness"), read("mass")

    def write(self, target, coupling):
        """A manifest with the coupling for every interface."""
        m = self.manifest
        lines = ["[model]", f'name = "{m["model"]["name"]}"', "[model.units]"]
        lines += [f'{k} = "{v}"' for k, v in m["model"]["units"].items()]
        lines += ["[files]"] + [f"{k} = {json.dumps(str(self.folder / v))}" for k, v in m["files"].items()]
        for interface in m["interface"]:
            lines += ["[[interface]]", f'name = "{interface["name"]}"', f'coupling = "{coupling}"']
            lines += [f'nodes = {interface["nodes"]}']
        target.write_text("\n".join(lines) + "\n")

    def rigid(self):
        x = self.positions - self.positions.mean(axis=0)
        fields = np.zeros((x.size, 6))
        for k in range(3):
            fields[k::3, k] = 1
            fields[:, 3 + k] = np.cross(np.eye(3)[k], x).ravel() / np.abs(x).max()
        return fields


def orthonormal(basis, mass):
    """An M-orthonormal basis of the same span."""
    for _ in range(3):
        basis = basis / np.sqrt(np.einsum("ij,ij->j", basis, mass @ basis))
        basis = la.solve_triangular(la.cholesky(basis.T @ (mass @ basis), lower=True), basis.T, lower=True).T
    return basis


def largest_angle(a, b, mass):
    """Between the spans of a and b, radians, in the inner product of M; through the sine, so that small ones keep their digits."""
    a, b = orthonormal(a, mass), orthonormal(b, mass)
    assert a.shape == b.shape, (a.shape, b.shape)
    left = b - a @ (a.T @ (mass @ b))
    return float(np.arcsin(min(1.0, np.sqrt(la.eigvalsh(left.T @ (mass @ left))[-1]))))


def exudyn_modes(model, coupling):
    fem = FEMinterface()
    fem.nodes = {"Position": model.positions}
    fem.stiffnessMatrix, fem.massMatrix = model.stiffness, model.mass
    mode = {"rigid": HCBstaticModeSelection.RBE2, "averaging": HCBstaticModeSelection.RBE3}[coupling]
    sets = [[model.place[node] for node in interface["nodes"]] for interface in model.manifest["interface"]]
    fem.ComputeHurtyCraigBamptonModes(boundaryNodesList=sets, nEigenModes=MODES, computationMode=mode)
    return fem.modeBasis["matrix"], np.sort(fem.eigenValues)


def compare(flexbody, name, coupling, scratch):
    model = Model(ROOT / "fixtures/models" / name)
    manifest, output = scratch / "model.toml", scratch / "body.flex.h5"
    model.write(manifest, coupling)
    command = [flexbody, "convert", manifest, "--basis", "craig-bampton", "--modes", str(MODES), "--lumped", "none"]
    subprocess.run([*command, "--quiet", "-o", output], check=True, stdout=subprocess.DEVNULL)
    with h5py.File(output) as f:
        shapes = f["modes/shape"][()] @ f["frame/axes"][()].T  # nf x n x 3, model axes
        assert [model.place[node] for node in f["nodes/id"][()]] == list(range(len(model.positions)))
        ours = shapes.reshape(len(shapes), -1).T
        group = f["interface_coordinates"]
        names, k, m = json.loads(group.attrs["names"]), group["stiffness"][()], group["mass"][()]
        points = np.array([interface["reference"][()] for interface in f["interfaces"].values()])
        total, inertia = f["invariants/mass"][0], f["invariants/I0"][()]
        first = f["invariants/first_moment"][()]
    theirs, eigenvalues = exudyn_modes(model, coupling)
    rigid = model.rigid()
    boundary = 6 * len(points)
    fixed = np.diag(k)[boundary:]
    found = {
        "angle": largest_angle(np.hstack([rigid, ours]), np.hstack([rigid, theirs]), model.mass),
        "eigenvalues": np.abs(fixed / eigenvalues - 1).max(),
    }
    # pyYeti: six coordinates for every interface, then the fixed-interface modes.
    assert names[boundary:] == [f"fixed-interface mode {j + 1}" for j in range(MODES)]
    grids = n2p.addgrid(None, list(range(1, len(points) + 1)), "b", 0, points, 0)
    text = io.StringIO()
    b = np.arange(boundary)
    checked = cb.cbcheck(text, m, k, b, b[:6], uset=grids, uref=(0, 0, 0), rb_norm=True, n_freefree_modes=MODES)
    rbg = np.zeros((len(m), 6))
    rbg[:boundary] = checked.rbg
    scale = np.sqrt(np.diag(k))
    forces = k @ rbg / (scale[:, None] * (scale[:, None] * np.abs(rbg)).sum(axis=0))
    lever = np.array([[0, -first[2], first[1]], [first[2], 0, -first[0]], [-first[1], first[0], 0]])
    expected = np.block([[total * np.eye(3), -lever], [lever, inertia]])
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    found["grounding"] = np.abs(forces).max()
    found["geometry"] = max(
        np.abs((checked.rbs[:boundary] - checked.rbg) / np.abs(checked.rbg).max(axis=0)).max(),
        np.abs((checked.rbe[:boundary] - checked.rbg) / np.abs(checked.rbg).max(axis=0)).max(),
    )
    found["mass"] = np.abs((rbg.T @ m @ rbg - expected) / size).max()
    found["fixed"] = np.abs((2 * np.pi * checked.cb_frq) ** 2 / fixed - 1).max()
    warnings = [line for line in text.getvalue().splitlines() if "warning" in line.lower()]
    assert not warnings, warnings
    return {key: float(value) for key, value in found.items()}, len(model.positions), boundary


PAGE = """\
<!-- Written by tests/peers/craig_bampton.py -->

# Craig-Bampton bases, compared with other programs

`tests/peers/craig_bampton.py` converts two bodies of `fixtures/models` with `--basis craig-bampton --modes {modes}`, once with rigid and once with
averaging interfaces, gives the same K, M and node sets to Exudyn, and the reduced matrices of the file (`/interface_coordinates`) to pyYeti.
Versions: exudyn {exudyn}, pyYeti {pyyeti}, scipy {scipy}, numpy {numpy}.

## The same space as Exudyn's `ComputeHurtyCraigBamptonModes`

Rigid motion is added to both bases: Exudyn leaves the static modes of the first interface out instead, flexbody the rigid motions. The angle is
the largest between the two spaces, in the inner product of M.

| body | nodes | coupling | Exudyn | largest angle (rad) | fixed-interface eigenvalues, relative |
|---|---|---|---|---|---|
{spans}

## pyYeti's `cb.cbcheck` on K and M in interface coordinates

Rigid-body motion from the geometry of the reference points (about the origin of the body frame), from the stiffness and from the
eigenvectors; forces that it causes, relative to sqrt(K_ii K_jj); the rigid-body mass from the reduced M against m and I0 of the file, relative to
the diagonal; the fixed-base eigenvalues. No warning of `cbcheck` in any case.

| body | coupling | K R | rigid-body modes, three ways | R' M R | fixed-base eigenvalues |
|---|---|---|---|---|---|
{checks}
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flexbody", type=Path, default=ROOT / "target/release/flexbody")
    args = parser.parse_args()
    spans, checks, poor = [], [], []
    with tempfile.TemporaryDirectory() as scratch:
        for name in BODIES:
            for coupling, theirs in [("rigid", "RBE2"), ("averaging", "RBE3")]:
                found, nodes, _ = compare(args.flexbody, name, coupling, Path(scratch))
                poor += [f"{name}, {coupling}: {k} {v:.1e}" for k, v in found.items() if not v <= LIMITS[k]]
                say = {k: f"{v:.1e}" for k, v in found.items()}
                print(name, coupling, say)
                spans.append([name, nodes, coupling, theirs, say["angle"], say["eigenvalues"]])
                checks.append([name, coupling, say["grounding"], say["geometry"], say["mass"], say["fixed"]])
    if poor:
        sys.exit("beyond the limits: " + "; ".join(poor))
    table = lambda rows: "\n".join("| " + " | ".join(map(str, row)) + " |" for row in rows)
    versions = {p: version(p) for p in ["exudyn", "pyyeti", "scipy", "numpy"]}
    page = PAGE.format(modes=MODES, spans=table(spans), checks=table(checks), **versions)
    (ROOT / "evidence/pages/craig_bampton.md").write_text(page)


if __name__ == "__main__":
    main()
