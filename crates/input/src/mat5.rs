//! Matrices in MAT-files of MATLAB, versions 5 to 7, as MATLAB, Octave and SciPy write them: "MAT-File Format", The
//! MathWorks. Files of version 7.3 are HDF5.

use super::named_matrices::NamedMatrices;
use super::reader::{MatrixRole, MatrixSource, Reader};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_model::RawMatrix;

mod elements;
mod variable;

use elements::{Found, Order};
use variable::{Variable, VariableKind};

/// Reader of MAT-files.
pub(super) struct Mat5;

/// Number of bytes of the header: text, version and byte order.
const HEADER: usize = 128;
/// Kinds of elements that are variables.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;

const NAMES: NamedMatrices = NamedMatrices { holder: "variable", file: "FILE.mat", matrices: "matrices" };
const HELP: &str = "write it again: save('FILE.mat', 'K', 'M')";

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

    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix> {
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
}

/// Reads the heads of all variables of the file.
fn variables(bytes: &[u8], order: Order) -> Found<Vec<Variable<'_>>> {
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
            MATRIX => variables.push(Variable::open(body, false, order)?),
            COMPRESSED => variables.push(Variable::open(body, true, order)?),
            // Elements of other kinds are skipped.
            _ => {}
        }
        rest = after;
    }
    Ok(variables)
}

/// Returns the variable that the user named.
fn named<'v, 'a>(variables: &'v [Variable<'a>], name: &str) -> Found<&'v Variable<'a>> {
    let path = name.trim_matches('/');
    let outer = path.split('/').next().unwrap_or(path);
    let mut found = variables.iter().filter(|variable| variable.name == outer);
    match (found.next(), found.next()) {
        (Some(variable), None) if outer == path => Ok(variable),
        (Some(variable), None) => {
            let message = format!("`{path}` is within the variable `{}`, which is not read", variable.name);
            let help = format!("save its fields as variables: save('FILE.mat', '-struct', '{outer}')");
            Err(Diagnostic::new(Code::Hdf5Layout, message).with_help(help))
        }
        (Some(_), Some(_)) => {
            let message = format!("file has several variables `{outer}`");
            Err(Diagnostic::new(Code::Hdf5Layout, message).with_help(HELP))
        }
        (None, _) => {
            let message = format!("variable `{path}` is not in the file");
            let paths = paths(variables);
            let names: Vec<&str> = paths.iter().map(String::as_str).collect();
            let help = if names.is_empty() { HELP.to_owned() } else { NAMES.listing(&names) };
            Err(Diagnostic::new(Code::Hdf5Layout, message).with_help(help))
        }
    }
}

/// Returns the only sparse matrix, or the only one named after its role; in a file without sparse matrices, the only
/// square full one or the one named after its role.
fn search<'v, 'a>(variables: &'v [Variable<'a>], role: MatrixRole) -> Found<&'v Variable<'a>> {
    let sparse: Vec<&Variable<'a>> = variables.iter().filter(|v| v.kind == VariableKind::Sparse).collect();
    let is_full = |v: &&Variable<'a>| v.kind == VariableKind::Full && v.rows == v.columns && v.rows > 1;
    let candidates = if sparse.is_empty() { variables.iter().filter(is_full).collect() } else { sparse };
    if candidates.is_empty() {
        let message = "file holds no sparse matrix and no square one";
        return Err(Diagnostic::new(Code::Hdf5Layout, message).with_help(HELP));
    }
    let paths = paths(candidates.iter().copied());
    let names: Vec<&str> = paths.iter().map(String::as_str).collect();
    Ok(candidates[NAMES.choose(&names, role)?])
}

fn paths<'v, 'a: 'v>(variables: impl IntoIterator<Item = &'v Variable<'a>>) -> Vec<String> {
    variables.into_iter().map(|variable| format!("/{}", variable.name)).collect()
}
