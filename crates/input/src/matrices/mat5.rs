//! Matrices in MAT-files of MATLAB, versions 5 to 7, as MATLAB, Octave and SciPy write them: "MAT-File Format", The
//! MathWorks. Fields of structs count as variables with a path. Files of version 7.3 are HDF5.

use super::assemble::{Entry, check_extents, check_size, most_entries_of};
use super::compressed::{Compressed, Full};
use super::named_matrices::{NamedMatrices, named_or_only};
use super::operator::OperatorColumns;
use super::reader::{ArraySource, MatrixRole, MatrixSource, Reader};
use super::rectangular::Rectangular;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::error::{self, Error};
use flexbody_base::memory::{left, refuse_beyond};
use flexbody_base::text::InputFile;
use flexbody_model::RawMatrix;
use std::io::{ErrorKind, Read};
use std::path::Path;

/// Reader of MAT-files.
pub(crate) struct Mat5;

/// Number of bytes of the header: text, version and byte order.
const HEADER: usize = 128;
/// Kinds of elements that are variables.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Largest number of bytes after the numbers of a compressed variable. No program writes any; more of them are not unpacked.
const MAX_REST_BYTES: u64 = 1 << 16;

const NAMES: NamedMatrices = NamedMatrices { holder: "variable", file: "FILE.mat", matrices: "matrices" };
const HELP: &str = "write it again: save('FILE.mat', 'K', 'M')";

/// Largest depth of structs within structs.
const MAX_DEPTH: usize = 8;
/// Largest number of bytes of the names of the fields of a struct.
const MAX_FIELD_NAMES_BYTES: u64 = 1 << 16;

impl Reader for Mat5 {
    fn name(&self) -> &'static str {
        "MATLAB"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["mat"]
    }

    /// Recognises a file by version and byte order after 124 bytes of text.
    fn recognises(&self, head: &[u8]) -> bool {
        Order::of(head).is_some()
    }

    fn read(&self, source: &MatrixSource<'_>) -> error::Result<RawMatrix> {
        let read = || {
            let bytes = source.not_packed("MATLAB file")?;
            let Some(order) = Order::of(bytes) else {
                let message = "file is not of a MATLAB version from 5 to 7.3";
                return Err(Diagnostic::new(Code::FileFormatUnknown, message)
                    .with_help("save it with the option -v7 or -v7.3"));
            };
            let variables = variables(bytes, order)?;
            let chosen = match source.group {
                Some(name) => named(&variables, name)?,
                None => search(&variables, source.role)?,
            };
            chosen.matrix(source.file.path())
        };
        read().map_err(|diagnostic: Diagnostic| Error::from(diagnostic.in_file(source.file.path())))
    }

    fn read_operator(&self, source: &ArraySource<'_>) -> Option<Diagnosed<OperatorColumns>> {
        let read = || read_rectangular(source.file, source.name).map(Rectangular::operator);
        source.is_plain().then(|| read().map_err(|diagnostic| vec![diagnostic]))
    }
}

/// Reads the variable `name`, or the only matrix of the file, which need not be square.
///
/// # Errors
/// FB102 and FB103 for a file that cannot be read, FB310 if there is no such variable, FB301 to FB306 for an invalid
/// matrix.
fn read_rectangular(file: &InputFile, name: Option<&str>) -> Result<Rectangular, Diagnostic> {
    let bytes = file.bytes();
    let Some(order) = Order::of(bytes) else {
        return Err(Diagnostic::new(
            Code::FileFormatUnknown,
            "file is not of a MATLAB version from 5 to 7.3",
        ));
    };
    let variables = variables(bytes, order)?;
    let chosen = match name {
        Some(name) => named(&variables, name)?,
        None => {
            let is_matrix = |v: &&Variable<'_>| {
                v.kind == VariableKind::Sparse || v.kind == VariableKind::Full && v.rows * v.columns > 1
            };
            let candidates = outermost(variables.iter().filter(is_matrix).collect());
            let names: Vec<String> = candidates.iter().map(|variable| variable.path.clone()).collect();
            candidates[named_or_only(&names, None)?]
        }
    };
    chosen.rectangular()?.checked()
}

