"""Buckling of struts, rotating beams and rotating discs from the geometric stiffness that flexbody computes from elements, beside beam and plate equations solved by Rayleigh and Ritz."""

import h5py
import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.polynomial import legendre

from geometric_elements import SPIN, Part, full, run

# Degrees of the polynomials of beams and discs.
DEGREE = 14
# Strut and rotating beam: length, width, thickness in m.
STRUT, BEAM = (1.0, 0.03, 0.02), (1.0, 0.03, 0.02)
# Disc: inner and outer radius, thickness in m.
DISC = (0.05, 0.25, 0.0025)


class Body:
    """A flex-body file with geometric stiffness."""

    def __init__(self, path):
        with h5py.File(path) as file:
            names = ("modal_stiffness", "W2", "modal_mass", "I0", "first_moment", "mass")
            self.stiffness, self.w2, self.modal_mass, self.inertia, self.c, self.mass = (file["invariants"][name][()] for name in names)
            self.origin, self.axes = file["frame/origin"][()], file["frame/axes"][()]
            self.shape, self.position = file["modes/shape"][()], file["nodes/position"][()]
            self.loads = {name: group["stiffness"][()] for name, group in file["geometric_stiffness"].items()}
            self.rotated = {name: (group["modes"][()], group["rotations"][()]) for name, group in file["rotated_stiffness"].items()}

    def spinning(self, rate, hub=np.zeros(3), stiffened=True):
        """Stiffness at the angular velocity `rate` (model axes) of the body that a rotor carries at its root, whose reference point is the
        origin of the frame: K_ff with the geometric stiffness of spin and reaction, less W2 (theory 7.1 and 7.6). The rotor axis goes
        through -hub (model axes)."""
        nf, w = len(self.stiffness), self.axes.T @ rate
        a = np.cross(w, np.cross(w, self.axes.T @ (self.origin + hub)))
        force = self.mass * a + np.cross(w, np.cross(w, self.c))
        moment = np.cross(self.c, a) + np.cross(w, self.inertia @ w)
        stiffness = self.stiffness - sum(w[k] * w[l] * self.w2[k * nf : (k + 1) * nf, l * nf : (l + 1) * nf] for k in range(3) for l in range(3))
        if stiffened:
            for k, l in SPIN:
                stiffness = stiffness + w[k] * w[l] * self.loads.get(f"spin_{'xyz'[k]}{'xyz'[l]}", 0.0)
            for k in range(3):
                stiffness = stiffness + force[k] * self.loads[f"force_{'xyz'[k]}_root"] + moment[k] * self.loads[f"moment_{'xyz'[k]}_root"]
        return (stiffness + stiffness.T) / 2


def converted(flexbody, ccx, part, folder, coupling, *options, ends=("root", "tip")):
    """The body of a part, with the geometric stiffness of its elements. K is that of element code, with 17 digits: CalculiX prints 14, of
    which the rounding is seen in the first frequency of a slender body."""
    part.write(folder, coupling, ends)
    run(ccx, "-i", "job", cwd=folder)
    k = part.stiffness()
    sp.save_npz(folder / "K.npz", ((k + k.T) / 2).tocsc())
    sp.save_npz(folder / "M.npz", full(folder / "job.mas", *part.rows(folder / "job.dof")).tocsc())
    (folder / "nodes.csv").write_text("node,x,y,z\n" + "".join(f"{node},{x!r},{y!r},{z!r}\n" for node, (x, y, z) in zip(part.ids, part.points.tolist())))
    manifest = (folder / "model.toml").read_text().replace('job = "job.inp"', 'stiffness = "K.npz"\nmass = "M.npz"\nnodes = "nodes.csv"')
    for name in ends:
        manifest = manifest.replace(f'set = "{name.upper()}"', f"nodes = {part.ids[part.ends[name]].tolist()}")
    (folder / "model.toml").write_text(manifest + '[[elements]]\nfile = "job.inp"\n')
    run(flexbody, "convert", "model.toml", "--geometric-stiffness", "spin,interfaces", "--lumped", "none", *options, "-o", "body.flex.h5", cwd=folder)
    return Body(folder / "body.flex.h5")


