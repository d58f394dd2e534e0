#!/usr/bin/env python3
"""Free modes of a body by SLEPc over MPI, in a folder that `flexbody prepare` has written.

    mpiexec -n 64 python3 driver.py DIR [--solver mumps|slices|gamg] [--keep-every N] [PETSc options]

reads K, M and the rigid modes in PETSc's binary form, finds the modes that `prepared.jsonl` asks for, counts by the
inertia of K - sigma M whether one is missing, multiplies modes, rigid modes and turned modes by M and with each
other, and writes `modes.petsc`, `condensed.petsc` and `result.jsonl`, from which `flexbody assemble DIR` makes the
body. Converged modes are kept in `checkpoint.jsonl` on the way: the same command goes on from them. Every other option
goes to PETSc, as `-st_mat_mumps_icntl_14 50`.

    mumps   Krylov-Schur, shift-invert, one factor of K + tau M by MUMPS
    slices  spectrum slicing: one factor for each part of the spectrum; hundreds of modes
    gamg    Krylov-Schur on K + tau M solved by conjugate gradients with algebraic multigrid: no factor, no count
    lobpcg  LOBPCG with the same multigrid as preconditioner

Exit codes: 0 done, 1 not all modes converged or some are missing (what was found is kept), 2 the folder, the options or
the packages are not what they should be, 3 a solver or a rank failed (what was found is kept).
"""

import sys

# Packages are not looked for beside this file or in the current folder: data lie there, not code.
if not (sys.flags.isolated or getattr(sys.flags, "safe_path", False)):
    del sys.path[0]

import argparse
import glob
import hashlib
import json
import os
import time

VERSION = 1
EXTRA = 4  # eigenvalues beyond the wanted ones: they show where the last cluster ends, and the gap for the count
SEARCHED = 0.1  # part of the promised residual that the driver aims at
ATTEMPTS = 4  # searches for modes that the count misses
SLICE = 60  # modes in one part of the spectrum
PANEL = 64  # columns that are multiplied by M at a time


def import_packages():
    """petsc4py and slepc4py; where Debian has installed them for another default, out of its folders."""
    try:
        import slepc4py
    except ImportError:
        for kind in ("petsc", "slepc"):
            sys.path += sorted(glob.glob(f"/usr/lib/{kind}dir/{kind}*/*-real/lib/python3/dist-packages"))[-1:]
        try:
            import slepc4py
        except ImportError as missing:
            stop(f"{missing}: install petsc4py and slepc4py (Debian: apt-get install python3-petsc4py-real python3-slepc4py-real)")
    return slepc4py


def stop(message, code=2):
    """Ends this rank before MPI is there."""
    print(f"error: {message}", file=sys.stderr)
    sys.exit(code)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", help="folder of `flexbody prepare`")
    parser.add_argument("--solver", choices=["mumps", "slices", "gamg", "lobpcg"], default="mumps")
    parser.add_argument("--no-count", action="store_true", help="leave out the inertia count, and its factor")
    parser.add_argument("--keep-every", type=int, default=0, help="number of modes that one search finds before they are saved [all]")
    parser.add_argument("--subspace", type=int, help="vectors of the subspace [SLEPc's choice]")
    parser.add_argument("--trust-files", action="store_true", help="do not check the fingerprints of the files, which reads them once more")
    parser.add_argument("--probe", action="store_true", help="print the versions of the packages and end")
    known, rest = parser.parse_known_args()
    if not known.folder and not known.probe:
        parser.error("name the folder")
    return known, rest


def fingerprint(path):
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while piece := file.read(1 << 22):
            digest.update(piece)
    return digest.hexdigest()


def read_sealed(path, kind):
    """The second line of a file whose first line says what it is and which digest the second has."""
    with open(path, encoding="utf-8") as file:
        head, body = json.loads(file.readline()), file.readline().rstrip("\n")
    if head["format"] != kind or head["version"] != VERSION:
        raise ValueError(f"{path} is not a {kind} file of version {VERSION}")
    if head["sha256"] != hashlib.sha256(body.encode()).hexdigest():
        raise ValueError(f"{path} changed since it was written")
    return json.loads(body)


