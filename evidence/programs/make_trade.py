#!/usr/bin/env python3
"""Writes evidence/pages/trade.md and evidence/images/trade_*.svg: what each scene of fixtures/scenes needs, and what accuracy costs there.

    pip install numpy scipy h5py exudyn==1.13.6
    cargo build --release --locked
    python3 evidence/programs/make_trade.py

Runs in Exudyn and in a C program are those of evidence/programs/trade_seconds.py, in MBDyn those of trade_mbdyn.py where it is installed (the variable MBDYN or the PATH); all of it takes some two hours. `--only PART ...` measures some parts again (a scene by
the name of its file, or guidelines, block, conversions) and keeps the rest of the page, which is written after each part.
"""

import argparse
import csv
import json
import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from importlib import metadata
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # one process per core instead
import h5py  # noqa: E402
import numpy as np  # noqa: E402

from trade_figure import figure  # noqa: E402
from trade_guidelines import Body, read_scene, study  # noqa: E402
import trade_mbdyn  # noqa: E402
from trade_seconds import TURNS, InC, InExudyn, Measure, Task, cheapest  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]

# Scene, model, modes of a usual conversion: the reference has twice as many, residual vectors, and what the scene's motion lacks.
SCENES = [
    ("tumbling", "bracket_hex20", 12),
    ("connecting_rod_8000rpm", "connecting_rod", 20),
    ("car_frame_road", "car_frame", 30),
    ("satellite_tumbling", "satellite", 20),
    ("turbine_blade_runup", "turbine_blade", 15),
    ("mems_gyroscope", "mems_gyroscope", 20),
    ("robot_link", "robot_link", 10),
    ("gear_disc", "gear_disc", 30),
    ("conveyor_plate", "conveyor_plate", 20),
]
# Parts of the page that are not of one scene.
OTHERS = ("guidelines", "block", "conversions")
COUNTER = ("block_79_periods", "cube_hex8", 12)
# Candidates of the front whose error is more than this many times what is allowed are not timed.
HOPELESS = 10
# What the reference may lack of the FE model, as `trade` names it.
OUTPUTS = ("attitude", "deflection", "stress", "reaction")
# Lowest modes that the guidelines are tried with.
FEW = 6
INSTANTS = 300
# Reasons for which no reference of a scene is within the tolerances.
REASONS = {
    "tumbling": "The bracket is thrown undeformed with its full spin, which is a shock: it vibrates at all its frequencies, and those above the modes of the reference are missing in its stress. "
    'With `[initial] deformation = "static"` there is no shock.',
}
HEAD = """<!-- Written by evidence/programs/make_trade.py -->

# Cost of accuracy in each scene

For each scene of `fixtures/scenes`: the body that it needs, its error against the finite element model, and the seconds that it takes in two other
programs. Each part names the versions and the processor that it was measured with. Written by `./scripts/make.sh pages trade`; how `trade` works: [reference](../../docs/reference/trade.md).

* **Error**: `flexbody trade MODEL --modes N` simulates candidate bodies and measures each against a reference: 2N modes with residual vectors, enriched with the static
  responses to the forces that the equations of all nodes leave unbalanced along the motion ([theory](../../docs/theory.md), (8.16)). The error of the reference
  itself against the FE model is estimated by the same forces and listed. If it exceeds the tolerances (**bold**), `trade` warns (FB548) and exits with 1: errors of such a scene are
  relative to its reference only, and the part of the scene says why.
* **Runs**: time, error and number of steps are those of one run. The number of steps belongs to a candidate as its modes do: for each candidate and program it is the smallest found for which the error of the run
  against the reference is within what the error of the reference leaves of the tolerances; a candidate beyond the tolerances may get a tenth worse. An error in **bold** is the smallest where no number of steps is enough. `flexbody measure` finds the error of a run from its modal coordinates and attitude.
  Times are those of the processor, medians of {turns} runs in turns; those of *simulate* are of one run, by the clock. *simulate*: explicit steps of order 8 with error control, or the method that the scene states. *Exudyn*: generalised alpha, implicit, order 2. *C*: the header of
  `export --to embedded` in a Runge-Kutta program of order 4, explicit: its step is limited by the highest mode of the body, so that a high mode that is not needed costs steps.
{mbdyn}* **Candidates that are run**: those near the tolerances that no other candidate beats in both cost and accuracy, the recommended one and the whole body.
* **Out of sample**: *variations* are motions that the body was not made for; a recommended body holds in them, or the verdict says where it does not.
* **Percentages** are the largest of the errors of attitude, deflection, stress and reaction over its tolerance; the dashed line of the figures is 100 %.
* **Whole body**: N free modes with residual vectors and all terms, the body that one would convert without knowing the scene. If its error exceeds the tolerances (**bold**),
  the recommended body is also more accurate, and may cost more. Seconds in the table are those of the whole body and of the recommended body.

{table}

Terms alone save nothing in Exudyn, whose object has no form without them (`export` writes zeros); only the number of modes counts there. The C program leaves out terms that a body does not hold.

Number of modes that the tolerances of each scene need, by the way in which they are chosen; the lowest first unless stated otherwise. Free modes and residual vectors are tried in the numbers 2N, N, N/2 and N/4 of free modes; shapes of the motion are
those of `convert --scene --basis scene`, which represent this motion only ([select](../../docs/reference/select.md#a-basis-for-one-scene)):

{bases}

"""
MBDYN = """* **MBDyn** (in the parts {parts}): `export --to mbdyn` in its modal joint with its Runge-Kutta method {method}, implicit, order {order}; the seconds are those of the process, with the writing of its results and without its start-up.
"""
GUIDE = """## Guidelines I to IV

Guidelines of [WP19], section 8, taken literally as sets of terms ([theory](../../docs/theory.md#7-sizes-of-the-terms), section 7), whether or not they cut across a group of the kinetic energy:

| | terms |
|---|---|
| I | I0 only |
| II | and the constant centrifugal load, W1'/2 |
| III | and W1 Q in the inertia, W2 Q in the load |
| III free | and Q'W2 Q in the inertia and the coupling Q'W3 |
| IV rotation | III, and of all Coriolis terms only the torque W1 Qd omega in the rows of the rotation |
| IV normal | IV rotation, and the Coriolis force 2 W3'Qd omega on the modes |
| IV | and Coriolis forces: everything |

In the normal case of guideline IV, W1 Qd omega is the only Coriolis term in the rows of the rotation; slender free bodies need all terms. "IV rotation" and "IV normal" are the two readings of the normal case, without and with
the Coriolis force on the modes. Where the rotation is prescribed, they equal III and IV apart from the Euler force.

Each set is integrated with the first {few} free modes, by a separate program (numpy and scipy, `evidence/programs/trade_guidelines.py`, from the equations of theory section 3), and compared with all terms.
Its whole motion agrees with `flexbody simulate` to {agree:.0e}. Numbers are attitude errors in radians / errors of the elastic energy's root; **bold** above the tolerance of
the scene. Bodies with nodal rotations have other equations and are not in the table.

"""


