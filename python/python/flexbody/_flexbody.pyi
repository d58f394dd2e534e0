"""Types of the extension module. Made of python/src by ./scripts/make.sh bless: change the sources instead."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _types
from ._errors import Diagnostic

_Floats = NDArray[np.float64]
_Path = _types.Path
_Source = Mapping[str, Any] | _Path
_Scene = Scene | _Source
_Cases = Scene | Sequence[Scene] | _Source
_Compressed = tuple[int, NDArray[np.int64], NDArray[np.int64], _Floats]

__version__: str

def batch(path: _Path, *, memory_limit: int | None = None, allow_programs: bool = False) -> Batch:
    """Makes the bodies of a list (docs/how_to/batch.md) that are missing or have changed inputs, as many in parallel as fit
    into the memory, like `flexbody batch`. A failed body does not end the batch.

    `memory_limit` limits the memory of all of them in bytes; without one it is the free memory. `allow_programs` lets the
    options of the list name programs to start. Raises InputError for a list that cannot be read.
    """

def audit(path: _Path, *, format: _types.ImportFormat | None = None, tolerance: float = 1e-6) -> Audit:
    """Reads and checks a flexible body in a file of another program, like `flexbody audit`. Identities pass up to
    `tolerance`, relative to the size of their terms.

    Raises InputError if the file cannot be read or its format is not recognised.
    """

def explain(code: str | None = None) -> str:
    """Returns what a message means, why it arises and what to do, like `flexbody explain`: by its code (`"FB408"`,
    `"408"`), or all codes in one line each without one. Errors and warnings of this package state their codes.
    """

def recipe(program: _types.RecipeProgram) -> str:
    """Returns how an FE program writes its matrices, like `flexbody recipe`: the lines of the deck, and the command that
    continues from there.
    """

def _choices() -> dict[str, list[str]]:
    """Returns the names of all choices, for the test that the types of the package state the same ones."""

def run_command(words: Sequence[str]) -> int:
    """Runs the command `flexbody` with `words`, the name of the command first, and returns its exit code. Its output goes
    to the streams of the process.

    The process must serve this command only: signals with the default handling, and panics, end the process as they end
    the program, without an unfinished file.
    """

def _restored(bytes: bytes, found: Sequence[tuple[object, ...]]) -> Body:
    """Makes a body of the bytes and the diagnostics of a pickle."""

def export_formats() -> dict[str, str]:
    """Returns the formats that `Body.export` writes: dict of name to the programs that read it."""

def import_body(
    path: _Path, format: _types.ImportFormat, *, units: _types.Units | None = None, frame: _types.Frame | None = None
) -> Body:
    """Reads a body in a file of another program, like `flexbody convert --from`: SID_FEM, MBDyn, MBSim, Exudyn.

    `units` are those of length, mass and time of the file, m, kg and s without; `frame` is a body frame as for `convert`,
    that of the file without. Raises InputError if the file cannot be read, does not determine a body, or contradicts itself.
    """

def read(path: _Path) -> Body:
    """Reads a flex-body file.

    Raises InputError if it cannot be read or has a newer format, CheckError if it violates its schema or was changed
    since it was written.
    """

@final
class Batch:
    """Bodies of a list, made by the command `flexbody`, each in a process of its own."""

    @property
    def bodies(self) -> list[dict[str, Any]]:
        """Bodies, each as a dict with the properties from `flexbody batch`: output, state ("done", "unchanged", "failed"),
        error, modes, frequencies_hz, seconds and others.
        """

    @property
    def failed(self) -> int:
        """Number of failed bodies."""

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """The error about failed bodies (FB771), as a tuple of `Diagnostic`; empty if all were made."""

    @overload
    def report(self, form: Literal["dict"] = "dict") -> dict[str, Any]:
        """Returns the report of `flexbody batch`: a dict with all numbers, or "json", "text", "html" as a str."""

    @overload
    def report(self, form: Literal["json", "text", "html"]) -> str: ...

@final
class Body:
    """A flexible body with n nodes and nf modes: the modes, and the constant invariants in the equations of motion of its
    floating frame. Vectors are along the axes of the body frame, about its origin, in the units of the model. Arrays
    are read-only and made once: copy an array before you change it.

    `flexbody.convert` makes one, `flexbody.read` reads one. Bodies can be compared for equality, copied and pickled.
    """

    @property
    def name(self) -> str:
        """Name of the model."""

    @property
    def units(self) -> tuple[str, str, str]:
        """Units of length, mass and time as stated: ("mm", "t", "s"), or factors to SI."""

    @property
    def dimension(self) -> int:
        """Number of dimensions: 3, or 2 for a body that moves only in its plane z = 0."""

    @property
    def n_nodes(self) -> int:
        """Number of nodes n."""

    @property
    def n_modes(self) -> int:
        """Number of modes nf."""

    @property
    def n_dofs(self) -> int:
        """Number of rows of the matrices; 0 if it is not known."""

    @property
    def mass_structure(self) -> str:
        """Structure of the mass matrix: "rotation-invariant", "diagonal" or "general"."""

    @property
    def settings(self) -> dict[str, Any]:
        """Settings of the conversion that can change the result, as a dict."""

    @property
    def sources(self) -> list[tuple[str, str, str]]:
        """Files that the body was made from: list of (role, name, SHA-256). Empty for matrices in memory."""

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Warnings and notes of the conversion, as a tuple of `Diagnostic`; empty for a body that was read."""

    @property
    def node_ids(self) -> NDArray[np.int64]:
        """Node numbers (n), int64."""

    @property
    def positions(self) -> _Floats:
        """Positions of the nodes in the body frame (n x 3). Unit: length."""

    @property
    def origin(self) -> _Floats:
        """Origin of the body frame in model coordinates (3). Unit: length."""

    @property
    def axes(self) -> _Floats:
        """Axes of the body frame as columns, in model axes (3 x 3): x_model = origin + axes @ x_body."""

    @property
    def frequencies_hz(self) -> _Floats:
        """Frequencies of the modes, ascending (nf). Unit: Hz."""

    @property
    def eigenvalues(self) -> _Floats:
        """Eigenvalues of the modes, omega^2 (nf). Unit: 1/time^2."""

    @property
    def residuals(self) -> _Floats:
        """K-residuals |K psi - lambda M psi| / (|K psi| + |lambda| |M psi|) of the modes (nf)."""

    @property
    def damping_ratios(self) -> _Floats:
        """Damping ratios of the modes (nf)."""

    @property
    def mode_origins(self) -> list[str]:
        """Origin of each mode: "free mode", "imported shape", ...; empty if it is not known."""

    @property
    def proved_complete(self) -> int | None:
        """Number of lowest modes among which no mode is missing, by proof; None without a proof."""

    @property
    def shapes(self) -> _Floats:
        """Psi (nf x n x 3): displacements of the nodes in each mode, shapes[j] for mode j. Unit: 1/sqrt(mass)."""

    @property
    def rotations(self) -> _Floats | None:
        """Rotations of the nodes in each mode (nf x n x 3), zero at nodes without rotations; None for models with
        displacements only. Unit: 1/(length sqrt(mass)).
        """

    @property
    def mass(self) -> float:
        """Mass m. Unit: mass."""

    @property
    def first_moment(self) -> _Floats:
        """First moment c = sum m x (3). Unit: mass length."""

    @property
    def second_moment(self) -> _Floats:
        """Second moment J = sum m x x' (3 x 3). Unit: mass length^2."""

    @property
    def I0(self) -> _Floats:
        """I0 (3 x 3): inertia of the undeformed body. Unit: mass length^2."""

    @property
    def W0(self) -> _Floats:
        """W0 (3 x 3nf): linear momentum of rotation, linear in the modal coordinates. Unit: sqrt(mass)."""

    @property
    def W1(self) -> _Floats | None:
        """W1 (3 x 3nf): inertia linear in q, I(q) = I0 + W1 Q + Q'W2 Q with Q = kron(eye(3), q). None for a body made for
        a scene that does not need it. Unit: sqrt(mass) length.
        """

    @property
    def W2(self) -> _Floats | None:
        """W2 (3nf x 3nf): inertia quadratic in q. None for a body made for a scene that does not need it. Unit: 1."""

    @property
    def W3(self) -> _Floats | None:
        """W3 (3nf x nf): coupling of rotation and modes through q. None for a body made for a scene that does not need it.
        Unit: 1.
        """

    @property
    def C1(self) -> _Floats:
        """C1 (3 x nf): coupling of translation and modes; zero for free modes. Unit: sqrt(mass)."""

    @property
    def C2(self) -> _Floats:
        """C2 (3 x nf): coupling of rotation and modes in the undeformed body; zero for free modes. Unit: sqrt(mass)
        length.
        """

    @property
    def modal_mass(self) -> _Floats:
        """Modal mass m_ff = Psi' M Psi (nf x nf). Unit: 1."""

    @property
    def modal_stiffness(self) -> _Floats:
        """Modal stiffness K_ff = Psi' K Psi (nf x nf). Unit: 1/time^2."""

    @property
    def damping(self) -> _Floats:
        """D (nf x nf): modal damping; diag(2 zeta_j omega_j) if only ratios are known. Unit: 1/time."""

    @property
    def geometric_stiffness(self) -> dict[str, _Floats]:
        """Geometric stiffness Psi' K_geo Psi (nf x nf) of unit loads: dict of load ("spin_xx", "force_z_tip", ...) to
        array. Unit: 1/time^2 per unit of the load.
        """

    @property
    def inertia_stiffness(self) -> dict[str, _Floats]:
        """Stiffness of inertia (nf x nf) of nodes whose rotations carry mass, for unit loads: dict of load
        ("acceleration_x", "angular_acceleration_x", "spin_xx", ...) to array; empty if no rotation carries mass. It is
        added to K_ff like geometric stiffness. Unit: 1/time^2 per unit of the load.
        """

    @property
    def interfaces(self) -> dict[str, _types.Interface]:
        """Interfaces: dict of name to Interface (node_ids, coupling, reference, translation, rotation)."""

    @property
    def interface_coordinates(self) -> _types.InterfaceCoordinates | None:
        """K and M in the nc interface coordinates of a Craig-Bampton body: InterfaceCoordinates (names, stiffness, mass,
        of_modes); None for other bodies.
        """

    @property
    def terms(self) -> list[tuple[str, bool, str]]:
        """Decisions about the groups of the kinetic energy: list of (name, true if it is kept, reason). Empty if no
        decision was made; all groups are then kept.
        """

    @property
    def lumped_errors(self) -> dict[str, dict[str, float]]:
        """Errors of lumped masses: dict of scheme to a dict of error norm to relative error."""

    def identities(self) -> list[_types.Identity]:
        """Checks all identities of the numbers of the body: list of Identity (name, value, limit, holds)."""

    def equations_of_motion(self) -> EquationsOfMotion:
        """Returns the equations of motion of the body, with all terms that it holds."""

    def write(self, path: _Path) -> None:
        """Writes a flex-body file (HDF5, docs/reference/file_format.md), which appears complete or not at all. The bytes
        are those of `flexbody convert` for the same model and settings.
        """

    def export(
        self,
        format: _types.ExportFormat,
        path: _Path,
        *,
        points: _types.Points | None = None,
        dialect: _types.Dialect | None = None,
        to_units: _types.Units | None = None,
        modes: int | None = None,
        motion: Motion | _Path | None = None,
        scene: _Cases | None = None,
        allow_loss: bool | str | Sequence[str] = False,
    ) -> tuple[Diagnostic, ...]:
        """Writes the body in a format of another program, by its name on the command line (docs/reference/exports.md):
        the file, and further files beside it. Returns warnings and notes; warnings are issued as well.

        `points` are the places of the body in the file: "nodes", "interfaces", numbers of nodes, or both as in
        "interfaces,17,23". `dialect` is one of the format, `to_units` the units of the file. A picture ("vtk", "gltf")
        shows the first `modes`, or a `motion` (a Motion, or the path of its file). `scene` is one for which the errors
        of losses are stated that grow with the motion. With `allow_loss` the file is written even if the format cannot hold
        all of the body; with names of properties ("damping", or a list), only these may be lost. Losses are then warnings,
        as losses are without it that change deflections of the scene by less than 5 %, or that only a motion causes.

        Raises InputError for properties that the format cannot hold (FB720), options that it does not have, and the motion
        of another body.
        """

    def check(self, against: Model | _Path | None = None) -> Check:
        """Checks every identity of the body and, `against` the model that it was made of (a Model, or the path of its
        manifest or job), every invariant and every mode, like `flexbody check`.
        """

    def compare(
        self,
        other: Body | _Path,
        *,
        common: bool = False,
        frequency: float | None = None,
        mass: float | None = None,
        centre_of_mass: float | None = None,
        inertia: float | None = None,
        invariants: float | None = None,
    ) -> Comparison:
        """Compares another body (a Body, or the path of its file) with this one, like `flexbody compare`. With `common` only
        the modes and the groups of the kinetic energy that both have are compared. The tolerances are relative; 1e-9 without, 1e-8 for `invariants`.
        """

    def response(
        self,
        source: _types.Places | None = None,
        target: _types.Places | None = None,
        *,
        base: str | None = None,
        rows: str | Sequence[str] | None = None,
        psd: _Path | None = None,
        band: tuple[float, float] | None = None,
        scene: _Scene | None = None,
        damping: float | None = None,
        points: int = 400,
    ) -> Response:
        """Computes the frequency response between places, like `flexbody response` without a model: its errors are unknown.
        `Model.response` computes them, and describes the arguments.
        """

    @property
    def recoveries(self) -> list[str]:
        """Names of the recoveries of the body: stresses, strains and forces that `recover` computes."""

    @property
    def named_loads(self) -> list[str]:
        """Names of the named loads of the body, preloads included."""

    def recover(
        self, history: _types.History, only: str | Sequence[str] | None = None, carried_by: str | None = None
    ) -> Recovered:
        """Computes the recoveries of the body over a motion of any program, like `flexbody recover`: all, or `only` those
        with these names.

        `history` is the path of a table (docs/reference/recovery.md), or a dict of "time" (nt), "q" (nt x nf),
        "angular_velocity" (nt x 3), if the body has columns of forces of motion "qd", "qdd" (nt x nf) and
        "angular_acceleration" (nt x 3), "loads", a dict of interface to a tuple of forces and torques (nt x 3 each) at its
        reference point, and "amplitudes", a dict of named load to its amplitudes (nt). Vectors are along the axes of the
        model, which turn with the body. Interfaces without loads count as unloaded, named loads without amplitudes as zero;
        preloads act always and take none. `carried_by` names the interface (or the number of the node) in whose frame the
        motion is, that of a body carried by it.
        """

    def channels(self, history: _types.History, shapes: _Path) -> Channels:
        """Returns the factor of each FE step over a motion of any program, like `flexbody recover --channels`, for a program
        that superposes the results of the steps: Channels with names (nc) and values (nt x nc).

        `history` is one as for `recover`, `shapes` the archive (.npz) that `flexbody shapes` wrote with the steps. Raises
        InputError for steps of another body, of other modes or terms (FB326).
        """

    @overload
    def view(
        self,
        motion: Motion | _Path | None = None,
        *,
        recovery: None = None,
        envelope: _Path | None = None,
        triangles: int | None = None,
    ) -> View:
        """Returns the page of `flexbody view`: of the modes of the body, or of a motion (a Motion, or the path of its file).
        `triangles` limits the surface; without it the page stays below 10 MB.

        With `recovery`, the name of a recovery, the modes have the colours of its equivalent stress of von Mises, per unit of
        the largest displacement. With `envelope`, the path of a table (.csv) of `Recovered.write_envelope` or
        `write_envelope_of_cases`, the body, at rest or in the motion, has the colours of the largest equivalent stresses.
        Raises InputError for stresses that cannot be drawn (FB221).
        """

    @overload
    def view(
        self, motion: None = None, *, recovery: str, envelope: None = None, triangles: int | None = None
    ) -> View: ...

    def advise(
        self,
        *,
        spin: float = 0.0,
        deflection: float | None = None,
        duration: float | None = None,
        attached: _types.Attached | None = None,
        rotation_given: bool = False,
        limit: float = 0.05,
    ) -> dict[str, Any]:
        """Returns which terms of the equations of motion a body needs for ranges of its motion, like `flexbody advise`, as a
        dict: the largest rotation rate `spin` in Hz, the largest `deflection` of a node (that which the rotation causes without),
        the `duration` of the motions (five revolutions without), and the mass `attached` to it, or a tuple of the mass and the
        interface that carries it.
        """

    def select(self, scene: _Cases) -> Selection:
        """Decides which terms and modes the body needs in a scene: a Scene, a list of load cases, or the path of a scene
        file.
        """

    def subset(
        self,
        modes: Sequence[int] | None = None,
        terms: str = "all",
        *,
        fixed_interface_modes: Sequence[int] | None = None,
        storage: Literal["f32"] | None = None,
    ) -> Body:
        """Returns the body with some of its modes (numbers from 1, ascending; all by default) and groups of terms: "W1", "W2",
        "W3" with commas, "none", "all", or those of a guideline: "I", "II", "III", "IV". `fixed_interface_modes` are the numbers
        of those that a Craig-Bampton body keeps beside all motions of its interfaces; `modes` refers to the modes of the body
        that this leaves. With `storage` "f32" its shapes and the inertia of its modes are rounded to 32-bit floats. Like
        `flexbody reduce`.
        """

    def simulate(self, scene: _Scene, *, envelope: bool = False) -> Motion:
        """Simulates the body in a scene: a Scene, or a scene as it takes one (a path, a text, a dict) without load cases. With
        `envelope` the largest stresses of every point of the recoveries over the continuous motion are found for
        `Motion.recovered.write_envelope`.
        """

    def measure(
        self,
        scene: _Scene,
        history: _Path | tuple[ArrayLike, ArrayLike, ArrayLike | None],
        *,
        reference: Body | _Path | None = None,
        model: Model | _Path | None = None,
    ) -> dict[str, Any]:
        """Measures the errors of a run of this body in a scene by another program. `history` is the path of a table with the
        columns time, q_1 to q_n and attitude_0 to attitude_3, or a tuple of time (nt), q (nt x nf) and attitude (nt x 4, or
        None). The reference is the motion of `reference`, a body with more modes of `model`, or of this body itself.

        Returns the report of `flexbody measure` as a dict.
        """

    def trade(self, scene: _Cases, *, repeat: int = 3) -> Trade:
        """Measures accuracy against cost in a scene for reduced versions of this body. `Model.trade` compares conversions."""

    @overload
    def report(self, form: Literal["dict"] = "dict") -> dict[str, Any]:
        """Returns the report of `flexbody inspect`: a dict with all numbers, or "json", "text", "html" as a str."""

    @overload
    def report(self, form: Literal["json", "text", "html"]) -> str: ...

    def __copy__(self) -> Body:
        """Returns the body itself: it cannot be changed."""

    def __deepcopy__(self, _memo: object) -> Body: ...

    def __reduce__(self) -> tuple[Any, ...]: ...

    def _repr_html_(self) -> str: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __ne__(self, other: object, /) -> bool: ...

