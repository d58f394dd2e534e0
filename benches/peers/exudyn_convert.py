#!/usr/bin/env python3
"""The same job in Exudyn: modes and exact invariants of a model folder, CPU seconds by phase and peak memory as JSON."""

import argparse
import tempfile
from pathlib import Path

from measure import Phases, peak_mib, read_model, report, residual


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder with model.toml, as benches/make_block.py writes it")
    parser.add_argument("--modes", type=int, default=20, help="flexible modes; 6 rigid ones come on top")
    args = parser.parse_args()
    phases = Phases()
    with phases.phase("import"):
        import exudyn
        import numpy
        import scipy
        from exudyn.FEM import FEMinterface, ObjectFFRFreducedOrderInterface
    with phases.phase("read"):
        stiffness, mass, positions = read_model(args.folder)
    with phases.phase("set_up"):
        fem = FEMinterface()
        fem.nodes = {"Position": positions}
        fem.massMatrix, fem.stiffnessMatrix = mass, stiffness
    with phases.phase("eigenmodes"):
        fem.ComputeEigenmodes(args.modes, excludeRigidBodyModes=6, useSparseSolver=True)
    with phases.phase("invariants"):
        body = ObjectFFRFreducedOrderInterface(fem)
    with phases.phase("write"), tempfile.TemporaryDirectory() as scratch:
        body.SaveToFile(str(Path(scratch) / "body.npz"))
    peak = peak_mib()  # before the residuals, which are no part of the job
    residuals = residual(stiffness, mass, fem.eigenValues, fem.modeBasis["matrix"])
    versions = {"exudyn": exudyn.__version__, "scipy": scipy.__version__, "numpy": numpy.__version__}
    report("exudyn", versions, args.folder, stiffness, args.modes, phases, peak, fem.eigenValues, residuals)


if __name__ == "__main__":
    main()