def run(program, *arguments, folder, passes=(0,)):
    done = subprocess.run([program, *map(str, arguments)], cwd=folder, capture_output=True, text=True)
    if done.returncode not in passes:
        sys.exit(f"{' '.join(map(str, arguments))} ended with {done.returncode}:\n{done.stderr}")
    return done.stdout


def number(value, digits=2):
    if value is None:
        return ""
    if value == 0:
        return "0"
    if not 1e-3 <= abs(value) < 1e4:
        return f"{value:.{digits - 1}e}"
    return f"{value:.{digits}g}" if abs(value) < 100 else f"{value:.0f}"


def convert(program, folder, model, modes):
    words = ["convert", ROOT / "fixtures/models" / model / "model.toml", "--modes", modes, "-o", "body.flex.h5", "--quiet"]
    run(program, *words, folder=folder)


def decided(program, folder, scene, *body):
    """What `select` decides, in its five lines."""
    told = json.loads(run(program, "select", *body, "--scene", scene, "--json", folder=folder, passes=(0, 1)))["results"]["verdict"]
    lines = [f"* {label}: {told[key]}" for label, key in (("take", "take"), ("why", "why"), ("error", "error"), ("saves", "saves"))]
    return "`select`:\n\n" + "\n".join(lines)


def described(row):
    words = f"{row['modes']} mode{'s' if row['modes'] > 1 else ''}, {' '.join(row['groups']) or 'no group'}"
    if row["mode_numbers"][-1] != row["modes"]:
        words += " (by contribution)"
    lumped = {"couplings": "lumped couplings", "whole": "lumped mass", None: None}[row["lumped_part"]]
    return words + (f", {lumped} ({row['lumped']})" if lumped else "") + (", f32" if row["storage"] == "f32" else "")


