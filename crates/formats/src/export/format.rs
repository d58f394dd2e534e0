//! Trait of export formats, the options and results of an export, and its checklist: every property of a body, and its
//! holding by the file.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_body::flex_body::FlexBody;
use flexbody_file::RecordedMotion;
use flexbody_motion::scene::FrameMotion;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// A format that other programs read.
pub trait ExportFormat: Sync {
    /// Returns the name on the command line.
    fn name(&self) -> &'static str;

    /// Returns the programs that read the format, in a few words.
    fn reader(&self) -> &'static str;

    /// Returns further names of the format: programs that read no other format of this registry, in lowercase.
    fn other_names(&self) -> &'static [&'static str] {
        &[]
    }

    /// Returns the dialects of the format, the default first; empty for a format with a single form.
    fn dialects(&self) -> &'static [&'static str] {
        &[]
    }

    /// Returns true if the places of the body in the file can be chosen ([`ExportOptions::points`]).
    fn has_points(&self) -> bool {
        false
    }

    /// Returns true if the file is a picture of the body: the number of modes can be chosen, motions can be
    /// played, and no program computes with the file.
    fn is_picture(&self) -> bool {
        false
    }

    /// Returns the holding of every property of `body` with these options.
    fn checklist(&self, body: &FlexBody, options: &ExportOptions) -> ExportChecklist;

    /// Returns the settings that the reading program needs to use all of the file; without them a part is
    /// ignored. Each entry is a sentence without a full stop.
    fn needs(&self, _body: &FlexBody, _options: &ExportOptions) -> Vec<String> {
        Vec::new()
    }

    /// Returns the interfaces that the file has numbers instead of names for, with these numbers.
    fn interface_numbers(&self, _body: &FlexBody, _options: &ExportOptions) -> Vec<(String, i64)> {
        Vec::new()
    }

    /// Returns the properties of the body that a picture leaves out with these options, as sentences without
    /// a full stop.
    fn leaves_out(&self, _body: &FlexBody, _options: &ExportOptions) -> Vec<String> {
        Vec::new()
    }

    /// Returns the contents of the file. The options are valid for the format; for a picture of a motion the
    /// body is in the frame of the motion.
    ///
    /// # Errors
    /// [`ExportLoses`](flexbody_base::diagnostic::Code::ExportLoses) for a body that no file of this format
    /// can represent.
    fn write(&self, body: &FlexBody, options: &ExportOptions) -> Result<Exported>;
}

/// Options of an export. [`export`](crate::export()) rejects options that a format does not have.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ExportOptions {
    /// Dialect of the format, one of [`ExportFormat::dialects`]; `None` for the default.
    pub dialect: Option<String>,
    /// Places of the body in the file.
    pub points: Points,
    /// Number of modes in a picture, from the first; `None` for the default of the format.
    pub modes: Option<usize>,
    /// Motion shown in a picture instead of modes; `None` for modes.
    pub motion: Option<RecordedMotion>,
    /// Name of the main file, for formats whose main file refers to further files.
    pub name: Option<PathBuf>,
    /// Motion in the load cases of a scene, for which the error of a loss is stated; empty without a scene.
    pub in_scene: Vec<FrameMotion>,
}

/// Selection of the places of the body in a file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Points {
    /// Default of the format: all nodes, or for a format with frames the interfaces if the body has some.
    #[default]
    Usual,
    /// All nodes.
    Nodes,
    /// Reference points of the interfaces, and the nodes of free interfaces.
    Interfaces,
    /// Places of the interfaces, and the nodes with these numbers.
    InterfacesAnd(Vec<i64>),
    /// Nodes with these numbers.
    Some(Vec<i64>),
}

impl FromStr for Points {
    type Err = Diagnostic;

    /// Parses the points: `nodes`, `interfaces`, node numbers with commas, or `interfaces` and node numbers.
    fn from_str(text: &str) -> std::result::Result<Self, Diagnostic> {
        match text {
            "nodes" => return Ok(Self::Nodes),
            "interfaces" => return Ok(Self::Interfaces),
            _ => {}
        }
        let (numbers, points): (&str, fn(Vec<i64>) -> Self) = match text.strip_prefix("interfaces,") {
            Some(numbers) => (numbers, Self::InterfacesAnd),
            None => (text, Self::Some),
        };
        let numbers: Option<Vec<i64>> = numbers.split(',').map(|number| number.trim().parse().ok()).collect();
        numbers.map(points).ok_or_else(|| {
            let message = format!("`{text}` is not a set of points of the body");
            Diagnostic::new(Code::Usage, message)
                .with_help("give nodes, interfaces, node numbers with commas, or both as in interfaces,17,23")
        })
    }
}

