"""Runs all checks on all formats. Each check has a limit with its reason; the result is the table of evidence/pages/exports.md."""

import re
import subprocess
from dataclasses import dataclass

import numpy as np

import common
from common import Absent, Row

from . import bodies, checks

COLUMNS = ["shapes", "accelerations", "gravity", "force", "moment", "deflection", "damping", "units", "frames", "carried frames", "rotations", "geometric stiffness"]
# Limits and their reasons. Numbers of a file have 15 to 17 digits; forces and accelerations are sums of some thousands of products of them.
ROUNDING = 1e-10
# Static solutions, and K of the modes: rigid motion strains the matrices of the fixtures, which have 14 digits, by 1e-10 of the first mode.
STIFFNESS = 1e-8
# openradioss: fields of 16 columns have 11 to 15 digits, of numbers about the ends of axes of length one.
FIELDS_OF_16 = 1e-8
# Numbers of 24 bits: eight roundings of the largest.
SINGLE = 1e-6
# Solutions with the mass matrix of a body, whose condition is up to a thousand, and differences over amplitudes of a twentieth, in numbers of 24 bits.
SINGLE_SOLVED = 1e-4

SOLID = [("bolt_base", "rigid", [42.0, 24.0, 10.0], None), ("bolt_wall", "averaging", [6.0, 24.0, 38.0], None)]
BEAMS = [(name, "rigid", None, None) for name in ("front_left", "front_right", "rear_left", "rear_right")]
BLADE = [("root", "rigid", [0.0, 0.0, 5.0], None), ("tip", "averaging", [0.0, 2.0, 170.0], None)]
SHELLS = [("corner", "rigid", None, [1]), ("fold", "averaging", [0.15, 0.1, 0.0], [9, 10, 11, 20, 21])]
REGION = [("weight", "rigid", None, [500]), ("end", "averaging", [-0.01, 0.08, 0.05], list(range(1, 12)))]

MARKS = {"first": "a", "undeformed": "b", "rest": "c", "small": "d"}
NOTES = {
    "a": "To first order in q, q' and q'', at any angular velocity: SID has mdCM, J and Cr to first order (modal forces of solids are exact, and compared at the random states), and the kinetic energy of nodes that turn is of second order in q and q' ([6.2a](../../docs/theory.md)).",
    "b": "At q = 0, to first order in q' and q'': the format has no stiffness of inertia of nodes that turn. mbdyn has it, and is compared so for beams and shells only: their mass has a symmetric part of W3, for which it has no place.",
    "c": "At q = q' = 0 at any angular velocity, and without angular velocity to first order: the engine has no terms of angular velocity with q and q'.",
    "d": "To first order without angular velocity: the file has no groups 14 to 18.",
    "e": "Small motions at rest: receptances between all interfaces at three frequencies. The column of gravity has its resultants and the deflection under it.",
    "f": "Gravity acts on masses that the deck gives to the nodes.",
    "g": "Exudyn has Rayleigh damping only, an argument of `AddObjectFFRFreducedOrder`.",
    "h": "Angles between the modes: each is drawn with a factor of its own, in single precision, in metres whatever the units of the body are.",
    "i": "The moment acts on the axes $e^{\\tilde\\theta}$ at a random q ([6.8](../../docs/theory.md)).",
    "j": "Refused (FB720).",
    "l": "At q = 0: Exudyn takes the moment of the undeformed centre of mass.",
    "k": "Without groups 14 to 18 the modes of such a body do not move its centre of mass. `export` refuses it.",
}


@dataclass
class Cell:
    """An entry of the table: the largest difference and its limit, or no number where the format has no place for it. `marks` are those of footnotes."""

    found: float = None
    limit: float = 0.0
    marks: str = ""

    def good(self):
        return self.found is None or self.found <= self.limit

    def text(self):
        marks = "".join(f"<sup>{mark}</sup>" for mark in self.marks)
        if self.found is None:
            return "not held" + marks
        number = f"{self.found:.0e}"
        return (number if self.good() else f"**{number}**") + marks


NOT_HELD = Cell()


