//! Table of codes: `NAME = "FBnnn", severity, exit code, title, help, cause`. `docs/reference/codes.md` is generated from it, and `flexbody explain` prints its rows.

use super::Severity;
use crate::exit_code::ExitCode;

macro_rules! codes {
    ($($variant:ident = $id:literal, $severity:ident, $exit:ident, $title:literal, $help:literal, $cause:literal;)*) => {
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

            /// Returns why messages with this code arise.
            pub fn cause(self) -> &'static str {
                match self { $(Code::$variant => $cause,)* }
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
    FileUnreadable = "FB101", Error, BadInput, "file cannot be read", "check the path and its permissions",
        "The path does not exist, is a folder, may not be read by this user, or the library that reads this format fails on the content.";
    FileFormatUnknown = "FB102", Error, BadInput, "file format not recognised", "give Matrix Market (.mtx, .mtx.gz, .mtx.zst), HDF5 (.h5, .hdf5), SciPy (.npz), NumPy (.npy), MATLAB (.mat), PETSc or Nastran (.op4, .pch) matrices",
        "The first bytes and the extension of the file match none of the formats that this entry accepts.";
    FileCompressionBroken = "FB103", Error, BadInput, "compressed file is damaged or cut off", "transfer or write the file again",
        "The checksum or the end of the compressed stream is missing, as after a transfer that stopped or a full disk.";
    OutputUnwritable = "FB104", Error, Resources, "output cannot be written", "check the folder, its permissions and the free space",
        "The operating system refused a write: the disk is full, a quota is used up, or the device failed.";
    OutputFolderMissing = "FB105", Error, BadInput, "folder of the output file does not exist", "make the folder first",
        "Outputs are written into folders that exist; folders are not made, so that a mistyped path is noticed.";
    FileEmpty = "FB106", Error, BadInput, "file is empty", "write the file again",
        "The file has no bytes, as after a program that stopped before it wrote.";
    OutputNotFile = "FB107", Error, BadInput, "output path does not name a file", "name a file that may be made or replaced",
        "The output path is a folder, a device, or ends without a file name.";
    JobUnknown = "FB108", Error, BadInput, "input is not a job of a supported FE program", "give a manifest (model.toml), or name the program with --format",
        "The file is neither a manifest nor recognised by its content as the input deck of a supported FE program.";
    JobIncomplete = "FB109", Error, BadInput, "a file of the FE job is missing", "write all files of the job in one run and keep them beside the input deck",
        "The input deck names or implies a further file (matrices, nodes, includes) that is not beside it.";
    DeckSyntax = "FB110", Error, BadInput, "input deck cannot be read", "correct the line",
        "A line of the input deck does not have the form that the manual of the FE program prescribes.";
    DeckUnsupported = "FB111", Error, BadInput, "input deck uses a feature that is not supported", "write the model without this feature, or give matrices and tables by a manifest",
        "The deck has a keyword or an option that changes the matrices or the nodes in a way that this reader does not model.";
    DeckRows = "FB112", Error, BadInput, "rows of the matrices do not match the input deck", "write the deck and the matrices in one run",
        "The matrices have other rows than the deck describes, as when the deck was changed after the matrices were written.";
    DeckRenumbered = "FB113", Note, Done, "nodes of instances were renumbered", "nothing to do; refer to interfaces by node sets",
        "A model of assembled instances may repeat node numbers, so nodes get new numbers that are unique.";
    JobStep = "FB114", Note, Done, "one of several steps with matrices was chosen", "nothing to do if it is the right step; otherwise remove the other steps",
        "The job wrote matrices in more than one step, and one body needs one pair of matrices.";
    NodeFileSyntax = "FB115", Error, BadInput, "node file cannot be read", "write the file again, or give a table with the columns node, x, y, z",
        "A line of the node file does not have a node number and its coordinates in the form of its program.";
    DeckSupports = "FB116", Note, Done, "input deck has supports", "matrices written before the supports are applied (KGG, MGG) are free; for other matrices remove the supports",
        "The deck holds boundary conditions. A body of a floating frame is free, so the matrices must not contain them.";
    RowsEmpty = "FB117", Note, Done, "rows without stiffness and mass were left out", "nothing to do for rotations of solid elements and nodes without elements",
        "FE programs number degrees of freedom that no element uses; such rows are zero in K and M.";
    DeckLumps = "FB118", Warning, Done, "input deck does not ask for consistent masses", "write PARAM,COUPMASS,1 into the bulk data and run the deck again",
        "Nastran lumps the masses of many elements unless PARAM,COUPMASS asks for consistent ones.";
    JobCondensed = "FB119", Warning, Done, "matrices are condensed to the boundary of a superelement", "give K and M of all nodes (Nastran: KGG and MGG) if the change of inertia with deformation matters",
        "The matrices belong to a superelement: the inner nodes are already replaced by boundary nodes and modes, so the positions of the mass are lost.";
    DeckReference = "FB120", Note, Done, "reference node of a distributing coupling was placed at the mean of its nodes", "nothing to do; an averaging interface of these nodes also has their rotation",
        "The reference node of a distributing coupling has a position of its own, but the mean displacement belongs to the mean of the nodes.";
    OutputForbidden = "FB121", Error, Resources, "no permission to write the output", "choose another folder, or change the permissions of the folder or the file",
        "The user has no permission to write the folder or the file, or the file system is read-only.";
    MeshPartial = "FB124", Note, Done, "surface for drawing the body is incomplete", "nothing to do for the results; connectors and springs are not drawn",
        "Some elements have no faces (springs, connectors) or are of a type without known faces, so the drawn surface leaves them out.";
    MeshForeign = "FB125", Error, BadInput, "mesh does not match the nodes", "give the mesh that the matrices were computed on, in the same units, or leave `mesh` out",
        "The elements of the mesh refer to nodes that the model does not have, or its nodes lie at other places.";
    ModesDiffer = "FB127", Warning, Done, "modes in the file are not modes of K and M", "give modes of the same mesh, material and mass matrix, of the body without supports",
        "The frequencies that the file states differ from those that K and M give its shapes, or the shapes differ from eigenvectors of K and M.";
    ModeFileSyntax = "FB128", Error, BadInput, "mode file cannot be read", "write the file as docs/how_to/import_modes.md says, or give the shapes as an array",
        "A line or a record of the mode file does not have the form of its format.";
    ModesCompleted = "FB129", Note, Done, "rows missing from the mode file were completed with K and M", "nothing to do: the completed modes satisfy the equations of motion in these rows too",
        "The mode file lacks rows of the matrices (rotations, midside nodes, multipliers); K and M determine them from the rows that are given.";
    DeckConstrained = "FB131", Note, Done, "rows constrained by the deck were eliminated", "nothing to do: matrices before the constraints (KGG, MGG) describe parts that are not joined",
        "The deck ties degrees of freedom together (multi-point constraints, rigid elements), so the dependent rows are combined with the independent ones.";
    InputChanged = "FB132", Error, BadInput, "file changed while it was read", "run again after the program that writes the file has finished",
        "Size, time or content of the file was different at the end of the reading: another program writes it.";
    DeckDamping = "FB133", Warning, Done, "dashpots of the deck are not in the body", "state the damping of the modes (--damping, [damping] of a manifest: also as a matrix), or give the dashpots to the multibody program as force elements at interfaces",
        "Dashpots are in neither of the matrices K and M, and the body has only the damping that is stated.";
    DeckStressed = "FB134", Warning, Done, "stiffness of the deck contains the stress of an earlier step", "write K in a first step without PERTURBATION, and give the stress stiffness as [[geometric_stiffness]]",
        "A step with PERTURBATION after another one writes the stiffness under the loads of that step. It resists rotations (FB410), and acts whatever the loads of the body are.";
    // FB2xx: tables and manifest
    ManifestSyntax = "FB201", Error, BadInput, "manifest is not valid TOML or has unknown, missing or mistyped keys", "see docs/reference/input.md for the keys",
        "The text is not TOML, a key is misspelled or missing, or a value has another type than its key.";
    ManifestUnit = "FB202", Error, BadInput, "unknown unit", "use one of length: m mm cm um km in ft; mass: kg g t tonne lb slug slinch; time: s ms us; or a positive number (factor to SI)",
        "The unit is not in the list of names, or the number is not positive.";
    TableHeader = "FB203", Error, BadInput, "unexpected table header", "write the header of nodes: `node,x,y,z`; of dofs: `node,dir` or `row,node,dir`",
        "The first line of a table names its columns, and these are not the expected ones.";
    TableRow = "FB204", Error, BadInput, "table row cannot be read", "give one row per line with the columns of the header",
        "A line has another number of columns than the header, or a field is not a number of the expected kind.";
    NodeDuplicate = "FB205", Error, BadInput, "node number occurs twice", "list each node once",
        "Two lines of the node table have one number, so the position of the node is ambiguous.";
    CoordinateNotFinite = "FB206", Error, BadInput, "node coordinate is not a finite number", "correct the coordinate",
        "The coordinate is NaN, infinite or too large for double precision.";
    DofDirection = "FB207", Error, BadInput, "direction is not between 1 and 6", "use 1, 2, 3 for displacements along x, y, z, and 4, 5, 6 for rotations",
        "The column `dir` holds a number that is no direction.";
    DofRowOrder = "FB208", Error, BadInput, "row numbers of dofs.csv are not 0, 1, 2, ... without gaps", "number the rows from 0, or leave the column out",
        "The column `row` of dofs.csv does not count the rows of the matrices in their order.";
    InterfaceNode = "FB209", Error, BadInput, "interface names a node that the model does not have", "correct the node list of the interface",
        "The node list of the interface has a number that is not in the node table, or that the body has no rows for.";
    InterfaceAcross = "FB210", Error, BadInput, "interface contains nodes of several bodies", "define one interface for each body",
        "The matrices hold several bodies, and the nodes of the interface belong to more than one of them.";
    SceneSyntax = "FB211", Error, BadInput, "scene is not valid TOML or has unknown, missing or mistyped keys", "see docs/reference/scenes.md for the keys",
        "The text is not TOML, a key is misspelled or missing, or a value has another type or range than its key.";
    SceneBody = "FB212", Error, BadInput, "scene does not fit the body", "run flexbody inspect, which shows the modes and interfaces of the body",
        "The scene names modes, interfaces or amplitudes that the body does not have.";
    SceneContradicts = "FB213", Error, BadInput, "scene contradicts itself", "remove one of the two entries",
        "Two entries of the scene determine one quantity in different ways.";
    CarrierImpossible = "FB214", Error, BadInput, "body cannot be carried at this place", "carry an interface with a reference point whose nodes do not lie on one line, or a node with rotations, of a body with W1",
        "The body can be carried only by a place with a position and a rotation, and its W2 and W3 depend on W1, which must then be in the file.";
    SeriesColumn = "FB215", Error, BadInput, "column of a history is not in the file", "name a column of the file, or give its number, from 1",
        "The scene or the command asks for a column that the header of the history file does not have.";
    SeriesRow = "FB216", Error, BadInput, "history file cannot be read as columns over time", "write one row per instant, with ascending times and decimal points",
        "A line of the history file has a wrong number of columns, a field that is no number, or a time that does not increase.";
    SeriesRange = "FB217", Error, BadInput, "history file does not cover the run", "shorten the run, or set `outside` = \"hold\" to hold the first and the last value outside the file",
        "The times of the history file begin after the start of the run or end before its end.";
    PlaceUnknown = "FB218", Error, BadInput, "place or direction does not exist in the body", "run flexbody inspect, which lists the interfaces; give nodes by number",
        "The name is not an interface of the body, the number is not a node of it, or the place has no such direction.";
    SceneCase = "FB219", Error, BadInput, "load case not found, or not named although the scene has several", "name a case of the scene with --case NAME",
        "A scene with several load cases needs the name of one, and the name must be one of them.";
    NodeSetUnknown = "FB220", Error, BadInput, "node set or region contains no node of the model", "name a node set of the deck, or correct the region",
        "The set is not in the deck, or no node lies in the region that an interface, a cut or a recovery describes: its units or axes may differ from those of the nodes.";
    RecoveryUnknown = "FB221", Error, BadInput, "body has no recovery of this name", "run flexbody inspect, which lists the recoveries; give [[recovery]] in the manifest to convert with one",
        "The body was converted without a recovery of this name.";
    SceneDamping = "FB225", Error, BadInput, "scene and body both define damping", "remove [damping] from the scene (--damping from the command), or write `replace = true` in it to ignore the damping of the body",
        "The body file holds modal damping and the scene defines damping too; the sum of both is rarely meant.";
    GravityUnits = "FB226", Warning, Done, "gravity of a scene is that of the earth in other units than those of the body", "write gravity in the units of the body: 9.81 m/s^2 is 9810 mm/s^2",
        "The number of the gravity in a scene is 9.81 (or 9810, 386.1, 32.2) although the body has another unit of length, so that the weight is wrong by the ratio of the units.";
    // FB3xx: matrices
    MatrixSyntax = "FB301", Error, BadInput, "matrix file cannot be parsed", "write the matrix as Matrix Market coordinate real, symmetric or general",
        "A line or a record of the matrix file does not have the form of its format.";
    MatrixKind = "FB302", Error, BadInput, "kind of matrix is not supported", "write a real (or integer) sparse matrix",
        "The matrix is complex, skew-symmetric, dense or has only a pattern; K and M are real sparse matrices.";
    MatrixIndex = "FB303", Error, BadInput, "matrix index out of range", "Matrix Market counts from 1, HDF5 indices from 0",
        "An index is smaller than the first or larger than the last one of the declared size.";
    MatrixCount = "FB304", Error, BadInput, "number of entries differs from the header", "write the file again; it may be cut off",
        "The header of the file declares another number of entries than the file has.";
    MatrixNotSquare = "FB305", Error, BadInput, "matrix is not square", "give the whole symmetric matrix",
        "The number of rows differs from the number of columns.";
    MatrixNotFinite = "FB306", Error, BadInput, "matrix contains NaN or infinite values", "find the element that produced them in the FE program",
        "An entry is NaN or infinite, as from an element of zero volume or a division by zero in the FE program.";
    MatrixAsymmetric = "FB307", Error, BadInput, "matrix is not symmetric", "remove gyroscopic, follower and friction terms: only symmetric K and M describe a conservative body",
        "Entries on both sides of the diagonal differ by more than rounding.";
    MatrixSizesDiffer = "FB308", Error, BadInput, "stiffness and mass matrix differ in size", "write both from the same analysis",
        "K and M come from different analyses, or one of them has constraints eliminated.";
    MatrixTriangles = "FB309", Error, BadInput, "matrix declared symmetric has entries on both sides of the diagonal", "write one triangle, or declare the matrix general",
        "A symmetric file stores one triangle. This one has entries in both, so it is unclear whether to add or to mirror them.";
    Hdf5Layout = "FB310", Error, BadInput, "matrix not found in the file or group", "store data, indices, indptr and shape (CSC, CSR) or data, row, col and shape (COO); name the group as FILE.h5:/group",
        "The HDF5 file has no group with the arrays of a sparse matrix, or it has several and none is named.";
    MatrixDigits = "FB311", Warning, Done, "matrix values have few digits", "write 15 to 17 significant digits; thin bodies lose all digits otherwise",
        "The values were printed with few digits. Stiffness of a thin body is a difference of large numbers, and the lost digits become errors of its lowest frequencies.";
    MatrixEmpty = "FB312", Error, BadInput, "matrix has no nonzero entries", "write the matrix again",
        "All entries are zero or the file has none.";
    MatrixTooLarge = "FB313", Error, BadInput, "matrix has more than 4294967295 rows", "split the model",
        "Rows are numbered by 32 bits.";
    ShapesSize = "FB320", Error, BadInput, "array of shapes or loads does not fit the matrices", "give one row (or one column) for each matrix row, in the order of the matrices",
        "The array has neither as many rows nor as many columns as the matrices have rows.";
    ShapesZero = "FB321", Error, BadInput, "shape or load is zero everywhere", "remove the column",
        "A column has only zeros, so it defines no direction of motion.";
    RecoverySize = "FB322", Error, BadInput, "operator of a recovery does not fit the matrices", "give one column for each matrix row, in the order of the matrices, and one value of the offset for each row",
        "The operator has another number of columns than K, or the offset another number of values than the operator has rows.";
    RecoveryRows = "FB323", Error, BadInput, "table of rows does not describe the operator of its recovery", "write the header `row,name,quantity,component,unit` and one line for each row of the operator; docs/reference/recovery.md has the words",
        "The table has another number of lines than the operator has rows, or a word that is no known quantity, component or unit.";
    RecoveryCut = "FB324", Error, BadInput, "cut of a recovery does not divide the body", "give the nodes of one side, with all nodes of a rigid interface or none",
        "The nodes of one side of the cut are all nodes, none, or divide a rigid interface, so the section has no force.";
    RecoveryShapes = "FB326", Error, BadInput, "answers of an FE program do not belong to the shapes of their recovery", "run the FE program on all shapes that flexbody shapes wrote, and keep the .npz that was written with them beside the results",
        "The number or the order of the steps in the results differs from the shapes that were written.";
    FeResultsSyntax = "FB327", Error, BadInput, "results of an FE program cannot be read", "write them as docs/how_to/stresses_from_calculix.md says",
        "The result file has another form than its program writes, or lacks the stresses, the steps or the places that the recovery needs.";
    NamedLoadMisfit = "FB328", Error, BadInput, "named load does not fit the model", "give one force for each matrix row, in the order of the matrices",
        "The number of forces differs from the number of rows, or a force acts on a row that is not in the model.";
    PreloadUnbalanced = "FB329", Error, BadInput, "preload is not in equilibrium by itself", "give all forces of the preload, those on both sides of each bolt, so that their resultant is zero; a load with a resultant is no preload (`preload = false`) and has a history in a scene",
        "The forces of a preload are internal and must add up to zero force and zero moment; these have a resultant.";
    // FB4xx: model
    NodesMissing = "FB401", Error, BadInput, "degrees of freedom refer to nodes without coordinates", "add the nodes to the node table",
        "The table of degrees of freedom names node numbers that the node table does not have.";
    DofCount = "FB402", Error, BadInput, "number of degrees of freedom differs from the matrix size", "give one row of dofs.csv for each matrix row; without dofs.csv there are three rows for each node",
        "The number of rows that the tables describe is not the size of the matrices.";
    DofDuplicate = "FB403", Error, BadInput, "direction of a node occurs twice", "label each matrix row with another pair (node, direction)",
        "Two matrix rows are labelled with the same direction of the same node.";
    DofIncomplete = "FB404", Error, BadInput, "displacement directions of nodes are missing, so the body cannot move rigidly", "export the matrices without supports, symmetry planes or eliminated constraints",
        "Rows of held directions were removed from the matrices, so a rigid translation of the body cannot be written in them.";
    NodesUnused = "FB406", Note, Done, "nodes without degrees of freedom were left out", "nothing to do if they are reference nodes or deleted nodes",
        "The node table has nodes that no matrix row belongs to.";
    MassNotPositive = "FB407", Error, Untrustworthy, "mass is not positive", "check densities and the matrix that was given as mass",
        "The sum of the mass matrix over a rigid translation is zero or negative.";
    MassDirectional = "FB408", Error, BadInput, "mass differs between directions, so it is not the mass of a free body", "export the mass matrix without supports and without eliminated constraints",
        "A rigid translation of a free body has the same mass in each direction. Supports, eliminated constraints or directional masses break this.";
    MassBlockStructure = "FB409", Note, Done, "part of the mass matrix does not rotate with the nodes", "nothing to do for slender beams and thin shells, whose error falls with the square of the element size to that of the rotary inertia of their sections; for a condensed model (superelement) keep more nodes",
        "The mass of a pair of nodes is not a number times the identity, as for condensed models and rotary inertia of sections; its change with rotation is then approximate.";
    RigidMotionStrained = "FB410", Error, BadInput, "rigid motion strains the body: K R is not zero", "remove supports from K, and check that rotations are labelled as rotations and that coordinates have the units and the order of the matrix; without a table of rows (dofs) the rows are taken as x, y, z of the nodes in their order",
        "A rigid motion R of the nodes must cause no force. K R is larger than rounding, so K contains supports or springs to ground, or its rows are labelled wrongly.";
    PencilSingular = "FB411", Error, BadInput, "eigenproblem is singular: rows have neither stiffness nor mass", "remove these degrees of freedom from the matrices, or hold them",
        "There are directions in which K and M are both zero, so their frequency is 0/0.";
    MassDiagonal = "FB412", Warning, Done, "mass matrix is diagonal, so it is already lumped", "export the consistent mass matrix from the FE program; below, `exact` means exact for this lumped matrix",
        "The FE program lumped the mass to the nodes before it wrote the matrix.";
    InertiaImplausible = "FB413", Warning, Done, "mass and size do not fit any material in the units of the model", "check the units in the manifest, or set them with --units",
        "Mass divided by the volume that the nodes span is outside the densities of materials: units of length, mass and time do not belong together.";
    BodiesSeveral = "FB414", Error, Untrustworthy, "matrices contain several bodies", "convert each body separately with --split, or connect the bodies",
        "The graph of the matrices falls into parts that nothing joins.";
    DiagonalNegative = "FB415", Error, Untrustworthy, "matrix has negative diagonal entries, so it cannot be positive semidefinite", "check the element that produced them",
        "A positive semidefinite matrix has no negative diagonal entry; an element with wrong orientation or a negative thickness causes one.";
    BodyDegenerate = "FB416", Error, BadInput, "nodes lie on one point or one line, so the body has no rotational inertia about it", "check the coordinates; beams need nodal rotations",
        "All nodes lie on a point or a line and have no rotations, so the rotation about the line has no inertia.";
    ModelTooSmall = "FB418", Error, BadInput, "model has no flexible degree of freedom", "a body needs more degrees of freedom than rigid motions: six in space, three in the plane",
        "After the rigid motions nothing is left that can deform.";
    DirectionOutOfPlane = "FB419", Error, BadInput, "plane model has entries out of its plane", "use z = 0 and directions 1 and 2 in a plane model, or set `dimension = 3`",
        "The model was declared plane, but a node has z other than 0 or a row has another direction than 1 and 2.";
    DampingRigid = "FB420", Warning, Done, "damping matrix resists rigid motion", "model damping to ground, or proportional to mass, in the multibody system: it acts on the motion of the whole body",
        "The damping matrix gives a force for a rigid motion, as damping to ground or proportional to mass does.";
    BodiesCoupled = "FB421", Error, BadInput, "damping or geometric stiffness couples bodies that K and M keep separate", "remove the entries between the bodies",
        "Damping or geometric stiffness has entries between nodes that neither K nor M joins.";
    RowsUnheld = "FB422", Error, BadInput, "rows without coordinates are not held by the stiffness", "add the nodes to the node table, or remove these degrees of freedom",
        "Rows belong to no node with coordinates, and K leaves them free, so no rigid motion can be assigned to them.";
    RowsWithoutPlace = "FB423", Note, Done, "rows without coordinates are internal degrees of freedom", "nothing to do for bubbles and massless connections; add the nodes to the node table if they are nodes",
        "The matrices have rows of no position, such as bubble functions or multipliers.";
    MagnitudeExtreme = "FB424", Error, BadInput, "numbers are too large or too small for products in double precision", "write the model in units that bring its numbers closer to one",
        "Products of the entries overflow or vanish in double precision.";
    NodesRounded = "FB425", Warning, Done, "node positions do not fit the stiffness to all digits", "write coordinates with 17 digits and keep the body near the origin: far from it, coordinates lose digits",
        "The rigid rotations that the coordinates give strain the stiffness a little: the coordinates were written with fewer digits than the matrix was computed with.";
    RotationsFollow = "FB427", Note, Done, "rotations without stiffness and mass follow the nodes around them", "nothing to do for shells without drilling stiffness: no frequency and no displacement depends on these rotations",
        "Rotations about the normal of a shell often have neither stiffness nor mass; they are determined from the displacements around them.";
    SoftRotationsFollow = "FB428", Warning, Done, "rotations that are held by elements that are not quite coplanar follow the nodes around them", "nothing to do for shells without drilling stiffness; --keep-soft-rotations (or keep_soft_rotations in [model]) leaves these rotations as K has them",
        "Shells without drilling stiffness give a rotation about the normal a small stiffness if their elements are not quite coplanar, as with coordinates of few digits. The elements then bend against each other as at hinges, and frequencies are several percent too low.";
    SoftRotationsEffect = "FB429", Note, Done, "frequencies without the rotations that were made to follow their elements", "nothing to do: a rotation about the normal that elements hold only because they are not quite coplanar is a hinge between them, of the mesh and not of the part",
        "The rotations of FB428 turn freely in the stiffness as read, which lowers frequencies.";
    InterfaceCoupling = "FB430", Error, BadInput, "interface cannot be coupled to its reference point", "give the interface three nodes that do not lie on one line (two in the plane), or another coupling",
        "The nodes of the interface do not determine the motion that the coupling needs, such as a rotation about the line on which they lie.";
    InterfaceShared = "FB431", Error, BadInput, "interfaces share nodes", "assign each shared node to one interface",
        "Interface motions must be independent, and a shared node would belong to two of them.";
    InterfaceFit = "FB432", Warning, Done, "interface declared rigid deforms in the modes", "convert with --basis craig-bampton (select, trade and simulate take the body file), or declare the interface averaging",
        "The modes were computed without rigid interfaces, so the nodes of the interface move relative to each other in them.";
    MassOrder = "FB433", Error, BadInput, "mass matrix couples nodes that the stiffness matrix does not: its rows are in another order, or it belongs to another mesh", "write K and M from the same analysis in the same order; --allow-implausible=FB433 (or allow_implausible = [\"FB433\"] in [model]) if the model is meant so",
        "Mass joins nodes of one element, and these are also joined by stiffness. Here many pairs have mass only.";
    MassPairs = "FB434", Warning, Done, "mass matrix couples nodes that the stiffness matrix does not", "nothing to do if the model is meant so; else write K and M in the same order",
        "A mass element, or a mass spread over several nodes, joins nodes in M that no element joins in K.";
    MassesExchanged = "FB435", Warning, Done, "masses of nodes seem to be exchanged", "write K and M in the same order of nodes",
        "Neighbouring nodes have different masses where their stiffness is alike, and the masses fit only if the two nodes are exchanged: M was written in another order of nodes than K.";
    SpeedImplausible = "FB436", Warning, Done, "speed of sound is outside the range of all known materials: stiffness, mass and lengths do not fit the units of the model", "check that density, Young's modulus and coordinates are all in the units of the manifest, or state these with --units",
        "The speed of sound that K, M and the node distances imply is that of no material.";
    DensityImplausible = "FB437", Error, BadInput, "density or speed of sound is outside the range of all known materials: the numbers do not fit the units of the model", "check the units of the manifest and of the coordinates; --allow-implausible=FB437 (or allow_implausible = [\"FB437\"] in [model]) if the density is meant",
        "Mass per volume or the speed of sound is far from all materials, as with coordinates in mm and matrices in m, or both are those of a metal in other units than the stated ones.";
    MatricesExchanged = "FB438", Error, BadInput, "stiffness and mass matrix are exchanged", "give the other file as stiffness, this one as mass",
        "The matrix given as mass vanishes for rigid motions as a stiffness does, and the other one does not.";
    InterfaceFar = "FB439", Warning, Done, "reference point of an interface is far from its nodes", "reference points are in model axes and in the unit of length of the nodes",
        "The reference point lies far outside the nodes of the interface, as with coordinates in other units or axes.";
    GeometricStiffnessMotion = "FB440", Error, BadInput, "geometric stiffness is not that of a stress: it breaks a relation with rigid motion", "give the stress stiffness alone: the difference of the stiffness matrices with and without prestress holds the stiffness of the initial displacements as well",
        "The stiffness of a stress has known products with rigid motions (docs/how_to/geometric_stiffness.md). This matrix does not have them.";
    GeometricStiffnessLoad = "FB441", Error, BadInput, "geometric stiffness is not that of the load that it is given for", "check load, axis, sign and units, and divide the matrix by the size of the load (of spin about the centre of mass or the origin of the model: by the square of the rate in radians per unit of time)",
        "Equilibrium of the stressed body relates the matrix to its load; with the given load the relation does not hold.";
    GeometricStiffnessRough = "FB442", Warning, Done, "geometric stiffness fulfils its relations with rigid motion roughly", "nothing to do where elements of reduced integration explain it; else check that the matrix holds the stress stiffness alone",
        "The relations with rigid motions hold to a few digits only, as with reduced integration or few printed digits.";
    RecoveryStrained = "FB443", Error, BadInput, "rigid motion of the body strains a recovery: its columns do not belong to the rows of the matrices", "write the operator by the rows of K and M; a row that a rigid motion may change is a `displacement` or `other`",
        "A rigid motion of the body must not change stresses, strains and section forces, and the operator gives a change.";
    RecoveryScale = "FB444", Warning, Done, "stresses of a recovery do not fit the stiffness of the model", "check the column `unit` of the rows (nothing converts values to it), and that the operator belongs to this model",
        "Stress times strain of the modes is far from their strain energy per volume.";
    RecoveryUnanswered = "FB445", Error, BadInput, "modes or static columns of the body are not combinations of the shapes of a recovery", "write shapes for this body with flexbody shapes, and run the FE program on them again",
        "The FE program answered other shapes than those from which the modes of this body can be combined.";
    RecoveryEnergy = "FB446", Error, BadInput, "FE program computes another strain energy of the shapes than K", "give the FE program the elements, materials and units that K was written with",
        "The strain energy that the FE program printed for each shape differs from v' K v / 2 by more than its digits.";
    RecoveryEnergyDiffers = "FB447", Warning, Done, "strain energy of some shapes differs between the FE program and K", "nothing to do for elements of reduced integration, springs and other elements without stresses; else compare the deck with that of K",
        "Some shapes have another strain energy in the FE program than in K.";
    RecoveryAveraged = "FB448", Warning, Done, "stresses at nodes between materials are means over the materials", "ask for stresses at integration points: flexbody shapes --at integration-points",
        "The FE program averages stresses at nodes over the elements around them, also where the material changes.";
    RecoveryMapped = "FB449", Note, Done, "recovery was computed from the answers of an FE program to shapes", "nothing to do: the misfit bounds the share of each mode that the shapes do not contain",
        "The rows of the recovery are combinations of the answers of the FE program.";
    InterfaceCentre = "FB450", Warning, Done, "reference point of an interface is not the mean of its nodes", "nothing to do if the joint belongs there; else state the point: --interface NAME=SET,COUPLING,X/Y/Z, or `reference` in [[interface]]",
        "The middle of the hole, edge or face that the nodes lie on is the reference point, and the mean of the nodes is another: the mesh is denser on one side, or the nodes are a part of the whole.";
    GeometricStiffnessDifference = "FB451", Note, Done, "geometric stiffness is the difference of two stiffness matrices", "nothing to do; with less than four digits give the stress of a larger load",
        "The matrix was computed by subtraction, in which the common digits cancel.";
    GeometricStiffnessUnstressed = "FB452", Error, BadInput, "matrix with stress is the stiffness without it", "assemble the stiffness after the stress, with the stress of a larger load",
        "The two matrices agree to nearly all digits, so the stress did not enter the second one or is too small.";
    RecoveryCorners = "FB453", Note, Done, "stresses at nodes are means over the corners of their elements", "nothing to do in a part of one material; where materials meet, request the elements of each material alone and give a recovery for each",
        "The results list the corners of elements, and several elements share a node.";
    InterfacesUncompared = "FB454", Note, Done, "interfaces of the body are not stated like this by the model that it is checked against", "state them by --interface NAME=NODES,COUPLING, or by [[interface]] in the manifest, to compare them",
        "The matrices say nothing of interfaces: they are stated beside the model, and were left out or stated differently when the body was checked.";
    SectionAbout = "FB455", Note, Done, "moments of a section are about the origin of the model", "state the point: about = [x, y, z] in its [[recovery]], in model axes",
        "The moment of the forces across a section depends on the point that it is about. Without a stated point this is the origin of the model, which need not be near the section.";
    NodeInertia = "FB456", Warning, Done, "rotary inertia of a node is that of no rigid mass", "nothing to do for a disc of which only the inertia about its axis is meant; else give all moments of inertia (a thin disc has half of that about its axis about each diameter): none is larger than the sum of the other two",
        "A moment of inertia at a node is larger than the sum of the other two, or negative. The mass is carried as it is, and the bounds that points of mass fulfil do not hold.";
    RecoveryPlane = "FB458", Note, Done, "stresses of a recovery are read as those of a plane state", "nothing to do for plane stress and membranes; of a solid give all six components",
        "Points of a recovery have the stresses xx, yy and xy, with or without zz, and none across the plane. Von Mises and principal stresses are those of a plane state.";
    RecoveryNoEquivalent = "FB459", Note, Done, "no von Mises and principal stresses are formed of stresses that look like a tensor", "name the components xx, yy, zz, xy, yz, xz (or 11, S11, sigma_xx and their like), and let the name of each row end with its component: `e1 xx`",
        "Several stresses of one place look like a tensor, but their components are not known, not complete, or not at the end of the names of the rows. The rows are used one by one, without an equivalent stress.";
    RecoveryContradicts = "FB460", Error, BadInput, "stresses of a recovery contradict the stiffness of the model under uniform strain", "check the order, signs and units of the rows (shear stresses belong to s_xy, not to twice or half of it), and that the operator belongs to this model; --allow-implausible=FB460 (or allow_implausible = [\"FB460\"] in [model]) if the rows are meant so",
        "Under uniform strain all points of a homogeneous solid have one stress, which K gives: s : E V = u'K u. The rows give another.";
    RecoveryUncompared = "FB461", Note, Done, "stresses of a recovery were not compared with the stiffness, or only along other axes", "nothing to do; compare stresses under one load with those of the FE program",
        "Under uniform strain K is not that of a homogeneous solid, a point lacks components, or its stresses are along axes of elements.";
    ElementsUnproved = "FB462", Error, BadInput, "the stiffness of the elements in the deck is not K, or not known", "give the deck that K was written with, unchanged; or take stress and its stiffness from the FE program: `flexbody shapes`, and [[geometric_stiffness]] of the manifest",
        "Stress and stress stiffness are computed from the elements of the deck only if their assembled stiffness is K, entry by entry. It is not, or some elements, materials or constraints of the deck are not read.";
    // FB5xx: numerics
    NotConverged = "FB501", Error, Untrustworthy, "eigen-solver did not converge", "ask for fewer modes or a lower accuracy; look for extreme stiffness contrasts",
        "The residuals of some modes stay above the accuracy after the largest number of restarts.";
    Mechanism = "FB502", Error, Untrustworthy, "more zero-energy modes than rigid motions: a mechanism or loosely connected bodies", "connect the parts or remove the free degree of freedom",
        "Parts move without strain: a missing connection, a hinge, or a node that no element holds.";
    MassIndefinite = "FB503", Error, Untrustworthy, "mass matrix is indefinite", "negative lumped masses or wrong signs: export the consistent mass",
        "Some motion has negative kinetic energy.";
    StiffnessIndefinite = "FB504", Error, Untrustworthy, "stiffness matrix is indefinite", "check for negative springs, prestress beyond buckling, wrong signs",
        "Some motion has negative strain energy.";
    FactorizationFailed = "FB505", Error, Untrustworthy, "factorisation failed or is inaccurate", "check units and stiffness contrasts: the model may be badly scaled",
        "The factor of K - sigma M does not reproduce the matrix to the needed digits.";
    CompletenessFailed = "FB506", Error, Untrustworthy, "completeness proof failed: the inertia count differs from the number of modes found", "report the model to the developers",
        "The number of negative pivots of K - sigma M counts the eigenvalues below sigma, and another number was found.";
    CompletenessUnproved = "FB507", Warning, Done, "completeness of the modes is not proved", "use --accuracy standard",
        "No factor was made, or it is too inaccurate to count eigenvalues.";
    RepeatedSplit = "FB508", Warning, Done, "last mode belongs to a repeated eigenvalue whose other modes were left out", "ask for the number of modes in the note to keep the symmetry of the body",
        "Symmetric bodies have several modes of one frequency, and the requested number ends among them.";
    ModesClamped = "FB509", Note, Done, "fewer modes exist than requested", "nothing to do",
        "A model with n rows has fewer than n flexible modes; rigid motions and rows without mass have none.";
    NoiseFloor = "FB510", Warning, Done, "digits of the input limit the accuracy of the lowest modes", "write the matrices with 17 significant digits",
        "Rounded entries of K give rigid motions a small stiffness; frequencies near it have few correct digits.";
    MassMatrixSingular = "FB511", Note, Done, "mass matrix is singular: fewer finite modes than degrees of freedom", "nothing to do: common with reduced integration",
        "Some motions have no mass (reduced integration, multipliers), so their frequency is infinite.";
    NoModes = "FB512", Error, BadInput, "no flexible mode below the requested frequency", "raise --max-frequency",
        "The lowest flexible frequency of the body is above the limit that was asked for.";
    FactorPrecision = "FB513", Note, Done, "precision of the factorisation that was chosen automatically", "nothing to do: --factor f64 or f32 sets it",
        "Single precision needs half the memory; the program chooses it if its accuracy is enough for the modes.";
    DampingIndefinite = "FB514", Error, Untrustworthy, "modal damping is not positive semidefinite or not finite", "check the signs and the units of the damping: damping must not add energy",
        "Some motion would gain energy from the damping, or a value is not finite.";
    ModesOverdamped = "FB515", Warning, Done, "modes are overdamped", "nothing to do if intended; otherwise check the units: a ratio of 2 % is 0.02, alpha is in 1/time, beta in time, D in mass/time",
        "The damping ratio of some modes is above 1, so they do not oscillate.";
    ShapesNone = "FB520", Error, BadInput, "no shape deforms the body", "give shapes that are not rigid motions",
        "All given shapes are rigid motions or zero after these are removed.";
    ShapesDependent = "FB521", Warning, Done, "shapes that depend linearly on the others were left out", "nothing to do if expected",
        "A shape is a combination of the others up to rounding, so it adds no motion.";
    ShapesRigid = "FB522", Note, Done, "rigid-body motions were removed from the shapes; the body frame performs them", "nothing to do: no motion is lost",
        "Given shapes contained translation or rotation of the whole body, which the body frame performs.";
    ShapesSpan = "FB523", Warning, Done, "modes of the given subspace are not eigenvectors", "nothing to do for static shapes; otherwise compute the modes more accurately, or write all their digits",
        "The given shapes span a subspace that K does not map into M times itself.";
    LoadsCovered = "FB524", Note, Done, "static responses that the basis already contains were left out", "nothing to do: other modes contain them",
        "The static response to a load is a combination of modes that are already there.";
    FreeFrequencies = "FB525", Note, Done, "frequencies of the Craig-Bampton body that differ from the free body by more than 1 %", "use more fixed-interface modes (--modes, --max-frequency) if higher frequencies matter",
        "Fixed-interface and constraint modes approximate the modes of the free body; the highest ones have the largest errors.";
    InterfaceCompliance = "FB526", Note, Done, "modes do not contain the whole static compliance at the interfaces", "convert with --basis craig-bampton or --residual-vectors interfaces, which contain it",
        "A force at an interface also deforms the body in the modes that were left out.";
    GeometricStiffnessNone = "FB530", Warning, Done, "no geometric stiffness: the body softens under spin where a real one stiffens", "give [[geometric_stiffness]] for spin, or keep to spin rates far below the value in the message",
        "Centrifugal forces stretch the body and so stiffen it; without this stiffness the equations keep the softening part only.";
    GeometricStiffnessPartial = "FB531", Note, Done, "geometric stiffness is given for some directions of a load only", "nothing to do if the load does not act in the other directions",
        "A load has up to three directions, and each needs a matrix of its own.";
    SimulationStopped = "FB540", Error, Untrustworthy, "simulation stopped", "check spin, loads and dropped terms: the motion leaves the range of the model",
        "The integration found no step that meets its tolerances, or the motion grew beyond what the model describes.";
    LinearRangeLeft = "FB541", Warning, Done, "deflections beyond the range of linear elasticity", "trust the result as a trend only; a body of several flexible parts carries larger deflections",
        "A node is deflected by a large part of the size of the body, and modes describe small deformations only.";
    SpinSoftens = "FB542", Warning, Done, "the stress of the spin changes the stiffness, and the body does not have it", "give the geometric stiffness of spin (convert --geometric-stiffness spin, or [[geometric_stiffness]]: docs/how_to/geometric_stiffness.md), and do not switch it off in [run]",
        "A second run with an estimate of the stress stiffness of the spin differs from the first by more than a third of the tolerances: its errors relative to a body without it say nothing about the part.";
    PhaseDrifts = "FB543", Warning, Done, "errors grow with time although amplitudes are bounded", "check a run of the longest duration that the model is meant for: phases drift apart with angular velocity times duration",
        "A small error of the angular velocity adds up to a growing error of the angle.";
    ResonanceDropped = "FB544", Warning, Done, "dropped mode is near the frequency of a load", "keep the mode, or lengthen the run until the resonance would show",
        "A load oscillates near the frequency of a mode that the selection drops; the run is too short to show its growth.";
    LoadIdle = "FB545", Warning, Done, "load has no effect", "let an interface carry the body to see gravity and inertia bend it: [carried] in docs/reference/scenes.md",
        "A free body falls with gravity and moves with its base without deformation, or the load acts on a mode that is not there.";
    CarrierUnresolved = "FB546", Warning, Done, "modes resolve the carried interface poorly", "convert with --basis craig-bampton, or with --residual-vectors interfaces, and with the interface in the manifest",
        "The motion of the carried interface is a combination of modes, and the modes leave out much of its compliance.";
    CarriedGeometricStiffness = "FB547", Warning, Done, "geometric stiffness does not act while the body is carried", "convert the model again: the file is of a version before 1.10 or comes from another program; without it trust spin rates far below the first frequency only",
        "A carrier that moves in the modes needs the geometric stiffness of rigid rotations, which the file lacks.";
    ReferenceIncomplete = "FB548", Warning, Done, "error of the reference body relative to the model uses more of the tolerances than intended", "convert more modes, or residual vectors for the loads; a shorter or slower scene shows where the difference comes from",
        "The modes of the reference are themselves truncated, and their error is not small against the tolerances.";
    LumpedWithoutBody = "FB549", Note, Done, "no body can be computed with a lumped mass, so it is missing in the comparison", "nothing to do: a program that lumps the mass in this way cannot compute the body either",
        "The lumped mass is indefinite or has zero inertia, so no equations of motion exist.";
    RunTooLong = "FB550", Error, BadInput, "run takes more steps than allowed", "simulate a shorter `duration`, leave out modes beyond the frequencies of the loads, or raise `most_steps` in [run]",
        "The highest frequency determines the step, and the duration asks for more steps than the limit.";
    StepPassesOver = "FB551", Error, BadInput, "steps are longer than the oscillations of a load", "give a shorter `step`, or none",
        "The given step is so long that only few steps fall on an oscillation of a load or of the spin, which would then be seen as a slower one.";
    MotionWithoutBasis = "FB552", Note, Done, "no small number of shapes represents the motion", "nothing to do: the body has the modes of a conversion without --basis scene",
        "The shapes that represent the simulated motion within the tolerances are not fewer than the modes, or the body from which they would be computed is itself too inaccurate.";
    RecoveryLoadUnseen = "FB553", Warning, Done, "recoveries have no columns for a load", "define an interface with a reference point where the load acts (any coupling but `free`), convert again, and let the load act there",
        "The modes leave out the static response next to a load, and the file has no static column for this place.";
    RateUnsettled = "FB554", Warning, Done, "angular velocity still changes with the step size of the integration", "give a smaller `tolerance` (or a shorter `step`) in [run] until the angular velocity no longer changes",
        "Halving the step changes the angular velocity by more than the tolerances allow.";
    VariationStops = "FB555", Note, Done, "standard variation cannot be simulated and judges nothing", "state what may vary in [[variation]]; nothing to do if the load cannot turn so far",
        "The load of a standard variation (a turned load, another rate) leaves the range of the model.";
    RecoveryLeftOut = "FB556", Note, Done, "recovery of displacements is left out of a motion in another frame", "convert with a frame at the centre of mass, or watch the nodes in the scene ([[watch]]): displacements of a recovery are relative to the frame of the body in its file",
        "Displacements are relative to a frame, and the motion was computed in another one.";
    SelectionUnjudged = "FB557", Error, CheckFailed, "body does not meet the tolerances of the scene, or this cannot be judged", "convert more modes, or residual vectors for the loads of the scene; --allow-unjudged writes the body nevertheless",
        "The largest error of the body in the scene is above a tolerance, or no reference could be computed.";
    RecoveryUnjudged = "FB561", Note, Done, "truncation error of a recovery is not known", "give the recovery by an operator (`operator` in [[recovery]]); or make a body of more shapes and compare",
        "A recovery of answered shapes knows the stresses of these shapes only, not of what was truncated.";
    VariationFails = "FB559", Warning, Done, "recommended body does not hold in a variation of the scene", "make the variation a [[case]] of the scene, so that the body is made for it as well; or leave out a [[variation]] that cannot occur",
        "The body was selected for the scene as it is, and a variation of it excites what was dropped.";
    PreloadReleased = "FB562", Warning, Done, "body starts undeformed under a preload and vibrates", "start in the equilibrium of the preload: deformation = \"static\" in [initial]",
        "The run starts undeformed, so the preload acts as a sudden load.";
    RecoveryMotionUnknown = "FB564", Warning, Done, "run lacks columns that forces of motion in the recoveries depend on", "write the columns that the message names to the table of the run: `simulate --csv` writes all of them",
        "Rows with static columns of damping forces or of the inertia of the deformation depend on rates of the motion, which a run may not have; the rows are then those of modes, loads and spin.";
    InertiaIndefinite = "FB560", Warning, Done, "W3 is kept without W2, and deflections make the inertia indefinite", "keep W2 as well (--terms W2,W3 or all), unless joints prescribe the rotation or the deflections stay far below the value in the message",
        "W3 has a first-order term whose second-order partner W2 is missing; for large deflections the mass matrix is then no longer positive.";
    StressAtInterface = "FB563", Note, Done, "largest stress is at a rigid interface", "judge the part by the largest value away from the interface, or model the joint: coupling = \"averaging\" lets the interface deform",
        "A rigid interface does not deform, so that stresses concentrate at its edge: their size depends on the coupling and the mesh, not on the part.";
    CouplingEffect = "FB558", Note, Done, "effect of rigid interfaces that the body and its reference model share", "nothing to do where a stiff part is mounted at the interface; otherwise set coupling = \"averaging\", which lets the interface deform",
        "A rigid interface stiffens the body, and the reference has the same interface, so no comparison shows the effect.";
    // FB6xx: resources; FB603 stays unused (checkpoints of earlier versions)
    MemoryShort = "FB601", Error, Resources, "not enough memory", "ask for fewer modes, or use a larger machine",
        "The factor, the modes or the matrices need more memory than the machine or the limit has.";
    DiskShort = "FB602", Error, Resources, "not enough disk space", "free some space",
        "The output is larger than the free space.";
    WorkLong = "FB604", Error, BadInput, "work would take very long", "ask for less, or use --allow-long",
        "The estimated number of operations is far above what is usually meant, as for many pairs of modes.";
    Stopped = "FB605", Error, Interrupted, "computation was stopped", "nothing to do: the caller stopped it",
        "The caller (a callback of Python or of the library) asked to stop.";
    Forked = "FB606", Error, Resources, "forked process has no worker threads", "start processes by `spawn` or `forkserver`, or fork before the first computation",
        "Threads do not survive a fork, so a forked child has no workers.";
    // FB7xx: flex-body files; FB705 and FB708 to FB711 stay unused (earlier versions)
    BodyUnreadable = "FB701", Error, BadInput, "not a flex-body file", "give a file written by flexbody convert",
        "The file is not HDF5, or has no attribute that marks a flex-body file.";
    BodyVersion = "FB702", Error, BadInput, "flex-body file of a newer format", "read it with the flexbody version named in the file",
        "The file states a format version that is newer than this program knows.";
    BodySchema = "FB703", Error, CheckFailed, "flex-body file breaks its schema", "convert the model again",
        "An entry is missing, or has another type or size than the schema states.";
    BodyIdentity = "FB704", Error, CheckFailed, "identity violated", "convert the model again; if the error persists, report the file to the developers",
        "Numbers of the file contradict each other (theory section 10): one of them was changed or computed wrongly.";
    BodySourceChanged = "FB706", Warning, Done, "input file differs from the one the body was made of", "convert the model again",
        "The digest of an input file is not the one that the body file recorded.";
    BodyIncomparable = "FB707", Error, BadInput, "flexible bodies cannot be compared", "give two bodies (or a body and its model) with the same nodes, dimension and units; compare --common takes bodies with different numbers of modes",
        "The bodies differ in dimension, units, numbers of modes, nodes or rows, or have no modes in common.";
    BodyChanged = "FB712", Error, CheckFailed, "content of a flex-body file changed since it was written", "take the file as it was written, or convert the model again; docs/reference/file_format.md says how a program that changes files states new digests",
        "The digest in the file is not that of its content: another program changed it, or the medium did.";
    BodyWithoutDigest = "FB713", Note, Done, "flex-body file has no digest, so changes since it was written cannot be detected", "convert the model again to get a digest",
        "The file was written by an early version or by another program.";
    BodyUntrustworthy = "FB714", Error, Untrustworthy, "body violates conditions that hold for every body; nothing was written", "ask for fewer modes, and look for weakly joined parts and implausible masses; if the error persists, report the model to the developers",
        "The identities of theory section 10 fail for the new body by more than rounding, as for extreme stiffness contrasts.";
    WarningsDenied = "FB715", Error, CheckFailed, "warnings are treated as errors", "resolve the warnings, or leave out --deny-warnings",
        "--deny-warnings was given, and a warning arose.";
    ForeignRounded = "FB716", Warning, Done, "inertia data in a file of another program have few digits", "write the file with 17 significant digits, and from one mass matrix; flexbody audit gives details",
        "The numbers agree with each other to few digits only.";
    ExportLoses = "FB720", Error, BadInput, "format cannot hold the whole body", "export to a format that holds it (docs/reference/exports.md), or write the file without it by --allow-loss",
        "The body holds data that change its motion and that the file format has no place for.";
    ExportLost = "FB721", Warning, Done, "exported file does not hold all data of the body", "give --scene SCENE to measure the effect in your motion; if it matters, export to a format that holds it (docs/reference/exports.md)",
        "The body holds data that the file format has no place for.";
    ExportNeeds = "FB722", Note, Done, "program uses a part of the file only with a setting", "make the setting named in the message in the input of the program",
        "The program reads a part of the file only if its input asks for it.";
    ExportPicture = "FB723", Note, Done, "file is a picture of the body", "use another format for multibody programs: docs/reference/exports.md lists them",
        "VTK and glTF hold shapes and surfaces, but no inertia.";
    ExportRecoveries = "FB724", Note, Done, "exported file has not all of the recoveries", "compute them from a run of the program: flexbody recover",
        "The format has no place for some rows of the recoveries.";
    ExportNumbers = "FB725", Note, Done, "interfaces have numbers instead of names in the exported file", "join them by these numbers in the model of the program",
        "The format names places by numbers only.";
    ForeignUnreadable = "FB730", Error, BadInput, "flexible-body file of another program cannot be read", "give a SID_FEM, MBDyn .fem, MBSim or Exudyn file as the program writes it",
        "The content does not follow the layout of the format.";
    ForeignIncomplete = "FB731", Error, BadInput, "data that a body needs are missing in the file", "write the file again with the missing data",
        "The format allows files without the arrays that the equations of motion need.";
    ForeignChanged = "FB732", Note, Done, "modes of the file are not normalised or contain rigid motions; combinations of them were used", "nothing to do: the motion of the nodes is unchanged, the modal coordinates differ",
        "The equations need modes that are orthonormal in M and free of rigid motion.";
    ForeignDropped = "FB733", Warning, Done, "terms of the kinetic energy are missing in the file, and therefore in the body", "use a format that holds them",
        "The file has no arrays for these terms, or they are empty.";
    MotionUnreadable = "FB734", Error, BadInput, "file is not a simulation result, or it is damaged", "give the file that flexbody simulate -o writes",
        "The file has no recorded motion, or its arrays do not fit each other.";
    MotionForeign = "FB735", Error, BadInput, "simulation result belongs to another body", "simulate this body, or give the body that was simulated",
        "The digest of the body in the simulation result is not that of this body.";
    AuditIdentity = "FB740", Error, CheckFailed, "identity of inertia data violated", "write the file again with the program that made it, or with flexbody export",
        "Arrays of the file contradict a relation that holds for every body.";
    AuditLumped = "FB741", Error, CheckFailed, "inertia comes from lumped masses", "condense the consistent mass matrix: flexbody convert",
        "The invariants are those of nodal masses, as programs compute them that do not know the consistent mass matrix.";
    AuditLayout = "FB742", Error, CheckFailed, "arrays are stored in another order than the dialect prescribes", "name the dialect to the reading program, or write the file again with flexbody export",
        "Programs of one format order rows and columns differently, and the file fits another order better.";
    AuditDigits = "FB743", Error, CheckFailed, "digits were lost in writing", "write with 17 significant digits and exponents",
        "Numbers were printed with few digits or without exponents, so small ones became zero.";
    AuditUnits = "FB744", Error, CheckFailed, "numbers do not fit each other: units are mixed", "write masses, lengths and times in one system of units",
        "Ratios of the numbers fit if one group of them is scaled by a factor between units.";
    AuditCoupling = "FB745", Error, CheckFailed, "coupling of rigid and flexible motion is missing", "write the inertia couplings too",
        "The arrays that couple modes with translation and rotation are zero or absent.";
    AuditImplausible = "FB746", Error, CheckFailed, "numbers cannot be those of a body", "check the input that the file was made from",
        "A mass, an inertia or a frequency is negative, not finite or far outside every body.";
    AuditSurplus = "FB747", Error, CheckFailed, "file has more numbers than its header says", "correct the counts in the header, or remove the surplus",
        "Further numbers follow after the last one that the header announces.";
    AuditFrame = "FB748", Error, CheckFailed, "axes of a frame are not a rotation", "write right-handed orthonormal axes",
        "The three axes are not orthonormal or are left-handed.";
    ForeignUnsound = "FB749", Error, BadInput, "file contradicts conditions that every body fulfils", "run flexbody audit on the file for details, and write the file again",
        "Mass, inertia or stiffness of the file cannot be those of a body.";
    ClusterUnreadable = "FB760", Error, BadInput, "folder was not made by flexbody prepare, or is damaged", "prepare the folder again, or name the prepared folder",
        "A file of the prepared folder is missing or is not as `prepare` writes it.";
    ClusterChanged = "FB761", Error, CheckFailed, "file of a cluster changed since it was written", "copy the folder again from the cluster, or run the driver again",
        "The digest of a file is not the one recorded when it was written, as after an incomplete copy.";
    ClusterForeign = "FB762", Error, BadInput, "cluster result belongs to another model", "name the model that was prepared, or prepare this model and run the driver",
        "The digest of the matrices in the result is not that of the model.";
    ClusterUnfinished = "FB763", Error, BadInput, "cluster has no result yet", "run the driver; it continues from the saved modes",
        "The driver has not ended yet, or ended before it wrote its result.";
    ClusterInaccurate = "FB764", Error, Untrustworthy, "modes from the cluster are not modes of the model", "run the driver again, with --solver mumps if another solver was used",
        "The residuals of the modes, computed again with the matrices of the model, are too large.";
    CompletenessElsewhere = "FB765", Note, Done, "completeness relies on the count of another program", "use flexbody assemble --prove to count with flexbody",
        "The count of eigenvalues was made by the program on the cluster and not again here.";
    EngineMissing = "FB766", Error, BadInput, "MPI, PETSc or SLEPc not found", "install them (docs/how_to/cluster.md), name them with --mpiexec and --python, or use --engine built-in",
        "No MPI start program, or no Python with petsc4py and slepc4py, was found.";
    EngineFailed = "FB767", Error, Untrustworthy, "MPI solver ended without a result", "run the same command again: it continues from the saved modes",
        "The MPI processes ended with an error or were killed, often for memory.";
    BatchSyntax = "FB770", Error, BadInput, "list of bodies cannot be read", "see docs/how_to/batch.md for the keys",
        "The list is not TOML, or has an unknown, missing or mistyped key.";
    BatchFailed = "FB771", Error, CheckFailed, "bodies of a batch failed", "see the message of each body; the other bodies were written, and a second run makes the missing ones only",
        "At least one body of the list ended with an error.";
    // FB8xx: usage
    Usage = "FB801", Error, BadInput, "command line not understood", "see flexbody help",
        "A command, an option or a value is unknown or missing, or options exclude each other.";
    LumpedScheme = "FB802", Error, BadInput, "unknown lumping scheme", "use row-sum, diagonal-scaling, user=FILE or none",
        "The name of the lumping scheme is not in the list.";
    LumpedMassTable = "FB803", Error, BadInput, "nodal masses cannot be used", "give a table with the header `node,mass` and one finite mass for each node",
        "A node has no mass, two masses, or a mass that is not finite.";
    Argument = "FB804", Error, BadInput, "argument of a function is not possible", "give the argument as the documentation of the function describes it",
        "A function of the library was called with a value outside its range.";
    Internal = "FB999", Error, Bug, "internal error", "report this bug of flexbody with the input",
        "The program found its own data in a state that must not occur.";
}