class Beam:
    """A beam along x by polynomials for deflection w and rotation t of its sections (Timoshenko): energies E I t'^2 + k G A (w' - t)^2."""

    def __init__(self, part, size, depth):
        self.length, area = size[0], size[1] * size[2]
        young, shear = part.young, part.young / (2 * (1 + part.poisson))
        self.mass, self.radius2 = part.density * area, depth**2 / 12
        # Cowper's coefficient of rectangles.
        factor = 10 * (1 + part.poisson) / (12 + 11 * part.poisson)
        self.bending, self.area, self.young = young * area * self.radius2, area, young
        x, weight = legendre.leggauss(DEGREE + 6)
        self.x, self.weight = (x + 1) * self.length / 2, weight * self.length / 2
        zero = np.zeros((len(x), DEGREE))
        value = legendre.legvander(x, DEGREE - 1)
        slope = np.column_stack([legendre.legval(x, legendre.legder(row)) for row in np.eye(DEGREE)]) * 2 / self.length
        self.w, self.t = np.hstack([value, zero]), np.hstack([zero, value])
        self.dw, self.dt = np.hstack([slope, zero]), np.hstack([zero, slope])
        self.stiffness = self.sum(self.dt, self.bending) + self.sum(self.dw - self.t, factor * shear * area)

    def sum(self, rows, of_points):
        return rows.T @ ((self.weight * of_points)[:, None] * rows)

    def held(self, *ends):
        """Shapes without deflection (w) or rotation (t) at the ends."""
        rows = np.zeros((len(ends), 2 * DEGREE))
        for row, (what, at) in zip(rows, ends):
            value = legendre.legvander(np.array([at]), DEGREE - 1)[0]
            row[:DEGREE] = value * (what == "w")
            row[DEGREE:] = value * (what == "t")
        return la.null_space(rows)

    def buckling(self, *ends):
        """Critical force: the axial stress works on the gradients of both displacements of a section, w' and y t'."""
        z = self.held(*ends)
        stressed = self.sum(self.dw, 1.0) + self.sum(self.dt, self.radius2)
        return 1 / la.eigh(z.T @ stressed @ z, z.T @ self.stiffness @ z, eigvals_only=True)[-1]

    def spinning(self, rate, hub, in_plane, count):
        """Angular frequencies of the beam held at its root, on a hub with the radius `hub`."""
        z = self.held(("w", -1), ("t", -1))
        l, x = self.length, self.x
        force = self.mass * rate**2 * (hub * (l - x) + (l**2 - x**2) / 2)
        stiffness = self.stiffness + self.sum(self.dw, force) + self.sum(self.dt, force * self.radius2)
        mass = self.sum(self.w, self.mass) + self.sum(self.t, self.mass * self.radius2)
        softening = self.sum(self.t, self.mass * self.radius2) + (self.sum(self.w, self.mass) if in_plane else 0.0)
        stiffness = stiffness - rate**2 * softening
        return np.sqrt(la.eigh(z.T @ stiffness @ z, z.T @ mass @ z, eigvals_only=True)[:count])


class Disc:
    """A thin disc, held at its inner edge, by polynomials along the radius (Kirchhoff's plate with rotary inertia), with the plane stress of its spin."""

    def __init__(self, part, size):
        self.a, self.b, self.h = size
        self.young, self.poisson, self.density = part.young, part.poisson, part.density

    def stress(self, r):
        """Radial and circumferential stress at unit rate, for no displacement at a and no stress at b."""
        v, rho, a, b = self.poisson, self.density, self.a, self.b
        # s_r = p + q / r^2 - (3 + v) / 8 rho r^2, s_t = p - q / r^2 - (1 + 3 v) / 8 rho r^2, u = r / E (s_t - v s_r).
        p, q = np.linalg.solve([[1 - v, -(1 + v) / a**2], [1, 1 / b**2]], [(1 - v**2) / 8 * rho * a**2, (3 + v) / 8 * rho * b**2])
        return p + q / r**2 - (3 + v) / 8 * rho * r**2, p - q / r**2 - (1 + 3 * v) / 8 * rho * r**2

    def frequencies(self, diameters, rate, count, bending=True):
        """Angular frequencies with a number of nodal diameters."""
        x, weight = legendre.leggauss(DEGREE + 12)
        half = (self.b - self.a) / 2
        r, weight = self.a + (x + 1) * half, weight * half
        # Clamped at a; a membrane is only held there.
        order = 2 if bending else 1
        base = legendre.legmul
        shapes = [base(legendre.legpow([1.0, 1.0], order), row) for row in np.eye(DEGREE)]
        w, d, dd = (np.column_stack([legendre.legval(x, legendre.legder(shape, k)) for shape in shapes]) / half**k for k in range(3))
        n, v, r = diameters, self.poisson, r[:, None]
        product = lambda left, right, of=1.0: left.T @ (weight[:, None] * of * r * right)
        radial, around = self.stress(r)
        stiffness = rate**2 * self.h * (product(d, d, radial) + product(w, w, around * n**2 / r**2))
        mass = self.density * self.h * product(w, w)
        if bending:
            plate = self.young * self.h**3 / 12 / (1 - v**2)
            across, twist = d / r - n**2 * w / r**2, n * (d / r - w / r**2)
            stiffness += plate * (product(dd + across, dd + across) - (1 - v) * (product(dd, across) + product(across, dd) - 2 * product(twist, twist)))
            mass += self.density * self.h**3 / 12 * (product(d, d) + product(w, w, n**2 / r**2))
        return np.sqrt(la.eigh(stiffness, mass, eigvals_only=True)[:count])


