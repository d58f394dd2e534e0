#!/usr/bin/env python3
"""Converts the models of fixtures/models and writes evidence/pages/accuracy.md: differences from the reference numbers beside the models.

    pip install numpy h5py
    cargo build --release --locked
    python3 evidence/programs/make_accuracy.py
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
SCHEMES = ("row-sum", "diagonal-scaling")
BLOCKS = (3000, 30000)
HEAD = """<!-- Written by evidence/programs/make_accuracy.py -->

# Accuracy

Results of `flexbody` {version} on the models in `fixtures/models`, compared with reference numbers (`expected.json`: scipy on the same
matrices, mass properties as plain sums; frequencies printed by CalculiX).
Written by `./scripts/make.sh pages accuracy`.
"""


def run(program, *arguments):
    done = subprocess.run([program, *map(str, arguments)], cwd=ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"flexbody {' '.join(map(str, arguments))} ended with {done.returncode}:\n{done.stderr}{done.stdout}")
    return json.loads(done.stdout)["results"]


def relative(found, expected):
    found, expected = np.asarray(found, float), np.asarray(expected, float)
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def evaluate(program, folder, scratch):
    """Everything the tables show of one model."""
    expected = json.loads((folder / "expected.json").read_text())
    values = np.array(expected["flexible_eigenvalues"])
    path = scratch / f"{folder.name}.flex.h5"
    report = run(program, "convert", folder / "model.toml", "-o", path, "--modes", len(values), "--json")
    identities = run(program, "check", path, "--against", folder / "model.toml", "--json")
    rigid, norms = expected["rigid_body"], expected["invariant_norms"]
    with h5py.File(path) as body:
        axes, data = body["frame/axes"][()], body["invariants"]
        inertia = axes @ data["I0"][()] @ axes.T
        mass = float(data["mass"][0])
        radius = np.sqrt(np.trace(rigid["inertia_com"]) / 2 / rigid["mass"])
        found = {name: body["modes"][name][()] for name in ("eigenvalue", "frequency_hz", "residual")}
        sizes = {"consistent": {name: np.linalg.norm(data[name][()]) for name in ("I0", "W1", "W2", "W3")}}
        errors, negative = {}, {}
        for scheme in SCHEMES:
            sizes[scheme] = {name: np.linalg.norm(body[f"lumped/{scheme}/{name}"][()]) for name in ("W1", "W2", "W3")}
            errors[scheme] = dict(body[f"comparison/{scheme}"].attrs)
            negative[scheme] = (int(body[f"lumped/{scheme}"].attrs["negative_masses"]), expected["lumped"][scheme]["negative_nodal_masses"])
        pivots = (int(body["certificate"].attrs["negative_pivots"]), 6 + len(values))
        proved = int(body["certificate"].attrs["proved"]) == 1
        origin = body["frame/origin"][()]
    assert len(found["eigenvalue"]) == len(values) == norms["modes"], folder.name
    return {
        "name": folder.name,
        "element": expected["element"],
        "dofs": expected["n_dofs"],
        "modes": len(values),
        "eigenvalue": float(np.abs(found["eigenvalue"] / values - 1).max()),
        "calculix": float(np.abs(found["frequency_hz"] / expected["calculix_frequencies_hz"] - 1).max()),
        "residual": float(found["residual"].max()),
        "reference_residual": expected["eigenvalue_facts"]["residual_max"],
        "noise": report["completeness"]["rigid_noise"],
        "proved": proved,
        "pivots": pivots,
        "mass": abs(mass / rigid["mass"] - 1),
        "com": float(np.linalg.norm(origin - rigid["com"]) / radius),
        "inertia": relative(inertia, rigid["inertia_com"]),
        "invariants": {name: abs(size / norms["consistent"][name] - 1) for name, size in sizes["consistent"].items()},
        "lumped": {s: max(abs(size / norms[s][name] - 1) for name, size in sizes[s].items()) for s in SCHEMES},
        "errors": errors,
        "negative": negative,
        "identities": identities,
    }


def general(program, folder, scratch):
    """A model with nodal rotations, inner rows or eliminated constraints beside the dense general products of its reference."""
    expected = json.loads((folder / "expected.json").read_text())
    values = np.array(expected["flexible_eigenvalues"])
    path = scratch / f"{folder.name}.flex.h5"
    report = run(program, "convert", folder / "model.toml", "-o", path, "--modes", len(values), "--json")
    checks = checks_of(run(program, "check", path, "--against", folder / "model.toml", "--json"))
    reference = {name: np.array(a) for name, a in expected["invariants"].items()}
    nf = len(values)
    with h5py.File(path) as body:
        data = {name: body["invariants"][name][()] for name in ("I0", "C1", "W1", "W2", "W3")}
        # e_b x C1_j where the mass commutes with rotations.
        data["W0"] = body["invariants/W0"][()] if "W0" in body["invariants"] else np.hstack([np.cross(e, data["C1"].T).T for e in np.eye(3)])
        found, mass = body["modes/eigenvalue"][()], float(body["invariants/mass"][0])
        proved = int(body["certificate"].attrs["proved"]) == 1
    if expected["dimension"] == 2:  # nothing but the rotation about z is known
        z, block = slice(2, 3), slice(2 * nf, 3 * nf)
        parts = {"I0": (z, z), "W0": (slice(0, 2), block), "W1": (z, block), "W2": (block, block), "W3": (block, slice(nf))}
    else:
        parts = {name: (slice(None), slice(None)) for name in ("I0", "W0", "W1", "W2", "W3")}
    size = {"I0": np.trace(reference["I0"]), "W0": math.sqrt(mass), "W1": math.sqrt(np.trace(reference["I0"])), "W2": 1.0, "W3": 1.0}
    norms = {name: abs(np.linalg.norm(data[name][part]) - np.linalg.norm(reference[name][part])) / size[name] for name, part in parts.items()}
    return {
        "name": folder.name, "element": expected["element"], "dofs": expected["n_dofs"], "structure": report["model"]["mass_structure"],
        "eigenvalue": float(np.abs(found / values - 1).max()), "mass": abs(mass / expected["rigid_body"]["mass"] - 1), "norms": norms,
        "proved": proved, "checks": (sum(c["passed"] for c in checks), len(checks)),
    }


def certified(program, folder, scratch):
    """What accuracy `certified` guarantees of one model, and what it costs against `standard` on one thread."""
    found = {}
    for accuracy in ("standard", "certified"):
        report = run(program, "convert", folder / "model.toml", "-o", scratch / "certified.flex.h5", "--accuracy", accuracy,
                     "--lumped", "none", "--threads", 1, "--json")
        seconds = {phase["name"]: phase["cpu_seconds"] for phase in report["run"]["phases"]}
        # Reading and writing are the same for both.
        work = sum(value for name, value in seconds.items() if name not in ("reading", "checks", "writing"))
        found[accuracy] = {"report": report, "work": work, "counters": report["run"]["counters"]}
    report = found["certified"]["report"]
    guarantee = report["guarantee"]
    checks = checks_of(run(program, "check", scratch / "certified.flex.h5", "--against", folder / "model.toml", "--json"))
    name, digits = min(guarantee["invariant_digits"].items(), key=lambda item: item[1])
    return {
        "name": folder.name,
        "dofs": report["model"]["n_dofs"],
        "modes": report["modes"]["count"],
        "width": max(b / a - 1 for a, b in zip(guarantee["eigenvalue_lower"], guarantee["eigenvalue_upper"])),
        "digits": min(guarantee["eigenvalue_digits"]),
        "shape": max(guarantee["shape_error"]),
        "invariants": f"{math.floor(10 * digits) / 10} ({name})",
        "counts": (guarantee["negative_pivots_below"], report["completeness"]["negative_pivots"]),
        "checks": (sum(c["passed"] for c in checks), len(checks)),
        "factorisations": tuple(found[a]["counters"]["factorizations"] for a in ("standard", "certified")),
        "work": tuple(found[a]["work"] for a in ("standard", "certified")),
    }


def table(head, rows):
    return ["| " + " | ".join(head) + " |", "|" + "---|" * len(head), *("| " + " | ".join(row) + " |" for row in rows), ""]


def digits(value):
    return "0" if value == 0 else f"{value:.1e}"


def percent(value):
    if value < 1e-12:  # rounding
        return "0"
    return f"{100 * value:.2g} %" if value < 1 else f"{100 * value:.0f} %"


def checks_of(found):
    """Identity checks in the JSON of `flexbody check`."""
    return found["identities"]


def page(models, others, certificates, version):
    out = [HEAD.format(version=version), "## Modes", "",
           "Largest relative differences over all modes. CalculiX prints seven digits and splits the repeated frequencies of the cube in the last of them. The residual is |K psi - lambda M psi| / (|K psi| + |lambda M psi|), the noise "
           "the stiffness of rigid motion that the digits of K leave, relative to the first eigenvalue. The count of negative pivots must be six plus the number of modes.", ""]
    out += table(["model", "element", "DOF", "modes", "eigenvalues, scipy", "frequencies, CalculiX", "worst residual", "scipy's residual", "noise", "negative pivots", "complete"],
                 [[m["name"], m["element"], f"{m['dofs']:,}", str(m["modes"]), digits(m["eigenvalue"]), digits(m["calculix"]), digits(m["residual"]),
                   digits(m["reference_residual"]), digits(m["noise"]), f"{m['pivots'][0]} of {m['pivots'][1]}", "proved" if m["proved"] else "not proved"] for m in models])
    out += ["## Mass properties and invariants", "",
            "Mass and inertia relative, centre of mass relative to the radius of gyration. Frobenius norms of the invariants relative to the reference's: they do not "
            "depend on axes, signs or the basis of repeated eigenvalues.", ""]
    out += table(["model", "mass", "centre of mass", "inertia", "I0", "W1", "W2", "W3", "row-sum W", "diagonal-scaling W"],
                 [[m["name"], *(digits(m[k]) for k in ("mass", "com", "inertia")), *(digits(m["invariants"][k]) for k in ("I0", "W1", "W2", "W3")),
                   *(digits(m["lumped"][s]) for s in SCHEMES)] for m in models])
    out += ["## Errors of lumped masses", "", "Error norms of [theory](../../docs/theory.md) section 9 (`max`: largest entry, otherwise spectral norm), same modes. Rounding counts as 0.", ""]
    rows = []
    for m in models:
        for s in SCHEMES:
            e = m["errors"][s]
            rows.append([m["name"], s, "{0} (reference {1})".format(*m["negative"][s]), percent(e["com_shift"]), percent(e["I0_max"]),
                         *(percent(e[f"{k}_spectral"]) for k in ("I0", "W1", "W2", "W3", "modal_mass", "C2"))])
    out += table(["model", "scheme", "negative masses", "centre of mass", "I0 (max)", "I0", "W1", "W2", "W3", "modal mass", "C2"], rows)
    out += ["## Identities", "", "`flexbody check --against model.toml`: number of fulfilled identities, and the identity closest to its limit.", ""]
    rows = []
    for m in models:
        checks = checks_of(m["identities"])
        worst = max((c for c in checks if c["limit"] > 0), key=lambda c: c["value"] / c["limit"])
        rows.append([m["name"], f"{sum(c['passed'] for c in checks)} of {len(checks)}", f"`{worst['name']}`: {digits(worst['value'])} of {digits(worst['limit'])}"])
    out += table(["model", "hold", "closest"], rows)
    out += ["## Nodal rotations, constraints, internal rows", "",
            "Models of elements written for the purpose (`fixtures/make/make_general.py`), compared with dense products of [theory](../../docs/theory.md) section 6 by numpy: beams and shells, a "
            "rigid connection eliminated in the matrices, bubbles and hierarchical functions without coordinates, massless rotations and spring ends. Frobenius norms about the centre of mass, "
            "relative to what the Cauchy-Schwarz inequality allows.", ""]
    out += table(["model", "element", "DOF", "mass structure", "eigenvalues, scipy", "mass", "I0", "W0", "W1", "W2", "W3", "complete", "identities hold"],
                 [[m["name"], m["element"], f"{m['dofs']:,}", m["structure"], digits(m["eigenvalue"]), digits(m["mass"]),
                   *(digits(m["norms"][k]) for k in ("I0", "W0", "W1", "W2", "W3")), "proved" if m["proved"] else "not proved", "{0} of {1}".format(*m["checks"])]
                  for m in others])
    out += ["## Accuracy `certified`", "",
            "Guarantees of [theory](../../docs/theory.md) section 8 and their cost: lower and upper bounds of every eigenvalue, of the error of every mode, of the rounding in every "
            "invariant; 20 modes. The blocks come from `benches/make_block.py`. CPU time of one thread, without reading and writing.", ""]
    out += table(["model", "DOF", "widest bounds", "digits of eigenvalues", "shape error", "digits of invariants", "counts below and above", "check", "factorisations",
                  "CPU s, `standard`", "CPU s, `certified`", "ratio"],
                 [[c["name"], f"{c['dofs']:,}", digits(c["width"]), str(math.floor(10 * c["digits"]) / 10), digits(c["shape"]), c["invariants"],
                   "{0} and {1}".format(*c["counts"]), "{0} of {1}".format(*c["checks"]), "{0}, {1}".format(*c["factorisations"]),
                   *(f"{w:.2g}" for w in c["work"]), f"{c['work'][1] / c['work'][0]:.1f}"] for c in certificates])
    return "\n".join(out).rstrip() + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    parser.add_argument("--program", default=str(target / "release" / "flexbody"), help="flexbody (default: the release build)")
    parser.add_argument("--output", type=Path, default=ROOT / "evidence/pages/accuracy.md")
    args = parser.parse_args()
    folders = sorted(f.parent for f in (ROOT / "fixtures" / "models").glob("*/matrices.inp.gz"))
    rest = sorted(f.parent for f in (ROOT / "fixtures" / "models").glob("*/expected.json") if f.parent not in folders)
    version = subprocess.run([args.program, "--version"], capture_output=True, text=True, check=True).stdout.split()[-1]
    with tempfile.TemporaryDirectory() as scratch:
        models = [evaluate(args.program, folder, Path(scratch)) for folder in folders]
        others = [general(args.program, folder, Path(scratch)) for folder in rest]
        for dofs in BLOCKS:
            block = Path(scratch) / f"block, {dofs // 1000}k"
            subprocess.run([sys.executable, ROOT / "benches" / "make_block.py", block, "--dofs", str(dofs)], check=True, stdout=subprocess.DEVNULL)
            folders.append(block)
        certificates = [certified(args.program, folder, Path(scratch)) for folder in folders]
    args.output.write_text(page(models, others, certificates, version), encoding="utf-8")
    print(args.output)


if __name__ == "__main__":
    main()