def write_sealed(path, kind, content):
    """Whole or not at all: a killed run leaves the file as it was."""
    body = json.dumps(content, sort_keys=True)
    head = json.dumps({"format": kind, "version": VERSION, "sha256": hashlib.sha256(body.encode()).hexdigest()})
    with open(path + ".part", "w", encoding="utf-8") as file:
        file.write(head + "\n" + body + "\n")
        file.flush()
        os.fsync(file.fileno())
    os.replace(path + ".part", path)


class Run:
    """The folder, the matrices and what was found so far; the same on every rank."""

    def __init__(self, options):
        self.options, self.folder, self.clock = options, options.folder, {}
        self.rank, self.ranks = PETSc.COMM_WORLD.getRank(), PETSc.COMM_WORLD.getSize()
        self.begun = time.perf_counter()
        self.prepared = self.sealed("prepared.jsonl", "flexbody-prepared")
        p = self.prepared
        if PETSc.IntType().itemsize != p["index_bytes"]:
            self.refuse(f"the files have indices of {p['index_bytes']} bytes, this PETSc of {PETSc.IntType().itemsize}: prepare with --indices {8 * PETSc.IntType().itemsize}")
        if not PETSc.ScalarType().dtype == float:
            self.refuse("this PETSc does not compute with real numbers of double precision: use such a build")
        if not options.trust_files:
            self.check_files()
        self.read()
        self.solvers, self.found, self.parts, self.factor = [], [], [], {}

    def path(self, name):
        return os.path.join(self.folder, name)

    def say(self, text):
        if self.rank == 0:
            print(f"[{time.perf_counter() - self.begun:9.1f} s] {text}", file=sys.stderr, flush=True)

    def refuse(self, message, code=2):
        """All ranks end together."""
        if self.rank == 0:
            print(f"error: {message}", file=sys.stderr, flush=True)
        PETSc.COMM_WORLD.barrier()
        sys.exit(code)

    def sealed(self, name, kind):
        try:
            return read_sealed(self.path(name), kind)
        except (OSError, ValueError, KeyError, TypeError) as problem:
            self.refuse(f"{self.path(name)} cannot be used: {problem}")

    def check_files(self):
        """The first rank reads them; where one differs it ends the program, and mpiexec the other ranks."""
        for name, expected in self.prepared["files"].items():
            if self.rank == 0 and name.endswith(".petsc"):
                try:
                    changed = fingerprint(self.path(name)) != expected
                except OSError as problem:
                    changed = f"{problem}"
                if changed:
                    print(f"error: {self.path(name)} differs from what `flexbody prepare` wrote", file=sys.stderr, flush=True)
                    os._exit(2)
        PETSc.COMM_WORLD.barrier()

    def read(self):
        block, n = self.prepared["block_size"], self.prepared["rows"]
        self.stiffness, self.mass = (self.matrix(name, block) for name in ("stiffness.petsc", "mass.petsc"))
        self.rigid = self.vectors("rigid.petsc", self.prepared["rigid"])
        self.shifted = self.stiffness.copy()
        self.shifted.axpy(self.prepared["shift"], self.mass)
        self.shifted.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        self.shifted.setOption(PETSc.Mat.Option.SPD, True)
        self.time("read")
        self.say(f"{n} rows, {self.ranks} ranks")

    def matrix(self, name, block):
        matrix = PETSc.Mat().create(PETSc.COMM_WORLD)
        matrix.setType("aij")
        matrix.setBlockSize(block)
        viewer = PETSc.Viewer().createBinary(self.path(name), "r", PETSc.COMM_WORLD)
        matrix.load(viewer)
        viewer.destroy()
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        return matrix

    def vectors(self, name, count):
        viewer = PETSc.Viewer().createBinary(self.path(name), "r", PETSc.COMM_WORLD)
        found = []
        for _ in range(count):
            vector = self.stiffness.createVecRight()
            vector.load(viewer)
            found.append(vector)
        viewer.destroy()
        return found

    def write_vectors(self, name, vectors):
        """Under a name that nobody reads until it is whole; the digest of the file on rank 0."""
        viewer = PETSc.Viewer().createBinary(self.path(name) + ".part", "w", PETSc.COMM_WORLD)
        for vector in vectors:
            vector.view(viewer)
        viewer.destroy()
        digest = None
        if self.rank == 0:
            digest = fingerprint(self.path(name) + ".part")
            with open(self.path(name) + ".part", "rb") as file:
                os.fsync(file.fileno())
            os.replace(self.path(name) + ".part", self.path(name))
            self.remove(name + ".part.info")
        PETSc.COMM_WORLD.barrier()
        return digest

    def remove(self, name):
        if os.path.exists(self.path(name)):
            os.remove(self.path(name))

    def hertz(self, eigenvalue):
        return max(eigenvalue, 0.0) ** 0.5 / (2 * np.pi) * self.prepared["hertz"]

    def time(self, phase):
        now = time.perf_counter()
        self.clock[phase] = self.clock.get(phase, 0.0) + now - getattr(self, "last", self.begun)
        self.last = now

    # Keeping what was found.

    def resume(self):
        """Modes that an earlier run has kept for the same matrices."""
        if not os.path.exists(self.path("checkpoint.jsonl")):
            return
        kept = self.sealed("checkpoint.jsonl", "flexbody-kept")
        if kept["matrices"] != self.prepared["matrices"]:
            self.say("the checkpoint belongs to other matrices and is not used")
            return
        for part in kept["parts"]:
            if self.rank == 0 and fingerprint(self.path(part["file"])) != part["sha256"]:
                print(f"error: {self.path(part['file'])} changed since it was written: remove checkpoint.jsonl to start from the beginning", file=sys.stderr, flush=True)
                os._exit(2)
            PETSc.COMM_WORLD.barrier()
            self.found += self.vectors(part["file"], part["vectors"])
        self.parts = kept["parts"]
        self.say(f"continues from {len(self.found)} saved modes")

    def keep(self, vectors):
        """Adds converged vectors to what is kept."""
        if not vectors:
            return
        name = f"kept-{len(self.parts) + 1:04d}.petsc"
        digest = self.write_vectors(name, vectors)
        self.parts.append({"file": name, "sha256": digest, "vectors": len(vectors)})
        if self.rank == 0:
            content = {"matrices": self.prepared["matrices"], "parts": self.parts}
            write_sealed(self.path("checkpoint.jsonl"), "flexbody-kept", content)
        PETSc.COMM_WORLD.barrier()
        self.say(f"{sum(part['vectors'] for part in self.parts)} modes are saved")

    # Searching.

    def search(self, count):
        """So many of the lowest modes beside those that were found; how many of them converged."""
        count = min(count, self.prepared["rows"] - self.prepared["rigid"] - len(self.found))
        if count <= 0:
            return 0
        eps = self.eigen_solver()
        eps.setDimensions(count, self.options.subspace)
        eps.setDeflationSpace(self.rigid + self.found)
        kept = [0]

        def converged(eps, its, nconv, eigenvalues, errors):
            # Locked columns are eigenvectors already.
            if kept[0] < nconv < count and self.options.solver != "lobpcg":
                self.keep([self.column(eps.getBV(), j) for j in range(kept[0], nconv)])
                kept[0] = nconv

        eps.cancelMonitor()
        eps.setMonitor(converged)
        eps.solve()
        given = eps.getConverged()
        new = []
        for j in range(given):
            vector = self.stiffness.createVecRight()
            eps.getEigenpair(j, vector)
            new.append(vector)
        # Behind those that were kept on the way: pairs come in another order than columns.
        self.keep([self.column(eps.getBV(), j) for j in range(kept[0], given)] if kept[0] else new)
        self.found += new
        self.time("search")
        self.say(f"{given} of {count} modes converged in {eps.getIterationNumber()} restarts")
        return given

    def eigen_solver(self):
        """The one of this run: its factor serves all searches."""
        if not self.solvers:
            eps = SLEPc.EPS().create(PETSc.COMM_WORLD)
            eps.setOperators(self.shifted, self.mass)
            eps.setProblemType(SLEPc.EPS.ProblemType.GHEP)
            eps.setTolerances(1e-2 * self.prepared["residual"], 1000)
            self.solver(eps)
            eps.setFromOptions()
            self.solvers.append(eps)
        return self.solvers[-1]

    def column(self, block, j):
        vector = self.stiffness.createVecRight()
        block.copyVec(j, vector)
        return vector

    def solver(self, eps):
        """How K + tau M is solved."""
        transform, kind = eps.getST(), self.options.solver
        if kind == "lobpcg":
            eps.setType(SLEPc.EPS.Type.LOBPCG)
            eps.setWhichEigenpairs(SLEPc.EPS.Which.SMALLEST_REAL)
            transform.setType(SLEPc.ST.Type.PRECOND)
        else:
            eps.setType(SLEPc.EPS.Type.KRYLOVSCHUR)
            eps.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
            eps.setTarget(0.0)
            transform.setType(SLEPc.ST.Type.SINVERT)
        linear = transform.getKSP()
        factor = linear.getPC()
        if kind in ("gamg", "lobpcg"):
            self.shifted.setNearNullSpace(self.near_null_space())
            factor.setType(PETSc.PC.Type.GAMG)
            linear.setType(PETSc.KSP.Type.CG if kind == "gamg" else PETSc.KSP.Type.PREONLY)
            linear.setTolerances(rtol=1e-2 * self.prepared["residual"], max_it=2000)
        else:
            linear.setType(PETSc.KSP.Type.PREONLY)
            factor.setType(PETSc.PC.Type.CHOLESKY)
            factor.setFactorSolverType(PETSc.Mat.SolverType.MUMPS)

    def near_null_space(self):
        """The rigid motions, orthonormal, which multigrid has to keep on every level."""
        basis = block_of(self.rigid)
        basis.orthogonalize(None)
        vectors = [self.column(basis, j) for j in range(len(self.rigid))]
        return PETSc.NullSpace().create(vectors=vectors, comm=PETSc.COMM_WORLD)

    # Refining.

    def ritz(self):
        """Rayleigh-Ritz on all that was found, rigid motion taken out; eigenvalues, K-residuals."""
        x, rigid = block_of(self.found), block_of(self.rigid)
        for _ in range(2):
            x.mult(-1.0, 1.0, rigid, x_dot(rigid, product(self.mass, x)))
        gm, gk = (gram(x, product(matrix, x)) for matrix in (self.mass, self.stiffness))
        scale = 1.0 / np.sqrt(np.diag(gm))
        values, vectors = np.linalg.eigh(scale[:, None] * gm * scale)
        keep = values > 1e-8
        root = scale[:, None] * vectors[:, keep] / np.sqrt(values[keep])
        eigenvalues, small = np.linalg.eigh(root.T @ gk @ root)
        combined = root @ small
        y = block_of([self.stiffness.createVecRight() for _ in eigenvalues])
        y.mult(1.0, 0.0, x, dense(combined))
        kx, mx = product(self.stiffness, y), product(self.mass, y)
        residuals, self.found = [], []
        for j, value in enumerate(eigenvalues):
            k, m, vector = (self.stiffness.createVecRight() for _ in range(3))
            for block, to in ((kx, k), (mx, m), (y, vector)):
                block.copyVec(j, to)
            size = k.norm() + abs(value) * m.norm()
            k.axpy(-value, m)
            residuals.append(k.norm() / size if size > 0 else 0.0)
            self.found.append(vector)
        self.eigenvalues, self.residuals = [float(v) for v in eigenvalues], residuals

    def refine(self):
        """Inverse iterations of modes whose K-residual is not small enough yet, at most three."""
        self.ritz()
        aim = SEARCHED * self.prepared["residual"]
        linear = self.linear_solver()
        for _ in range(3):
            poor = [j for j, residual in enumerate(self.residuals) if residual > aim]
            worst = max(self.residuals, default=0.0)
            if not poor or linear is None:
                break
            before = (self.found, self.eigenvalues, self.residuals)
            self.found = list(self.found)
            for j in poor:
                right, solution = self.mass.createVecRight(), self.mass.createVecRight()
                self.mass.mult(self.found[j], right)
                linear.solve(right, solution)
                self.found[j] = solution
            self.ritz()
            if not max(self.residuals) < 0.5 * worst:
                if not max(self.residuals) < worst:
                    self.found, self.eigenvalues, self.residuals = before
                break
        self.time("refinement")

    def linear_solver(self):
        """What solves with K + tau M here; none where the factor is given back or is one of a part of the spectrum."""
        kind = self.options.solver
        if kind in ("mumps", "gamg"):
            return self.solvers[-1].getST().getKSP() if self.solvers else None
        if kind == "slices":
            return None
        linear = PETSc.KSP().create(PETSc.COMM_WORLD)
        linear.setOptionsPrefix("refine_")
        linear.setOperators(self.shifted)
        linear.setType(PETSc.KSP.Type.CG)
        linear.getPC().setType(PETSc.PC.Type.GAMG)
        linear.setTolerances(rtol=1e-2 * self.prepared["residual"], max_it=2000)
        linear.setFromOptions()
        return linear

    # Counting.

    def count(self, shift):
        """Negative and zero pivots of K - shift M, by MUMPS."""
        matrix = self.stiffness.copy()
        matrix.axpy(-shift, self.mass)
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        solver = PETSc.KSP().create(PETSc.COMM_WORLD)
        solver.setOptionsPrefix("count_")
        # The pivots of a root that ScaLAPACK factors are not counted: MUMPS factors it itself.
        for name, value in (("count_mat_mumps_icntl_13", 1), ("count_mat_mumps_icntl_24", 1)):
            if not PETSc.Options().hasName(name):
                PETSc.Options()[name] = value
        solver.setOperators(matrix)
        solver.setType(PETSc.KSP.Type.PREONLY)
        factor = solver.getPC()
        factor.setType(PETSc.PC.Type.CHOLESKY)
        factor.setFactorSolverType(PETSc.Mat.SolverType.MUMPS)
        solver.setFromOptions()
        solver.setUp()
        negative, zero, _ = factor.getFactorMatrix().getInertia()
        self.factor = mumps_facts(factor.getFactorMatrix())
        solver.destroy()
        matrix.destroy()
        self.time("count")
        return int(negative), int(zero)

    def free_solvers(self):
        for eps in self.solvers:
            eps.destroy()
        self.solvers = []


