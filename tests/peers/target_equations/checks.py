"""The checks: what a file says beside what all nodes of the model say, each a largest relative difference."""

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
    """A random state in which all terms of the equations are of a size that counts: 2 % of the radius of gyration in every mode as far as its stiffness allows, a spin of 0.3 of the first frequency."""

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
    random = np.random.default_rng(SEED)
    return [State(random, scale, nf) for _ in range(STATES)]


def worst(found, right, scale):
    """Largest difference of generalised forces over the largest of them, each over its unit."""
    scale = scale.forces
    return float(np.abs((found - right) / scale).max() / np.abs(right / scale).max())


def accelerations(equations, nodes, scale, order, damped=True):
    """Exact equations: accelerations of all nodes at random states under random generalised forces. Others: the forces that a motion takes, to the order that the equations have;
    those that hold at rest ("rest") also without angular velocity."""
    found = 0.0
    nodes = nodes if damped else nodes.undamped()
    for state in states(scale, nodes.nf):
        if order == "exact":
            right = nodes.accelerations(state.q, state.w, state.qd, state.applied)
            told = equations.accelerations(state.q, state.w, state.qd, state.applied)
            field, other = (nodes.nodal(state.q, one, state.w, state.qd) for one in (right, told))
            found = max(found, float(np.abs(other - field).max() / np.abs(field).max()))
            # The modes that the nodes of the model hardly see.
            found = max(found, float(np.abs(told[6:] - right[6:]).max() / np.abs(right[6:]).max()))
        else:
            found = max(found, *series(equations, nodes, scale, state, order))
            if order == "rest":
                found = max(found, *series(equations, nodes, scale, state, "small"))
    return found


def series(equations, nodes, scale, state, order):
    """Forces at q = q' = q'' = 0, and what is linear in a common amplitude of these ("first", and without spin "small"), of q' and q'' ("undeformed") or of q'' ("rest")."""
    zero = np.zeros(nodes.nf)
    q = state.q if order in ("first", "small") else zero
    qd = state.qd if order != "rest" else zero
    w = 0 * state.w if order == "small" else state.w
    rigid = (lambda s: s) if order == "small" else (lambda s: 1.0)

    def slope(one):
        at = lambda s: one.balance(s * q, w, s * qd, rigid(s) * state.a, rigid(s) * state.alpha, s * state.qdd)
        # Central differences of fourth order: what is odd in the amplitude beyond the first power is of the fifth.
        h = 0.05
        return (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h)

    if order == "small":
        return (worst(slope(equations), slope(nodes), scale),)
    still = lambda one: one.balance(zero, w, zero, state.a, state.alpha, zero)
    return worst(still(equations), still(nodes), scale), worst(slope(equations), slope(nodes), scale)


def gravity(equations, nodes, scale, order):
    """Generalised forces of gravity along the three axes at random q, or at q = 0 and linear in q ("first")."""
    found = 0.0
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
            for told, right in pairs:
                unit = np.abs(nodes.gravity(0 * state.q, g) / scale.forces).max()
                found = max(found, float(np.abs((told - right) / scale.forces).max() / unit))
    return found


def force(equations, nodes, scale, order):
    """Generalised forces of a force along each axis at every interface, at a random q, or at q = 0 ("rest")."""
    return at_interfaces(equations, nodes, scale, 0 if order == "rest" else 1, "force")


def moment(equations, nodes, scale, order):
    """Generalised forces of a moment about each axis at every interface; None where the file has no rotation of it."""
    return at_interfaces(equations, nodes, scale, 1 if equations.finite_moments else 0, "moment")


def at_interfaces(equations, nodes, scale, amplitude, what):
    found = 0.0
    q = amplitude * states(scale, nodes.nf)[0].q
    for interface in nodes.model.interfaces:
        place = equations.at(nodes.interface(interface.name)[0], scale.extent)
        for axis in np.eye(3):
            if what == "force":
                told, right = equations.force(place, q, axis), nodes.force(interface.name, q, axis)
            else:
                told, right = equations.moment(place, q, axis), nodes.moment(interface.name, q, axis, equations.finite_moments)
            if told is None:
                return None
            found = max(found, worst(told, right, scale))
    return found


def deflection(equations, nodes, scale):
    """Motion of one interface under forces and moments on it while another is held: by K and the places of the file, beside the solution of all nodes without modes."""
    found = 0.0
    zero = np.zeros(nodes.nf)
    stiffness = np.stack([equations.elastic(e, zero) for e in np.eye(nodes.nf)], 1)
    motions = {}
    for interface in nodes.model.interfaces:
        place = equations.at(nodes.interface(interface.name)[0], scale.extent)
        if place.rotation is None:
            return None
        # What does work on a unit force or moment: six columns of generalised forces.
        unit = [equations.force(place, zero, e) for e in np.eye(3)] + [equations.moment(place, zero, e) for e in np.eye(3)]
        motions[interface.name] = np.stack(unit, 1)
    for held in nodes.model.interfaces:
        for loaded in nodes.model.interfaces:
            if held is loaded:
                continue
            told = held_motion(stiffness, motions[held.name], motions[loaded.name])
            right = compliance(nodes, held, loaded)
            diagonal = np.sqrt(np.diag(right))
            found = max(found, float(np.abs((told - right) / np.outer(diagonal, diagonal)).max()))
    return found


def held_motion(stiffness, held, loaded):
    """Motion of `loaded` under unit loads there, with the six motions of `held` zero."""
    # Rigid motion that keeps `held` where it is follows from q: held' (rigid, q) = 0.
    follow = -np.linalg.solve(held[:6].T, held[6:].T)
    load = follow.T @ loaded[:6] + loaded[6:]
    return load.T @ np.linalg.solve(stiffness, load)


