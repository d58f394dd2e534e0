"""Solid elements with their stress stiffness in numpy, models of them as jobs of CalculiX, and the geometric stiffness that flexbody makes of the stresses of CalculiX."""

import itertools
import re
import subprocess
import sys

import numpy as np
import scipy.sparse as sp

CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
HEX_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
TET_CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
TET_EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
# Six tetrahedra around a diagonal of the brick fit their neighbours.
TETRAHEDRA = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
SPIN = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))


def powers(total, each):
    """Exponents of monomials; of serendipity bricks those of superlinear degree two at most."""
    return [p for p in itertools.product(range(each + 1), repeat=3) if total(p)]


def superlinear(p):
    return sum(power for power in p if power > 1) <= 2 and max(p) <= 2


class Element:
    """Isoparametric element: its nodes in reference coordinates, monomials and quadrature."""

    def __init__(self, kind):
        count = int(re.match(r"C3D(\d+)", kind).group(1))
        full = count == 20 and not kind.endswith("R")
        line2, line3 = np.array([-1, 1]) / np.sqrt(3), np.array([-1, 0, 1]) * np.sqrt(0.6)
        if count in (8, 20):
            corners, edges = 2.0 * CORNERS - 1, HEX_EDGES if count == 20 else []
            monomials = powers(superlinear, 2) if count == 20 else powers(lambda p: True, 1)
            line, weight = (line3, np.array([5, 8, 5]) / 9) if full else (line2, np.ones(2))
            self.points = list(itertools.product(line, repeat=3))
            self.weights = [np.prod(w) for w in itertools.product(weight, repeat=3)]
        else:
            corners, edges = TET_CORNERS.astype(float), TET_EDGES if count == 10 else []
            monomials = powers(lambda p: sum(p) <= (2 if count == 10 else 1), 2)
            a, b = (5 - np.sqrt(5)) / 20, (5 + 3 * np.sqrt(5)) / 20
            self.points = [(0.25, 0.25, 0.25)] if count == 4 else [(a, a, a), (b, a, a), (a, b, a), (a, a, b)]
            self.weights = [1 / 6 / len(self.points)] * len(self.points)
        self.nodes = np.vstack([corners, *[(corners[i] + corners[j]) / 2 for i, j in edges]]) if edges else corners
        self.monomials = np.array(monomials)
        assert len(self.monomials) == len(self.nodes) == count
        self.inverse = np.linalg.inv(np.array([np.prod(x**self.monomials, axis=1) for x in self.nodes]))

    def slopes(self, xi):
        """Derivatives of the shape functions (nodes x 3)."""
        columns = []
        for k in range(3):
            lower = self.monomials.copy()
            lower[:, k] = np.maximum(lower[:, k] - 1, 0)
            columns.append(self.monomials[:, k] * np.prod(np.asarray(xi) ** lower, axis=1))
        return self.inverse.T @ np.array(columns).T

    def stress_stiffness(self, x, u, young, poisson):
        """Integral of grad N . stress . grad N for the stress of displacements u of nodes at x."""
        lame, shear = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
        total = 0.0
        for xi, weight in zip(self.points, self.weights):
            slope = self.slopes(xi)
            jacobian = x.T @ slope
            gradient = slope @ np.linalg.inv(jacobian)
            strain = u.T @ gradient
            strain = (strain + strain.T) / 2
            stress = 2 * shear * strain + lame * np.trace(strain) * np.eye(3)
            total = total + weight * np.linalg.det(jacobian) * gradient @ stress @ gradient.T
        return total


    def stiffness(self, x, young, poisson):
        """Stiffness of nodes at x, rows node by node."""
        lame, shear = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
        elasticity = np.diag([2 * shear] * 3 + [shear] * 3)
        elasticity[:3, :3] += lame
        total = 0.0
        for xi, weight in zip(self.points, self.weights):
            slope = self.slopes(xi)
            jacobian = x.T @ slope
            gradient = slope @ np.linalg.inv(jacobian)
            strain = np.zeros((6, gradient.size))
            for k in range(3):
                strain[k, k::3] = gradient[:, k]
            for row, (a, b) in enumerate(((0, 1), (1, 2), (0, 2)), 3):
                strain[row, a::3], strain[row, b::3] = gradient[:, b], gradient[:, a]
            total = total + weight * np.linalg.det(jacobian) * strain.T @ elasticity @ strain
        return (total + total.T) / 2


