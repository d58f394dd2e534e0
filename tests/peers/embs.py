#!/usr/bin/env python3
"""SID_FEM of dialect `embs` in the reader of EMBSlib (github.com/vwaurich/EMBS_ModelicaLib): its arrays are those of the body, and the equations of
its Modelica model with these arrays are those of the nodes of the model, to first order in the deformation.

`rows` is called by suite.py. EMBSLIB=folder with EMBSlib/Resources/Include/ReadSID_C.h, which is compiled with `cc` in a temporary folder, with the
checks of memory that the compiler has. `embs.c` calls it as EMBSlib/ExternalFunctions_C.mo does; arrays of Modelica lie row by row.
"""

import csv
import gzip
import re
import shutil
import subprocess

import h5py
import numpy as np
import scipy.io

import common
from common import ROOT, Row

PROGRAM = "EMBSlib"
HEADER = "EMBSlib/Resources/Include/ReadSID_C.h"
# Places of (11, 22, 33, 12, 13, 23), the order of J, and of (11, 22, 33, 12, 23, 13), that of Oe.
INERTIA = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
PAIRS = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)]
# Names of bodies with the keywords that the reader looks for, and what added to the numbers of the nodes.
BODIES = [("Crank", 4, 0), ("Gear", 5, 99000), ("Joint_A", 1, 0), ("frame Ct Me De", 12, 200000), ("", 3, 0), ("Pleuel größer 日本", 2, 123456789), ("Key Cr Ke", 101, 0)]
LINEAR = ["mdCM", "J", "Ct", "Cr", "Oe"]


def reader(folder):
    """The reader as a program."""
    sources = common.folder("EMBSLIB", HEADER, "EMBSlib, github.com/vwaurich/EMBS_ModelicaLib")
    compiler = common.program("cc", "CC", "Debian: apt-get install gcc")
    out = folder / "embs"
    # The header calls functions before it declares them and passes pointers of other types.
    command = [compiler, "-std=gnu99", "-w", "-g", "-I", (sources / HEADER).parent, ROOT / "tests/peers/embs.c", "-o", out, "-lm"]
    try:
        common.run(*command, "-fsanitize=address,undefined")
    except RuntimeError:
        common.run(*command)
    return out


def model(folder, name, shift):
    """bracket_hex20 under another name, with numbers of nodes that are larger by `shift`."""
    own = ROOT / "fixtures/models/bracket_hex20"
    shutil.copytree(own, folder)
    text = (own / "model.toml").read_text().replace('name = "bracket_hex20"', f'name = "{name}"', 1)
    number = lambda found: str(int(found[0]) + shift)
    text = re.sub(r"nodes = \[[^]]*\]", lambda found: re.sub(r"\d+", number, found[0]), text)
    (folder / "model.toml").write_text(text)
    for file in ["nodes.csv", "dofs.csv"]:
        (folder / file).write_text(re.sub(r"^\d+", number, (own / file).read_text(), flags=re.M))
    return folder / "model.toml"


def read(program, path, frames, nq):
    """What the reader hands to Modelica: mass, arrays with their M1 as [row, mode, column], frames."""
    done = subprocess.run([program, path, str(frames), str(nq)], capture_output=True, env={"ASAN_OPTIONS": "detect_leaks=0"})
    if done.returncode:
        raise RuntimeError(f"the reader of EMBSlib: {done.stderr.decode(errors='replace')[-2000:]}")
    flat, at = np.frombuffer(done.stdout), 0

    def take(*shape):
        nonlocal at
        at += (count := int(np.prod(shape)))
        return flat[at - count : at].reshape(shape)

    mass = take(1)[0]
    shapes = {"mdCM": (3, 1), "J": (6, 1), "Ct": (nq, 3), "Cr": (nq, 3), "Me": (nq, nq), "Gr": (3, 3 * nq), "Ge": (nq, 3 * nq), "Oe": (nq, 6), "ksigma": (nq, 1), "Ke": (nq, nq), "De": (nq, nq)}
    arrays = {}
    for name, (rows, columns) in shapes.items():
        arrays[name] = take(rows, columns)
        if name in LINEAR:
            arrays[name + "1"] = take(rows, nq, columns)
    places = []
    for _ in range(frames):
        places.append({})
        for name, columns in [("origin", 1), ("phi", nq), ("psi", nq), ("AP", 3)]:
            places[-1][name] = take(3, columns)
            places[-1][name + "1"] = take(3, nq, columns)
    assert at == len(flat)
    return mass, arrays, places


