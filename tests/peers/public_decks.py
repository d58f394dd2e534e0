"""Public decks of CalculiX (Debian's calculix-ccx-test, the test suite of CalculiX itself), judged by scipy.

Of every deck the model is kept, supports and steps are taken out, materials without a density get one, and CalculiX writes the matrices by a FREQUENCY
step with SOLVER=MATRIXSTORAGE: with all constraints of the deck (ties, equations, rigid bodies, expanded beams and shells) eliminated. flexbody converts
the job, and scipy solves the same matrices. A body that is taken must have the mass and the frequencies of scipy, no more and no fewer rigid motions; what
is refused is counted by its code, beside what scipy says of the matrices.

    CCX_TESTS=folder python3 tests/peers/public_decks.py --flexbody target/release/flexbody --jobs 2

The decks are GPL: they are read where they lie and never copied into the project.
"""

import argparse
import gzip
import json
import os
import re
import subprocess
import sys
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from common import ROOT, Absent, Row, program

INSTALLED = Path("/usr/share/doc/calculix-ccx-test/examples/test")
MODES = 10
# Largest relative difference of eigenvalues of the same matrices, beside what rounding makes of rigid motions.
LIMIT = 1e-6
# Rows up to which dense algebra is quicker than a factor.
DENSE = 1200
# Larger ones take minutes.
MOST_ROWS = 30_000
SECONDS = 60
# Every so many decks for the small suite.
STRIDE = 12
# Cards that hold or load the model, or say what a free body has not.
LEFT_OUT = ("BOUNDARY", "BOUNDARYF", "INITIAL CONDITIONS", "CONTACT PAIR", "CYCLIC SYMMETRY MODEL", "CFLUX", "DFLUX", "FILM", "RADIATE", "SUBMODEL", "RESTART", "MASS FLOW")


@dataclass
class Verdict:
    """What became of one deck."""

    deck: str
    kind: str
    said: str
    error: float = 0.0


def cards(text):
    """Keyword and lines of every card before the first step."""
    found = []
    for line in text.splitlines():
        if line.startswith("**"):
            continue
        if line.startswith("*"):
            keyword = " ".join(line[1:].split(",")[0].upper().split())
            if keyword == "STEP":
                break
            found.append((keyword, [line]))
        elif found:
            found[-1][1].append(line)
    return found


def free_deck(text):
    """The model of a deck, free, with densities, and a step that writes its matrices; `None` where it has no elastic material."""
    kept = [(keyword, lines) for keyword, lines in cards(text) if keyword not in LEFT_OUT]
    if not any(keyword == "ELASTIC" for keyword, _ in kept):
        return None
    lines, material, dense = [], False, False
    of_material = ("ELASTIC", "DENSITY", "PLASTIC", "EXPANSION", "CREEP", "HYPERELASTIC", "HYPERFOAM", "CYCLIC HARDENING", "CONDUCTIVITY", "SPECIFIC HEAT", "DEPVAR", "USER MATERIAL", "DAMPING", "DEFORMATION PLASTICITY", "FLUID CONSTANTS", "SPECIFIC GAS CONSTANT", "ELECTRICAL CONDUCTIVITY", "MAGNETIC PERMEABILITY", "VALUES AT INFINITY")
    for keyword, own in [*kept, ("END", [])]:
        if material and keyword not in of_material:
            lines += [] if dense else ["*DENSITY", "7800."]
            material = False
        if keyword == "MATERIAL":
            material, dense = True, False
        dense = dense or keyword == "DENSITY"
        lines += own
    return "\n".join([*lines, "*STEP", "*FREQUENCY, SOLVER=MATRIXSTORAGE", str(MODES + 6), "*END STEP", ""])


def matrix(path, n):
    import numpy as np
    import scipy.sparse as sp

    table = np.array(path.read_text().split(), float).reshape(-1, 3)
    i, j, values = table[:, 0].astype(int) - 1, table[:, 1].astype(int) - 1, table[:, 2]
    upper = sp.coo_matrix((values, (i, j)), shape=(n, n)).tocsc()
    return (upper + upper.T - sp.diags(upper.diagonal())).tocsc()


