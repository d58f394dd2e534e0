//! Structure of the file: `part`, `new modal`, `refmod`, `frame` and the objects.

use super::lines::{Head, Line, Lines};
use super::taylor::{ModeIndex, Taylor};
use crate::import::digits::Digits;
use flexbody_base::diagnostic::{Code, Diagnostic};
use std::path::Path;

/// Objects of the body in the order of the format, lower case, with alternative names.
const OBJECTS: [(&str, &[&str]); 11] = [
    ("mdcm", &["mcm"]),
    ("j", &["mmi"]),
    ("ct", &[]),
    ("cr", &[]),
    ("me", &[]),
    ("gr", &[]),
    ("ge", &[]),
    ("oe", &[]),
    ("ksigma", &[]),
    ("ke", &[]),
    ("de", &[]),
];

/// Objects of a frame in the order of the format.
const FRAME_OBJECTS: [&str; 5] = ["origin", "phi", "psi", "ap", "sigma"];

/// Largest number of modes that a short file may state. A longer file may state up to sqrt(64 n) modes for n
/// listed numbers; the limit prevents huge arrays from a single number.
const MODES_OF_ANY_FILE: usize = 100;

/// Largest product of frames and modes that a short file may state. A longer file may state up to 64 times
/// its listed numbers.
const NUMBERS_OF_ANY_FILE: usize = 1_000_000;

/// A frame of the file; its objects are in the order of [`FRAME_OBJECTS`].
pub(crate) struct ListedFrame {
    pub(crate) label: String,
    line: usize,
    objects: [Option<Taylor>; 5],
}

impl ListedFrame {
    pub(crate) fn object(&self, name: &str) -> Option<&Taylor> {
        let at = FRAME_OBJECTS.iter().position(|known| *known == name)?;
        self.objects[at].as_ref().filter(|object| !object.is_empty())
    }
}

/// Parsed contents of a file.
pub(crate) struct Listed<'t> {
    /// Text of the first line after the counts.
    pub(crate) comment: String,
    /// Number of frames stated in the first line.
    pub(crate) stated_frames: Option<usize>,
    pub(crate) mass: f64,
    pub(crate) nq: usize,
    /// Texts of the modes: (mode from 0, text).
    pub(crate) mode_texts: Vec<(usize, &'t str)>,
    pub(crate) frames: Vec<ListedFrame>,
    objects: [Option<Taylor>; 11],
    pub(crate) modes: ModeIndex,
}

impl<'t> Listed<'t> {
    /// Returns the object with this lower-case name; `None` if it is missing or lists no entries.
    pub(crate) fn object(&self, name: &str) -> Option<&Taylor> {
        let at = OBJECTS.iter().position(|(known, _)| *known == name)?;
        self.objects[at].as_ref().filter(|object| !object.is_empty())
    }

    /// Reads and checks a file.
    ///
    /// # Errors
    /// FB730 if the file cannot be parsed; FB731 if required objects or numbers are missing.
    pub(crate) fn read(path: &'t Path, text: &'t str) -> Result<Self, Diagnostic> {
        let mut lines = Lines::new(path, text);
        let Head { comment, stated } = Head::read(&mut lines)?;
        let Modal { refmod, frames, objects } = Modal::read(&mut lines)?;
        let incomplete = |message: String| Diagnostic::new(Code::ForeignIncomplete, message).in_file(path);
        let refmod = refmod
            .ok_or_else(|| incomplete("the object `refmod`, which has the mass, is missing".to_owned()))?;
        let nq = refmod.nq;
        if let Some((_, modes)) = stated.filter(|(_, modes)| *modes != nq) {
            return Err(
                lines.unreadable(1, format!("the first line states {modes} modes, `refmod` states {nq}"))
            );
        }
        let mut listed = Self {
            comment,
            stated_frames: stated.map(|(nodes, _)| nodes),
            mass: refmod.mass,
            nq,
            mode_texts: refmod.texts,
            frames: frames.unwrap_or_default(),
            objects,
            modes: ModeIndex::Middle,
        };
        listed.refuse_incomplete().map_err(incomplete)?;
        listed.find_mode_index();
        listed.check(&lines)?;
        lines.finish()?;
        Ok(listed)
    }

