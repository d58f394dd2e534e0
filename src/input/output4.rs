//! Matrices that Nastran writes with OUTPUT4: as text or binary, dense or as strings of nonzeros (their
//! starts packed with their lengths, or apart: BIGMAT).

mod binary;
mod layout;
mod text;

use super::assemble::{Storage, assemble, check_size, undeclared_triangle};
use super::bytes::InputFile;
use super::compression::Compression;
use super::nastran_names::choose;
use super::reader::{MatrixSource, Reader};
use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::{Error, Result};
use crate::model::RawMatrix;
use binary::Binary;
use layout::{Columns, Header, SINGLE_DIGITS};
use text::Text;

/// Digits in which OUTPUT4 writes numbers of single precision as text.
const PADDED_DIGITS: u8 = 10;

/// The reader of OUTPUT4 files.
pub(super) struct Output4;

impl Reader for Output4 {
    fn name(&self) -> &'static str {
        "OUTPUT4"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["op4"]
    }

    fn recognises(&self, head: &[u8]) -> bool {
        Binary::of(head).is_some() || text::begins(head)
    }

    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix> {
        let path = source.file.path();
        if source.compression != Compression::None {
            let message = "OUTPUT4 file is compressed as a whole";
            let diagnostic = Diagnostic::new(Code::FileFormatUnknown, message).in_file(path);
            return Err(diagnostic.with_help("unpack it").into());
        }
        let read = || {
            let names = names(source.file)?;
            matrix(source.file, choose(&names, source.role, source.group)?)
        };
        read().map_err(|found: Diagnostic| Error::from(found.in_file(path)))
    }
}

type Found<T> = std::result::Result<T, Diagnostic>;

/// Names of the matrices of a file, in its order.
///
/// # Errors
/// FB301, FB302, FB304: [`matrix`].
pub(super) fn names(file: &InputFile) -> Found<Vec<String>> {
    let mut names = Vec::new();
    walk(file, &mut |header| {
        names.push(header.name.clone());
        None
    })?;
    Ok(names)
}

/// The matrix with this index.
///
/// # Errors
/// FB301 for what is no OUTPUT4 file, FB302 for complex and other matrices, FB303, FB304 for files that are
/// cut off, FB305, FB306, FB307, FB312.
pub(super) fn matrix(file: &InputFile, wanted: usize) -> Found<RawMatrix> {
    let (mut at, mut found) = (0, None);
    let columns = walk(file, &mut |header| {
        at += 1;
        let is_wanted = at == wanted + 1;
        if is_wanted {
            found = Some(header.clone());
        }
        (is_wanted && header.is_real()).then(|| Columns::new(header))
    })?;
    let Some(header) = found else {
        return Err(Diagnostic::new(Code::MatrixSyntax, "the matrix is not in the file"));
    };
    let about = |diagnostic: Diagnostic| diagnostic.about(&header.name);
    let Some(columns) = columns else {
        let message = format!("type {} is complex", header.kind);
        let help = "write real matrices, without structural damping";
        return Err(about(Diagnostic::new(Code::MatrixKind, message).with_help(help)));
    };
    if !matches!(header.form, 1 | 2 | 6) {
        let message = format!("form {} is none of a symmetric matrix", header.form);
        return Err(about(Diagnostic::new(Code::MatrixKind, message).with_help("forms are 1, 2, 6")));
    }
    let n = check_size(header.rows, header.columns, columns.count).map_err(about)?;
    let triangle = undeclared_triangle(columns.sides, |_| "write the whole matrix".into());
    if let Some(triangle) = triangle {
        return Err(about(triangle));
    }
    let raw = assemble(n, columns.pieces, Storage::Full, columns.written, file.path())?;
    // Nastran with words of eight bytes calls its numbers single as well, but writes all their digits.
    let is_single = header.is_single() && columns.written <= PADDED_DIGITS;
    let digits = if is_single { raw.digits.min(SINGLE_DIGITS) } else { raw.digits };
    Ok(RawMatrix { digits, ..raw })
}

/// Goes through the matrices of a file; the columns of the one that `take` gives a place for.
fn walk(file: &InputFile, take: &mut dyn FnMut(&Header) -> Option<Columns>) -> Found<Option<Columns>> {
    match Binary::of(file.bytes()) {
        Some(binary) => binary.walk(file.bytes(), take),
        None => Text::new(file.bytes()).walk(take),
    }
}
