#!/usr/bin/env python3
"""Measures a whole conversion of a block of hexahedra, and where they are installed the peers of benches/peers/; writes docs/speed.md.

    pip install numpy                                   (benches/make_block.py needs it)
    cargo build --release --locked
    python3 benches/speed.py                            [--exudyn PYTHON] [--slepc PYTHON]

CPU seconds are user + system of the whole process. Peers are skipped, and the page says so, when their interpreter
cannot import them; benches/peers/README.md installs them. Measure on a quiet machine.
"""

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PEERS = ROOT / "benches" / "peers"

# Measured earlier on the 99,636 DOF block, 20 modes, one thread, on a quiet machine; shown when a peer is not run.
REFERENCE_DOFS = 99636
REFERENCE = {
    "exudyn": ("Exudyn 1.13.6, whole conversion (modes 412, set-up 31, invariants 5)", 412 + 31 + 5, 6800),
    "slepc": ("SLEPc with MUMPS, modes alone", 22, 1100),
}


def measured(command, env=None):
    """Runs a command: its standard output, and user + system CPU seconds, wall seconds, peak resident MB of its process."""
    began = time.perf_counter()
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        process = subprocess.Popen(command, stdout=out, stderr=err, env=env)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        wall = time.perf_counter() - began
        out.seek(0)
        err.seek(0)
        if process.returncode != 0:
            sys.exit(f"{' '.join(map(str, command))} ended with {process.returncode}:\n{err.read().decode()}{out.read().decode()}")
        text = out.read().decode()
    kib = used.ru_maxrss / (1024 if sys.platform == "darwin" else 1)
    return text, {"cpu": used.ru_utime + used.ru_stime, "wall": wall, "memory": kib * 1024 / 1e6}


def median(runs, key):
    return statistics.median(run[key] for run in runs)


def convert(args, folder):
    """Runs of flexbody: figures, and the report of each."""
    command = [args.program, "convert", folder / "model.toml", "-o", folder / "body.flex.h5", "--modes", str(args.modes),
               "--threads", str(args.threads), "--json"]
    runs = []
    for i in range(args.repeat):
        text, run = measured(command)
        run["report"] = json.loads(text)
        print(f"flexbody {i + 1}/{args.repeat}: {run['cpu']:.2f} CPU s, {run['memory']:.0f} MB", file=sys.stderr)
        runs.append(run)
    return runs


def can_import(python, module, env):
    try:
        return subprocess.run([python, "-c", f"import {module}, scipy, numpy"], env=env, capture_output=True).returncode == 0
    except OSError:
        return False


def peer(name, args, folder, reference):
    """Runs of a peer, empty when it is not installed: CPU seconds of the phases that count, peak memory, agreement."""
    python = getattr(args, name)
    module, script, modes, left_out = {
        "exudyn": ("exudyn", "exudyn_convert.py", args.modes, {"import"}),
        "slepc": ("slepc4py", "slepc_modes.py", args.modes + 6, {"import", "read", "set_up"}),
    }[name]
    env = dict(os.environ, OMP_NUM_THREADS="1")
    if not can_import(python, module, env):
        print(f"{name}: skipped, {python} cannot import {module}, scipy and numpy", file=sys.stderr)
        return []
    runs = []
    for i in range(args.peer_repeat):
        text, whole = measured([python, PEERS / script, folder, "--modes", str(modes)], env)
        found = json.loads(text[text.index("{"):])
        phases = {k: v for k, v in found["phases"].items() if k not in left_out}
        runs.append({
            "cpu": sum(p["cpu_s"] for p in phases.values()),
            "wall": sum(p["wall_s"] for p in phases.values()),
            "memory": found["peak_rss_mib"] * 1.048576,
            "phases": phases,
            "versions": found["versions"],
            "difference": max(abs(a / b - 1) for a, b in zip(found["frequencies_hz"], reference)),
            "residual": found["residual_max"],
        })
        print(f"{name} {i + 1}/{args.peer_repeat}: {runs[-1]['cpu']:.2f} CPU s ({whole['cpu']:.2f} with the rest)", file=sys.stderr)
    return runs


def machine():
    def field(path, key):
        try:
            lines = Path(path).read_text().splitlines()
        except OSError:
            return "unknown"
        return next((line.split(":", 1)[1].strip() for line in lines if line.startswith(key)), "unknown")
    memory = field("/proc/meminfo", "MemTotal").split()
    size = f"{int(memory[0]) * 1024 / 1e9:.0f} GB" if len(memory) == 2 else "unknown"
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return f"{field('/proc/cpuinfo', 'model name')}, {cores} cores for this process, {size} memory, {platform.system()} {platform.machine()}"


def number(value):
    return f"{value:.2f}" if value < 10 else f"{value:.1f}" if value < 100 else f"{value:.0f}"


def modes_alone(runs):
    """Median CPU seconds of everything between the checked model and its modes, without the proof of completeness."""
    wanted = ("ordering", "factorisation", "modes", "dense eigenproblem")
    sums = [sum(p["cpu_seconds"] for p in r["report"]["run"]["phases"] if p["name"] in wanted) for r in runs]
    return statistics.median(sums)