class Bench:
    """The bodies of a run. A quick run, for CI, has fewer of them."""

    def __init__(self, flexbody, folder, quick):
        self.flexbody, self.folder, self.quick = flexbody, folder, quick
        self.told = subprocess.run([str(flexbody), "convert", "--help"], capture_output=True, text=True).stdout
        solid = bodies.Source(folder, "bracket_hex20", SOLID, 6, damped=True)
        region = bodies.Source(folder, "mpc_block", REGION, 6, damped=True)
        make = lambda source, frame: bodies.Body(flexbody, source, frame, folder)
        self.solid, self.region = make(solid, "com"), make(region, "com")
        self.dialects = [name for name in bodies.sid.DIALECTS if self.has_dialect(name)]
        # One unit of the model in m and kg.
        self.other = solid.model.scaled(1e-3, 1e3)
        self.frames, self.carried, self.turning, self.stressed = [], [], [self.region], []
        # Bodies that the program refuses to make, which is a failure.
        self.refusals = []
        if not quick:
            self.frames = [make(solid, "principal"), make(solid, "model"), make(region, "model")]
            beams = bodies.Source(folder, "car_frame", BEAMS, 3, damped=True)
            shells = bodies.Source(folder, "shell_folded", SHELLS, 6, damped=True)
            blade = bodies.Source(folder, "turbine_blade", BLADE, 4, damped=True)
            self.stressed = [make(blade, "com"), make(blade, "principal")]
            self.turning += [make(beams, "com"), make(beams, "principal"), make(shells, "model")]
        if "interface=" in self.told:
            wanted = [(solid, "bolt_base")]
            if not quick:
                self.stressed += [make(blade, "interface=root")]
                wanted += [(solid, "bolt_wall"), (region, "end"), (region, "weight"), (beams, "front_left"), (shells, "fold")]
            for source, name in wanted:
                try:
                    self.carried.append(make(source, f"interface={name}"))
                except RuntimeError as refusal:
                    self.refusals.append(f"`{source.folder.name}`, `--frame interface={name}`: {str(refusal).split('error', 1)[-1].splitlines()[0]}")

    def has_dialect(self, name):
        """Returns true if the program has this dialect of sid."""
        words = [self.flexbody, "export", self.solid.path, "--to", "sid", "--dialect", name, "--allow-loss", "--quiet", "-o", self.folder / f"{name}.SID_FEM"]
        told = subprocess.run([str(word) for word in words], capture_output=True, text=True)
        # FB801: the usage is wrong.
        return "FB801" not in told.stderr


def evaluated(target, body, model, order=None, units=None):
    """Returns the results of all checks of a target on a body by the names of the columns."""
    equations = body.read(target, units)
    return checked(equations, target, body, model, order)


def checked(equations, target, body, model, order=None, oracle=None):
    """Returns the results of all checks of equations. `oracle` is the pair that `bodies.nodes_of` returns, by default for these equations."""
    nodes, wrong = oracle or bodies.nodes_of(equations, body, model)
    scale = checks.Scale(nodes)
    if order is None:
        order = equations.order
        if body.general and equations.order in ("exact", "first"):
            order = target.general if not (target.to == "mbdyn" and nodes.rest is not None) else "undeformed"
    free = not body.frame.startswith("interface=")
    found = {
        "order": order,
        "carried": not free,
        "shapes": checks.shapes(nodes, free, wrong),
        "accelerations": checks.accelerations(equations, nodes, scale, order, equations.has_damping),
        "gravity": checks.gravity(equations, nodes, scale, equations.gravity_order or order) if equations.has_gravity else None,
        "force": checks.force(equations, nodes, scale, order),
        "moment": checks.moment(equations, nodes, scale, order),
        "deflection": checks.deflection(equations, nodes, scale),
        "damping": checks.damping(equations, nodes, scale) if equations.has_damping else None,
    }
    return found


def limits(target, result):
    """Returns the limits of the checks of a format; the key "else" has that of all other columns."""
    if target.dialect == "float":
        return {"accelerations": SINGLE_SOLVED, "deflection": 10 * SINGLE, "else": SINGLE}
    stiff = {"shapes": STIFFNESS, "deflection": STIFFNESS}
    if target.to == "openradioss":
        return stiff | {"else": FIELDS_OF_16}
    # Without spin the forces of stiff modes are the largest ones. On an interface modes hold rigid motions, which strain K in its last digits: 4e-11 of the modes of the beams.
    of_stiffness = result["order"] == "small" or result["carried"]
    return stiff | {"accelerations": STIFFNESS if of_stiffness else ROUNDING, "else": ROUNDING}


