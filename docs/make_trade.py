#!/usr/bin/env python3
"""Writes docs/trade.md and docs/images/trade_*.svg: what each scene of fixtures/scenes needs, and what accuracy costs there.

    pip install numpy scipy h5py
    cargo build --release --locked
    python3 docs/make_trade.py
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
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # one process per core instead
import numpy as np  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "docs"))
from trade_guidelines import GUIDELINES, Body, read_scene, study  # noqa: E402

# Scene, model, modes of its body, residual vectors.
SCENES = [
    ("tumbling", "bracket_hex20", 12, ""),
    ("connecting_rod_8000rpm", "connecting_rod", 20, ""),
    ("car_frame_road", "car_frame", 30, ""),
    ("satellite_tumbling", "satellite", 20, "centrifugal"),
    ("turbine_blade_runup", "turbine_blade", 15, "centrifugal"),
    ("mems_gyroscope", "mems_gyroscope", 20, ""),
    ("robot_link", "robot_link", 10, "interfaces"),
    ("gear_disc", "gear_disc", 30, ""),
    ("conveyor_plate", "conveyor_plate", 20, ""),
]
COUNTER = ("block_79_periods", "cube_hex8", 12)
# Lowest modes that the guidelines are tried with.
FEW = 6
INSTANTS = 300
STYLE = (
    "text { font: 12px system-ui, sans-serif; fill: #1a1d21; } .tick { fill: #5a6370; } .grid { stroke: #d5dae1; } "
    "polyline { fill: none; stroke-width: 1.4; } .s0 { fill: #1f5fa8; } .s1 { fill: #b4560d; } .s2 { fill: #4f7a28; } "
    ".l0 { stroke: #1f5fa8; } .l1 { stroke: #b4560d; stroke-dasharray: 7 3; }"
)
HEAD = """<!-- Written by docs/make_trade.py -->

# What accuracy costs

For each scene of `fixtures/scenes`: what `flexbody {version} select` decides, and what `flexbody trade` measures of candidate bodies, against the whole body:
`convert MODEL --modes N --residual-vectors ...`, then `trade BODY --scene SCENE`. *Work* are multiplications of one evaluation of the equations of motion, *error* is the
largest error of attitude, deflection, stress and reaction over its tolerance: 1 is what the scene allows. In the figures the front joins the candidates that
none is as cheap and as accurate as; the ring is the one to take. All candidates of a scene are integrated with the steps of the reference, so that errors are those of
the model. Times are of this machine; everything else is the same everywhere. Written by `python3 docs/make_trade.py`.

"""
GUIDE = """## Guidelines I to IV

