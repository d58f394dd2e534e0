"""Files: the same bytes from Python, the command and the program of the crate."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import FIXTURES, MODELS, Given

import flexbody

MANIFEST = MODELS / "bracket_hex20" / "model.toml"


def digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def program() -> str | None:
    """The program of the crate, where it was built."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", FIXTURES.parent / "target"))
    built = [target / profile / "flexbody" for profile in ("release", "debug")]
    named = os.environ.get("FLEXBODY_PROGRAM")
    return named or next((str(path) for path in built if path.exists()), None)


def test_what_was_written_is_read(cube: Given, tmp_path: Path) -> None:
    body = cube.model(damping=0.01, interfaces={"end": cube.node_ids[:5]}).convert(modes=8)
    body.write(tmp_path / "cube.flex.h5")
    read = flexbody.read(tmp_path / "cube.flex.h5")
    assert read == body and read != cube.model(damping=0.02).convert(modes=8)
    assert repr(read).startswith("<flexbody.Body 'model': ") or "model" in repr(read)
    assert list(read.interfaces) == ["end"]


def test_the_same_bytes_from_python_and_the_command(tmp_path: Path) -> None:
    flexbody.convert(MANIFEST, modes=6).write(tmp_path / "python.flex.h5")
    words = ["convert", str(MANIFEST), "--modes", "6", "--quiet", "-o"]
    subprocess.run([sys.executable, "-m", "flexbody", *words, tmp_path / "module.flex.h5"], check=True)
    assert digest(tmp_path / "python.flex.h5") == digest(tmp_path / "module.flex.h5")
    command = shutil.which("flexbody", path=str(Path(sys.executable).parent))
    if command:
        subprocess.run([command, *words, tmp_path / "command.flex.h5"], check=True)
        assert digest(tmp_path / "command.flex.h5") == digest(tmp_path / "module.flex.h5")
    if (own := program()) is None:
        pytest.skip("the program of the crate is not built")
    subprocess.run([own, *words, tmp_path / "program.flex.h5"], check=True)
    assert digest(tmp_path / "python.flex.h5") == digest(tmp_path / "program.flex.h5")


@pytest.mark.filterwarnings("ignore::flexbody.FlexbodyWarning")
def test_every_format_is_written(bracket_body: flexbody.Body, tmp_path: Path) -> None:
    assert {"exudyn", "sid", "mbdyn", "npz"} <= set(flexbody.export_formats())
    bracket_body.write(tmp_path / "body.flex.h5")
    # Those two need a Craig-Bampton body.
    for name in flexbody.export_formats().keys() - {"chrono", "simscape"}:
        (tmp_path / "own").mkdir(exist_ok=True)
        said = bracket_body.export(name, tmp_path / "own" / "body.out", allow_loss=True)  # type: ignore[arg-type]
        assert all(one.severity in ("warning", "note") for one in said), name
        assert (tmp_path / "own" / "body.out").stat().st_size > 0
        words = ["export", tmp_path / "body.flex.h5", "--to", name, "--allow-loss", "--quiet", "-o"]
        (tmp_path / "other").mkdir(exist_ok=True)
        subprocess.run([sys.executable, "-m", "flexbody", *words, tmp_path / "other" / "body.out"], check=True)
        files = sorted(path.name for path in (tmp_path / "own").iterdir())
        assert files == sorted(path.name for path in (tmp_path / "other").iterdir())
        for file in files:
            assert digest(tmp_path / "own" / file) == digest(tmp_path / "other" / file), (name, file)
        shutil.rmtree(tmp_path / "own")
        shutil.rmtree(tmp_path / "other")


