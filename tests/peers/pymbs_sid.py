#!/usr/bin/env python3
"""SID_FEM in the reader of pymbs (github.com/sevoigt/pymbs): the arrays that it reads are those of the body.

`rows` is called by suite.py. PYMBS=folder with pymbs/common/sidfilereader.py, which is loaded by itself.
"""

import importlib.util

import h5py
import numpy as np

import common
from common import Row

# Places of (11, 22, 33, 12, 13, 23) in J.
INERTIA = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]


def reader():
    sources = common.folder("PYMBS", "pymbs/common/sidfilereader.py", "pymbs, github.com/sevoigt/pymbs")
    spec = importlib.util.spec_from_file_location("sidfilereader", sources / "pymbs/common/sidfilereader.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def rows(flexbody, folder):
    sid = reader()
    path = common.body(flexbody, "bracket_hex20", folder / "b.flex.h5", "--modes", 4)
    with h5py.File(path) as f:
        get = lambda name: f["invariants/" + name][()]
        mass, inertia, w1, w3, stiffness = get("mass")[0], get("I0"), get("W1"), get("W3"), get("modal_stiffness")
        modal_mass, shapes = get("modal_mass"), f["modes/shape"][()]
    nf = len(stiffness)
    i5, w1 = w3.reshape(3, nf, nf), w1.reshape(3, 3, nf)
    found = []
    for dialect in ["fembs", "py-sid"]:
        out = common.export(flexbody, path, "sid", folder / f"{dialect}.SID_FEM", "--dialect", dialect, "--points", "nodes")
        with open(out) as f:
            modal = sid.SID(f).modal
        taylor = lambda one: one if hasattr(one, "M0") else next(v for v in vars(one).values() if hasattr(v, "M0"))
        m0 = lambda one: np.asarray(taylor(one).M0)
        m1 = lambda one: np.stack([np.asarray(m) for m in taylor(one).M1])
        column = (lambda a, k: a * nf + k) if dialect == "fembs" else (lambda a, k: 3 * k + a)
        gr = m0(modal.gr)
        told = {
            "Me": (m0(modal.me), modal_mass),
            "Ke": (m0(modal.ke), stiffness),
            "J": (m0(modal.j)[:, 0], np.array([inertia[at] for at in INERTIA])),
            "J1": (m1(modal.j)[:, :, 0], np.array([[w1[at][k] for at in INERTIA] for k in range(nf)])),
            "Cr1": (m1(modal.cr), i5.transpose(1, 2, 0)),
            "Ge": (m0(modal.ge), 2 * i5.transpose(2, 0, 1).reshape(nf, 3 * nf)),
            "sym Gr": (np.array([[[gr[r, column(a, k)] + gr[a, column(r, k)] for k in range(nf)] for a in range(3)] for r in range(3)]), 2 * w1),
            "phi": (m0(modal.frame.Knoten[0].phi), shapes[:, 0, :].T),
            "mass": (np.array([modal.refmod.mass]), np.array([mass])),
        }
        worst = {name: float(np.abs(a - b).max() / np.abs(b).max()) for name, (a, b) in told.items()}
        name = max(worst, key=worst.get)
        found.append(Row("pymbs", "sid", f"bracket_hex20, `{dialect}`: every array (worst: `{name}`)", worst[name], 1e-14))
    return found