def worst_error(row, tolerance):
    """The error that is largest beside its tolerance: its name, its size and the tolerance, of the attitude in radians, else relative."""
    errors = {key: value for key, value in row["measured"]["errors"].items() if key in tolerance and value is not None}
    name = max(errors, key=lambda key: errors[key] / tolerance[key])
    return name, errors[name], tolerance[name]


def in_words(name, value):
    return f"{number(value)} rad" if name == "attitude" else f"{number(100 * value)} %"


def own_error(name, error, allowed):
    """An error beside what is allowed, in bold where it is more."""
    return f"{in_bold(name, error, allowed)} (allowed {in_words(name, allowed)})"


def in_bold(name, error, allowed):
    """An error, in bold where it is more than is allowed."""
    return f"{name} **{in_words(name, error)}**" if error > allowed else f"{name} {in_words(name, error)}"


def shown(told):
    """Numbers of the rows that the page shows: the front where it is near the tolerances, what is recommended, the usual body, lumped masses and two sets of groups."""
    rows = told["rows"]
    numbers = worth_timing(told) + [1]
    whole = rows[0]["modes"]
    for row in rows:
        alone = row["lumped"] or row["modes"] == whole and row["kind"] == "groups" and len(row["groups"]) == 2
        if alone and row["measured"]:
            numbers.append(row["number"])
    unique = sorted(set(numbers), key=lambda at: rows[at - 1]["measured"]["multiplications"])
    return [rows[at - 1] for at in unique if rows[at - 1]["measured"]]


def worth_timing(told):
    """Numbers of the rows that are timed: the front near the tolerances, what is recommended, the usual body."""
    rows = told["rows"]
    near = [number for number in told["front"] if 0 < rows[number - 1]["measured"]["worst"] <= HOPELESS]
    return near + ([told["recommended"]] if told["recommended"] else []) + [usual(told)]


def usual(told):
    """The row of N free modes with residual vectors and all terms: the first conversion after the reference that has both."""
    usual = [row for row in told["rows"] if row["source"].endswith("free modes, residual vectors") and row["source"] != told["rows"][0]["source"] and len(row["groups"]) == 3]
    return usual[0]["number"]


def programs():
    """The other programs, by the name of their column, with the class of their runs."""
    found = {"Exudyn": InExudyn, "C": InC}
    return {**found, "MBDyn": trade_mbdyn.InMbdyn} if trade_mbdyn.installed() else found


class Timed:
    """A candidate in the other programs, each with the fewest steps that the tolerances allow."""

    def __init__(self, program, folder, row, scene, start, measure, most):
        own = folder / f"{row['number']:03}"
        own.mkdir()
        path = folder / f"candidate_{row['number']:03}.flex.h5"
        task = Task(path, scene, start)
        self.task, self.programs, self.runs, self.errors, self.meets, self.seconds, self.why = task, {}, {}, {}, {}, {}, {}
        for name, kind in programs().items():
            try:
                made = kind(program, task, own)
                best = cheapest(made, measure, task, row["measured"]["worst"], most, own)
            except (RuntimeError, ValueError) as error:
                self.why[name] = str(error).splitlines()[0]
                continue
            if best is None:
                self.why[name] = f"no run of up to {made.most:,} steps comes to its end"
                continue
            self.programs[name], (self.runs[name], self.errors[name], self.meets[name]) = made, best
            self.seconds[name] = [self.runs[name].seconds]

    def run(self):
        for name, program in self.programs.items():
            self.seconds[name].append(program.run(self.runs[name].steps).seconds)

    def median(self, name):
        return float(np.median(self.seconds[name])) if name in self.seconds else None


