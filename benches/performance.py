#!/usr/bin/env python3
"""Measures whole conversions and the peers of benches/peers/ side by side, and the floors of this machine; writes evidence/pages/performance.md.

    python3 -m venv target/peers && target/peers/bin/pip install numpy scipy    (benches/peers/README.md: the peers themselves)
    cargo build --release --locked
    python3 benches/performance.py --quick                        small models, a minute: does everything work?
    python3 benches/performance.py                                all of it, hours, on a quiet machine
    python3 benches/performance.py --cases block-100k --peers slepc
    python3 benches/performance.py --render-only                  evidence/pages/performance.md from benches/results.json

Programs take turns, in alternating order. flexbody is charged for its whole process: reading Matrix Market text, checks, proof of
completeness, lumped comparison, flex-body file. Peers get the matrices as arrays for nothing and are charged for
what follows; SLEPc and scipy make the modes alone. What a run measured replaces what benches/results.json had of the same
case, program and thread count; all the rest stays. Peers that are not installed are left out, with a message.
"""

import argparse
import datetime
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import performance_page

ROOT = Path(__file__).resolve().parents[1]
BENCHES = ROOT / "benches"
MODES = 20
RESIDUAL = 1e-9  # asked of everyone
AGREEMENT = 1e-8  # of frequencies
DEBIAN = {"PETSC_DIR": "/usr/lib/petscdir/petsc3.18/x86_64-linux-gnu-real", "SLEPC_DIR": "/usr/lib/slepcdir/slepc3.18/x86_64-linux-gnu-real"}


@dataclass(frozen=True)
class Case:
    maker: str
    options: tuple
    dofs: int
    peers: dict = field(default_factory=dict)  # name: most runs
    threads: tuple = (1, 2)


@dataclass(frozen=True)
class Peer:
    """A script, tried with ever tighter tolerances until its modes are right (ARPACK may lose one of the six rigid modes, and so
    report one mode too few below the last, when it stops early); phases in `free` are not charged.
    """

    script: str
    options: tuple = ()
    tolerances: tuple = (None,)
    threads: tuple = (1, 2)
    imports: str = "scipy"
    free: frozenset = frozenset({"import", "read"})


CUBE = ("--shape", "cube", "--lengths", "1", "1", "1")
CASES = {
    "block-30k": Case("make_block.py", ("--shape", "block"), 30000, {"exudyn": 3, "scipy": 3, "cholmod": 9, "slepc": 9}),
    "block-100k": Case("make_block.py", ("--shape", "block"), 100000, {"exudyn": 1, "scipy": 1, "cholmod": 9, "slepc": 9}),
    "block-300k": Case("make_block.py", ("--shape", "block"), 300000, {"cholmod": 1, "slepc": 3}),
    "cube-30k": Case("make_block.py", CUBE, 30000, {"scipy": 1, "cholmod": 9, "slepc": 9}),
    "cube-100k": Case("make_block.py", CUBE, 100000, {"cholmod": 3, "slepc": 3}),
    "cube-300k": Case("make_block.py", CUBE, 300000, {"cholmod": 1, "slepc": 3}),
    "tet10-100k": Case("make_tet10.py", (), 100000, {"cholmod": 3, "slepc": 3}),
    "plate-50k": Case("make_block.py", ("--shape", "thin-plate"), 50000, {"cholmod": 3, "slepc": 3}),
    "shell-200k": Case("make_shell.py", (), 200000),  # no peer: SLEPc did not end within two minutes, with a good shift and 1e-6 either
    # 70 nodes along each edge: 1,029,000 degrees of freedom.
    "cube-1m": Case("make_block.py", (*CUBE, "--cells", "69", "69", "69"), 1029000, threads=(2,)),
}
PEERS = {
    "exudyn": Peer("exudyn_convert.py", threads=(1,), imports="exudyn, scipy"),
    "scipy": Peer("scipy_modes.py", ("--factor", "superlu"), ("1e-8", "0"), threads=(1,)),
    "cholmod": Peer("scipy_modes.py", ("--factor", "cholmod"), ("1e-8", "0"), imports="sksparse.cholmod, scipy"),
    "slepc": Peer("slepc_modes.py", (), ("1e-9", "1e-10", "1e-11", "1e-12"), imports="slepc4py, scipy"),
}


def log(text):
    print(text, file=sys.stderr, flush=True)


def after_warm_up(command, threads=None):
    """[`measured`], directly after a run of the same that is not. A virtual machine gets memory from its host page by page when it is touched first, and again a
    few seconds after it was given back: up to 2.5 ms per MB, a third of some runs, for which no program is to be charged by chance."""
    measured(command, threads)
    return measured(command, threads)


