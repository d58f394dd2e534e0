"""Every command has a function of the package with the same results, or a reason why it has none."""

from __future__ import annotations

import copy
import os
import pickle
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from conftest import MODELS, command, results, same, stress_of_element

import flexbody

pytestmark = pytest.mark.filterwarnings("ignore::flexbody.FlexbodyWarning")

FUNCTIONS = {
    "convert": ("convert", "Model.convert", "import_body"),
    "batch": ("batch",),
    "inspect": ("Body.report",),
    "check": ("Body.check",),
    "compare": ("Body.compare",),
    "select": ("Body.select",),
    "simulate": ("Body.simulate",),
    "trade": ("Body.trade", "Model.trade"),
    "advise": ("Body.advise",),
    "measure": ("Body.measure",),
    "recover": ("Body.recover", "Body.channels", "Recovered.write_envelope_of_cases"),
    "reduce": ("Body.subset",),
    "response": ("Body.response", "Model.response"),
    "view": ("Body.view",),
    "export": ("Body.export",),
    "recipe": ("recipe",),
    "explain": ("explain",),
    "audit": ("audit",),
}
"""The functions that do what a command does."""

WITHOUT = {
    "prepare": "writes a folder for another machine: its result is files that `assemble` reads",
    "assemble": "reads a folder of `prepare` after the run of a cluster",
    "shapes": "writes a deck for an FE program: its result is a file that the program reads",
    "doctor": "describes the program and the machine that it runs on",
    "completions": "is about the command line",
    "man": "is about the command line",
    "help": "is about the command line",
}
"""Commands without a function, with the reason."""