/// Reads the heads of all variables of the file, and of the fields of structs.
fn variables(bytes: &[u8], order: Order) -> Result<Vec<Variable<'_>>, Diagnostic> {
    let mut variables = Vec::new();
    let mut rest = &bytes[HEADER..];
    while !rest.is_empty() {
        let cut_off = || {
            let message = format!("file ends within its variable number {}", variables.len() + 1);
            Diagnostic::new(Code::MatrixCount, message)
        };
        let (tag, after) = rest.split_first_chunk::<8>().ok_or_else(cut_off)?;
        let [kind, length] = order.two(tag);
        let (body, after) = after.split_at_checked(length as usize).ok_or_else(cut_off)?;
        match kind {
            MATRIX | COMPRESSED => {
                let place = Place { body, compressed: kind == COMPRESSED, order, start: 0 };
                Variable::open(&mut place.elements()?, place, "", &mut variables)?;
            }
            // Elements of other kinds are skipped.
            _ => {}
        }
        rest = after;
    }
    Ok(variables)
}

/// Returns the variable that the user named; fields of structs follow a point or a `/`.
fn named<'v, 'a>(variables: &'v [Variable<'a>], name: &str) -> Result<&'v Variable<'a>, Diagnostic> {
    let path = name.trim_matches('/').replace('.', "/");
    let outer = path.split('/').next().unwrap_or_default();
    let mut found = variables.iter().filter(|variable| variable.path == path);
    match (found.next(), found.next()) {
        (Some(variable), None) => Ok(variable),
        (Some(_), Some(_)) => {
            let message = format!("file has several variables `{path}`");
            Err(Diagnostic::new(Code::Hdf5Layout, message).with_help(HELP))
        }
        (None, _) => {
            let holder = variables.iter().find(|variable| variable.path == outer && outer != path);
            let (message, help) = match holder {
                Some(holder) if holder.kind != VariableKind::Struct => (
                    format!("`{path}` is within the variable `{outer}`, which holds {}", holder.kind.words()),
                    format!("save the matrix as a variable or as a field of one struct: {outer}.K = K"),
                ),
                _ => (format!("variable `{path}` is not in the file"), listing(variables)),
            };
            Err(Diagnostic::new(Code::Hdf5Layout, message).with_help(help))
        }
    }
}

/// Returns the help that lists the variables of the file, with fields in place of their structs.
fn listing(variables: &[Variable<'_>]) -> String {
    let paths = paths(variables.iter().filter(|variable| variable.kind != VariableKind::Struct));
    let names: Vec<&str> = paths.iter().map(String::as_str).collect();
    if names.is_empty() { HELP.to_owned() } else { NAMES.listing(&names) }
}

/// Returns the candidates that are no fields of structs, or all if there are only fields.
fn outermost<'v, 'a>(mut candidates: Vec<&'v Variable<'a>>) -> Vec<&'v Variable<'a>> {
    if candidates.iter().any(|variable| !variable.is_field()) {
        candidates.retain(|variable| !variable.is_field());
    }
    candidates
}

/// Returns the only sparse matrix, or the only one named after its role; in a file without sparse matrices, the only
/// square full one or the one named after its role. Fields of structs are considered if no variable is such a matrix.
fn search<'v, 'a>(variables: &'v [Variable<'a>], role: MatrixRole) -> Result<&'v Variable<'a>, Diagnostic> {
    let is_sparse = |v: &&Variable<'a>| v.kind == VariableKind::Sparse;
    let is_full = |v: &&Variable<'a>| v.kind == VariableKind::Full && v.rows == v.columns && v.rows > 1;
    let is_outer = |v: &&Variable<'a>| !v.is_field();
    let candidates = [
        variables.iter().filter(is_sparse).filter(is_outer).collect::<Vec<_>>(),
        variables.iter().filter(is_full).filter(is_outer).collect(),
        variables.iter().filter(is_sparse).collect(),
        variables.iter().filter(is_full).collect(),
    ];
    let candidates = candidates.into_iter().find(|found| !found.is_empty()).unwrap_or_default();
    if candidates.is_empty() {
        let message = "file holds no sparse matrix and no square one";
        return Err(Diagnostic::new(Code::Hdf5Layout, message).with_help(HELP));
    }
    let paths = paths(candidates.iter().copied());
    let names: Vec<&str> = paths.iter().map(String::as_str).collect();
    Ok(candidates[NAMES.choose(&names, role)?])
}