def limit(target, result, column):
    """Returns the limit of a column."""
    found = limits(target, result)
    return found.get(column, found["else"])


def cell(target, results, column):
    """Returns the entry of a column: of several results the one with the largest ratio to its limit."""
    pairs = [(result[column], limit(target, result, column), result["order"]) for result in results]
    if any(found is None for found, _, _ in pairs):
        return NOT_HELD
    found, most, _ = max(pairs, key=lambda pair: pair[0] / pair[1])
    orders = {order for _, _, order in pairs if order in MARKS} if column == "accelerations" else set()
    return Cell(found, most, "".join(sorted(MARKS[order] for order in orders)))


PHYSICS = ["accelerations", "gravity", "force", "moment", "deflection"]


def whole(target, results):
    """Returns one entry for all checks of several bodies: the result with the largest ratio to its limit."""
    if not results:
        return Cell()
    pairs = []
    for result in results:
        for column in PHYSICS + (["damping"] if result["damping"] is not None else []):
            if result[column] is not None:
                pairs.append((result[column], limit(target, result, column)))
    found, most = max(pairs, key=lambda pair: pair[0] / pair[1])
    orders = {result["order"] for result in results if result["order"] in MARKS}
    return Cell(found, most, "".join(sorted(MARKS[order] for order in orders)))


def flexible(target, bench):
    """Returns the entries of a format with equations of the floating frame."""
    own = evaluated(target, bench.solid, bench.solid.source.model)
    cells = {column: cell(target, [own], column) for column in COLUMNS[:7]}
    if cells["gravity"] is NOT_HELD:
        cells["gravity"] = Cell(marks="f")
    if cells["damping"] is NOT_HELD:
        cells["damping"] = Cell(marks="g")
    if target.to == "embedded":
        cells["moment"].marks = "i"
    if target.to == "exudyn":
        cells["gravity"].marks = "l"
    cells["units"] = whole(target, [evaluated(target, bench.solid, bench.other, units="m,kg,s")])
    each = lambda some: [evaluated(target, body, body.source.model) for body in some]
    cells["frames"] = whole(target, each(bench.frames))
    cells["carried frames"] = Cell(marks="k") if target.dialect == "level13" else whole(target, each(bench.carried))
    cells["rotations"] = whole(target, each(bench.turning))
    cells["geometric stiffness"] = stressed(target, bench)
    return cells


def stressed(target, bench):
    """Returns the entry of bodies with geometric stiffness, for formats that hold it."""
    if target.general != "first":
        return NOT_HELD
    found = [0.0]
    for body in bench.stressed:
        equations = body.read(target)
        nodes, _ = bodies.nodes_of(equations, body, body.source.model)
        found.append(checks.stress(equations, nodes, checks.Scale(nodes)))
    return Cell(max(found), SINGLE_SOLVED if target.dialect == "float" else STIFFNESS, "a")


def reference(bench, body, model):
    """Returns the expected values for formats without shapes, from the oracle with the shapes of npz."""
    npz = next(target for target in bodies.targets([]) if target.name == "npz")
    nodes, wrong = bodies.nodes_of(body.read(npz), body, body.source.model)
    assert checks.shapes(nodes, not body.frame.startswith("interface="), wrong) < STIFFNESS
    if model is not body.source.model:
        factor = model.x.ravel() @ body.source.model.x.ravel() / (body.source.model.x.ravel() @ body.source.model.x.ravel())
        # Mass-normalised shapes of the same motion.
        mass = model.m.sum() / body.source.model.m.sum()
        nodes = bodies.Nodes(model, factor * nodes.origin, nodes.axes, nodes.psi / np.sqrt(mass), None)
    return checks.Coordinates(nodes)


