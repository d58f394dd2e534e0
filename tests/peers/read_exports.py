#!/usr/bin/env python3
"""Reads the exports json, npz, simscape and chrono with the libraries that their users have, and compares them with the body.

Optional: needs Python with h5py, numpy and scipy; not part of `cargo test`.

    flexbody convert model.toml --basis craig-bampton -o body.flex.h5
    python3 tests/peers/read_exports.py flexbody body.flex.h5

where `flexbody` is the program. A body without Craig-Bampton coordinates is compared in json and npz only.
Tried with h5py 3.16, numpy 2.4 and scipy 1.17.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np
import scipy.io


def entries(path):
    """Datasets and attributes of a flex-body file by their paths."""
    datasets, attributes = {}, {}
    with h5py.File(path) as f:

        def visit(name, item):
            if isinstance(item, h5py.Dataset):
                datasets[name] = item[()]
            elif item.attrs:
                attributes[name] = {key: plain(value) for key, value in item.attrs.items()}

        attributes["/"] = {key: plain(value) for key, value in f.attrs.items()}
        # Digests are of the file, not of the body.
        for digest in ["digests", "sha256"]:
            del attributes["/"][digest]
        f.visititems(visit)
    return datasets, attributes


def plain(value):
    return value.item() if isinstance(value, np.generic) else value


def same(found, own):
    assert found.shape == own.shape and np.array_equal(found, own), (found, own)


def check_entries(get, names, attributes, own):
    assert set(names) == set(own[0]), set(names) ^ set(own[0])
    assert attributes == own[1]
    for name, array in own[0].items():
        same(get(name), array)


def check_frames(k, m, origins, own):
    """K and M are those of the body, and rigid motions about the origins strain nothing and have its mass."""
    same(k, own["interface_coordinates/stiffness"])
    same(m, own["interface_coordinates/mass"])
    rigid = np.zeros((len(k), 6))
    for i, (x, y, z) in enumerate(origins):
        rigid[6 * i : 6 * i + 6] = np.eye(6)
        rigid[6 * i : 6 * i + 3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    mass = rigid.T @ m @ rigid
    total = own["invariants/mass"][0]
    np.testing.assert_allclose(mass[:3, :3], total * np.eye(3), atol=1e-9 * total)
    np.testing.assert_allclose(mass[3:, 3:], own["invariants/I0"], atol=1e-9 * np.trace(mass[3:, 3:]))
    strained = np.abs(np.diag(rigid.T @ k @ rigid)) / np.diag(mass) / own["modes/eigenvalue"][0]
    assert strained.max() < 1e-6, strained


def check_chrono(k, m, origins, own):
    """Reduced as ChModalAssembly does (Craig-Bampton), K and M are those of the body; M times g on all translations, of which it keeps the rows of
    translations, is the load of gravity."""
    wanted = {name: own[f"interface_coordinates/{name}"] for name in ("stiffness", "mass")}
    nb, size = 6 * len(origins), len(wanted["mass"])
    modes = size - nb
    assert len(k) == len(m) == -(-(size + 3) // 6) * 6
    of_interfaces = -np.linalg.solve(k[nb:, nb:], k[nb:, :nb])
    half = np.linalg.inv(np.linalg.cholesky(k[nb:, nb:]))
    flexibility, shapes = np.linalg.eigh(half @ m[nb:, nb:] @ half.T)
    shapes = half.T @ shapes[:, ::-1][:, :modes] / np.sqrt(flexibility[::-1][:modes])
    basis = np.block([[np.eye(nb), np.zeros((nb, modes))], [of_interfaces, shapes]])
    # Amplitudes of the modes of the body in the internal nodes: those in translations stand on the centre of mass.
    total = own["invariants/mass"][0]
    to_body = np.zeros((size, len(m)))
    to_body[:nb, :nb] = np.eye(nb)
    for i in range(modes):
        to_body[nb + i, nb + 3 + i] = np.sqrt(total)
        if (3 + i) % 6 < 3:
            to_body[nb + i, nb + (3 + i) % 6] = -np.sqrt(total)
    back = np.linalg.inv(to_body @ basis)
    for name, matrix in (("stiffness", k), ("mass", m)):
        found = back.T @ (basis.T @ matrix @ basis) @ back
        scale = np.sqrt(np.outer(np.diag(wanted[name]), np.diag(wanted[name])))
        assert (np.abs(found - wanted[name]) / scale).max() < 1e-9, name
    for g in np.eye(3):
        load = m @ np.tile(np.append(g, [0, 0, 0]), len(m) // 6)
        load[np.arange(len(m)) % 6 >= 3] = 0
        rigid = np.append(np.tile(np.append(g, [0, 0, 0]), len(origins)), np.zeros(modes))
        own_load = wanted["mass"] @ rigid
        scale = np.sqrt(np.diag(wanted["mass"]) * total)
        assert (np.abs(back.T @ (basis.T @ load) - own_load) / scale).max() < 1e-9, g


def main(program, body):
    own = entries(body)
    with tempfile.TemporaryDirectory() as folder:

        def export(to, name, *options):
            path = Path(folder) / name
            command = [program, "export", body, "--to", to, "--allow-loss", "-o", path, *options]
            subprocess.run(command, check=True, capture_output=True)
            return path

        document = json.loads(export("json", "body.json").read_text())
        arrays = document["arrays"]
        check_entries(lambda name: np.array(arrays[name]["values"]), arrays, document["attributes"], own)
        with np.load(export("npz", "body.npz"), allow_pickle=False) as archive:
            about = json.loads(archive["metadata"].item())
            names = [name for name in archive.files if name != "metadata"]
            check_entries(lambda name: archive[name], names, about["attributes"], own)
        print(f"json and npz: {len(arrays)} arrays and all attributes are those of the body")

        if "interface_coordinates" not in own[1]:
            return
        mat = scipy.io.loadmat(export("simscape", "body.mat"))
        check_frames(mat["K"], mat["M"], mat["P0"], own[0])
        with h5py.File(export("simscape", "body.h5", "--dialect", "hdf5")) as f:
            for name in ("K", "M", "P0", "origin", "axes") + (("C",) if "C" in mat else ()):
                same(f[name][()], mat[name])
            frames = json.loads(f["frames"].asstr()[()])
            assert frames == [str(name).rstrip() for name in mat["frames"]], (frames, mat["frames"])
        table = export("chrono", "body.csv")
        k, m = (scipy.io.mmread(table.with_suffix(f".{name}.mtx")).toarray() for name in "KM")
        origins = [line.split(",")[-3:] for line in table.read_text().splitlines()[2:]]
        assert np.array_equal(np.array(origins, float), mat["P0"])
        check_chrono(k, m, origins, own[0])
        print(f"simscape (MAT, HDF5) and chrono: K and M at {', '.join(frames)} are those of the body, gravity in Chrono too")


if __name__ == "__main__":
    main(*sys.argv[1:])
