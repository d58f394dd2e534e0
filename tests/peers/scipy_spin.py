#!/usr/bin/env python3
"""A body in the archive `npz`, spun about an axis by equations of motion written out in numpy and integrated by scipy's DOP853:
damping, geometric stiffness for spin and a force in body axes, beside `flexbody simulate`.

`rows` is called by suite.py. Nothing of the equations is shared with flexbody: they are section 3 of [ZG21] for a frame whose centre of mass is
held, alpha and omega about z given,

    q'' + 2 zeta omega_j q' + K q = (W1_zz' / 2 + W2_zz q) w^2 - K_zz q w^2 - (C2_z + W3_z' q) alpha - 2 W3_z' q' w + Psi_i' f
"""

import h5py
import numpy as np
import scipy
from scipy.integrate import solve_ivp

import common
from common import Row

RATE, RISE, DURATION, ZETA = 300.0, 4e-3, 1e-2, 0.02
FORCE, TONE = np.array([3.0, -20.0, 8.0]), 700.0
SCENE = """
[run]
duration = {duration}
outputs = 100
tolerance = 1e-11
[damping]
ratio = {zeta}
[spin]
axis = [0, 0, 1]
rate = {{ from = 0, to = {rate}, start = 0, duration = {rise} }}
hold = true
[[load]]
node = {node}
force = {force}
axes = "model"
history = {{ amplitude = 1, frequency = {tone} }}
"""


def ramp(time):
    """The angular velocity and its rate."""
    x = np.clip(time / RISE, 0, 1)
    return RATE * (x - np.sin(2 * np.pi * x) / (2 * np.pi)), RATE * (1 - np.cos(2 * np.pi * x)) / RISE


def equations(body, row):
    """q'' of time, q and q'."""
    get = lambda name: body["invariants/" + name]
    stiffness, w1, w2, w3, c2 = (get(name) for name in ["modal_stiffness", "W1", "W2", "W3", "C2"])
    nf = len(stiffness)
    z = slice(2 * nf, 3 * nf)
    damping = 2 * ZETA * np.sqrt(np.diag(stiffness))
    geometric = body["geometric_stiffness/spin_zz/stiffness"]
    inertia = 0.5 * (w2[z, z] + w2[z, z].T)

    def accelerations(time, q, qd):
        w, alpha = ramp(time)
        force = row.T @ FORCE * np.sin(2 * np.pi * TONE * time)
        force += w * w * (0.5 * w1[2, z] + inertia @ q - geometric @ q)
        force -= alpha * (c2[2] + w3[z].T @ q) + 2 * w * (w3[z].T @ qd)
        return force - damping * qd - stiffness @ q

    return accelerations


def rows(flexbody, folder):
    path = common.body(flexbody, "turbine_blade", folder / "b.flex.h5", "--modes", 6)
    body = np.load(common.export(flexbody, path, "npz", folder / "b.npz"))
    node = 5
    place = body["modes/shape"][:, node, :].T
    scene = folder / "scene.toml"
    scene.write_text(SCENE.format(
        duration=DURATION, zeta=ZETA, rate=RATE, rise=RISE, node=body["nodes/id"][node], force=FORCE.tolist(), tone=TONE))
    motion = folder / "m.h5"
    common.run(flexbody, "simulate", path, "--scene", scene, "--quiet", "-o", motion)
    with h5py.File(motion) as f:
        time, q = f["time"][()], f["modes/q"][()]
    accelerations, nf = equations(body, place), q.shape[1]
    rates = lambda t, y: np.concatenate([y[nf:], accelerations(t, y[:nf], y[nf:])])
    start = np.zeros(2 * nf)
    found = solve_ivp(rates, (0, RISE), start, "DOP853", time[time <= RISE], rtol=1e-11, atol=1e-16)
    middle = solve_ivp(rates, (0, RISE), start, "DOP853", rtol=1e-11, atol=1e-16).y[:, -1]
    rest = solve_ivp(rates, (RISE, DURATION), middle, "DOP853", time[time > RISE], rtol=1e-11, atol=1e-16)
    own = np.concatenate([found.y[:nf], rest.y[:nf]], axis=1).T
    without = np.abs(body["geometric_stiffness/spin_zz/stiffness"]).max() * RATE**2
    assert without > 1e-3 * body["modes/eigenvalue"][0], "geometric stiffness must count"
    difference = np.abs(own - q).max() / np.abs(q).max()
    what = "blade spun up with geometric stiffness, damping and a force: q of an integration by scipy"
    return [Row(f"numpy, scipy {scipy.__version__}", "npz", what, float(difference), 1e-9)]