Guidelines of [WP19], section 8, taken literally as sets of terms ([theory](theory.md#7-sizes-of-the-terms), section 7), whether or not they cut across a group of the kinetic energy:

| | terms |
|---|---|
| I | I0 only |
| II | and the constant centrifugal load, W1'/2 |
| III | and W1 Q in the inertia, W2 Q in the load |
| III free | and Q'W2 Q in the inertia and the coupling Q'W3 |
| IV | and Coriolis forces: everything |

Each is integrated with the first {few} free modes, by a program of its own (numpy and scipy, `docs/trade_guidelines.py`, from the equations of theory section 3), against everything.
Its whole motion agrees with `flexbody simulate` to {agree:.0e}. Numbers are attitude errors in radians / errors of the elastic energy's root; **bold** where one is beyond the tolerance of
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
    return "0" if value == 0 else f"{value:.{digits}g}" if 1e-3 <= abs(value) < 1e4 else f"{value:.{digits - 1}e}"


def convert(program, folder, model, modes, residual):
    words = ["convert", ROOT / "fixtures/models" / model / "model.toml", "--modes", modes, "-o", "body.flex.h5", "--quiet"]
    run(program, *words, *(["--residual-vectors", residual] if residual else []), folder=folder)


def decided(program, folder, scene):
    """What `select` decides, in words."""
    told = json.loads(run(program, "select", "body.flex.h5", "--scene", scene, "--json", folder=folder))["results"]
    kept = [term["group"] for term in told["terms"] if term["kept"]]
    def proof(term):
        if not term["limit"]:
            return term["reason"]
        return f"{term['reason']}: {'without it' if term['kept'] else 'at most'} {number(term['bound'], 3)}, allowed {number(term['limit'], 3)}"

    lines = [f"* {'keeps' if term['kept'] else 'drops'} {term['group']} (tier {term['tier']}): {proof(term)}" for term in told["terms"]]
    modes = told["modes"]
    chosen = told["chosen"]
    cost = f", {chosen['multiplications']:,} of {told['multiplications_before']:,} multiplications" if chosen else ""
    lines.append(f"* {len(modes['kept'])} of {modes['of']} modes: {modes['reason']}{cost}")
    return f"`select` decides ({told['guideline']}): " + (", ".join(kept) or "no group") + "\n\n" + "\n".join(lines)


def described(row):
    words = f"{row['modes']} mode{'s' if row['modes'] > 1 else ''}, {' '.join(row['groups']) or 'no group'}"
    if row["mode_numbers"][-1] != row["modes"]:
        words += " (the liveliest)"
    return words + (f", {row['lumped']}" if row["lumped"] else "") + (", f32" if row["storage"] == "f32" else "")


def measured(told):
    """The front and what is to be learnt from the rest, as a table."""
    rows = {row["number"]: row for row in told["rows"]}
    shown = [(number, "") for number in told["front"]]
    if told["recommended"] and told["recommended"] not in told["front"]:
        shown.append((told["recommended"], ""))
    whole = rows[1]["modes"]
    for row in told["rows"][1:]:
        alone = row["modes"] == whole and row["kind"] in ("lumped", "single") or row["modes"] == whole and row["kind"] == "groups" and len(row["groups"]) == 2
        if alone and row["number"] not in [number for number, _ in shown]:
            shown.append((row["number"], "beside"))
    out = ["| candidate | work | evaluation (us) | simulation (ms) | steps | file (kB) | error / tolerance |", "|---|---|---|---|---|---|---|"]
    for at, _ in sorted(shown, key=lambda one: (one[1], rows[one[0]]["measured"]["multiplications"] if rows[one[0]]["measured"] else 0)):
        row, own = rows[at], rows[at]["measured"]
        name = f"**{described(row)}**" if at == told["recommended"] else described(row)
        if own is None:
            out.append(f"| {name} | | | | | | {row['failed']['message']} |")
            continue
        seconds = own["seconds"]
        cells = [f"{own['multiplications']:,}", number(1e6 * seconds["evaluation"], 3), number(1e3 * seconds["integration"], 3), f"{own['steps']:,}", number(own["file_bytes"] / 1e3, 3), number(own["worst"], 3)]
        out.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(out)


def figure(folder, name):
    """The plot of the report as a picture of its own."""
    [(inside,)] = [(m,) for m in re.findall(r"<svg[^>]*>(.*?)</svg>", (folder / "trade.html").read_text(), re.S)]
    width, height = re.search(r'viewBox="0 0 (\S+) (\S+)"', (folder / "trade.html").read_text()).groups()
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" role="img">'
    text = f'{head}\n<style>{STYLE}</style><rect width="{width}" height="{height}" fill="#fff"/>\n{inside}</svg>\n'
    (ROOT / "docs/images" / f"trade_{name}.svg").write_text(text)


def scene_part(program, name, model, modes, residual):
    scene = ROOT / "fixtures/scenes" / f"{name}.toml"
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        convert(program, folder, model, modes, residual)
        decision = decided(program, folder, scene)
        run(program, "trade", "body.flex.h5", "--scene", scene, "--repeat", 1, "--report", "trade.html", "--report", "trade.json", "--quiet", folder=folder, passes=(0, 1))
        told = json.loads((folder / "trade.json").read_text())
        figure(folder, name)
    options = f"--modes {modes}" + (f" --residual-vectors {residual}" if residual else "")
    parts = [f"## {told['scene']}", f"`{model}`, `{options}`; {len(told['rows'])} candidates. {told['verdict'][0].upper() + told['verdict'][1:]}.", decision, measured(told), f"![error against work](images/trade_{name}.svg)"]
    return "\n\n".join(parts) + "\n\n"


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
        convert(program, folder, model, FEW, "")
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
    names = [name for name in GUIDELINES if name != "IV"]
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
        convert(program, folder, model, modes, "")
        body = Body(folder / "body.flex.h5")
        instants, own = simulated(program, folder, path, body)
        decision = decided(program, folder, path)
        run(program, "trade", "body.flex.h5", "--scene", path, "--repeat", 1, "--report", "trade.html", "--report", "trade.json", "--quiet", folder=folder, passes=(0, 1))
        told = json.loads((folder / "trade.json").read_text())
        figure(folder, name)
    every = max(1, len(instants) // INSTANTS)
    whole, errors = study(body, scene, instants[::every])
    q = np.linalg.norm(own[7:7 + body.nf], axis=0).max()
    omega = np.linalg.norm(own[4:7], axis=0).max()
    first = np.sqrt(body.eigenvalue[0])
    facts = f"eta = |q| / sqrt(I0) = {100 * q / np.sqrt(np.diag(body.I0).min()):.1f} %, omega / Omega1 = {omega / first:.3f}, {first * instants[-1] / (2 * np.pi):.0f} periods of the first mode"
    lines = [f"| {key} | " + " | ".join(f"{100 * errors[key][what]:.2g} %" if errors[key] else "does not run" for what in ("omega", "modes")) + f" | {number(errors[key]['attitude'])} |" for key in errors if errors[key]]
    table = "\n".join(["| guideline | angular velocity | modal coordinates | attitude (rad) |", "|---|---|---|---|", *lines])
    said = "Small deformations and a slow spin, for which guidelines I and II are meant; over many periods they are not enough. `trade` finds what is:"
    parts = ["## A block that tumbles while it vibrates", f"`fixtures/scenes/{name}.toml` with `{model}`: {facts}.", table, said, decision, measured(told), f"![error against work](images/trade_{name}.svg)"]
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


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    parser.add_argument("--program", default=str(target / "release" / "flexbody"), help="flexbody (default: the release build)")
    parser.add_argument("--output", type=Path, default=ROOT / "docs" / "trade.md")
    parser.add_argument("--only", nargs="*", help="these scenes (for trying the command)")
    args = parser.parse_args()
    program = str(Path(args.program).resolve())  # it runs in another folder
    version = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout.split()[-1]
    scenes = [one for one in SCENES if not args.only or one[0] in args.only]
    # One after the other: the times are measured.
    parts = [scene_part(program, *one) for one in scenes]
    counter = counter_part(program) + conversion_part(program)
    with ProcessPoolExecutor() as pool:
        found = list(pool.map(guidelines, [(program, name, model) for name, model, *_ in scenes]))
    args.output.write_text(HEAD.format(version=version) + "".join(parts) + guide_part(found) + counter.rstrip() + "\n", encoding="utf-8")
    print(args.output)


if __name__ == "__main__":
    main()