def expected(path):
    """The same arrays from the invariants of the body."""
    with h5py.File(path) as f:
        get = lambda name: f["invariants/" + name][()]
        mass, moment, c1, c2, inertia = get("mass")[0], get("first_moment"), get("C1"), get("C2"), get("I0")
        ibar, s, stiffness = get("Ibar"), get("S"), get("modal_stiffness")
        eigenvalue, ratio = f["modes/eigenvalue"][()], f["modes/damping_ratio"][()]
    nq = len(stiffness)
    one = np.eye(3)
    trace = np.einsum("aaj->j", ibar)
    i8 = np.einsum("ab,j->jab", one, trace) - ibar.transpose(2, 1, 0)
    w1 = i8 + i8.transpose(0, 2, 1)
    i5 = np.stack([s[1, 2] - s[2, 1], s[2, 0] - s[0, 2], s[0, 1] - s[1, 0]])  # [axis, l, k]
    oe1 = [s[a, a] - np.einsum("ccjk->jk", s) if a == b else s[b, a] + s[b, a].T for a, b in PAIRS]
    return mass, {
        "mdCM": moment[:, None],
        "mdCM1": c1[:, :, None],
        "J": np.array([[inertia[at]] for at in INERTIA]),
        "J1": np.stack([w1[:, a, b] for a, b in INERTIA])[:, :, None],
        "Ct": c1.T,
        "Ct1": np.zeros((nq, nq, 3)),
        "Cr": c2.T,
        "Cr1": i5.transpose(2, 1, 0),  # [k, l, a]
        "Me": np.einsum("aajk->jk", s),
        "Gr": 2 * i8.transpose(1, 0, 2).reshape(3, 3 * nq),
        "Ge": 2 * i5.transpose(2, 1, 0).reshape(nq, 3 * nq),
        "Oe": np.stack([-(0.5 if a == b else 1) * w1[:, a, b] for a, b in PAIRS], axis=1),
        "Oe1": np.stack(oe1, axis=2),
        "ksigma": np.zeros((nq, 1)),
        "Ke": stiffness,
        "De": np.diag(2 * ratio * np.sqrt(eigenvalue)),
    }


def apart(found, own):
    """Largest difference beside the largest number."""
    size = np.abs(own).max()
    return float(np.abs(found - own).max() / (size if size else 1))


def frames_apart(places, table, path):
    """The same of origin, phi and psi of nodes and reference points."""
    with h5py.File(path) as f:
        ids, x, shape = f["nodes/id"][()], f["nodes/position"][()], f["modes/shape"][()]
        points = {name: {at: one[at][()] for at in ["reference", "translation", "rotation"]} for name, one in f["interfaces"].items()}
    worst = 0.0
    for place, row in zip(places, table, strict=True):
        if row["interface"]:
            point = points[row["interface"]]
            origin, phi, psi = point["reference"], point["translation"], point["rotation"]
        else:
            node = list(ids).index(int(row["node"]))
            origin, phi, psi = x[node], shape[:, node].T, np.zeros((3, len(shape)))
        turned = np.zeros((3, len(shape), 3))
        for a, b, c, sign in [(0, 1, 2, -1), (1, 2, 0, -1), (2, 0, 1, -1), (1, 0, 2, 1), (2, 1, 0, 1), (0, 2, 1, 1)]:
            turned[a, :, b] = sign * psi[c]
        for name, own in [("origin", origin[:, None]), ("phi", phi), ("psi", psi), ("origin1", phi[:, :, None]), ("AP", np.eye(3)), ("AP1", turned)]:
            worst = max(worst, apart(place[name], own))
        assert np.allclose([float(row[axis]) for axis in "xyz"], origin, rtol=1e-15)
    return worst


