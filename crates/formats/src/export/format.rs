//! What a format is that other programs read.

use super::ExportChecklist;
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_body::flex_body::FlexBody;
use flexbody_file::RecordedMotion;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// A format that other programs read.
pub trait ExportFormat: Sync {
    /// Name on the command line.
    fn name(&self) -> &'static str;

    /// Programs that read the format, in a few words.
    fn reader(&self) -> &'static str;

    /// Variants of the format, the usual one first; empty where there is a single one.
    fn dialects(&self) -> &'static [&'static str] {
        &[]
    }

    /// Whether the file has places of the body that can be chosen ([`ExportOptions::points`]).
    fn has_points(&self) -> bool {
        false
    }

    /// Whether the file is a picture of the body: it has modes that can be chosen, plays motions, and nobody
    /// computes with it.
    fn is_picture(&self) -> bool {
        false
    }

    /// Returns the holding of every property of `body` with these options.
    fn checklist(&self, body: &FlexBody, options: &ExportOptions) -> ExportChecklist;

    /// What its program must be told to use all of the file: settings without which a part of it is ignored.
    /// Sentences without a full stop.
    fn needs(&self, _body: &FlexBody, _options: &ExportOptions) -> Vec<String> {
        Vec::new()
    }

    /// What a picture leaves out of the body, with these options. Sentences without a full stop.
    fn leaves_out(&self, _body: &FlexBody, _options: &ExportOptions) -> Vec<String> {
        Vec::new()
    }

    /// The file. Called with options that the format has, and of a picture of a motion with the body as the
    /// motion has it.
    ///
    /// # Errors
    /// [`ExportLoses`](flexbody_base::diagnostic::Code::ExportLoses) for a body of which no file of this format can be made.
    fn write(&self, body: &FlexBody, options: &ExportOptions) -> Result<Exported>;
}

/// Options of an export. Those that a format does not have are refused by [`export`](crate::export()).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ExportOptions {
    /// Variant of the format, one of [`ExportFormat::dialects`]; none: the usual one.
    pub dialect: Option<String>,
    /// Which places of the body the file has.
    pub points: Points,
    /// Of a picture: how many modes it has, the first ones; none: as many as are usual.
    pub modes: Option<usize>,
    /// Of a picture: the motion that it shows instead of modes.
    pub motion: Option<RecordedMotion>,
    /// Name of the file, for formats whose file names those beside it.
    pub name: Option<PathBuf>,
    /// The part that the stiffness of inertia has in a scene, told where the format cannot hold it.
    pub in_scene: Option<InertiaInScene>,
}

/// Largest part of the stiffness of a motion that the stiffness of inertia has in a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct InertiaInScene {
    /// Name of the scene.
    pub scene: String,
    /// The part, 0.01 for 1 %.
    pub share: f64,
}

/// Which places of the body a file has.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Points {
    /// What the format needs: all nodes, or of a format with frames the interfaces where the body has some.
    #[default]
    Usual,
    /// All nodes.
    Nodes,
    /// The reference points of the interfaces and the nodes of free ones.
    Interfaces,
    /// Those of the interfaces, and the nodes with these numbers.
    InterfacesAnd(Vec<i64>),
    /// Nodes with these numbers.
    Some(Vec<i64>),
}

impl Points {
    /// Whether they are those of the interfaces, others beside them or not.
    pub fn of_interfaces(&self) -> bool {
        matches!(self, Self::Interfaces | Self::InterfacesAnd(_))
    }

    /// Numbers of nodes that are named one by one.
    pub fn named(&self) -> &[i64] {
        match self {
            Self::Some(ids) | Self::InterfacesAnd(ids) => ids,
            Self::Usual | Self::Nodes | Self::Interfaces => &[],
        }
    }
}

/// What an export makes: the file, and others that belong beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Exported {
    /// The file itself.
    pub file: Vec<u8>,
    /// Further files, each with the ending that takes the place of the extension of the file: `M.mtx` stands
    /// for a file `body.M.mtx` beside `body.csv`, `_exudyn.py` for a file `body_exudyn.py` beside
    /// `body.hdf5`.
    pub beside: Vec<(Cow<'static, str>, Vec<u8>)>,
}

impl Exported {
    /// Where a further file belongs, for the ending that it has.
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

    /// Fills `slot`, which is for the file, and a slot for each of the others; they appear together when all
    /// are committed.
    ///
    /// # Errors
    /// FB104, FB602 when one cannot be written.
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

    /// A single file.
    pub fn single(file: Vec<u8>) -> Self {
        Self { file, beside: Vec::new() }
    }
}
