"""Conversion of matrices, nodes and other arguments to the types of the extension module."""

from __future__ import annotations

import json
import numbers as abstract
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import Diagnostic, FlexbodyError, error_of, type_error, value_error

Compressed = tuple[int, NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]

_DIRECTIONS = {2: (1, 2), 3: (1, 2, 3), 6: (1, 2, 3, 4, 5, 6)}


def _read(convert: Callable[[], NDArray[Any]], name: str, expected: str) -> NDArray[Any]:
    """Returns the array of a conversion by numpy, whose exceptions become those of this package."""
    try:
        return convert()
    except (ValueError, OverflowError) as error:
        raise value_error(f"{name} cannot be read as {expected}: {error}") from error
    except TypeError as error:
        raise type_error(f"{name} cannot be read as {expected}: {error}") from error


def compressed(matrix: Any, name: str) -> Compressed:
    """Returns a square matrix with both triangles by compressed columns: rows, pointers, rows of entries, values.

    Accepts every sparse matrix and array of scipy, and everything that numpy converts to a dense matrix.
    """
    if hasattr(matrix, "tocsc"):
        columns = matrix.tocsc()
        _check(columns.shape, columns.dtype, name)
        if not columns.has_canonical_format:
            # The matrix of the caller stays unchanged.
            columns = columns.copy() if columns is matrix else columns
            columns.sum_duplicates()
        pointers, rows = columns.indptr.astype(np.int64), columns.indices.astype(np.int64)
        values = np.ascontiguousarray(columns.data, dtype=np.float64)
    else:
        dense = _read(lambda: np.asarray(matrix), name, "a matrix")
        _check(dense.shape, dense.dtype, name)
        columns, rows = np.nonzero(dense.T)
        values = np.ascontiguousarray(dense[rows, columns], dtype=np.float64)
        pointers = np.concatenate([[0], np.cumsum(np.bincount(columns, minlength=dense.shape[1]))])
        pointers, rows = pointers.astype(np.int64), rows.astype(np.int64)
    size = len(pointers) - 1
    _refuse_one_triangle(pointers, rows, name)
    return size, pointers, np.ascontiguousarray(rows), values


def _check(shape: tuple[int, ...], kind: np.dtype[Any], name: str) -> None:
    if len(shape) != 2 or shape[0] != shape[1]:
        raise value_error(f"{name} has the shape {shape}, expected a square matrix")
    if kind.kind not in "fiub":
        raise type_error(f"{name} has entries of type {kind}, expected real numbers")


def _refuse_one_triangle(pointers: NDArray[np.int64], rows: NDArray[np.int64], name: str) -> None:
    columns = np.repeat(np.arange(len(pointers) - 1), np.diff(pointers))
    above, below = bool(np.any(rows < columns)), bool(np.any(rows > columns))
    if above != below:
        side = "upper" if above else "lower"
        raise value_error(
            f"{name} has only its {side} triangle: give both, {name} + {name}.T - scipy.sparse.diags({name}.diagonal())"
        )


def coordinates(nodes: ArrayLike) -> tuple[NDArray[np.float64], bool]:
    """Returns positions (n x 3), and True if they were given for a plane model (n x 2)."""
    positions = _read(lambda: np.array(nodes, dtype=np.float64), "nodes", "numbers")
    if positions.ndim != 2 or positions.shape[1] not in (2, 3):
        raise value_error(f"nodes have the shape {positions.shape}, expected n x 3, or n x 2 of a plane model")
    plane = positions.shape[1] == 2
    if plane:
        positions = np.column_stack([positions, np.zeros(len(positions))])
    return np.ascontiguousarray(positions), plane


def numbers(node_ids: ArrayLike | None, count: int) -> NDArray[np.int64]:
    """Returns node numbers; positions from 0 if none are given."""
    if node_ids is None:
        return np.arange(count, dtype=np.int64)
    ids = _integers(node_ids, "node_ids")
    if ids.shape != (count,):
        raise value_error(f"node_ids have the shape {ids.shape}, expected ({count},)")
    return ids


def _integers(given: ArrayLike, name: str) -> NDArray[np.int64]:
    array = _read(lambda: np.asarray(given), name, "integers")
    if array.size and array.dtype.kind not in "iu":
        raise type_error(f"{name} are of type {array.dtype}, expected integers of 64 bits")
    if array.dtype.kind == "u" and array.size and array.max() > np.iinfo(np.int64).max:
        raise value_error(f"{name} have the number {array.max()}, expected integers of 64 bits")
    return np.ascontiguousarray(array, dtype=np.int64)