def product(matrix, block):
    """A X, column by column."""
    result = block.duplicate()
    block.matMult(matrix, result)
    return result


def block_of(vectors):
    return filled(vectors, vectors[0], len(vectors))


def filled(vectors, like, count):
    block = SLEPc.BV().create(PETSc.COMM_WORLD)
    block.setSizesFromVec(like, count)
    block.setFromOptions()
    for j, vector in enumerate(vectors):
        block.insertVec(j, vector)
    return block


def x_dot(left, right):
    """left' right, as a dense matrix of every rank."""
    return right.dot(left)


def gram(left, right):
    array = x_dot(left, right).getDenseArray().copy()
    return 0.5 * (array + array.T)


def dense(array):
    return PETSc.Mat().createDense(array.shape, array=array.ravel(order="F"), comm=PETSc.COMM_SELF)


def mumps_facts(matrix):
    entries = matrix.getMumpsInfog(29)
    return {
        "entries": int(entries if entries >= 0 else -entries * 1_000_000),
        "flops": float(matrix.getMumpsRinfog(3)),
        "megabytes_of_the_largest_rank": int(matrix.getMumpsInfog(18)),
        "megabytes_of_all_ranks": int(matrix.getMumpsInfog(19)),
        "null_pivots": int(matrix.getMumpsInfog(28)),
    }


