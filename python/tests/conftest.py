"""Models of the fixtures as a Python code has them: matrices of scipy and arrays of numpy. Runs of the command, and their results."""

from __future__ import annotations

import gzip
import json
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import scipy.io
import scipy.sparse

import flexbody

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
MODELS = FIXTURES / "models"
SCENES = FIXTURES / "scenes"


class Given(NamedTuple):
    """A model as matrices and arrays."""

    stiffness: Any
    mass: Any
    nodes: np.ndarray
    node_ids: np.ndarray
    dofs: np.ndarray | None
    units: tuple[str, str, str]

    def model(self, **keywords: Any) -> flexbody.Model:
        keywords = {"node_ids": self.node_ids, "dofs": self.dofs, "units": self.units, **keywords}
        return flexbody.model(self.stiffness, self.mass, self.nodes, **keywords)


def given(name: str) -> Given:
    folder = MODELS / name

    def matrix(stem: str) -> Any:
        with gzip.open(folder / f"{stem}.mtx.gz") as file:
            return scipy.sparse.csc_array(scipy.io.mmread(file))

    nodes = np.loadtxt(folder / "nodes.csv", delimiter=",", skiprows=1, ndmin=2)
    labels = folder / "dofs.csv"
    dofs = np.loadtxt(labels, delimiter=",", skiprows=1, dtype=np.int64) if labels.exists() else None
    stated = tomllib.loads((folder / "model.toml").read_text())["model"]["units"]
    units = (stated["length"], stated["mass"], stated["time"])
    return Given(matrix("K"), matrix("M"), nodes[:, 1:], nodes[:, 0].astype(np.int64), dofs, units)


def command(*words: object, cwd: Path | None = None) -> str:
    """Runs the command of the package and returns what it prints."""
    line = [sys.executable, "-m", "flexbody", *map(str, words)]
    done = subprocess.run(line, capture_output=True, text=True, check=False, cwd=cwd)
    assert done.returncode == 0, done.stderr + done.stdout
    return done.stdout


def results(*words: object) -> dict[str, Any]:
    """The results that a command prints with --json."""
    found = json.loads(command(*words, "--json"))["results"]
    assert isinstance(found, dict)
    return found


OF_A_RUN = ("diagnostics", "run", "wall_seconds", "cpu_seconds", "threads", "seconds", "history", "command", "body")


def same(found: Any, expected: Any) -> None:
    """Asserts that two reports agree apart from times, messages and paths."""

    def stripped(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: stripped(own) for key, own in value.items() if key not in OF_A_RUN}
        return [stripped(own) for own in value] if isinstance(value, list) else value

    assert stripped(found) == stripped(expected)


@pytest.fixture(scope="session")
def cube() -> Given:
    return given("cube_hex8")


@pytest.fixture(scope="session")
def bracket() -> Given:
    return given("bracket_hex20")


@pytest.fixture(scope="session")
def bracket_body() -> flexbody.Body:
    """In the frame that scenes are told in: at the centre of mass, along the axes of the model."""
    return flexbody.convert(MODELS / "bracket_hex20" / "model.toml", modes=6, frame="com")


# The material of the cube, in Pa, and the edge of its elements in m (fixtures/models/cube_hex8).
YOUNG, POISSON, EDGE = 7.0e10, 0.33, 0.0125


def stress_of_element(places: Any, node: int) -> Any:
    """The rows (6 x 3N) of the stress in Pa at the centre of a brick that has `node`, xx, yy, zz, xy, yz, xz."""
    inwards = np.where(places[node] < 0.05, 0.5 * EDGE, -0.5 * EDGE)
    offsets = places - (places[node] + inwards)
    corners = np.flatnonzero(np.abs(offsets).max(axis=1) < 0.6 * EDGE)
    # At the centre the gradient of the shape function of a corner is sign / (4 edge) along each axis.
    gradients = np.sign(offsets[corners]) / (4 * EDGE)
    strain = np.zeros((6, 3 * len(places)))
    for corner, (x, y, z) in zip(corners, gradients, strict=True):
        strain[:, 3 * corner : 3 * corner + 3] = [[x, 0, 0], [0, y, 0], [0, 0, z], [y, x, 0], [0, z, y], [z, 0, x]]
    shear = YOUNG / (2 * (1 + POISSON))
    elasticity = np.diag([2 * shear] * 3 + [shear] * 3)
    elasticity[:3, :3] += YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
    return scipy.sparse.csr_array(elasticity @ strain)
