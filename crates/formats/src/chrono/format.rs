//! Format `chrono`: a table of the nodes, and matrices as Matrix Market files.

use super::assembly::Assembly;
use crate::export::Holding::{Lost, NotApplicable};
use crate::export::interface_matrices::{InterfaceMatrices, matrix_checklist};
use crate::export::{ExportChecklist, ExportFormat, ExportOptions, Exported};
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use std::fmt::Write;

/// Export format of Project Chrono.
pub(crate) struct Chrono;

impl ExportFormat for Chrono {
    fn name(&self) -> &'static str {
        "chrono"
    }

    fn reader(&self) -> &'static str {
        "Project Chrono, ChModalAssembly: matrices for DoModalReduction"
    }

    fn checklist(&self, body: &FlexBody, options: &ExportOptions) -> ExportChecklist {
        ExportChecklist {
            gravity: Lost(
                "the point of action of gravity on the deformed body: Chrono distributes the weight over the nodes as on the undeformed body"
                    .to_owned(),
            ),
            units: NotApplicable,
            ..matrix_checklist(body, options)
        }
    }

    fn needs(&self, body: &FlexBody, _: &ExportOptions) -> Vec<String> {
        let Ok(given) = InterfaceMatrices::of(body, "chrono") else { return Vec::new() };
        let modes = Assembly::modes_to_request(given.mass.nrows() - 6 * given.frames.len());
        vec![
            format!(
                "DoModalReduction must request {modes} modes with SetReductionType(CRAIG_BAMPTON) and SetUseStaticCorrection(false): the body has no more"
            ),
            "gravity acts with SetModalAutomaticGravity(true) alone, the default: nodes and meshes have no mass \
             of their own"
                .to_owned(),
        ]
    }

    fn write(&self, body: &FlexBody, _: &ExportOptions) -> Result<Exported> {
        let given = InterfaceMatrices::of(body, "chrono")?;
        let assembly = Assembly::of(&given)?;
        let mut beside = vec![
            ("M.mtx".into(), matrix_market(&assembly.mass)),
            ("K.mtx".into(), matrix_market(&assembly.stiffness)),
        ];
        beside.extend(assembly.damping.as_ref().map(|damping| ("R.mtx".into(), matrix_market(damping))));
        Ok(Exported { file: table(&given, &assembly, centre_of_mass(body)), beside })
    }
}

/// Returns the centre of mass in the body frame.
fn centre_of_mass(body: &FlexBody) -> [f64; 3] {
    (body.invariants().first_moment() / body.invariants().mass()).into()
}

/// Returns the table of the boundary nodes, with a remark about the internal ones.
fn table(given: &InterfaceMatrices<'_>, assembly: &Assembly, [x, y, z]: [f64; 3]) -> Vec<u8> {
    let internal = assembly.mass.nrows() / 6 - given.frames.len();
    let mut table = format!(
        "# boundary nodes in the order of the matrices, then {internal} internal nodes, all at the centre of mass \
         {x:e} {y:e} {z:e}; modes to request: {}\nname,x,y,z\n",
        Assembly::modes_to_request(assembly.n_modes)
    );
    for (name, [x, y, z]) in &given.frames {
        let name = name.replace('"', "\"\"");
        writeln!(table, "\"{name}\",{x:e},{y:e},{z:e}").expect("writing to a String cannot fail");
    }
    table.into_bytes()
}

/// Returns a symmetric matrix with all its nonzero entries in the general form of Matrix Market, which more
/// readers support than the symmetric form.
fn matrix_market(a: &Mat<f64>) -> Vec<u8> {
    let size = a.nrows();
    let places = (0..size).flat_map(|j| (0..size).map(move |i| (i, j)));
    let entries: Vec<(usize, usize, f64)> =
        places.map(|(i, j)| (i + 1, j + 1, a[(i, j)])).filter(|(_, _, v)| *v != 0.0).collect();
    let mut text =
        format!("%%MatrixMarket matrix coordinate real general\n{size} {size} {}\n", entries.len());
    for (i, j, v) in entries {
        writeln!(text, "{i} {j} {v:e}").expect("writing to a String cannot fail");
    }
    text.into_bytes()
}