fn paths<'v, 'a: 'v>(variables: impl IntoIterator<Item = &'v Variable<'a>>) -> Vec<String> {
    variables.into_iter().map(|variable| format!("/{}", variable.path)).collect()
}

// A variable of a MAT-file: its kind, and its matrix.

/// Largest number of bytes of the flags, the extents and the name of a variable, each.
const HEAD_BYTES: u64 = 1 << 12;

const REAL: &str = "save a matrix of real numbers: K = sparse(real(K)); save('FILE.mat', 'K')";
const BOTH_TRIANGLES: &str = "save both triangles: K + tril(K, -1)'";

/// Kind of the content of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum VariableKind {
    Sparse,
    /// Full array of real numbers with two extents.
    Full,
    /// One struct, whose fields count as variables.
    Struct,
    /// Content that is no matrix, in words.
    Other(&'static str),
}

impl VariableKind {
    /// Returns the content in words.
    fn words(self) -> &'static str {
        match self {
            Self::Sparse => "a sparse matrix",
            Self::Full => "a full matrix",
            Self::Struct => "a struct",
            Self::Other(words) => words,
        }
    }
}

/// Place of a variable in its file.
#[derive(Clone, Copy)]
struct Place<'a> {
    /// Body of the variable, or of that whose field it is.
    body: &'a [u8],
    compressed: bool,
    order: Order,
    /// Number of bytes before the elements of a field in the unpacked body; 0 for a variable.
    start: u64,
}

impl<'a> Place<'a> {
    /// Returns the elements of the variable.
    fn elements(self) -> Result<Elements<'a>, Diagnostic> {
        let mut elements = Elements::of(self.body, self.compressed, self.order)?;
        elements.skip_to(self.start)?;
        Ok(elements)
    }
}

/// Variable, or field of a struct, whose head has been read.
struct Variable<'a> {
    /// Names of the structs around it and its own, separated by `/`.
    pub path: String,
    pub kind: VariableKind,
    pub rows: u64,
    pub columns: u64,
    single: bool,
    /// Kind of its values, if they are no real numbers.
    not_real: Option<&'static str>,
    place: Place<'a>,
}

impl<'a> Variable<'a> {
    /// Reads the head of a variable, and those of its fields if it is a struct, into `variables`. `elements` begin at the
    /// variable; `path` is that of a field, and empty for a variable, which has a name.
    ///
    /// # Errors
    /// FB103 for damaged packed bytes, FB301, FB304.
    fn open(
        elements: &mut Elements<'a>,
        place: Place<'a>,
        path: &str,
        variables: &mut Vec<Self>,
    ) -> Result<(), Diagnostic> {
        let [flags, extents, name] = Self::head(elements)?;
        let flags = flags.whole(0).unwrap_or(0);
        let extent = |k: usize| extents.whole(k).and_then(|extent| u64::try_from(extent).ok()).unwrap_or(0);
        let kind = match (flags & 0xff, extents.len()) {
            (5, 2) => VariableKind::Sparse,
            (6..=15, 2) => VariableKind::Full,
            (6..=15, _) => VariableKind::Other("an array of more than two extents"),
            (1, _) => VariableKind::Other("a cell array"),
            (2, 2) if extent(0) == 1 && extent(1) == 1 => VariableKind::Struct,
            (2, _) => VariableKind::Other("an array of structs"),
            (4, _) => VariableKind::Other("a text"),
            _ => VariableKind::Other("an object"),
        };
        let not_real = match flags >> 8 {
            flags if flags & 8 != 0 => Some("complex numbers"),
            flags if flags & 2 != 0 => Some("logical values"),
            _ => None,
        };
        let name = String::from_utf8_lossy(&name.bytes);
        let path = if path.is_empty() { name.into_owned() } else { path.to_owned() };
        let structs = path.split('/').count();
        variables.push(Self {
            path: path.clone(),
            kind,
            rows: extent(0),
            columns: extent(1),
            single: flags & 0xff == 7,
            not_real,
            place,
        });
        if kind == VariableKind::Struct && structs <= MAX_DEPTH {
            Self::open_fields(elements, place, &path, variables)?;
        }
        Ok(())
    }

