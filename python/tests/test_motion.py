"""Equations of motion for other integrators, and the simulation of the library."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from conftest import SCENES
from scipy.integrate import solve_ivp

import flexbody


def rotation(p: np.ndarray) -> np.ndarray:
    """A of Euler parameters, the cosine of half the angle first."""
    w, e = p[0], p[1:]
    cross = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    return np.eye(3) * (w * w - e @ e) + 2 * np.outer(e, e) + 2 * w * cross


def test_a_motion_of_scipy_is_that_of_the_library(bracket_body: flexbody.Body, tmp_path: Path) -> None:
    scene = tmp_path / "tumble.toml"
    scene.write_text(
        'gravity = [0, 0, -9810]\n[run]\nduration = 0.004\noutputs = 40\ntolerance = 1e-11\n'
        "[initial]\nvelocity = [500, 0, 2000]\nangular_velocity = [28, 1500, 4]\n[[watch]]\nnode = 20000\n"
    )
    motion = bracket_body.simulate(scene)
    equations, nf = bracket_body.equations_of_motion(), bracket_body.n_modes
    gravity = np.array([0, 0, -9810.0])

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        p, q, nu = y[3:7], y[7 : 7 + nf], y[7 + nf :]
        A = rotation(p)
        omega = nu[3:6]
        quaternion = 0.5 * np.concatenate([[-p[1:] @ omega], p[0] * omega + np.cross(p[1:], omega)])
        applied = equations.gravity(q, A.T @ gravity)
        return np.concatenate([A @ nu[:3], quaternion, nu[6:], equations.accelerations(q, nu, applied)])

    start = np.concatenate([motion.origin[0], motion.attitude[0], motion.modal_coordinates[0]])
    A = rotation(motion.attitude[0])
    nu = np.concatenate([A.T @ motion.velocity[0], motion.angular_velocity[0], motion.modal_velocities[0]])
    found = solve_ivp(
        rates, (0, motion.time[-1]), np.concatenate([start, nu]), "DOP853", motion.time, rtol=1e-10, atol=1e-12
    )
    assert found.success
    np.testing.assert_allclose(found.y[:3].T, motion.origin, atol=1e-7)
    np.testing.assert_allclose(found.y[3:7].T, motion.attitude, atol=1e-7)
    q = motion.modal_coordinates
    np.testing.assert_allclose(found.y[7 : 7 + nf].T, q, atol=1e-5 * np.abs(q).max())
    # The path of a node from the same states.
    point, path = equations.node(20000), motion.paths["node 20000"]
    for at in (0, 17, 40):
        A = rotation(motion.attitude[at])
        np.testing.assert_allclose(motion.origin[at] + A @ point.place(q[at]), path.place[at], atol=1e-9)


@pytest.fixture(scope="module")
def state(bracket_body: flexbody.Body) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(7)
    nf = bracket_body.n_modes
    return 1e-3 * rng.normal(size=nf), rng.normal(size=6 + nf), rng.normal(size=6 + nf)


def test_forces_accelerations_and_mass_matrix_agree(
    bracket_body: flexbody.Body, state: tuple[np.ndarray, ...]
) -> None:
    equations, (q, nu, acceleration) = bracket_body.equations_of_motion(), state
    mass = equations.mass_matrix(q)
    np.testing.assert_allclose(mass, mass.T)
    forces = equations.forces(q, nu, acceleration)
    by_parts = mass @ acceleration + equations.velocity_forces(q, nu)
    by_parts[6:] += bracket_body.modal_stiffness @ q + bracket_body.damping @ nu[6:]
    np.testing.assert_allclose(forces, by_parts, rtol=1e-9, atol=1e-9 * np.abs(forces).max())
    np.testing.assert_allclose(
        equations.accelerations(q, nu, forces), acceleration, atol=1e-7 * np.abs(acceleration).max()
    )
    np.testing.assert_allclose(equations.kinetic_energy(q, nu), 0.5 * nu @ mass @ nu, rtol=1e-12)
    np.testing.assert_allclose(equations.momenta(q, nu), mass @ nu, rtol=1e-12)
    Q = np.kron(np.eye(3), q[:, None])
    assert bracket_body.W1 is not None and bracket_body.W2 is not None
    np.testing.assert_allclose(
        equations.inertia(q), bracket_body.I0 + bracket_body.W1 @ Q + Q.T @ bracket_body.W2 @ Q, rtol=1e-12, atol=1e-14
    )


def test_jacobians_are_the_slopes_of_the_forces(bracket_body: flexbody.Body, state: tuple[np.ndarray, ...]) -> None:
    equations, (q, nu, acceleration) = bracket_body.equations_of_motion(), state
    by_q, by_nu = equations.jacobians(q, nu, acceleration)
    for of, step, exact in [(0, 1e-3, by_q), (1, 1.0, by_nu)]:
        slopes = np.empty_like(exact)
        for column in range(exact.shape[1]):
            ends = []
            for sign in (1, -1):
                moved = [q.copy(), nu.copy()]
                moved[of][column] += sign * step
                ends.append(equations.forces(*moved, acceleration))
            slopes[:, column] = (ends[0] - ends[1]) / (2 * step)
        # Forces are quadratic: central differences have rounding alone.
        np.testing.assert_allclose(slopes, exact, atol=1e-7 * np.abs(exact).max())


def test_points_do_the_power_of_their_forces(bracket_body: flexbody.Body, state: tuple[np.ndarray, ...]) -> None:
    equations, (q, nu, acceleration) = bracket_body.equations_of_motion(), state
    force, torque = np.array([1.0, -2.0, 3.0]), np.array([0.3, 0.2, -0.1])
    bolt = equations.interface("bolt_wall")
    assert bolt.turns
    power = bolt.generalised_force(q, force, torque) @ nu
    expected = force @ bolt.velocity(q, nu) + torque @ bolt.angular_velocity(q, nu)
    np.testing.assert_allclose(power, expected, rtol=1e-12)
    np.testing.assert_allclose(bolt.jacobian(q) @ nu, bolt.velocity(q, nu), rtol=1e-12)
    node = equations.node(20000)
    assert not node.turns and node.angular_velocity(q, nu) is None
    assert node.acceleration(q, nu, acceleration).shape == (3,)
    with pytest.raises(ValueError, match="no orientation"):
        node.generalised_force(q, force, torque)
    with pytest.raises(flexbody.InputError):
        equations.node(-1)
    with pytest.raises(ValueError, match="`q` has 2 entries, expected 6"):
        equations.mass_matrix([1.0, 2.0])
    with pytest.raises(flexbody.InputError, match="`nu` has NaN"):
        equations.velocity_forces(q, np.full(12, np.nan))


def test_what_a_simulation_tells(bracket_body: flexbody.Body, tmp_path: Path) -> None:
    motion = bracket_body.simulate(SCENES / "tumbling.toml")
    instants = 1501
    assert motion.time.shape == (instants,) and motion.attitude.shape == (instants, 4)
    assert motion.modal_coordinates.shape == motion.modal_velocities.shape == (instants, 6)
    np.testing.assert_allclose(np.linalg.norm(motion.attitude, axis=1), 1.0, rtol=1e-12)
    total = motion.kinetic_energy + motion.elastic_energy - motion.work
    assert np.ptp(total) < 1e-6 * motion.kinetic_energy.max()
    assert max(motion.drift) < 1e-6 and motion.steps > 0 and motion.reactions is None
    path = motion.paths["interface bolt_wall"]
    assert 0 < np.abs(path.deflection).max() <= 1.001 * motion.largest_deflection
    report = motion.report()
    assert report["scene"] == "tumbling bracket" and "<svg" in motion.report("html")
    assert len(motion.csv().splitlines()) >= instants
    motion.write(tmp_path / "motion.h5")
    assert (tmp_path / "motion.h5").stat().st_size > 0


def test_scenes(tmp_path: Path) -> None:
    cases = flexbody.Scene.cases(SCENES / "car_frame_cases.toml")
    assert len(cases) > 1 and cases[0].name.startswith("car frame: ")
    with pytest.raises(flexbody.InputError) as caught:
        flexbody.Scene(SCENES / "car_frame_cases.toml")
    assert caught.value.codes == ("FB219",)
    named = flexbody.Scene(SCENES / "car_frame_cases.toml", cases[1].name.split(": ")[1])
    assert named.name == cases[1].name
    bad = tmp_path / "bad.toml"
    bad.write_text("gravity = 3\n")
    with pytest.raises(flexbody.InputError) as caught:
        flexbody.Scene(bad)
    assert caught.value.diagnostics[0].file == str(bad) and caught.value.diagnostics[0].line == 1


def test_scenes_of_text_and_of_dicts(bracket_body: flexbody.Body, tmp_path: Path) -> None:
    text = 'name = "spin"\n[run]\nduration = 0.004\noutputs = 4\n[initial]\nangular_velocity = [10, 200, 5]\n'
    values = {
        "name": "spin",
        "run": {"duration": np.float64(0.004), "outputs": np.int64(4)},
        "initial": {"angular_velocity": np.array([10.0, 200.0, 5.0])},
    }
    (tmp_path / "spin.toml").write_text(text)
    expected = bracket_body.simulate(tmp_path / "spin.toml").csv()
    for scene in (text, values, flexbody.Scene(text), flexbody.Scene(values)):
        assert bracket_body.simulate(scene).csv() == expected
    assert repr(flexbody.Scene(values)) == "<flexbody.Scene \"spin\">"
    cases = {"run": {"duration": 0.004}, "case": [{"name": "a"}, {"name": "b"}]}
    assert [case.name for case in flexbody.Scene.cases(cases)] == ["scene: a", "scene: b"]
    assert flexbody.Scene(cases, "b").name == "scene: b"
    with pytest.raises(flexbody.InputError) as caught:
        flexbody.Scene(cases)
    assert caught.value.codes == ("FB219",)
    with pytest.raises(flexbody.InputError) as caught:
        flexbody.Scene("[run]\nduration = true\n")
    assert caught.value.codes == ("FB211",) and caught.value.diagnostics[0].line == 2
    with pytest.raises(flexbody.InputError, match=r"in \[\[load\]\] 2: `force = 1`"):
        flexbody.Scene({"load": [{"node": 1, "force": [0, 0, 1]}, {"node": 2, "force": 1}]})
    # Files of histories lie in the stated folder.
    (tmp_path / "force.csv").write_text("time,f\n0,1\n0.004,2\n")
    history = {"file": "force.csv", "time": "time", "value": "f"}
    load = {"run": {"duration": 0.004}, "load": [{"node": 20000, "force": [0, 0, 1], "history": history}]}
    assert flexbody.Scene(load, folder=tmp_path).name == "scene"
    with pytest.raises(flexbody.InputError):
        flexbody.Scene(load, folder=tmp_path / "none")
    with pytest.raises(flexbody.InputError, match="whose folder counts"):
        flexbody.Scene(tmp_path / "spin.toml", folder=tmp_path)
