"""Checks of the equations of a file against those of all nodes. Each returns the largest relative difference."""

import numpy as np

SEED, STATES = 7, 3


class Scale:
    """Sizes of a body: mass, radius of gyration, lowest angular frequency of its modes."""

    def __init__(self, nodes):
        zero = np.zeros(nodes.nf)
        rigid = nodes.mass_matrix(zero)
        self.mass = rigid[0, 0]
        self.length = np.sqrt(np.trace(rigid[3:6, 3:6]) / 2 / self.mass)
        self.extent = np.ptp(nodes.x, 0).max()
        self.stiffness = np.diag(nodes.stiffness) / np.diag(nodes.mass)
        self.first = np.sqrt(self.stiffness.min())
        # Units of generalised forces and accelerations: every entry of a balance over these is of order one.
        force = self.mass * self.length * self.first**2
        self.forces = np.concatenate([np.full(3, force), np.full(3, force * self.length), np.full(nodes.nf, force / np.sqrt(self.mass))])


class State:
    """A random state in which no term of the equations is negligible.

    Deflections are about 2 % of the radius of gyration in the first mode and less in stiffer ones, the spin is about 0.3 of the first frequency.
    """

    def __init__(self, random, scale, nf):
        soft = scale.first / np.sqrt(scale.stiffness)
        amplitude = 0.02 * scale.length * np.sqrt(scale.mass)
        self.q, self.qd = amplitude * soft**2 * random.standard_normal(nf), amplitude * scale.first * soft * random.standard_normal(nf)
        self.qdd = amplitude * scale.first**2 * random.standard_normal(nf)
        self.w = 0.3 * scale.first * random.standard_normal(3)
        unit = 0.1 * scale.length * scale.first**2
        self.a, self.alpha = unit * random.standard_normal(3), 0.1 * scale.first**2 * random.standard_normal(3)
        self.applied = 0.1 * scale.forces * random.standard_normal(6 + nf)
        self.g = unit


def states(scale, nf):
    """Returns the random states, the same for all formats."""
    random = np.random.default_rng(SEED)
    return [State(random, scale, nf) for _ in range(STATES)]


def difference(computed, expected, units):
    """Returns the largest difference of generalised forces relative to the largest expected one, each in its unit."""
    return float(np.abs((computed - expected) / units).max() / np.abs(expected / units).max())


def accelerations(equations, nodes, scale, order, damped=True):
    """Compares accelerations of all nodes and modes at random states (order "exact"), or the forces that a motion takes as series in the amplitude of the modes (other orders).

    Equations of order "rest" are also compared at small motions without angular velocity, and modal forces that are exact (`exact_modal_forces`) at the random states.
    """
    largest = 0.0
    nodes = nodes if damped else nodes.undamped()
    for state in states(scale, nodes.nf):
        if order == "exact":
            expected = nodes.accelerations(state.q, state.w, state.qd, state.applied)
            computed = equations.accelerations(state.q, state.w, state.qd, state.applied)
            field, other = (nodes.nodal(state.q, one, state.w, state.qd) for one in (expected, computed))
            largest = max(largest, float(np.abs(other - field).max() / np.abs(field).max()))
            # The modes that the nodes of the model hardly see.
            largest = max(largest, float(np.abs(computed[6:] - expected[6:]).max() / np.abs(expected[6:]).max()))
        else:
            largest = max(largest, *series(equations, nodes, scale, state, order))
            if equations.exact_modal_forces and not nodes.model.turning:
                motion = state.q, state.w, state.qd, state.a, state.alpha, state.qdd
                computed, expected = equations.balance(*motion), nodes.balance(*motion)
                largest = max(largest, difference(computed[6:], expected[6:], scale.forces[6:]))
            if order == "rest":
                largest = max(largest, *series(equations, nodes, scale, state, "small"))
    return largest


