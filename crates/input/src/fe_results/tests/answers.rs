//! Answers to shapes, written by the tests: their displacements and stresses, and the folder of their files.

use crate::fe_results::{AnswerFiles, read_answers};
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_base::units::UnitSystem;
use flexbody_model::{AnsweredShapes, RecoveryOperator, RecoveryRow};
use std::io::Write;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

pub(super) const NODES: [i32; 4] = [11, 4, 7, 1_000_000];

/// Returns a displacement of a node in a step.
pub(super) fn displacement(step: usize, node: i32, k: usize) -> f64 {
    let x = f64::from(node % 13) + 1.0;
    1e-3 * (x * (step + 1) as f64 + 0.37 * (k as f64 - 1.0) * x * x).sin()
}

/// Returns a stress in the order xx, yy, zz, xy, yz, xz.
pub(super) fn stress(step: usize, node: i32, component: usize) -> f64 {
    100.0 * (f64::from(node) + 3.0 * component as f64 + 0.5 * step as f64).cos()
}

/// Returns a number in the form of C and Fortran: 1.50000E+02.
pub(super) fn exponential(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$E}");
    let (mantissa, exponent) = text.split_once('E').expect("an exponent");
    let exponent: i32 = exponent.parse().expect("an exponent");
    format!("{mantissa}E{}{:02}", if exponent < 0 { '-' } else { '+' }, exponent.abs())
}

/// Returns an archive of the displacements of all nodes.
pub(super) fn archive(steps: usize) -> Vec<u8> {
    let npy = |kind: &str, shape: String, bytes: Vec<u8>| {
        let mut head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
        while (head.len() + 11) % 64 != 0 {
            head.push(' ');
        }
        head.push('\n');
        let length = u16::try_from(head.len()).expect("a short head").to_le_bytes();
        [b"\x93NUMPY\x01\x00", &length[..], head.as_bytes(), &bytes].concat()
    };
    let nodes = NODES.iter().flat_map(|node| i64::from(*node).to_le_bytes()).collect();
    let at =
        |step: usize| NODES.iter().flat_map(move |node| (0..3).map(move |k| displacement(step, *node, k)));
    let values = (0..steps).flat_map(at).flat_map(f64::to_le_bytes).collect();
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut zip = ZipWriter::new(&mut bytes);
    for (name, content) in [
        ("nodes.npy", npy("<i8", format!("{},", NODES.len()), nodes)),
        ("displacements.npy", npy("<f8", format!("{steps}, {}, 3", NODES.len()), values)),
    ] {
        zip.start_file(name, SimpleFileOptions::default()).expect("memory");
        zip.write_all(&content).expect("memory");
    }
    zip.finish().expect("memory");
    bytes.into_inner()
}

/// Folder with the archive of shapes and results.
pub(super) struct Place(pub TempDir);

impl Place {
    pub(super) fn new(shapes: usize) -> Self {
        let place = Self(tempfile::tempdir().expect("a folder"));
        place.put("ask.npz", &archive(shapes));
        place
    }

    pub(super) fn put(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        path
    }

    pub(super) fn read(
        &self,
        answers: &str,
        energies: Option<&str>,
    ) -> Diagnosed<(RecoveryOperator, Vec<Diagnostic>)> {
        let open = |name: &str| InputFile::open_unread(self.0.path().join(Path::new(name))).expect("a file");
        let (answers, displacements) = (open(answers), open("ask.npz"));
        let energies = energies.map(open);
        let (energies, listed) = (energies.as_ref(), Vec::new());
        let files = AnswerFiles { answers: &answers, displacements: &displacements, energies, listed };
        read_answers(&files, &UnitSystem::parse("mm", "t", "s").expect("units"))
    }

    pub(super) fn refused(&self, answers: &str, energies: Option<&str>) -> (Code, String) {
        let found = self.read(answers, energies).expect_err(answers);
        (found[0].code(), found[0].message().to_owned())
    }
}

/// Returns the answers to shapes of a recovery, and the labels of its rows.
pub(super) fn parts(operator: RecoveryOperator) -> (AnsweredShapes, Vec<RecoveryRow>) {
    let RecoveryOperator::Shapes { shapes, labels } = operator else { panic!("shapes") };
    (shapes, labels)
}