    /// Reads the heads of the fields of the struct `path`: the length of their names, the names, and a variable for each.
    fn open_fields(
        elements: &mut Elements<'a>,
        place: Place<'a>,
        path: &str,
        variables: &mut Vec<Self>,
    ) -> Result<(), Diagnostic> {
        let length = elements.next(HEAD_BYTES)?.whole(0).and_then(|length| usize::try_from(length).ok());
        let names = elements.next(MAX_FIELD_NAMES_BYTES)?;
        let Some(length) = length.filter(|length| *length > 0) else {
            let message = format!("struct `{path}` does not state how long the names of its fields are");
            return Err(Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP));
        };
        for name in names.bytes.chunks_exact(length) {
            let name = name.split(|byte| *byte == 0).next().unwrap_or_default();
            let path = format!("{path}/{}", String::from_utf8_lossy(name));
            let [kind, bytes] = elements.tag()?;
            let end = elements.at.saturating_add(u64::from(bytes).next_multiple_of(8));
            // An empty field has no elements.
            if kind == MATRIX && bytes > 0 {
                Self::open(elements, Place { start: elements.at, ..place }, &path, variables)?;
            }
            elements.skip_to(end)?;
        }
        Ok(())
    }

    /// Returns true for a field of a struct.
    fn is_field(&self) -> bool {
        self.place.start > 0
    }

    /// Reads flags, extents and name.
    fn head(elements: &mut Elements<'a>) -> Result<[Numbers; 3], Diagnostic> {
        let mut next = || elements.next(HEAD_BYTES);
        let head = [next()?, next()?, next()?];
        if head[0].len() < 2 || !head[0].is_whole() || !head[1].is_whole() {
            let message = "a variable does not begin with its flags and extents";
            return Err(Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP));
        }
        Ok(head)
    }

    /// Reads the arrays of the variable.
    ///
    /// # Errors
    /// FB302 for a variable that is no matrix of real numbers, FB103.
    fn arrays(&self) -> Result<Arrays, Diagnostic> {
        let mut elements = self.place.elements()?;
        Self::head(&mut elements)?;
        let refused = |what: &str, help: &str| {
            let message = format!("variable `{}` holds {what}, not a matrix of real numbers", self.path);
            Err(Diagnostic::new(Code::MatrixKind, message).with_help(help))
        };
        let arrays = match (self.kind, self.not_real) {
            (VariableKind::Struct, _) => return refused("a struct", "name a field: FILE.mat:/struct.K"),
            (VariableKind::Other(what), _) | (_, Some(what)) => return refused(what, REAL),
            (VariableKind::Sparse, None) => {
                let (indices, values) = (self.most_entries() * 4, self.most_entries() * 8);
                let pointers = self.columns.saturating_add(1).saturating_mul(8);
                Arrays::Sparse([elements.next(indices)?, elements.next(pointers)?, elements.next(values)?])
            }
            (VariableKind::Full, None) => {
                let places = self.rows.saturating_mul(self.columns);
                Arrays::Full(elements.next(places.saturating_mul(8))?)
            }
        };
        elements.finish(self.is_field())?;
        Ok(arrays)
    }

    /// Returns the square matrix of the variable.
    ///
    /// # Errors
    /// The errors of [`Self::arrays`] and of matrices.
    fn matrix(&self, path: &Path) -> Result<RawMatrix, Diagnostic> {
        let raw = match self.arrays()? {
            Arrays::Sparse(arrays) => self.sparse(arrays, path)?,
            Arrays::Full(values) => self.full(&values, path)?,
        };
        Ok(RawMatrix { digits: if self.single { raw.digits.min(7) } else { raw.digits }, ..raw })
    }

    /// Returns the matrix of the variable, which need not be square.
    ///
    /// # Errors
    /// The errors of [`Self::arrays`]; FB301, FB304 for lists that do not fit each other, FB313 for a matrix beyond
    /// memory.
    fn rectangular(&self) -> Result<Rectangular, Diagnostic> {
        let (starts, count, entry): (Vec<u64>, usize, EntryAt) = match self.arrays()? {
            Arrays::Sparse([indices, pointers, values]) => {
                let count = indices.len().min(values.len());
                let starts = starts_of(&pointers);
                let entry = move |k| (indices.whole(k).unwrap_or(-1), values.real(k).unwrap_or(f64::NAN));
                (starts, count, Box::new(entry))
            }
            Arrays::Full(values) => {
                let (rows, count) = (self.rows, values.len());
                let starts = (0..=self.columns).map_while(|column| column.checked_mul(rows)).collect();
                let entry =
                    move |k: usize| ((k as u64 % rows.max(1)) as i64, values.real(k).unwrap_or(f64::NAN));
                (starts, count, Box::new(entry))
            }
        };
        let fits = starts.len() as u64 == self.columns.saturating_add(1)
            && starts.is_sorted()
            && starts[0] == 0
            && starts.last().is_some_and(|last| *last <= count as u64);
        if !fits {
            let message = format!("variable `{}` has lists that do not fit each other", self.path);
            return Err(Diagnostic::new(Code::MatrixCount, message).with_help(HELP));
        }
        let used = starts.last().copied().unwrap_or(0);
        let [rows, columns] = check_extents(self.rows, self.columns, used)?;
        let mut entries = Vec::new();
        for (column, pair) in starts.windows(2).enumerate() {
            for k in pair[0]..pair[1] {
                let (row, value) = entry(k as usize);
                let row = u32::try_from(row).unwrap_or(u32::MAX);
                if value != 0.0 {
                    entries.push(Entry { row, col: column as u32, value });
                }
            }
        }
        Ok(Rectangular { rows, columns, entries })
    }

    /// Returns the largest number of entries of a matrix of this size.
    fn most_entries(&self) -> u64 {
        most_entries_of(self.columns).min(u64::MAX / 8)
    }

    fn sparse(
        &self,
        [indices, pointers, values]: [Numbers; 3],
        path: &Path,
    ) -> Result<RawMatrix, Diagnostic> {
        let n = check_size(self.rows, self.columns, values.len() as u64)?;
        let pointers = starts_of(&pointers);
        // The arrays may have capacity for more entries than are used.
        let count = indices.len().min(values.len());
        let entries = pointers.last().map_or(0, |last| (*last).min(count as u64) as usize);
        let compressed = Compressed {
            n,
            by_rows: false,
            pointers,
            pointers_name: "the list of columns (jc)",
            entries,
            entry: &|k| (indices.whole(k).unwrap_or(-1), values.real(k).unwrap_or(f64::NAN)),
            help: HELP,
            both_triangles: BOTH_TRIANGLES,
        };
        compressed.assemble(path)
    }

    fn full(&self, values: &Numbers, path: &Path) -> Result<RawMatrix, Diagnostic> {
        if self.rows.checked_mul(self.columns) != Some(values.len() as u64) {
            let (rows, columns, count) = (self.rows, self.columns, values.len());
            let message =
                format!("variable `{}` has {rows} x {columns} places and {count} values", self.path);
            return Err(Diagnostic::new(Code::MatrixCount, message).with_help(HELP));
        }
        let n = check_size(self.rows, self.columns, values.len() as u64)?;
        let value = |k| values.real(k).unwrap_or(f64::NAN);
        let full = Full { n, by_rows: false, value: &value, help: HELP, both_triangles: BOTH_TRIANGLES };
        full.assemble(path)
    }
}

