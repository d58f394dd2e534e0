//! Simscape Multibody: input of the block Reduced Order Flexible Solid, with the names of the example in its
//! documentation ("Model an Excavator Dipper Arm as a Flexible Body"): `arm = load('body.mat')` gives
//! `arm.P0`, `arm.K`, `arm.M`, `arm.C`.

use super::export::hdf5_contents::{Hdf5Contents, hdf5_bytes};
use super::export::interface_matrices::{InterfaceMatrices, matrix_checklist};
use super::export::mat5::{Mat5Value, mat5};
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