def page(args, block, runs, peers, load):
    report, cpu, memory = runs[0]["report"], median(runs, "cpu"), median(runs, "memory")
    spread = f"{min(r['cpu'] for r in runs):.2f} to {max(r['cpu'] for r in runs):.2f}"
    alone = modes_alone(runs)
    options = " ".join(args.shown)
    lines = [
        "<!-- Written by benches/speed.py -->", "", "# Speed", "",
        f"`python3 benches/speed.py{' ' + options if options else ''}`, version {report['generator'].split()[-1]}.", "",
        f"* model: block {' x '.join(map(str, block['lengths']))} m, {' x '.join(map(str, block['cells']))} 8-node hexahedra, {block['dofs']} degrees of "
        f"freedom, {block['stiffness_entries']} entries in K; Matrix Market text (`benches/make_block.py`)",
        f"* job: {args.modes} flexible modes, from the files to the flex-body file, `--threads {args.threads}`; proof of completeness and both lumped comparisons included",
        f"* machine: {machine()}; load {load:.1f} when the measurement began",
        f"* medians of {args.repeat} runs of flexbody" + (f" and {args.peer_repeat} of each peer" if any(peers.values()) else ""),
        "", "## Whole process", "",
        "| program | CPU s | wall s | peak memory, MB | CPU ratio | memory ratio |", "|---|---|---|---|---|---|",
        f"| flexbody, whole process | {number(cpu)} ({spread}) | {number(median(runs, 'wall'))} | {number(memory)} | 1 | 1 |",
        f"| flexbody, ordering + factorisation + modes | {number(alone)} | | | | |",
    ]
    names = {"exudyn": "Exudyn, whole conversion", "slepc": "SLEPc with MUMPS, factor + modes"}
    for name, found in peers.items():
        if found:
            ratio = median(found, "cpu") / (cpu if name == "exudyn" else alone)
            to = "" if name == "exudyn" else " (to the modes)"
            lines.append(f"| {names[name]} | {number(median(found, 'cpu'))} | {number(median(found, 'wall'))} | {number(median(found, 'memory'))} | "
                         f"{number(ratio)}{to} | {number(median(found, 'memory') / memory)} |")
    lines += ["", "CPU ratio: CPU seconds over those of flexbody; above 1 flexbody needs less. Peers leave out their imports; SLEPc does no more than the modes."]
    skipped = [name for name, found in peers.items() if not found]
    if skipped:
        lines += ["", "## Reference measured earlier", "",
                  f"Not run here: {' and '.join(names[name].split(',')[0] for name in skipped)}. Figures measured earlier, on a quiet machine, on the block of "
                  f"{REFERENCE_DOFS} degrees of freedom with 20 modes, one thread:", "",
                  "| program | CPU s | peak memory, MB | CPU ratio | memory ratio |", "|---|---|---|---|---|"]
        same = block["dofs"] == REFERENCE_DOFS and args.modes == 20
        for name in skipped:
            title, seconds, megabytes = REFERENCE[name]
            to, base = ("", cpu) if name == "exudyn" else (" (to the modes)", alone)
            ratios = f"{number(seconds / base)}{to} | {number(megabytes / memory)}" if same else "other model | other model"
            lines.append(f"| {title} | {seconds} | {megabytes} | {ratios} |")
    lines += ["", "## Phases of flexbody", "", "| phase | CPU s | wall s |", "|---|---|---|"]
    for i, phase in enumerate(report["run"]["phases"]):
        of = [r["report"]["run"]["phases"][i] for r in runs]
        lines.append(f"| {phase['name']} | {statistics.median(p['cpu_seconds'] for p in of):.2f} | {statistics.median(p['wall_seconds'] for p in of):.2f} |")
    counters = ", ".join(f"{key.replace('_', ' ')} {value}" for key, value in report["run"]["counters"].items())
    lines += ["", f"Work: {counters}. Worst residual {report['modes']['worst_residual']:.1e}. Completeness: {report['completeness']['sentence']}."]
    for name, found in peers.items():
        if found:
            versions = ", ".join(f"{key} {value}" for key, value in found[0]["versions"].items())
            phases = ", ".join(f"{key} {value['cpu_s']:.1f}" for key, value in found[0]["phases"].items())
            lines += ["", f"{names[name].split(',')[0]} ({versions}): CPU s by phase {phases}; worst residual {found[0]['residual']:.1e}; frequencies agree with "
                      f"flexbody to {max(r['difference'] for r in found):.1e}."]
    return "\n".join(lines + [""])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    parser.add_argument("--dofs", type=int, default=100000, help="about this many degrees of freedom")
    parser.add_argument("--modes", type=int, default=20)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--repeat", type=int, default=5, help="runs of flexbody")
    parser.add_argument("--peer-repeat", type=int, default=1, help="runs of each peer")
    parser.add_argument("--program", default=str(target / "release" / "flexbody"), help="flexbody (default: the release build)")
    parser.add_argument("--exudyn", default="/tmp/exudyn/bin/python", metavar="PYTHON", help="interpreter that has Exudyn")
    parser.add_argument("--slepc", default="/usr/bin/python3", metavar="PYTHON", help="interpreter that has slepc4py")
    parser.add_argument("--output", type=Path, default=ROOT / "docs" / "speed.md")
    args = parser.parse_args()
    if min(args.repeat, args.peer_repeat) < 1:
        parser.error("at least one run")
    args.shown = [f"--{key.replace('_', '-')} {getattr(args, key)}" for key in ("dofs", "modes", "threads", "repeat", "peer_repeat")
                  if getattr(args, key) != parser.get_default(key)]
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "block"
        made, _ = measured([sys.executable, ROOT / "benches" / "make_block.py", folder, "--dofs", str(args.dofs)])
        runs = convert(args, folder)
        reference = runs[0]["report"]["modes"]["frequency_hz"]
        peers = {name: peer(name, args, folder, reference) for name in ("exudyn", "slepc")}
    args.output.write_text(page(args, json.loads(made), runs, peers, load), encoding="utf-8")
    print(args.output)


if __name__ == "__main__":
    main()