/// Function that returns row and value of the k-th entry.
type EntryAt = Box<dyn Fn(usize) -> (i64, f64)>;

/// Arrays of a matrix.
enum Arrays {
    /// Rows, starts of the columns, values.
    Sparse([Numbers; 3]),
    /// Values, column by column.
    Full(Numbers),
}

/// Returns the starts of the columns of a sparse matrix.
fn starts_of(pointers: &Numbers) -> Vec<u64> {
    let start = |k| pointers.whole(k).and_then(|at| u64::try_from(at).ok()).unwrap_or(u64::MAX);
    (0..pointers.len()).map(start).collect()
}

// Data elements of a MAT-file: a tag with type and number of bytes, and the bytes.

/// Byte order of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    Little,
    Big,
}

impl Order {
    /// Returns the byte order of a file of version 5 that begins with `head`; `None` for other files.
    fn of(head: &[u8]) -> Option<Self> {
        match head.get(124..128)? {
            b"\x00\x01IM" => Some(Self::Little),
            b"\x01\x00MI" => Some(Self::Big),
            _ => None,
        }
    }

    /// Returns the bytes as a number, without regard to a sign.
    fn digits(self, bytes: &[u8]) -> u64 {
        let append = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        match self {
            Self::Little => bytes.iter().rev().fold(0, append),
            Self::Big => bytes.iter().fold(0, append),
        }
    }

