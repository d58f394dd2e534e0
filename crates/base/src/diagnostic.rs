//! Table of diagnostics. Every message of the program has a code, a severity, an exit code, a title and a default help
//! in this table. `docs/reference/codes.md` is generated from the table; `fixtures/cases/` triggers each code.

mod causes;

pub use crate::explanation::Explanation;

use crate::exit_code::ExitCode;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Severity of a diagnostic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, strum::IntoStaticStr)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum Severity {
    /// Fact that the user should know.
    Note,
    /// Valid result with an unusual property.
    Warning,
    /// Operation that cannot be done, or whose result cannot be trusted.
    Error,
}

impl Severity {
    /// Returns the name of the severity: `note`, `warning` or `error`.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

macro_rules! codes {
    ($($variant:ident = $id:literal, $severity:ident, $exit:ident, $title:literal, $help:literal;)*) => {
        /// Code of a diagnostic. FB1xx files, FB2xx tables and manifest, FB3xx matrices, FB4xx model, FB5xx numerics,
        /// FB6xx resources, FB7xx flex-body files, FB8xx usage.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Code {
            $(#[doc = $title] $variant,)*
        }

        impl Code {
            /// All codes, in the order of the table.
            pub const ALL: &'static [Code] = &[$(Code::$variant,)*];

            /// Returns the printed code: `FB` and three digits.
            pub fn id(self) -> &'static str {
                match self { $(Code::$variant => $id,)* }
            }

            /// Returns the severity of every diagnostic with this code.
            pub fn severity(self) -> Severity {
                match self { $(Code::$variant => Severity::$severity,)* }
            }

            /// Returns the exit code of a process that ends because of this code ([`ExitCode::Done`] for warnings and
            /// notes).
            pub fn exit_code(self) -> ExitCode {
                match self { $(Code::$variant => ExitCode::$exit,)* }
            }

            /// Returns the general description of the problem.
            pub fn title(self) -> &'static str {
                match self { $(Code::$variant => $title,)* }
            }

            /// Returns the general advice. A diagnostic may have a more precise one.
            pub fn help(self) -> &'static str {
                match self { $(Code::$variant => $help,)* }
            }
        }
    };
}