def eigenvalues(stiffness, mass, count):
    """The lowest eigenvalues of K x = lambda M x, M positive semidefinite, by shift and inversion."""
    import numpy as np
    import scipy.linalg
    import scipy.sparse.linalg as spl

    own, weight = stiffness.diagonal(), mass.diagonal()
    shift = -1e-7 * float(np.median(own[weight > 0] / weight[weight > 0]))
    shifted = stiffness - shift * mass
    n = stiffness.shape[0]
    if n <= DENSE:
        lower = np.linalg.cholesky(shifted.toarray())
        half = scipy.linalg.solve_triangular(lower, mass.toarray(), lower=True)
        inverse = scipy.linalg.solve_triangular(lower, half.T, lower=True)
        values = np.linalg.eigvalsh(0.5 * (inverse + inverse.T))[::-1][:count]
    else:
        return subspace(stiffness, mass, spl.splu(shifted.tocsc()), count)
    return np.sort(shift + 1 / values[values > 1e-14 * values[0]])


def translation(stiffness, labels, deck):
    """Rows that move along x by one; `None` where rotations stand among the rows with direction 1 that nothing tells from them."""
    import numpy as np

    nodes = np.array([int(label.split(".")[0]) for label in labels])
    along = np.array([label.endswith(".1") for label in labels])
    turning = [int(node) for node in re.findall(r"ROT\s*NODE\s*=\s*(\d+)", deck, re.IGNORECASE)]
    size = abs(stiffness).sum(axis=1).max()
    for rows in (along, along & ~np.isin(nodes, turning)):
        if np.abs(stiffness @ rows.astype(float)).max() <= 1e-8 * size:
            return rows.astype(float)
    return None


def subspace(stiffness, mass, factor, count):
    """The same by subspace iteration with a factor of K - shift M."""
    import numpy as np
    import scipy.linalg

    vectors = np.random.default_rng(0).standard_normal((stiffness.shape[0], 2 * count + 8))
    values = np.zeros(count)
    for _ in range(60):
        vectors, _ = np.linalg.qr(factor.solve(mass @ vectors))
        found, turn = scipy.linalg.eigh(vectors.T @ (stiffness @ vectors), vectors.T @ (mass @ vectors))
        vectors, before, values = vectors @ turn, values, found[:count]
        if np.all(np.abs(values - before) <= 1e-10 * np.abs(values) + 1e-14 * np.abs(values).max()):
            return values
    raise RuntimeError("the subspace iteration does not converge")


def run_quietly(words, folder, seconds=SECONDS):
    environment = dict(os.environ, OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    try:
        return subprocess.run([str(word) for word in words], cwd=folder, capture_output=True, text=True, errors="replace", timeout=seconds, env=environment)
    except subprocess.TimeoutExpired:
        return None


def judge(flexbody, ccx, source):
    """One deck, from its file to a verdict."""
    import h5py
    import numpy as np

    name = source.name.removesuffix(".gz").removesuffix(".inp")
    text = (gzip.decompress(source.read_bytes()) if source.suffix == ".gz" else source.read_bytes()).decode("latin-1")
    deck = free_deck(text)
    if deck is None:
        return Verdict(name, "no matrices", "no elastic material")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "job.inp").write_text(deck, encoding="latin-1")
        if run_quietly([ccx, "-i", "job"], folder) is None:
            return Verdict(name, "no matrices", "CalculiX takes too long")
        written = [folder / f"job.{ending}" for ending in ("sti", "mas", "dof")]
        if not all(path.is_file() and path.stat().st_size for path in written):
            return Verdict(name, "no matrices", "CalculiX writes none")
        labels = (folder / "job.dof").read_text().split()
        n = len(labels)
        if n > MOST_ROWS:
            return Verdict(name, "no matrices", f"more than {MOST_ROWS} rows")
        words = ["convert", "job.inp", "--units", "m,kg,s", "--allow-implausible", "--lumped", "none", "--modes", MODES, "--json", "--threads", 1, "-o", "b.h5"]
        done = run_quietly([flexbody, *words], folder, 4 * SECONDS)
        if done is None:
            return Verdict(name, "no verdict", "flexbody takes too long")
        stiffness, mass = (matrix(path, n) for path in written[:2])
        try:
            found = eigenvalues(stiffness, mass, min(MODES + 8, n - 1))
        except Exception as failure:  # whatever LAPACK and SuperLU say of matrices that are no body's
            found = None
            theirs = f"scipy cannot solve ({type(failure).__name__})"
        else:
            theirs = f"{int(np.sum(np.abs(found) < 1e-7 * np.abs(found).max()))} zero eigenvalues by scipy"
        if done.returncode != 0:
            errors = [one["code"] for one in json.loads(done.stdout)["diagnostics"] if one["severity"] == "error"]
            return Verdict(name, "wrong" if done.returncode == 70 else f"refused {errors[0]}", theirs)
        with h5py.File(folder / "b.h5") as file:
            ours, weight = file["modes/eigenvalue"][()], file["invariants/mass"][0]
        if found is None:
            return Verdict(name, "wrong", f"taken, but {theirs}")
        along = translation(stiffness, labels, deck)
        heavy = 0.0 if along is None else abs(float(along @ (mass @ along)) / weight - 1)
        below = int(np.sum(found < 0.5 * ours[0]))
        rest = found[below:][: len(ours)]
        noise = 20 * np.abs(found[:below]).max(initial=0.0)
        error = float(np.max(np.abs(rest - ours[: len(rest)]) / (rest + noise / LIMIT)))
        if below != 6 or error > LIMIT or heavy > 1e-9:
            return Verdict(name, "wrong", f"{below} eigenvalues below the first mode, eigenvalues {error:.1e}, mass {heavy:.1e}", error)
        return Verdict(name, "right", theirs, max(error, heavy))