def tilde(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def modelica(mass, arrays, state):
    """Left sides of the equations of EMBS_Body (Components.mo) without elastic forces, for an origin at rest."""
    q, qd, qdd, a, alpha, omega = state
    taylor = lambda name: arrays[name] + np.einsum("ikj,k->ij", arrays[name + "1"], q)
    by_modes = lambda name: sum(arrays[name][:, 3 * k : 3 * k + 3] * rate for k, rate in enumerate(qd))
    moment, j, ct, cr, oe = (taylor(name) for name in LINEAR)
    moment, j = moment[:, 0], j[:, 0]
    inertia = np.array([[j[0], j[3], j[4]], [j[3], j[1], j[5]], [j[4], j[5], j[2]]])
    spin = tilde(omega)
    products = [omega[a] * omega[b] for a, b in PAIRS]
    return [
        mass * a + tilde(moment).T @ alpha + ct.T @ qdd + spin @ spin @ moment,
        tilde(moment) @ a + inertia @ alpha + cr.T @ qdd + by_modes("Gr") @ omega + spin @ inertia @ omega,
        ct @ a + cr @ alpha + arrays["Me"] @ qdd + by_modes("Ge") @ omega + oe @ products,
    ]


def nodal(x, shape, weight, state):
    """The same forces from the accelerations of all nodes."""
    q, qd, qdd, a, alpha, omega = state
    r, u, v = (base + np.einsum("kia,k->ia", shape, rate) for base, rate in [(x, q), (0 * x, qd), (0 * x, qdd)])
    acceleration = a + np.cross(alpha, r) + np.cross(omega, np.cross(omega, r)) + 2 * np.cross(omega, u) + v
    force = weight @ acceleration
    return [force.sum(0), np.cross(r, force).sum(0), np.einsum("kia,ia->k", shape, force)]


def equations(path, mass, arrays):
    """Largest differences of both in random states: undeformed, and of what is of first order in the deformation."""
    with h5py.File(path) as f:
        ids, x, shape = f["nodes/id"][()], f["nodes/position"][()], f["modes/shape"][()]
        rate = np.sqrt(f["modes/eigenvalue"][0])
        inertia = np.sqrt(np.trace(f["invariants/I0"][()]))
    fixture = ROOT / "fixtures/models/bracket_hex20"
    with gzip.open(fixture / "M.mtx.gz") as file:
        matrix = scipy.io.mmread(file).tocsr()
    labels = list(csv.reader((fixture / "dofs.csv").open()))[1:]
    # The rows of direction 1, in the order of the body: M is the same along all axes.
    row = {int(node): i for i, (node, direction) in enumerate(labels) if direction == "1"}
    order = [row[int(node)] for node in ids]
    weight = matrix[order][:, order]
    random = np.random.default_rng(7)
    nf, still, bent = len(shape), 0.0, 0.0
    for _ in range(8):
        modal = [random.uniform(-1, 1, nf) * scale * inertia for scale in (1, rate, rate**2)]
        rigid = [random.uniform(-1, 1, 3) * scale for scale in (rate**2 * np.abs(x).max(), rate**2, rate)]
        at = lambda size: [size * one for one in modal] + rigid
        size = 1e-5
        both = lambda size: (modelica(mass, arrays, at(size)), nodal(x, shape, weight, at(size)))
        still = max(still, *(apart(m, n) for m, n in zip(*both(0))))
        (up, own_up), (down, own_down) = both(size), both(-size)
        for a, b, c, d in zip(up, down, own_up, own_down):
            # Modes of a free body do not move the centre of mass: their force is rounding of the one that it has at rest.
            scale = max(np.abs(c - d).max(), size * np.abs(c + d).max())
            bent = max(bent, float(np.abs((a - b) - (c - d)).max() / scale))
    return still, bent


def rows(flexbody, folder):
    program = reader(folder)
    found, worst, frames_worst = [], {}, 0.0
    for number, (name, modes, shift) in enumerate(BODIES):
        path, out = folder / f"{number}.flex.h5", folder / f"{number}.SID_FEM"
        manifest = model(folder / f"model{number}", name or "none", shift)
        if not name:
            manifest.write_text(manifest.read_text().replace('name = "none"\n', "", 1))
        # The frame of the model: the centre of mass has a place.
        common.run(flexbody, "convert", manifest, "--frame", "model", "--lumped", "none", "--quiet", "-o", path, "--modes", modes)
        points = f"interfaces,{1001 + shift},{20000 + shift}"
        common.export(flexbody, path, "sid", out, "--dialect", "embs", "--points", points)
        table = list(csv.DictReader((folder / f"{number}.frames.csv").open(encoding="utf-8")))
        mass, arrays, places = read(program, out, len(table), modes)
        own_mass, own = expected(path)
        differences = {key: apart(arrays[key], value) for key, value in own.items()} | {"mass": abs(mass / own_mass - 1)}
        frames_worst = max(frames_worst, frames_apart(places, table, path))
        worst = {key: max(worst.get(key, 0.0), value) for key, value in differences.items()}
        assert common.audit(flexbody, out)["dialect"] == "embs" and not common.failed(common.audit(flexbody, out))
        if not shift and modes == 4:
            still, bent = equations(path, mass, arrays)
    key = max(worst, key=worst.get)
    names = f"{len(BODIES)} names, 1 to {max(modes for _, modes, _ in BODIES)} modes, nodes to {max(shift for *_, shift in BODIES) + 20903}"
    return [
        Row(PROGRAM, "sid", f"bracket_hex20, {names}: every array that its reader gives to Modelica (worst: `{key}`)", worst[key], 1e-14),
        Row(PROGRAM, "sid", "bracket_hex20: places and shapes of all frames", frames_worst, 1e-14),
        Row(PROGRAM, "sid", "bracket_hex20: equations of `EMBS_Body`, undeformed, beside those of the nodes", still, 1e-11),
        Row(PROGRAM, "sid", "bracket_hex20: what they have of first order in q, its rate and acceleration", bent, 1e-6),
    ]
