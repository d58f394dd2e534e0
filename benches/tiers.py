#!/usr/bin/env python3
"""Measures what each `--accuracy` costs and gives, and writes it into evidence/pages/performance.md.

    pip install numpy
    cargo build --release --locked
    python3 benches/tiers.py --cases block-100k cube-300k      needs a quiet machine

The tiers of a case run in turns, whole processes on two threads. Errors are those beside `certified` where that was run, else beside `standard`: the largest
relative difference of a frequency, and the largest error norm of an invariant that `flexbody compare` finds.
"""

import argparse
import json
import shutil
import subprocess
from dataclasses import dataclass
from statistics import median

import performance
import performance_page

# What `compare` calls the constants of the equations of motion that hang on the modes.
INVARIANTS = ("C1", "Ibar (W1, C2)", "S (W2, W3, m_ff)")


@dataclass(frozen=True)
class Case:
    model: performance.Case
    tiers: tuple
    modes: int = performance.MODES


ALL = ("fast", "standard", "certified")
# Without certified bounds: a million rows have no room for them in a workstation, rotations of nodes have none at all.
MODES_ALONE = ("fast", "standard")
CASES = {
    **{name: Case(performance.CASES[name], ALL) for name in ("block-100k", "cube-100k", "tet10-100k", "plate-50k", "cube-300k")},
    "block-100k-200-modes": Case(performance.CASES["block-100k"], MODES_ALONE, modes=200),
    "shell-200k": Case(performance.CASES["shell-200k"], MODES_ALONE),
    "frame-200k": Case(performance.Case("make_frame.py", (), 220000), MODES_ALONE),
    "lattice-200k": Case(performance.Case("make_frame.py", ("--elements", "1"), 200000), MODES_ALONE),
    "cube-1m": Case(performance.CASES["cube-1m"], MODES_ALONE),
    "cube-3m": Case(performance.Case("make_block.py", (*performance.CUBE, "--cells", "99", "99", "99"), 3000000), MODES_ALONE),
}


def convert(args, folder, tier, modes):
    body = folder / f"{tier}.flex.h5"
    words = [args.program, "convert", folder / "model.toml", "-o", body, "--modes", modes, "--threads", 2, "--accuracy", tier, "--json", "--quiet"]
    text, run = performance.after_warm_up(words)
    told = performance.parsed(text)["results"]
    phases = {phase["name"]: round(phase["wall_seconds"], 2) for phase in told["run"]["phases"]}
    said = told["completeness"]["sentence"]
    return run, {"residual": told["modes"]["worst_residual"], "frequencies_hz": told["modes"]["frequency_hz"], "phases": phases,
                 "without_factor": "multigrid" in phases, "completeness": said}


def beside(args, folder, tier, reference):
    """The largest difference of an invariant, in the norms of `flexbody compare`."""
    words = [args.program, "compare", folder / f"{reference}.flex.h5", folder / f"{tier}.flex.h5", "--json", "--quiet"]
    # Exit code 1 where the bodies differ, as tiers do.
    rows = json.loads(subprocess.run(list(map(str, words)), capture_output=True, text=True).stdout)["results"]["rows"]
    return max(row["difference"] for row in rows if row["quantity"] in INVARIANTS)


def measure(args, name):
    case, folder = CASES[name], args.models / name
    tiers, model = case.tiers, performance.make_model(args, case.model, folder)
    runs, told = {tier: [] for tier in tiers}, {}
    try:
        for turn in range(1 if model["dofs"] > 500000 else args.runs):
            for tier in tiers if turn % 2 == 0 else reversed(tiers):
                run, told[tier] = convert(args, folder, tier, case.modes)
                runs[tier].append(run)
                performance.log(f"  {tier}: {run['cpu_s']:.1f} CPU s, {run['wall_s']:.1f} s, {run['memory_mb']:.0f} MB")
        reference = tiers[-1]
        exact = told[reference]["frequencies_hz"]
        found = {}
        for tier in tiers:
            figures = {key: round(median(run[key] for run in runs[tier]), 2) for key in ("cpu_s", "wall_s", "memory_mb")}
            own = told[tier].pop("frequencies_hz")
            errors = {} if tier == reference else {"frequency": max(abs(f / g - 1) for f, g in zip(own, exact, strict=True)), "invariant": beside(args, folder, tier, reference)}
            found[tier] = figures | told[tier] | errors
        return {"dofs": model["dofs"], "runs": len(runs[reference]), "reference": reference, "tiers": found}
    finally:
        if not args.keep:
            shutil.rmtree(folder, ignore_errors=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    target = performance.ROOT / "target"
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES), metavar="CASE", help=f"of {', '.join(CASES)} (default: all)")
    parser.add_argument("--runs", type=int, default=3, help="runs of each tier; a million rows make one (default: 3)")
    parser.add_argument("--keep", action="store_true", help="leave the models where they are")
    parser.add_argument("--models", type=performance.Path, default=target / "bench-models", help="folder for the models (needs 6 GB)")
    parser.add_argument("--program", type=performance.Path, default=target / "release" / "flexbody", help="flexbody (default: the release build)")
    parser.add_argument("--python", default=str(target / "peers" / "bin" / "python"), help="interpreter with numpy (default: target/peers)")
    args = parser.parse_args()
    args.quick, args.models = False, args.models.resolve()
    args.models.mkdir(parents=True, exist_ok=True)
    store = performance.BENCHES / "results.json"
    for name in args.cases:
        performance.log(name)
        found = measure(args, name) | {"machine": performance.machine(), "commit": performance.commit()}
        results = json.loads(store.read_text())
        results.setdefault("tiers", {})[name] = found
        results["tiers"] = {key: results["tiers"][key] for key in CASES if key in results["tiers"]}
        store.write_text(json.dumps(results, indent=1) + "\n")
        (performance.ROOT / "evidence/pages/performance.md").write_text(performance_page.render(results), encoding="utf-8")


if __name__ == "__main__":
    main()