def series(equations, nodes, scale, state, order):
    """Compares the forces at q = q' = q'' = 0, and their derivative by a common amplitude of the modal terms that the order has ("small": the derivative alone, without spin)."""
    zero = np.zeros(nodes.nf)
    q = state.q if order in ("first", "small") else zero
    qd = state.qd if order != "rest" else zero
    w = 0 * state.w if order == "small" else state.w
    rigid = (lambda s: s) if order == "small" else (lambda s: 1.0)

    def slope(one):
        at = lambda s: one.balance(s * q, w, s * qd, rigid(s) * state.a, rigid(s) * state.alpha, s * state.qdd)
        # Central differences of fourth order. The forces are polynomials of at most fourth degree in the amplitude, of which these take the linear term without error.
        h = 0.05
        return (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h)

    if order == "small":
        return (difference(slope(equations), slope(nodes), scale.forces),)
    still = lambda one: one.balance(zero, w, zero, state.a, state.alpha, zero)
    return difference(still(equations), still(nodes), scale.forces), difference(slope(equations), slope(nodes), scale.forces)


def gravity(equations, nodes, scale, order):
    """Compares generalised forces of gravity along three axes: at random q ("exact"), at q = 0 and the derivative by q ("first"), or at q = 0 (other orders)."""
    largest = 0.0
    for state in states(scale, nodes.nf):
        for axis in np.eye(3):
            g = state.g * axis
            if order == "exact":
                pairs = [(equations.gravity(state.q, g), nodes.gravity(state.q, g))]
            else:
                zero = 0 * state.q
                slope = lambda one: one.gravity(0.05 * state.q, g) - one.gravity(-0.05 * state.q, g)
                pairs = [(equations.gravity(zero, g), nodes.gravity(zero, g))]
                if order == "first":
                    pairs.append((slope(equations), slope(nodes)))
            for computed, expected in pairs:
                unit = np.abs(nodes.gravity(0 * state.q, g) / scale.forces).max()
                largest = max(largest, float(np.abs((computed - expected) / scale.forces).max() / unit))
    return largest


def stress(equations, nodes, scale):
    """Compares forces with geometric stiffness, and generalised forces of gravity, to first order in q."""
    found = [one for state in states(scale, nodes.nf) for one in series(equations, nodes, scale, state, "first")]
    return max(*found, gravity(equations, nodes, scale, "first"))


def force(equations, nodes, scale, order):
    """Compares generalised forces of a force along each axis at every interface, at a random q or, for order "rest", at q = 0."""
    return at_interfaces(equations, nodes, scale, 0 if order == "rest" else 1, "force")


def moment(equations, nodes, scale, order):
    """Compares generalised forces of a moment about each axis at every interface. Returns None where the file has no rotation of an interface."""
    return at_interfaces(equations, nodes, scale, 1 if equations.finite_moments else 0, "moment")


def at_interfaces(equations, nodes, scale, amplitude, what):
    """Compares generalised forces of unit loads at all interfaces, at a random q times `amplitude`."""
    largest = 0.0
    q = amplitude * states(scale, nodes.nf)[0].q
    for interface in nodes.model.interfaces:
        place = equations.at(nodes.interface(interface.name)[0], scale.extent)
        for axis in np.eye(3):
            if what == "force":
                computed, expected = equations.force(place, q, axis), nodes.force(interface.name, q, axis)
            else:
                computed, expected = equations.moment(place, q, axis), nodes.moment(interface.name, q, axis, equations.finite_moments)
            if computed is None:
                return None
            largest = max(largest, difference(computed, expected, scale.forces))
    return largest