def compliance(nodes, held, loaded):
    """The same of all nodes, body axes."""
    turn = np.kron(np.eye(2), nodes.axes)
    return turn.T @ nodes.model.compliance(held, loaded) @ turn


def damping(equations, nodes, scale):
    """Damping forces of random velocities of the modes, beside those of alpha M + beta K of all nodes."""
    found, zero = 0.0, np.zeros(nodes.nf)
    for state in states(scale, nodes.nf):
        told = equations.elastic(zero, state.qd) - equations.elastic(zero, zero)
        right = nodes.damping @ state.qd
        found = max(found, float(np.abs(told - right).max() / np.abs(right).max()))
    return found


def shapes(nodes, free, wrong):
    """Modes at all nodes: Psi' M Psi = I (`free`: of free modes) and Psi' K Psi as the modes are, relative to its diagonal; and the places of the nodes."""
    mass, stiffness = nodes.mass, nodes.stiffness
    diagonal = np.sqrt(np.diag(stiffness))
    off = stiffness / np.outer(diagonal, diagonal) - np.eye(nodes.nf) if free else np.zeros(1)
    return max(float(np.abs(mass - np.eye(nodes.nf)).max()) if free else 0.0, float(np.abs(off).max()), wrong)


class Coordinates:
    """What all nodes say of bodies in the motions of their interfaces: the same subspace by modes and rigid motion, and static solutions without modes. `nodes` is the oracle of the same body."""

    def __init__(self, nodes, damped=True):
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
        dynamic = self.stiffness - w * w * self.mass + (1j * w * self.damping if damped else 0)
        return self.motion @ np.linalg.solve(dynamic, self.motion.T)


def small_motion(matrices, oracle, damped, columns=slice(None)):
    """Motion of all interfaces under oscillating loads there, at half, 1.7 and 6 times the lowest frequency of a mode: K, M (and the damping) of the file beside those of all nodes."""
    found, b = 0.0, matrices.boundary
    for factor in (0.5, 1.7, 6.0):
        w = factor * oracle.scale.first
        dynamic = matrices.k - w * w * matrices.m + (1j * w * matrices.d if damped else 0)
        told, right = np.linalg.inv(dynamic)[:b, :b], oracle.receptance(w, damped)
        keep = np.isin(np.arange(b) % 6, np.arange(6)[columns])
        size = np.outer(oracle.unit, oracle.unit)
        found = max(found, float(np.abs((told - right) / size)[:, keep].max() / np.abs(right / size)[:, keep].max()))
    return found


def weight(matrices, oracle):
    """Resultant force and moment of gravity along the three axes, about the origin of the body frame."""
    found, nodes = 0.0, oracle.nodes
    for axis in np.eye(3):
        right = nodes.gravity(np.zeros(nodes.nf), axis)[:6]
        told = matrices.gravity_rigid(axis)
        size = np.concatenate([np.ones(3), np.full(3, oracle.scale.length)]) * oracle.scale.mass
        found = max(found, float(np.abs((told - right) / size).max()))
    return found


def sag(matrices, oracle):
    """Motion of every interface under gravity while another is held, beside the solution of all nodes without modes."""
    found, nodes = 0.0, oracle.nodes
    turn = np.kron(np.eye(2), nodes.axes)
    for i, held in enumerate(nodes.model.interfaces):
        for j, watched in enumerate(nodes.model.interfaces):
            if i == j:
                continue
            told, right = [], []
            for axis in np.eye(3):
                told.append(matrices.static(i, matrices.gravity(axis))[6 * j : 6 * j + 6])
                right.append(turn.T @ nodes.model.sag(held, watched, nodes.axes @ axis)[:, 0])
            told, right = np.array(told) / oracle.unit[:6], np.array(right) / oracle.unit[:6]
            found = max(found, float(np.abs(told - right).max() / np.abs(right).max()))
    return found


def static(matrices, oracle):
    """Motion of an interface under loads on it while another is held, beside the solution of all nodes without modes."""
    found, nodes = 0.0, oracle.nodes
    for i, held in enumerate(nodes.model.interfaces):
        for j, loaded in enumerate(nodes.model.interfaces):
            if i != j:
                right = compliance(nodes, held, loaded)
                diagonal = np.sqrt(np.diag(right))
                found = max(found, float(np.abs((matrices.compliance(i, j) - right) / np.outer(diagonal, diagonal)).max()))
    return found


def points(matrices, oracle):
    """Places of the interfaces in the body frame, over the extent."""
    right = np.array([oracle.nodes.interface(one.name)[0] for one in oracle.nodes.model.interfaces])
    return float(np.abs(matrices.points - right).max() / oracle.scale.extent)


def drawn(picture, model, single):
    """Places of the nodes and shapes of a picture: Psi' M Psi and Psi' K Psi without what couples two modes; of vtk also mass-normalised, with the frequencies of the file."""
    nodes, wrong = picture.nodes(model)
    mass, stiffness = nodes.mass, nodes.stiffness
    unit = np.eye(nodes.nf)
    size, stiff = np.sqrt(np.diag(mass)), np.sqrt(np.diag(stiffness))
    found = max(wrong, float(np.abs(mass / np.outer(size, size) - unit).max()), float(np.abs(stiffness / np.outer(stiff, stiff) - unit).max()))
    if not single:
        time = np.abs(np.sqrt(np.diag(stiffness) / np.diag(mass)) / (2 * np.pi * picture.frequency) - 1).max()
        found = max(found, float(np.abs(size - 1).max()), float(time))
    return found