codes! {
    // FB1xx: files
    FileUnreadable = "FB101", Error, BadInput, "file cannot be read", "check the path and its permissions";
    FileFormatUnknown = "FB102", Error, BadInput, "file format not recognised", "give Matrix Market (.mtx, .mtx.gz, .mtx.zst), HDF5 (.h5, .hdf5), SciPy (.npz), NumPy (.npy), MATLAB (.mat), PETSc or Nastran (.op4, .pch) matrices";
    FileCompressionBroken = "FB103", Error, BadInput, "compressed file is damaged or cut off", "transfer or write the file again";
    OutputUnwritable = "FB104", Error, Resources, "output cannot be written", "check the folder, its permissions and the free space";
    OutputFolderMissing = "FB105", Error, BadInput, "folder of the output file does not exist", "make the folder first";
    FileEmpty = "FB106", Error, BadInput, "file is empty", "write the file again";
    OutputNotFile = "FB107", Error, BadInput, "output path does not name a file", "name a file that may be made or replaced";
    JobUnknown = "FB108", Error, BadInput, "input is not a job of a supported FE program", "give a manifest (model.toml), or name the program with --format";
    JobIncomplete = "FB109", Error, BadInput, "a file of the FE job is missing", "write all files of the job in one run and keep them beside the input deck";
    DeckSyntax = "FB110", Error, BadInput, "input deck cannot be read", "correct the line";
    DeckUnsupported = "FB111", Error, BadInput, "input deck uses a feature that is not supported", "write the model without this feature, or give matrices and tables by a manifest";
    DeckRows = "FB112", Error, BadInput, "rows of the matrices do not match the input deck", "write the deck and the matrices in one run";
    DeckRenumbered = "FB113", Note, Done, "nodes of instances were renumbered", "nothing to do; refer to interfaces by node sets";
    JobStep = "FB114", Note, Done, "one of several steps with matrices was chosen", "nothing to do if it is the right step; otherwise remove the other steps";
    NodeFileSyntax = "FB115", Error, BadInput, "node file cannot be read", "write the file again, or give a table with the columns node, x, y, z";
    DeckSupports = "FB116", Note, Done, "input deck has supports", "matrices written before the supports are applied (KGG, MGG) are free; for other matrices remove the supports";
    RowsEmpty = "FB117", Note, Done, "rows without stiffness and mass were left out", "nothing to do for rotations of solid elements and nodes without elements";
    DeckLumps = "FB118", Warning, Done, "input deck does not ask for consistent masses", "write PARAM,COUPMASS,1 into the bulk data and run the deck again";
    JobCondensed = "FB119", Warning, Done, "matrices are condensed to the boundary of a superelement", "give K and M of all nodes (Nastran: KGG and MGG) if the change of inertia with deformation matters";
    DeckReference = "FB120", Note, Done, "reference node of a distributing coupling was placed at the mean of its nodes", "nothing to do; an averaging interface of these nodes also has their rotation";
    OutputForbidden = "FB121", Error, Resources, "no permission to write the output", "choose another folder, or change the permissions of the folder or the file";
    MeshPartial = "FB124", Note, Done, "surface for drawing the body is incomplete", "nothing to do for the results; connectors and springs are not drawn";
    MeshForeign = "FB125", Error, BadInput, "mesh does not match the nodes", "give the mesh that the matrices were computed on, in the same units, or leave `mesh` out";
    ModesDiffer = "FB127", Warning, Done, "modes in the file are not modes of K and M", "give modes of the same mesh, material and mass matrix, of the body without supports";
    ModeFileSyntax = "FB128", Error, BadInput, "mode file cannot be read", "write the file as docs/how_to/import_modes.md says, or give the shapes as an array";
    ModesCompleted = "FB129", Note, Done, "rows missing from the mode file were completed with K and M", "nothing to do: the completed modes satisfy the equations of motion in these rows too";
    DeckConstrained = "FB131", Note, Done, "rows constrained by the deck were eliminated", "nothing to do: matrices before the constraints (KGG, MGG) describe parts that are not joined";
    InputChanged = "FB132", Error, BadInput, "file changed while it was read", "run again after the program that writes the file has finished";
    // FB2xx: tables and manifest
    ManifestSyntax = "FB201", Error, BadInput, "manifest is not valid TOML or has unknown, missing or mistyped keys", "see docs/reference/input.md for the keys";
    ManifestUnit = "FB202", Error, BadInput, "unknown unit", "use one of length: m mm cm um km in ft; mass: kg g t tonne lb slug slinch; time: s ms us; or a positive number (factor to SI)";
    TableHeader = "FB203", Error, BadInput, "unexpected table header", "write the header of nodes: `node,x,y,z`; of dofs: `node,dir` or `row,node,dir`";
    TableRow = "FB204", Error, BadInput, "table row cannot be read", "give one row per line with the columns of the header";
    NodeDuplicate = "FB205", Error, BadInput, "node number occurs twice", "list each node once";
    CoordinateNotFinite = "FB206", Error, BadInput, "node coordinate is not a finite number", "correct the coordinate";
    DofDirection = "FB207", Error, BadInput, "direction is not between 1 and 6", "use 1, 2, 3 for displacements along x, y, z, and 4, 5, 6 for rotations";
    DofRowOrder = "FB208", Error, BadInput, "row numbers of dofs.csv are not 0, 1, 2, ... without gaps", "number the rows from 0, or leave the column out";
    InterfaceNode = "FB209", Error, BadInput, "interface names a node that the model does not have", "correct the node list of the interface";
    InterfaceAcross = "FB210", Error, BadInput, "interface contains nodes of several bodies", "define one interface for each body";
    SceneSyntax = "FB211", Error, BadInput, "scene is not valid TOML or has unknown, missing or mistyped keys", "see docs/reference/scenes.md for the keys";
    SceneBody = "FB212", Error, BadInput, "scene does not fit the body", "run flexbody inspect, which shows the modes and interfaces of the body";
    SceneContradicts = "FB213", Error, BadInput, "scene contradicts itself", "remove one of the two entries";
    CarrierImpossible = "FB214", Error, BadInput, "body cannot be carried at this place", "carry an interface with a reference point whose nodes do not lie on one line, or a node with rotations, of a body with all terms";
    SeriesColumn = "FB215", Error, BadInput, "column of a history is not in the file", "name a column of the file, or give its number, from 1";
    SeriesRow = "FB216", Error, BadInput, "history file cannot be read as columns over time", "write one row per instant, with ascending times and decimal points";
    SeriesRange = "FB217", Error, BadInput, "history file does not cover the run", "shorten the run, or set `outside` = \"hold\" to hold the first and the last value outside the file";
    PlaceUnknown = "FB218", Error, BadInput, "place or direction does not exist in the body", "run flexbody inspect, which lists the interfaces; give nodes by number";
    SceneCase = "FB219", Error, BadInput, "load case not found, or not named although the scene has several", "name a case of the scene with --case NAME";
    NodeSetUnknown = "FB220", Error, BadInput, "node set or region contains no node of the model", "name a node set of the deck, or correct the region";
    RecoveryUnknown = "FB221", Error, BadInput, "body has no recovery of this name", "run flexbody inspect, which lists the recoveries; give [[recovery]] in the manifest to convert with one";
    SceneDamping = "FB225", Error, BadInput, "scene and body both define damping", "remove [damping] from the scene (--damping from the command), or write `replace = true` in it to ignore the damping of the body";
    GravityUnits = "FB226", Warning, Done, "gravity of a scene is that of the earth in other units than those of the body", "write gravity in the units of the body: 9.81 m/s^2 is 9810 mm/s^2";
    // FB3xx: matrices
    MatrixSyntax = "FB301", Error, BadInput, "matrix file cannot be parsed", "write the matrix as Matrix Market coordinate real, symmetric or general";
    MatrixKind = "FB302", Error, BadInput, "kind of matrix is not supported", "write a real (or integer) sparse matrix";
    MatrixIndex = "FB303", Error, BadInput, "matrix index out of range", "Matrix Market counts from 1, HDF5 indices from 0";
    MatrixCount = "FB304", Error, BadInput, "number of entries differs from the header", "write the file again; it may be cut off";
    MatrixNotSquare = "FB305", Error, BadInput, "matrix is not square", "give the whole symmetric matrix";
    MatrixNotFinite = "FB306", Error, BadInput, "matrix contains NaN or infinite values", "find the element that produced them in the FE program";
    MatrixAsymmetric = "FB307", Error, BadInput, "matrix is not symmetric", "remove gyroscopic, follower and friction terms: only symmetric K and M describe a conservative body";
    MatrixSizesDiffer = "FB308", Error, BadInput, "stiffness and mass matrix differ in size", "write both from the same analysis";
    MatrixTriangles = "FB309", Error, BadInput, "matrix declared symmetric has entries on both sides of the diagonal", "write one triangle, or declare the matrix general";
    Hdf5Layout = "FB310", Error, BadInput, "matrix not found in the file or group", "store data, indices, indptr and shape (CSC, CSR) or data, row, col and shape (COO); name the group as FILE.h5:/group";
    MatrixDigits = "FB311", Warning, Done, "matrix values have few digits", "write 15 to 17 significant digits; thin bodies lose all digits otherwise";
    MatrixEmpty = "FB312", Error, BadInput, "matrix has no nonzero entries", "write the matrix again";
    MatrixTooLarge = "FB313", Error, BadInput, "matrix has more than 4294967295 rows", "split the model";
    ShapesSize = "FB320", Error, BadInput, "array of shapes or loads does not fit the matrices", "give one row (or one column) for each matrix row, in the order of the matrices";
    ShapesZero = "FB321", Error, BadInput, "shape or load is zero everywhere", "remove the column";
    RecoverySize = "FB322", Error, BadInput, "operator of a recovery does not fit the matrices", "give one column for each matrix row, in the order of the matrices, and one value of the offset for each row";
    RecoveryRows = "FB323", Error, BadInput, "table of rows does not describe the operator of its recovery", "write the header `row,name,quantity,component,unit` and one line for each row of the operator; docs/reference/recovery.md has the words";
    RecoveryCut = "FB324", Error, BadInput, "cut of a recovery does not divide the body", "give the nodes of one side, with all nodes of a rigid interface or none";
    RecoveryShapes = "FB326", Error, BadInput, "answers of an FE program do not belong to the shapes of their recovery", "run the FE program on all shapes that flexbody shapes wrote, and keep the .npz that was written with them beside the results";
    FeResultsSyntax = "FB327", Error, BadInput, "results of an FE program cannot be read", "write them as docs/how_to/stresses_from_calculix.md says";
    NamedLoadMisfit = "FB328", Error, BadInput, "named load does not fit the model", "give one force for each matrix row, in the order of the matrices";
    PreloadUnbalanced = "FB329", Error, BadInput, "preload is not in equilibrium by itself", "give all forces of the preload, those on both sides of each bolt, so that their resultant is zero; a load with a resultant is no preload (`preload = false`) and has a history in a scene";
    // FB4xx: model
    NodesMissing = "FB401", Error, BadInput, "degrees of freedom refer to nodes without coordinates", "add the nodes to the node table";
    DofCount = "FB402", Error, BadInput, "number of degrees of freedom differs from the matrix size", "give one row of dofs.csv for each matrix row; without dofs.csv there are three rows for each node";
    DofDuplicate = "FB403", Error, BadInput, "direction of a node occurs twice", "label each matrix row with another pair (node, direction)";
    DofIncomplete = "FB404", Error, BadInput, "displacement directions of nodes are missing, so the body cannot move rigidly", "export the matrices without supports, symmetry planes or eliminated constraints";
    NodesUnused = "FB406", Note, Done, "nodes without degrees of freedom were left out", "nothing to do if they are reference nodes or deleted nodes";
    MassNotPositive = "FB407", Error, Untrustworthy, "mass is not positive", "check densities and the matrix that was given as mass";
    MassDirectional = "FB408", Error, BadInput, "mass differs between directions, so it is not the mass of a free body", "export the mass matrix without supports and without eliminated constraints";
    MassBlockStructure = "FB409", Note, Done, "part of the mass matrix does not rotate with the nodes", "nothing to do for slender beams and thin shells, whose error falls with the square of the element size to that of the rotary inertia of their sections; for a condensed model (superelement) keep more nodes";
    RigidMotionStrained = "FB410", Error, BadInput, "rigid motion strains the body: K R is not zero", "remove supports from K, and check that rotations are labelled as rotations and that coordinates have the units and the order of the matrix; without a table of rows (dofs) the rows are taken as x, y, z of the nodes in their order";
    PencilSingular = "FB411", Error, BadInput, "eigenproblem is singular: rows have neither stiffness nor mass", "remove these degrees of freedom from the matrices, or hold them";
    MassDiagonal = "FB412", Warning, Done, "mass matrix is diagonal, so it is already lumped", "export the consistent mass matrix from the FE program; below, `exact` means exact for this lumped matrix";
    InertiaImplausible = "FB413", Warning, Done, "mass and size do not fit any material in the units of the model", "check the units in the manifest, or set them with --units";
    BodiesSeveral = "FB414", Error, Untrustworthy, "matrices contain several bodies", "convert each body separately with --split, or connect the bodies";
    DiagonalNegative = "FB415", Error, Untrustworthy, "matrix has negative diagonal entries, so it cannot be positive semidefinite", "check the element that produced them";
    BodyDegenerate = "FB416", Error, BadInput, "nodes lie on one point or one line, so the body has no rotational inertia about it", "check the coordinates; beams need nodal rotations";
    ModelTooSmall = "FB418", Error, BadInput, "model has no flexible degree of freedom", "a body needs more degrees of freedom than rigid motions: six in space, three in the plane";
    DirectionOutOfPlane = "FB419", Error, BadInput, "plane model has entries out of its plane", "use z = 0 and directions 1 and 2 in a plane model, or set `dimension = 3`";
    DampingRigid = "FB420", Warning, Done, "damping matrix resists rigid motion", "model damping to ground, or proportional to mass, in the multibody system: it acts on the motion of the whole body";
    BodiesCoupled = "FB421", Error, BadInput, "damping or geometric stiffness couples bodies that K and M keep separate", "remove the entries between the bodies";
    RowsUnheld = "FB422", Error, BadInput, "rows without coordinates are not held by the stiffness", "add the nodes to the node table, or remove these degrees of freedom";
    RowsWithoutPlace = "FB423", Note, Done, "rows without coordinates are internal degrees of freedom", "nothing to do for bubbles and massless connections; add the nodes to the node table if they are nodes";
    MagnitudeExtreme = "FB424", Error, BadInput, "numbers are too large or too small for products in double precision", "write the model in units that bring its numbers closer to one";
    NodesRounded = "FB425", Warning, Done, "node positions do not fit the stiffness to all digits", "write coordinates with 17 digits and keep the body near the origin: far from it, coordinates lose digits";
    RotationsFollow = "FB427", Note, Done, "rotations without stiffness and mass follow the nodes around them", "nothing to do for shells without drilling stiffness: no frequency and no displacement depends on these rotations";
    SoftRotationsFollow = "FB428", Warning, Done, "rotations that are held by elements that are not quite coplanar follow the nodes around them", "nothing to do for shells without drilling stiffness; --keep-soft-rotations (or keep_soft_rotations in [model]) leaves these rotations as K has them";
    SoftRotationsEffect = "FB429", Note, Done, "frequencies without the rotations that were made to follow their elements", "nothing to do: a rotation about the normal that elements hold only because they are not quite coplanar is a hinge between them, of the mesh and not of the part";
    InterfaceCoupling = "FB430", Error, BadInput, "interface cannot be coupled to its reference point", "give the interface three nodes that do not lie on one line (two in the plane), or another coupling";
    InterfaceShared = "FB431", Error, BadInput, "interfaces share nodes", "assign each shared node to one interface";
    InterfaceFit = "FB432", Warning, Done, "interface declared rigid deforms in the modes", "convert with --basis craig-bampton (select, trade and simulate take the body file), or declare the interface averaging";
    MassOrder = "FB433", Error, BadInput, "mass matrix couples nodes that the stiffness matrix does not: its rows are in another order, or it belongs to another mesh", "write K and M from the same analysis in the same order; --allow-implausible (or allow_implausible in [model]) if the model is meant so";
    MassPairs = "FB434", Warning, Done, "mass matrix couples nodes that the stiffness matrix does not", "nothing to do if the model is meant so; else write K and M in the same order";
    MassesExchanged = "FB435", Warning, Done, "masses of nodes seem to be exchanged", "write K and M in the same order of nodes";
    SpeedImplausible = "FB436", Warning, Done, "speed of sound is outside the range of all known materials: stiffness, mass and lengths do not fit the units of the model", "check that density, Young's modulus and coordinates are all in the units of the manifest, or state these with --units";
    DensityImplausible = "FB437", Error, BadInput, "density or speed of sound is outside the range of all known materials: the numbers do not fit the units of the model", "check the units of the manifest and of the coordinates; --allow-implausible (or allow_implausible in [model]) if the density is meant";
    MatricesExchanged = "FB438", Error, BadInput, "stiffness and mass matrix are exchanged", "give the other file as stiffness, this one as mass";
    InterfaceFar = "FB439", Warning, Done, "reference point of an interface is far from its nodes", "reference points are in model axes and in the unit of length of the nodes";
    GeometricStiffnessMotion = "FB440", Error, BadInput, "geometric stiffness is not that of a stress: it breaks a relation with rigid motion", "give the stress stiffness alone: the difference of the stiffness matrices with and without prestress holds the stiffness of the initial displacements as well";
    GeometricStiffnessLoad = "FB441", Error, BadInput, "geometric stiffness is not that of the load that it is given for", "check load, axis, sign and units, and divide the matrix by the size of the load (of spin about the centre of mass or the origin of the model: by the square of the rate in radians per unit of time)";
    GeometricStiffnessRough = "FB442", Warning, Done, "geometric stiffness fulfils its relations with rigid motion roughly", "nothing to do where elements of reduced integration explain it; else check that the matrix holds the stress stiffness alone";
    RecoveryStrained = "FB443", Error, BadInput, "rigid motion of the body strains a recovery: its columns do not belong to the rows of the matrices", "write the operator by the rows of K and M; a row that a rigid motion may change is a `displacement` or `other`";
    RecoveryScale = "FB444", Warning, Done, "stresses of a recovery do not fit the stiffness of the model", "check the column `unit` of the rows (nothing converts values to it), and that the operator belongs to this model";
    RecoveryUnanswered = "FB445", Error, BadInput, "modes or static columns of the body are not combinations of the shapes of a recovery", "write shapes for this body with flexbody shapes, and run the FE program on them again";
    RecoveryEnergy = "FB446", Error, BadInput, "FE program computes another strain energy of the shapes than K", "give the FE program the elements, materials and units that K was written with";
    RecoveryEnergyDiffers = "FB447", Warning, Done, "strain energy of some shapes differs between the FE program and K", "nothing to do for elements of reduced integration, springs and other elements without stresses; else compare the deck with that of K";
    RecoveryAveraged = "FB448", Warning, Done, "stresses at nodes between materials are means over the materials", "ask for stresses at integration points: flexbody shapes --at integration-points";
    RecoveryMapped = "FB449", Note, Done, "recovery was computed from the answers of an FE program to shapes", "nothing to do: the misfit bounds the share of each mode that the shapes do not contain";
    InterfaceCentre = "FB450", Warning, Done, "reference point of an interface is not the mean of its nodes", "nothing to do if the joint belongs there; else state the point: --interface NAME=SET,COUPLING,X/Y/Z, or `reference` in [[interface]]";
    GeometricStiffnessDifference = "FB451", Note, Done, "geometric stiffness is the difference of two stiffness matrices", "nothing to do; with less than four digits give the stress of a larger load";
    GeometricStiffnessUnstressed = "FB452", Error, BadInput, "matrix with stress is the stiffness without it", "assemble the stiffness after the stress, with the stress of a larger load";
    RecoveryCorners = "FB453", Note, Done, "stresses at nodes are means over the corners of their elements", "nothing to do in a part of one material; where materials meet, request the elements of each material alone and give a recovery for each";
    InterfacesUncompared = "FB454", Note, Done, "interfaces of the body are not stated like this by the model that it is checked against", "state them by --interface NAME=NODES,COUPLING, or by [[interface]] in the manifest, to compare them";
    SectionAbout = "FB455", Note, Done, "moments of a section are about the origin of the model", "state the point: about = [x, y, z] in its [[recovery]], in model axes";
    NodeInertia = "FB456", Warning, Done, "rotary inertia of a node is that of no rigid mass", "nothing to do for a disc of which only the inertia about its axis is meant; else give all moments of inertia (a thin disc has half of that about its axis about each diameter): none is larger than the sum of the other two";
    RecoveryPlane = "FB458", Note, Done, "stresses of a recovery are read as those of a plane state", "nothing to do for plane stress and membranes; of a solid give all six components";
    RecoveryNoEquivalent = "FB459", Note, Done, "no von Mises and principal stresses are formed of stresses that look like a tensor", "name the components xx, yy, zz, xy, yz, xz (or 11, S11, sigma_xx and their like), and let the name of each row end with its component: `e1 xx`";
    RecoveryContradicts = "FB460", Error, BadInput, "stresses of a recovery contradict the stiffness of the model under uniform strain", "check the order, signs and units of the rows (shear stresses belong to s_xy, not to twice or half of it), and that the operator belongs to this model; --allow-implausible (or allow_implausible in [model]) if the rows are meant so";
    RecoveryUncompared = "FB461", Note, Done, "stresses of a recovery were not compared with the stiffness, or only along other axes", "nothing to do; compare stresses under one load with those of the FE program";
    // FB5xx: numerics
    NotConverged = "FB501", Error, Untrustworthy, "eigen-solver did not converge", "ask for fewer modes or a lower accuracy; look for extreme stiffness contrasts";
    Mechanism = "FB502", Error, Untrustworthy, "more zero-energy modes than rigid motions: a mechanism or loosely connected bodies", "connect the parts or remove the free degree of freedom";
    MassIndefinite = "FB503", Error, Untrustworthy, "mass matrix is indefinite", "negative lumped masses or wrong signs: export the consistent mass";
    StiffnessIndefinite = "FB504", Error, Untrustworthy, "stiffness matrix is indefinite", "check for negative springs, prestress beyond buckling, wrong signs";
    FactorizationFailed = "FB505", Error, Untrustworthy, "factorisation failed or is inaccurate", "check units and stiffness contrasts: the model may be badly scaled";
    CompletenessFailed = "FB506", Error, Untrustworthy, "completeness proof failed: the inertia count differs from the number of modes found", "report the model to the developers";
    CompletenessUnproved = "FB507", Warning, Done, "completeness of the modes is not proved", "use --accuracy standard";
    RepeatedSplit = "FB508", Warning, Done, "last mode belongs to a repeated eigenvalue whose other modes were left out", "ask for the number of modes in the note to keep the symmetry of the body";
    ModesClamped = "FB509", Note, Done, "fewer modes exist than requested", "nothing to do";
    NoiseFloor = "FB510", Warning, Done, "digits of the input limit the accuracy of the lowest modes", "write the matrices with 17 significant digits";
    MassMatrixSingular = "FB511", Note, Done, "mass matrix is singular: fewer finite modes than degrees of freedom", "nothing to do: common with reduced integration";
    NoModes = "FB512", Error, BadInput, "no flexible mode below the requested frequency", "raise --max-frequency";
    FactorPrecision = "FB513", Note, Done, "precision of the factorisation that was chosen automatically", "nothing to do: --factor f64 or f32 sets it";
    DampingIndefinite = "FB514", Error, Untrustworthy, "modal damping is not positive semidefinite or not finite", "check the signs and the units of the damping: damping must not add energy";
    ModesOverdamped = "FB515", Warning, Done, "modes are overdamped", "nothing to do if intended; otherwise check the units: a ratio of 2 % is 0.02, alpha is in 1/time, beta in time, D in mass/time";
    ShapesNone = "FB520", Error, BadInput, "no shape deforms the body", "give shapes that are not rigid motions";
    ShapesDependent = "FB521", Warning, Done, "shapes that depend linearly on the others were left out", "nothing to do if expected";
    ShapesRigid = "FB522", Note, Done, "rigid-body motions were removed from the shapes; the body frame performs them", "nothing to do: no motion is lost";
    ShapesSpan = "FB523", Warning, Done, "modes of the given subspace are not eigenvectors", "nothing to do for static shapes; otherwise compute the modes more accurately, or write all their digits";
    LoadsCovered = "FB524", Note, Done, "static responses that the basis already contains were left out", "nothing to do: other modes contain them";
    FreeFrequencies = "FB525", Note, Done, "frequencies of the Craig-Bampton body that differ from the free body by more than 1 %", "use more fixed-interface modes (--modes, --max-frequency) if higher frequencies matter";
    InterfaceCompliance = "FB526", Note, Done, "modes do not contain the whole static compliance at the interfaces", "convert with --basis craig-bampton or --residual-vectors interfaces, which contain it";
    GeometricStiffnessNone = "FB530", Warning, Done, "no geometric stiffness: the body softens under spin where a real one stiffens", "give [[geometric_stiffness]] for spin, or keep to spin rates far below the value in the message";
    GeometricStiffnessPartial = "FB531", Note, Done, "geometric stiffness is given for some directions of a load only", "nothing to do if the load does not act in the other directions";
    SimulationStopped = "FB540", Error, Untrustworthy, "simulation stopped", "check spin, loads and dropped terms: the motion leaves the range of the model";
    LinearRangeLeft = "FB541", Warning, Done, "deflections beyond the range of linear elasticity", "trust the result as a trend only; a body of several flexible parts carries larger deflections";
    SpinSoftens = "FB542", Warning, Done, "body without geometric stiffness is too soft at this spin", "convert the model with [[geometric_stiffness]] for spin, and do not switch it off in [run]";
    PhaseDrifts = "FB543", Warning, Done, "errors grow with time although amplitudes are bounded", "check a run of the longest duration that the model is meant for: phases drift apart with angular velocity times duration";
    ResonanceDropped = "FB544", Warning, Done, "dropped mode is near the frequency of a load", "keep the mode, or lengthen the run until the resonance would show";
    LoadIdle = "FB545", Warning, Done, "load has no effect", "let an interface carry the body to see gravity and inertia bend it: [carried] in docs/reference/scenes.md";
    CarrierUnresolved = "FB546", Warning, Done, "modes resolve the carried interface poorly", "convert with --basis craig-bampton, or with --residual-vectors interfaces, and with the interface in the manifest";
    CarriedGeometricStiffness = "FB547", Warning, Done, "geometric stiffness does not act while the body is carried", "convert the model again: the file is of a version before 1.10 or comes from another program; without it trust spin rates far below the first frequency only";
    ReferenceIncomplete = "FB548", Warning, Done, "error of the reference body relative to the model uses more of the tolerances than intended", "convert more modes, or residual vectors for the loads; a shorter or slower scene shows where the difference comes from";
    LumpedWithoutBody = "FB549", Note, Done, "no body can be computed with a lumped mass, so it is missing in the comparison", "nothing to do: a program that lumps the mass in this way cannot compute the body either";
    RunTooLong = "FB550", Error, BadInput, "run takes more steps than allowed", "simulate a shorter `duration`, leave out modes beyond the frequencies of the loads, or raise `most_steps` in [run]";
    StepPassesOver = "FB551", Error, BadInput, "steps are longer than the oscillations of a load", "give a shorter `step`, or none";
    MotionWithoutBasis = "FB552", Note, Done, "no small number of shapes represents the motion", "nothing to do: the body has the modes of a conversion without --basis scene";
    RecoveryLoadUnseen = "FB553", Warning, Done, "recoveries have no columns for a load", "define an interface with a reference point where the load acts (any coupling but `free`), convert again, and let the load act there";
    RateUnsettled = "FB554", Warning, Done, "angular velocity still changes with the step size of the integration", "give a smaller `tolerance` (or a shorter `step`) in [run] until the angular velocity no longer changes";
    VariationStops = "FB555", Note, Done, "standard variation cannot be simulated and judges nothing", "state what may vary in [[variation]]; nothing to do if the load cannot turn so far";
    RecoveryLeftOut = "FB556", Note, Done, "recovery of displacements is left out of a motion in another frame", "convert with a frame at the centre of mass, or watch the nodes in the scene ([[watch]]): displacements of a recovery are relative to the frame of the body in its file";
    SelectionUnjudged = "FB557", Error, CheckFailed, "body does not meet the tolerances of the scene, or this cannot be judged", "convert more modes, or residual vectors for the loads of the scene; --allow-unjudged writes the body nevertheless";
    RecoveryUnjudged = "FB561", Note, Done, "truncation error of a recovery is not known", "give the recovery by an operator (`operator` in [[recovery]]); or make a body of more shapes and compare";
    VariationFails = "FB559", Warning, Done, "recommended body does not hold in a variation of the scene", "make the variation a [[case]] of the scene, so that the body is made for it as well; or leave out a [[variation]] that cannot occur";
    PreloadReleased = "FB562", Warning, Done, "body starts undeformed under a preload and vibrates", "start in the equilibrium of the preload: deformation = \"static\" in [initial]";
    RecoveryMotionUnknown = "FB564", Warning, Done, "run lacks columns that forces of motion in the recoveries depend on", "write the columns that the message names to the table of the run: `simulate --csv` writes all of them";
    InertiaIndefinite = "FB560", Warning, Done, "W3 is kept without W2, and deflections make the inertia indefinite", "keep W2 as well (--terms W2,W3 or all), unless joints prescribe the rotation or the deflections stay far below the value in the message";
    StressAtInterface = "FB563", Note, Done, "largest stress is at a rigid interface", "judge the part by the largest value away from the interface, or model the joint: coupling = \"averaging\" lets the interface deform";
    CouplingEffect = "FB558", Note, Done, "effect of rigid interfaces that the body and its reference model share", "nothing to do where a stiff part is mounted at the interface; otherwise set coupling = \"averaging\", which lets the interface deform";
    // FB6xx: resources; FB603 stays unused (checkpoints of earlier versions)
    MemoryShort = "FB601", Error, Resources, "not enough memory", "ask for fewer modes, or use a larger machine";
    DiskShort = "FB602", Error, Resources, "not enough disk space", "free some space";
    WorkLong = "FB604", Error, BadInput, "work would take very long", "ask for less, or use --allow-long";
    Stopped = "FB605", Error, Interrupted, "computation was stopped", "nothing to do: the caller stopped it";
    Forked = "FB606", Error, Resources, "forked process has no worker threads", "start processes by `spawn` or `forkserver`, or fork before the first computation";
    // FB7xx: flex-body files; FB705 and FB708 to FB711 stay unused (earlier versions)
    BodyUnreadable = "FB701", Error, BadInput, "not a flex-body file", "give a file written by flexbody convert";
    BodyVersion = "FB702", Error, BadInput, "flex-body file of a newer format", "read it with the flexbody version named in the file";
    BodySchema = "FB703", Error, CheckFailed, "flex-body file breaks its schema", "convert the model again";
    BodyIdentity = "FB704", Error, CheckFailed, "identity violated", "convert the model again; if the error persists, report the file to the developers";
    BodySourceChanged = "FB706", Warning, Done, "input file differs from the one the body was made of", "convert the model again";
    BodyIncomparable = "FB707", Error, BadInput, "flexible bodies cannot be compared", "give two bodies (or a body and its model) with the same nodes, dimension and units; compare --common takes bodies with different numbers of modes";
    BodyChanged = "FB712", Error, CheckFailed, "content of a flex-body file changed since it was written", "take the file as it was written, or convert the model again; docs/reference/file_format.md says how a program that changes files states new digests";
    BodyWithoutDigest = "FB713", Note, Done, "flex-body file has no digest, so changes since it was written cannot be detected", "convert the model again to get a digest";
    BodyUntrustworthy = "FB714", Error, Untrustworthy, "body violates conditions that hold for every body; nothing was written", "ask for fewer modes, and look for weakly joined parts and implausible masses; if the error persists, report the model to the developers";
    WarningsDenied = "FB715", Error, CheckFailed, "warnings are treated as errors", "resolve the warnings, or leave out --deny-warnings";
    ForeignRounded = "FB716", Warning, Done, "inertia data in a file of another program have few digits", "write the file with 17 significant digits, and from one mass matrix; flexbody audit gives details";
    ExportLoses = "FB720", Error, BadInput, "format cannot hold the whole body", "export to a format that holds it (docs/reference/exports.md), or write the file without it by --allow-loss";
    ExportLost = "FB721", Warning, Done, "exported file does not hold all data of the body", "give --scene SCENE to measure the effect in your motion; if it matters, export to a format that holds it (docs/reference/exports.md)";
    ExportNeeds = "FB722", Note, Done, "program uses a part of the file only with a setting", "make the setting named in the message in the input of the program";
    ExportPicture = "FB723", Note, Done, "file is a picture of the body", "use another format for multibody programs: docs/reference/exports.md lists them";
    ExportRecoveries = "FB724", Note, Done, "exported file has not all of the recoveries", "compute them from a run of the program: flexbody recover";
    ExportNumbers = "FB725", Note, Done, "interfaces have numbers instead of names in the exported file", "join them by these numbers in the model of the program";
    ForeignUnreadable = "FB730", Error, BadInput, "flexible-body file of another program cannot be read", "give a SID_FEM, MBDyn .fem, MBSim or Exudyn file as the program writes it";
    ForeignIncomplete = "FB731", Error, BadInput, "data that a body needs are missing in the file", "write the file again with the missing data";
    ForeignChanged = "FB732", Note, Done, "modes of the file are not normalised or contain rigid motions; combinations of them were used", "nothing to do: the motion of the nodes is unchanged, the modal coordinates differ";
    ForeignDropped = "FB733", Warning, Done, "terms of the kinetic energy are missing in the file, and therefore in the body", "use a format that holds them";
    MotionUnreadable = "FB734", Error, BadInput, "file is not a simulation result, or it is damaged", "give the file that flexbody simulate -o writes";
    MotionForeign = "FB735", Error, BadInput, "simulation result belongs to another body", "simulate this body, or give the body that was simulated";
    AuditIdentity = "FB740", Error, CheckFailed, "identity of inertia data violated", "write the file again with the program that made it, or with flexbody export";
    AuditLumped = "FB741", Error, CheckFailed, "inertia comes from lumped masses", "condense the consistent mass matrix: flexbody convert";
    AuditLayout = "FB742", Error, CheckFailed, "arrays are stored in another order than the dialect prescribes", "name the dialect to the reading program, or write the file again with flexbody export";
    AuditDigits = "FB743", Error, CheckFailed, "digits were lost in writing", "write with 17 significant digits and exponents";
    AuditUnits = "FB744", Error, CheckFailed, "numbers do not fit each other: units are mixed", "write masses, lengths and times in one system of units";
    AuditCoupling = "FB745", Error, CheckFailed, "coupling of rigid and flexible motion is missing", "write the inertia couplings too";
    AuditImplausible = "FB746", Error, CheckFailed, "numbers cannot be those of a body", "check the input that the file was made from";
    AuditSurplus = "FB747", Error, CheckFailed, "file has more numbers than its header says", "correct the counts in the header, or remove the surplus";
    AuditFrame = "FB748", Error, CheckFailed, "axes of a frame are not a rotation", "write right-handed orthonormal axes";
    ForeignUnsound = "FB749", Error, BadInput, "file contradicts conditions that every body fulfils", "run flexbody audit on the file for details, and write the file again";
    ClusterUnreadable = "FB760", Error, BadInput, "folder was not made by flexbody prepare, or is damaged", "prepare the folder again, or name the prepared folder";
    ClusterChanged = "FB761", Error, CheckFailed, "file of a cluster changed since it was written", "copy the folder again from the cluster, or run the driver again";
    ClusterForeign = "FB762", Error, BadInput, "cluster result belongs to another model", "name the model that was prepared, or prepare this model and run the driver";
    ClusterUnfinished = "FB763", Error, BadInput, "cluster has no result yet", "run the driver; it continues from the saved modes";
    ClusterInaccurate = "FB764", Error, Untrustworthy, "modes from the cluster are not modes of the model", "run the driver again, with --solver mumps if another solver was used";
    CompletenessElsewhere = "FB765", Note, Done, "completeness relies on the count of another program", "use flexbody assemble --prove to count with flexbody";
    EngineMissing = "FB766", Error, BadInput, "MPI, PETSc or SLEPc not found", "install them (docs/how_to/cluster.md), name them with --mpiexec and --python, or use --engine built-in";
    EngineFailed = "FB767", Error, Untrustworthy, "MPI solver ended without a result", "run the same command again: it continues from the saved modes";
    BatchSyntax = "FB770", Error, BadInput, "list of bodies cannot be read", "see docs/how_to/batch.md for the keys";
    BatchFailed = "FB771", Error, CheckFailed, "bodies of a batch failed", "see the message of each body; the other bodies were written, and a second run makes the missing ones only";
    // FB8xx: usage
    Usage = "FB801", Error, BadInput, "command line not understood", "see flexbody help";
    LumpedScheme = "FB802", Error, BadInput, "unknown lumping scheme", "use row-sum, diagonal-scaling, user=FILE or none";
    LumpedMassTable = "FB803", Error, BadInput, "nodal masses cannot be used", "give a table with the header `node,mass` and one finite mass for each node";
    Argument = "FB804", Error, BadInput, "argument of a function is not possible", "give the argument as the documentation of the function describes it";
    Internal = "FB999", Error, Bug, "internal error", "report this bug of flexbody with the input";
}

