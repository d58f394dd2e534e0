"""Small bodies and their modes and invariants with 120 digits, for make_stability.py."""

import itertools

import gmpy2
import numpy as np
from gmpy2 import mpfr, sqrt

gmpy2.get_context().precision = 400  # bits
CORNERS = list(itertools.product((-1, 1), repeat=3))
STEEL = {"young": mpfr("210e9"), "poisson": mpfr("0.3"), "density": mpfr(7850)}


def real(values):
    """Numbers, or decimal numbers as text, exactly."""
    return np.vectorize(mpfr, otypes=[object])(values)


def zeros(*shape):
    return np.full(shape, mpfr(0), dtype=object)


# Linear algebra.

def cholesky(a):
    """The lower factor."""
    lower = a.copy()
    for k in range(len(a)):
        assert lower[k, k] > 0, "not positive definite"
        lower[k:, k] = lower[k:, k] / sqrt(lower[k, k])
        lower[k + 1:, k + 1:] -= np.multiply.outer(lower[k + 1:, k], lower[k + 1:, k])
    return np.where(np.tri(len(a), dtype=bool), lower, mpfr(0))


def solve_lower(lower, b):
    x = b.copy()
    for k in range(len(x)):
        x[k] = x[k] / lower[k, k]
        x[k + 1:] -= np.multiply.outer(lower[k + 1:, k], x[k])
    return x


def solve_upper(lower, b):
    """With the transpose of a lower factor."""
    x = b.copy()
    for k in reversed(range(len(x))):
        x[k] = x[k] / lower[k, k]
        x[:k] -= np.multiply.outer(lower[k, :k], x[k])
    return x


def symmetric_eigen(s):
    """Eigenvalues and orthonormal vectors by Jacobi rotations, after numpy has nearly diagonalised the matrix."""
    size = max(abs(v) for v in s.flat)
    rough = real(np.linalg.eigh((s / size).astype(float))[1])
    vectors = solve_lower(cholesky(rough.T.dot(rough)), rough.T).T
    a = vectors.T.dot(s).dot(vectors)
    a = (a + a.T) / 2
    zero = mpfr(2) ** (60 - gmpy2.get_context().precision)
    rotated = True
    while rotated:
        rotated = False
        for p, q in itertools.combinations(range(len(a)), 2):
            if abs(a[p, q]) <= max(zero * sqrt(abs(a[p, p] * a[q, q])), zero**2 * size):
                continue
            rotated = True
            theta = (a[q, q] - a[p, p]) / (2 * a[p, q])
            t = (1 if theta >= 0 else -1) / (abs(theta) + sqrt(theta * theta + 1))
            c = 1 / sqrt(t * t + 1)
            for m in (a.T, a, vectors.T):
                x, y = m[p].copy(), m[q].copy()
                m[p], m[q] = c * (x - t * y), c * (t * x + y)
            a[p, q] = a[q, p] = mpfr(0)
    return np.diag(a), vectors


# Modes and invariants.

def rigid(dofs, x):
    """Unit translations and rotations about the origin of x (rows x 6)."""
    fields = zeros(len(dofs), 6)
    for row, (node, k) in enumerate(dofs):
        fields[row, k] = mpfr(1)
        if k < 3:
            l, m = (k + 1) % 3, (k + 2) % 3
            fields[row, 3 + l], fields[row, 3 + m] = x[node, m], -x[node, l]
    return fields


def modes(k, m, dofs, x, dimension):
    """Finite eigenvalues, ascending, and mass-normalised modes of K and M on what is M-orthogonal to rigid motion."""
    r = rigid(dofs, x - x.mean(axis=0))[:, range(6) if dimension == 3 else (0, 1, 5)]
    r = solve_lower(cholesky(r.T.dot(m).dot(r)), r.T).T
    mr, kr = m.dot(r), k.dot(r)
    k = k - mr.dot(kr.T) - kr.dot(mr.T) + mr.dot(r.T.dot(kr)).dot(mr.T)
    # So many digits are there that no shift costs any.
    tau = min(k[i, i] / m[i, i] for i in range(len(k)) if m[i, i] > 0 and k[i, i] > 0)
    lower = cholesky(k + tau * m)
    s = solve_lower(lower, solve_lower(lower, m).T)
    y = lower.T.dot(r)
    theta, vectors = symmetric_eigen((s + s.T) / 2 - y.dot(y.T) / tau**2)
    order = sorted(range(len(theta)), key=lambda i: -theta[i])
    finite = [i for i in order if theta[i] > mpfr("1e-50") * theta[order[0]]]
    return 1 / theta[finite] - tau, solve_upper(lower, vectors[:, finite] / np.vectorize(sqrt)(theta[finite]))


