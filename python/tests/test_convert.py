"""From matrices to bodies: what goes in, what comes out, and what is refused."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import scipy.sparse
from conftest import MODELS, Given, given
from numpy.typing import NDArray

import flexbody


def in_model(body: flexbody.Body, given: Given) -> np.ndarray:
    """Psi (N x nf) by the rows of the matrices, along the axes of the model."""
    shapes = body.shapes @ body.axes.T
    place = {int(node): at for at, node in enumerate(body.node_ids)}
    assert given.dofs is not None
    rows = [shapes[:, place[int(node)], direction - 1] for node, direction in given.dofs]
    return np.array(rows)


def test_five_lines_make_a_body(cube: Given) -> None:
    K, M, nodes = cube.stiffness, cube.mass, cube.nodes
    body = flexbody.convert(K, M, nodes, node_ids=cube.node_ids, dofs=cube.dofs, units=("m", "kg", "s"), modes=8)
    assert (body.n_modes, body.n_nodes, body.n_dofs) == (8, len(nodes), K.shape[0])
    assert body.units == ("m", "kg", "s")
    assert body.proved_complete is not None and body.proved_complete >= 8


def test_modes_are_those_of_the_matrices(bracket: Given) -> None:
    body = bracket.model().convert(modes=10)
    psi = in_model(body, bracket)
    np.testing.assert_allclose(psi.T @ (bracket.mass @ psi), np.eye(10), atol=1e-10)
    strain = psi.T @ (bracket.stiffness @ psi)
    np.testing.assert_allclose(strain, np.diag(body.eigenvalues), atol=1e-9 * body.eigenvalues[-1])
    np.testing.assert_allclose(body.frequencies_hz, np.sqrt(body.eigenvalues) / (2 * np.pi), rtol=1e-14)
    np.testing.assert_allclose(body.modal_mass, np.eye(10), atol=1e-10)
    assert all(identity.holds for identity in body.identities())


def test_inertia_is_that_of_the_matrices(bracket: Given) -> None:
    body = bracket.model().convert(modes=4)
    assert bracket.dofs is not None
    place = dict(zip(bracket.node_ids.tolist(), bracket.nodes, strict=True))
    arms = np.array([place[int(node)] for node, _ in bracket.dofs]) - body.origin
    axis = np.array([direction - 1 for _, direction in bracket.dofs])
    move = np.eye(3)[axis]
    np.testing.assert_allclose(body.mass, move[:, 0] @ (bracket.mass @ move[:, 0]), rtol=1e-12)
    # Unit rotations about the axes of the body, along those of the model.
    turn = np.array([np.cross(body.axes[:, k], arms)[np.arange(len(axis)), axis] for k in range(3)]).T
    np.testing.assert_allclose(body.I0, turn.T @ (bracket.mass @ turn), atol=1e-11 * np.max(body.I0))


def test_the_kind_of_matrix_does_not_matter(cube: Given) -> None:
    first = cube.model().convert(modes=8)
    shuffled = scipy.sparse.coo_matrix(cube.stiffness)
    order = np.random.default_rng(1).permutation(shuffled.nnz)
    halves = [0.5 * shuffled.data[order]] * 2
    twice = scipy.sparse.coo_array(
        (np.concatenate(halves), (np.tile(shuffled.row[order], 2), np.tile(shuffled.col[order], 2))), shuffled.shape
    )
    for stiffness in (cube.stiffness.tocsr(), scipy.sparse.csr_matrix(cube.stiffness), twice, cube.stiffness.toarray()):
        assert cube._replace(stiffness=stiffness).model().convert(modes=8) == first


def test_callers_keep_their_matrices(cube: Given) -> None:
    stiffness = cube.stiffness.copy()
    column = slice(stiffness.indptr[0], stiffness.indptr[1])
    stiffness.indices[column] = stiffness.indices[column][::-1]
    stiffness.data[column] = stiffness.data[column][::-1]
    stiffness.has_sorted_indices = False
    before = stiffness.indices.copy()
    assert cube._replace(stiffness=stiffness).model().convert(modes=8) == cube.model().convert(modes=8)
    np.testing.assert_array_equal(stiffness.indices, before)


def test_files_and_memory_give_the_same_numbers(bracket: Given) -> None:
    read = flexbody.convert(MODELS / "bracket_hex20" / "model.toml", modes=6)
    made = bracket.model().convert(modes=6)
    for name in ("eigenvalues", "shapes", "I0", "W0", "W1", "W2", "W3", "C1", "C2", "axes", "origin", "positions"):
        np.testing.assert_array_equal(getattr(read, name), getattr(made, name), err_msg=name)
    assert [role for role, _, _ in read.sources] == ["manifest", "stiffness", "mass", "nodes", "dofs"]
    assert made.sources == [] and made.settings["modes"] == 6


def test_arrays_are_made_once_and_read_only(cube: Given) -> None:
    body = cube.model().convert(modes=8)
    assert body.W2 is body.W2 and body.W2 is not None and body.W2.shape == (24, 24)
    assert body.shapes.shape == (8, body.n_nodes, 3) and body.positions.shape == (body.n_nodes, 3)
    with pytest.raises(ValueError, match="read-only"):
        body.shapes[0, 0, 0] = 1.0
    assert body.rotations is None and body.interface_coordinates is None


def test_plane_models_and_rotations() -> None:
    plane = given("plane_frame")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", flexbody.FlexbodyWarning)
        flat = plane._replace(nodes=plane.nodes[:, :2]).model().convert(modes=5)
    assert flat.dimension == 2 and flat.equations_of_motion().n_rigid == 3
    beams = given("frame_beams")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", flexbody.FlexbodyWarning)
        labelled = beams.model().convert(modes=5)
    assert labelled.rotations is not None and labelled.rotations.shape == labelled.shapes.shape


def test_interfaces_and_craig_bampton(bracket: Given) -> None:
    ends = {"low": bracket.node_ids[:9], "high": (bracket.node_ids[-9:].tolist(), "rigid", bracket.nodes[-1])}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", flexbody.FlexbodyWarning)
        body = bracket.model(interfaces=ends).convert(modes=4, basis="craig-bampton")
    low, high = body.interfaces["low"], body.interfaces["high"]
    assert (low.coupling, high.coupling) == ("averaging", "rigid")
    np.testing.assert_array_equal(np.sort(low.node_ids), np.sort(bracket.node_ids[:9]))
    np.testing.assert_allclose(body.origin + body.axes @ high.reference, bracket.nodes[-1], atol=1e-12 * 100)
    own = body.interface_coordinates
    assert own is not None and len(own.names) == 12 + 4 == own.stiffness.shape[0]
    np.testing.assert_allclose(own.of_modes.T @ own.mass @ own.of_modes, np.eye(body.n_modes), atol=1e-8)


def without_numbers(given: Given) -> tuple[dict[str, object], np.ndarray]:
    """The model by positions, and the nodes of its face of the largest x, which are not those at their positions + 1."""
    place = {int(node): at for at, node in enumerate(given.node_ids)}
    dofs = None if given.dofs is None else np.array([[place[int(node)], dir] for node, dir in given.dofs])
    arguments = {"stiffness": given.stiffness, "mass": given.mass, "nodes": given.nodes, "dofs": dofs, "units": given.units}
    return arguments, given.nodes[:, 0] > given.nodes[:, 0].max() - 1e-9


def test_nodes_are_positions_without_numbers_and_numbers_with_them(bracket: Given) -> None:
    arguments, mask = without_numbers(bracket)
    positions = np.flatnonzero(mask)
    assert 0 not in positions
    numbered = bracket.model(interfaces={"end": (bracket.node_ids[mask], "rigid")})
    expected = numbered.convert(modes=2, basis="craig-bampton")
    for end in (positions, positions.tolist(), mask, mask.tolist()):
        body = flexbody.convert(**arguments, interfaces={"end": (end, "rigid")}, modes=2, basis="craig-bampton")
        np.testing.assert_allclose(body.frequencies_hz, expected.frequencies_hz, rtol=1e-9)
        np.testing.assert_array_equal(body.interfaces["end"].node_ids, positions)
        np.testing.assert_array_equal(body.node_ids, np.arange(len(mask)))
    by_mask = bracket.model(interfaces={"end": (mask, "rigid")}).convert(modes=2, basis="craig-bampton")
    assert by_mask == expected
    # A box around the same nodes.
    low, high = bracket.nodes[mask].min(axis=0), bracket.nodes[mask].max(axis=0)
    inside = np.all((bracket.nodes >= low) & (bracket.nodes <= high), axis=1)
    box = "box:" + ":".join("/".join(repr(float(x)) for x in corner) for corner in (low, high))
    by_box = bracket.model(interfaces={"end": (box, "rigid")}).convert(modes=2, basis="craig-bampton")
    assert by_box == bracket.model(interfaces={"end": (inside, "rigid")}).convert(modes=2, basis="craig-bampton")
    with pytest.raises(flexbody.InputError) as refused:
        bracket.model(interfaces={"end": "END"})
    assert refused.value.codes == ("FB801",)
    q = np.zeros(expected.n_modes)
    for at in positions[:3]:
        point = body.equations_of_motion().node(int(at))
        np.testing.assert_allclose(body.origin + body.axes @ point.place(q), bracket.nodes[at], atol=1e-9)


@pytest.mark.parametrize(
    ("end", "words"),
    [
        ([684], "names 1 positions outside of 0 to 683: 684"),
        ([-1, 3], "names 1 positions outside of 0 to 683: -1"),
        ([20000], "without node_ids nodes are positions from 0"),
        (np.ones(5, bool), r"the mask of interface 'end' has the shape \(5,\), expected \(684,\)"),
    ],
)
def test_nodes_that_are_none_are_refused_by_what_they_are(bracket: Given, end: object, words: str) -> None:
    arguments, _ = without_numbers(bracket)
    with pytest.raises(ValueError, match=words):
        flexbody.model(**arguments, interfaces={"end": end})


def test_unknown_numbers_are_called_numbers(bracket: Given) -> None:
    with pytest.raises(flexbody.InputError, match="names 1 unknown node numbers: 999999") as caught:
        bracket.model(interfaces={"end": [int(bracket.node_ids[0]), 999999]})
    assert caught.value.codes == ("FB209",) and "node_ids" in caught.value.diagnostics[0].help


def test_damping(cube: Given) -> None:
    frequencies = cube.model().convert(modes=8).frequencies_hz
    gap = int(np.argmax(np.diff(frequencies)))
    middle = float(frequencies[gap] + frequencies[gap + 1]) / 2
    bands = cube.model(damping=[(middle, 0.01), (None, 1.0)]).convert(modes=8)
    np.testing.assert_allclose(bands.damping_ratios, np.where(bands.frequencies_hz < middle, 0.01, 1.0))
    ratio = cube.model(damping=0.02).convert(modes=8)
    np.testing.assert_allclose(ratio.damping_ratios, 0.02)
    rayleigh = cube.model(damping=(0.0, 1e-9)).convert(modes=8)
    np.testing.assert_allclose(np.diag(rayleigh.damping), 1e-9 * rayleigh.eigenvalues, rtol=1e-9)
    matrix = cube.model(damping=1e-9 * cube.stiffness).convert(modes=8)
    np.testing.assert_allclose(matrix.damping, rayleigh.damping, atol=1e-8 * rayleigh.damping.max())


@pytest.mark.parametrize("side", ["upper", "lower"])
def test_one_triangle_is_refused(cube: Given, side: str) -> None:
    half = scipy.sparse.triu(cube.stiffness) if side == "upper" else scipy.sparse.tril(cube.stiffness)
    with pytest.raises(ValueError, match=f"stiffness has only its {side} triangle"):
        cube._replace(stiffness=half).model()


def test_texts_of_errors_move_no_terminal() -> None:
    diagnostic = flexbody.Diagnostic("FB202", "error", "length `\x1b[31m`", "a\nb\u202e.toml", 3, "give a unit")
    assert str(diagnostic) == "error[FB202]: length `\\u{1b}[31m`\n  in a\\nb\\u{202e}.toml, line 3\n  help: give a unit"
    assert "\x1b" not in str(flexbody.FlexbodyWarning(diagnostic))


def test_no_mode_at_all_is_no_body(cube: Given) -> None:
    with pytest.raises(flexbody.InputError, match="leaves the body without modes") as caught:
        cube.model().convert(modes=0)
    assert caught.value.codes == ("FB801",)


def test_errors_carry_codes(cube: Given) -> None:
    wrong = cube.stiffness.copy().tolil()
    wrong[0, 1] = 2.0 * wrong[0, 1] + 1.0
    with pytest.raises(flexbody.InputError) as caught:
        cube._replace(stiffness=wrong.tocsc()).model()
    error = caught.value
    assert isinstance(error, flexbody.FlexbodyError) and isinstance(error, ValueError)
    assert error.exit_code == 2 and error.codes == ("FB307",)
    first = error.diagnostics[0]
    assert first.severity == "error" and first.message and first.help and "FB307" in str(error)

    for keywords, code in [
        ({"units": ("mm", "stone", "s")}, "FB202"),
        ({"interfaces": {"end": [999999]}}, "FB209"),
        ({"damping": -2.0}, None),
    ]:
        with pytest.raises(flexbody.InputError) as caught:
            cube.model(**keywords)
        assert code is None or code in caught.value.codes
    infinite = cube.mass.copy()
    infinite.data[3] = np.nan
    with pytest.raises(flexbody.InputError) as caught:
        cube._replace(mass=infinite).model()
    assert "FB306" in caught.value.codes


def test_supports_in_the_matrix_are_refused(cube: Given) -> None:
    held = cube.stiffness.copy().tolil()
    for row in range(6):
        held[row, row] *= 10.0
    with pytest.raises(flexbody.FlexbodyError) as caught:
        cube._replace(stiffness=held.tocsc()).model().convert(modes=2)
    assert caught.value.codes


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"nodes": np.zeros((4, 4))}, "expected n x 3"),
        ({"nodes": np.zeros(3)}, "expected n x 3"),
        ({"node_ids": [1, 2]}, "node_ids have the shape"),
        ({"dofs": [[1, 2, 3]]}, "expected N x 2"),
        ({"dofs": [[1, 7]]}, "direction that is not 1 to 6"),
        ({"dofs": 5}, "expected 2, 3 or 6"),
        ({"units": ("mm", "t")}, "expected three"),
        ({"interfaces": {"end": ([1], "glued")}}, "`coupling` is \"glued\", expected one of rigid, averaging, free"),
        ({"residual_vectors": "wind"}, "'interfaces', 'centrifugal'"),
    ],
)
def test_wrong_arguments(cube: Given, change: dict[str, object], message: str) -> None:
    keywords = {"node_ids": cube.node_ids, "dofs": cube.dofs, "nodes": cube.nodes} | change
    with pytest.raises(flexbody.InputError, match=message) as caught:
        flexbody.model(cube.stiffness, cube.mass, **keywords)  # type: ignore[arg-type]
    assert isinstance(caught.value, ValueError) and caught.value.codes == ("FB804",)


def test_wrong_options(cube: Given) -> None:
    model = cube.model()
    for keywords, message in [
        ({"basis": "rayleigh"}, '`basis` is "rayleigh", expected one of free, '),
        ({"basis": "imported"}, "expected one of free, "),
        ({"accuracy": "best"}, '`accuracy` is "best"'),
        ({"frame": "mine"}, '`frame` is "mine"'),
        ({"modes": 3, "max_frequency": 10.0}, "expected one of them"),
        ({"max_frequency": -1.0}, "positive"),
        ({"max_frequency": float("nan")}, "finite"),
        ({"modes": -1}, "`modes` is -1, expected a whole number, 0 or larger"),
        ({"modes": 2**70}, "`modes` is 1180591620717411303424"),
    ]:
        with pytest.raises(flexbody.InputError, match=message) as caught:
            model.convert(**keywords)  # type: ignore[arg-type]
        assert caught.value.codes == ("FB804",)
    for wrong in ({"modes": 2.5}, {"modes": "three"}, {"modes": True}, {"basis": 3}, {"max_frequency": "high"}, {"frame": 1}):
        (name,) = wrong
        with pytest.raises(flexbody.ArgumentError, match=f"`{name}` is an? ") as mistyped:
            model.convert(**wrong)  # type: ignore[arg-type]
        assert isinstance(mistyped.value, TypeError) and isinstance(mistyped.value, flexbody.InputError)
    assert model.convert(modes=np.int64(8)).n_modes == 8  # type: ignore[arg-type]
    with pytest.raises(flexbody.ArgumentError, match="K, M and nodes"):
        flexbody.convert(cube.stiffness, cube.mass)  # type: ignore[call-overload]
    with pytest.raises(flexbody.ArgumentError, match="real numbers"):
        flexbody.model(cube.stiffness * 1j, cube.mass, cube.nodes)
    with pytest.raises(flexbody.InputError, match="square"):
        flexbody.model(cube.stiffness[:, :-1], cube.mass, cube.nodes)


@pytest.mark.filterwarnings("ignore::flexbody.FlexbodyWarning")
def test_jobs_of_fe_programs() -> None:
    folder = MODELS.parent / "small" / "calculix"
    model = flexbody.read_model(folder / "job.inp", units=("m", "kg", "s"))
    assert model.n_dofs > 0 and model.positions.shape == (len(model.node_ids), 3)
    with pytest.raises(flexbody.InputError) as caught:
        flexbody.read_model(folder / "nothing.inp")
    assert caught.value.codes
    with pytest.raises(ValueError, match="given together with a manifest"):
        flexbody.read_model(MODELS / "cube_hex8" / "model.toml", units=("m", "kg", "s"))


@pytest.mark.filterwarnings("ignore::flexbody.FlexbodyWarning")
def test_damping_of_jobs() -> None:
    job = MODELS.parent / "small" / "calculix" / "job.inp"

    def ratios(damping: float | tuple[float, float] | list[tuple[float | None, float]]) -> NDArray[np.float64]:
        return flexbody.read_model(job, units=("m", "kg", "s"), damping=damping).convert(modes=4).damping_ratios

    body = flexbody.read_model(job, units=("m", "kg", "s")).convert(modes=4)
    omega = 2 * np.pi * body.frequencies_hz
    assert np.allclose(ratios(0.02), 0.02)
    assert np.allclose(ratios((3.0, 1e-6)), 0.5 * (3.0 / omega + 1e-6 * omega))
    end = float(np.mean(body.frequencies_hz[[0, -1]]))
    assert np.allclose(ratios([(end, 0.01), (None, 0.03)]), np.where(body.frequencies_hz < end, 0.01, 0.03))
    with pytest.raises(flexbody.InputError):
        flexbody.read_model(job, units=("m", "kg", "s"), damping="no such file.mtx")
    with pytest.raises(ValueError, match="damping of a job"):
        flexbody.read_model(job, units=("m", "kg", "s"), damping=np.eye(3))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "wrong",
    [
        {"nodes": [[0, 0, 0], [1, 0]]},
        {"nodes": [["a", "b", "c"]]},
        {"nodes": None},
        {"stiffness": [[1, 0], [0]]},
        {"stiffness": "K"},
        {"node_ids": [1.5, 2.5]},
        {"node_ids": [2**63, 1]},
        {"node_ids": [2**70, 1]},
        {"dofs": "xyz"},
        {"interfaces": [1, 2]},
        {"interfaces": {1: [1]}},
        {"interfaces": {"end": ["a"]}},
        {"interfaces": {"end": ([1], "rigid", ["a", "b", "c"])}},
        {"interfaces": {"end": ([1], 3)}},
        {"units": 3},
        {"units": ("mm", "t")},
        {"damping": "much"},
        {"damping": 10**400},
        {"damping": ("a", 1.0)},
        {"damping": [(None, "a")]},
        {"residual_vectors": 3},
        {"residual_vectors": [3]},
        {"name": 3},
    ],
)
def test_every_wrong_value_is_an_error_of_the_package(cube: Given, wrong: dict[str, object]) -> None:
    whole = {"stiffness": cube.stiffness, "mass": cube.mass, "nodes": cube.nodes}
    keywords = whole | {"node_ids": cube.node_ids, "dofs": cube.dofs} | wrong
    with pytest.raises(flexbody.FlexbodyError) as caught:
        flexbody.model(**keywords)  # type: ignore[arg-type]
    assert caught.value.codes and caught.value.exit_code == 2


def test_wrong_paths_are_errors_of_the_package(cube: Given) -> None:
    body = cube.model().convert(modes=8)
    for call in (
        lambda: flexbody.read(3),
        lambda: flexbody.read_model(3),
        lambda: flexbody.read_model("a.inp", interfaces={"a": 3}),
        lambda: flexbody.read_model("a.inp", interfaces={"a": ("b", 3)}),
        lambda: flexbody.audit(None),
        lambda: flexbody.batch([]),
        lambda: flexbody.recipe(1),
        lambda: flexbody.explain(1),
        lambda: flexbody.import_body("a", 1),
        lambda: body.write(1),
        lambda: body.simulate(1),
        lambda: body.select([1]),
        lambda: body.report(1),
        lambda: body.subset(3),
        lambda: body.subset(["a"]),
        lambda: body.export("sid", 1),
        lambda: body.compare(1),
        lambda: body.check(1),
        lambda: body.view(1),
        lambda: body.recover(1),
        lambda: body.advise(spin="fast"),
        lambda: body.response(1.5, 1),
        lambda: body.equations_of_motion().node("a"),
        lambda: body.equations_of_motion().mass_matrix("abc"),
        lambda: flexbody.Scene(3),
        lambda: flexbody.Scene({"run": object()}),
    ):
        with pytest.raises(flexbody.ArgumentError) as caught:
            call()  # type: ignore[no-untyped-call]
        assert caught.value.codes == ("FB804",) and caught.value.diagnostics[0].help
    for call in (
        lambda: body.subset([-1]),
        lambda: body.subset([10**30]),
        lambda: body.equations_of_motion().node(2**70),
        lambda: body.view(triangles=0),
        lambda: body.response("1", "1", band=(1.0, 2.0, 3.0)),
        lambda: body.response("1", "1", band=(1.0, 2.0), points=-1),
        lambda: body.export("vtk", "a.vtu", modes=0),
        lambda: body.compare(body, mass=-1.0),
        lambda: flexbody.audit("a", tolerance=0.0),
        lambda: flexbody.Scene({"gravity": [0.0, 0.0, float("nan")]}),
        lambda: body.equations_of_motion().mass_matrix([[0.0] * 8]),
        lambda: body.select([]),
    ):
        with pytest.raises(flexbody.InputError) as caught:
            call()  # type: ignore[no-untyped-call]
        assert caught.value.codes == ("FB804",)