def cluster_end(values, wanted, gap):
    """How many eigenvalues there are up to the end of the cluster of the last wanted one."""
    end = min(wanted, len(values))
    while 0 < end < len(values) and values[end] - values[end - 1] <= gap * abs(values[end]):
        end += 1
    return end


def wanted_modes(run):
    """How many modes are wanted; of those below an eigenvalue, as many as the count says."""
    wanted = run.prepared["wanted"]
    if wanted.get("below") is None:
        return wanted["modes"], None
    negative, zero = run.count(wanted["below"])
    return max(negative - run.prepared["rigid"], 0), (negative, zero, wanted["below"])


def find(run, wanted):
    """The wanted modes and some beyond, in stages that are kept."""
    stage = run.options.keep_every or wanted + EXTRA
    while len(run.found) < wanted + EXTRA:
        before = len(run.found)
        run.search(min(stage, wanted + EXTRA - before))
        if len(run.found) == before:
            break


def slices(run, wanted):
    """Spectrum slicing by SLEPc, part by part of the spectrum: each starts where the one before ended."""
    low, step = -run.prepared["shift"], 4.0 * run.prepared["shift"]
    below = run.prepared["rigid"]  # counted below the part; the rigid modes lie in the first one
    first = True
    while below - run.prepared["rigid"] < wanted + EXTRA:
        high = max(low, 0.0) + step
        counted, _ = run.count(high)
        inside = counted - below
        aimed = min(SLICE, wanted + EXTRA + run.prepared["rigid"] - below)
        if inside > 2 * SLICE or 2 * inside < aimed:
            # So many modes of a solid lie below an eigenvalue as its power of 3/2 says.
            step *= max(0.1, min(8.0, 1.2 * (aimed / max(inside, 1)) ** (2.0 / 3.0)))
            continue
        run.say(f"{inside} modes up to {run.hertz(high):.6g} Hz")
        one_slice(run, (low, high), inside + (run.prepared["rigid"] if first else 0))
        low, below, first = high, counted, False