def timed(program, folder, told, scene, model):
    """The rows that are shown in the other programs; seconds are taken in turns."""
    reference = folder / "candidate_001.flex.h5"
    measure = Measure(program, scene[0], reference, model)
    lacks = told["reference_lacks"]
    # What the error of the reference leaves of the tolerances; all of them if it is no reference.
    lost = max(lacks[-1][key] / told["tolerance"][key] for key in OUTPUTS if lacks[-1][key]) if lacks else 0.0
    most = 1.0 - lost if lost < 1.0 else 1.0
    found = {}
    for number in sorted(set(worth_timing(told))):
        row = told["rows"][number - 1]
        # A body starts in its own equilibrium, as `simulate` has it.
        body = folder / f"candidate_{number:03}.flex.h5"
        given = row["measured"]["runs"][0].get("initial_modes") if row["measured"]["runs"] else None
        start = stated_modes(body, given) if given else modes_at_the_start(program, folder, body, scene[0])
        found[number] = Timed(program, folder, row, scene[1], start, measure, most)
    for _ in range(TURNS - 1):
        for one in found.values():
            one.run()
    return found


def measured(told, times):
    """What is shown, as a table."""
    heads = ["candidate", "error of the body", "in `simulate`", *(f"in {name}" for name in programs()), "file (kB)"]
    out = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for row in shown(told):
        own, one = row["measured"], times.get(row["number"])
        name, error, _ = worst_error(row, told["tolerance"])
        label = f"**{described(row)}**" if row["number"] == told["recommended"] else described(row)
        label += " (whole body)" if row["number"] == usual(told) else ""
        cells = [f"{name} {in_words(name, error)}: {number(100 * own['worst'])} %", simulated_run(own), *other_runs(one), number(own["file_bytes"] / 1e3, 3)]
        out.append(f"| {label} | " + " | ".join(cells) + " |")
    return "\n".join(out)


def simulated_run(measured):
    """The run in `flexbody simulate`: seconds, error, accuracy of the step."""
    if not measured["runs"]:
        return ""
    run = max(measured["runs"], key=lambda run: run["worst"])
    step = f"tolerance {run['tolerance']:g}" if run["tolerance"] else f"step {run['step']:.3g}"
    return f"{time_in_words(run['seconds'])}, {number(100 * run['worst'])} %, {step}"


def other_runs(one):
    """The runs in the other programs: seconds, error of the same run, number of steps; empty for candidates that were not run."""
    if one is None:
        return [""] * len(programs())
    return [run_in_words(one, name) if name in one.runs else one.why[name] for name in programs()]


def run_in_words(one, name):
    """A run: seconds, error, number of steps; the error in bold if no number of steps is enough."""
    error = f"{number(100 * one.errors[name])} %"
    return f"{time_in_words(one.median(name))}, {error if one.meets[name] else f'**{error}**'}, {one.runs[name].steps:,} steps"


def too_long(told, times):
    """A paragraph on the runs in Exudyn for which no number of steps is enough; empty if there is none."""
    one = times[told["recommended"] or usual(told)]
    if one.meets.get("Exudyn", True):
        return []
    if one.task.is_stiffened:
        return ["Errors in **bold**: no number of steps is enough. The body has geometric stiffness, which Exudyn does not have: the error of its runs does not depend on the step."]
    steps, periods = one.runs["Exudyn"].steps, np.sqrt([one.task.eigenvalue.min(), one.task.eigenvalue.max()]) / (2 * np.pi) * one.task.duration
    return [
        f"Errors in **bold**: no number of steps that was tried is enough (in Exudyn up to {InExudyn.most:,}, in C up to {InC.most:,}). The recommended body has {periods[0]:.0f} periods of its lowest and {periods[1]:.0f} of its highest mode in this scene; with {steps:,} steps "
        f"Exudyn takes {steps / periods[1]:.0f} steps per period of the highest one, and the errors of a method of order 2 in phase, and its numerical damping, add up over the periods."
    ]


