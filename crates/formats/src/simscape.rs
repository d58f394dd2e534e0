//! Simscape Multibody: input of the block Reduced Order Flexible Solid, with the names of the example in its
//! documentation ("Model an Excavator Dipper Arm as a Flexible Body"): `arm = load('body.mat')` gives
//! `arm.P0`, `arm.K`, `arm.M`, `arm.C`.

use super::export::hdf5_contents::{Hdf5Contents, hdf5_bytes};
use super::export::matrices::{InterfaceMatrices, matrix_checklist};
use super::export::{ExportChecklist, ExportFormat, ExportOptions, Exported};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;

/// Export format of Simscape Multibody.
pub(crate) struct Simscape;

const HDF5: &str = "hdf5";

impl ExportFormat for Simscape {
    fn name(&self) -> &'static str {
        "simscape"
    }

    fn reader(&self) -> &'static str {
        "Simscape Multibody, Reduced Order Flexible Solid"
    }

    fn dialects(&self) -> &'static [&'static str] {
        &["mat5", HDF5]
    }

    fn checklist(&self, body: &FlexBody, options: &ExportOptions) -> ExportChecklist {
        matrix_checklist(body, options)
    }

    fn write(&self, body: &FlexBody, options: &ExportOptions) -> Result<Exported> {
        let interface_matrices = InterfaceMatrices::of(body, "simscape")?;
        let names: Vec<&str> = interface_matrices.frames.iter().map(|(name, _)| *name).collect();
        let (pose, units) = (body.frame(), body.units());
        let units = [units.length.name(), units.mass.name(), units.time.name()];
        let small = [
            (
                "P0",
                Mat::from_fn(interface_matrices.frames.len(), 3, |i, k| interface_matrices.frames[i].1[k]),
            ),
            ("origin", Mat::from_fn(1, 3, |_, k| pose.origin[k])),
            ("axes", Mat::from_fn(3, 3, |i, j| pose.axes[(i, j)])),
        ];
        let mut matrices = vec![("K", interface_matrices.stiffness), ("M", interface_matrices.mass)];
        matrices.extend(interface_matrices.damping.as_ref().map(|damping| ("C", damping)));
        matrices.extend(small.iter().map(|(name, matrix)| (*name, matrix)));
        if options.dialect.as_deref() == Some(HDF5) {
            let mut root: Vec<_> =
                matrices.iter().map(|(name, matrix)| Hdf5Contents::matrix(matrix).named(*name)).collect();
            for (name, texts) in [("frames", names.as_slice()), ("units", &units)] {
                let texts = ascii(&serde_json::to_string(texts).expect("strings are valid JSON"));
                root.push(Hdf5Contents::Text(texts).named(name));
            }
            return hdf5_bytes(&root).map(Exported::single);
        }
        let mut variables: Vec<(&str, Mat5Value<'_>)> =
            matrices.iter().map(|(name, matrix)| (*name, Mat5Value::Matrix(matrix))).collect();
        variables.push(("frames", Mat5Value::Text(names)));
        variables.push(("units", Mat5Value::Text(units.to_vec())));
        let too_large = || {
            let message = "simscape cannot hold a matrix of more than 4 GiB in a MAT-file of version 5";
            Diagnostic::new(Code::ExportLoses, message)
                .with_help("use --dialect hdf5, which has no such limit")
                .into()
        };
        mat5(&variables).map(Exported::single).ok_or_else(too_large)
    }
}

/// Returns JSON in ASCII, which Octave reads; other characters are written as escape sequences.
fn ascii(json: &str) -> String {
    let mut out = String::with_capacity(json.len());
    for c in json.chars() {
        if c.is_ascii() {
            out.push(c);
        } else {
            let mut units = [0; 2];
            out.extend(c.encode_utf16(&mut units).iter().map(|unit| format!("\\u{unit:04x}")));
        }
    }
    out
}

// MAT-files of version 5, little-endian, not compressed: "MATLAB MAT-File Format", The MathWorks.

/// Contents of a variable.
enum Mat5Value<'a> {
    /// Matrix of 64-bit floats.
    Matrix(&'a Mat<f64>),
    /// Rows of characters, padded with blanks to one length.
    Text(Vec<&'a str>),
}

/// Returns the file with these variables; `None` if a variable has more bytes than the format can state.
///
/// The names must be valid names of MATLAB variables.
fn mat5(variables: &[(&str, Mat5Value<'_>)]) -> Option<Vec<u8>> {
    let mut file = b"MATLAB 5.0 MAT-file, written by flexbody".to_vec();
    file.resize(124, b' ');
    // The offset of subsystem data is zero: there are none.
    file[116..].fill(0);
    file.extend(VERSION.to_le_bytes());
    file.extend(b"IM");
    for (name, value) in variables {
        file.extend(element(MATRIX, &variable(name, value)?)?);
    }
    Some(file)
}

const VERSION: u16 = 0x0100;

// Types of elements.
const INT8: u32 = 1;
const UINT16: u32 = 4;
const INT32: u32 = 5;
const UINT32: u32 = 6;
const DOUBLE: u32 = 9;
const MATRIX: u32 = 14;

// Classes of arrays.
const CHARACTERS: u32 = 4;
const DOUBLES: u32 = 6;

fn variable(name: &str, value: &Mat5Value<'_>) -> Option<Vec<u8>> {
    let (class, rows, columns, data) = match value {
        Mat5Value::Matrix(a) => {
            let bytes: Vec<u8> =
                a.col_iter().flat_map(|column| column.iter().flat_map(|v| v.to_le_bytes())).collect();
            (DOUBLES, a.nrows(), a.ncols(), element(DOUBLE, &bytes)?)
        }
        Mat5Value::Text(lines) => {
            let lines: Vec<Vec<u16>> = lines.iter().map(|line| line.encode_utf16().collect()).collect();
            let longest = lines.iter().map(Vec::len).max().unwrap_or(0);
            let unit = |i: usize, j: usize| lines[i].get(j).copied().unwrap_or(u16::from(b' '));
            let places = (0..longest).flat_map(|j| (0..lines.len()).map(move |i| (i, j)));
            let bytes: Vec<u8> = places.flat_map(|(i, j)| unit(i, j).to_le_bytes()).collect();
            (CHARACTERS, lines.len(), longest, element(UINT16, &bytes)?)
        }
    };
    let extents = [rows, columns].map(|extent| i32::try_from(extent).ok());
    let mut body = element(UINT32, &[class.to_le_bytes(), [0; 4]].concat())?;
    body.extend(element(INT32, &[extents[0]?.to_le_bytes(), extents[1]?.to_le_bytes()].concat())?);
    body.extend(element(INT8, name.as_bytes())?);
    body.extend(data);
    Some(body)
}

/// Returns an element: type, number of bytes, and the bytes padded to a multiple of eight; up to four bytes
/// are in the tag itself.
fn element(kind: u32, bytes: &[u8]) -> Option<Vec<u8>> {
    let length = u32::try_from(bytes.len()).ok()?;
    let mut out = if (1..=4).contains(&length) {
        (length << 16 | kind).to_le_bytes().to_vec()
    } else {
        [kind.to_le_bytes(), length.to_le_bytes()].concat()
    };
    out.extend(bytes);
    out.resize(out.len().next_multiple_of(8), 0);
    Some(out)
}