def one_slice(run, interval, expected):
    if all_inside(run, interval, expected):
        return
    eps = SLEPc.EPS().create(PETSc.COMM_WORLD)
    eps.setOperators(run.stiffness, run.mass)
    eps.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    eps.setType(SLEPc.EPS.Type.KRYLOVSCHUR)
    eps.setWhichEigenpairs(SLEPc.EPS.Which.ALL)
    eps.setInterval(*interval)
    eps.setTolerances(1e-2 * run.prepared["residual"], 1000)
    transform = eps.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    linear = transform.getKSP()
    linear.setType(PETSc.KSP.Type.PREONLY)
    linear.getPC().setType(PETSc.PC.Type.CHOLESKY)
    linear.getPC().setFactorSolverType(PETSc.Mat.SolverType.MUMPS)
    # SLEPc counts by the pivots, which MUMPS has to keep to itself.
    PETSc.Options()["st_mat_mumps_icntl_13"] = 1
    PETSc.Options()["st_mat_mumps_icntl_24"] = 1
    eps.setFromOptions()
    eps.solve()
    new = []
    for j in range(eps.getConverged()):
        vector = run.stiffness.createVecRight()
        value = eps.getEigenpair(j, vector).real
        if value > 1e-3 * run.prepared["shift"]:
            new.append(vector)
    run.keep(new)
    run.found += new
    eps.destroy()
    run.time("search")


