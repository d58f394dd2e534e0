"""Tuples of arrays that bodies and motions consist of."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Interface(NamedTuple):
    """A set of nodes that joints and loads act on, along body axes."""

    node_ids: NDArray[np.int64]
    """Node numbers."""
    coupling: str | None
    """"rigid", "averaging", "free", or None if it was not stated."""
    reference: NDArray[np.float64] | None
    """Reference point (3); None of a free interface. Unit: length."""
    translation: NDArray[np.float64] | None
    """Displacement of the reference point in each mode (3 x nf). Unit: 1/sqrt(mass)."""
    rotation: NDArray[np.float64] | None
    """Rotation of the reference point (3 x nf); None if the nodes determine none. Unit: 1/(length sqrt(mass))."""


class InterfaceCoordinates(NamedTuple):
    """K and M in the coordinates of a Craig-Bampton body at its interfaces, along body axes."""

    names: list[str]
    """Names of the nc coordinates."""
    stiffness: NDArray[np.float64]
    """K (nc x nc)."""
    mass: NDArray[np.float64]
    """M (nc x nc)."""
    of_modes: NDArray[np.float64]
    """B (nc x nf): coordinates B @ q for the modal coordinates q."""


class PointPath(NamedTuple):
    """The path of a watched point, a row for each instant."""

    place: NDArray[np.float64]
    """Places, world axes (nt x 3). Unit: length."""
    deflection: NDArray[np.float64]
    """Deflections from the undeformed body, along the axes of the frame (nt x 3). Unit: length."""
    velocity: NDArray[np.float64]
    """Velocities, world axes (nt x 3). Unit: length/time."""
    acceleration: NDArray[np.float64]
    """Accelerations, world axes (nt x 3). Unit: length/time^2."""


class Identity(NamedTuple):
    """An identity that the numbers of every body fulfil (docs/theory.md, section 10)."""

    name: str
    value: float
    """Relative deviation."""
    limit: float
    """Largest allowed deviation."""
    holds: bool