impl Points {
    /// Returns true for a selection of the interfaces, with or without further nodes.
    pub fn of_interfaces(&self) -> bool {
        matches!(self, Self::Interfaces | Self::InterfacesAnd(_))
    }

    /// Returns the numbers of nodes that are selected individually.
    pub fn named(&self) -> &[i64] {
        match self {
            Self::Some(ids) | Self::InterfacesAnd(ids) => ids,
            Self::Usual | Self::Nodes | Self::Interfaces => &[],
        }
    }
}

/// Result of an export: the main file and accompanying files.
#[derive(Debug, Clone, PartialEq)]
pub struct Exported {
    /// Bytes of the main file.
    pub file: Vec<u8>,
    /// Accompanying files, each with the suffix that replaces the extension of the main file: `M.mtx` gives
    /// `body.M.mtx` for `body.csv`, `_exudyn.py` gives `body_exudyn.py` for `body.hdf5`.
    pub beside: Vec<(Cow<'static, str>, Vec<u8>)>,
}

impl Exported {
    /// Returns the path of an accompanying file from its suffix.
    pub fn place_beside(file: &Path, ending: &str) -> PathBuf {
        match (ending.strip_prefix('_'), file.file_stem()) {
            (Some(_), Some(stem)) => {
                let mut name = stem.to_owned();
                name.push(ending);
                file.with_file_name(name)
            }
            _ => file.with_extension(ending),
        }
    }

    /// Fills `slot` with the main file and a new slot with each of the other files. The files appear together
    /// when all slots are committed.
    ///
    /// # Errors
    /// FB104 or FB602 if a file cannot be written.
    pub fn fill(&self, slot: OutputSlot) -> Result<Vec<OutputSlot>> {
        slot.fill(&self.file)?;
        let mut slots = vec![slot];
        for (ending, bytes) in &self.beside {
            let other = OutputSlot::prepare(Self::place_beside(slots[0].path(), ending))?;
            other.fill(bytes)?;
            slots.push(other);
        }
        Ok(slots)
    }

    /// Returns an export of a single file.
    pub fn single(file: Vec<u8>) -> Self {
        Self { file, beside: Vec::new() }
    }
}

/// Holding of one property of a body by an export.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Holding {
    /// The file holds the property.
    Held,
    /// The file does not hold a property of the body. The text completes the sentence "FORMAT cannot hold
    /// ...".
    Lost(String),
    /// The file does not hold a property whose effect is small, or grows with a motion that no scene states: a
    /// warning, unless the user names the losses that are allowed. The text is that of [`Holding::Lost`].
    Slight(String),
    /// The body does not have the property, or the readers of the format do not use it; nothing is reported.
    NotApplicable,
}

impl Holding {
    /// Returns [`Lost`](Self::Lost) with the text, or [`Held`](Self::Held) without a text.
    pub(crate) fn held_but_for(lost: Option<String>) -> Self {
        lost.map_or(Self::Held, Self::Lost)
    }

    /// Returns the loss of the property with this name, if there is one.
    fn lost(self, property: &'static str) -> Option<Loss> {
        match self {
            Self::Lost(text) => Some(Loss { property, text, is_slight: false }),
            Self::Slight(text) => Some(Loss { property, text, is_slight: true }),
            Self::Held | Self::NotApplicable => None,
        }
    }
}

/// Holdings of all properties of a body, in the order in which losses are reported. The type has no default,
/// so that a new property compiles only after every format has stated its holding, by itself or with formats
/// of the same contents. The origin and proof of the numbers (certificate, lumped comparators, fingerprints
/// of the inputs) are in the flex-body file alone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExportChecklist {
    /// Coupling of rigid motion and modes in the kinetic energy.
    pub rigid_coupling: Holding,
    /// Restriction of a plane body to its plane.
    pub plane: Holding,
    /// Inertia of the deformed body (W1, W2, W3).
    pub deformed_inertia: Holding,
    /// W0 of a mass that does not commute with rotations.
    pub general_w0: Holding,
    /// Coriolis force of modes that move the centre of mass, on the frame.
    pub coriolis_force: Holding,
    /// W3 with its symmetric part.
    pub general_w3: Holding,
    /// W2 apart from the modal mass.
    pub separate_w2: Holding,
    /// Geometric stiffness.
    pub geometric_stiffness: Holding,
    /// Stiffness of inertia of rotating nodes.
    pub inertia_stiffness: Holding,
    /// Damping of the modes.
    pub damping: Holding,
    /// Displacements of nodes or frames in the modes.
    pub shapes: Holding,
    /// Rotations of nodes or frames in the modes.
    pub rotations: Holding,
    /// Rows of the modes that belong to no node.
    pub internal_rows: Holding,
    /// Point of action of gravity on the deformed body.
    pub gravity: Holding,
    /// Positions of the interfaces.
    pub interfaces: Holding,
    /// Surface for drawing the body.
    pub surface: Holding,
    /// Origin of each mode (free mode, residual vector, ...).
    pub origins_of_modes: Holding,
    /// Units of the numbers.
    pub units: Holding,
    /// Storage of large arrays in 32-bit floats.
    pub storage: Holding,
    /// Named loads, and preloads among them.
    pub named_loads: Holding,
    /// Recoveries. A loss is a note, whatever is allowed, since `recover` computes them from a run of any program; its
    /// text completes "the file ...".
    pub recoveries: Holding,
}