@pytest.mark.filterwarnings("ignore::flexbody.FlexbodyWarning")
def test_a_motion_is_drawn_as_the_command_draws_it(bracket_body: flexbody.Body, tmp_path: Path) -> None:
    scene = tmp_path / "tumble.toml"
    scene.write_text("[run]\nduration = 0.001\noutputs = 4\n[initial]\nangular_velocity = [28, 1500, 4]\n")
    bracket_body.write(tmp_path / "body.flex.h5")
    motion = bracket_body.simulate(scene)
    motion.write(tmp_path / "motion.h5")
    for format, name in (("vtk", "motion.pvd"), ("gltf", "motion.glb")):
        own, others = tmp_path / format / "python", tmp_path / format / "command"
        own.mkdir(parents=True)
        others.mkdir(parents=True)
        said = bracket_body.export(format, own / name, motion=motion)  # type: ignore[arg-type]
        assert "FB723" in [diagnostic.code for diagnostic in said]
        words = ["export", tmp_path / "body.flex.h5", "--simulation", tmp_path / "motion.h5", "--to", format]
        subprocess.run([sys.executable, "-m", "flexbody", *words, "--quiet", "-o", others / name], check=True)
        written = {path.relative_to(own): digest(path) for path in own.rglob("*") if path.is_file()}
        assert written == {path.relative_to(others): digest(path) for path in others.rglob("*") if path.is_file()}
        assert len(written) == (6 if format == "vtk" else 1)
    with pytest.raises(flexbody.InputError) as shows_no_motion:
        bracket_body.export("json", tmp_path / "motion.json", motion=motion)
    assert shows_no_motion.value.codes == ("FB801",)
    other = flexbody.convert(MODELS / "cube_hex8" / "model.toml", modes=4)
    with pytest.raises(flexbody.InputError) as of_another:
        other.export("gltf", tmp_path / "other.glb", motion=tmp_path / "motion.h5")
    assert of_another.value.codes == ("FB735",)


def test_losses_are_warned_of(bracket_body: flexbody.Body, tmp_path: Path) -> None:
    # As by the command, loss is refused unless it is allowed.
    with pytest.raises(flexbody.InputError) as refused:
        bracket_body.export("openradioss", tmp_path / "body.rad")
    assert set(refused.value.codes) == {"FB720"} and not (tmp_path / "body.rad").exists()
    with pytest.warns(flexbody.FlexbodyWarning) as caught:
        said = bracket_body.export("openradioss", tmp_path / "body.rad", allow_loss=True)
    first = caught[0]
    assert isinstance(first.message, flexbody.FlexbodyWarning) and first.message.diagnostic in said
    assert first.message.diagnostic.code == "FB721"
    # In the name of this file, not of the package.
    assert first.filename == __file__


def test_frames_are_exported_with_warnings(tmp_path: Path) -> None:
    body = flexbody.read_model(MODELS / "frame_beams" / "model.toml").convert(modes=6)
    body.write(tmp_path / "body.flex.h5")
    scene = tmp_path / "fast.toml"
    spin = "[spin]\naxis = [0, 0, 1]\nrate = { to = 200.0, duration = 0.05 }\nhold = true\n"
    scene.write_text("[run]\nduration = 0.1\n" + spin)
    command = [sys.executable, "-m", "flexbody", "export", tmp_path / "body.flex.h5", "--to", "exudyn", "-o"]
    with pytest.warns(flexbody.FlexbodyWarning) as caught:
        body.export("exudyn", tmp_path / "python.hdf5")
    assert any("changes deflections by 1 %" in str(one.message) for one in caught)
    subprocess.run([*command, tmp_path / "command.hdf5", "--quiet"], check=True)
    assert digest(tmp_path / "python.hdf5") == digest(tmp_path / "command.hdf5")
    with pytest.raises(flexbody.InputError) as refused:
        body.export("exudyn", tmp_path / "fast.hdf5", scene=scene)
    assert set(refused.value.codes) == {"FB720"} and "deflections change by at most" in str(refused.value)
    done = subprocess.run([*command, tmp_path / "fast.hdf5", "--scene", scene], capture_output=True, text=True)
    assert done.returncode == 2 and "deflections change by at most" in done.stderr


def test_files_that_cannot_be(cube: Given, tmp_path: Path) -> None:
    body = cube.model().convert(modes=8)
    with pytest.raises(flexbody.InputError) as caught:
        body.write(tmp_path / "no folder" / "body.flex.h5")
    assert caught.value.codes == ("FB105",)
    with pytest.raises(flexbody.InputError) as caught:
        body.export("msc", tmp_path / "x")  # type: ignore[arg-type]
    assert caught.value.codes == ("FB801",)
    with pytest.raises(flexbody.InputError):
        flexbody.read(tmp_path / "none.flex.h5")
    (tmp_path / "text.flex.h5").write_text("no HDF5")
    with pytest.raises(flexbody.FlexbodyError):
        flexbody.read(tmp_path / "text.flex.h5")
    with pytest.raises(TypeError):
        flexbody.read(3)  # type: ignore[arg-type]
