//! DMIG cards of Nastran: matrices whose entries name the grids and components of their rows and columns.

use super::assemble::{Entry, Sides, Storage, assemble, check_size, push, undeclared_triangle};
use super::bulk_cards::{Card, Item, is_bulk_data, read_deck};
use super::compression::Compression;
use super::coordinates::excerpt;
use super::digits::written_digits;
use super::nastran_names::choose;
use super::reader::{MatrixSource, Reader};
use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::{Error, Result};
use crate::model::RawMatrix;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A grid or scalar point and its component: 1 to 6, of a scalar point 0.
pub(super) type Point = (i64, u8);

/// Bad cards that are told one by one.
const SHOWN: usize = 5;

/// All matrices of a deck.
#[derive(Default)]
pub(super) struct Dmigs {
    matrices: Vec<Dmig>,
    points: Vec<Point>,
    numbers: HashMap<Point, u32>,
    bad: Vec<Diagnostic>,
}

struct Dmig {
    name: String,
    form: i64,
    /// 1, 2: real numbers; complex ones are passed over.
    kind: i64,
    path: PathBuf,
    line: usize,
    /// Numbers of the points of row and column, and the value.
    entries: Vec<(u32, u32, f64)>,
    written: u8,
}

impl Dmig {
    fn is_real(&self) -> bool {
        matches!(self.kind, 1 | 2)
    }
}

impl Dmigs {
    /// Those of some files.
    ///
    /// # Errors
    /// FB101, FB106, FB110, FB301, FB302, as many as are found.
    pub(super) fn of(paths: &[PathBuf]) -> std::result::Result<Self, Vec<Diagnostic>> {
        let mut all = Self::default();
        for path in paths {
            let read = read_deck(path, &mut |item| match item {
                Item::Card(card, path) if card.name == "DMIG" => all.card(card, path),
                _ => {}
            });
            read.map_err(|diagnostic| vec![diagnostic])?;
        }
        let bad = all.take_bad();
        if bad.is_empty() { Ok(all) } else { Err(bad) }
    }

    /// Takes a DMIG card.
    pub(super) fn card(&mut self, card: &Card, path: &Path) {
        let taken = match card.field(1) {
            b"0" => self.header(card, path),
            _ => self.column(card, path),
        };
        if let Err(bad) = taken
            && self.bad.len() < SHOWN
        {
            self.bad.push(bad);
        }
    }

    /// What is wrong with the cards.
    pub(super) fn take_bad(&mut self) -> Vec<Diagnostic> {
        std::mem::take(&mut self.bad)
    }

    /// Names of the matrices, in the order of the deck.
    pub(super) fn names(&self) -> Vec<String> {
        self.matrices.iter().map(|matrix| matrix.name.clone()).collect()
    }

    /// The points that entries of some matrices which are not zero name, ascending.
    pub(super) fn points(&self, of: &[usize]) -> Vec<Point> {
        let mut named = vec![false; self.points.len()];
        for &(row, column, value) in of.iter().flat_map(|&k| &self.matrices[k].entries) {
            if value != 0.0 {
                named[row as usize] = true;
                named[column as usize] = true;
            }
        }
        let mut points: Vec<Point> =
            self.points.iter().zip(named).filter(|(_, named)| *named).map(|(point, _)| *point).collect();
        points.sort_unstable();
        points
    }

    /// A matrix with its rows in the order of `points`, which ascend and hold all that its entries name.
    ///
    /// # Errors
    /// FB302 for matrices that are not square, FB307 for a triangle that is not declared, FB309 for entries
    /// that are given twice, FB301, FB306, FB312.
    pub(super) fn matrix(&self, k: usize, points: &[Point]) -> std::result::Result<RawMatrix, Diagnostic> {
        let own = &self.matrices[k];
        let about = |diagnostic: Diagnostic| {
            diagnostic.about(format!("DMIG {}", own.name)).in_file(&own.path).at_line(own.line)
        };
        if !own.is_real() {
            let message = format!("type {} is complex", own.kind);
            let help = "write real matrices, without structural damping";
            return Err(about(Diagnostic::new(Code::MatrixKind, message).with_help(help)));
        }
        let storage = match own.form {
            1 | 2 | 9 => Storage::Full,
            6 => Storage::Triangle,
            other => {
                let message = format!("form {other} is none of a symmetric matrix");
                return Err(about(
                    Diagnostic::new(Code::MatrixKind, message).with_help("forms are 1, 2, 6, 9"),
                ));
            }
        };
        let row_of: Vec<Option<u32>> =
            self.points.iter().map(|point| points.binary_search(point).ok().map(|row| row as u32)).collect();
        let (mut pieces, mut sides, mut places) = (Vec::new(), Sides::default(), Vec::new());
        for &(row, column, value) in own.entries.iter().filter(|(.., value)| *value != 0.0) {
            let (Some(row), Some(col)) = (row_of[row as usize], row_of[column as usize]) else { continue };
            sides.lower |= row > col;
            sides.upper |= row < col;
            places.push(match storage {
                Storage::Full => (row, col),
                Storage::Triangle => (row.max(col), row.min(col)),
            });
            push(&mut pieces, Entry { row, col, value });
        }
        places.sort_unstable();
        if let Some(twice) = places.windows(2).find(|pair| pair[0] == pair[1]) {
            let [row, column] = [twice[0].0, twice[0].1].map(|row| named(points[row as usize]));
            let message = format!("the entry of {row} and {column} is given twice");
            let help = "form 6 has one triangle; write the matrix again";
            return Err(about(Diagnostic::new(Code::MatrixTriangles, message).with_help(help)));
        }
        if storage == Storage::Full
            && let Some(triangle) = undeclared_triangle(sides, |_| "declare form 6 in the DMIG header".into())
        {
            return Err(about(triangle));
        }
        let n = points.len() as u64;
        let n = check_size(n, n, own.entries.len() as u64).map_err(about)?;
        assemble(n, pieces, storage, own.written, &own.path)
    }

