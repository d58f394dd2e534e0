#!/usr/bin/env python3
"""Stores the matrices and positions of a model folder as numpy arrays, so that peers need not be charged for reading text."""

import argparse
from pathlib import Path

import numpy as np

from measure import PACKED, read_model


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder with model.toml, as benches/make_block.py writes it")
    folder = parser.parse_args().folder
    stiffness, mass, positions = read_model(folder)
    arrays = {f"{name}_{part}": getattr(matrix, part) for name, matrix in (("K", stiffness), ("M", mass))
              for part in ("data", "indices", "indptr")}
    np.savez(folder / PACKED, positions=positions, **arrays)


if __name__ == "__main__":
    main()
