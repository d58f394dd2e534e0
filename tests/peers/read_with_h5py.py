#!/usr/bin/env python3
"""Reads a flex-body file with h5py (and h5dump where it is installed) and checks its layout and identities.

Optional: needs Python with h5py and numpy; not part of `cargo test`.

    flexbody convert model.toml -o body.flex.h5
    python3 tests/peers/read_with_h5py.py body.flex.h5

Tried with h5py 3.16, numpy 2 and h5dump 1.10.
"""

import shutil
import subprocess
import sys

import h5py
import numpy as np


def invariants(group):
    """The derived invariants, computed anew from the primary ones."""
    J, Ib, S = (group[name][()] for name in ("second_moment", "Ibar", "S"))
    cyclic = [(1, 2), (2, 0), (0, 1)]
    w1 = [[-(Ib[k, l] + Ib[l, k]) for l in range(3)] for k in range(3)]
    w2 = [[-S[l, k] for l in range(3)] for k in range(3)]
    for k, (a, b) in enumerate(cyclic):
        w1[k][k] = 2 * (Ib[a, a] + Ib[b, b])
        w2[k][k] = S[a, a] + S[b, b]
    return {
        "I0": np.trace(J) * np.eye(3) - J,
        "W1": np.array([np.concatenate(row) for row in w1]),
        "W2": np.block(w2),
        "W3": np.vstack([S[a, b] - S[b, a] for a, b in cyclic]),
        "C2": np.array([Ib[a, b] - Ib[b, a] for a, b in cyclic]),
        "modal_mass": S[0, 0] + S[1, 1] + S[2, 2],
    }


def check(path):
    with h5py.File(path) as f:
        assert f.attrs["format"] == "flexbody" and f.attrs["format_major"] == 1, dict(f.attrs)
        n, nf = f["nodes/id"].shape[0], f["modes/eigenvalue"].shape[0]
        assert f["modes/shape"].shape == (nf, n, 3) and f["modes/shape"].chunks == (1, n, 3)
        assert f["modes/shape"].compression == "gzip" and f["modes/shape"].shuffle
        assert f["nodes/id"].dtype == np.int64 and f["source"].attrs["n_nodes"] == n

        def described(name, item):
            if isinstance(item, h5py.Dataset):
                for attribute in ("units", "symbol", "description"):
                    assert isinstance(item.attrs[attribute], str), (name, attribute)
                assert np.all(np.isfinite(item[()])), name

        f.visititems(described)
        groups = [f["invariants"], *f["lumped"].values()]
        for group in groups:
            for name, expected in invariants(group).items():
                found = group[name][()]
                assert found.shape == expected.shape, (group.name, name)
                assert np.array_equal(found, expected), (group.name, name, abs(found - expected).max())
        assert list(f["comparison"]) == list(f["lumped"])
        axes = f["frame/axes"][()]
        assert np.allclose(axes.T @ axes, np.eye(3), atol=1e-10) and np.linalg.det(axes) > 0
        print(f"{path}: {n} nodes, {nf} modes, {len(groups) - 1} lumping schemes: good for h5py {h5py.__version__}")
    if shutil.which("h5dump"):
        for options in (["-H"], ["-d", "/modes/shape"], ["-a", "/generator"]):
            subprocess.run(["h5dump", *options, path], check=True, stdout=subprocess.DEVNULL)
        print(f"{path}: good for h5dump")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    for name in sys.argv[1:]:
        check(name)