/// Subjects of the codes, by their first digit.
pub(crate) const SUBJECTS: [(char, &str); 9] = [
    ('1', "files, and input decks of FE programs"),
    ('2', "manifest, tables, scene file"),
    ('3', "matrices and arrays"),
    ('4', "checks of the model: mass, stiffness, rigid motion, units, interfaces"),
    ('5', "modes, bases, simulation, selection"),
    ('6', "memory, disk, time, processes"),
    ('7', "flex-body files, files of other programs, cluster, batches"),
    ('8', "command line"),
    ('9', "internal errors"),
];

/// Returns the content of `docs/reference/codes.md`: the table of codes and the exit codes.
pub fn codes_markdown() -> String {
    let mut out = String::from(
        "<!-- Generated from the table in crates/base/src/diagnostic.rs: FLEXBODY_BLESS=1 cargo test --test program docs_generated -->\n\n\
         # Diagnostics and exit codes\n\n\
         A message begins with its severity and its code (`error[FB101]: ...`); its line `help:` says what to do next. The\n\
         table of [codes](#codes) has the cause and the general help of each code; the message of a run may have a more precise\n\
         help. `flexbody explain FB408` prints the row of a code, `flexbody explain` lists all codes.\n\n\
         ## Exit codes\n\n\
         | exit code | meaning |\n|---|---|\n\
         | 0 | the work was done |\n\
         | 1 | a check failed or a tolerance was exceeded; the inputs themselves were readable |\n\
         | 2 | bad input or usage |\n\
         | 3 | no trustworthy numerical result: not converged, mechanism, indefinite mass |\n\
         | 4 | not enough memory or disk, or an output that may not be written (no permission, a read-only file system: FB121) |\n\
         | 70 | internal error: a bug of flexbody |\n\
         | 130 | interrupted (Ctrl-C), terminated (SIGTERM) or disconnected from its terminal (SIGHUP); no unfinished file is left |\n\n\
         Any other signal that ends programs also ends this one, after its unfinished files are removed: a shell reports\n\
         128 + the number of the signal. With exit code 0 all outputs are in their places, with 1 too unless the message\n\
         says that nothing is written. With 2, 3, 4, 70, 130 and after a signal no output is, and the files that they\n\
         would have replaced are there ([output files](runs.md#output-files)).\n\n\
         A process ends with the exit code of its first error; warnings and notes do not change it, unless\n\
         `--deny-warnings` treats a warning as a failed check (1): then nothing is written.\n\n\
         ## Codes\n\n\
         A **warning** means that the result may be wrong or incomplete for your purpose. A **note** states a fact or a\n\
         choice of the program; act on it only if its help says so.\n\n\
         | codes | subject |\n|---|---|\n",
    );
    for (hundred, subject) in SUBJECTS {
        out.push_str(&format!("| FB{hundred}xx | {subject} |\n"));
    }
    out.push_str("\n| code | severity | exit code | meaning | cause | help |\n|---|---|---|---|---|---|\n");
    for code in Code::ALL {
        let severity = code.severity().name();
        let exit = if code.severity() == Severity::Error {
            (code.exit_code() as u8).to_string()
        } else {
            String::new()
        };
        let (id, title, cause, help) = (code.id(), code.title(), code.cause(), code.help());
        out.push_str(&format!("| {id} | {severity} | {exit} | {title} | {cause} | {help} |\n"));
    }
    out
}