    /// Returns an error that names a missing required object, or states that the file has fewer numbers than
    /// its modes and frames need. The check precedes the allocation of arrays, whose sizes are otherwise
    /// unbounded.
    fn refuse_incomplete(&self) -> Result<(), String> {
        for at in [0, 1, 4, 9] {
            if self.objects[at].is_none() {
                return Err(format!("no `{}`", OBJECTS[at].0));
            }
        }
        let nq = self.nq;
        let entries: usize = self.objects.iter().flatten().map(Taylor::n_entries).sum();
        if nq == 0 || nq > MODES_OF_ANY_FILE.max((64.0 * entries as f64).sqrt() as usize) {
            return Err(format!("the file has only {entries} numbers, too few for {nq} modes"));
        }
        let frame_objects = self.frames.iter().flat_map(|f| f.objects.iter().flatten());
        let numbers: usize = frame_objects.map(Taylor::n_entries).sum();
        let n = self.frames.len();
        if n.saturating_mul(nq) > NUMBERS_OF_ANY_FILE.max(64 * numbers) {
            return Err(format!("the file has only {numbers} numbers, too few for {n} frames of {nq} modes"));
        }
        Ok(())
    }

    /// Returns true if J is a 3 x 3 matrix.
    pub(crate) fn has_square_inertia(&self) -> bool {
        self.object("j").is_some_and(|j| j.ncol == 3)
    }

    /// Returns true if a moment has its MatMorembs name.
    pub(crate) fn has_morembs_names(&self) -> bool {
        self.objects[..2].iter().flatten().any(|object| matches!(object.name.as_str(), "mcm" | "mmi"))
    }

    fn all_objects(&self) -> impl Iterator<Item = &Taylor> {
        let frame_objects = self.frames.iter().flat_map(|frame| frame.objects.iter().flatten());
        self.objects.iter().flatten().chain(frame_objects)
    }

    /// Returns the distinct names of objects that list entries without a `structure`.
    pub(crate) fn inferred(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for object in self.all_objects().filter(|object| object.inferred && !object.is_empty()) {
            if !names.contains(&object.name.as_str()) {
                names.push(&object.name);
            }
        }
        names
    }

    /// Returns the number format of the whole file.
    pub(crate) fn digits(&self) -> Digits {
        self.all_objects().map(|object| object.digits).fold(Digits::default(), Digits::most)
    }

    /// Returns the dialect named in the first line of a file written by flexbody.
    pub(crate) fn named_dialect(&self) -> Option<&str> {
        let facts = self.comment.strip_prefix("flexbody ")?;
        facts.split(", ").find_map(|fact| fact.strip_prefix("dialect "))
    }

    /// Finds the position of the mode index in `m1`. Arrays with one column decide; with three modes and
    /// arrays of three columns the order is ambiguous. The order of EMBSlib fits every array, so that only
    /// the first line can indicate it here.
    fn find_mode_index(&mut self) {
        if self.named_dialect() == Some("embs") {
            self.modes = ModeIndex::Rows;
            return;
        }
        let admits = |modes: ModeIndex| self.all_objects().all(|object| object.admits(modes, self.nq));
        let last = match (admits(ModeIndex::Middle), admits(ModeIndex::Last)) {
            (false, true) => true,
            (true, true) => self.has_square_inertia(),
            _ => false,
        };
        self.modes = if last { ModeIndex::Last } else { ModeIndex::Middle };
    }

    fn check(&self, lines: &Lines<'_>) -> Result<(), Diagnostic> {
        let (nq, modes) = (self.nq, self.modes);
        for ((name, _), object) in OBJECTS.iter().zip(&self.objects) {
            if let Some(object) = object {
                object.check(lines, self.shape(name), nq, modes)?;
            }
        }
        for frame in &self.frames {
            for (name, object) in FRAME_OBJECTS.iter().zip(&frame.objects) {
                if let Some(object) = object {
                    object.check(lines, self.shape(name), nq, modes)?;
                }
            }
            if let Some(at) = (0..2).find(|&at| frame.objects[at].is_none()) {
                let message = format!("node {} has no `{}`", frame.label, FRAME_OBJECTS[at]);
                return Err(lines.unreadable(frame.line, message));
            }
        }
        Ok(())
    }

    /// Returns the expected size (nrow, ncol) of the object with this name.
    pub(crate) fn shape(&self, name: &str) -> (usize, usize) {
        let nq = self.nq;
        match name {
            "mdcm" | "origin" => (3, 1),
            "j" if self.has_square_inertia() => (3, 3),
            "j" | "sigma" => (6, 1),
            "ct" | "cr" => (nq, 3),
            "gr" => (3, 3 * nq),
            "ge" => (nq, 3 * nq),
            "oe" => (nq, 6),
            "ksigma" => (nq, 1),
            "phi" | "psi" => (3, nq),
            "ap" => (3, 3),
            _ => (nq, nq),
        }
    }
}

/// Contents of `new modal`, up to `end part`.
#[derive(Default)]
struct Modal<'t> {
    refmod: Option<Refmod<'t>>,
    frames: Option<Vec<ListedFrame>>,
    objects: [Option<Taylor>; 11],
}

