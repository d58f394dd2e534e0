"""Interface of all readers: equations of motion along body axes with the acceleration a of the frame's origin, the angular acceleration alpha and q'' as unknowns."""

from dataclasses import dataclass

import numpy as np

from .oracle import skew


@dataclass
class Place:
    """A place of the body in a file: its position, and its translation and rotation in every mode (3 x modes). `rotation` is None where the file has none."""

    position: np.ndarray
    translation: np.ndarray
    rotation: np.ndarray = None


class Equations:
    """The equations that a program forms from its file. `places` maps numbers or names to the places of the file."""

    # Order to which the equations of the program hold: "exact"; "first": linear in q, q', q''; "undeformed": at q = 0, linear in q' and q''; "rest": at q = q' = 0,
    # linear in q''; "small": linear in q, q', q'' without angular velocity.
    order = "exact"
    # True if the modal forces of solids are exact at any q although the other equations are of first order.
    exact_modal_forces = False
    # Order to which gravity holds, where it differs from `order`.
    gravity_order = None
    has_damping = True
    has_gravity = True
    # True if a moment does work on the axes exp(theta~) of a place instead of on small rotations.
    finite_moments = False
    # Attributes of a reader that are arrays of its file, with the kind of each (selftest.py).
    ARRAYS = {}

    def mass(self, q):
        """Returns the mass matrix of (a, alpha, q'')."""
        raise NotImplementedError

    def velocity_forces(self, q, w, qd):
        """Returns the terms of the velocities on the left side."""
        raise NotImplementedError

    def elastic(self, q, qd):
        """Returns the modal forces of stiffness and damping on the left side."""
        raise NotImplementedError

    def gravity(self, q, g):
        """Returns the generalised forces of gravity g, given along body axes."""
        raise NotImplementedError

    def force(self, place, q, force):
        """Returns the generalised forces of a force at a place, in body axes."""
        return np.concatenate([force, np.cross(place.position + place.translation @ q, force), place.translation.T @ force])

    def moment(self, place, q, moment):
        """Returns the generalised forces of a moment at a place, or None where the file has no rotation of the place."""
        if place.rotation is None:
            return None
        return np.concatenate([np.zeros(3), moment, place.rotation.T @ moment])

    def balance(self, q, w, qd, a, alpha, qdd):
        """Returns the left side: force, moment about the origin and modal forces that a motion takes."""
        out = self.mass(q) @ np.concatenate([a, alpha, qdd]) + self.velocity_forces(q, w, qd)
        out[6:] += self.elastic(q, qd)
        return out

    def accelerations(self, q, w, qd, applied):
        """Returns (a, alpha, q'') under applied generalised forces."""
        out = applied - self.velocity_forces(q, w, qd)
        out[6:] -= self.elastic(q, qd)
        return np.linalg.solve(self.mass(q), out)

    def at(self, position, extent):
        """Returns the place at a position. Raises LookupError if no place lies there."""
        place = min(self.places.values(), key=lambda place: np.linalg.norm(place.position - position))
        distance = np.linalg.norm(place.position - position)
        if distance > 1e-6 * extent:
            raise LookupError(f"no place within {distance / extent:.1e} of the extent")
        return place


def lagrange(mass, q, w, qd, step):
    """Returns the terms of the velocities for a kinetic energy with the mass matrix mass(q) of (V, w, q'), by the equations of Kirchhoff at V = 0.

    The mass matrix must be quadratic in q: its derivatives are central differences with `step`.
    """
    nf = len(q)
    nu = np.concatenate([np.zeros(3), w, qd])
    slopes = np.stack([(mass(q + step * e) - mass(q - step * e)) / (2 * step) for e in np.eye(nf)])
    momentum = mass(q) @ nu
    out = np.einsum("jab,j,b->a", slopes, qd, nu)
    out[:3] += np.cross(w, momentum[:3])
    out[3:6] += np.cross(w, momentum[3:6])
    out[6:] -= np.einsum("a,jab,b->j", nu, slopes, nu) / 2
    return out


def assemble(mass, first_moment, c1, inertia, coupling, modal):
    """Returns the mass matrix put together from its blocks."""
    lever = skew(first_moment)
    return np.block([[mass * np.eye(3), -lever, c1], [lever, inertia, coupling], [c1.T, coupling.T, modal]])
