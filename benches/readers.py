#!/usr/bin/env python3
"""Measures how fast the matrices of FE programs are read, and with how much memory, and writes it into evidence/pages/performance.md.

    pip install numpy
    cargo build --release --locked
    python3 benches/readers.py                     needs a quiet machine, and 2 GB of disk

Each model has one node in the wrong place (benches/make_job.py --misplaced): `prepare` reads all files and ends at its check of rigid motion, with exit code 2 (`convert`
looks for the order of elimination beside its checks, which is no reading). What is measured is that whole process on two threads, fingerprints of the files and the check included. Memory is beside that of K and M in compressed columns.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
from statistics import median

import performance
import performance_page

MAIN_FILES = {"mtx": "model.toml", "op4-text": "job.bdf", "op4": "job.bdf", "dmig": "job.bdf"}
# Degrees of freedom of a cube, by form; a stiffness matrix of CalculiX of more than a gigabyte.
CASES = [(form, 100_000) for form in ("mtx", "calculix", "abaqus", "abaqus-labels", "op4-text", "op4", "dmig")] + [("calculix", 986_000)]


def measure(args, form, dofs):
    folder = args.models / f"{form}-{dofs}"
    maker = [args.python, performance.BENCHES / "make_job.py", folder, "--form", form, "--dofs", dofs, "--misplaced"]
    subprocess.run(list(map(str, maker)), check=True)
    units = [] if form == "mtx" else ["--units", "m,kg,s"]
    words = [args.program, "prepare", folder / MAIN_FILES.get(form, "job.inp"), *units, "--quiet", "--json", "-o", folder / "prepared"]
    try:
        size = sum(file.stat().st_size for file in folder.iterdir()) / 1e6
        runs = []
        for _ in range(args.runs):
            text, run = performance.measured(words, allowed=(2,))
            found = [one["code"] for one in json.loads(text)["diagnostics"] if one["severity"] == "error"]
            if found != ["FB410"]:
                sys.exit(f"{form}: expected FB410 alone, found {found}")
            runs.append(run)
        cells = round((dofs / 3) ** (1 / 3)) - 1
        # Node pairs of a cube of so many nodes along each edge; blocks of K are full, those of M diagonal.
        pairs = (3 * (cells + 1) - 2) ** 3
        kept = 12e-6 * (9 + 3) * pairs
        return {"form": form, "dofs": 3 * (cells + 1) ** 3, "files_mb": round(size), "kept_mb": round(kept)} | {
            key: round(median(run[key] for run in runs), 2) for key in ("cpu_s", "wall_s", "memory_mb")}
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def main():
    os.environ["RAYON_NUM_THREADS"] = "2"  # `prepare` takes what there is
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    target = performance.ROOT / "target"
    parser.add_argument("--runs", type=int, default=3, help="runs of each form (default: 3)")
    parser.add_argument("--models", type=performance.Path, default=target / "bench-models", help="folder for the models")
    parser.add_argument("--program", type=performance.Path, default=target / "release" / "flexbody", help="flexbody (default: the release build)")
    parser.add_argument("--python", default=str(target / "peers" / "bin" / "python"), help="interpreter with numpy (default: target/peers)")
    args = parser.parse_args()
    args.models = args.models.resolve()
    args.models.mkdir(parents=True, exist_ok=True)
    rows = []
    for form, dofs in CASES:
        rows.append(measure(args, form, dofs))
        performance.log(str(rows[-1]))
    store = performance.BENCHES / "results.json"
    results = json.loads(store.read_text())
    results["readers"] = {"machine": performance.machine(), "commit": performance.commit(), "runs": args.runs, "rows": rows}
    store.write_text(json.dumps(results, indent=1) + "\n")
    (performance.ROOT / "evidence/pages/performance.md").write_text(performance_page.render(results), encoding="utf-8")


if __name__ == "__main__":
    main()