def judged(flexbody, stride, jobs, hear=lambda verdict: None):
    """Verdicts on every so many decks; `hear` is given each as soon as it is known, in their order."""
    folder = Path(os.environ.get("CCX_TESTS", INSTALLED))
    decks = sorted({path.name.removesuffix(".gz"): path for path in folder.glob("*.inp*") if path.suffix in (".inp", ".gz")}.values())
    if not decks:
        raise Absent("decks of CalculiX (Debian's calculix-ccx-test, or CCX_TESTS=folder)")
    ccx = program("ccx", "CCX", "Debian's calculix-ccx")
    with ThreadPoolExecutor(jobs) as pool:
        found = []
        for verdict in pool.map(lambda deck: judge(flexbody, ccx, deck), decks[::stride]):
            hear(verdict)
            found.append(verdict)
        return found


def told(verdicts):
    """Counts in words."""
    kinds = Counter(verdict.kind for verdict in verdicts)
    refused = ", ".join(f"{count} {kind.removeprefix('refused ')}" for kind, count in sorted(kinds.items()) if kind.startswith("refused"))
    free = sum(1 for verdict in verdicts if verdict.kind.startswith("refused") and verdict.said.startswith("6 zero"))
    without = kinds["no matrices"] + kinds["no verdict"]
    return (
        f"{len(verdicts)} public decks: {len(verdicts) - without} give matrices; {kinds['right']} taken with the mass and the frequencies of scipy, "
        f"{sum(count for kind, count in kinds.items() if kind.startswith('refused'))} refused ({refused or 'none'}; of {free} scipy finds six rigid motions), {kinds['wrong']} wrong (the number)"
    )


def rows(flexbody, folder, stride=1):
    verdicts = judged(flexbody, stride, os.cpu_count() or 1)
    for verdict in verdicts:
        if verdict.kind == "wrong":
            print(f"  wrong: {verdict.deck}: {verdict.said}")
    wrong = sum(verdict.kind == "wrong" for verdict in verdicts)
    largest = max((verdict.error for verdict in verdicts if verdict.kind == "right"), default=0.0)
    return [
        Row("public decks, scipy", "CalculiX", told(verdicts), wrong, 0.0),
        Row("public decks, scipy", "CalculiX", "largest difference of an eigenvalue or a mass of those that are taken", largest, LIMIT),
    ]


def some(flexbody, folder):
    """A part of the decks, for the small suite."""
    return rows(flexbody, folder, STRIDE)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flexbody", type=Path, default=ROOT / "target/release/flexbody")
    parser.add_argument("--stride", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    args = parser.parse_args()

    def hear(verdict):
        print(f"{verdict.deck:24} {verdict.kind:16} {verdict.said} {verdict.error:.1e}", flush=True)

    verdicts = judged(args.flexbody.resolve(), args.stride, args.jobs, hear)
    print(told(verdicts))
    sys.exit(any(verdict.kind == "wrong" for verdict in verdicts))


if __name__ == "__main__":
    main()