def aligned(values, m, vectors, to, gap=mpfr("1e-6")):
    """The first modes, those of eigenvalues closer than `gap` turned into each other as close to the modes `to` as they can be."""
    product, out = m.dot(to), zeros(*to.shape)
    start = 0
    while start < to.shape[1]:
        end = start + 1
        while end < len(values) and values[end] - values[end - 1] <= gap * values[end]:
            end += 1
        own = slice(start, min(end, to.shape[1]))
        cross = vectors[:, start:end].T.dot(product[:, own])
        squares, turn = symmetric_eigen(cross.T.dot(cross))
        out[:, own] = vectors[:, start:end].dot(cross.dot(turn / np.vectorize(sqrt)(squares)).dot(turn.T))
        start = end
    return out


def crossed(axis, vectors, dofs):
    """e_axis x displacement in every row, zero at rotations."""
    rows, out = {dof: row for row, dof in enumerate(dofs)}, zeros(*vectors.shape)
    l, m = (axis + 1) % 3, (axis + 2) % 3
    for node, k in dofs:
        if k == l and (node, m) in rows:
            out[rows[node, k]] = -vectors[rows[node, m]]
        elif k == m and (node, l) in rows:
            out[rows[node, k]] = vectors[rows[node, l]]
    return out


def invariants(m, dofs, x, vectors):
    """I0, W1, W2, W3 of any mass about the origin of x (theory 6.2)."""
    nf = vectors.shape[1]
    columns = np.hstack([rigid(dofs, x)[:, 3:], *(crossed(b, vectors, dofs) for b in range(3)), vectors])
    g = columns.T.dot(m.dot(columns))
    half = g[:3, 3:3 + 3 * nf].reshape(3, 3, nf)
    return {"I0": g[:3, :3], "W1": (half + half.transpose(1, 0, 2)).reshape(3, 3 * nf),
            "W2": g[3:3 + 3 * nf, 3:3 + 3 * nf], "W3": g[3:3 + 3 * nf, 3 + 3 * nf:]}


# Elements and bodies.

class Body:
    """K and M (rows as `dofs`: node and direction), node positions."""

    def __init__(self, x, directions=3, dimension=3):
        self.x, self.dimension = x, dimension
        self.dofs = [(node, k) for node in range(len(x)) for k in range(directions)]
        self.directions = directions
        self.k, self.m = zeros(len(self.dofs), len(self.dofs)), zeros(len(self.dofs), len(self.dofs))

    def add(self, nodes, k, m=None):
        """An element; a mass of one row per node counts for every direction."""
        rows = np.array([self.directions * node + d for node in nodes for d in range(self.directions)])
        self.k[np.ix_(rows, rows)] += (k + k.T) / 2
        if m is not None and len(m) == len(rows):
            self.m[np.ix_(rows, rows)] += (m + m.T) / 2
        elif m is not None:
            for d in range(self.directions):
                self.m[np.ix_(rows[d::self.directions], rows[d::self.directions])] += m


def elastic(slopes, jacobian, young, poisson):
    """Stiffness at a point of functions with these slopes in the element (per weight), and the determinant."""
    d = len(jacobian)
    if d == 2:
        cofactors = np.array([[jacobian[1, 1], -jacobian[1, 0]], [-jacobian[0, 1], jacobian[0, 0]]])
    else:
        cofactors = np.array([np.cross(jacobian[(a + 1) % 3], jacobian[(a + 2) % 3]) for a in range(3)])
    determinant = jacobian[0].dot(cofactors[0])
    gradient = slopes.dot((cofactors.T / determinant).T)
    lame, shear = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
    k, dots = zeros(d * len(slopes), d * len(slopes)), gradient.dot(gradient.T)
    for a, b in itertools.product(range(d), repeat=2):
        k[a::d, b::d] = lame * np.multiply.outer(gradient[:, a], gradient[:, b]) + shear * np.multiply.outer(gradient[:, b], gradient[:, a])
        if a == b:
            k[a::d, b::d] += shear * dots
    return k, determinant