@final
class Channels:
    """Factors of the steps of an FE program over a motion, for a program that superposes the results of the steps, such as a
    fatigue program. The sum of the results of all steps times their channels is the row of a recovery.
    """

    @property
    def time(self) -> _Floats:
        """Times (nt). Unit: time."""

    @property
    def names(self) -> list[str]:
        """Names of the nc channels: those of the steps ("mode 1", "spin xy", "tip Fx"), and last "constant"."""

    @property
    def values(self) -> _Floats:
        """Factor of each step at each time (nt x nc): modal coordinate, product of angular velocities or load, over the factor
        with which the step was scaled; ones in the last column, for the results at rest. Unit: 1.
        """

    def csv(self) -> str:
        """Returns the table of `flexbody recover --channels FILE.csv`, as a str: one line per instant."""

    def write(self, path: _Path) -> None:
        """Writes the HDF5 file of `flexbody recover --channels FILE.h5`, which appears complete or not at all."""

@final
class Audit:
    """An audit of a file of another program: dialect, identities, digits, units."""

    @property
    def passed(self) -> bool:
        """True if every check passed."""

    @property
    def format(self) -> str:
        """Name of the format of the file."""

    @property
    def dialect(self) -> str:
        """Dialect of the format; empty for a format with a single form."""

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        """Failed checks, as a tuple of `Diagnostic`."""

    @overload
    def report(self, form: Literal["dict"] = "dict") -> dict[str, Any]:
        """Returns the report of `flexbody audit`: a dict with all numbers, or "json", "text" as a str."""

    @overload
    def report(self, form: Literal["json", "text"]) -> str: ...

