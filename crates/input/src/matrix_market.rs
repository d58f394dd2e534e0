//! Matrix Market coordinate files, plain or compressed: <https://math.nist.gov/MatrixMarket/formats.html>.

use super::assemble::{
    Entry, StoredEntries, assemble, check_extents, check_size, refuse_beyond_memory, undeclared_triangle,
};
use super::coordinates::{Blocks, Coordinates, Limits};
use super::reader::{MatrixSource, Reader};
use super::recovery_files::Rectangular;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::text::InputFile;
use flexbody_base::text::compression::{Compression, broken};
use flexbody_model::RawMatrix;

mod array;
mod header;

pub(super) use array::read_array;
use header::{Header, Symmetry};

/// Reader of Matrix Market files.
pub(super) struct MatrixMarket;

impl Reader for MatrixMarket {
    fn name(&self) -> &'static str {
        "Matrix Market"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["mtx", "mm"]
    }

    fn recognises(&self, head: &[u8]) -> bool {
        header::has_banner(head)
    }

    fn reads_by_itself(&self) -> bool {
        true
    }

    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix> {
        let path = source.file.path();
        if let Some(group) = source.group {
            let message = format!("group `{group}` is named, but Matrix Market files have no groups");
            let help = "give the file without a group";
            return Err(Diagnostic::new(Code::Hdf5Layout, message).in_file(path).with_help(help).into());
        }
        read(source)
            .map_err(|diagnostics| Error::new(diagnostics.into_iter().map(|d| d.in_file(path)).collect()))
    }
}

fn read(source: &MatrixSource<'_>) -> std::result::Result<RawMatrix, Vec<Diagnostic>> {
    let path = source.file.path();
    let mut blocks = Blocks::of(source.file, source.compression);
    let Some(first) = blocks.next().map_err(|e| vec![broken(path, &e)])? else {
        return Err(vec![Diagnostic::new(Code::FileEmpty, "compressed file holds no bytes")]);
    };
    let (header, length, lines) = header::parse(&first)?;
    check_size(header.rows, header.cols, header.entries).map_err(|d| vec![d.at_line(lines)])?;
    refuse_beyond_memory(header.entries.min(possible_entries(source))).map_err(|d| vec![d])?;
    let limits = Limits { n: header.rows as u32, integer: header.integer };
    let mut body = Coordinates::new(limits, Some(header.entries), lines);
    let newline = body.read(path, blocks, first, length)?;
    let mut found = body.bad_lines(newline);
    found.extend(wrong_count(&header, &body));
    found.extend(wrong_triangles(&header, &body));
    if !found.is_empty() {
        return Err(found);
    }
    let stored = match header.symmetry {
        Symmetry::Symmetric => StoredEntries::Triangle,
        Symmetry::General => StoredEntries::Full,
    };
    assemble(header.rows as usize, body.pieces, stored, body.written, path).map_err(|d| vec![d])
}

/// Returns true if the (unpacked) file that begins with `head` lists entries, not a dense array.
pub(super) fn is_coordinate(head: &[u8]) -> bool {
    let first = head.split(|&byte| byte == b'\n').next().unwrap_or_default();
    header::has_banner(head) && !String::from_utf8_lossy(first).to_lowercase().contains(" array ")
}

/// Reads a matrix that need not be square, with all entries stored: its numbers of rows and columns, and its entries
/// from 0.
///
/// # Errors
/// FB301 to FB306 for a file that is not valid, all that are found.
pub(super) fn read_rectangular(
    file: &InputFile,
    compression: Compression,
) -> std::result::Result<Rectangular, Vec<Diagnostic>> {
    let path = file.path();
    let mut blocks = Blocks::of(file, compression);
    let Some(first) = blocks.next().map_err(|e| vec![broken(path, &e)])? else {
        return Err(vec![Diagnostic::new(Code::FileEmpty, "compressed file holds no bytes")]);
    };
    let (header, length, lines) = header::parse(&first)?;
    if header.symmetry == Symmetry::Symmetric && header.rows != header.cols {
        let message =
            format!("matrix of {} rows and {} columns is declared symmetric", header.rows, header.cols);
        return Err(vec![Diagnostic::new(Code::MatrixKind, message).with_help("declare it general")]);
    }
    let [rows, columns] =
        check_extents(header.rows, header.cols, header.entries).map_err(|d| vec![d.at_line(lines)])?;
    let limits = Limits { n: rows.max(columns) as u32, integer: header.integer };
    let mut body = Coordinates::new(limits, Some(header.entries), lines);
    let newline = body.read(path, blocks, first, length)?;
    let mut found = body.bad_lines(newline);
    found.extend(wrong_count(&header, &body));
    if !found.is_empty() {
        return Err(found);
    }
    let mut entries: Vec<Entry> = body.pieces.into_iter().flatten().collect();
    if header.symmetry == Symmetry::Symmetric {
        let mirrored: Vec<Entry> = entries
            .iter()
            .filter(|entry| entry.row != entry.col)
            .map(|entry| Entry { row: entry.col, col: entry.row, value: entry.value })
            .collect();
        entries.extend(mirrored);
    }
    Rectangular { rows, columns, entries }.checked().map_err(|diagnostic| vec![diagnostic])
}

/// Returns the largest number of entries that the file can hold, whatever it announces.
fn possible_entries(source: &MatrixSource<'_>) -> u64 {
    /// Bytes of the shortest line, `1 1 1`, with its end.
    const MIN_LINE_BYTES: u64 = 6;
    /// Largest ratio by which deflate shrinks data.
    const MAX_DEFLATE_RATIO: u64 = 1032;
    let unpacked = match source.compression {
        Compression::None => source.file.length(),
        Compression::Gzip => source.file.length().saturating_mul(MAX_DEFLATE_RATIO),
        Compression::Zstd => u64::MAX,
    };
    unpacked / MIN_LINE_BYTES + 1
}

fn wrong_count(header: &Header, body: &Coordinates) -> Option<Diagnostic> {
    if body.count == header.entries {
        return None;
    }
    let found = if body.stopped { "more".to_owned() } else { body.count.to_string() };
    let message = format!("header announces {} entries, the file has {found}", header.entries);
    let diagnostic = Diagnostic::new(Code::MatrixCount, message);
    Some(if body.count > header.entries {
        diagnostic.with_help("correct the size line, or write the file again")
    } else {
        diagnostic
    })
}

fn wrong_triangles(header: &Header, body: &Coordinates) -> Option<Diagnostic> {
    match (header.symmetry, body.lower, body.upper) {
        (Symmetry::Symmetric, Some(lower), Some(upper)) => {
            let (stored, other, line) =
                if lower < upper { ("lower", "above", upper) } else { ("upper", "below", lower) };
            let message = format!(
                "matrix is declared symmetric and stored by its {stored} triangle, but this entry lies {other} the diagonal"
            );
            Some(Diagnostic::new(Code::MatrixTriangles, message).at_line(line))
        }
        (Symmetry::General, ..) => undeclared_triangle(body.sides(), |_| {
            "write `symmetric` instead of `general` in the first line, or store both triangles".into()
        }),
        _ => None,
    }
}