impl ExportChecklist {
    /// Returns what the file lacks of the recoveries, as completion of "the file ..."; `None` if it lacks nothing.
    pub fn left_out_recoveries(&self) -> Option<&str> {
        match &self.recoveries {
            Holding::Lost(text) | Holding::Slight(text) => Some(text),
            Holding::Held | Holding::NotApplicable => None,
        }
    }

    /// Returns the losses, the most important first.
    pub fn losses(self) -> Vec<Loss> {
        let all = [
            ("rigid-coupling", self.rigid_coupling),
            ("plane", self.plane),
            ("deformed-inertia", self.deformed_inertia),
            ("general-w0", self.general_w0),
            ("coriolis-force", self.coriolis_force),
            ("general-w3", self.general_w3),
            ("separate-w2", self.separate_w2),
            ("geometric-stiffness", self.geometric_stiffness),
            ("inertia-stiffness", self.inertia_stiffness),
            ("damping", self.damping),
            ("shapes", self.shapes),
            ("rotations", self.rotations),
            ("internal-rows", self.internal_rows),
            ("gravity", self.gravity),
            ("interfaces", self.interfaces),
            ("surface", self.surface),
            ("origins-of-modes", self.origins_of_modes),
            ("units", self.units),
            ("storage", self.storage),
            ("named-loads", self.named_loads),
        ];
        all.into_iter().filter_map(|(name, holding)| holding.lost(name)).collect()
    }
}

/// Property of a body that a format cannot hold.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Loss {
    /// Name of the property, one of [`Loss::PROPERTIES`].
    pub property: &'static str,
    /// Completion of "FORMAT cannot hold ...".
    pub text: String,
    /// True if the loss is allowed unless the user names others ([`Holding::Slight`]).
    pub is_slight: bool,
}

impl Loss {
    /// Names of all properties that may be lost.
    pub const PROPERTIES: [&'static str; 20] = [
        "rigid-coupling",
        "plane",
        "deformed-inertia",
        "general-w0",
        "coriolis-force",
        "general-w3",
        "separate-w2",
        "geometric-stiffness",
        "inertia-stiffness",
        "damping",
        "shapes",
        "rotations",
        "internal-rows",
        "gravity",
        "interfaces",
        "surface",
        "origins-of-modes",
        "units",
        "storage",
        "named-loads",
    ];
}

/// Losses with which a body may be exported.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum AllowedLosses {
    /// Slight losses only.
    #[default]
    None,
    /// Losses of the properties with these names.
    Named(Vec<String>),
    /// Any loss.
    All,
}

impl From<bool> for AllowedLosses {
    /// Returns any loss for true, slight losses for false.
    fn from(any: bool) -> Self {
        if any { Self::All } else { Self::None }
    }
}

impl AllowedLosses {
    /// Creates the losses from names.
    ///
    /// # Errors
    /// [`Usage`](Code::Usage) for a name that is none of [`Loss::PROPERTIES`].
    pub fn named(names: Vec<String>) -> Result<Self> {
        match names.iter().find(|name| !Loss::PROPERTIES.contains(&name.as_str())) {
            Some(unknown) => {
                let message = format!("`{unknown}` is no property that a format may lose");
                Err(Diagnostic::new(Code::Usage, message).with_help(Loss::PROPERTIES.join(", ")).into())
            }
            None => Ok(Self::Named(names)),
        }
    }

    /// Returns true if the loss is allowed.
    pub(crate) fn allow(&self, loss: &Loss) -> bool {
        match self {
            Self::None => loss.is_slight,
            Self::Named(names) => names.iter().any(|name| name == loss.property),
            Self::All => true,
        }
    }
}