class Part:
    """A part of one kind of element along x, as a job of CalculiX. `place` maps the unit cube to the part; `units` is m or mm; `turn` its
    attitude; `closed` joins its two sides along y."""

    def __init__(self, kind, cells, place, units="m", turn=np.eye(3), closed=False, poisson=0.3):
        self.kind, self.units, self.element = kind, units, Element(kind)
        self.scale = {"m": 1.0, "mm": 1000.0}[units]
        self.young, self.density = {"m": (2.1e11, 7850.0), "mm": (2.1e5, 7.85e-9)}[units]
        self.poisson = poisson
        corners = len(CORNERS if len(self.element.nodes) in (8, 20) else TET_CORNERS)
        parts = [tuple(range(8))] if corners == 8 else TETRAHEDRA
        edges = {8: HEX_EDGES, 4: TET_EDGES}[corners] if len(self.element.nodes) > corners else []
        numbers, self.elements = {}, []
        for cell in itertools.product(*(range(n) for n in cells)):
            own = [tuple(2 * (np.array(cell) + corner)) for corner in CORNERS]
            for nodes in parts:
                lattice = [own[k] for k in nodes]
                lattice += [tuple((np.array(lattice[i]) + lattice[j]) // 2) for i, j in edges]
                around = 2 * cells[1] if closed else sys.maxsize
                lattice = [(x, y % around, z) for x, y, z in lattice]
                self.elements.append([numbers.setdefault(at, len(numbers)) for at in lattice])
        self.lattice = np.array(list(numbers)) / (2 * np.array(cells))
        points = np.array([turn @ place(*at) * self.scale for at in self.lattice])
        # The digits of the deck.
        self.points = np.array([[float(f"{value:.12g}") for value in point] for point in points])
        self.ids = 10 * np.arange(len(points)) + 7
        self.ends = {name: np.flatnonzero(self.lattice[:, 0] == x) for name, x in (("root", 0.0), ("tip", 1.0))}

    def mesh(self):
        lines = ["*NODE, NSET=NALL"] + [f"{at}, " + ", ".join(f"{value:.12g}" for value in x) for at, x in zip(self.ids, self.points)]
        lines.append(f"*ELEMENT, TYPE={self.kind}, ELSET=EALL")
        for at, nodes in enumerate(self.elements, 1):
            words = [str(word) for word in [at, *self.ids[nodes]]]
            lines += [", ".join(words[k : k + 10]) + ("," if k + 10 < len(words) else "") for k in range(0, len(words), 10)]
        for name, nodes in self.ends.items():
            lines += [f"*NSET, NSET={name.upper()}"] + [f"{self.ids[node]}," for node in nodes]
        lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", f"{self.young}, {self.poisson}", "*DENSITY", f"{self.density}", "*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL"]
        return "\n".join(lines) + "\n"

    def write(self, folder, coupling, ends=("root", "tip")):
        """The job and its manifest, with interfaces at `ends`."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "job.inp").write_text(self.mesh() + "*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n4\n*END STEP\n")
        mass = {"m": "kg", "mm": "tonne"}[self.units]
        manifest = f'[model]\nname = "part"\n[model.units]\nlength = "{self.units}"\nmass = "{mass}"\ntime = "s"\n[files]\njob = "job.inp"\n'
        for name in ends:
            manifest += f'[[interface]]\nname = "{name}"\nset = "{name.upper()}"\ncoupling = "{coupling}"\nreference = {self.reference(name).tolist()}\n'
        (folder / "model.toml").write_text(manifest)

    def matrices(self, folder, job="job"):
        return full(folder / f"{job}.sti", *self.rows(folder / f"{job}.dof"))

    def rows(self, path):
        """Row of the part (three per node) for each row of a file, and the number of rows."""
        place = {int(node): at for at, node in enumerate(self.ids)}
        labels = [line.strip().split(".") for line in path.read_text().split()]
        return np.array([3 * place[int(node)] + int(k) - 1 for node, k in labels]), 3 * len(self.ids)

    def stress_stiffness(self, u):
        """K_geo of displacements (3n) by element code."""
        return sp.kron(self.by_nodes(u), sp.identity(3)).tocsr()

    def by_nodes(self, u):
        """The matrix whose Kronecker product with I3 is K_geo."""
        u = u.reshape(-1, 3)
        return self.assembled(lambda nodes: self.element.stress_stiffness(self.points[nodes], u[nodes], self.young, self.poisson), 1)

    def stiffness(self):
        """K by element code, with all digits."""
        return self.assembled(lambda nodes: self.element.stiffness(self.points[nodes], self.young, self.poisson), 3)

    def assembled(self, of_element, each):
        """Sum of matrices of elements with a number of rows for each node."""
        rows, columns, values = [], [], []
        for nodes in self.elements:
            block = of_element(nodes)
            own = (each * np.array(nodes)[:, None] + np.arange(each)).ravel()
            rows.append(np.repeat(own, len(own)))
            columns.append(np.tile(own, len(own)))
            values.append(block.ravel())
        return sp.coo_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(each * len(self.ids),) * 2).tocsr()

    def rigid(self, about=np.zeros(3)):
        motions = np.zeros((3 * len(self.ids), 6))
        for k in range(3):
            motions[k::3, k] = 1.0
            motions[:, 3 + k] = np.cross(np.eye(3)[k], self.points - about).ravel()
        return motions

    def reference(self, name):
        return self.points[self.ends[name]].mean(axis=0)

    def at(self, name):
        """Unit forces and moments at the mean of an end (3n x 6), distributed as a rigid motion of its nodes."""
        rows = (3 * self.ends[name][:, None] + np.arange(3)).ravel()
        own = self.rigid(self.reference(name))[rows]
        loads = np.zeros((3 * len(self.ids), 6))
        loads[rows] = own @ np.linalg.inv(own.T @ own)
        return loads


def full(path, rows, count):
    """A matrix of CalculiX by the rows of the part."""
    table = np.loadtxt(path)
    i, j = rows[table[:, 0].astype(int) - 1], rows[table[:, 1].astype(int) - 1]
    off = i != j
    values = np.concatenate([table[:, 2], table[off, 2]])
    return sp.coo_matrix((values, (np.concatenate([i, j[off]]), np.concatenate([j, i[off]]))), shape=(count, count)).tocsr()


def run(*words, cwd):
    done = subprocess.run([str(word) for word in words], cwd=cwd, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))} ended with {done.returncode}:\n{done.stderr}{done.stdout}")
    return done.stdout + done.stderr


def with_stresses(flexbody, ccx, part, folder, options=()):
    """Runs all steps in `folder`: plain.flex.h5, stiff.toml, and the manifest stressed.toml with the geometric stiffness."""
    run(ccx, "-i", "job", cwd=folder)
    run(flexbody, "convert", "model.toml", "--modes", 6, "--lumped", "none", *options, "-o", "plain.flex.h5", cwd=folder)
    run(flexbody, "shapes", "plain.flex.h5", "--model", "model.toml", "--geometric-stiffness", "-o", "stiff.inp", cwd=folder)
    script = (folder / "stiff.sh").read_text().replace("\nflexbody ", f"\n{flexbody} ").replace("\nccx ", f"\n{ccx} ")
    (folder / "stiff.sh").write_text(script)
    run("sh", "stiff.sh", cwd=folder)
    (folder / "stressed.toml").write_text((folder / "model.toml").read_text() + (folder / "stiff.toml").read_text())


def given(part, folder):
    """K_geo of each load of stiff.toml: kind, axis, interface and matrix."""
    import tomllib

    plain = part.matrices(folder)
    for table in tomllib.loads((folder / "stiff.toml").read_text())["geometric_stiffness"]:
        kind = next(kind for kind in ("spin", "force", "moment") if kind in table)
        stressed = part.matrices(folder, table["with_stress"].removesuffix(".sti"))
        yield kind, table[kind], table.get("interface"), (stressed - plain) / table["load_size"]


class Responses:
    """Static responses of a free part to loads that its inertia balances."""

    def __init__(self, part, folder):
        self.part = part
        self.k, self.m = part.matrices(folder), full(folder / "job.mas", *part.rows(folder / "job.dof"))
        rigid = part.rigid()
        momenta = self.m @ rigid
        self.relief = momenta @ np.linalg.solve(rigid.T @ momenta, rigid.T)
        self.inverse = np.linalg.pinv(self.k.toarray(), rcond=1e-11, hermitian=True)

    def to(self, load):
        balanced = load - self.relief @ load
        response = self.inverse @ balanced
        # One step of refinement removes the error of the inverse.
        return response + self.inverse @ (balanced - self.k @ response)

    def to_spin(self, a, b, axes=np.eye(3)):
        """Response to the centrifugal forces of a product of two unit spin rates about columns of `axes`."""
        e, x = axes.T, self.part.points
        pair = lambda a, b: np.cross(e[a], np.cross(e[b], x))
        return self.to(-(self.m @ (pair(a, a) if a == b else pair(a, b) + pair(b, a)).ravel()))

    def to_interface(self, interface, kind, axis):
        """Response to a unit force or moment along an axis at an interface."""
        return self.to(self.part.at(interface)[:, {"force": slice(0, 3), "moment": slice(3, 6)}[kind]] @ axis)


def by_element_code(part, folder):
    """Largest difference of K_geo from element code over all loads, relative to the largest entry of each, and the number of loads."""
    responses = Responses(part, folder)
    worst, count = 0.0, 0
    for kind, axis, interface, found in given(part, folder):
        if kind == "spin":
            moved = responses.to_spin(*("xyz".index(letter) for letter in axis))
        else:
            moved = responses.to_interface(interface, kind, np.eye(3)["xyz".index(axis)])
        expected = part.stress_stiffness(moved)
        worst = max(worst, abs(found - expected).max() / abs(expected).max())
        count += 1
    return worst, count


def of_elements(part, folder):
    """Function that yields the loads along the columns of `axes`: the name in the flex-body file, and K_geo by nodes of element code."""
    responses = Responses(part, folder)

    def loads(axes):
        for a, b in SPIN:
            yield f"spin_{'xyz'[a]}{'xyz'[b]}", part.by_nodes(responses.to_spin(a, b, axes))
        for interface in part.ends:
            for kind in ("force", "moment"):
                for k in range(3):
                    yield f"{kind}_{'xyz'[k]}_{interface}", part.by_nodes(responses.to_interface(interface, kind, axes[:, k]))

    return loads
