"""Modes by SLEPc over MPI beside those of the built-in engine: the same frequencies and invariants at 1, 2 and 4 ranks; a killed rank, other matrices and changed results.

Debian: apt-get install python3-petsc4py-real python3-slepc4py-real (they bring Open MPI).
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import common
from common import ROOT, Absent, Row

PYTHON = os.environ.get("FLEXBODY_PYTHON", "/usr/bin/python3")
MPIEXEC = os.environ.get("FLEXBODY_MPIEXEC", "mpiexec --oversubscribe" + (" --allow-run-as-root" if os.geteuid() == 0 else ""))
# Solids of every element, shells, beams, a plane model, one with repeated eigenvalues.
SOLIDS = ["connecting_rod", "bracket_hex20", "gear_disc"]
MODELS = [*SOLIDS, "shell_folded", "frame_beams", "plane_frame"]
LARGE = [
    ("shell-30k", "make_shell.py", ["--dofs", 30000], "standard"),
    ("shell-300k", "make_shell.py", ["--dofs", 300000], "standard"),
    ("cube-30k", "make_block.py", ["--dofs", 30000, "--shape", "cube", "--lengths", 1, 1, 1], "certified"),
    ("block-300k", "make_block.py", ["--dofs", 300000], "certified"),
]
QUANTITIES = {"frequency": 1e-9, "invariants": 1e-11}
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "OMPI_MCA_mpi_yield_when_idle": "1"}


def drive(folder, ranks, *options):
    words = [*MPIEXEC.split(), "-n", str(ranks), PYTHON, str(folder / "driver.py"), str(folder), *options]
    return subprocess.run(words, capture_output=True, text=True, env=ENVIRONMENT, timeout=900)


def forget(folder):
    """Leaves what `prepare` has written."""
    for path in folder.iterdir():
        if path.name.startswith(("result", "modes", "condensed", "kept", "checkpoint")):
            path.unlink()


def version():
    """Name and version of SLEPc; `Absent` where it is not here."""
    probe = subprocess.run([PYTHON, str(ROOT / "crates/cluster/src/driver.py"), "--probe"], capture_output=True, text=True)
    if probe.returncode or not shutil.which(MPIEXEC.split()[0]):
        raise Absent("petsc4py, slepc4py and MPI (apt-get install python3-petsc4py-real python3-slepc4py-real)")
    told = json.loads(probe.stdout)
    return f"SLEPc {'.'.join(map(str, told['slepc']))}"


def differences(flexbody, one, two):
    """The largest relative differences of frequencies and of invariants, in norms that no basis changes."""
    done = subprocess.run([str(flexbody), "compare", str(one), str(two), "--json"], capture_output=True, text=True)
    rows = json.loads(done.stdout)["results"]["rows"]
    value = {row["quantity"]: row["difference"] for row in rows}
    rest = [value[name] for name in value if name not in ("frequency", "mode shapes")]
    return value["frequency"], max(rest)


def on_ranks(flexbody, folder, manifest, accuracy, program):
    """The largest differences that 1, 2 and 4 ranks make to the body of the built-in engine, as two rows."""
    model = manifest.parent.name
    job, own = folder / f"{model}.job", folder / f"{model}.own.flex.h5"
    common.run(flexbody, "prepare", manifest, "--quiet", "-o", job)
    common.run(flexbody, "convert", manifest, "--accuracy", accuracy, "--residual-vectors", "", "--quiet", "-o", own)
    worst = (0.0, 0.0)
    for ranks in (1, 2, 4):
        forget(job)
        done = drive(job, ranks)
        if done.returncode:
            raise RuntimeError(done.stderr)
        body = folder / f"{model}.{ranks}.flex.h5"
        common.run(flexbody, "assemble", job, "--quiet", "-o", body)
        worst = tuple(max(pair) for pair in zip(worst, differences(flexbody, own, body)))
    told = (("frequencies", "frequency", worst[0]), ("invariants", "invariants", worst[1]))
    return [Row(program, f"cluster: {model}", f"{name} on 1, 2 and 4 ranks", found, QUANTITIES[kind]) for name, kind, found in told]


def agreement(flexbody, folder):
    rows, program = [], version()
    for model in MODELS:
        # At `standard` the built-in modes of solids themselves are good to no more than the limit; rotations of nodes have nothing better.
        accuracy = "certified" if model in SOLIDS else "standard"
        rows += on_ranks(flexbody, folder, ROOT / "fixtures/models" / model / "model.toml", accuracy, program)
    return rows


def large(flexbody, folder):
    """Solids and thin shells of 30,000 to 300,000 rows, made here: twelve minutes."""
    rows, program = [], version()
    for model, maker, options, accuracy in LARGE:
        made = Path(folder) / model
        common.run(sys.executable, ROOT / "benches" / maker, made, *options)
        rows += on_ranks(flexbody, Path(folder), made / "model.toml", accuracy, program)
        shutil.rmtree(made)
        shutil.rmtree(Path(folder) / f"{model}.job")
    return rows


def killed(flexbody, folder):
    """One rank is killed as soon as modes are kept; the next run goes on from them."""
    job = folder / "connecting_rod.job"
    forget(job)
    words = [*MPIEXEC.split(), "-n", "2", PYTHON, str(job / "driver.py"), str(job), "--keep-every", "6"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT) as run:
        while not (job / "checkpoint.jsonl").exists() and run.poll() is None:
            time.sleep(0.01)
        ranks = subprocess.run(["pgrep", "-P", str(run.pid)], capture_output=True, text=True).stdout.split()
        for rank in ranks[-1:]:
            os.kill(int(rank), signal.SIGKILL)
        said = run.communicate()[1]
    assert run.returncode != 0 and not (job / "result.jsonl").exists(), "the run was to be killed before its result"
    assert "signal 9" in said or "Killed" in said, said
    early = subprocess.run([str(flexbody), "assemble", str(job), "-o", str(folder / "early.flex.h5")], capture_output=True, text=True)
    assert early.returncode == 2 and "modes are saved" in early.stderr, early.stderr
    again = drive(job, 2)
    assert again.returncode == 0 and "goes on from" in again.stderr, again.stderr
    body = folder / "again.flex.h5"
    common.run(flexbody, "assemble", job, "--quiet", "-o", body)
    found = differences(flexbody, folder / "connecting_rod.own.flex.h5", body)
    return [Row(version(), "cluster: connecting_rod", "frequencies after a rank was killed", found[0], QUANTITIES["frequency"])]


def refusals(flexbody, folder):
    """Another model, a changed vector and a changed result."""
    job, count = folder / "connecting_rod.job", 0
    modes = (job / "modes.petsc").read_bytes()
    changed = bytearray(modes)
    changed[1000] ^= 1
    (job / "modes.petsc").write_bytes(changed)
    words = [str(flexbody), "assemble", str(job), "-o", str(folder / "never.flex.h5")]
    count += "FB761" not in subprocess.run(words, capture_output=True, text=True).stderr
    (job / "modes.petsc").write_bytes(modes)
    other = ["--model", str(ROOT / "fixtures/models/bracket_hex20/model.toml")]
    count += "FB762" not in subprocess.run(words + other, capture_output=True, text=True).stderr
    count += (folder / "never.flex.h5").exists()
    return [Row(version(), "cluster: connecting_rod", "refusals of another model and of changed modes that were missed", float(count), 0.0)]


def rows(flexbody, folder):
    """Everything; `Absent` where the packages are not there."""
    return agreement(flexbody, folder) + killed(flexbody, folder) + refusals(flexbody, folder) + one_command(flexbody, folder)


def one_command(flexbody, folder):
    """`convert --engine slepc`, which does all of it."""
    manifest, body = ROOT / "fixtures/models/bracket_hex20/model.toml", Path(folder) / "one.flex.h5"
    common.run(flexbody, "convert", manifest, "--engine", "slepc", "--ranks", 2, "--mpiexec", MPIEXEC, "--python", PYTHON, "--quiet", "-o", body)
    found = differences(flexbody, folder / "bracket_hex20.own.flex.h5", body)
    return [Row(version(), "cluster: bracket_hex20", "frequencies of convert --engine slepc", found[0], QUANTITIES["frequency"])]
