"""Shows that the checks can fail: each array of each file is changed in one entry by a thousandth of its size, and a check must exceed its limit.

    python3 tests/peers/suite.py --only "equations can fail"

Sizes are those of the kind of the array: "m" mass, "L" radius of gyration, "s" root of the mass, products of these; "own": the largest entry. Arrays of free modes that are zero, as C1, are
so changed too. Of `embedded` the bytes of each table are changed behind its checksum.
"""

import copy

import numpy as np

from . import bodies, checks, matrices, table

PART = 1e-3
# Tables of the layout of `embedded` (docs/reference/formats/embedded.md): entry, and the kind of their first numbers.
TABLES = {"rigid": 72, "linear": 88, "w2": 104, "w3": 120, "stiffness": 200, "damping": 216, "frame_position": 264, "frame_translation": 280, "frame_rotation": 296}


class Remembered:
    """The oracle with a memory: each result is computed once."""

    def __init__(self, nodes):
        self.nodes, self.memory = nodes, {}

    def __getattr__(self, name):
        value = getattr(self.nodes, name)
        if not callable(value):
            return value

        def call(*arguments):
            key = (name, *(one.tobytes() if isinstance(one, np.ndarray) else one for one in arguments))
            if key not in self.memory:
                found = value(*arguments)
                self.memory[key] = Remembered(found) if name == "undamped" else found
            return self.memory[key]

        return call


def size(kind, value, scale):
    if kind == "own":
        return np.abs(value).max()
    mass, length = scale.mass, scale.length
    return {"m": mass, "L": length, "mL": mass * length, "mL2": mass * length**2, "s": np.sqrt(mass), "sL": np.sqrt(mass) * length, "1": 1.0}[kind]


def changed(equations, path, kind, scale):
    """Returns the equations with the largest entry of an array changed."""
    other = copy.deepcopy(equations)
    *parents, name = path.split(".")
    owner = other
    for parent in parents:
        owner = getattr(owner, parent)
    value = np.array(getattr(owner, name), float)
    at = np.unravel_index(np.argmax(np.abs(value)), value.shape)
    value[at] += PART * size(kind, value, scale)
    setattr(owner, name, value if value.ndim else float(value))
    if hasattr(other, "assemble"):
        other.assemble()
    return other


def moved(equations, scale, what):
    """Returns the equations with the translation or the rotation of the first interface changed."""
    other = copy.deepcopy(equations)
    place = next(iter(other.places.values()))
    value = np.array(getattr(place, what))
    value.flat[np.argmax(np.abs(value))] *= 1 + PART
    setattr(place, what, value)
    return other


def fails(equations, target, body, oracle):
    """Returns the columns that exceed their limits."""
    found = table.checked(equations, target, body, body.source.model, oracle=oracle)
    failing = []
    for column, value in found.items():
        if column not in ("order", "carried", "shapes") and value is not None and not value <= table.limit(target, found, column):
            failing.append(column)
    return failing


def tables(equations, target, body, oracle):
    """Yields the name of each table of `embedded` and the columns that fail after one of its numbers is changed."""
    whole = equations.data.copy()
    start = -equations.data.ctypes.data % 64
    word = lambda at: int.from_bytes(bytes(whole[start + at : start + at + 4]), "little")
    for name, entry in TABLES.items():
        at = word(entry)
        if not at:
            continue
        rows, columns, stride = (word(entry + 4 * k) for k in (1, 2, 3))
        numbers = equations.data[start + at : start + at + stride * columns * np.dtype(equations.type).itemsize].view(equations.type)
        # Of frames the first, which is an interface.
        own = {"frame_position": rows, "frame_translation": 3 * stride, "frame_rotation": 3 * stride}.get(name, len(numbers))
        largest = np.argmax(np.abs(numbers[:own]))
        numbers[largest] *= 1 + PART
        yield name, fails(equations, target, body, oracle)
        equations.data[:] = whole


def fails_in_coordinates(equations, reference):
    """Returns the columns of Chrono and Simscape that exceed their limit."""
    results = {"points": checks.points(equations, reference), "deflection": checks.static(equations, reference), "accelerations": checks.small_motion(equations, reference, False),
               "damping": checks.small_motion(equations, reference, True), "gravity": max(checks.weight(equations, reference), checks.sag(equations, reference))}
    return [column for column, value in results.items() if not value <= table.STIFFNESS]


def run(flexbody, folder):
    """Returns the changes that no check has detected, and the number of changes."""
    bench = table.Bench(flexbody, folder, True)
    body = bench.solid
    missed, made = [], 0
    for target in bodies.targets(bench.dialects):
        equations = body.read(target)
        nodes, wrong = bodies.nodes_of(equations, body, body.source.model)
        scale = checks.Scale(nodes)
        oracle = Remembered(nodes), wrong
        assert not fails(equations, target, body, oracle), target.name
        results = []
        if target.to == "embedded":
            if target.dialect == "double":
                results = list(tables(equations, target, body, oracle))
        else:
            for path, kind in equations.ARRAYS.items():
                results.append((path, fails(changed(equations, path, kind, scale), target, body, oracle)))
            for what in ("translation", "rotation"):
                results.append((f"{what} of an interface", fails(moved(equations, scale, what), target, body, oracle)))
        for name, failing in results:
            made += 1
            if not failing:
                missed.append(f"{target.name}: {name}")
        print(f"  {target.name}: {'; '.join(name + ': ' + ', '.join(failing) for name, failing in results)}", flush=True)
    reference = table.reference(bench, body, body.source.model)
    for target in [bodies.CHRONO, *bodies.SIMSCAPE]:
        whole = body.read(target)
        assert not fails_in_coordinates(whole, reference), target.name
        chrono = isinstance(whole, matrices.Chrono)
        for name in (("file_k", "file_m", "file_d") if chrono else ("k", "m", "d")) + ("points",):
            other = copy.deepcopy(whole)
            value = getattr(other, name).copy()
            value.flat[np.argmax(np.abs(value))] *= 1 + PART
            setattr(other, name, value)
            if chrono:
                other.assemble()
            failing = fails_in_coordinates(other, reference)
            made += 1
            print(f"  {target.name}: {name}: {', '.join(failing)}", flush=True)
            if not failing:
                missed.append(f"{target.name}: {name}")
    return missed, made