/// Diagnostic: its message, its location and its help.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostic {
    code: Code,
    message: String,
    file: Option<PathBuf>,
    line: Option<usize>,
    help: Option<String>,
}

/// Value of a step, or the errors that prevent it.
pub type Diagnosed<T> = Result<T, Vec<Diagnostic>>;

impl Diagnostic {
    /// Creates a diagnostic with `message`, a lowercase text that says what is wrong, with the facts.
    pub fn new(code: Code, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), file: None, line: None, help: None }
    }

    /// Adds the file.
    pub fn in_file(mut self, file: impl AsRef<Path>) -> Self {
        self.file = Some(file.as_ref().to_path_buf());
        self
    }

    /// Adds the line (from 1) of the file.
    pub fn at_line(mut self, line: usize) -> Self {
        self.line = Some(line);
        self
    }

    /// Replaces the help of the table by a more precise one.
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Prefixes the message with its subject.
    pub fn about(mut self, what: impl std::fmt::Display) -> Self {
        self.message = format!("{what}: {}", self.message);
        self
    }

    /// Replaces every quotation between backticks by dots.
    pub fn without_quotes(mut self) -> Self {
        let parts: Vec<&str> = self.message.split('`').collect();
        // Every second part is between backticks.
        let shown =
            |(k, part): (usize, &&str)| if k % 2 == 1 { "...".to_owned() } else { (*part).to_owned() };
        self.message = parts.iter().enumerate().map(shown).collect::<Vec<_>>().join("`");
        self
    }

    /// Returns the code.
    pub fn code(&self) -> Code {
        self.code
    }

    /// Returns the severity, from the table.
    pub fn severity(&self) -> Severity {
        self.code.severity()
    }

    /// Returns the message: what is wrong, with the facts.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// Returns the file of the problem.
    pub fn file(&self) -> Option<&Path> {
        self.file.as_deref()
    }

    /// Returns the line (from 1) of the problem.
    pub fn line(&self) -> Option<usize> {
        self.line
    }

    /// Returns the advice.
    pub fn help(&self) -> &str {
        self.help.as_deref().unwrap_or(self.code.help())
    }
}

