#!/usr/bin/env python3
"""Modes alone, by scipy's eigsh (ARPACK, shift-invert), on SuperLU or CHOLMOD: CPU seconds by phase and peak memory as JSON."""

import argparse

import numpy as np
import scipy
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from measure import Phases, peak_mib, read_model, report, residual, shift_estimate


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", help="folder with model.toml, as benches/make_block.py writes it")
    parser.add_argument("--modes", type=int, default=20, help="flexible modes; 6 rigid ones come on top")
    parser.add_argument("--factor", choices=["superlu", "cholmod"], default="superlu", help="superlu: what eigsh takes by itself")
    parser.add_argument("--tolerance", type=float, default=0.0, help="of eigsh (default: 0, its own default, machine precision)")
    args = parser.parse_args()
    phases, versions = Phases(), {"scipy": scipy.__version__, "numpy": np.__version__}
    if args.factor == "cholmod":
        with phases.phase("import"):
            import sksparse
            from sksparse.cholmod import cholesky
        versions["scikit-sparse"] = sksparse.__version__
    with phases.phase("read"):
        stiffness, mass, positions = read_model(args.folder)
    with phases.phase("set_up"):
        shift = shift_estimate(stiffness, mass, positions)
        shifted = (stiffness - shift * mass).tocsc()
    with phases.phase("factor"):
        if args.factor == "cholmod":
            solve = cholesky(shifted, ordering_method="metis", mode="supernodal")
        else:
            solve = splu(shifted).solve  # as eigsh does it
    with phases.phase("eigenmodes"):
        inverse = LinearOperator(stiffness.shape, matvec=solve, dtype=float)
        start = np.random.default_rng(1).standard_normal(stiffness.shape[0])
        values, vectors = eigsh(stiffness, args.modes + 6, mass, sigma=shift, OPinv=inverse, tol=args.tolerance, v0=start)
    peak = peak_mib()
    order = np.argsort(values)[6:]
    residuals = residual(stiffness, mass, values[order], vectors[:, order])
    versions["shift"] = shift
    report(f"scipy-{args.factor}", versions, args.folder, stiffness, args.modes, phases, peak, values[order], residuals)


if __name__ == "__main__":
    main()