def time_in_words(seconds):
    """Seconds with a fitting prefix."""
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{number(seconds / size, 3)} {unit}"
    return f"{number(seconds / 1e-6, 3)} us"


def drawn(told, times, name):
    """The figure: error and seconds of the runs in Exudyn. Returns its line in the page; empty if Exudyn has no run of a candidate."""
    points = []
    for row in shown(told):
        one = times.get(row["number"])
        seconds = one.median("Exudyn") if one else None
        if seconds:
            points.append((seconds, 100 * one.errors["Exudyn"], described(row), bool(row["lumped"]), row["number"] == told["recommended"]))
    if not points:
        return []
    (ROOT / "evidence/images" / f"trade_{name}.svg").write_text(figure(told["scene"], points))
    return [f"![error over seconds](../images/trade_{name}.svg)"]


def summary(told, times):
    """The row of the table on top."""
    lacks = told["reference_lacks"]
    reference = ", ".join(in_bold(key, lacks[-1][key], told["tolerance"][key]) for key in OUTPUTS if lacks and lacks[-1][key])
    whole = times[usual(told)]
    name, error, allowed = worst_error(told["rows"][usual(told) - 1], told["tolerance"])
    beside = own_error(name, error, allowed)
    if not told["recommended"]:
        return f"| {told['scene']} | none within the tolerances | | {beside} | {reference} | | |"
    row = told["rows"][told["recommended"] - 1]
    own = times[told["recommended"]]
    name, error, allowed = worst_error(row, told["tolerance"])

    def saved(kind):
        before, after = whole.median(kind), own.median(kind)
        if not before or not after:
            return whole.why.get(kind) or own.why.get(kind) or ""
        errors = f"errors {number(100 * whole.errors[kind])} % and {number(100 * own.errors[kind])} % of the tolerance"
        if not own.meets[kind]:
            return f"no number of steps is enough: {time_in_words(before)} and {time_in_words(after)} ({errors})"
        return f"{time_in_words(before)} to {time_in_words(after)}: **{number(before / after)} times** ({errors})"

    return f"| {told['scene']} | {described(row)} | {own_error(name, error, allowed)} | {beside} | {reference} | {saved('Exudyn')} | {saved('C')} |"


def scene_part(program, name, model, modes):
    """The part of a scene, and its rows of the two tables on top."""
    path = ROOT / "fixtures/scenes" / f"{name}.toml"
    manifest = ROOT / "fixtures/models" / model / "model.toml"
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        words = ["trade", manifest, "--modes", modes, "--scene", path, "--repeat", 1, "--bodies", folder, "--report", "trade.json", "--quiet"]
        run(program, *words, folder=folder, passes=(0, 1))
        told = json.loads((folder / "trade.json").read_text())
        times = timed(program, folder, told, (path, read_scene(path)), manifest)
    picture = drawn(told, times, name)
    verdict = "\n".join(f"* {line['label'].lower()}: {line['text']}" for line in told["verdict"][1:]).replace(f"{ROOT}/", "")
    said = f"`trade {model}/model.toml --modes {modes}`: {len(told['rows'])} candidates in {told['cpu_seconds']:.0f} s of the processor. {versions(program)}."
    parts = [f"## {told['scene']}", said, *unmet(told, name), verdict, measured(told, times), *too_long(told, times), *picture]
    return "\n\n".join(parts) + "\n\n", summary(told, times), bases(told)


def unmet(told, name):
    """A paragraph on a reference that does not meet the tolerances, or on a scene without a recommended body."""
    lacks, lines = told["reference_lacks"], []
    beyond = [key for key in OUTPUTS if lacks and lacks[-1][key] and lacks[-1][key] > told["tolerance"][key]]
    if beyond:
        errors = ", ".join(own_error(key, lacks[-1][key], told["tolerance"][key]) for key in beyond)
        lines.append(f"The reference of {lacks[-1]['modes']} modes is not within the tolerances of the FE model: {errors}, estimated. Errors and runs of this part are relative to the reference; relative to the FE model this error comes on top. {REASONS.get(name, '')}")
    if not told["recommended"]:
        lines.append("No candidate is within the tolerances.")
    return lines


