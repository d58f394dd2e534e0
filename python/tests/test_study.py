"""What a scene needs of a body, and what accuracy costs there."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest
from conftest import MODELS

import flexbody

pytestmark = pytest.mark.filterwarnings("ignore::flexbody.FlexbodyWarning")


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scene") / "spin.toml"
    path.write_text(
        "[run]\nduration = 0.004\noutputs = 20\n[initial]\nangular_velocity = [10, 200, 5]\n"
        "[tolerance]\ndeflection = 0.05\nattitude = 0.01\n"
    )
    return path


def test_selection(bracket_body: flexbody.Body, scene: Path) -> None:
    selection = bracket_body.select(scene)
    assert set(selection.modes) <= set(range(6)) and selection.holds
    assert {name for name, _, _ in selection.groups} == {"W1", "W2", "W3"} and selection.report()["scene"] == "spin"
    assert selection.report("text") and selection.report("json").startswith("{")
    with pytest.raises(ValueError, match='`form` is "pdf", expected one of dict'):
        selection.report("pdf")  # type: ignore[call-overload]


def test_a_body_made_for_a_scene(scene: Path) -> None:
    model = flexbody.read_model(MODELS / "bracket_hex20" / "model.toml")
    # The error of its reference body is above half of the tolerances.
    body = model.convert(modes=6, scene=flexbody.Scene(scene), allow_unjudged=True)
    assert len(body.terms) > 0 and all(isinstance(kept, bool) for _, kept, _ in body.terms)
    again = flexbody.convert(model, modes=6, scene=[flexbody.Scene(scene)], allow_unjudged=True)
    assert again == body


def test_a_body_that_cannot_be_judged() -> None:
    model = flexbody.read_model(MODELS / "cube_hex8" / "model.toml")
    shock = {
        "run": {"duration": 2e-4, "outputs": 20},
        "load": [{"node": 1, "force": [10, 20, 100]}],
        "tolerance": {"deflection": 0.5, "stress": 0.5},
    }
    with pytest.raises(flexbody.FlexbodyError, match="FB557"):
        model.convert(modes=5, scene=shock)
    assert model.convert(modes=5, scene=shock, allow_unjudged=True).n_modes > 0
    with pytest.raises(flexbody.InputError, match="without a `scene`"):
        model.convert(allow_unjudged=True)


def test_trade(bracket_body: flexbody.Body, scene: Path, tmp_path: Path) -> None:
    trade = bracket_body.trade(flexbody.Scene(scene), repeat=1)
    assert len(trade.candidates) > 3 and trade.recommended is not None and trade.holds
    assert trade.recommended in trade.front
    taken = trade.body(trade.recommended)
    assert taken.n_modes == trade.candidates[trade.recommended]["modes"]
    assert trade.report()["rows"] == trade.candidates and trade.csv().count("\n") > 3
    with pytest.raises(flexbody.InputError):
        trade.body(10_000)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "flexbody.Trade" in repr(trade)


def test_the_command_of_a_selection(bracket_body: flexbody.Body, scene: Path) -> None:
    command = bracket_body.select(scene).command("bracket.flex.h5")
    assert command is not None and command.startswith("flexbody reduce bracket.flex.h5 --keep-modes ")


def test_a_run_of_another_program(bracket_body: flexbody.Body, scene: Path, tmp_path: Path) -> None:
    motion = bracket_body.simulate(scene)
    exact = bracket_body.measure(scene, (motion.time, motion.modal_coordinates, motion.attitude))
    assert exact["holds"] and exact["worst"] < 1e-6
    wrong = bracket_body.measure(scene, (motion.time, 1.1 * motion.modal_coordinates, None))
    assert not wrong["holds"] and wrong["errors"]["attitude"] is None
    assert wrong["errors"]["stress"] == pytest.approx(0.1, rel=1e-6)
    table = tmp_path / "run.csv"
    table.write_text(motion.csv())
    assert bracket_body.measure(scene, table)["worst"] == pytest.approx(exact["worst"], abs=1e-9)
    with pytest.raises(flexbody.InputError, match="FB217"):
        bracket_body.measure(scene, (2 * motion.time, motion.modal_coordinates, None))
    with pytest.raises(ValueError, match="expected both or none"):
        bracket_body.measure(scene, table, reference=bracket_body)
