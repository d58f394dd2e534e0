"""Recipes of open FE codes (examples/recipes): each makes matrices and nodes of a block, which become a body beside scipy's own solution of the same matrices."""

import subprocess
import sys

import numpy as np
from common import ROOT, Absent, Row, run

# Recipe, the module that it needs, and how its program calls its version.
RECIPES = [
    ("scikit_fem", "skfem", "scikit-fem"),
    ("ngsolve_block", "ngsolve", "NGSolve"),
    ("mfem_block", "mfem", "PyMFEM"),
    ("getfem_block", "getfem", "GetFEM"),
    ("fenicsx", "dolfinx", "FEniCSx"),
]
SOURCES = "pip: scikit-fem, ngsolve, mfem; Debian: python3-getfem, python3-dolfinx-real"
# The block of all recipes: its edges and its density.
SIZE, DENSITY = np.array([0.3, 0.1, 0.08]), 7850.0
MODES = 8
VERSION = "import importlib.metadata as m, {0}; print(next((m.version(d) for d in m.packages_distributions().get('{0}', [])), getattr({0}, '__version__', '')))"


def python_with(module):
    """A Python that has the module, and the version of what it belongs to."""
    for python in (sys.executable, "/usr/bin/python3"):
        done = subprocess.run([python, "-c", VERSION.format(module)], capture_output=True, text=True)
        if done.returncode == 0:
            return python, done.stdout.strip()
    return None


def petsc(path):
    """A matrix of PETSc's binary form with 32-bit indices."""
    import scipy.sparse

    data = path.read_bytes()
    _, n, columns, count = np.frombuffer(data, ">i4", 4)
    lengths, indices = np.frombuffer(data, ">i4", n, 16), np.frombuffer(data, ">i4", count, 16 + 4 * n)
    values = np.frombuffer(data, ">f8", count, 16 + 4 * n + 4 * count)
    pointers = np.concatenate([[0], np.cumsum(lengths)])
    return scipy.sparse.csr_matrix((values.astype(float), indices.astype(np.int32), pointers), shape=(n, columns))


def matrix(folder, name):
    """The matrix that a recipe has written, and its file."""
    import scipy.io
    import scipy.sparse

    readers = {"npz": scipy.sparse.load_npz, "mtx": scipy.io.mmread, "petsc": petsc}
    path = next(path for kind in readers if (path := folder / f"{name}.{kind}").exists())
    return readers[path.suffix[1:]](path).tocsc(), path


def rows(flexbody, folder):
    import h5py
    from scipy.sparse.linalg import eigsh

    found = []
    for recipe, module, name in RECIPES:
        python = python_with(module)
        if python is None:
            continue
        own = folder / recipe
        own.mkdir()
        done = subprocess.run([python[0], ROOT / "examples/recipes" / f"{recipe}.py"], cwd=own, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"{recipe}: {done.stderr[-2000:]}")
        (K, stiffness), (M, mass) = matrix(own, "K"), matrix(own, "M")
        labels = ["--dofs", own / "dofs.csv"] if (own / "dofs.csv").exists() else []
        files = ["--stiffness", stiffness, "--mass", mass, "--nodes", own / "nodes.csv", *labels]
        path = own / "block.flex.h5"
        run(flexbody, "convert", *files, "--units", "m,kg,s", "--modes", MODES, "--lumped", "none", "--quiet", "-o", path)
        with h5py.File(path) as file:
            ours, weight, inertia = (file[at][()] for at in ("modes/eigenvalue", "invariants/mass", "invariants/I0"))
        theirs = np.sort(eigsh(K, 6 + MODES, M, sigma=-1e7, return_eigenvectors=False))[6:]
        m = DENSITY * SIZE.prod()
        exact = np.sort(m / 12 * ((SIZE**2).sum() - SIZE**2))
        program, form = f"{name} {python[1]}".strip(), f"recipe, {stiffness.suffix[1:]}"
        found.append(Row(program, form, f"eigenvalues of {MODES} modes beside scipy's", abs(ours / theirs - 1).max(), 1e-8))
        errors = [abs(np.ravel(weight)[0] / m - 1), *abs(np.linalg.eigvalsh(inertia) / exact - 1)]
        found.append(Row(program, form, "mass and inertia beside those of the block", max(errors), 1e-11))
    if not found:
        raise Absent(SOURCES)
    return found
