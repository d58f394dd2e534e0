"""Types of arguments, and tuples of arrays that bodies and motions consist of."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple, Protocol, TypeAlias, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

Path: TypeAlias = Union[str, "os.PathLike[str]"]
"""Path of a file or a folder."""

Basis: TypeAlias = Literal["free", "craig-bampton", "craig-chang", "scene"]
"""Basis of the modes."""
Accuracy: TypeAlias = Literal["fast", "standard", "certified"]
"""Accuracy of the modes."""
Frame: TypeAlias = Union[Literal["com", "principal", "model"], str]
"""Body frame; also "interface=NAME"."""
Coupling: TypeAlias = Literal["rigid", "averaging", "free"]
"""Coupling of an interface to its reference point."""
Reference: TypeAlias = Literal["full", "fine", "nodal"]
"""Reference motion of a trade study."""
StressLoads: TypeAlias = Union[Literal["none", "spin", "interfaces", "loads", "spin,interfaces"], str]
"""Loads whose stress stiffness is computed, separated by commas."""
ResidualLoads: TypeAlias = Literal["interfaces", "centrifugal"]
"""Loads whose static responses join free modes."""

Length: TypeAlias = Literal["m", "mm", "cm", "um", "km", "in", "ft"]
"""Unit of length."""
Mass: TypeAlias = Literal["kg", "g", "t", "tonne", "lb", "slug", "slinch"]
"""Unit of mass."""
Time: TypeAlias = Literal["s", "ms", "us"]
"""Unit of time."""
Units: TypeAlias = Union[tuple[Union[Length, float], Union[Mass, float], Union[Time, float]], str]
"""Units of length, mass and time; a number is a factor to SI. Also a text with commas, as in "mm,t,s"."""

ExportFormat: TypeAlias = Literal[
    "exudyn",
    "sid",
    "mbdyn",
    "mbsim",
    "openradioss",
    "chrono",
    "simscape",
    "adams-invariants",
    "npz",
    "json",
    "embedded",
    "vtk",
    "gltf",
]
"""Format that `Body.export` writes."""
Dialect: TypeAlias = Literal[
    "fembs",
    "morembs",
    "py-sid",
    "fembeam",
    "embs",
    "level19",
    "level13",
    "mat5",
    "hdf5",
    "json",
    "text",
    "double",
    "float",
]
"""Dialect of a format; each format has its own."""
ImportFormat: TypeAlias = Literal["sid", "mbdyn", "mbsim", "exudyn"]
"""Format that `import_body` and `audit` read."""
Program: TypeAlias = Literal["calculix", "abaqus", "nastran"]
"""FE program whose jobs are read."""
RecipeProgram: TypeAlias = Literal["calculix", "abaqus", "ansys", "nastran"]
"""FE program with a recipe."""
Points: TypeAlias = Union[Literal["nodes", "interfaces"], str, Sequence[int]]
"""Places of a body in a file; also numbers of nodes in a text, as in "interfaces,17,23"."""


class SupportsTocsc(Protocol):
    """A sparse matrix or array of scipy."""

    def tocsc(self) -> Any:
        """Returns the matrix in compressed columns."""


Matrix: TypeAlias = Union[SupportsTocsc, ArrayLike]
"""A sparse matrix or array of scipy, or a dense array."""
Nodes: TypeAlias = Union[Sequence[int], "NDArray[Any]", str]
"""Nodes by number or position, a boolean mask, or the text of a region as in "cylinder:0/0/0:0/0/10:5"."""
InterfaceNodes: TypeAlias = Union[
    Nodes, tuple[Nodes, Union[Coupling, None]], tuple[Nodes, Union[Coupling, None], Union[ArrayLike, None]]
]
"""Nodes of an interface, or a tuple of these, a coupling, and perhaps a reference point (3)."""
Damping: TypeAlias = Union[float, tuple[float, float], list[tuple[Union[float, None], float]], Matrix]
"""A ratio, (alpha, beta), ratios by frequency, or a matrix."""
JobDamping: TypeAlias = Union[float, tuple[float, float], list[tuple[Union[float, None], float]], Path]
"""A ratio, (alpha, beta), ratios by frequency, or the file of a matrix."""
Attached: TypeAlias = Union[float, tuple[float, str]]
"""Attached mass, or a tuple of it and the interface that carries it."""
Places: TypeAlias = Union[str, int, Sequence[Union[str, int]]]
"""Places of a frequency response: interfaces or numbers of nodes, perhaps with directions, as in "tip:z"."""
History: TypeAlias = Union[Path, Mapping[str, Any]]
"""A run of any program: the path of a table, or a dict of time, q, angular_velocity, loads and others (`Body.recover`)."""


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


class TransferFunction(NamedTuple):
    """The response at one place to a unit force at another, over n frequencies, in the units of the body and radians."""

    source: str
    """Place of the force: "interface tip", "node 17"."""
    source_direction: str
    """Direction of the force or torque: "x", "y", "z", "rx", "ry" or "rz"; "amplitude" of a named load."""
    target: str
    """Place of the displacement: "interface tip", "node 17"."""
    target_direction: str
    """Direction of the displacement or rotation."""
    reduced: NDArray[np.complex128]
    """Response of the body (n)."""
    full: NDArray[np.complex128]
    """Response of all nodes (n); nan where their equations were not solved."""


class ComparisonRow(NamedTuple):
    """A quantity that two bodies are compared in."""

    quantity: str
    meaning: str
    """Reference value that the difference is divided by, in words."""
    difference: float
    """Largest difference, relative."""
    tolerance: float
    """Largest difference that passes."""
    passed: bool


class RowLabel(NamedTuple):
    """The label of a row of a recovery."""

    name: str
    quantity: str
    """"stress", "strain", "force", "moment", "displacement" or "other"."""
    component: str
    """"xx", "yy", ... or any other text."""
    unit: str
    """Unit of the values; empty for a pure number."""
    node: int | None
    """Number of the node that the row belongs to."""
    element: int | None
    """Number of the element that the row belongs to."""


class RecoveredRows(NamedTuple):
    """The rows of a recovery over nt instants."""

    labels: list[RowLabel]
    """Label of every row."""
    values: NDArray[np.float64]
    """Values (nt x rows), in the units of the labels."""
    points: list[str]
    """Names of the points with all six stresses among the rows."""
    von_mises: NDArray[np.float64]
    """Equivalent stress of von Mises (nt x points)."""
    signed_von_mises: NDArray[np.float64]
    """The same with the sign of the principal stress of the largest magnitude (nt x points)."""
    principal: NDArray[np.float64]
    """Principal stresses, the largest first (nt x points x 3)."""
