"""Colours of stresses, envelopes of load cases, and channels of FE steps: what Python makes is what the command writes."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import scipy.io
import scipy.sparse
from conftest import MODELS, command, results, stress_of_element

import flexbody

pytestmark = pytest.mark.filterwarnings("ignore::flexbody.FlexbodyWarning")

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "xz")

SCENE = """
[run]
duration = 0.001
outputs = 10

[[case]]
name = "about-x"
[case.initial]
angular_velocity = [390, 1, 0]

[[case]]
name = "about-z"
[case.initial]
angular_velocity = [0, 1, 400]
"""


class Stresses(NamedTuple):
    """A body with the stresses of nodes, of an element, and an interface, and the files that commands share."""

    folder: Path
    body: flexbody.Body
    operator: Any
    """Rows of the stresses of the nodes (rows x displacements of the model)."""

    def motions(self) -> dict[str, flexbody.Motion]:
        """The motions of the load cases."""
        cases = flexbody.Scene.cases(self.folder / "scene.toml")
        return {one.name.split(": ")[-1]: self.body.simulate(one, envelope=True) for one in cases}

    def assert_same(self, name: str, page: str | None = None) -> None:
        """Asserts that `python.*` has the bytes of `command.*`, or `page` its text."""
        expected = (self.folder / f"command{name}").read_bytes()
        found = page.encode() if page is not None else (self.folder / f"python{name}").read_bytes()
        assert expected and found == expected, name


@pytest.fixture(scope="module")
def stresses(tmp_path_factory: pytest.TempPathFactory) -> Stresses:
    folder = tmp_path_factory.mktemp("stresses") / "model"
    shutil.copytree(MODELS / "cube_hex8", folder)
    manifest = folder / "model.toml"
    model = flexbody.read_model(manifest)
    ids, places = model.node_ids, model.positions
    at = [0, 8, 80, 368, 688, 728]
    rows = 1e-3 * scipy.sparse.vstack([stress_of_element(places, node) for node in at]).tocsr()
    head = "row,name,quantity,component,unit,node,element\n"

    def labels(node: str, element: str, count: int) -> str:
        named = [(row, f"p{row // 6} {COMPONENTS[row % 6]}", COMPONENTS[row % 6], row // 6) for row in range(count)]
        node_of = [node or ids[at[point]] for *_, point in named]
        lines = [f"{row},{name},stress,{part},kPa,{node_of[row]},{element}\n" for row, name, part, _ in named]
        return head + "".join(lines)

    (folder / "skin.csv").write_text(labels("", "", rows.shape[0]))
    (folder / "inside.csv").write_text(labels(" ", "7", 6).replace(", ,", ",,"))
    scipy.io.mmwrite(folder / "skin.mtx", rows.tocoo())
    scipy.io.mmwrite(folder / "inside.mtx", rows[:6].tocoo())
    tip = ids[places[:, 0] > places[:, 0].max() - 1e-9]
    parts = [f'\n[[interface]]\nname = "tip"\ncoupling = "rigid"\nnodes = {tip.tolist()}\n']
    parts += [f'\n[[recovery]]\nname = "{name}"\noperator = "{name}.mtx"\nrows = "{name}.csv"\n' for name in ("inside", "skin")]
    manifest.write_text(manifest.read_text() + "".join(parts))
    flexbody.convert(manifest, modes=6).write(folder / "body.flex.h5")
    (folder / "scene.toml").write_text(SCENE)
    command("shapes", folder / "body.flex.h5", "--model", manifest, "--to", "npz", "-o", folder / "ask.npz", "--quiet")
    return Stresses(folder, flexbody.read(folder / "body.flex.h5"), rows)


def test_modes_have_the_colours_of_stresses(stresses: Stresses) -> None:
    folder, body = stresses.folder, stresses.body
    for words, triangles in ((), None), (("--triangles", 40), 40):
        told = results("view", folder / "body.flex.h5", "--recovery", "skin", *words, "-o", folder / "command.html")
        page = body.view(recovery="skin", triangles=triangles)
        page.write(folder / "python.html")
        stresses.assert_same(".html")
        assert page.report() == told and told["colours"] == ["skin: von Mises"]
    assert page.html != body.view(triangles=40).html


def test_envelopes_of_load_cases(stresses: Stresses) -> None:
    folder, body = stresses.folder, stresses.body
    motions = stresses.motions()
    assert list(motions) == ["about-x", "about-z"]
    cases = {name: motion.recovered for name, motion in motions.items() if motion.recovered}
    for kind in (".csv", ".vtu"):
        line = ["simulate", folder / "body.flex.h5", "--scene", folder / "scene.toml", "--quiet"]
        command(*line, "--envelope", folder / f"command{kind}")
        flexbody.Recovered.write_envelope_of_cases(cases, folder / f"python{kind}")
        stresses.assert_same(kind)
    with (folder / "python.csv").open() as table:
        rows = list(csv.DictReader(table))
    assert {row["von_mises_case"] for row in rows} == cases.keys(), "each load case is the larger one somewhere"
    # Both orders have the same extremes, each of the same load case.
    flexbody.Recovered.write_envelope_of_cases(dict(reversed(cases.items())), folder / "python.csv")
    stresses.assert_same(".csv")
    # The page of the body at rest, and that of one of its motions.
    told = results("view", folder / "body.flex.h5", "--envelope", folder / "command.csv", "-o", folder / "command.html")
    page = body.view(envelope=folder / "python.csv")
    stresses.assert_same(".html", page.html)
    assert page.report() == told
    motion = motions["about-z"]
    motion.write(folder / "motion.h5")
    line = ["view", folder / "body.flex.h5", "--simulation", folder / "motion.h5", "--triangles", 40]
    command(*line, "--envelope", folder / "command.csv", "-o", folder / "command.html", "--quiet")
    for given in (motion, folder / "motion.h5"):
        page = body.view(given, envelope=folder / "python.csv", triangles=40)
        stresses.assert_same(".html", page.html)
        assert page.html != body.view(given, triangles=40).html


def test_stresses_that_cannot_be_drawn_are_refused(stresses: Stresses) -> None:
    folder, body = stresses.folder, stresses.body
    motion = body.simulate(flexbody.Scene.cases(folder / "scene.toml")[0], envelope=True)
    assert motion.recovered is not None
    motion.recovered.write_envelope(folder / "one.csv")
    refused: list[tuple[dict[str, Any], str, str]] = [
        ({"recovery": "inside"}, "FB221", "only nodes are drawn"),
        ({"recovery": "gone"}, "FB221", "no recovery `gone`"),
        ({"recovery": "skin", "motion": motion}, "FB221", "a simulation has none"),
        ({"recovery": "skin", "envelope": folder / "one.csv"}, "FB804", "expected one of them"),
        ({"recovery": 3}, "FB804", "`recovery` is an int"),
        ({"envelope": 3}, "FB804", "`envelope` is an int"),
        ({"envelope": folder / "gone.csv"}, "FB101", "gone.csv"),
        ({"envelope": folder / "skin.csv"}, "FB203", "skin.csv"),
    ]
    for wrong, code, part in refused:
        with pytest.raises(flexbody.InputError) as caught:
            body.view(**wrong)
        assert caught.value.codes == (code,) and part in str(caught.value), wrong


def test_envelopes_of_other_bodies_and_recoveries_are_refused(stresses: Stresses) -> None:
    folder, body = stresses.folder, stresses.body
    target = folder / "refused.csv"
    scene = flexbody.Scene.cases(folder / "scene.toml")[0]
    with_envelope, without = body.simulate(scene, envelope=True).recovered, body.simulate(scene).recovered
    foreign = body.subset([1, 2, 3]).simulate(scene, envelope=True).recovered
    history = {"time": [0.0], "q": [[1e-6] * 6], "angular_velocity": [[0.0] * 3]}
    skin = body.recover(history, only="skin")
    for wrong, path, code, part in [
        ({}, target, "FB804", "`cases` is empty"),
        ({"a": with_envelope, "b": foreign}, target, "FB804", "load case `b` is of another body than load case `a`"),
        ({"a": with_envelope, "b": skin}, target, "FB804", "load case `b` has other recoveries or points"),
        ({"a": with_envelope, "b": without}, target, "FB804", "without the largest stresses"),
        ({"a": with_envelope, "b": 3}, target, "FB804", "`b` is an int, expected a Recovered"),
        ({1: with_envelope}, target, "FB804", "`name of a load case` is an int"),
        ([with_envelope], target, "FB804", "expected a dict"),
        ({"a": with_envelope}, folder / "refused.pdf", "FB801", "no known extension"),
    ]:
        with pytest.raises(flexbody.InputError) as caught:
            flexbody.Recovered.write_envelope_of_cases(wrong, path)  # type: ignore[arg-type]
        assert caught.value.codes == (code,) and part in str(caught.value), str(caught.value)
        assert not path.exists()
    # A body that was read again is the same body.
    again = flexbody.read(folder / "body.flex.h5").recover(history, only="skin")
    flexbody.Recovered.write_envelope_of_cases({"a": skin, "b": again}, target)
    assert target.exists()


def history_with_loads(body: flexbody.Body, folder: Path) -> dict[str, Any]:
    """A history of every quantity, also as the table `run.csv`."""
    seeds = np.random.default_rng(5)
    count, n = 9, body.n_modes
    time = 0.1 * np.arange(count)
    q, omega = 1e-4 * seeds.standard_normal((count, n)), 30 * seeds.standard_normal((count, 3))
    force, torque = 50 * seeds.standard_normal((count, 3)), 4 * seeds.standard_normal((count, 3))
    names = ["time", *(f"q_{j + 1}" for j in range(n)), *(f"angular_velocity_{axis}" for axis in "xyz")]
    names += [f"tip {kind}_{axis}" for kind in ("force", "torque") for axis in "xyz"]
    table = np.column_stack([time, q, omega, force, torque])
    lines = [",".join(names), *(",".join(repr(float(value)) for value in row) for row in table)]
    (folder / "run.csv").write_text("\n".join(lines) + "\n")
    return {"time": time, "q": q, "angular_velocity": omega, "loads": {"tip": (force, torque)}}


def test_channels_of_fe_steps(stresses: Stresses) -> None:
    folder, body = stresses.folder, stresses.body
    history = history_with_loads(body, folder)
    line = ["recover", folder / "body.flex.h5", "--history", folder / "run.csv", "--shapes", folder / "ask.npz", "--quiet"]
    for kind in (".csv", ".h5"):
        command(*line, "--channels", folder / f"command{kind}")
    channels = body.channels(folder / "run.csv", folder / "ask.npz")
    stresses.assert_same(".csv", channels.csv())
    channels.write(folder / "python.h5")
    stresses.assert_same(".h5")
    same = body.channels(history, folder / "ask.npz")
    stresses.assert_same(".csv", same.csv())
    steps = [f"mode {j + 1}" for j in range(6)]
    assert channels.names[:6] == steps and channels.names[-1] == "constant"
    assert {"spin xx", "spin yz", "tip Fx", "tip Mz"} < set(channels.names)
    assert channels.values.shape == (9, len(channels.names)) and not channels.values.flags.writeable
    np.testing.assert_array_equal(channels.time, history["time"])
    np.testing.assert_array_equal(channels.values[:, -1], 1)
    assert repr(channels) == f"<flexbody.Channels: {len(channels.names) - 1} steps and a constant at 9 instants>"
    table = np.loadtxt(folder / "command.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(table, np.column_stack([channels.time, channels.values]))
    # The results of the steps times their channels are the rows of the recovery.
    with np.load(folder / "ask.npz") as archive:
        displacements, columns = archive["displacements"], json.loads(str(archive["description"]))["columns"]
    assert columns == channels.names[:-1]
    answers = stresses.operator @ displacements.reshape(len(columns), -1).T
    rows = body.recover(history, "skin").rows["skin"].values
    np.testing.assert_allclose(channels.values[:, :-1] @ answers.T, rows, atol=1e-7 * np.abs(rows).max())


def test_channels_of_other_steps_are_refused(stresses: Stresses) -> None:
    folder, body = stresses.folder, stresses.body
    history = history_with_loads(body, folder)
    steps = folder / "ask.npz"
    (folder / "damaged.npz").write_bytes(steps.read_bytes()[:200])
    small = body.subset([1, 2, 3])
    short = {**history, "q": history["q"][:, :3]}
    rest = {key: value for key, value in history.items() if key != "angular_velocity"}
    for own, given, archive, code in [
        (small, short, steps, "FB326"),
        (body, short, steps, "FB804"),
        (body, rest, steps, "FB215"),
        (body, {**history, "loads": {"wall": (np.zeros((9, 3)), None)}}, steps, "FB212"),
        (body, history, folder / "gone.npz", "FB101"),
        (body, history, folder / "damaged.npz", "FB103"),
        (body, history, 3, "FB804"),
        (body, 3, steps, "FB804"),
    ]:
        with pytest.raises(flexbody.InputError) as caught:
            own.channels(given, archive)  # type: ignore[arg-type]
        assert caught.value.codes == (code,), str(caught.value)


def test_amplitudes_of_named_loads(stresses: Stresses, tmp_path: Path) -> None:
    folder = tmp_path / "model"
    shutil.copytree(stresses.folder, folder)
    manifest = folder / "model.toml"
    model = flexbody.read_model(manifest)
    wind = np.sin(0.7 * np.arange(model.n_dofs))
    # Two opposite forces along the line between two nodes.
    bolts = np.zeros(model.n_dofs)
    axis = model.positions[300] - model.positions[8]
    bolts[24:27], bolts[900:903] = axis, -axis
    np.save(folder / "wind.npy", wind)
    np.save(folder / "bolts.npy", bolts)
    parts = '\n[[named_load]]\nname = "wind"\nvector = "wind.npy"\n\n[[named_load]]\nname = "bolts"\nvector = "bolts.npy"\npreload = true\n'
    manifest.write_text(manifest.read_text() + parts)
    body = flexbody.convert(manifest, modes=6)
    assert body.named_loads == ["wind", "bolts"]
    time, amplitude = np.linspace(0, 1, 5), np.array([0.0, 2.0, -1.0, 0.5, 3.0])
    q = 1e-6 * np.sin(np.arange(30)).reshape(5, 6)
    head = ",".join(["time", *(f"q_{j}" for j in range(1, 7)), *(f"angular_velocity_{k}" for k in "xyz"), "wind"])
    table = np.column_stack([time, q, np.zeros((5, 3)), amplitude])
    np.savetxt(folder / "run.csv", table, delimiter=",", header=head, comments="", fmt="%.17g")
    history = {"time": time, "q": q, "angular_velocity": np.zeros((5, 3))}
    given = body.recover({**history, "amplitudes": {"wind": amplitude}}).rows["skin"].values
    np.testing.assert_array_equal(given, body.recover(folder / "run.csv").rows["skin"].values)
    # The rows are linear in the amplitude, and the preload acts in all of them.
    unloaded = body.recover(history).rows["skin"].values
    one = (given - unloaded)[1] / 2.0
    np.testing.assert_allclose(given - unloaded, np.outer(amplitude, one), atol=1e-9 * np.abs(one).max())
    assert np.abs(unloaded - stresses.body.recover(history).rows["skin"].values).max() > 0
    for amplitudes, said in (
        ({"rain": amplitude}, "the body has no named load `rain`"),
        ({"bolts": amplitude}, "`bolts` is a preload"),
        ({"wind": amplitude[:3]}, "3 amplitudes of the named load `wind` for 5 times"),
    ):
        with pytest.raises(flexbody.FlexbodyError, match=said):
            body.recover({**history, "amplitudes": amplitudes})