def bases(told):
    """The row of the table of bases: how many modes the tolerances take, by the way in which they are chosen."""
    rows, first = told["rows"], told["rows"][0]

    def fewest(fits):
        found = [row["modes"] for row in rows if not row["lumped"] and row["measured"] and row["measured"]["worst"] <= 1 and fits(row)]
        return str(min(found)) if found else f"more than {max((row['modes'] for row in rows if fits(row)), default=0)}"

    def of_reference(row):
        return row["source"] == first["source"]

    def in_order(row):
        return row["mode_numbers"][-1] == row["modes"]

    cells = [
        fewest(lambda row: row["source"].endswith("free modes") or row["source"].endswith("free mode")),
        fewest(lambda row: row["source"].endswith("residual vectors") and in_order(row)),
        fewest(of_reference),
        fewest(lambda row: row["source"].endswith("of the motion")),
    ]
    return f"| {told['scene']} | " + " | ".join(cells) + " |"


def stated_modes(body, given):
    """Modal coordinates and rates of the start that `trade` gives a candidate whose scene states those of the reference."""
    with h5py.File(body) as file:
        count = len(file["modes/eigenvalue"])
    q, qd = np.zeros(count), np.zeros(count)
    for one in given:
        q[one["number"] - 1], qd[one["number"] - 1] = one["amplitude"], one["rate"]
    return q, qd


def modes_at_the_start(program, folder, body, scene):
    """Modal coordinates of `flexbody simulate` at the start of a scene, and their rates."""
    run(program, "simulate", body, "--scene", scene, "--csv", "modes.csv", "--quiet", folder=folder)
    with open(folder / "modes.csv", newline="") as file:
        first = next(csv.DictReader(file))
    count = sum(key.startswith("q_") for key in first)
    return tuple(np.array([float(first[f"{name}_{j + 1}"]) for j in range(count)]) for name in ("q", "qd"))