    /// Returns two whole numbers of four bytes.
    fn two(self, bytes: &[u8; 8]) -> [u32; 2] {
        [self.digits(&bytes[..4]) as u32, self.digits(&bytes[4..]) as u32]
    }
}

/// Consecutive elements of a variable.
struct Elements<'a> {
    stream: Box<dyn Read + 'a>,
    order: Order,
    is_packed: bool,
    /// Number of bytes that were read of the unpacked body.
    at: u64,
    /// Number of bytes that the unpacked body states to have.
    length: u64,
}

impl<'a> Elements<'a> {
    /// Returns the elements in the body of a variable.
    fn of(body: &'a [u8], compressed: bool, order: Order) -> Result<Self, Diagnostic> {
        let length = body.len() as u64;
        let mut elements = Self { stream: Box::new(body), order, is_packed: compressed, at: 0, length };
        if compressed {
            elements.stream = Box::new(flate2::read::ZlibDecoder::new(body));
            // Packed bytes hold a variable with its tag.
            elements.length = u64::from(elements.tag()?[1]);
            elements.at = 0;
        }
        Ok(elements)
    }

    /// Returns kind and number of bytes of the next element, whose bytes follow.
    fn tag(&mut self) -> Result<[u32; 2], Diagnostic> {
        let tag: [u8; 8] = self.take(8)?.try_into().expect("eight bytes were read");
        Ok(self.order.two(&tag))
    }

    /// Skips the bytes before the byte `start` of the unpacked body; the last one may be missing, as padding may be.
    fn skip_to(&mut self, start: u64) -> Result<(), Diagnostic> {
        let count = start.min(self.length.saturating_add(8)).saturating_sub(self.at);
        let mut skipped = self.stream.by_ref().take(count);
        self.at += std::io::copy(&mut skipped, &mut std::io::sink()).map_err(damaged)?;
        Ok(())
    }

    /// Returns the next element.
    ///
    /// # Errors
    /// FB103 for damaged packed bytes, FB304 if the variable ends within the element or the element has more than
    /// `most` bytes, FB601.
    fn next(&mut self, most: u64) -> Result<Numbers, Diagnostic> {
        let tag: [u8; 8] = self.take(8)?.try_into().expect("eight bytes were read");
        let [kind, length] = self.order.two(&tag);
        // An element of up to four bytes is stored in the tag itself.
        if kind >> 16 != 0 {
            let bytes = tag[4..].get(..(kind >> 16) as usize).ok_or_else(|| {
                Diagnostic::new(
                    Code::MatrixSyntax,
                    "an element that is stored in its tag is longer than 4 bytes",
                )
                .with_help(HELP)
            })?;
            return Ok(Numbers { kind: kind & 0xffff, bytes: bytes.to_vec(), order: self.order });
        }
        if u64::from(length) > most {
            let message = format!("a variable has {length} bytes, but its extents allow at most {most}");
            return Err(Diagnostic::new(Code::MatrixCount, message).with_help(HELP));
        }
        let what = "reading a variable";
        refuse_beyond(left(), f64::from(length), what, "use a larger machine")
            .map_err(|error| error.first_error().clone())?;
        let bytes = self.take(u64::from(length))?;
        let padding = u64::from(length).next_multiple_of(8) - u64::from(length);
        // The padding of the last element of a file may be missing.
        self.read(padding)?;
        Ok(Numbers { kind, bytes, order: self.order })
    }

