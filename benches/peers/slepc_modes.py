#!/usr/bin/env python3
"""Modes alone, by SLEPc (Krylov-Schur, shift-invert) with MUMPS: CPU seconds by phase and peak memory as JSON."""

import argparse
from pathlib import Path

import numpy as np

from measure import Phases, peak_mib, read_model, report, residual, shift_estimate


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder with model.toml, as benches/make_block.py writes it")
    parser.add_argument("--modes", type=int, default=20, help="flexible modes; 6 rigid ones come on top")
    parser.add_argument("--shift", type=float, help="negative shift (default: from simple trial deformations)")
    parser.add_argument("--tolerance", type=float, default=1e-10)
    args = parser.parse_args()
    wanted, phases = args.modes + 6, Phases()
    with phases.phase("import"):
        import petsc4py
        import slepc4py
        slepc4py.init(["slepc_modes"])
        from petsc4py import PETSc
        from slepc4py import SLEPc
    with phases.phase("read"):
        stiffness, mass, positions = read_model(args.folder)
    with phases.phase("set_up"):
        shift = args.shift if args.shift is not None else shift_estimate(stiffness, mass, positions)
        if shift >= 0:
            parser.error("the shift must be negative: K - shift M has to be positive definite")
        pair = []
        for matrix in (stiffness, mass):
            csr = (matrix.indptr.astype(PETSc.IntType), matrix.indices.astype(PETSc.IntType), matrix.data)
            aij = PETSc.Mat().createAIJ(matrix.shape, csr=csr, comm=PETSc.COMM_SELF)
            aij.setOption(PETSc.Mat.Option.SYMMETRIC, True)
            pair.append(aij)
        solver = SLEPc.EPS().create(comm=PETSc.COMM_SELF)
        solver.setOperators(*pair)
        solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
        solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
        solver.setTarget(shift)
        solver.setDimensions(wanted)
        solver.setTolerances(args.tolerance, 200)
        transform = solver.getST()
        transform.setType(SLEPc.ST.Type.SINVERT)
        transform.setMatStructure(PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        linear = transform.getKSP()
        linear.setType(PETSc.KSP.Type.PREONLY)
        factor = linear.getPC()
        factor.setType(PETSc.PC.Type.CHOLESKY)
        factor.setFactorSolverType(PETSc.Mat.SolverType.MUMPS)
        PETSc.Options()["mat_mumps_icntl_7"] = 5  # METIS ordering
        linear.setFromOptions()
    with phases.phase("factor"):
        solver.setUp()
        linear.setUp()
    with phases.phase("eigenmodes"):
        solver.solve()
    peak = peak_mib()
    found = solver.getConverged()
    if found < wanted:
        raise SystemExit(f"only {found} of {wanted} modes converged")
    vector = pair[0].createVecRight()
    values, vectors = np.zeros(wanted), np.zeros((stiffness.shape[0], wanted))
    for i in range(wanted):
        values[i] = solver.getEigenpair(i, vector).real
        vectors[:, i] = vector.getArray()
    order = np.argsort(values)[6:]
    residuals = residual(stiffness, mass, values[order], vectors[:, order])
    versions = {"slepc": ".".join(map(str, SLEPc.Sys.getVersion())), "petsc": ".".join(map(str, PETSc.Sys.getVersion())),
                "petsc4py": petsc4py.__version__, "slepc4py": slepc4py.__version__, "shift": shift}
    report("slepc", versions, args.folder, stiffness, args.modes, phases, peak, values[order], residuals)


if __name__ == "__main__":
    main()
