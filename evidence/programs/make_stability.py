#!/usr/bin/env python3
"""Writes evidence/pages/stability.md: the digits that flexbody keeps of extreme bodies, against the same computation with 120 digits.

    pip install numpy h5py gmpy2
    cargo build --release --locked --bins --example extreme_motion
    python3 evidence/programs/make_stability.py
"""

import argparse
import json
import math
import multiprocessing
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # one process per core instead
import h5py  # noqa: E402
import numpy as np  # noqa: E402
from gmpy2 import mpfr, sqrt  # noqa: E402

from stability_cases import BAR, FAMILIES  # noqa: E402
from stability_models import aligned, bricks, invariants, modes, real, zeros  # noqa: E402
from stability_tumbling import TURNS, tumbled  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
QUANTITIES = ("f", "I0", "W1", "W2", "W3", "tumbling")
TOLD = {"FB311", "FB425", "FB510"}
SILENT = 3e-6  # three times what the diagnostics allow
HEAD = """<!-- Written by evidence/programs/make_stability.py -->

# Stability at the extremes

Decimal digits that `flexbody` {version} keeps of extreme bodies. Small models of bricks, tetrahedra and beams are made with 120 digits
and written to files; the eigenproblem, the invariants and the frame of the files' numbers are then computed once more with 120 digits. Each pair of columns
separates two errors:

* **in**: the error of the numbers in the files: exact results of the rounded matrices and coordinates, compared with exact results of the body. No program
  can be more exact.
* **out**: the additional error of `flexbody`: its results, compared with exact results of the same files.

`f` are the frequencies, the worst of all modes. I0, W1, W2, W3 are compared entry by entry relative to their Cauchy-Schwarz bounds ([theory](../../docs/theory.md#9-lumped-comparators) section 9)
in the frame of the file, the modes of eigenvalues within 10^-6 of each other turned into each other first; the worst entry counts. Modes whose eigenvalues
differ by a part g are known to 10^-16 / g at best, which explains `out` of W1 to W3 beside better frequencies. `tumbling` is the state (attitude, rates, deformation)
after the body tumbled free for {turns} periods of its first mode at a twentieth of its frequency about an axis between the principal ones, with the modes up to ten times the first.
16 stands for 16 or more. *told* lists warnings and notes of the run; *refused* is an error with its exit code, and no file.

Every file was checked against its model (`flexbody check --against`): all passed. No case has an error above 10^-6 in frequencies, I0 or W1, or from its files in W2 and W3,
without a warning that says so. Where rounding keeps the K-residuals above those that `standard` promises, modes are projected in twice the precision ([theory](../../docs/theory.md#8-modes), after (8.4)): most frequencies then keep
all digits of the files, and W2 and W3 the digits that the distance of the modes permits. Tumbling has no digits where the mass matrix of a bent needle is singular to double precision. `./scripts/make.sh pages stability`
writes this page, and fails if this is not so; `crates/body/tests/body/extremes.rs` tests these statements.

![digits kept against digits that the files hold](../images/stability.svg)
"""


def text(value, digits=17):
    return format(value, f".{digits - 1}e") if value else "0"


def save(folder, model, digits):
    """The files, matrices with so many digits; K, M and positions as a reader in double precision has them."""
    read = []
    for name, matrix in (("K", model.k), ("M", model.m)):
        lines, back = [], zeros(*matrix.shape)
        for i, j in zip(*np.nonzero(np.tril(matrix != 0))):
            entry = text(matrix[i, j], digits)
            back[i, j] = back[j, i] = mpfr(float(entry))
            lines.append(f"{i + 1} {j + 1} {entry}\n")
        size = len(matrix)
        (folder / f"{name}.mtx").write_text(f"%%MatrixMarket matrix coordinate real symmetric\n{size} {size} {len(lines)}\n" + "".join(lines))
        read.append(back)
    d = model.dimension
    written = [[text(v) for v in position[:d]] for position in model.x]
    x = zeros(*model.x.shape)
    for i, position in enumerate(written):
        x[i, :d] = [mpfr(float(v)) for v in position]
    (folder / "nodes.csv").write_text(f"node,{'x,y,z'[:2 * d - 1]}\n" + "".join(f"{i + 1},{','.join(p)}\n" for i, p in enumerate(written)))
    (folder / "dofs.csv").write_text("node,dir\n" + "".join(f"{i + 1},{k + 1}\n" for i, k in model.dofs))
    (folder / "model.toml").write_text(f'[model]\ndimension = {d}\n[files]\nstiffness = "K.mtx"\nmass = "M.mtx"\nnodes = "nodes.csv"\ndofs = "dofs.csv"\n')
    return *read, x


