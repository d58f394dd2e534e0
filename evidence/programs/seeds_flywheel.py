"""A slender beam without and with a flywheel: sizes of the terms and errors of guidelines I to IV; for make_seeds.py.

The wheel is a square frame of steel around a cell of the beam, in the finite element model itself. Beside that stands the bare beam with the inertia of
the wheel as the attachment of a scene: both have to give the same sizes.
"""

import json

import numpy as np

from make_cutoff import hexahedra, save
from trade_guidelines import Body, GUIDELINES, Motion, read_scene, study

CELLS = (25, 3, 3)
LENGTH, WIDTH, HEIGHT = 1.0, 0.02, 0.01  # m
RIM = 0.1  # half the side of the wheel, m
DENSITY = 7850.0  # kg/m^3
MODES = 6
DEFLECTION = 0.01
SPEED = 0.02
PERIODS, OUTPUTS = 20, 400
# Direction of the spin: mostly across the beam, with a part along its axis.
AXIS = (0.4, 0.5, 0.77)
# Wheel in the middle or at the end: index of its cell along the beam.
CASES = {"bare beam": None, "wheel in the middle": CELLS[0] // 2, "wheel at the end": CELLS[0] - 1}
# Terms that stand beside I0, as `select` names them.
BESIDE_INERTIA = ("linear inertia W1 Q", "quadratic inertia Q'W2 Q", "inertia coupling Q'W3")
# Largest distance of the two programs.
AGREEMENT = 1e-6
TOLERANCE = {"attitude": 1e-3, "stress": 0.01}


def write_model(folder, wheel):
    """Writes the beam with a wheel at a cell, or without one; returns the manifest."""
    corners = [np.linspace(0.0, LENGTH, CELLS[0] + 1), np.array([-RIM, -WIDTH / 2, WIDTH / 2, RIM]), np.array([-RIM, -HEIGHT / 2, HEIGHT / 2, RIM])]

    def place(lattice):
        return np.column_stack([np.interp(lattice[:, k], np.arange(len(corners[k])), corners[k]) for k in range(3)])

    x, k, m = hexahedra(CELLS, place, density=DENSITY, is_filled=lambda cell: cell[1:] == (1, 1) or cell[0] == wheel)
    folder.mkdir()
    save(folder / "K.mtx", k)
    save(folder / "M.mtx", np.kron(m, np.eye(3)))
    (folder / "nodes.csv").write_text("node,x,y,z\n" + "".join(f"{i + 1},{a!r},{b!r},{c!r}\n" for i, (a, b, c) in enumerate(x.tolist())))
    (folder / "model.toml").write_text(
        '[model]\nname = "beam_with_wheel"\n[model.units]\nlength = "m"\nmass = "kg"\ntime = "s"\n[files]\nstiffness = "K.mtx"\nmass = "M.mtx"\nnodes = "nodes.csv"\n')
    return folder / "model.toml"


def box(a, b, c):
    """Mass and moments about the centre of a box of steel."""
    mass = DENSITY * a * b * c
    return mass, mass / 12 * np.array([b * b + c * c, a * a + c * c, a * a + b * b])


class Wheel:
    """Mass and moments of the frame, and what they add to those of the bare beam about the common centre of mass."""

    def __init__(self, cell):
        thickness = LENGTH / CELLS[0]
        (outer, of_outer), (inner, of_inner) = box(thickness, 2 * RIM, 2 * RIM), box(thickness, WIDTH, HEIGHT)
        self.mass, self.own = outer - inner, of_outer - of_inner
        beam, _ = box(LENGTH, WIDTH, HEIGHT)
        arm = (cell + 0.5) * thickness - LENGTH / 2
        self.added = self.own + beam * self.mass / (beam + self.mass) * arm**2 * np.array([0, 1, 1])


def sizes(program, path, body, folder, attached=None):
    """Sizes of the terms beside I0 at a deflection of 1 %."""
    scene = folder / "range.toml"
    text = f"[motion]\nangular_velocity = {float(SPEED * np.sqrt(body.eigenvalue[0]))!r}\n[limits]\ndeflection = {DEFLECTION * LENGTH!r}\n"
    if attached is not None:
        text += f"[attachment]\ninertia = {attached.tolist()}\n"
    scene.write_text(text)
    found = json.loads(program.run("select", path, "--scene", scene, "--json", codes=(0, 1)))["results"]["significance"]
    return [next(one["tier_1"] for one in found if one["term"] == term) for term in BESIDE_INERTIA]


class Case:
    """A beam with or without a wheel: its body, sizes and errors."""

    def __init__(self, program, name, wheel, bare, parent):
        folder = parent / name.replace(" ", "_")
        manifest = write_model(folder, wheel)
        self.path = folder / "body.flex.h5"
        program.convert(manifest, self.path, MODES, "--frame", "com")
        self.name, self.body = name, Body(self.path)
        self.inertia = np.diag(self.body.I0)
        self.sizes = sizes(program, self.path, self.body, folder)
        self.attached = self.inertia_error = None
        if wheel is not None:
            added = Wheel(wheel).added
            self.attached = sizes(program, bare.path, bare.body, folder, added)
            self.inertia_error = float(np.abs(bare.inertia + added - self.inertia).max() / self.inertia.max())
            assert self.inertia_error < 1e-12, (name, self.inertia_error)
        self.simulate(program, folder)

    def simulate(self, program, folder):
        """Errors of the guidelines in a tumble with the first mode bent, and the distance of all terms from `flexbody simulate`."""
        body = self.body
        self.frequency = float(np.sqrt(body.eigenvalue[0]) / (2 * np.pi))
        rate = float(np.sqrt(body.eigenvalue[0]))
        largest = float(np.linalg.norm(body.shape[0], axis=1).max())
        self.products = products(body, DEFLECTION * LENGTH / largest)
        spin = SPEED * rate * np.array(AXIS) / np.linalg.norm(AXIS)
        path = folder / "scene.toml"
        path.write_text(
            f'name = "tumble"\n[run]\nduration = {PERIODS * 2 * np.pi / rate!r}\noutputs = {OUTPUTS}\n[initial]\nangular_velocity = {spin.tolist()}\n'
            f"mode = [{{ number = 1, amplitude = {DEFLECTION * LENGTH / largest!r} }}]\n")
        times, own = simulated(program, self.path, path, body)
        scene = read_scene(path)
        whole, self.errors = study(body, scene, times, tolerance=1e-9)
        self.agree = distance(own, whole, body)
        # One whole group of the kinetic energy: W1 Qd omega without the other Coriolis terms, in both programs.
        reduced = folder / "w1.flex.h5"
        program.run("reduce", self.path, "--terms", "W1", "-o", reduced, "--quiet")
        of_group = Motion(body, scene, {"load", "W1Q", "torque W1Qd"}).states(times, 1e-9)
        self.group_agree = distance(simulated(program, reduced, path, body)[1], of_group, body)
        assert max(self.agree, self.group_agree) < AGREEMENT, (self.name, self.agree, self.group_agree)


def simulated(program, path, scene, body):
    """The motion by `flexbody simulate`: instants, and attitude, angular velocity and modal coordinates in rows."""
    table = scene.with_suffix(".csv")
    program.run("simulate", path, "--scene", scene, "--csv", table, "--quiet")
    rows = np.genfromtxt(table, delimiter=",", names=True)
    names = [f"attitude_{k}" for k in range(4)] + [f"angular_velocity_{k}" for k in "xyz"] + [f"q_{j + 1}" for j in range(body.nf)]
    return rows["time"], np.array([rows[name] for name in names])


def distance(own, other, body):
    """The largest difference of the Euler parameters, and of the modal coordinates relative to their largest."""
    attitude, q = own[:4] * np.sign((own[:4] * other[:4]).sum(axis=0)), own[7:]
    return max(np.abs(attitude - other[:4]).max(), np.abs(q - other[7:7 + body.nf]).max() / np.abs(q).max())


def products(body, amplitude):
    """The largest product of inertia of W1 Q over the smaller of the two moments, with the first mode bent."""
    changed = np.abs(body.W1.reshape(3, 3, body.nf)[:, :, 0]) * amplitude
    moments = np.diag(body.I0)
    return max(float(changed[k, l] / min(moments[k], moments[l])) for k, l in ((0, 1), (1, 2), (0, 2)))


class Study:
    """All cases."""

    def __init__(self, program, folder):
        self.cases = []
        for name, wheel in CASES.items():
            self.cases.append(Case(program, name, wheel, self.cases[0] if self.cases else None, folder))
        self.names = [name for name in GUIDELINES if name != "IV"]
        self.wheel = Wheel(CASES["wheel in the middle"])