    /// Reads to the end, where the checksum of packed bytes is verified. Behind a field (`is_field`) further fields follow.
    ///
    /// # Errors
    /// FB103 for damaged packed bytes, FB304 if the packed bytes do not end soon.
    fn finish(mut self, is_field: bool) -> Result<(), Diagnostic> {
        if is_field {
            self.skip_to(self.length)?;
        }
        let mut rest = self.stream.by_ref().take(MAX_REST_BYTES + 1);
        let count = std::io::copy(&mut rest, &mut std::io::sink()).map_err(damaged)?;
        if count <= MAX_REST_BYTES || !self.is_packed {
            return Ok(());
        }
        let message = format!("a compressed variable has more than {MAX_REST_BYTES} bytes after its numbers");
        Err(Diagnostic::new(Code::MatrixCount, message).with_help(HELP))
    }

    fn take(&mut self, length: u64) -> Result<Vec<u8>, Diagnostic> {
        let bytes = self.read(length)?;
        if bytes.len() as u64 == length {
            return Ok(bytes);
        }
        let message = "a variable ends within its data: the file may be cut off";
        Err(Diagnostic::new(Code::MatrixCount, message).with_help(HELP))
    }

    /// Returns the next `length` bytes, or fewer at the end.
    fn read(&mut self, length: u64) -> Result<Vec<u8>, Diagnostic> {
        let mut bytes = Vec::new();
        self.at += self.stream.by_ref().take(length).read_to_end(&mut bytes).map_err(damaged)? as u64;
        Ok(bytes)
    }
}

fn damaged(error: std::io::Error) -> Diagnostic {
    let message = match error.kind() {
        ErrorKind::UnexpectedEof => "a compressed variable ends before its data do".to_owned(),
        _ => format!("a compressed variable is damaged: {error}"),
    };
    Diagnostic::new(Code::FileCompressionBroken, message).with_help(HELP)
}

/// Content of an element: numbers of one type, or text.
struct Numbers {
    kind: u32,
    pub bytes: Vec<u8>,
    order: Order,
}

impl Numbers {
    /// Returns the bytes per number; `None` if the element holds no numbers.
    fn width(&self) -> Option<usize> {
        Some(match self.kind {
            1 | 2 => 1,
            3 | 4 => 2,
            5..=7 => 4,
            9 | 12 | 13 => 8,
            _ => return None,
        })
    }

    /// Returns the number of numbers.
    fn len(&self) -> usize {
        self.width().map_or(0, |width| self.bytes.len() / width)
    }

    fn is_real(&self) -> bool {
        matches!(self.kind, 7 | 9)
    }

    /// Returns true when the type of the numbers is an integer.
    fn is_whole(&self) -> bool {
        self.width().is_some() && !self.is_real()
    }

    /// Returns the k-th number if it is an integer that fits into i64.
    fn whole(&self, k: usize) -> Option<i64> {
        if !self.is_whole() {
            return None;
        }
        let width = self.width()?;
        let number = self.order.digits(self.bytes.get(k * width..(k + 1) * width)?);
        let unused = 64 - 8 * width as u32;
        match self.kind {
            2 | 4 | 6 | 13 => i64::try_from(number).ok(),
            _ => Some(((number << unused) as i64) >> unused),
        }
    }

    /// Returns the k-th number.
    fn real(&self, k: usize) -> Option<f64> {
        let digits = |width: usize| Some(self.order.digits(self.bytes.get(k * width..(k + 1) * width)?));
        match self.kind {
            7 => Some(f64::from(f32::from_bits(digits(4)? as u32))),
            9 => Some(f64::from_bits(digits(8)?)),
            13 => Some(digits(8)? as f64),
            _ => self.whole(k).map(|number| number as f64),
        }
    }
}
