"""Exact flexible bodies for multibody simulation from finite element mass and stiffness matrices.

    body = flexbody.convert(K, M, nodes, units=("m", "kg", "s"), modes=20)
    body.write("body.flex.h5")

K and M are sparse matrices of scipy (or dense ones), with both triangles, of the free body, with the
consistent mass. Arrays come back as numpy arrays, in the units of the model. Long work releases the lock of
the interpreter, and Ctrl-C ends it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, overload

from numpy.typing import ArrayLike

from . import _inputs, _types
from ._errors import (
    ArgumentError,
    CheckError,
    Diagnostic,
    FlexbodyError,
    FlexbodyWarning,
    InputError,
    InternalError,
    NumericalError,
    ResourceError,
    type_error,
)
from ._flexbody import (
    Audit,
    Batch,
    Body,
    Channels,
    Check,
    Comparison,
    EquationsOfMotion,
    Model,
    Motion,
    Point,
    Recovered,
    Response,
    Scene,
    Selection,
    Trade,
    View,
    __version__,
    audit,
    batch,
    explain,
    export_formats,
    import_body,
    read,
    recipe,
)
from ._types import (
    ComparisonRow,
    Identity,
    Interface,
    InterfaceCoordinates,
    PointPath,
    RecoveredRows,
    RowLabel,
    TransferFunction,
)

__all__ = [
    "ArgumentError",
    "Audit",
    "Batch",
    "Body",
    "Channels",
    "Check",
    "CheckError",
    "Comparison",
    "ComparisonRow",
    "Diagnostic",
    "EquationsOfMotion",
    "FlexbodyError",
    "FlexbodyWarning",
    "Identity",
    "InputError",
    "Interface",
    "InterfaceCoordinates",
    "InternalError",
    "Model",
    "Motion",
    "NumericalError",
    "Point",
    "PointPath",
    "Recovered",
    "RecoveredRows",
    "ResourceError",
    "Response",
    "RowLabel",
    "Scene",
    "Selection",
    "Trade",
    "TransferFunction",
    "View",
    "__version__",
    "audit",
    "batch",
    "convert",
    "explain",
    "export_formats",
    "import_body",
    "model",
    "read",
    "read_model",
    "recipe",
]


def model(
    stiffness: _types.Matrix,
    mass: _types.Matrix,
    nodes: ArrayLike,
    *,
    name: str = "model",
    node_ids: ArrayLike | None = None,
    dofs: ArrayLike | int | None = None,
    interfaces: Mapping[str, _types.InterfaceNodes] | None = None,
    units: _types.Units | None = None,
    damping: _types.Damping | None = None,
    residual_vectors: _types.ResidualLoads | Sequence[_types.ResidualLoads] = (),
    allow_implausible: bool | Sequence[str] = False,
    keep_soft_rotations: bool = False,
) -> Model:
    """Creates a finite element model from matrices and checks it.

    Parameters
    ----------
    stiffness, mass
        K and M (N x N) of the free body, real and symmetric, both triangles: any sparse matrix or array of
        scipy, or a dense array. M is the consistent mass matrix.
    nodes
        Positions of the nodes (n x 3), of a plane model (n x 2). Unit: length.
    node_ids
        Numbers of the nodes (n). Without, the number of a node is its position from 0, as numpy counts: in
        `dofs` and `interfaces`, in scenes and files, and for `EquationsOfMotion.node`.
    dofs
        Node number (without `node_ids` its position from 0) and direction of every row (N x 2), directions 1, 2, 3 being displacements along x, y, z
        and 4, 5, 6 rotations about them. A number 2, 3 or 6 for so many directions of every node, node by
        node. Without: x, y, z of every node, node by node (in the plane x, y).
    interfaces
        Sets of nodes that joints and loads act on: name to nodes, or to a tuple of these with a coupling
        ("rigid", "averaging", "free") and perhaps a reference point (3) in model axes; without one it is the
        mean of the nodes. With `node_ids` nodes are given by their numbers, without by positions from 0 (as
        `numpy.flatnonzero` has them); in both cases also by a boolean mask (n), or as a region in the words of
        `--interface`: "box:X/Y/Z:X/Y/Z", "cylinder:X/Y/Z:X/Y/Z:R", "plane:X/Y/Z:X/Y/Z:WITHIN", "nearest:X/Y/Z:COUNT".
    units
        Units of length, mass and time, as in ("mm", "t", "s"); a number is a factor to SI. Without, they are
        m, kg, s; an implausible density in these units is a warning.
    damping
        A damping ratio for all modes (1 is critical), a tuple (alpha, beta) for D = alpha M + beta K in 1/time
        and time, ratios by frequency as a list of tuples (end of the band in Hz, ratio), the last with the end
        None, as in [(100, 0.01), (1000, 0.1), (None, 1.0)], or a matrix D with the rows of K in mass/time.
    residual_vectors
        Loads whose static responses join free modes: "interfaces", "centrifugal", or both in a list.
    allow_implausible
        Codes of the checks whose findings are warnings instead of errors: FB437 (density, speed of sound), FB433 (mass
        coupling between nodes without stiffness), FB460 (stresses that contradict the stiffness), FB410 (rotations that
        strain the stiffness while translations do not). True for the first three.
    keep_soft_rotations
        True to leave rotations that only elements that are not quite coplanar hold as K has them, instead of making
        them follow the nodes around them.

    Raises
    ------
    InputError
        If matrices, nodes or interfaces are invalid; has all findings. It is a ValueError; for an argument of a
        wrong type an ArgumentError, which is also a TypeError.
    """
    if not isinstance(name, str):
        raise type_error(f"name is of type {type(name).__name__}, expected str")
    positions, plane = _inputs.coordinates(nodes)
    ids = _inputs.numbers(node_ids, len(positions))
    return Model._assembled(
        name,
        _inputs.compressed(stiffness, "stiffness"),
        _inputs.compressed(mass, "mass"),
        ids,
        positions,
        plane=plane,
        dofs=_inputs.labels(dofs, ids),
        interfaces=_inputs.interface_list(interfaces, ids, node_ids is not None),
        units=_inputs.unit_names(units),
        damping=_inputs.damping_of(damping),
        residual_vectors=_inputs.residual_loads(residual_vectors),
        allow_implausible=allow_implausible if isinstance(allow_implausible, bool) else list(allow_implausible),
        keep_soft_rotations=keep_soft_rotations,
    )


def read_model(
    path: _types.Path,
    *,
    program: _types.Program | None = None,
    units: _types.Units | None = None,
    interfaces: Mapping[str, str | tuple[str, _types.Coupling | None]] | None = None,
    damping: _types.JobDamping | None = None,
) -> Model:
    """Reads a model: a manifest (`model.toml`, docs/reference/input.md), or the files of an FE program
    (docs/how_to/import_modes.md), whose deck is `path`.

    Parameters
    ----------
    program
        Name of the FE program as on the command line; by default it is detected from the files.
    units
        Units of length, mass and time of a job, as in ("mm", "t", "s").
    interfaces
        Name to the node set of the deck that it is (or a region, as for `model`), or to a tuple of it and a coupling.
    damping
        Damping of a job: a ratio, a tuple (alpha, beta) or a list of bands as for `model`, or the file of a damping matrix.

    Raises
    ------
    InputError
        If the files or the model are invalid; has all findings.
    """
    return Model._read(path, program, _inputs.unit_names(units), _inputs.set_list(interfaces), _inputs.damping_text(damping))


@overload
def convert(
    stiffness: _types.Matrix,
    mass: _types.Matrix,
    nodes: ArrayLike,
    *,
    modes: int | None = None,
    max_frequency: float | None = None,
    basis: _types.Basis = "free",
    accuracy: _types.Accuracy = "standard",
    frame: _types.Frame = "com",
    comparators: bool = True,
    geometric_stiffness: _types.StressLoads = "none",
    scene: Scene | Sequence[Scene] | Mapping[str, Any] | _types.Path | None = None,
    allow_unjudged: bool = False,
    name: str = "model",
    node_ids: ArrayLike | None = None,
    dofs: ArrayLike | int | None = None,
    interfaces: Mapping[str, _types.InterfaceNodes] | None = None,
    units: _types.Units | None = None,
    damping: _types.Damping | None = None,
    residual_vectors: _types.ResidualLoads | Sequence[_types.ResidualLoads] = (),
    allow_implausible: bool | Sequence[str] = False,
    keep_soft_rotations: bool = False,
) -> Body: ...


@overload
def convert(
    stiffness: Model | _types.Path,
    mass: None = None,
    nodes: None = None,
    *,
    modes: int | None = None,
    max_frequency: float | None = None,
    basis: _types.Basis = "free",
    accuracy: _types.Accuracy = "standard",
    frame: _types.Frame = "com",
    comparators: bool = True,
    geometric_stiffness: _types.StressLoads = "none",
    scene: Scene | Sequence[Scene] | Mapping[str, Any] | _types.Path | None = None,
    allow_unjudged: bool = False,
    program: _types.Program | None = None,
    units: _types.Units | None = None,
    interfaces: Mapping[str, str | tuple[str, _types.Coupling | None]] | None = None,
) -> Body: ...


def convert(
    stiffness: Any,
    mass: Any = None,
    nodes: ArrayLike | None = None,
    *,
    modes: int | None = None,
    max_frequency: float | None = None,
    basis: _types.Basis = "free",
    accuracy: _types.Accuracy = "standard",
    frame: _types.Frame = "com",
    comparators: bool = True,
    geometric_stiffness: _types.StressLoads = "none",
    scene: Any = None,
    allow_unjudged: bool = False,
    **of_model: Any,
) -> Body:
    """Converts a model to a flexible body.

    The model is that of K, M and nodes, as `flexbody.model` takes them, or of a file, as
    `flexbody.read_model` reads it: `convert(K, M, nodes)` or `convert("model.toml")`. Further keywords are
    those of these two.

    Parameters
    ----------
    modes
        Number of flexible modes; 20 without.
    max_frequency
        All modes below a frequency instead. Unit: Hz.
    basis
        "free", "craig-bampton", "craig-chang" (with interfaces), "scene" (with a scene).
    accuracy
        "fast"; "standard" proves that no mode is missing; "certified" guarantees bounds.
    frame
        Body frame: "com" (at the centre of mass, along the axes of the model), "principal" (there, along the
        principal axes of inertia), "model", or "interface=NAME" (on the reference point of an interface, which
        then rests in every mode).
    comparators
        True to compute the results of lumped masses for comparison.
    geometric_stiffness
        Loads whose stress stiffness is computed from the elements of the deck, separated by commas: "spin",
        "interfaces" (unit forces and moments), "loads" (named loads); or "none". The assembled stiffness of the
        elements has to be K (FB462).
    scene
        A Scene, a list of load cases, or a scene as `flexbody.Scene` takes it (the path of a file, a text, a
        dict), for a body with the terms and modes alone that it needs.
    allow_unjudged
        True to return the body although the selection for its scene does not hold, or cannot be judged (FB557).

    Raises
    ------
    InputError, NumericalError, ResourceError
        Invalid input, as for `flexbody.model`; modes that cannot be trusted; not enough memory.
    """
    if mass is None and nodes is None:
        if isinstance(stiffness, Model):
            if of_model:
                raise type_error(f"{', '.join(of_model)} cannot be given together with a Model, which states them")
            made = stiffness
        else:
            made = read_model(stiffness, **of_model)
    elif mass is None or nodes is None:
        raise type_error("convert has some of K, M and nodes, expected all three, or one file or Model")
    else:
        made = model(stiffness, mass, nodes, **of_model)
    return made.convert(
        modes=modes,
        max_frequency=max_frequency,
        basis=basis,
        accuracy=accuracy,
        frame=frame,
        comparators=comparators,
        geometric_stiffness=geometric_stiffness,
        scene=scene,
        allow_unjudged=allow_unjudged,
    )