def labels(dofs: ArrayLike | int | None, node_ids: NDArray[np.int64]) -> NDArray[np.int64] | None:
    """Returns node number and direction of every row (N x 2); None if the rows are x, y, z of each node."""
    if dofs is None:
        return None
    if isinstance(dofs, (int, np.integer)):
        if dofs not in _DIRECTIONS:
            raise value_error(f"dofs is {dofs}, expected 2, 3 or 6 for each node, or an array of labels")
        directions = np.array(_DIRECTIONS[int(dofs)])
        each = np.tile(directions, len(node_ids))
        return np.column_stack([np.repeat(node_ids, len(directions)), each]).astype(np.int64)
    array = _integers(dofs, "dofs")
    if array.ndim != 2 or array.shape[1] != 2:
        raise value_error(f"dofs have the shape {array.shape}, expected N x 2: node number and direction of each row")
    if np.any((array[:, 1] < 1) | (array[:, 1] > 6)):
        raise value_error("dofs have a direction that is not 1 to 6: 1, 2, 3 are displacements, 4, 5, 6 rotations")
    return array


def _members(nodes: ArrayLike, name: str, node_ids: NDArray[np.int64], numbered: bool) -> list[int]:
    """Returns the node numbers of an interface, given by a mask, by numbers, or (not `numbered`) by positions."""
    array = _read(lambda: np.asarray(nodes), f"nodes of interface {name!r}", "integers")
    if array.dtype == np.bool_:
        if array.shape != node_ids.shape:
            raise value_error(
                f"the mask of interface {name!r} has the shape {array.shape}, expected {node_ids.shape}: one entry for each node"
            )
        members: list[int] = node_ids[array].tolist()
        return members
    given = _integers(array, f"nodes of interface {name!r}").ravel()
    unknown = given[~np.isin(given, node_ids)]
    if unknown.size:
        named = ", ".join(map(str, unknown[:5].tolist())) + (", ..." if unknown.size > 5 else "")
        what, help_text = (
            ("unknown node numbers", "give numbers of node_ids, or a boolean mask")
            if numbered
            else (
                f"positions outside of 0 to {len(node_ids) - 1}",
                "without node_ids nodes are positions from 0, or a boolean mask; give node_ids for numbers",
            )
        )
        message = f"interface `{name}` names {unknown.size} {what}: {named}"
        raise error_of(2, (Diagnostic("FB209", "error", message, None, None, help_text),))
    found: list[int] = given.tolist()
    return found


def interface_list(
    interfaces: Mapping[str, Any] | None, node_ids: NDArray[np.int64], numbered: bool
) -> list[tuple[str, list[int] | str, str | None, tuple[float, float, float] | None]]:
    """Returns name, nodes (numbers, or the text of a region), coupling and reference point of every interface."""
    found: list[tuple[str, list[int] | str, str | None, tuple[float, float, float] | None]] = []
    if interfaces is not None and not isinstance(interfaces, Mapping):
        raise type_error(f"interfaces are of type {type(interfaces).__name__}, expected a mapping of name to nodes")
    for name, given in (interfaces or {}).items():
        if not isinstance(name, str):
            raise type_error(f"the name {name!r} of an interface is of type {type(name).__name__}, expected str")
        nodes, coupling, reference = given, None, None
        if isinstance(given, tuple) and len(given) in (2, 3) and isinstance(given[1], (str, type(None))):
            nodes, coupling = given[0], given[1]
            reference = given[2] if len(given) == 3 else None
        ids = nodes if isinstance(nodes, str) else _members(nodes, name, node_ids, numbered)
        if reference is not None:
            place = f"the reference point of interface {name!r}"
            point = _read(lambda: np.asarray(reference, dtype=np.float64), place, "numbers")
            if point.shape != (3,):
                raise value_error(f"{place} has the shape {point.shape}, expected (3,)")
            reference = (float(point[0]), float(point[1]), float(point[2]))
        found.append((name, ids, coupling, reference))
    return found