impl std::fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let severity = self.severity().name();
        write!(f, "{severity}[{}]: {}", self.code.id(), printable(&self.message))?;
        if let Some(file) = &self.file {
            let name = file.display().to_string().replace('\n', "\\n");
            write!(f, "\n  in {}", printable(&name))?;
            if let Some(line) = self.line {
                write!(f, ", line {line}")?;
            }
        }
        write!(f, "\n  help: {}", printable(self.help()))
    }
}

/// Returns the text with escaped terminal commands: control characters except line ends and tabs, and characters that
/// change the direction of writing, are shown by their numbers, such as `\u{1b}`.
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(is_command) {
        return Cow::Borrowed(text);
    }
    let shown = |c: char| if is_command(c) { c.escape_unicode().to_string() } else { c.to_string() };
    Cow::Owned(text.chars().map(shown).collect())
}

fn is_command(c: char) -> bool {
    c.is_control() && !matches!(c, '\n' | '\t')
        || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{200e}' | '\u{200f}')
}

impl serde::Serialize for Diagnostic {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeStruct;
        let mut s = serializer.serialize_struct("Diagnostic", 6)?;
        s.serialize_field("code", self.code.id())?;
        s.serialize_field("severity", &self.severity())?;
        s.serialize_field("message", &self.message)?;
        s.serialize_field("file", &self.file.as_ref().map(|f| f.display().to_string()))?;
        s.serialize_field("line", &self.line)?;
        s.serialize_field("help", self.help())?;
        s.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_take_for_a_command_is_shown_by_its_number() {
        let diagnostic = Diagnostic::new(Code::Hdf5Layout, "group `\u{1b}]0;t\u{7}K\u{9b}31m` \u{202e}x")
            .in_file("a\nb\u{1b}[31m.h5")
            .with_help("\u{1b}[2J");
        let told = diagnostic.to_string();
        assert!(!told.contains(is_command), "{told:?}");
        assert!(
            told.contains("`\\u{1b}]0;t\\u{7}K\\u{9b}31m`") && told.contains("a\\nb\\u{1b}[31m.h5"),
            "{told}"
        );
        assert_eq!(printable("a\tb\nc"), "a\tb\nc");
    }

    #[test]
    fn quotes_are_left_out() {
        let of = |message: &str| Diagnostic::new(Code::TableHeader, message).without_quotes().message;
        assert_eq!(of("column `root:$6$` is not `node`"), "column `...` is not `...`");
        assert_eq!(of("file does not exist"), "file does not exist");
        assert_eq!(of("an open `quote"), "an open `...");
    }
}
