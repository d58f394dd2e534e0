#!/usr/bin/env python3
"""Exports in GNU Octave: the two files for Simscape, and SID_FEM in FEMBeam's own reader and writer.

`simscape` and `fembeam` are called by suite.py. Octave: OCTAVE or the PATH (Debian: `apt-get install octave`). FEMBeam (GPL3, github.com/jgeisler0303/FEMBeam):
FEMBEAM=folder with read_sid.m. Octave evaluates what it loaded and writes it with `save -7`; scipy reads that. FEMBeam is written for MATLAB, which grows a
variable that is not there yet: for Octave a temporary copy of `read_sid` defines it first.
"""

import h5py
import numpy as np
import scipy.io

import common
from common import Row

# Texts are JSON lists in the HDF5 file and rows of characters in the MAT-file.
SIMSCAPE = """
a = load('{mat}'); b = load('{hdf}');
% The axes of an HDF5 array are in reverse order.
same = isequal(a.K, b.K') && isequal(a.M, b.M') && isequal(a.P0, b.P0') && isequal(a.axes, b.axes');
frames = jsondecode(b.frames); names = cellstr(a.frames);
same = same && isequal(frames(:), names(:)) && numel(names) == {count};
x = a.P0; n = rows(x); R = zeros(columns(a.K), 6);
for i = 1:n
  R(6*i-5:6*i, :) = [eye(3), [0 x(i,3) -x(i,2); -x(i,3) 0 x(i,1); x(i,2) -x(i,1) 0]; zeros(3), eye(3)];
end
inertia = R' * a.M * R; lowest = sort(real(eig(a.K, a.M)));
save('-7', '{out}', 'same', 'inertia', 'lowest');
"""

FEMBEAM = """
addpath('{fembeam}'); addpath('{own}');
s = read_sid('{sid}');
mass = s.refmod.mass; md = s.md.M0; I0 = s.I.M0; I1 = s.I.M1; Cr1 = s.Cr.M1; Me = s.Me.M0; Ke = s.Ke.M0; Ge = s.Ge.M0; Oe1 = s.Oe.M1;
save('-7', '{out}', 'mass', 'md', 'I0', 'I1', 'Cr1', 'Me', 'Ke', 'Ge', 'Oe1');
write_sid(s, '{again}');
"""


OPENED = "fid= fopen(fn, 'r');"
DEFINED = "sid= struct('comment', {{}}, 'frame', struct('node', {}, 'rframe', {}, 'origin', {}, 'Phi', {}, 'Psi', {}, 'AP', {}));"


def octave(folder, text):
    program = common.program("octave-cli", "OCTAVE", "Debian: apt-get install octave")
    script, out = folder / "script.m", folder / "out.mat"
    script.write_text(text.replace("{out}", str(out)))
    common.run(program, "--norc", "--quiet", script)
    return scipy.io.loadmat(out, squeeze_me=False)


def version():
    program = common.program("octave-cli", "OCTAVE", "Debian: apt-get install octave")
    return "Octave " + common.run(program, "--version").split()[3]


def scaled(found, own):
    own = np.asarray(own)
    assert found.shape == own.shape, (found.shape, own.shape)
    return float(np.abs(found - own).max() / np.abs(own).max())


def simscape(flexbody, folder):
    """Both dialects, loaded by Octave, are the same; rigid motion has the mass and inertia of the body, and no strain."""
    program = version()
    path = common.body(flexbody, "bracket_hex20", folder / "cb.flex.h5", "--basis", "craig-bampton", "--modes", 6)
    mat = common.export(flexbody, path, "simscape", folder / "cb.mat")
    hdf = common.export(flexbody, path, "simscape", folder / "cb.h5", "--dialect", "hdf5")
    with h5py.File(path) as f:
        mass, inertia, lam = f["invariants/mass"][0], f["invariants/I0"][()], f["modes/eigenvalue"][()]
        count = len(f["interfaces"])
    told = octave(folder, SIMSCAPE.replace("{mat}", str(mat)).replace("{hdf}", str(hdf)).replace("{count}", str(count)))
    rigid = np.zeros((6, 6))
    rigid[:3, :3], rigid[3:, 3:] = mass * np.eye(3), inertia
    sizes = np.sqrt(np.outer(np.diag(rigid), np.diag(rigid)))
    row = lambda what, found, limit: Row(program, "simscape", f"bracket_hex20: {what}", float(found), limit)
    return [
        row("`mat5` and `hdf5` hold the same (1: no)", not told["same"].item(), 0.0),
        row("mass and inertia of rigid motion", np.abs((told["inertia"] - rigid) / sizes).max(), 1e-9),
        row("eigenvalues of K, M: the modes of the body", np.abs(told["lowest"][6:6 + len(lam), 0] / lam - 1).max(), 1e-6),
    ]


def fembeam(flexbody, folder):
    """`read_sid` gives the numbers of the body; what `write_sid` makes of them is recognised, and lacks digits only."""
    program = version()
    sources = common.folder("FEMBEAM", "read_sid.m", "FEMBeam, github.com/jgeisler0303/FEMBeam, GPL3")
    # write_sid prints `%f`: numbers of a body in metres would have no digits left.
    path = common.body(flexbody, "bracket_hex20", folder / "b.flex.h5", "--modes", 4)
    sid = common.export(flexbody, path, "sid", folder / "b.SID_FEM", "--dialect", "fembeam")
    again = folder / "again.SID_FEM"
    own = folder / "own"
    own.mkdir()
    source = (sources / "read_sid.m").read_text(errors="replace")
    assert OPENED in source, "read_sid.m is another one"
    (own / "read_sid.m").write_text(source.replace(OPENED, OPENED + " " + DEFINED, 1))
    text = FEMBEAM.replace("{own}", str(own)).replace("{fembeam}", str(sources)).replace("{sid}", str(sid)).replace("{again}", str(again))
    told = octave(folder, text)
    with h5py.File(path) as f:
        get = lambda name: f["invariants/" + name][()]
        mass, inertia, w1, w2, w3, stiffness = get("mass")[0], get("I0"), get("W1"), get("W2"), get("W3"), get("modal_stiffness")
        modal_mass = get("modal_mass")
    nf = len(stiffness)
    i5 = w3.reshape(3, nf, nf)  # axis, l, k
    # Derivatives by q_l stand last: J1_l = W1_l, Cr1(k, a) = I5_l(a, k), Ge mode-blocked 2 I5.
    own = {
        "mass": np.array([[mass]]), "I0": inertia, "Me": modal_mass, "Ke": stiffness,
        "I1": w1.reshape(3, 3, nf), "Cr1": i5.transpose(2, 0, 1),
        "Ge": 2 * i5.transpose(2, 1, 0).reshape(nf, 3 * nf),
        "Oe1": np.stack([-w2.reshape(3, nf, 3, nf)[a, :, a, :] for a in range(3)], axis=1),
    }
    told["Oe1"] = told["Oe1"][:, :3, :]
    worst = {name: scaled(told[name], value) for name, value in own.items()}
    name = max(worst, key=worst.get)
    heard = common.audit(flexbody, again)
    other = [name for name in common.failed(heard) if name != "digits"]
    program += " with FEMBeam"
    return [
        Row(program, "sid", f"bracket_hex20: every array of `read_sid` (worst: `{name}`)", worst[name], 1e-14),
        Row(program, "sid", "what `write_sid` prints of them is a file of dialect fembeam (1: no)", float(heard["dialect"] != "fembeam"), 0.0),
        Row(program, "sid", f"findings of its audit besides lost digits{': ' + ', '.join(other) if other else ''}", float(len(other)), 0.0),
    ]