@final
class Check:
    """Checks of a body: every identity and, against its model, every invariant and every mode."""

    @property
    def passed(self) -> bool:
        """True if every check passed."""

    @property
    def identities(self) -> list[_types.Identity]:
        """All checks: list of Identity (name, value, limit, holds)."""

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Warnings and notes, as a tuple of `Diagnostic`."""

    @overload
    def report(self, form: Literal["dict"] = "dict") -> dict[str, Any]:
        """Returns the report of `flexbody check`: a dict with all numbers, or "json", "text" as a str."""

    @overload
    def report(self, form: Literal["json", "text"]) -> str: ...

@final
class Comparison:
    """A comparison of two bodies, independent of the signs and bases of their modes."""

    @property
    def passed(self) -> bool:
        """True if every quantity is within its tolerance."""

    @property
    def rows(self) -> list[_types.ComparisonRow]:
        """Compared quantities: list of ComparisonRow (quantity, meaning, difference, tolerance, passed)."""

    @overload
    def report(self, form: Literal["dict"] = "dict") -> dict[str, Any]:
        """Returns the report of `flexbody compare`: a dict with all numbers, or "json", "text", "html", "junit", "markdown"
        as a str.
        """

    @overload
    def report(self, form: Literal["json", "text", "html", "junit", "markdown"]) -> str: ...

@final
class View:
    """A page that shows a body in motion: one HTML file for any browser, which loads nothing from elsewhere. A notebook
    shows it.
    """

    @property
    def html(self) -> str:
        """HTML of the page."""

    def write(self, path: _Path) -> None:
        """Writes the page, which appears complete or not at all."""

    @overload
    def report(self, form: Literal["dict"] = "dict") -> dict[str, Any]:
        """Returns the facts that `flexbody view` prints: a dict, or "json", "text" as a str."""

    @overload
    def report(self, form: Literal["json", "text"]) -> str: ...

    def _repr_html_(self) -> str: ...

@final
class EquationsOfMotion:
    """Equations of motion of one flexible body, for any integrator:

        Mc(q) nu' + h(q, nu) + (0, 0, K_ff q + D q') = (F, tau, Q),    nu = (V, omega, q')

    q (nf) are the modal coordinates, V the velocity of the origin of the body frame and omega its angular velocity,
    both along body axes; nu has n = 6 + nf entries. A plane body has 3 + nf: V_x, V_y, omega_z, q'. F, tau (about the
    origin) and Q are generalised forces with the power F'V + tau'omega + Q'q'. With the rotation A from body axes to
    the world, the position R of the origin has the rate R' = A V, and Euler parameters p (cosine of half the angle
    first) have the rate p' = p * (0, omega) / 2 as quaternions. Units are those of the body.
    """

    @property
    def n_modes(self) -> int:
        """Number of modes nf."""

    @property
    def n_rigid(self) -> int:
        """Number of rigid motions: 6, or 3 for a plane body."""

    @property
    def n_velocities(self) -> int:
        """Number of velocities n in nu."""

    def mass_matrix(self, q: ArrayLike) -> _Floats:
        """Returns the mass matrix Mc(q) (n x n)."""

    def velocity_forces(self, q: ArrayLike, nu: ArrayLike) -> _Floats:
        """Returns h(q, nu) (n): the inertia forces at zero acceleration."""

    def forces(self, q: ArrayLike, nu: ArrayLike, acceleration: ArrayLike | None = None) -> _Floats:
        """Returns Mc(q) nu' + h(q, nu) + (0, 0, K_ff q + D q') (n): the forces that must be applied for the accelerations
        nu', which are zero by default.
        """

    def accelerations(self, q: ArrayLike, nu: ArrayLike, applied: ArrayLike | None = None) -> _Floats:
        """Returns nu' (n) from Mc(q) nu' = applied - h(q, nu) - (0, 0, K_ff q + D q'); without `applied` for the free
        body.

        Raises NumericalError, an ArithmeticError, if the mass matrix of the deformed body is not positive definite.
        """

    def jacobians(self, q: ArrayLike, nu: ArrayLike, acceleration: ArrayLike | None = None) -> tuple[_Floats, _Floats]:
        """Returns the derivatives of `forces` by q (n x nf) and by nu (n x n), at constant accelerations. The derivative
        by the accelerations is the mass matrix.
        """

    def gravity(self, q: ArrayLike, g: ArrayLike) -> _Floats:
        """Returns the generalised forces (n) of uniform gravity A'g (3), given along body axes. Unit of gravity:
        length/time^2.
        """

    def momenta(self, q: ArrayLike, nu: ArrayLike) -> _Floats:
        """Returns Mc(q) nu (n): linear momentum, angular momentum about the origin, both along body axes, and the momenta
        of the modes.
        """

    def kinetic_energy(self, q: ArrayLike, nu: ArrayLike) -> float:
        """Returns the kinetic energy T = nu' Mc(q) nu / 2. Unit: mass length^2/time^2."""

    def elastic_energy(self, q: ArrayLike) -> float:
        """Returns the elastic energy U = q' K_ff q / 2. Unit: mass length^2/time^2."""

    def inertia(self, q: ArrayLike) -> _Floats:
        """Returns I(q) = I0 + W1 Q + Q'W2 Q (3 x 3), about the origin, in body axes. Unit: mass length^2."""

    def first_moment(self, q: ArrayLike) -> _Floats:
        """Returns the first moment c + C1 q (3) of the deformed body. Unit: mass length."""

    def node(self, number: int) -> Point:
        """Returns the node of this number (`Body.node_ids`; without `node_ids` its index from 0) as a point for forces and
        motion.
        """

    def interface(self, name: str) -> Point:
        """Returns the reference point of the interface of this name."""

@final
class Point:
    """Point of a body: a node, or the reference point of an interface. All vectors are along body axes."""

    @property
    def turns(self) -> bool:
        """True if the point has an orientation: it then has an angular velocity, and accepts torques."""

    def place(self, q: ArrayLike) -> _Floats:
        """Returns the position r(q) (3) in the deformed body. Unit: length."""

    def velocity(self, q: ArrayLike, nu: ArrayLike) -> _Floats:
        """Returns the velocity V + omega x r + dr/dt (3). Unit: length/time."""

    def acceleration(self, q: ArrayLike, nu: ArrayLike, acceleration: ArrayLike) -> _Floats:
        """Returns the acceleration J nu' + drift (3) relative to the world. Unit: length/time^2."""

    def angular_velocity(self, q: ArrayLike, nu: ArrayLike) -> _Floats | None:
        """Returns the angular velocity (3) of the axes of the point; None for a point without orientation. Unit: 1/time."""

    def jacobian(self, q: ArrayLike) -> _Floats:
        """Returns the Jacobian J(q) (3 x n), with velocity = J nu: a force f at the point is the generalised force J'f."""

    def generalised_force(self, q: ArrayLike, force: ArrayLike, torque: ArrayLike | None = None) -> _Floats:
        """Returns the generalised forces (n) of a force and a torque at the point.

        Raises InputError, a ValueError, for a torque at a point without orientation.
        """

@final
class Model:
    """A finite element model that passed every check: K and M are symmetric, K has the rigid motions and no other
    zero-energy motion, M is positive semidefinite and fits the nodes.

    `flexbody.model` makes one from matrices, `flexbody.read_model` from files.
    """

    @staticmethod
    def _assembled(
        name: str,
        stiffness: _Compressed,
        mass: _Compressed,
        node_ids: NDArray[np.int64],
        positions: _Floats,
        *,
        plane: bool,
        dofs: NDArray[np.int64] | None,
        interfaces: Sequence[tuple[str, list[int] | str, str | None, tuple[float, float, float] | None]],
        units: tuple[str, str, str] | None,
        damping: float | tuple[float, float] | list[tuple[float, float]] | _Compressed | None,
        residual_vectors: tuple[bool, bool],
        allow_implausible: bool | list[str],
        keep_soft_rotations: bool,
    ) -> Model:
        """Makes a model from arrays, which `flexbody.model` prepares."""

    @staticmethod
    def _read(
        path: _Path,
        program: str | None,
        units: tuple[str, str, str] | None,
        sets: Sequence[tuple[str, str, str | None]],
        damping: str | None,
    ) -> Model:
        """Reads the model of a manifest, or of the job of an FE program, for `flexbody.read_model`."""

    @property
    def name(self) -> str:
        """Name of the model."""

    @property
    def n_dofs(self) -> int:
        """Number of degrees of freedom N: rows of K and M."""

    @property
    def node_ids(self) -> NDArray[np.int64]:
        """Node numbers (n)."""

    @property
    def positions(self) -> _Floats:
        """Positions of the nodes in model axes (n x 3). Unit: length."""

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Warnings and notes of reading and checking, as a tuple of `Diagnostic`."""

    def with_stresses(self, nodes: str | Sequence[int], *, name: str = "stress") -> Model:
        """Model with stresses at nodes as a recovery, from the elements of its deck: `nodes` is "surface", "nodes" (all), or a
        sequence of node numbers. The assembled stiffness of the elements has to be K.

        Raises InputError.
        """

    def convert(
        self,
        *,
        modes: int | None = None,
        max_frequency: float | None = None,
        basis: _types.Basis = "free",
        accuracy: _types.Accuracy = "standard",
        frame: _types.Frame = "com",
        comparators: bool = True,
        geometric_stiffness: _types.StressLoads = "none",
        scene: _Cases | None = None,
        allow_unjudged: bool = False,
    ) -> Body:
        """Computes modes and invariants, like `flexbody.convert`.

        `geometric_stiffness` names loads whose stress stiffness is computed from the elements of the deck, separated by
        commas: "spin", "interfaces", "loads"; the assembled stiffness of the elements has to be K.

        With a `scene` (a `Scene`, the path of a scene file, or a list of load cases) the body has only the terms and
        modes that the scene needs; `Body.terms` gives the reasons. A selection that does not hold, or cannot be judged, is
        an error (FB557) unless `allow_unjudged` is true.

        Raises InputError, NumericalError or ResourceError.
        """

    def select(self, scene: _Cases, *, modes: int | None = None) -> Selection:
        """Decides which terms and modes a body of the model needs in a scene, like `flexbody select model.toml`: a body with
        `modes` free modes (by default those of the band of the scene, or 20) and residual vectors is made and judged.
        """

    def trade(self, scene: _Cases, *, modes: int = 20, repeat: int = 3, reference: _types.Reference = "full") -> Trade:
        """Measures accuracy against cost in a scene: candidate bodies against a reference, like `flexbody.trade`. With
        several load cases every candidate is measured in each of them and judged by the worst.
        """

    def response(
        self,
        source: _types.Places | None = None,
        target: _types.Places | None = None,
        *,
        base: str | None = None,
        rows: str | Sequence[str] | None = None,
        psd: _Path | None = None,
        body: Body | _Path | None = None,
        band: tuple[float, float] | None = None,
        scene: _Scene | None = None,
        damping: float | None = None,
        tolerance: float = 0.05,
        points: int = 400,
        solves: int = 80,
        modes: int = 20,
        basis: _types.Basis = "free",
    ) -> Response:
        """Computes the frequency response between places, and its difference from the response of all nodes, like `flexbody
        response`: of `body`, which was made of this model, or of a body that is made now.

        `source` and `target` are the places of unit forces and of measured displacements: an interface or a node number,
        optionally with a colon and directions ("big_end:z", "17:x,rz"), or a list of these. `band` is (low, high) in Hz. A
        `scene` supplies what is not stated: the places of its loads, its watched points, band and damping. `damping` is a
        ratio, for a body without damping. `points` and `solves` are the approximate numbers of frequencies of the curves,
        and of those at which the equations of all nodes are solved. `base` is an interface whose acceleration excites the
        body in place of forces, `rows` are recoveries whose rows are read ("gauges", or "gauges:ROW" for one), `psd` is the
        file of the spectral densities of a random excitation. `modes` and `basis` are those of a body that is made.
        """

@final
class Recovered:
    """Recoveries of a body over a motion, of a run of any program or of a simulation: stresses, strains, forces."""

    @property
    def time(self) -> _Floats:
        """Times (nt). Unit: time."""

    @property
    def rows(self) -> dict[str, _types.RecoveredRows]:
        """Rows by recovery: dict of name to RecoveredRows (labels, values, points, von_mises, signed_von_mises, principal)
        with the values of all rows (nt x rows) in the units of their labels, and the equivalent stresses of von Mises (nt x
        points) and the principal stresses (nt x points x 3) at the points with all six stresses.
        """

    def write(self, path: _Path) -> None:
        """Writes the HDF5 file of `flexbody recover -o FILE.h5` and `flexbody simulate --rows FILE.h5`, which appears complete
        or not at all.
        """

    def write_envelope(self, path: _Path) -> None:
        """Writes the largest stresses of every point over the motion, like `--envelope`: a table (.csv), or the body with them
        at its nodes (.vtu). Those of a simulation need `Body.simulate(scene, envelope=True)`.
        """

    @staticmethod
    def write_envelope_of_cases(cases: Mapping[str, Recovered], path: _Path) -> None:
        """Writes the largest stresses of every point over several load cases, like `--envelope` for a scene with several: a
        table (.csv), or the body with them at its nodes (.vtu), with the load case of each extreme. Of two equal extremes the
        first is taken.

        `cases` is a dict of the name of a load case to its Recovered, all of one body, with the same recoveries. Those of a
        simulation need `Body.simulate(scene, envelope=True)`. Raises InputError for recoveries of another body.
        """

    def csv(self) -> str:
        """Returns the table of `flexbody recover -o FILE.csv` and `flexbody simulate --rows FILE.csv`, as a str: one line per
        instant.
        """

    @overload
    def report(self, form: Literal["dict"] = "dict") -> dict[str, Any]:
        """Returns the report of `flexbody recover`: a dict with the largest values, or "json", "text", "html" as a str.

        Raises InputError for rows of a simulation: `Motion.report` has their largest values.
        """

    @overload
    def report(self, form: Literal["json", "text", "html"]) -> str: ...

@final
class Response:
    """A frequency response between places of a body."""

    @property
    def frequencies_hz(self) -> _Floats:
        """Frequencies, ascending (n). Unit: Hz."""

    @property
    def functions(self) -> list[_types.TransferFunction]:
        """Transfer functions: list of TransferFunction (source, source_direction, target, target_direction, reduced, full)
        with complex arrays (n); full is nan where the equations of all nodes were not solved.
        """

    @property
    def random(self) -> dict[str, dict[str, Any]] | None:
        """Root mean squares under random excitation: a dict with, for each recovery, a dict of `rows` and `points` (names), and
        of `rms` and `von_mises` (arrays, in the units of the rows); None without spectral densities.
        """

    @property
    def holds(self) -> bool:
        """True if no error exceeds the tolerance, or if no error is known."""

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Warnings and notes, as a tuple of `Diagnostic`."""

    @overload
    def report(self, form: Literal["dict"] = "dict") -> dict[str, Any]:
        """Returns the report of `flexbody response`: a dict with all numbers, or "json", "text", "html" as a str."""

    @overload
    def report(self, form: Literal["json", "text", "html"]) -> str: ...

    def csv(self) -> str:
        """Returns the table of `flexbody response --csv`, as a str: one line per frequency."""

@final
class Motion:
    """Motion of a body in a scene, at nt instants, in the units of the body.

    The motion is that of a frame with its origin at the centre of mass of the undeformed body, or at the reference
    point of its carrier, and with the axes of the model, which turn with the body.
    """

    @property
    def time(self) -> _Floats:
        """Instants (nt). Unit: time."""

    @property
    def modal_coordinates(self) -> _Floats:
        """Modal coordinates q (nt x nf). Unit: sqrt(mass) length."""

    @property
    def modal_velocities(self) -> _Floats:
        """Rates dq/dt of the modal coordinates (nt x nf). Unit: sqrt(mass) length/time."""

    @property
    def origin(self) -> _Floats:
        """Position of the origin of the frame, in world axes (nt x 3). Unit: length."""

    @property
    def velocity(self) -> _Floats:
        """Velocity of the origin, in world axes (nt x 3). Unit: length/time."""

    @property
    def attitude(self) -> _Floats:
        """Attitude of the frame (nt x 4): Euler parameters of unit length, the cosine of half the angle first."""

    @property
    def angular_velocity(self) -> _Floats:
        """Angular velocity of the frame along its axes (nt x 3). Unit: 1/time."""

    @property
    def kinetic_energy(self) -> _Floats:
        """Kinetic energy (nt). Unit: mass length^2/time^2."""

    @property
    def elastic_energy(self) -> _Floats:
        """Elastic energy (nt). Unit: mass length^2/time^2."""

    @property
    def work(self) -> _Floats:
        """Work of forces, damping and prescribed motion since the start (nt). Unit: mass length^2/time^2."""

    @property
    def linear_momentum(self) -> _Floats:
        """Linear momentum, in world axes (nt x 3). Unit: mass length/time."""

    @property
    def angular_momentum(self) -> _Floats:
        """Angular momentum about the initial position of the origin, in world axes (nt x 3). Unit: mass length^2/time."""

    @property
    def reactions(self) -> _Floats | None:
        """Force, and torque about the origin, of the prescribed motion, along the axes of the frame (nt x 6); None if no
        motion is prescribed.
        """

    @property
    def paths(self) -> dict[str, _types.PointPath]:
        """Paths of the watched points: dict of name to PointPath, with arrays (nt x 3) of position, deflection, velocity
        and acceleration.
        """

    @property
    def recovered(self) -> Recovered | None:
        """Recoveries of the body over this motion, at its instants; None if the body has none."""

    @property
    def largest_deflection(self) -> float:
        """Largest deflection of any node, also between the instants. Unit: length."""

    @property
    def drift(self) -> tuple[float, float, float]:
        """Drift of energy less work, and of linear and angular momentum less their impulses, relative to the largest of
        the motion: (energy, linear, angular).
        """

    @property
    def steps(self) -> int:
        """Number of steps of the integration."""

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Warnings and notes, as a tuple of `Diagnostic`."""

    def write(self, path: _Path) -> None:
        """Writes the motion to an HDF5 file, like `flexbody simulate -o`. The file appears complete or not at all."""

    @overload
    def report(self, form: Literal["dict"] = "dict") -> dict[str, Any]:
        """Returns the report of `flexbody simulate`: a dict with all numbers, or "json", "text", "html" as a str."""

    @overload
    def report(self, form: Literal["json", "text", "html"]) -> str: ...

    def csv(self) -> str:
        """Returns the table of `flexbody simulate --csv`, as a str."""

@final
class Scene:
    """A scene for a body: gravity, loads, prescribed motion, duration, tolerances (docs/reference/scenes.md).

    Scene(source, case=None, folder=None) makes one of the path of a scene file, of its text (a str with line breaks), or
    of a dict with its keys: {"run": {"duration": 0.1}, "load": [{"interface": "tip", "force": [0, 0, 1]}]}. `case` names
    the load case of a scene that has several. Files of histories are found in the folder of the scene file; for a text
    and a dict in `folder`, by default the current one.
    """

    def __new__(cls, source: _Source, case: str | None = None, folder: _Path | None = None) -> Scene: ...

    @staticmethod
    def cases(source: _Source, folder: _Path | None = None) -> list[Scene]:
        """Returns all load cases of a scene (the path of its file, its text, or a dict), in its order; the single scene if
        it has no cases.
        """

    @property
    def name(self) -> str:
        """Name of the scene; for a load case the name of the scene, a colon and the name of the case."""

@final
class Selection:
    """The terms and modes that a body needs in a scene."""

    @property
    def modes(self) -> NDArray[np.int64]:
        """Indices of the kept modes, from 0."""

    @property
    def groups(self) -> list[tuple[str, bool, str]]:
        """Groups of terms of the kinetic energy: list of (name, true if it is kept, reason)."""

    @property
    def holds(self) -> bool:
        """True if the tolerances of the scene hold, as far as they were measured."""

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Warnings and notes, as a tuple of `Diagnostic`."""

    def command(self, body: _Path) -> str | None:
        """Returns the command that makes exactly the selected body from the flex-body file that was judged. None if the body
        was made with the selection.
        """

    @overload
    def report(self, form: Literal["dict"] = "dict") -> dict[str, Any]:
        """Returns the report of `flexbody select`: a dict with all numbers, or "json", "text", "html" as a str."""

    @overload
    def report(self, form: Literal["json", "text", "html"]) -> str: ...

@final
class Trade:
    """Candidate bodies for a scene, measured against a reference, and the best of them."""

    @property
    def candidates(self) -> list[dict[str, Any]]:
        """Candidates, each as a dict with the properties from `flexbody trade`: source, kind, modes, groups, errors, worst
        error over its tolerance, multiplications, bytes, seconds. The first candidate is the reference.
        """

    @property
    def recommended(self) -> int | None:
        """Index of the recommended candidate, from 0; None if no candidate keeps the tolerances at an allowed cost."""

    @property
    def front(self) -> list[int]:
        """Indices of the candidates, from 0, for which no other candidate is cheaper and as accurate, ascending in cost."""

    @property
    def holds(self) -> bool:
        """True if there is a recommended candidate and the reference can be trusted."""

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Warnings and notes, as a tuple of `Diagnostic`."""

    def body(self, candidate: int) -> Body:
        """Returns the body of a candidate, counted from 0."""

    def command(self, input: _Path, scene: _Path) -> str | None:
        """Returns the command that makes exactly the recommended candidate from the files of the study: the model or the
        body, and the scene. None if no candidate is recommended.
        """

    @overload
    def report(self, form: Literal["dict"] = "dict") -> dict[str, Any]:
        """Returns the report of `flexbody trade`: a dict with all numbers, or "json", "text", "html" as a str."""

    @overload
    def report(self, form: Literal["json", "text", "html"]) -> str: ...

    def csv(self) -> str:
        """Returns the table of `flexbody trade --csv`, as a str."""