def measured(command, threads=None, allowed=(0,)):
    """Runs a command: its standard output, and user + system CPU seconds, wall seconds, peak resident MB of its process. `allowed` are the exit codes that are no
    failure."""
    env = dict(os.environ)
    for name, value in DEBIAN.items():
        env.setdefault(name, value)
    if threads:
        env.update(OMP_NUM_THREADS=str(threads), OPENBLAS_NUM_THREADS=str(threads))
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        began = time.perf_counter()
        process = subprocess.Popen([str(part) for part in command], stdout=out, stderr=err, env=env, cwd=ROOT)
        _, status, used = os.wait4(process.pid, 0)
        wall = time.perf_counter() - began
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        err.seek(0)
        text, complaint = out.read().decode(), err.read().decode()
    if process.returncode not in allowed:
        raise RuntimeError(f"{' '.join(map(str, command))} ended with {process.returncode}\n{complaint[-2000:]}")
    return text, {"cpu_s": used.ru_utime + used.ru_stime, "wall_s": wall, "memory_mb": used.ru_maxrss * 1024 / 1e6}


def parsed(text):
    return json.loads(text[text.index("{"):])  # libraries may greet first


def make_model(args, case, folder):
    """Writes the model; what the maker says of it, and the size of its matrices."""
    size = ("--dofs", max(2000, case.dofs // 30)) if args.quick else ("--dofs", case.dofs)
    options = case.options if not args.quick or "--cells" not in case.options else CUBE
    text, _ = measured([args.python, BENCHES / case.maker, folder, *options, *size])
    model = {key: value for key, value in parsed(text).items() if key not in ("folder", "seconds")}
    return model | {"matrix_bytes": sum((folder / f"{name}.mtx").stat().st_size for name in "KM")}


def run_flexbody(args, folder, threads):
    text, run = after_warm_up([args.program, "convert", folder / "model.toml", "-o", folder / "body.flex.h5", "--modes", MODES,
                               "--threads", threads, "--json", "--quiet"])
    report = parsed(text)["results"]
    worst = report["modes"]["worst_residual"]  # over |K x| + lambda |M x|; what it can be over |K x| alone
    detail = {key: report["run"][key] for key in ("phases", "counters")}
    return run | {"residual": 2 * worst / (1 - worst), "frequencies_hz": report["modes"]["frequency_hz"], "detail": detail,
                  "versions": {"flexbody": report["generator"].split()[-1]}, "completeness": report["completeness"]["sentence"]}


def run_peer(args, name, folder, threads, tolerance):
    peer = PEERS[name]
    command = [interpreter(args, name), BENCHES / "peers" / peer.script, folder, "--modes", MODES, *peer.options]
    text, _ = after_warm_up([*command, "--tolerance", tolerance] if tolerance else command, threads)
    found = parsed(text)
    charged = {key: value for key, value in found["phases"].items() if key not in peer.free}
    return {"cpu_s": sum(p["cpu_s"] for p in charged.values()), "wall_s": sum(p["wall_s"] for p in charged.values()),
            "memory_mb": found["peak_rss_mib"] * 1.048576, "residual": found["residual_max"], "floor": found["residual_floor"],
            "frequencies_hz": found["frequencies_hz"], "versions": {k: v for k, v in found["versions"].items() if k != "shift"},
            "detail": {"phases": [{"name": key, "wall_seconds": p["wall_s"], "cpu_seconds": p["cpu_s"]} for key, p in charged.items()],
                       "tolerance": tolerance}}


def interpreter(args, name):
    return args.slepc_python if name == "slepc" else args.python


def installed(args, name):
    env = DEBIAN | dict(os.environ)
    command = [interpreter(args, name), "-c", f"import numpy, {PEERS[name].imports}"]
    try:
        return subprocess.run(command, env=env, capture_output=True).returncode == 0
    except OSError:
        return False


def difference(run, reference):
    return max(abs(f / r - 1) for f, r in zip(run["frequencies_hz"], reference, strict=True))


def good(residual, difference, floor):
    """Whether modes are what everyone has to deliver; `floor` is the residual that rounding alone leaves."""
    return residual <= max(RESIDUAL, floor) and difference <= max(AGREEMENT, floor)


class Contestant:
    """One program at one thread count: how many runs it still owes, and those it has made."""

    def __init__(self, args, name, threads, owed, tolerances):
        self.args, self.name, self.threads, self.owed, self.tolerances = args, name, threads, owed, tolerances
        self.runs, self.failed = [], None

    def run(self, folder, reference):
        if self.name == "flexbody":
            found = run_flexbody(self.args, folder, self.threads)
        else:
            try:
                found = run_peer(self.args, self.name, folder, self.threads, self.tolerances[0])
                while len(self.tolerances) > 1 and not good(found["residual"], difference(found, reference), found["floor"]):
                    log(f"  {self.name}: residual {found['residual']:.1e}, frequencies differ by {difference(found, reference):.1e} at tolerance "
                        f"{self.tolerances.pop(0)}, once more")
                    found = run_peer(self.args, self.name, folder, self.threads, self.tolerances[0])
            except RuntimeError as error:
                log(f"  {error}")
                self.owed, self.failed = 0, str(error).splitlines()[-1]
                return
        self.owed -= 1
        self.runs.append(found)
        log(f"  {self.name}, {self.threads} threads: {found['cpu_s']:.2f} CPU s, {found['wall_s']:.2f} s, {found['memory_mb']:.0f} MB, "
            f"residual {found['residual']:.1e}")

    def record(self, reference):
        """What results.json keeps: figures of every run, the rest from the last one."""
        if not self.runs:
            return {"failed": self.failed}
        last = self.runs[-1]
        kept = {key: last[key] for key in ("residual", "floor", "detail", "versions", "completeness") if key in last}
        return kept | {"difference": difference(last, reference), "runs": [{key: round(run[key], 3) for key in ("cpu_s", "wall_s", "memory_mb")} for run in self.runs]}


def run_case(args, name, peers):
    """Model, runs in turns, records by program and thread count."""
    case, folder = CASES[name], args.models / name
    log(f"{name}: {time.strftime('%H:%M:%S')}")
    model = make_model(args, case, folder)
    try:
        contestants = [Contestant(args, "flexbody", threads, 1 if case.dofs > 500000 else args.runs, None) for threads in case.threads]
        wanted = [peer for peer in case.peers if peer in peers]
        for peer in wanted:
            tolerances = list(PEERS[peer].tolerances)  # one list: what one thread count found out spares the other
            contestants += [Contestant(args, peer, threads, min(args.runs, case.peers[peer]), tolerances) for threads in PEERS[peer].threads]
        if wanted:
            measured([args.python, BENCHES / "peers" / "pack.py", folder])
        turn, reference = 0, None
        while any(c.owed for c in contestants):
            for contestant in contestants if turn % 2 == 0 else reversed(contestants):
                if contestant.owed:
                    contestant.run(folder, reference)
                    reference = reference or contestant.runs[0]["frequencies_hz"]  # flexbody's: it begins
            turn += 1
    finally:
        if not args.keep:
            shutil.rmtree(folder, ignore_errors=True)
    return model, {f"{c.name}-{c.threads}": c.record(reference) for c in contestants}


def floors(args):
    """Rates of matrix products, by faer and by numpy's OpenBLAS since the better one is the floor, and of reading memory."""
    rates = [parsed(measured([args.python, BENCHES / "peers" / "gemm.py"], threads)[0]) for threads in (1, 2)]
    return {"faer": parsed(measured(["cargo", "bench", "--quiet", "--locked", "--bench", "floors"])[0]),
            "openblas": {f"gemm_{kind}": [rate[kind] for rate in rates] for kind in ("f64", "f32")}}


def machine():
    def entry(path, key):
        lines = Path(path).read_text().splitlines() if Path(path).exists() else []
        return next((line.split(":", 1)[1].strip() for line in lines if line.startswith(key)), "unknown")
    memory = entry("/proc/meminfo", "MemTotal").split()
    return {"processor": entry("/proc/cpuinfo", "model name"), "cores": len(os.sched_getaffinity(0)),
            "memory_gb": round(int(memory[0]) * 1024 / 1e9, 1) if len(memory) == 2 else None, "system": f"{platform.system()} {platform.machine()}"}


def command_line(args):
    """Options that shape the measurement; where programs and folders are does not."""
    shown = [(" ".join(["--cases", *args.cases]), args.cases != list(CASES)), (" ".join(["--peers", *args.peers]), args.peers != list(PEERS)),
             (f"--runs {args.runs}", args.runs != 5), ("--no-floors", args.no_floors), ("--quick", args.quick)]
    return " ".join(["python3 benches/performance.py"] + [text for text, told in shown if told])


def commit():
    """Of the working tree; with + when sources were changed since."""
    def git(*words):
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True)
    try:
        changed = git("diff", "--quiet", "HEAD", "--", "src", "Cargo.lock").returncode != 0
        return git("rev-parse", "--short", "HEAD").stdout.strip() + ("+" if changed else "")
    except OSError:
        return "unknown"


def doubts(case, records):
    """Results that make a comparison void. Exudyn has no tolerance to set: its residual and frequencies are shown, not judged.
    Where no peer tells what rounding leaves, flexbody itself judges its modes."""
    floors = [record["floor"] for record in records.values() if "floor" in record] + ([1e-8] if case == "cube-1m" else [])
    for key, record in records.items():
        residual = record.get("residual") if floors else 0.0
        if "failed" in record:
            yield f"{case}, {key}: {record['failed']}"
        elif not key.startswith("exudyn") and not good(residual, record["difference"], max(floors, default=0.0)):
            yield f"{case}, {key}: residual {record['residual']:.1e}, frequencies differ from flexbody's by {record['difference']:.1e}"


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES), metavar="CASE", help=f"of {', '.join(CASES)} (default: all)")
    parser.add_argument("--peers", nargs="*", choices=PEERS, default=list(PEERS), metavar="PEER", help=f"of {', '.join(PEERS)} (default: all)")
    parser.add_argument("--runs", type=int, default=5, help="runs of each program; slow peers make fewer (default: 5)")
    parser.add_argument("--quick", action="store_true", help="models of a thirtieth of the size, one run; page and results go to the models folder")
    parser.add_argument("--keep", action="store_true", help="leave the models where they are (30k: 50 MB, 300k: 1 GB, 1M: 2 GB)")
    parser.add_argument("--no-floors", action="store_true", help="do not measure the machine's floors again")
    parser.add_argument("--render-only", action="store_true", help="write the page from the results, measure nothing")
    parser.add_argument("--models", type=Path, default=target / "bench-models", help="folder for the models (needs 2 GB)")
    parser.add_argument("--program", type=Path, default=target / "release" / "flexbody", help="flexbody (default: the release build)")
    parser.add_argument("--python", default=ROOT / "target" / "peers" / "bin" / "python", help="interpreter with numpy, scipy and the peers (default: target/peers)")
    parser.add_argument("--slepc-python", default="/usr/bin/python3", help="interpreter with slepc4py")
    args = parser.parse_args()
    if args.runs < 1:
        parser.error("at least one run")
    if not args.render_only and not installed(args, "scipy"):
        parser.error(f"{args.python} cannot import numpy and scipy; benches/peers/README.md says how to make it")
    if args.quick:
        args.runs = 1
    args.models = args.models.resolve()
    return args