def deflection(equations, nodes, scale):
    """Compares the motion of an interface under loads on it, another interface held, with the static solution of all nodes without modes.

    Returns None where the file has no rotation of an interface.
    """
    largest = 0.0
    zero = np.zeros(nodes.nf)
    stiffness = np.stack([equations.elastic(e, zero) for e in np.eye(nodes.nf)], 1)
    motions = {}
    for interface in nodes.model.interfaces:
        place = equations.at(nodes.interface(interface.name)[0], scale.extent)
        if place.rotation is None:
            return None
        # Generalised forces of unit forces and moments, six columns.
        unit = [equations.force(place, zero, e) for e in np.eye(3)] + [equations.moment(place, zero, e) for e in np.eye(3)]
        motions[interface.name] = np.stack(unit, 1)
    for held in nodes.model.interfaces:
        for loaded in nodes.model.interfaces:
            if held is loaded:
                continue
            computed = held_motion(stiffness, motions[held.name], motions[loaded.name])
            expected = compliance(nodes, held, loaded)
            diagonal = np.sqrt(np.diag(expected))
            largest = max(largest, float(np.abs((computed - expected) / np.outer(diagonal, diagonal)).max()))
    return largest


def held_motion(stiffness, held, loaded):
    """Returns the motion of `loaded` under unit loads there with the six motions of `held` zero."""
    # The rigid motion that keeps `held` fixed follows from q: held' (rigid, q) = 0.
    follow = -np.linalg.solve(held[:6].T, held[6:].T)
    load = follow.T @ loaded[:6] + loaded[6:]
    return load.T @ np.linalg.solve(stiffness, load)


def compliance(nodes, held, loaded):
    """Returns the motion of `loaded` under unit loads there with `held` fixed, of all nodes, in body axes."""
    turn = np.kron(np.eye(2), nodes.axes)
    return turn.T @ nodes.model.compliance(held, loaded) @ turn


def damping(equations, nodes, scale):
    """Compares damping forces of random modal velocities with those of alpha M + beta K of all nodes."""
    largest, zero = 0.0, np.zeros(nodes.nf)
    for state in states(scale, nodes.nf):
        computed = equations.elastic(zero, state.qd) - equations.elastic(zero, zero)
        expected = nodes.damping @ state.qd
        largest = max(largest, float(np.abs(computed - expected).max() / np.abs(expected).max()))
    return largest


def shapes(nodes, free, wrong):
    """Returns the largest deviation of Psi' M Psi from I and of Psi' K Psi from its diagonal, or of the places of the nodes (`wrong`). Modes that are not `free` have the last alone."""
    mass, stiffness = nodes.mass, nodes.stiffness
    diagonal = np.sqrt(np.diag(stiffness))
    off = stiffness / np.outer(diagonal, diagonal) - np.eye(nodes.nf) if free else np.zeros(1)
    return max(float(np.abs(mass - np.eye(nodes.nf)).max()) if free else 0.0, float(np.abs(off).max()), wrong)


class Coordinates:
    """Expected values for bodies in the coordinates of their interfaces, from the oracle `nodes` of the same body: rigid motion and modes span the same subspace."""

    def __init__(self, nodes):
        self.nodes, self.scale = nodes, Scale(nodes)
        zero = np.zeros(nodes.nf)
        self.mass, nf = nodes.mass_matrix(zero), nodes.nf
        self.stiffness, self.damping = np.zeros((6 + nf, 6 + nf)), np.zeros((6 + nf, 6 + nf))
        self.stiffness[6:, 6:], self.damping[6:, 6:] = nodes.stiffness, nodes.damping
        # Motion of every reference point in (rigid, q).
        rows = []
        for interface in nodes.model.interfaces:
            loads = [nodes.force(interface.name, zero, e) for e in np.eye(3)] + [nodes.moment(interface.name, zero, e) for e in np.eye(3)]
            rows.append(np.stack(loads))
        self.motion = np.vstack(rows)
        # Units of the rows: a translation by the radius of gyration, a rotation by one.
        self.unit = np.tile(np.concatenate([np.full(3, self.scale.length), np.ones(3)]), len(rows))

    def receptance(self, w, damped):
        """Returns the motion of all interfaces under oscillating unit loads there."""
        dynamic = self.stiffness - w * w * self.mass + (1j * w * self.damping if damped else 0)
        return self.motion @ np.linalg.solve(dynamic, self.motion.T)