def struts(flexbody, ccx, folder):
    """Plane, supports, and critical forces of body, beam with shear and Euler's column: of a strut under opposite dead forces at its ends."""
    length, width, thickness = STRUT
    part = Part("C3D20", (30, 2, 2), lambda x, y, z: np.array([length * x, width * (y - 0.5), thickness * (z - 0.5)]), poisson=0.0)
    free = converted(flexbody, ccx, part, folder / "free", "rigid", "--residual-vectors", "interfaces", "--modes", 24)
    held = converted(flexbody, ccx, part, folder / "held", "rigid", "--basis", "craig-bampton", "--frame", "interface=root", "--modes", 24)
    clamped = 4.493409457909064**2 / np.pi**2
    cases = [
        ("pinned, pinned", free, [("root", "w"), ("tip", "w")], 1.0),
        ("clamped, free", held, [("root", "w"), ("root", "t")], 0.25),
        ("clamped, pinned", held, [("root", "w"), ("root", "t"), ("tip", "w")], clamped),
        ("clamped, clamped", held, [("root", "w"), ("root", "t"), ("tip", "w"), ("tip", "t")], 4.0),
    ]
    for plane, depth in ((1, width), (2, thickness)):
        beam = Beam(part, STRUT, depth)
        for name, body, supports, factor in cases:
            ends = [(what, -1 if end == "root" else 1) for end, what in supports]
            yield "xyz"[plane], name, critical(body, part, supports, plane), beam.buckling(*ends), factor * np.pi**2 * beam.bending / length**2


def critical(body, part, supports, plane):
    """Critical force of a body along x, with supports of its ends: by the modes that move in a plane, and its rigid motion there, which a
    frame at the root does not leave it."""
    axis = body.axes.T[:, 0]
    # A unit force along x at the root, and one against it at the tip.
    ends = [(sign * axis[k], f"force_{'xyz'[k]}_{name}") for name, sign in (("root", 1.0), ("tip", -1.0)) for k in range(3)]
    shape = body.shape @ body.axes.T
    moving = np.abs(shape).sum(axis=1).argmax(axis=1) == plane
    about = body.axes.T[:, 3 - plane]
    with_modes = sum(factor * body.loads[name] for factor, name in ends)[np.ix_(moving, moving)]
    mixed = sum(factor * body.rotated[name][0][moving] for factor, name in ends) @ about
    turned = about @ sum(factor * body.rotated[name][1] for factor, name in ends) @ about
    # Coordinates: modes, rotation, translation.
    size = len(with_modes) + 2
    stiffness, geometric = np.zeros((size, size)), np.zeros((size, size))
    stiffness[:-2, :-2] = body.stiffness[np.ix_(moving, moving)]
    geometric[:-2, :-2], geometric[:-2, -2], geometric[-2, :-2], geometric[-2, -2] = with_modes, mixed, mixed, turned
    rows = []
    for name, what in supports:
        nodes = part.ends[name]
        own = part.points[nodes] - part.reference(name)
        if what == "w":
            arm = part.reference(name) - body.origin
            rigid = [np.cross(np.eye(3)[3 - plane], arm)[plane], 1.0]
            row = shape[moving][:, nodes, plane].mean(axis=1)
        else:
            rigid = [1.0, 0.0]
            inertia = sum(r @ r * np.eye(3) - np.outer(r, r) for r in own)
            row = (np.cross(own[None], shape[moving][:, nodes]).sum(axis=1) @ np.linalg.inv(inertia))[:, 3 - plane]
        rows.append(np.concatenate([row, rigid]))
    if ("root", "t") in supports:
        assert abs(shape[:, part.ends["root"]]).max() < 1e-6 * abs(shape).max()
    z = la.null_space(np.array(rows))
    return 1 / la.eigh(-z.T @ geometric @ z, z.T @ stiffness @ z, eigvals_only=True)[-1]