def simulated(program, folder, scene, body):
    """The motion by `flexbody simulate`: instants, and the states as the other program has them."""
    run(program, "simulate", "body.flex.h5", "--scene", scene, "--csv", "motion.csv", "--quiet", folder=folder)
    with open(folder / "motion.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    names = [f"attitude_{k}" for k in range(4)] + [f"angular_velocity_{k}" for k in "xyz"] + [f"q_{j + 1}" for j in range(body.nf)] + [f"qd_{j + 1}" for j in range(body.nf)]
    return np.array([float(row["time"]) for row in rows]), np.array([[float(row[name]) for row in rows] for name in names])


def guidelines(job):
    """Errors of each guideline in a scene, the tolerances, and how well the two programs agree; `None` for bodies with other equations."""
    program, name, model = job
    path = ROOT / "fixtures/scenes" / f"{name}.toml"
    scene = read_scene(path)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        convert(program, folder, model, FEW)
        body = Body(folder / "body.flex.h5")
        if not body.solid:
            return name, None
        instants, own = simulated(program, folder, path, body)
    every = max(1, len(instants) // INSTANTS)
    whole, errors = study(body, scene, instants[::every])
    root = np.sqrt(body.eigenvalue)[:, None]
    q, p = (root * of[7:7 + body.nf] for of in (own[:, ::every], whole))
    # A body with geometric stiffness has it in `simulate`, and not here.
    agree = None if body.prestressed else np.linalg.norm(q - p, axis=0).max() / np.linalg.norm(q, axis=0).max()
    tolerance = {"attitude": 1e-3, "stress": 0.01, **scene.get("tolerance", {})}
    return name, (scene["name"], errors, tolerance, agree)


def guide_part(found):
    rows = [one for _, one in found if one is not None]
    names = list(rows[0][1])
    out = ["| scene | " + " | ".join(names) + " |", "|---|" + "---|" * len(names)]
    for title, errors, tolerance, _ in rows:
        cells = []
        for name in names:
            if errors[name] is None:
                cells.append("**does not run**")
                continue
            pair = [f"**{number(errors[name][key])}**" if errors[name][key] > tolerance[key] else number(errors[name][key]) for key in ("attitude", "stress")]
            cells.append(" / ".join(pair))
        out.append(f"| {title} | " + " | ".join(cells) + " |")
    agree = max(one[3] for one in rows if one[3] is not None)
    holds = {name: [title for title, errors, tolerance, _ in rows if errors[name] and all(errors[name][key] <= tolerance[key] for key in ("attitude", "stress"))] for name in names}
    lines = [f"* {name} holds in {len(held)} of {len(rows)} scenes" + (": " + ", ".join(held) if held else "") + "." for name, held in holds.items()]
    return GUIDE.format(few=FEW, agree=agree) + "\n".join(out) + "\n\n" + "\n".join(lines) + "\n\n"


def counter_part(program):
    """A block whose deformation and spin are small, and guidelines that fail."""
    name, model, modes = COUNTER
    path = ROOT / "fixtures/scenes" / f"{name}.toml"
    scene = read_scene(path)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        convert(program, folder, model, modes)
        body = Body(folder / "body.flex.h5")
        instants, own = simulated(program, folder, path, body)
        decision = decided(program, folder, path, "body.flex.h5")
    every = max(1, len(instants) // INSTANTS)
    whole, errors = study(body, scene, instants[::every])
    q = np.linalg.norm(own[7:7 + body.nf], axis=0).max()
    omega = np.linalg.norm(own[4:7], axis=0).max()
    first = np.sqrt(body.eigenvalue[0])
    facts = f"eta = |q| / sqrt(I0) = {100 * q / np.sqrt(np.diag(body.I0).min()):.1f} %, omega / Omega1 = {omega / first:.3f}, {first * instants[-1] / (2 * np.pi):.0f} periods of the first mode"
    lines = [f"| {key} | " + " | ".join(f"{100 * errors[key][what]:.2g} %" if errors[key] else "does not run" for what in ("omega", "modes")) + f" | {number(errors[key]['attitude'])} |" for key in errors if errors[key]]
    table = "\n".join(["| guideline | angular velocity | modal coordinates | attitude (rad) |", "|---|---|---|---|", *lines])
    said = "Small deformations and a slow spin, for which guidelines I and II are meant; over many periods they are not enough. What is enough:"
    parts = ["## A block that tumbles while it vibrates", f"`fixtures/scenes/{name}.toml` with `{model}`: {facts}.", table, said, decision]
    return "\n\n".join(parts) + "\n\n"


def conversion_part(program):
    """What the settings of a conversion cost and are worth, against the motion of all nodes."""
    name, model, modes = COUNTER
    words = ["trade", ROOT / "fixtures/models" / model / "model.toml", "--modes", modes, "--scene", ROOT / "fixtures/scenes" / f"{name}.toml"]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        run(program, *words, "--reference", "nodal", "--repeat", 1, "--report", "trade.json", "--quiet", folder=folder, passes=(0, 1))
        told = json.loads((folder / "trade.json").read_text())
    lines = ["| conversion | modes | made in (s) | work | file (kB) | attitude (rad) | stress | error / tolerance |", "|---|---|---|---|---|---|---|---|"]
    for row in told["rows"]:
        own = row["measured"]
        if own is None or len(row["groups"]) < 3 or row["kind"] != "modes" or row["source"] in [line.split(" | ")[0][2:] for line in lines]:
            continue
        cells = [row["source"], str(row["modes"]), number(own["seconds"]["preprocessing"]), f"{own['multiplications']:,}", number(own["file_bytes"] / 1e3, 3)]
        cells += [number(own["errors"][key]) for key in ("attitude", "stress")] + [number(own["worst"], 3)]
        lines.append("| " + " | ".join(cells) + " |")
    said = f"The same scene with the manifest, `trade {model}/model.toml --modes {modes} --reference nodal`: conversions with all groups, against the unreduced equations of all nodes."
    return "## Settings of the conversion\n\n" + said + "\n\n" + "\n".join(lines) + "\n\n"


def processor():
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{len(names)} cores, {names[0]}" if names else "processor not known"


def versions(program):
    """The programs and the processor of a measurement."""
    version = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout.split()[-1]
    others = [f"Exudyn {metadata.version('exudyn')}", *([f"MBDyn {trade_mbdyn.version()}"] if trade_mbdyn.installed() else [])]
    return f"`flexbody {version}`, {', '.join(others)}; {processor()}"


def main():
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--program", default=str(target / "release" / "flexbody"), help="flexbody (default: the release build)")
    parser.add_argument("--output", type=Path, default=ROOT / "evidence/pages/trade.md")
    names = [*(name for name, *_ in SCENES), *OTHERS]
    parser.add_argument("--only", nargs="+", choices=names, metavar="PART", help=f"measure these parts and keep the rest of the page: {', '.join(names)}")
    args = parser.parse_args()
    program = str(Path(args.program).resolve())  # it runs in another folder
    parts = {}
    for name, make in jobs(program).items():
        # One after the other: the times are measured.
        if not args.only or name in args.only:
            made = make()
            if args.only:
                # Another run may have written the page meanwhile.
                parts = read_page(args.output.read_text(encoding="utf-8"))
            parts[name] = made
            args.output.write_text(assembled(parts), encoding="utf-8")
            print(name, flush=True)
    print(args.output)


def jobs(program):
    """Functions that measure a part, by the name of the part."""
    scenes = {one[0]: partial(scene_part, program, *one) for one in SCENES}
    return {**scenes, "guidelines": partial(all_guidelines, program), "block": partial(counter_part, program), "conversions": partial(conversion_part, program)}


def all_guidelines(program):
    with ProcessPoolExecutor() as pool:
        return guide_part(list(pool.map(guidelines, [(program, name, model) for name, model, *_ in SCENES])))


def read_page(text):
    """The parts of a page: of a scene its section and its rows of the two tables, of other parts their text."""
    _, *marked = re.split(r"^<!-- part (\w+) -->\n", text, flags=re.MULTILINE)
    parts = {}
    for name, section in zip(marked[::2], marked[1::2]):
        section = section.rstrip() + "\n\n"
        if name in OTHERS:
            parts[name] = section
            continue
        title = section.splitlines()[0].removeprefix("## ")
        # The first two rows are those of the tables on top; the table of the guidelines may have a third.
        summary_row, bases_row, *_ = (line for line in text.splitlines() if line.startswith(f"| {title} |"))
        parts[name] = [section, summary_row, bases_row]
    return parts


def mbdyn_in_words(sections):
    """A line on the runs in MBDyn, with the titles of the parts that have them; empty if there is none."""
    titles = [section.splitlines()[0].removeprefix("## ") for section in sections if "| in MBDyn |" in section]
    kind = trade_mbdyn.InMbdyn
    return MBDYN.format(parts=", ".join(f"*{title}*" for title in titles), method=kind.method, order=kind.order) if titles else ""


def assembled(parts):
    """The page, of the parts that are there."""
    scenes = [name for name, *_ in SCENES if name in parts]
    head = ["| scene | body | its error | error of the whole body | the reference lacks (estimated) | Exudyn | C |", "|---|---|---|---|---|---|---|"]
    top = "\n".join(head + [parts[name][1] for name in scenes])
    head = ["| scene | free modes | and residual vectors | those of the reference that do most | shapes of the motion |", "|---|---|---|---|---|"]
    ways = "\n".join(head + [parts[name][2] for name in scenes])
    text = HEAD.format(turns=TURNS, table=top, bases=ways, mbdyn=mbdyn_in_words([parts[name][0] for name in scenes]))
    missing = [name for name, *_ in SCENES if name not in parts]
    if missing:
        text += f"Not measured yet in this form: {', '.join(missing)} (`python3 evidence/programs/make_trade.py --only ...`).\n\n"
    sections = {**{name: parts[name][0] for name in scenes}, **{name: parts[name] for name in OTHERS if name in parts}}
    return (text + "".join(f"<!-- part {name} -->\n{section}" for name, section in sections.items())).rstrip() + "\n"


if __name__ == "__main__":
    main()