def test_every_command_has_a_function_or_a_reason() -> None:
    listed = command("--help").split("Commands:")[1].split("Options:")[0]
    commands = set(re.findall(r"^  ([a-z]+) ", listed, re.MULTILINE))
    assert commands == FUNCTIONS.keys() | WITHOUT.keys(), "a new command needs a line in FUNCTIONS"
    for names in FUNCTIONS.values():
        for name in names:
            found: object = flexbody
            for part in name.split("."):
                found = getattr(found, part)
            assert callable(found), name


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a model that has recoveries, its body, a scene and its motion."""
    folder = tmp_path_factory.mktemp("parity") / "model"
    shutil.copytree(MODELS / "cube_hex8", folder)
    manifest = folder / "model.toml"
    model = flexbody.read_model(manifest)
    rows = stress_of_element(model.positions, 0)
    scipy.io.mmwrite(folder / "R.mtx", rows.tocoo())
    labels = ["row,name,quantity,component,unit"]
    labels += [f"{row},p {name},stress,{name},Pa" for row, name in enumerate(("xx", "yy", "zz", "xy", "yz", "xz"))]
    (folder / "rows.csv").write_text("\n".join(labels) + "\n")
    stress = '\n[[recovery]]\nname = "stress"\noperator = "R.mtx"\nrows = "rows.csv"\n'
    manifest.write_text(manifest.read_text() + stress)
    flexbody.convert(manifest, modes=8).write(folder / "body.flex.h5")
    (folder / "scene.toml").write_text(
        "[run]\nduration = 0.001\noutputs = 10\n[initial]\nangular_velocity = [10, 200, 5]\n"
    )
    command("simulate", folder / "body.flex.h5", "--scene", folder / "scene.toml", "--csv", folder / "run.csv", "--quiet", "-o", folder / "motion.h5")
    return folder


@pytest.fixture(scope="module")
def body(place: Path) -> flexbody.Body:
    return flexbody.read(place / "body.flex.h5")


def test_responses(place: Path, body: flexbody.Body) -> None:
    node = int(body.node_ids[3])
    line = ["--from", node, "--to", f"{node}:z", "--band", "10..5000", "--points", 60, "--csv", place / "response.csv"]
    alone = body.response(node, f"{node}:z", band=(10, 5000), points=60)
    same(alone.report(), results("response", place / "body.flex.h5", *line))
    assert alone.csv() == (place / "response.csv").read_text() and alone.holds
    model = flexbody.read_model(place / "model.toml")
    arguments: dict[str, Any] = {"band": (10, 5000), "points": 60, "solves": 4, "tolerance": 1e6}
    whole = model.response([node], [f"{node}:z"], modes=8, **arguments)
    more = ["--modes", 8, "--solves", 4, "--tolerance", 1e6]
    same(whole.report(), results("response", place / "model.toml", *line, *more))
    of_body = model.response(node, f"{node}:z", body=body, **arguments)
    assert of_body.csv() == whole.csv() == (place / "response.csv").read_text()
    function = whole.functions[0]
    assert (function.source, function.target, function.target_direction) == (f"node {node}", f"node {node}", "z")
    assert function.reduced.shape == function.full.shape == whole.frequencies_hz.shape
    assert function.reduced.dtype == np.complex128 and np.isfinite(function.full).any() and np.isnan(function.full).any()
    with pytest.raises(flexbody.InputError, match="no frequency band") as caught:
        body.response(node, node)
    assert caught.value.codes == ("FB801",)
    with pytest.raises(flexbody.InputError, match="those of a body that is made"):
        model.response(node, node, body=body, band=(10, 20), modes=3)


def test_comparisons(place: Path, body: flexbody.Body) -> None:
    small = body.subset([1, 2, 5])
    small.write(place / "small.flex.h5")
    common = body.compare(place / "small.flex.h5", common=True, invariants=1e-7)
    line = ["compare", place / "body.flex.h5", place / "small.flex.h5", "--common", "--invariants", 1e-7]
    assert common.report() == results(*line) and common.passed
    assert {row.quantity for row in common.rows} and all(row.passed for row in common.rows)
    assert common.report("junit").startswith("<?xml") and "|" in common.report("markdown")
    with pytest.raises(flexbody.InputError, match="FB707"):
        body.compare(small)


def test_checks(place: Path, body: flexbody.Body) -> None:
    assert body.check().report() == results("check", place / "body.flex.h5")
    against = body.check(place / "model.toml")
    assert against.report() == results("check", place / "body.flex.h5", "--against", place / "model.toml")
    assert against.passed and len(against.identities) > len(body.check().identities)
    assert body.check(flexbody.read_model(place / "model.toml")).report() == against.report()
    assert "identities hold" in against.report("text")


def test_audits_and_imports(place: Path, body: flexbody.Body) -> None:
    body.export("sid", place / "body.sid", allow_loss=True)
    audit = flexbody.audit(place / "body.sid")
    assert audit.report() == results("audit", place / "body.sid") and audit.passed
    assert audit.format == "sid" and audit.dialect and audit.findings == ()
    command("convert", place / "body.sid", "--from", "sid", "--units", "m,kg,s", "-o", place / "command.flex.h5", "--quiet")
    flexbody.import_body(place / "body.sid", "sid", units=("m", "kg", "s")).write(place / "python.flex.h5")
    assert (place / "command.flex.h5").read_bytes() == (place / "python.flex.h5").read_bytes()
    with pytest.raises(flexbody.InputError) as caught:
        flexbody.audit(place / "model.toml")
    assert caught.value.codes == ("FB730",)


def test_views(place: Path, body: flexbody.Body) -> None:
    command("view", place / "body.flex.h5", "-o", place / "command.html", "--quiet")
    view = body.view()
    view.write(place / "python.html")
    assert (place / "command.html").read_bytes() == (place / "python.html").read_bytes() == view.html.encode()
    assert view._repr_html_().startswith("<iframe srcdoc=") and view.report()["modes"] == 8
    command("view", place / "body.flex.h5", "--simulation", place / "motion.h5", "--triangles", 4, "-o", place / "command.html", "--quiet")
    motion = body.simulate(place / "scene.toml")
    for given in (motion, place / "motion.h5"):
        assert body.view(given, triangles=4).html == (place / "command.html").read_text()


def test_recoveries(place: Path, body: flexbody.Body) -> None:
    assert body.recoveries == ["stress"]
    recovered = body.recover(place / "run.csv")
    for name in ("command.csv", "command.h5"):
        told = results("recover", place / "body.flex.h5", "--history", place / "run.csv", "-o", place / name)
    same(recovered.report(), told)
    recovered.write(place / "python.h5")
    assert recovered.csv() == (place / "command.csv").read_text()
    assert (place / "python.h5").read_bytes() == (place / "command.h5").read_bytes()
    rows = recovered.rows["stress"]
    assert rows.values.shape == (len(recovered.time), 6) and rows.von_mises.shape == (len(recovered.time), 1)
    assert rows.points == ["p"] and rows.labels[3].component == "xy" and rows.labels[3].unit == "Pa"
    xx, yy, zz, xy, yz, xz = rows.values.T
    squares = ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2 + 3 * (xy**2 + yz**2 + xz**2)
    np.testing.assert_allclose(rows.von_mises[:, 0], np.sqrt(squares), rtol=1e-9)
    assert rows.principal.shape == (len(recovered.time), 1, 3)
    np.testing.assert_allclose(rows.principal.sum(axis=2)[:, 0], xx + yy + zz, atol=1e-9 * np.abs(rows.values).max())
    np.testing.assert_allclose(np.abs(rows.signed_von_mises), rows.von_mises)
    # The rows of a simulation, and the largest stresses.
    line = ["simulate", place / "body.flex.h5", "--scene", place / "scene.toml", "--quiet"]
    command(*line, "--rows", place / "command.h5", "--envelope", place / "command.csv")
    simulated = body.simulate(place / "scene.toml", envelope=True).recovered
    assert simulated is not None
    simulated.write(place / "python.h5")
    simulated.write_envelope(place / "python.csv")
    assert (place / "python.h5").read_bytes() == (place / "command.h5").read_bytes()
    assert (place / "python.csv").read_bytes() == (place / "command.csv").read_bytes()
    with pytest.raises(flexbody.InputError, match="in the report of its motion"):
        simulated.report()
    with pytest.raises(flexbody.InputError, match="without the largest stresses"):
        body.simulate(place / "scene.toml").recovered.write_envelope(place / "none.csv")  # type: ignore[union-attr]
    command("recover", place / "body.flex.h5", "--history", place / "run.csv", "-o", place / "command.h5", "--envelope", place / "command.csv", "--quiet")
    recovered.write_envelope(place / "python.csv")
    assert (place / "python.csv").read_bytes() == (place / "command.csv").read_bytes()
    # The same rows from arrays.
    motion = body.simulate(place / "scene.toml")
    history = {"time": motion.time, "q": motion.modal_coordinates, "angular_velocity": motion.angular_velocity}
    own = body.recover(history, "stress").rows["stress"]
    np.testing.assert_allclose(own.values, rows.values, atol=1e-6 * np.abs(rows.values).max())
    for wrong, code in [
        ({"time": [0.0]}, "FB804"),
        ({"time": [0.0], "q": [[0.0]]}, "FB804"),
        ({"time": [0.0], "q": [[0.0] * 8], "omega": 1}, "FB804"),
        ({"time": [0.0, 0.0], "q": [[0.0] * 8] * 2}, "FB804"),
        ({"time": [0.0], "q": [[0.0] * 8], "loads": {"end": ([[0.0] * 3], None)}}, "FB212"),
        ({"time": [0.0], "q": [[0.0] * 8], "loads": {"end": [[0.0] * 3]}}, "FB804"),
    ]:
        with pytest.raises(flexbody.InputError) as caught:
            body.recover(wrong)
        assert caught.value.codes == (code,)
    with pytest.raises(flexbody.InputError) as caught:
        body.recover(place / "run.csv", only="strain")
    assert caught.value.codes == ("FB221",)


def test_exports_with_options(place: Path, body: flexbody.Body) -> None:
    nodes = [int(node) for node in body.node_ids[:2]]
    line = ["--dialect", "py-sid", "--points", ",".join(map(str, nodes)), "--to-units", "mm,t,s", "--allow-loss"]
    command("export", place / "body.flex.h5", "--to", "sid", *line, "-o", place / "command.sid", "--quiet")
    body.export("sid", place / "python.sid", dialect="py-sid", points=nodes, to_units=("mm", "t", "s"), allow_loss=True)
    assert (place / "command.sid").read_bytes() == (place / "python.sid").read_bytes()
    command("export", place / "body.flex.h5", "--to", "gltf", "--modes", 2, "-o", place / "command.glb", "--quiet")
    body.export("gltf", place / "python.glb", modes=2)
    assert (place / "command.glb").read_bytes() == (place / "python.glb").read_bytes()
    with pytest.raises(flexbody.InputError) as caught:
        body.export("npz", place / "python.npz", to_units=("mm", "stone", "s"))  # type: ignore[arg-type]
    assert caught.value.codes == ("FB202",)


def test_batches(place: Path) -> None:
    listed = place / "list.toml"
    listed.write_text('[[body]]\nmodel = "model.toml"\noutput = "listed.flex.h5"\noptions = ["--modes", "8"]\n')
    batch = flexbody.batch(listed)
    assert batch.failed == 0 and batch.diagnostics == () and batch.bodies[0]["state"] == "done"
    assert (place / "listed.flex.h5").read_bytes() == (place / "body.flex.h5").read_bytes()
    # The command of the package starts itself, not the interpreter.
    assert results("batch", listed)["failed"] == 0
    listed.write_text('[[body]]\nmodel = "none.toml"\noutput = "none.flex.h5"\n')
    failed = flexbody.batch(listed)
    assert failed.failed == 1 and failed.diagnostics[0].code == "FB771" and "none.flex.h5" in failed.report("text")
    with pytest.raises(flexbody.InputError) as caught:
        flexbody.batch(place / "none.toml")
    assert caught.value.codes == ("FB770",)


def test_small_commands(place: Path, body: flexbody.Body) -> None:
    same(body.advise(spin=10.0), results("advise", place / "body.flex.h5", "--spin", 10))
    assert flexbody.recipe("calculix") == command("recipe", "calculix")
    with pytest.raises(flexbody.InputError) as caught:
        flexbody.recipe("patran")  # type: ignore[arg-type]
    assert caught.value.codes == ("FB801",)
    assert flexbody.explain("FB408") == command("explain", "FB408")
    assert flexbody.explain("408") == flexbody.explain("fb408")
    assert flexbody.explain() == command("explain")
    with pytest.raises(flexbody.InputError) as caught:
        flexbody.explain("FB000")
    assert caught.value.codes == ("FB801",) and "nearest codes are FB10" in str(caught.value)
    command("reduce", place / "body.flex.h5", "--keep-modes", "1,3", "--storage", "f32", "-o", place / "command.flex.h5", "--quiet")
    body.subset([1, 3], storage="f32").write(place / "python.flex.h5")
    assert (place / "command.flex.h5").read_bytes() == (place / "python.flex.h5").read_bytes()


@pytest.mark.parametrize("clone", [copy.copy, copy.deepcopy, lambda body: pickle.loads(pickle.dumps(body))])
def test_bodies_are_copied(place: Path, clone: Callable[[flexbody.Body], flexbody.Body]) -> None:
    body = flexbody.convert(place / "model.toml", modes=8)
    other = clone(body)
    assert other == body and other.diagnostics == body.diagnostics
    np.testing.assert_array_equal(other.shapes, body.shapes)


def test_other_processes_get_bodies(place: Path, body: flexbody.Body) -> None:
    (place / "body.pickle").write_bytes(pickle.dumps(body))
    code = "import pickle, sys; print(pickle.load(open(sys.argv[1], 'rb')).n_modes)"
    words = [sys.executable, "-c", code, os.fspath(place / "body.pickle")]
    assert subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip() == "8"
    damaged = pickle.dumps(body).replace(b"flexbody-file", b"flexbody-fxle")
    if damaged != pickle.dumps(body):
        with pytest.raises(flexbody.FlexbodyError):
            pickle.loads(damaged)


def test_notebooks_show_bodies(body: flexbody.Body) -> None:
    html = body._repr_html_()
    assert html.startswith("<dl") and "8 flexible" in html and "<script" not in html
