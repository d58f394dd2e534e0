"""SID_FEM: the equations of Wallrapp (Schwertassek, Wallrapp, *Dynamik flexibler Mehrkörpersysteme*), as Modelica's EMBSlib has them in Components.mo (`EMBS_Body`).

EMBSlib leaves out 2 w~ Ct' q' ("the derivation of the center of gravity is neglected"), which is zero for modes of the free body, and adds m w~ v although its acceleration is that of
the frame in space. The equations here have the first term and not the second. mdCM, J and the coupling Cr are of first order in q, and with them the equations.

The order of numbers in each dialect is that of docs/reference/formats/sid.md; that of `embs` is what the reader in C (`matrix3Index` of ReadSID_C.h: modes, rows, columns) and the
declaration `Real[nr, nq, nc]` of Modelica (by rows) make of m1(i, j, k).
"""

import re

import numpy as np

from .equations import Equations, Place, assemble
from .oracle import skew

INERTIA = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
# Columns of Gr and of Ge, and where the mode stands in m1: in the middle, last, or as EMBSlib takes it.
BY_AXES, BY_MODES = "axes", "modes"
MIDDLE, LAST, EMBSLIB = "middle", "last", "EMBSlib"
DIALECTS = {"fembs": (BY_AXES, BY_AXES, MIDDLE), "morembs": (BY_AXES, BY_AXES, MIDDLE), "py-sid": (BY_MODES, BY_AXES, MIDDLE), "fembeam": (BY_MODES, BY_MODES, LAST),
            "embs": (BY_MODES, BY_MODES, EMBSLIB)}
ENTRY = re.compile(r"(m[01])\s*\(\s*(\d+)\s*,\s*(\d+)\s*(?:,\s*(\d+)\s*)?\)\s*=\s*(\S+)")


class Taylor:
    """An object of the file with its arrays `m0` (rows x columns) and `m1` (rows x columns x modes)."""

    def __init__(self, header, entries, modes, third):
        rows, columns = header["nrow"], header["ncol"]
        self.m0, self.m1 = np.zeros((rows, columns)), np.zeros((rows, columns, modes))
        stored = np.zeros(rows * columns * modes)
        for kind, i, j, k, value in entries:
            if kind == "m0":
                self.m0[i - 1, j - 1] = value
            elif third == MIDDLE:
                self.m1[i - 1, k - 1, j - 1] = value
            elif third == LAST:
                self.m1[i - 1, j - 1, k - 1] = value
            else:
                stored[(j - 1) * columns * rows + (i - 1) * columns + k - 1] = value
        if third == EMBSLIB:
            self.m1 = stored.reshape(rows, modes, columns).transpose(0, 2, 1)
        if header["structure"] == 2:
            # One triangle or both.
            for part in [self.m0, *np.moveaxis(self.m1, 2, 0)]:
                lower, upper = np.tril(part, -1), np.triu(part, 1)
                part += np.where(upper == 0, lower.T, 0) + np.where(lower == 0, upper.T, 0)
        if header["structure"] == 4:
            self.m0 = np.eye(rows)

    def at(self, q):
        return self.m0 + self.m1 @ q


def objects(text, third):
    """Returns mass, number of modes, the objects of the body by name, and those of each frame by its number."""
    mass = modes = None
    body, frames, current, header, entries, target = {}, {}, None, {}, [], None
    for line in text.splitlines():
        word = line.split("=")[0].strip()
        value = line.split("=", 1)[1].strip() if "=" in line else ""
        entry = ENTRY.search(line)
        if entry and current:
            kind, *indices, number = entry.groups()
            i, j, k = (int(index) if index else 0 for index in indices)
            entries.append((kind, i, j, k, float(re.sub("[dD]", "e", number))))
        elif word == "mass":
            mass = float(re.sub("[dD]", "e", value))
        elif word == "nelastq":
            modes = int(value)
        elif word in ("new node", "new frame"):
            target = frames.setdefault(int(value), {})
        elif line.strip() in ("end node", "end frame"):
            target = None
        elif word in ("order", "nrow", "ncol", "nq", "nqn", "structure"):
            header[word] = int(value)
        elif line.strip().startswith("end ") and current and line.strip()[4:].strip().lower() == current.lower():
            (body if target is None else target)[current] = Taylor(header, entries, modes, third)
            current, header, entries = None, {}, []
        elif re.fullmatch(r"\s*(origin|phi|psi|AP|sigma|mdCM|mCM|J|mmi|Ct|Cr|Me|Gr|Ge|Oe|ksigma|Ke|De)\s*", line):
            current, header, entries = line.strip(), {}, []
    return mass, modes, body, frames


