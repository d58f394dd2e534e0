"""What every reader of this folder makes of a file: equations of motion along body axes, with the acceleration of the frame's origin, the angular acceleration and q'' as unknowns."""

from dataclasses import dataclass

import numpy as np

from .oracle import skew


@dataclass
class Place:
    """A place of the file: position, and translation and rotation in every mode (3 x modes); no rotation where the file has none."""

    position: np.ndarray
    translation: np.ndarray
    rotation: np.ndarray = None


class Equations:
    """The equations that a program forms from its file. `places` are all places of the file by their number or name."""

    # How far the equations of the program go: "exact"; "first" order in q, q', q''; "undeformed": at q = 0, linear in q' and q''; "rest": at q = q' = 0, linear in q'';
    # "small": without angular velocity, linear in q, q', q''.
    order = "exact"
    # The same of gravity, where it is another.
    gravity_order = None
    has_damping = True
    has_gravity = True
    # True if a moment acts on the axes exp(theta~) of a place, and not on small rotations.
    finite_moments = False
    # Significant digits of the numbers of the file, as a relative rounding.
    rounding = 0.0
    # What a reader keeps of the arrays of its file, and the kind of each: see selftest.py.
    ARRAYS = {}

    def mass(self, q):
        """Mass matrix of (a, alpha, q'')."""
        raise NotImplementedError

    def velocity_forces(self, q, w, qd):
        """Forces that the velocities take, on the left side."""
        raise NotImplementedError

    def elastic(self, q, qd):
        """Stiffness and damping on the left side, modal forces only."""
        raise NotImplementedError

    def gravity(self, q, g):
        raise NotImplementedError

    def force(self, place, q, force):
        """Generalised forces of a force at a place, body axes."""
        return np.concatenate([force, np.cross(place.position + place.translation @ q, force), place.translation.T @ force])

    def moment(self, place, q, moment):
        """Generalised forces of a moment at a place; None where the file has no rotation of it."""
        if place.rotation is None:
            return None
        return np.concatenate([np.zeros(3), moment, place.rotation.T @ moment])

    def balance(self, q, w, qd, a, alpha, qdd):
        out = self.mass(q) @ np.concatenate([a, alpha, qdd]) + self.velocity_forces(q, w, qd)
        out[6:] += self.elastic(q, qd)
        return out

    def accelerations(self, q, w, qd, applied):
        out = applied - self.velocity_forces(q, w, qd)
        out[6:] -= self.elastic(q, qd)
        return np.linalg.solve(self.mass(q), out)

    def at(self, position, extent):
        """The place nearest to a position, which must be there."""
        place = min(self.places.values(), key=lambda place: np.linalg.norm(place.position - position))
        distance = np.linalg.norm(place.position - position)
        if distance > 1e-6 * extent:
            raise LookupError(f"no place within {distance / extent:.1e} of the extent")
        return place


def lagrange(mass, q, w, qd, step):
    """Forces that the velocities take, of the kinetic energy with the mass matrix mass(q) of (V, w, q'), by the equations of Kirchhoff at V = 0.

    The mass matrix is quadratic in q, so that central differences with any `step` are its derivatives.
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
    """Mass matrix of its blocks."""
    lever = skew(first_moment)
    return np.block([[mass * np.eye(3), -lever, c1], [lever, inertia, coupling], [c1.T, coupling.T, modal]])