def all_inside(run, interval, expected):
    """Whether the modes of this part were kept by an earlier run."""
    if not run.found:
        return False
    inside = 0
    for vector in run.found:
        product = run.stiffness.createVecRight()
        run.stiffness.mult(vector, product)
        energy = product.dot(vector)
        run.mass.mult(vector, product)
        inside += interval[0] < energy / product.dot(vector) < interval[1]
    return inside >= expected - (run.prepared["rigid"] if interval[0] < 0 else 0)


def complete(run, wanted, counted):
    """The wanted modes, those of the same eigenvalue with them, and the count that says whether one is missing."""
    rigid, gap = run.prepared["rigid"], run.prepared["cluster_gap"]
    for _ in range(ATTEMPTS):
        run.refine()
        end = cluster_end(run.eigenvalues, wanted, gap)
        if len(run.eigenvalues) < wanted or run.options.no_count or run.options.solver in ("gamg", "lobpcg"):
            return end, None
        run.free_solvers()
        if counted:
            negative, zero, shift = counted
            end = sum(value < shift for value in run.eigenvalues)
        else:
            last, beyond = run.eigenvalues[end - 1], run.eigenvalues[end:]
            shift = 0.5 * (last + beyond[0]) if beyond else 1.1 * last
            negative, zero = run.count(shift)
        missing = negative - rigid - end
        run.say(f"inertia count {negative} at {run.hertz(shift):.6g} Hz: {rigid} rigid modes and {end} found, {missing} missing")
        if missing <= 0:
            return end, {"negative": negative, "zero": zero, "shift": shift}
        if run.search(missing + EXTRA) == 0:
            break
    return end, {"negative": negative, "zero": zero, "shift": shift}


