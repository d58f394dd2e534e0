//! Command `flexbody doctor`: components of the program and resources of the machine.

use super::left_out::features_left_out;
use super::outcome::Outcome;
use super::resources::{address_space_limit, memory_left, use_threads};
use flexbody_base::error::Result;
use flexbody_base::hdf5_file::library_version;
use flexbody_base::provenance::generator;
use flexbody_linalg::instruction_set;
use serde::Serialize;

/// Findings of the command.
#[derive(Debug, Serialize)]
struct Findings {
    program: String,
    /// Operating system and processor family that the program was built for.
    built_for: String,
    hdf5: String,
    hdf5_from: &'static str,
    /// Features that this build leaves out; the key is missing if it has all.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    features_left_out: Vec<&'static str>,
    /// Instructions of sums and products on this machine; the last bits of results depend on them.
    instructions: &'static str,
    processors: usize,
    threads: usize,
    /// Free memory; `None` if the system does not report it.
    memory_left_bytes: Option<u64>,
    /// Limit of the address space; `None` if there is no limit, or the system does not report it.
    address_space_limit_bytes: Option<u64>,
    temporary_folder: String,
    temporary_folder_is_writable: bool,
}

impl Findings {
    fn new() -> Self {
        let folder = std::env::temp_dir();
        Self {
            program: generator(),
            built_for: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            hdf5: library_version(),
            hdf5_from: if cfg!(feature = "bundled-hdf5") { "built in" } else { "of the system" },
            features_left_out: features_left_out(),
            instructions: instruction_set(),
            processors: std::thread::available_parallelism().map_or(1, usize::from),
            threads: use_threads(None),
            memory_left_bytes: memory_left(None),
            address_space_limit_bytes: address_space_limit(),
            temporary_folder_is_writable: tempfile::tempfile_in(&folder).is_ok(),
            temporary_folder: folder.display().to_string(),
        }
    }

    fn text(&self) -> String {
        let gigabytes = |bytes: Option<u64>, none: &str| {
            bytes.map_or_else(|| none.to_owned(), |bytes| format!("{:.1} GB", bytes as f64 * 1e-9))
        };
        let writable = if self.temporary_folder_is_writable { "" } else { ", NOT WRITABLE" };
        let lines = [
            ("program", format!("{}, {}", self.program, self.built_for)),
            ("HDF5", format!("{}, {}", self.hdf5, self.hdf5_from)),
            ("processors", format!("{}, instructions {}", self.processors, self.instructions)),
            ("threads", self.threads.to_string()),
            ("memory", gigabytes(self.memory_left_bytes, "not reported by the system")),
            ("limit", gigabytes(self.address_space_limit_bytes, "none on address space")),
            ("temporary", format!("{}{writable}", self.temporary_folder)),
        ];
        let left_out = ("left out", self.features_left_out.join(", "));
        let left_out = (!left_out.1.is_empty()).then_some(left_out);
        lines.iter().chain(&left_out).map(|(label, text)| format!("{label:12}{text}\n")).collect()
    }
}

pub(super) fn run() -> Result<Outcome> {
    let findings = Findings::new();
    let json = serde_json::to_string_pretty(&findings).expect("plain numbers and texts");
    Ok(Outcome {
        text: findings.text(),
        json,
        diagnostics: Vec::new(),
        passed: findings.temporary_folder_is_writable,
    })
}