def main():
    args = arguments()
    output = args.models if args.quick else BENCHES
    store, page = output / "results.json", args.models / "performance.md" if args.quick else ROOT / "evidence/pages/performance.md"
    args.models.mkdir(parents=True, exist_ok=True)
    results = json.loads(store.read_text()) if store.exists() else {"cases": {}}

    def save():
        used = {record["session"] for case in results["cases"].values() for record in case["programs"].values()}
        used.add(results.get("floors", {}).get("session"))
        results["sessions"] = {key: value for key, value in results.get("sessions", {}).items() if key in used}
        store.write_text(json.dumps(results, indent=1) + "\n")
        page.write_text(performance_page.render(results), encoding="utf-8")

    found = []
    if args.render_only:
        if not store.exists():
            sys.exit(f"{store} is not there: measure first")
    else:
        peers = [name for name in args.peers if installed(args, name)]
        for name in set(args.peers) - set(peers):
            log(f"{name}: left out, {interpreter(args, name)} cannot import {PEERS[name].imports}")
        session = {"session": datetime.datetime.now().isoformat(timespec="seconds")}
        results.setdefault("sessions", {})[session["session"]] = {"command": command_line(args), "commit": commit()}
        results["machine"] = machine()
        if not args.no_floors:
            results["floors"] = session | floors(args)
        for name in args.cases:
            load = round(os.getloadavg()[0], 1)
            try:
                model, records = run_case(args, name, peers)
            except RuntimeError as error:  # flexbody or a maker; the other cases may still be worth their hours
                log(f"  {error}")
                found.append(f"{name}: {str(error).splitlines()[0]}")
                continue
            case = results["cases"].setdefault(name, {"programs": {}})
            if case.get("model", model)["dofs"] != model["dofs"]:
                case["programs"] = {}  # figures of another model
            case["model"] = model
            case["programs"].update({key: session | {"load": load} | record for key, record in records.items()})
            results["cases"] = {key: results["cases"][key] for key in CASES if key in results["cases"]}
            found += doubts(name, records)
            save()
    save()
    print(page)
    if found:
        sys.exit("not a valid comparison:\n" + "\n".join(found))


if __name__ == "__main__":
    main()