def brick(points, young, poisson, density, mass_points=None):
    """Linear element with 2^d nodes: stiffness by two Gauss points per direction, mass by these or others (weights equal)."""
    d = points.shape[1]
    corners = list(itertools.product((-1, 1), repeat=d))
    full = list(itertools.product((-1 / sqrt(mpfr(3)), 1 / sqrt(mpfr(3))), repeat=d))
    k, m = zeros(d * len(points), d * len(points)), zeros(len(points), len(points))

    def functions(xi):
        factors = [[(1 + s * v) / 2 for s, v in zip(corner, xi)] for corner in corners]
        product = lambda f: np.multiply.reduce(np.array([mpfr(1), *f], dtype=object))  # noqa: E731
        values = np.array([product(f) for f in factors])
        slopes = np.array([[mpfr(s) / 2 * product(f[:e] + f[e + 1:]) for e, s in enumerate(corner)] for corner, f in zip(corners, factors)])
        return values, slopes

    for xi in full:
        slopes = functions(xi)[1]
        at_point, determinant = elastic(slopes, slopes.T.dot(points), young, poisson)
        k += at_point * determinant
    chosen = mass_points or full
    for xi in chosen:
        values, slopes = functions(xi)
        determinant = elastic(slopes, slopes.T.dot(points), young, poisson)[1]
        m += np.multiply.outer(values, values) * (determinant * density * 2**d / len(chosen))
    return k, m


def bricks(cells, size, move=lambda p: p, material=lambda cell: STEEL, mass_points=None):
    """A block, or a rectangle in the plane, of linear elements."""
    places = list(itertools.product(*(range(c + 1) for c in cells)))
    number = {place: i for i, place in enumerate(places)}
    size, d = real(size), len(cells)
    x = zeros(len(places), 3)
    for place, i in number.items():
        x[i, :d] = move(np.array([size[e] * place[e] / cells[e] for e in range(d)], dtype=object))
    body = Body(x, d, d)
    for cell in itertools.product(*map(range, cells)):
        nodes = [number[tuple(c + s for c, s in zip(cell, corner))] for corner in itertools.product((0, 1), repeat=d)]
        body.add(nodes, *brick(x[nodes][:, :d], **material(cell), mass_points=mass_points))
    return body


def tetrahedron(points, young, poisson, density):
    slopes = real([[-1, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    k, determinant = elastic(slopes, slopes.T.dot(points), young, poisson)
    volume = abs(determinant) / 6
    return k * volume, real(np.ones((4, 4), int) + np.eye(4, dtype=int)) * density * volume / 20


def beam(start, end, sides, young, poisson, density):
    """Euler-Bernoulli beam of rectangular section, 12 x 12, consistent mass with rotary inertia; polynomials integrated exactly."""
    along = end - start
    length = sqrt(along.dot(along))
    along = along / length
    up = real([0.1, 0.3, 1])
    up = up - up.dot(along) * along
    up = up / sqrt(up.dot(up))
    axes = np.array([along, up, np.cross(along, up)])
    area, about_z, about_y = sides[0] * sides[1], sides[0] ** 3 * sides[1] / 12, sides[0] * sides[1] ** 3 / 12
    linear = [[1, -1], [0, 1]]
    cubic = [[1, 0, -3, 2], [0, length, -2 * length, length], [0, 0, 3, -2], [0, 0, -length, length]]
    lateral = [[s * c for c in p] for p, s in zip(cubic, (1, -1, 1, -1))]  # ry = -dw/dx
    u, v, w, turn = (0, 6), (1, 5, 7, 11), (2, 4, 8, 10), (3, 9)

    def derivative(p, order=1):
        return p if order == 0 else derivative([i * c for i, c in enumerate(p)][1:], order - 1)

    def added(matrix, rows, functions, order, factor):
        functions = [derivative(p, order) for p in functions]
        for (r, p), (s, q) in itertools.product(zip(rows, functions), repeat=2):
            matrix[r, s] += factor * length ** (1 - 2 * order) * sum(a * b / mpfr(i + j + 1) for i, a in enumerate(p) for j, b in enumerate(q))

    k, m = zeros(12, 12), zeros(12, 12)
    added(k, u, linear, 1, young * area)
    added(k, turn, linear, 1, young / (2 * (1 + poisson)) * (about_y + about_z))
    added(k, v, cubic, 2, young * about_z)
    added(k, w, lateral, 2, young * about_y)
    for rows, functions in ((u, linear), (v, cubic), (w, lateral)):
        added(m, rows, functions, 0, density * area)
    added(m, turn, linear, 0, density * (about_y + about_z))
    added(m, v, cubic, 1, density * about_z)
    added(m, w, lateral, 1, density * about_y)
    to_local = zeros(12, 12)
    for block in range(0, 12, 3):
        to_local[block:block + 3, block:block + 3] = axes
    return to_local.T.dot(k).dot(to_local), to_local.T.dot(m).dot(to_local)


def frame(points, members, sides):
    """Beams between points."""
    body = Body(real(points), 6)
    for start, end in members:
        body.add([start, end], *beam(body.x[start], body.x[end], real(sides), **STEEL))
    return body


def tied(body, first, second, springs):
    """Six springs between two nodes at one place."""
    spring = np.diag(real(springs))
    body.add([first, second], np.block([[spring, -spring], [-spring, spring]]))
    return body