def set_list(interfaces: Mapping[str, Any] | None) -> list[tuple[str, str, str | None]]:
    """Returns name, node set and coupling of every interface of a job."""
    if interfaces is not None and not isinstance(interfaces, Mapping):
        raise type_error(f"interfaces are of type {type(interfaces).__name__}, expected a mapping of name to node set")
    found = []
    for name, given in (interfaces or {}).items():
        words = given if isinstance(given, tuple) else (given, None)
        if len(words) != 2 or not isinstance(name, str) or not isinstance(words[0], str):
            raise type_error(f"interface {name!r} is {given!r}, expected a node set, or a tuple of it and a coupling")
        found.append((name, words[0], words[1]))
    return found


def unit_names(units: Any) -> tuple[str, str, str] | None:
    """Returns units of length, mass and time; a number is a factor to SI."""
    if units is None:
        return None
    if not isinstance(units, Iterable):
        raise type_error(f"units are of type {type(units).__name__}, expected three, as in ('mm', 't', 's')")
    given = units.split(",") if isinstance(units, str) else list(units)
    if len(given) != 3:
        raise value_error(f"units are {units!r}, expected three: length, mass, time, as in ('mm', 't', 's')")
    length, mass, time = (str(unit).strip() for unit in given)
    return length, mass, time


def _real(given: Any, name: str) -> float:
    """Returns a number; numpy's count as numbers, texts do not."""
    if not isinstance(given, (abstract.Real, np.bool_)):
        raise type_error(f"{name} is {given!r}, expected a number")
    try:
        return float(given)
    except OverflowError as error:
        raise value_error(f"{name} is too large for a number of 64 bits") from error


def damping_of(damping: Any) -> Any:
    """Returns a ratio, the two numbers of Rayleigh damping, bands of ratios, or a compressed matrix."""
    if damping is None:
        return None
    if isinstance(damping, abstract.Real):
        return _real(damping, "damping")
    if isinstance(damping, tuple) and len(damping) == 2:
        return _real(damping[0], "alpha of damping"), _real(damping[1], "beta of damping")
    if isinstance(damping, list) and damping and all(isinstance(band, tuple) and len(band) == 2 for band in damping):
        end, ratio = "an end of a band of damping", "a ratio of damping"
        return [(np.inf if to is None else _real(to, end), _real(own, ratio)) for to, own in damping]
    return compressed(damping, "damping")


def damping_text(damping: Any) -> Any:
    """Returns the damping of a job as `--damping` has it: a ratio, Rayleigh damping, bands, or the file of a matrix."""
    if damping is None:
        return None
    if isinstance(damping, (str, os.PathLike)):
        return f"matrix={os.fspath(damping)}"
    given = damping_of(damping)
    if isinstance(given, float):
        return repr(given)
    if isinstance(given, tuple) and len(given) == 2:
        return f"rayleigh={given[0]!r},{given[1]!r}"
    if isinstance(given, list):
        return "bands=" + ",".join(repr(ratio) if np.isinf(end) else f"{end!r}:{ratio!r}" for end, ratio in given)
    raise value_error("damping of a job is a ratio, a tuple (alpha, beta), a list of bands or the file of a matrix")


def residual_loads(names: Any) -> tuple[bool, bool]:
    """Returns two flags for residual vectors: loads at interfaces, and centrifugal loads."""
    if not isinstance(names, Iterable):
        raise type_error(f"residual_vectors are {names!r}, expected 'interfaces', 'centrifugal' or both")
    given = [names] if isinstance(names, str) else list(names)
    unknown = [name for name in given if name not in ("interfaces", "centrifugal")]
    if unknown:
        raise value_error(f"residual_vectors are {given}, expected 'interfaces', 'centrifugal' or both")
    return "interfaces" in given, "centrifugal" in given


def _plain(value: Any) -> Any:
    """Returns a value of a scene as JSON has it."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, Mapping):
        return dict(value)
    raise type_error(f"the scene has {value!r} of type {type(value).__name__}, expected numbers, texts, lists and dicts")


def json_of_scene(scene: Mapping[str, Any]) -> str:
    """Returns the JSON of a scene that is given as a dict."""
    try:
        return json.dumps(dict(scene), default=_plain, allow_nan=False)
    except FlexbodyError:
        raise
    except (ValueError, RecursionError) as error:
        raise value_error(f"the scene cannot be read as values: {error}") from error
    except TypeError as error:
        raise type_error(f"the scene cannot be read as values: {error}") from error