def small_motion(matrices, oracle, damped, columns=slice(None)):
    """Compares receptances of all interfaces at 0.5, 1.7 and 6 times the lowest frequency of a mode, under loads on the given coordinates of each interface."""
    largest, b = 0.0, matrices.boundary
    for factor in (0.5, 1.7, 6.0):
        w = factor * oracle.scale.first
        dynamic = matrices.k - w * w * matrices.m + (1j * w * matrices.d if damped else 0)
        computed, expected = np.linalg.inv(dynamic)[:b, :b], oracle.receptance(w, damped)
        keep = np.isin(np.arange(b) % 6, np.arange(6)[columns])
        size = np.outer(oracle.unit, oracle.unit)
        largest = max(largest, float(np.abs((computed - expected) / size)[:, keep].max() / np.abs(expected / size)[:, keep].max()))
    return largest


def weight(matrices, oracle):
    """Compares resultant force and moment of gravity along three axes, about the origin of the body frame."""
    largest, nodes = 0.0, oracle.nodes
    for axis in np.eye(3):
        expected = nodes.gravity(np.zeros(nodes.nf), axis)[:6]
        computed = matrices.gravity_rigid(axis)
        size = np.concatenate([np.ones(3), np.full(3, oracle.scale.length)]) * oracle.scale.mass
        largest = max(largest, float(np.abs((computed - expected) / size).max()))
    return largest


def sag(matrices, oracle):
    """Compares the motion of every interface under gravity, another interface held, with the static solution of all nodes without modes."""
    largest, nodes = 0.0, oracle.nodes
    turn = np.kron(np.eye(2), nodes.axes)
    for i, held in enumerate(nodes.model.interfaces):
        for j, watched in enumerate(nodes.model.interfaces):
            if i == j:
                continue
            computed, expected = [], []
            for axis in np.eye(3):
                computed.append(matrices.static(i, matrices.gravity(axis))[6 * j : 6 * j + 6])
                expected.append(turn.T @ nodes.model.sag(held, watched, nodes.axes @ axis)[:, 0])
            computed, expected = np.array(computed) / oracle.unit[:6], np.array(expected) / oracle.unit[:6]
            largest = max(largest, float(np.abs(computed - expected).max() / np.abs(expected).max()))
    return largest


def static(matrices, oracle):
    """Compares the motion of every interface under loads on it, another interface held, with the static solution of all nodes without modes."""
    largest, nodes = 0.0, oracle.nodes
    for i, held in enumerate(nodes.model.interfaces):
        for j, loaded in enumerate(nodes.model.interfaces):
            if i != j:
                expected = compliance(nodes, held, loaded)
                diagonal = np.sqrt(np.diag(expected))
                largest = max(largest, float(np.abs((matrices.compliance(i, j) - expected) / np.outer(diagonal, diagonal)).max()))
    return largest


def points(matrices, oracle):
    """Compares the places of the interfaces, relative to the extent of the body."""
    expected = np.array([oracle.nodes.interface(one.name)[0] for one in oracle.nodes.model.interfaces])
    return float(np.abs(matrices.points - expected).max() / oracle.scale.extent)


def drawn(picture, model, single):
    """Checks the places of the nodes of a picture, and that its modes are orthogonal by M and K.

    Unless the picture is in single precision its modes must be mass-normalised and have the frequencies of the file.
    """
    nodes, wrong = picture.nodes(model)
    mass, stiffness = nodes.mass, nodes.stiffness
    unit = np.eye(nodes.nf)
    size, stiff = np.sqrt(np.diag(mass)), np.sqrt(np.diag(stiffness))
    largest = max(wrong, float(np.abs(mass / np.outer(size, size) - unit).max()), float(np.abs(stiffness / np.outer(stiff, stiff) - unit).max()))
    if not single:
        time = np.abs(np.sqrt(np.diag(stiffness) / np.diag(mass)) / (2 * np.pi * picture.frequency) - 1).max()
        largest = max(largest, float(np.abs(size - 1).max()), float(time))
    return largest