class Sid(Equations):
    order = "first"
    exact_modal_forces = True
    ARRAYS = {"m": "m", "md.m0": "mL", "md.m1": "s", "j.m0": "mL2", "j.m1": "sL", "ct.m0": "s", "cr.m0": "sL", "cr.m1": "1", "me": "1", "gr": "sL", "ge": "1", "oe.m0": "sL", "oe.m1": "1",
              "ke": "own", "de": "own"}

    def __init__(self, path, dialect):
        gr_by, ge_by, third = DIALECTS[dialect]
        self.m, nf, body, frames = objects(path.read_text(), third)
        # Frames have numbers of their own, in the order of the places.
        self.counted = dialect == "embs"
        self.modes = nf
        get = lambda *names: next(body[name] for name in names if name in body)
        self.md, self.j, self.ct, self.cr, self.oe = get("mdCM", "mCM"), get("J", "mmi"), get("Ct"), get("Cr"), get("Oe")
        self.me, self.ke, self.de = get("Me").m0, get("Ke").m0, get("De").m0
        by = lambda array, columns: array.reshape(len(array), nf, 3).transpose(0, 2, 1) if columns == BY_MODES else array.reshape(len(array), 3, nf)
        # Row, axis, mode.
        self.gr, self.ge = by(get("Gr").m0, gr_by), by(get("Ge").m0, ge_by)
        self.places = {}
        for number, one in frames.items():
            psi = one.get("psi")
            turned = psi is not None and np.abs(psi.m0).max() > 0
            self.places[number] = Place(one["origin"].m0[:, 0], one["phi"].m0, psi.m0 if turned else None)
            self.places[number].bent = one["phi"].m1, psi.m1 if turned else None
        self.ids = np.array(list(self.places))
        self.positions = np.array([place.position for place in self.places.values()])
        self.shape = np.array([place.translation for place in self.places.values()])
        self.rotation = np.array([np.zeros((3, nf)) if place.rotation is None else place.rotation for place in self.places.values()])

    def inertia(self, q):
        if self.j.m0.shape == (3, 3):
            return self.j.at(q)
        out, now = np.zeros((3, 3)), self.j.at(q)[:, 0]
        for (a, b), value in zip(INERTIA, now):
            out[a, b] = out[b, a] = value
        return out

    def mass(self, q):
        return assemble(self.m, self.md.at(q)[:, 0], self.ct.at(q).T, self.inertia(q), self.cr.at(q).T, self.me)

    def velocity_forces(self, q, w, qd):
        squares = np.array([w[0] ** 2, w[1] ** 2, w[2] ** 2, w[0] * w[1], w[1] * w[2], w[0] * w[2]])
        force = np.cross(w, np.cross(w, self.md.at(q)[:, 0])) + 2 * np.cross(w, self.ct.at(q).T @ qd)
        moment = np.einsum("raj,j,a->r", self.gr, qd, w) + np.cross(w, self.inertia(q) @ w)
        modal = np.einsum("raj,j,a->r", self.ge, qd, w) + self.oe.at(q) @ squares
        return np.concatenate([force, moment, modal])

    def elastic(self, q, qd):
        return self.ke @ q + self.de @ qd

    def gravity(self, q, g):
        return np.concatenate([self.m * g, skew(self.md.at(q)[:, 0]) @ g, self.ct.at(q) @ g])
