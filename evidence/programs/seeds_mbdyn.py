"""The slider-crank of seeds_slider_crank.py in MBDyn, with and without groups of terms; for `make_seeds.py --mbdyn PROGRAM`.

Bodies are what `flexbody export --to mbdyn` writes. MBDyn needs to know record group 19 (sources of 2024 or later).
"""

import resource
import subprocess

import numpy as np

from seeds_mechanism import CRANK, DAMPING, ROD, WHEEL, apart
from seeds_slider_crank import BLOCK, MODES, SETS, SPEEDS, STEPS, TURNS

# Labels of the nodes: wheel, block, and of each flexible body its frame and the nodes of its ends.
WHEEL_NODE, BLOCK_NODE = 1, 2
FRAMES = {"crank": 10, "rod": 20}
DECK = """
begin: data; problem: initial value; end: data;
begin: initial value;
    initial time: 0.; final time: {end!r}; time step: {step!r};
    method: ms, 0.9; linear solver: naive, colamd; tolerance: 1e-6; max iterations: 30, at most;
    derivatives tolerance: 1e-3; derivatives max iterations: 30; derivatives coefficient: {coefficient!r};
end: initial value;
begin: control data;
    structural nodes: 8; rigid bodies: 2; joints: 7; skip initial joint assembly; use automatic differentiation;
    output precision: 17;
end: control data;
begin: nodes;
{nodes}
end: nodes;
begin: elements;
{elements}
end: elements;
"""


def vector(*values):
    return ", ".join(repr(float(value)) for value in values)


def structural(label, kind, place, spin, pivot):
    """A node at a place on x that turns about z with a rate; the point `pivot` on x does not move along y."""
    return f"structural: {label}, {kind}, {vector(place, 0, 0)}, eye, {vector(0, spin * (place - pivot), 0)}, {vector(0, 0, spin)};"


def deck(parts, speed):
    """The input. All parts lie along x at the start; the pin rises, and the block is at rest."""
    spin = {"crank": speed, "rod": -CRANK / ROD * speed}
    pivot = {"crank": 0.0, "rod": CRANK + ROD}
    ends = {"crank": (0.0, CRANK), "rod": (CRANK, CRANK + ROD)}
    nodes = [structural(WHEEL_NODE, "dynamic", 0, speed, 0), structural(BLOCK_NODE, "dynamic", CRANK + ROD, 0, 0)]
    elements = [
        f"body: 1, {WHEEL_NODE}, 1., null, diag, {vector(WHEEL, WHEEL, WHEEL)};",
        f"body: 2, {BLOCK_NODE}, {vector(BLOCK)}, null, diag, {vector(1, 1, 1)};",
    ]
    for number, (name, frame) in enumerate(FRAMES.items(), 1):
        nodes.append(structural(frame, "modal", sum(ends[name]) / 2, spin[name], pivot[name]))
        nodes += [structural(frame + at, "static", place, spin[name], pivot[name]) for at, place in enumerate(ends[name], 1)]
        tied = ", ".join(f'"{end}", {frame + at}, null' for at, end in enumerate(("left", "right"), 1))
        elements.append(f'joint: {number}, modal, {frame}, {MODES[name]}, from file, single factor damping, {DAMPING!r}, "{parts[name]}", 2, {tied};')
    crank, rod = FRAMES["crank"], FRAMES["rod"]
    place, all_axes, none = "position constraint, {}, null", "active, active, active", "inactive, inactive, inactive"
    joints = [
        f"total pin joint, {WHEEL_NODE}, {place.format(all_axes)}, orientation constraint, active, active, inactive, null",
        f"total joint, {WHEEL_NODE}, {crank + 1}, {place.format(all_axes)}, orientation constraint, {all_axes}, null",
        f"total joint, {crank + 2}, {rod + 1}, {place.format(all_axes)}, orientation constraint, active, active, inactive, null",
        f"total joint, {rod + 2}, {BLOCK_NODE}, {place.format(all_axes)}, orientation constraint, {none}, null",
        f"total pin joint, {BLOCK_NODE}, {place.format('inactive, active, active')}, orientation constraint, {all_axes}, null",
    ]
    elements += [f"joint: {number}, {joint};" for number, joint in enumerate(joints, 3)]
    end = TURNS * 2 * np.pi / speed
    step = end / STEPS
    # A hundredth of this coefficient kicks the crank at the start, and the kick grows as the step falls.
    return DECK.format(end=end - step / 2, step=step, coefficient=0.1 * step, nodes="\n".join(nodes), elements="\n".join(elements))


def run(mbdyn, program, bodies, speed, folder):
    """Returns the seconds of the processor, and the modal coordinates of crank and rod (instants x modes)."""
    parts = {}
    for name, body in bodies.items():
        parts[name] = body.with_suffix(".fem")
        program.run("export", body, "--to", "mbdyn", "-o", parts[name], "--allow-loss", "--quiet", "--points", "interfaces")
    text, out = folder / "slider_crank.mbd", folder / "slider_crank"
    text.write_text(deck(parts, speed))
    begin = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([mbdyn, "-s", "-f", text, "-o", out], check=True, capture_output=True)
    end = resource.getrusage(resource.RUSAGE_CHILDREN)
    q = np.loadtxt(out.with_suffix(".mod"), usecols=1).reshape(-1, sum(MODES.values()))
    return end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime, np.split(q, [MODES["crank"]], axis=1)


class Study:
    """Seconds, and the largest difference of the deflections of the rod from those with all terms, of every set of groups at the first speed."""

    def __init__(self, mbdyn, program, parts, folder):
        found = {}
        for terms in SETS:
            try:
                seconds, (_, q) = run(mbdyn, program, {name: part.path for name, part in parts[terms].items()}, SPEEDS[0], folder)
            except subprocess.CalledProcessError as error:
                if terms == "all":
                    raise RuntimeError(error.stderr.decode()[-2000:]) from error
                found[terms] = None
                continue
            found[terms] = seconds, q @ parts[terms]["rod"].shape
        whole = found["all"][1]
        self.rows = {terms: one and (one[0], apart(one[1], whole)) for terms, one in found.items()}