    fn header(&mut self, card: &Card, path: &Path) -> std::result::Result<(), Diagnostic> {
        let name = String::from_utf8_lossy(card.field(0)).to_uppercase();
        let syntax = |expected: &str| bad_card(card, 0, path, format!("DMIG {name}: {expected}"));
        let (Some(form), Some(kind)) = (card.integer(2), card.integer(3)) else {
            return Err(syntax("expected 0, form, type of the input"));
        };
        if name.is_empty() {
            return Err(syntax("the matrix has no name"));
        }
        if self.matrices.iter().any(|known| known.name == name) {
            return Err(syntax("the matrix is given twice"));
        }
        let line = card.line();
        self.matrices.push(Dmig {
            name,
            form,
            kind,
            path: path.to_path_buf(),
            line,
            entries: Vec::new(),
            written: 0,
        });
        Ok(())
    }

    fn column(&mut self, card: &Card, path: &Path) -> std::result::Result<(), Diagnostic> {
        let name = String::from_utf8_lossy(card.field(0)).to_uppercase();
        let Some(at) = self.matrices.iter().rposition(|known| known.name == name) else {
            let message = format!("a column of DMIG {name} stands above its header");
            return Err(bad_card(card, 0, path, message));
        };
        if !self.matrices[at].is_real() {
            return Ok(());
        }
        let column = self.point(card, 1, path)?;
        for k in (4..card.len()).step_by(4) {
            if (k..k + 4).all(|k| card.field(k).is_empty()) {
                continue;
            }
            let row = self.point(card, k, path)?;
            let value = match (card.real(k + 2), card.real(k + 3)) {
                (Some(value), Some(0.0)) => value,
                (Some(_), Some(_)) => {
                    return Err(bad_card(
                        card,
                        k,
                        path,
                        format!("DMIG {name}: a real matrix has a complex entry"),
                    ));
                }
                _ => {
                    let text = excerpt(card.field(k + 2));
                    let message = format!("DMIG {name}: expected a finite number, found `{text}`");
                    return Err(bad_card(card, k, path, message));
                }
            };
            let own = &mut self.matrices[at];
            own.written = own.written.max(written_digits(card.field(k + 2)));
            own.entries.push((row, column, value));
        }
        Ok(())
    }

    /// The number of the point that two fields name.
    fn point(&mut self, card: &Card, k: usize, path: &Path) -> std::result::Result<u32, Diagnostic> {
        let component = card.integer(k + 1).filter(|component| (0..=6).contains(component));
        let id = card.integer(k).filter(|id| *id > 0);
        let (Some(id), Some(component)) = (id, component) else {
            let found = [k, k + 1].map(|k| excerpt(card.field(k)));
            let message = format!(
                "DMIG: expected a grid and a component from 0 to 6, found `{}`, `{}`",
                found[0], found[1]
            );
            return Err(bad_card(card, k, path, message));
        };
        let point = (id, component as u8);
        let next = self.points.len() as u32;
        Ok(*self.numbers.entry(point).or_insert_with(|| {
            self.points.push(point);
            next
        }))
    }
}

fn bad_card(card: &Card, field: usize, path: &Path, message: impl Into<String>) -> Diagnostic {
    Diagnostic::new(Code::MatrixSyntax, message)
        .in_file(path)
        .at_line(card.line_of(field))
        .with_help("write the matrix again")
}

fn named((id, component): Point) -> String {
    match component {
        0 => format!("scalar point {id}"),
        _ => format!("grid {id} component {component}"),
    }
}

/// The reader of matrices in punch files.
pub(super) struct DmigPunch;

impl Reader for DmigPunch {
    fn name(&self) -> &'static str {
        "DMIG punch"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["pch", "bdf"]
    }

    fn recognises(&self, head: &[u8]) -> bool {
        is_bulk_data(head)
    }

    /// Rows are the points that any matrix of the file names, ascending.
    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix> {
        let path = source.file.path();
        if source.compression != Compression::None {
            let message = "file of Nastran is compressed as a whole";
            let diagnostic = Diagnostic::new(Code::FileFormatUnknown, message).in_file(path);
            return Err(diagnostic.with_help("unpack it").into());
        }
        let all = Dmigs::of(&[path.to_path_buf()]).map_err(Error::new)?;
        let at = choose(&all.names(), source.role, source.group).map_err(|d| d.in_file(path))?;
        let every: Vec<usize> = (0..all.matrices.len()).collect();
        Ok(all.matrix(at, &all.points(&every))?)
    }
}