def rotating_beam(flexbody, ccx, folder):
    """Hub over length, rate over the unit of the beam, flapping or in the plane, and frequencies in that unit of body and beam."""
    length, width, thickness = BEAM
    # In the plane of rotation the beam is wide. Without lateral contraction a clamped end is that of beams.
    part = Part("C3D20", (30, 2, 2), lambda x, y, z: np.array([length * x, width * (y - 0.5), thickness * (z - 0.5)]), poisson=0.0)
    body = converted(flexbody, ccx, part, folder, "rigid", "--basis", "craig-bampton", "--frame", "interface=root", "--modes", 30, ends=("root",))
    shape = body.shape @ body.axes.T
    for hub in (0.0, 1.0):
        for ratio in (0.0, 3.0, 6.0, 12.0):
            flap, chord = Beam(part, BEAM, thickness), Beam(part, BEAM, width)
            unit = np.sqrt(flap.bending / flap.mass / length**4)
            rate = ratio * unit
            stiffness = body.spinning(np.array([0.0, 0.0, rate]), np.array([hub * length, 0.0, 0.0]))
            values, vectors = la.eigh(stiffness, body.modal_mass)
            # Mean motion of the sections: torsion has none.
            sections = np.array([shape[:, part.lattice[:, 0] == x].mean(axis=1) for x in np.unique(part.lattice[:, 0])])
            moved = np.abs(np.einsum("sjk,jm->smk", sections, vectors)).sum(axis=0)
            least = 0.1 * np.median(moved.max(axis=1))
            flapping, in_plane = (np.sqrt(values[(moved.argmax(axis=1) == k) & (moved[:, k] > least)]) for k in (2, 1))
            yield hub, ratio, flapping[:3] / unit, flap.spinning(rate, hub * length, False, 3) / unit, in_plane[:2] / unit, chord.spinning(rate, hub * length, True, 2) / unit


def rotating_disc(flexbody, ccx, folder):
    """Nodal diameters, circles, rate over the first frequency, and frequencies in Hz of body, plate, and body without geometric stiffness."""
    a, b, h = DISC
    place = lambda x, y, z: np.array([(a + (b - a) * x**2) * np.cos(2 * np.pi * y), (a + (b - a) * x**2) * np.sin(2 * np.pi * y), h * (z - 0.5)])
    part = Part("C3D20R", (12, 32, 1), place, closed=True)
    body = converted(flexbody, ccx, part, folder, "rigid", "--basis", "craig-bampton", "--frame", "interface=root", "--modes", 100, ends=("root",))
    disc = Disc(part, DISC)
    first = min(disc.frequencies(n, 0.0, 1)[0] for n in range(4))
    rim = part.ends["tip"]
    angle = np.arctan2(part.points[rim, 1], part.points[rim, 0])
    for ratio in (0.0, 1.0, 3.0):
        rate = ratio * first
        values, vectors = la.eigh(body.spinning(np.array([0.0, 0.0, rate])), body.modal_mass)
        moved = np.einsum("jnk,jm->mnk", body.shape @ body.axes.T, vectors)
        across = np.abs(moved).sum(axis=1).argmax(axis=1) == 2
        waves = np.abs(moved[:, rim, 2] @ np.exp(1j * np.outer(angle, np.arange(8)))).argmax(axis=1)
        for diameters in range(4):
            mine = np.sqrt(np.maximum(values[across & (waves == diameters)], 0.0)) / 2 / np.pi
            # Two modes for each number of diameters but zero.
            mine = mine[:: 2 if diameters else 1][:2]
            theirs = disc.frequencies(diameters, rate, 2) / 2 / np.pi
            southwell = np.hypot(disc.frequencies(diameters, 0.0, 1), disc.frequencies(diameters, rate, 1, bending=False)) / 2 / np.pi
            yield ratio, diameters, mine, theirs, southwell[0]
