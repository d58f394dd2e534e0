"""A free flexible body that tumbles, for make_stability.py."""

import numpy as np

TURNS = 5
STEPS = 500
RATE = 0.05  # of the first frequency


def tumbled(data, values, units, dimension):
    """Attitude, rates and deformation after so many periods of the first mode, without units, by the same fixed Runge-Kutta steps for any
    data: what differs between two results comes from the data. Momentum form (6.3) about the centre of mass. `units`: size and first
    eigenvalue that all data are divided by, and the number of modes."""
    size, first, nf = units
    values, all_modes = np.array(values / first, dtype=float), len(values)
    inertia = np.array(data["I0"] / size**2, dtype=float)
    w1 = np.array(data["W1"] / size, dtype=float).reshape(3, 3, all_modes)[:, :, :nf]
    w2 = np.array(data["W2"], dtype=float).reshape(3, all_modes, 3, all_modes)[:, :nf, :, :nf]
    w3 = np.array(data["W3"], dtype=float).reshape(3, all_modes, all_modes)[:, :nf, :nf]
    rate = RATE * np.array([0.3, 0.9, 0.3162])
    if dimension == 2:  # about z alone
        z = np.array([0, 0, 1.0])
        inertia = np.diag([1, 1, inertia[2, 2]])
        keep = np.multiply.outer(z, z)
        w1, w2, w3, rate = w1 * keep[:, :, None], w2 * keep[:, None, :, None], w3 * z[:, None, None], RATE * z
    w2 = (w2 + w2.transpose(2, 3, 0, 1)) / 2
    values = values[:nf]

    def velocities(q, h, p):
        turned = np.einsum("aibj,j->aib", w2, q)
        coupling = np.einsum("aij,i->aj", w3, q)
        now = inertia + w1.dot(q) + np.einsum("aib,i->ab", turned, q)
        w = np.linalg.solve(now - coupling.dot(coupling.T), h - coupling.dot(p))
        return w, p - coupling.T.dot(w), turned

    def change(y):
        e, q, h, p = y[:4], y[4:4 + nf], y[4 + nf:7 + nf], y[7 + nf:]
        w, qd, turned = velocities(q, h, p)
        pull = 0.5 * np.einsum("abj,a,b->j", w1, w, w) + np.einsum("aib,a,b->i", turned, w, w) + np.einsum("ajk,a,k->j", w3, w, qd)
        spin = 0.5 * np.array([-e[1:].dot(w), *(e[0] * w + np.cross(e[1:], w))])
        return np.concatenate([spin, qd, np.cross(h, w), pull - values * q])

    # Nothing deforms yet, so that nothing couples: the momenta of the modes are zero.
    y = np.concatenate([[1, 0, 0, 0], np.zeros(nf), inertia.dot(rate), np.zeros(nf)])
    step = TURNS * 2 * np.pi / STEPS
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            for _ in range(STEPS):
                a = change(y)
                b = change(y + step / 2 * a)
                c = change(y + step / 2 * b)
                y = y + step / 6 * (a + 2 * b + 2 * c + change(y + step * c))
            w, _, _ = velocities(y[4:4 + nf], y[4 + nf:7 + nf], y[7 + nf:])
    except np.linalg.LinAlgError:  # a bent needle: its mass matrix is singular to double precision
        return np.full(7 + nf, np.nan)
    # Rates in units of the first, deformations of what the spin makes of them.
    return np.concatenate([y[:4], w / RATE, y[4:4 + nf] / RATE**2])