impl<'t> Modal<'t> {
    fn read(lines: &mut Lines<'t>) -> Result<Self, Diagnostic> {
        let line = lines.next("part")?;
        expect(lines, &line, "new modal")?;
        let mut modal = Self::default();
        loop {
            let line = lines.next("new modal")?;
            if line.key == "end modal" {
                break;
            }
            modal.read_part(lines, &line)?;
        }
        let line = lines.next("part")?;
        expect(lines, &line, "end part")?;
        Ok(modal)
    }

    /// Reads the part of the file that begins with `line`.
    fn read_part(&mut self, lines: &mut Lines<'t>, line: &Line<'t>) -> Result<(), Diagnostic> {
        let twice = |lines: &Lines<'_>| lines.unreadable(line.number, format!("`{}` occurs twice", line.key));
        match line.key.as_str() {
            "refmod" if self.refmod.is_some() => return Err(twice(lines)),
            "refmod" => self.refmod = Some(Refmod::read(lines)?),
            "frame" | "new frame" if self.frames.is_some() => return Err(twice(lines)),
            "frame" | "new frame" => self.frames = Some(read_frames(lines)?),
            key => {
                let is = |(name, others): &(&str, &[&str])| *name == key || others.contains(&key);
                let Some(at) = OBJECTS.iter().position(is) else {
                    let message = format!("`{key}` in `new modal`, expected one of its objects");
                    return Err(lines.unreadable(line.number, message));
                };
                if self.objects[at].is_some() {
                    return Err(twice(lines));
                }
                self.objects[at] = Some(Taylor::read(lines, line)?);
            }
        }
        Ok(())
    }
}

fn expect(lines: &Lines<'_>, line: &Line<'_>, key: &str) -> Result<(), Diagnostic> {
    if line.key == key {
        return Ok(());
    }
    Err(lines.unreadable(line.number, format!("`{}`, expected `{key}`", line.key)))
}

struct Refmod<'t> {
    mass: f64,
    nq: usize,
    texts: Vec<(usize, &'t str)>,
}

impl<'t> Refmod<'t> {
    fn read(lines: &mut Lines<'t>) -> Result<Self, Diagnostic> {
        let (mut mass, mut nq, mut texts) = (None, None, Vec::new());
        let end = loop {
            let line = lines.next("refmod")?;
            match line.key.as_str() {
                "end refmod" => break line.number,
                "mass" => mass = Some(lines.number(&line)?),
                "nelastq" => nq = Some(lines.count(&line)?),
                key => {
                    let mode = key
                        .strip_prefix("ielastq")
                        .and_then(|rest| rest.trim().strip_prefix('(')?.strip_suffix(')'))
                        .and_then(|mode| mode.trim().parse::<usize>().ok()?.checked_sub(1));
                    let Some(mode) = mode else {
                        let message =
                            format!("`{key}` in `refmod`, expected `mass`, `nelastq` or `ielastq(k)`");
                        return Err(lines.unreadable(line.number, message));
                    };
                    texts.push((mode, line.value.unwrap_or("")));
                }
            }
        };
        let missing = |what: &str| lines.unreadable(end, format!("`refmod` has no `{what}`"));
        let (mass, _) = mass.ok_or_else(|| missing("mass"))?;
        Ok(Self { mass, nq: nq.ok_or_else(|| missing("nelastq"))?, texts })
    }
}

fn read_frames(lines: &mut Lines<'_>) -> Result<Vec<ListedFrame>, Diagnostic> {
    let mut frames = Vec::new();
    loop {
        let line = lines.next("frame")?;
        match line.key.as_str() {
            "end frame" => return Ok(frames),
            "new node" => {}
            key => {
                let message = format!("`{key}` in `frame`, expected `new node` or `end frame`");
                return Err(lines.unreadable(line.number, message));
            }
        }
        let label = line.value.unwrap_or("").to_owned();
        let mut frame = ListedFrame { label, line: line.number, objects: Default::default() };
        loop {
            let line = lines.next("new node")?;
            match line.key.as_str() {
                "end node" => break,
                "rframe" => continue,
                key => {
                    let Some(at) = FRAME_OBJECTS.iter().position(|name| *name == key) else {
                        let message = format!("`{key}` in `new node`, expected one of its objects");
                        return Err(lines.unreadable(line.number, message));
                    };
                    if frame.objects[at].is_some() {
                        let message = format!("`{key}` occurs twice");
                        return Err(lines.unreadable(line.number, message));
                    }
                    frame.objects[at] = Some(Taylor::read(lines, &line)?);
                }
            }
        }
        frames.push(frame);
    }
}