def coordinates(target, bench):
    """Returns the entries of Chrono and Simscape."""

    def results(body, model, units=None):
        matrices, oracle = body.read(target, units), reference(bench, body, model)
        first, second = slice(0, 3), slice(3, 6)
        return {
            "points": checks.points(matrices, oracle),
            "accelerations": checks.small_motion(matrices, oracle, False),
            "gravity": max(checks.weight(matrices, oracle), checks.sag(matrices, oracle)),
            "force": checks.small_motion(matrices, oracle, False, first),
            "moment": checks.small_motion(matrices, oracle, False, second),
            "deflection": checks.static(matrices, oracle),
            "damping": checks.small_motion(matrices, oracle, True),
        }

    # Receptances near a resonance and static solutions: digits of K.
    def entry(results, columns, marks=""):
        if not results:
            return Cell()
        return Cell(max(result[column] for result in results for column in columns), STIFFNESS, marks)

    own = [results(bench.solid, bench.solid.source.model)]
    cells = {column: entry(own, [column]) for column in COLUMNS[2:7]}
    cells["shapes"] = cells["geometric stiffness"] = NOT_HELD
    cells["accelerations"] = entry(own, ["points", "accelerations"], "e")
    every = ["points", *PHYSICS, "damping"]
    cells["units"] = entry([results(bench.solid, bench.other, "m,kg,s")], every)
    each = lambda some: [results(body, body.source.model) for body in some]
    cells["frames"], cells["rotations"] = entry(each(bench.frames), every), entry(each(bench.turning), every)
    try:
        cells["carried frames"] = entry(each(bench.carried), every)
    except RuntimeError as refusal:
        # FB720: the format cannot hold it.
        if "FB720" not in str(refusal):
            raise
        cells["carried frames"] = Cell(marks="j")
    return cells


def drawn(target, bench):
    """Returns the entries of pictures: shapes and places. Of nodes that turn vtk alone has the rotations."""
    single = target.to == "gltf"

    def entry(some, model=None, units=None):
        if not some:
            return Cell()
        found = max(checks.drawn(body.read(target, units), model or body.source.model, single) for body in some)
        return Cell(found, SINGLE if single else STIFFNESS, "h" if single else "")

    solids = lambda some: [body for body in some if not (single and body.general)]
    cells = {column: NOT_HELD for column in COLUMNS}
    cells["shapes"] = entry([bench.solid])
    cells["frames"], cells["carried frames"] = entry(solids(bench.frames)), entry(solids(bench.carried))
    if not single:
        cells["units"] = entry([bench.solid], bench.other, "m,kg,s")
        cells["rotations"] = entry(bench.turning)
    return cells


def run(flexbody, folder, quick=False):
    """Returns the entries of all formats by name and column, a note for each format that was not run, and one for each body that was refused."""
    bench, found, absent = Bench(flexbody, folder, quick), {}, []
    for target in bodies.targets(bench.dialects):
        try:
            found[target.name] = flexible(target, bench)
        except Absent as missing:
            absent.append(f"{target.name}: {missing}")
    for target in [bodies.CHRONO, *bodies.SIMSCAPE]:
        found[target.name] = coordinates(target, bench)
    for target in [bodies.VTK, bodies.GLTF]:
        found[target.name] = drawn(target, bench)
    if not bench.carried:
        for cells in found.values():
            del cells["carried frames"]
    if quick:
        for cells in found.values():
            del cells["frames"], cells["geometric stiffness"]
    return found, absent, bench.refusals


def columns_of(found):
    """Returns the columns that all formats have."""
    return [column for column in COLUMNS if all(column in cells for cells in found.values())]


def rows(found, refusals):
    """Returns a row of the suite for each entry that has a number and for each body that was refused."""
    return [Row("all nodes", "all", f"equations of the target: {one} (1: refused)", 1.0, 0.0) for one in refusals] + [Row("all nodes", name, f"equations of the target: {column}", cells[column].found, cells[column].limit)
            for name, cells in found.items() for column in columns_of(found) if cells[column].found is not None]


def text(found, absent, refusals):
    """Returns the table with its footnotes."""
    columns = columns_of(found)
    lines = ["| format | " + " | ".join(columns) + " |", "|---" * (len(columns) + 1) + "|"]
    lines += [f"| {name} | " + " | ".join(cells[column].text() for column in columns) + " |" for name, cells in found.items()]
    used = sorted({mark for cells in found.values() for column in columns for mark in cells[column].marks})
    notes = "".join(f"\n<sup>{mark}</sup> {NOTES[mark]}\n" for mark in used)
    missing = f"\nNot at hand when this was written: {'; '.join(absent)}.\n" if absent else ""
    missing += "".join(f"\nNot converted when this was written: {one}.\n" for one in refusals)
    return "\n".join(lines) + "\n" + notes + missing