def worst(name, difference, inertia, plane):
    """The largest entry relative to its bound; of a plane body what belongs to the rotation about z."""
    size = np.array([sqrt(abs(inertia[k, k])) for k in range(3)], dtype=object)
    nf = difference.shape[1] // 3
    if name == "I0":
        bound = np.multiply.outer(size, size)
    elif name == "W1":
        bound = np.hstack([np.repeat([[size[k] + size[b]] for k in range(3)], nf, axis=1) for b in range(3)])
    else:
        bound = np.full(difference.shape, mpfr(1))
    part = np.ones(difference.shape, dtype=bool)
    if plane:
        rows = {"I0": [2], "W1": [2], "W2": range(2 * nf, 3 * nf), "W3": range(2 * difference.shape[1], 3 * difference.shape[1])}[name]
        columns = {"I0": [2], "W1": range(2 * nf, 3 * nf), "W2": range(2 * nf, 3 * nf), "W3": range(difference.shape[1])}[name]
        part[:] = False
        part[np.ix_(list(rows), list(columns))] = True
    return max(abs(d) / b for d, b in zip(difference[part], bound[part]))


def study(program, model, count, digits=17, options=()):
    """What a case keeps: for each quantity the errors `in` and `out`, the codes that were told; or the refusal."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        k, m, x = save(folder, model, digits)
        command = [program, "convert", "model.toml", "-o", "body.flex.h5", "--modes", str(count), "--frame", "principal", "--lumped", "none", *options]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        codes = sorted(set(re.findall(r"\[(FB\d+)\]", done.stderr)))
        if done.returncode:
            return {"exit": done.returncode, "codes": codes}
        checked = subprocess.run([program, "check", "body.flex.h5", "--against", "model.toml"], cwd=folder, capture_output=True, text=True)
        if checked.returncode:
            raise RuntimeError(f"the body fails its checks:\n{checked.stdout}{checked.stderr}")
        with h5py.File(folder / "body.flex.h5") as body:
            found = {name: real(body["invariants"][name][()]) for name in ("I0", "W1", "W2", "W3")}
            eigenvalues = real(body["modes/eigenvalue"][()])
            shapes = [real(body["modes/shape"][()]), real(body["modes/rotation"][()]) if "rotation" in body["modes"] else None]
            axes, origin = real(body["frame/axes"][()]), real(body["frame/origin"][()])
    nf = len(eigenvalues)
    own = zeros(len(model.dofs), nf)
    for row, (node, direction) in enumerate(model.dofs):
        own[row] = shapes[direction // 3][:, node].dot(axes[direction % 3])
    turn = np.kron(axes.T, real(np.eye(nf, dtype=int)))

    def exact(k, m, x):
        values, vectors = modes(k, m, model.dofs, x, model.dimension)
        vectors = aligned(values, m, vectors, own)
        data = invariants(m, model.dofs, x - origin, vectors)
        data = {"I0": axes.T.dot(data["I0"]).dot(axes), "W1": axes.T.dot(data["W1"]).dot(turn.T), "W2": turn.dot(data["W2"]).dot(turn.T), "W3": turn.dot(data["W3"])}
        return values[:nf], data

    (read_values, read), (true_values, true) = exact(k, m, x), exact(model.k, model.m, model.x)
    out = {"exit": 0, "codes": codes, "modes": nf}
    # An eigenvalue has twice the relative error of a frequency.
    out["f"] = [max(abs(a / b - 1) for a, b in zip(read_values, true_values)) / 2, max(abs(a / b - 1) for a, b in zip(eigenvalues, read_values)) / 2]
    for name, value in found.items():
        out[name] = [worst(name, d, true["I0"], model.dimension == 2) for d in (read[name] - true[name], value - read[name])]
    units = sqrt(np.trace(true["I0"])), true_values[0], int((true_values <= 100 * true_values[0]).sum())
    states = [tumbled(data, values, units, model.dimension) for data, values in ((true, true_values), (read, read_values), (found, eigenvalues))]
    out["tumbling"] = [float(np.abs(a - b).max()) for a, b in zip(states, states[1:])]
    return out


def studied(program, family, case):
    label, make, count, settings = FAMILIES[family][2][case]
    try:
        return study(program, make(), count, **settings)
    except Exception as error:
        raise RuntimeError(f"{FAMILIES[family][0]}: {label}") from error


def is_silent(found):
    """Whether more is wrong of a body than its diagnostics say."""
    if found["exit"] or TOLD & set(found["codes"]):
        return False
    # What is left of W2 and W3 between nearly repeated modes is a matter of the pair.
    errors = [sum(found[name]) for name in ("f", "I0", "W1")] + [found[name][0] for name in ("W2", "W3")]
    return max(errors) > SILENT


def kept(error):
    """Digits; none where there is no number."""
    return 16.0 if error < 1e-16 else max(0.0, -math.log10(error)) if error < 1 else 0.0


def cell(error):
    return f"{math.floor(10 * kept(error)) / 10:.3g}"


def table(rows):
    head = ["case", *(f"{name} {what}" for name in QUANTITIES for what in ("in", "out")), "told"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for label, found in rows:
        if found["exit"]:
            cells = [f"*refused*, exit code {found['exit']}", *[""] * (len(head) - 3), ", ".join(found["codes"])]
        else:
            cells = [*(cell(error) for name in QUANTITIES for error in found[name]), ", ".join(found["codes"])]
        lines.append("| " + " | ".join([label, *cells]) + " |")
    return lines

MOTION = {
    "spin": ("Spin", "The bar of three bricks with eight modes, a little bent, set spinning near its middle axis at this part of its first frequency and left alone for twenty periods. Where the "
             "centrifugal term outweighs the stiffness (from about the first frequency on) the body stretches until its moment of inertia has slowed it, by amounts that linear elasticity does not know: `largest` is "
             "the largest modal coordinate beside the size of the body, root of tr J. `gauss`: order 6, a tenth of the fastest mode's radian a step; `explicit`: order 8, tolerance 1e-12; `apart`: their states at the end; `nudged`: the states at the end of two explicit runs whose first bend differs by 10^-9 of it. Where both are of one size the motion is chaotic, and nobody follows it for long: energy and momentum are what is left to hold.",
             ("gauss", "explicit")),
    "step": ("Steps", "The same at a twentieth of the first frequency, with steps of this many radians of the fastest mode. Collocation is stable for every step that its equations can be solved for.", ("gauss2", "gauss4", "gauss6")),
    "deformation": ("Deformation", "The same, bent at the start by this part of its size in the first mode.", ("gauss", "explicit")),
    "steps": ("Number of steps", "Order 4, 0.3 radians of the fastest mode a step.", ("gauss4",)),
}


def motion(program, bar):
    """Tables of what examples/extreme_motion.rs says of a bar."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        save(folder, bar, 17)
        subprocess.run([program[0], "convert", "model.toml", "-o", "body.flex.h5", "--modes", "8", "--frame", "principal", "--quiet"], cwd=folder, check=True, capture_output=True)
        done = subprocess.run([program[1], "body.flex.h5"], cwd=folder, check=True, capture_output=True, text=True)
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    out = ["## Motion", "", "Relative drift of the energy and the angular momentum of a free body over the whole run, largest at twenty instants, by the integrators of the library "
           "(`examples/extreme_motion.rs`). A run that cannot go on ends with the reason; none goes on with numbers that are not finite.", ""]
    for family, (title, what, methods) in MOTION.items():
        own = [row for row in rows if row["family"] == family]
        apart = [key for key in ("apart", "nudged") if key in own[0]]
        head = [title.lower(), *(f"{m} {k}" for m in methods for k in ("energy", "angular momentum", "largest")), *apart]
        out += [f"### {title}", "", what, "", "| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
        for row in own:
            cells = [f"{row['case']:g}"]
            for method in methods:
                told = row[method]
                cells += [f"*ends*: {told['ends']}", "", ""] if "ends" in told else [f"{told['energy']:.0e}", f"{told['angular']:.0e}", f"{told['largest']:.2g}"]
            cells += ["" if row[a] is None else f"{row[a]:.0e}" for a in apart]
            out.append("| " + " | ".join(cells) + " |")
        out.append("")
    return out


def figure(results):
    """Digits in the results against digits that the files hold, as SVG."""
    side, unit = 420, 24
    place = lambda digits: 20 + unit * digits  # noqa: E731
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {side + 60} {side + 20}" font-family="sans-serif" font-size="12">',
           '<rect width="100%" height="100%" fill="white"/>']
    for digits in range(0, 17, 4):
        at, up = 40 + place(digits), side - place(digits)
        out.append(f'<path d="M{at} {side - place(0)}V{side - place(16)}M{40 + place(0)} {up}H{40 + place(16)}" stroke="#ddd"/>')
        out.append(f'<text x="{at}" y="{side - 2}" text-anchor="middle">{digits}</text><text x="{30 + place(0)}" y="{up + 4}" text-anchor="end">{digits}</text>')
    out.append(f'<path d="M{40 + place(0)} {side - place(0)}L{40 + place(16)} {side - place(16)}" stroke="#888" stroke-dasharray="4 4"/>')
    for name, colour in (("f", "#1f77b4"), ("W2", "#d62728")):
        for found in results:
            if not found["exit"]:
                x, y = (place(kept(error)) for error in found[name])
                out.append(f'<circle cx="{40 + x:.1f}" cy="{side - y:.1f}" r="3.5" fill="{colour}" fill-opacity="0.6"/>')
    out.append(f'<text x="{40 + side / 2}" y="{side + 15}" text-anchor="middle">digits that the files hold (in)</text>')
    out.append(f'<text transform="translate(16 {side / 2}) rotate(-90)" text-anchor="middle">digits that flexbody keeps of them (out)</text>')
    out.append(f'<text x="{45 + place(0)}" y="{side - place(15.4)}" fill="#1f77b4">frequencies</text><text x="{45 + place(0)}" y="{side - place(14.7)}" fill="#d62728">W2</text>')
    return "\n".join([*out, "</svg>"]) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    parser.add_argument("--program", default=str(target / "release" / "flexbody"), help="flexbody (default: the release build)")
    parser.add_argument("--output", type=Path, default=ROOT / "evidence/pages/stability.md")
    parser.add_argument("--motion", default=str(target / "release" / "examples" / "extreme_motion"), help="that example (default: the release build)")
    args = parser.parse_args()
    program = str(Path(args.program).resolve())  # it runs in another folder
    version = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout.split()[-1]
    out, silent = [HEAD.format(version=version, turns=TURNS)], []
    places = [(program, family, case) for family, (_, _, cases) in enumerate(FAMILIES) for case in range(len(cases))]
    with multiprocessing.get_context("fork").Pool() as pool:
        results = pool.starmap(studied, places, chunksize=1)
    for family, (title, what, cases) in enumerate(FAMILIES):
        rows = [(cases[case][0], found) for (_, of, case), found in zip(places, results) if of == family]
        silent += [f"{title}: {label}" for label, found in rows if is_silent(found)]
        out += [f"## {title}", "", what, "", *table(rows), ""]
    out += motion((program, str(Path(args.motion).resolve())), bricks((3, 1, 1), BAR))
    args.output.write_text("\n".join(out).rstrip() + "\n", encoding="utf-8")
    (ROOT / "evidence/images/stability.svg").write_text(figure(results), encoding="utf-8")
    if silent:
        sys.exit(f"errors above {SILENT:.0e} without a warning: {'; '.join(silent)}")
    print(args.output)


if __name__ == "__main__":
    main()