def write_result(run, end, count, wanted):
    modes = run.found[:end]
    condensed = run.write_vectors("condensed.petsc", spread(condense(run, modes)))
    digest = run.write_vectors("modes.petsc", modes)
    version = ".".join(map(str, PETSc.Sys.getVersion()))
    if count:
        count["by"] = f"MUMPS of PETSc {version}"
    run.time("condensation and writing")
    beyond = run.eigenvalues[end:]
    content = {
        "matrices": run.prepared["matrices"],
        "wanted": wanted,
        "modes": end,
        "index_bytes": run.prepared["index_bytes"],
        "modes_sha256": digest,
        "condensed_sha256": condensed,
        "eigenvalues": run.eigenvalues[:end],
        "residuals": run.residuals[:end],
        "next_eigenvalue": beyond[0] if beyond else None,
        "count": count,
        "solver": run.options.solver,
        "slepc": ".".join(map(str, SLEPc.Sys.getVersion())),
        "petsc": version,
        "ranks": run.ranks,
        "seconds": {phase: round(seconds, 3) for phase, seconds in run.clock.items()},
        "factor": run.factor,
    }
    if run.rank == 0:
        write_sealed(run.path("result.jsonl"), "flexbody-result", content)
        run.remove("checkpoint.jsonl")
        for part in run.parts:
            run.remove(part["file"])
    PETSc.COMM_WORLD.barrier()


def condense(run, modes):
    """X' M X of X = [rigid modes, T_b modes for each axis b, modes]; T_b turns displacements about b. Every product runs on all ranks."""

    def columns():
        yield from run.rigid
        turned = run.stiffness.createVecRight()
        for name in run.prepared["turns"]:
            turn = run.matrix(name, run.prepared["block_size"])
            for mode in modes:
                turn.mult(mode, turned)
                yield turned
            turn.destroy()
        yield from modes

    count = len(run.rigid) + (len(run.prepared["turns"]) + 1) * len(modes)
    x, products = filled(columns(), modes[0], count), np.zeros((count, count))
    for first in range(0, count, PANEL):
        last = min(first + PANEL, count)
        panel = filled([], modes[0], last - first)
        x.setActiveColumns(first, last)
        x.matMult(run.mass, panel)
        x.setActiveColumns(0, count)
        products[:, first:last] = x_dot(x, panel).getDenseArray()
    return 0.5 * (products + products.T)


def spread(columns):
    """The columns of an array that every rank has, as vectors of all ranks."""
    vectors = [PETSc.Vec().createMPI(len(column), comm=PETSc.COMM_WORLD) for column in columns.T]
    for vector, column in zip(vectors, columns.T):
        vector.getArray()[:] = column[slice(*vector.getOwnershipRange())]
    return vectors


def main():
    run = Run(OPTIONS)
    run.resume()
    wanted, counted = wanted_modes(run)
    if run.options.solver == "slices":
        slices(run, wanted)
    elif len(run.found) < wanted + EXTRA:
        find(run, wanted)
    if not run.found:
        run.refuse("no mode was found", 1)
    end, count = complete(run, wanted, counted)
    if end < wanted:
        run.refuse(f"{end} of {wanted} modes converged; what was found is saved: run the same command again, which continues from there", 1)
    if count and count["negative"] != run.prepared["rigid"] + end:
        run.refuse(f"the inertia count is {count['negative']} below {run.hertz(count['shift']):.6g} Hz, {run.prepared['rigid']} rigid and {end} other modes were found; what was found is saved", 1)
    run.say(f"K-residual up to {max(run.residuals[:end]):.0e}, {run.prepared['residual']:.0e} is required, or the rounding floor of K")
    write_result(run, end, count, wanted)
    run.say(f"{end} modes up to {run.hertz(run.eigenvalues[end - 1]):.6g} Hz are in {run.path('result.jsonl')}")


OPTIONS, REST = arguments()
slepc4py = import_packages()
slepc4py.init([sys.argv[0], *REST])
import numpy as np
from petsc4py import PETSc
from slepc4py import SLEPc

if OPTIONS.probe:
    versions = {"petsc": PETSc.Sys.getVersion(), "slepc": SLEPc.Sys.getVersion(), "index_bytes": PETSc.IntType().itemsize, "ranks": PETSc.COMM_WORLD.getSize()}
    if PETSc.COMM_WORLD.getRank() == 0:
        print(json.dumps(versions))
elif __name__ == "__main__":
    try:
        main()
    except Exception as problem:
        # One rank that fails alone must not leave the others waiting: mpiexec ends them.
        is_out_of_memory = any(code in str(problem) for code in ("76", "91"))
        hint = "; if MUMPS ran out of memory: use -st_mat_mumps_icntl_14 100, or more nodes" if is_out_of_memory else ""
        print(f"error on rank {PETSc.COMM_WORLD.getRank()}: {problem}{hint}", file=sys.stderr, flush=True)
        os._exit(3)
