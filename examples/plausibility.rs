//! Writes the table of evidence/pages/plausibility.md: findings of the checks of the mass against the stiffness on
//! every model at hand, in the right order and in wrong ones.
//!
//!     cargo run --release --example plausibility
//!
//! With folders of models as arguments it prints their rows only.

use flexbody_base::diagnostic::Code;
use flexbody_input::{ModelFiles, read_manifest, read_model};
use flexbody_model::{FeModel, Plausibility, RawModel};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Codes of the checks that are shown.
const JUDGING: [Code; 6] = [
    Code::MassOrder,
    Code::MassPairs,
    Code::MassesExchanged,
    Code::SpeedImplausible,
    Code::DensityImplausible,
    Code::InertiaImplausible,
];

/// Largest number of exchanges of two nodes for each model.
const EXCHANGES: usize = 60;
/// Number of nodes to check over all exchanges of a model.
const CHECKED: usize = 40_000;

/// Names under which models without a manifest are shown.
const NAMES: [(&str, &str); 9] = [
    ("a_beam_c3d20", "slender rod, CalculiX C3D20"),
    ("b_conrod_30k", "connecting rod, CalculiX C3D10"),
    ("e_bracket_near", "bracket, CalculiX C3D20"),
    ("f_cube_c3d8", "cube, CalculiX C3D8"),
    ("g_two_1e6", "steel and rubber, 1e6 : 1, CalculiX C3D20"),
    ("i_plane_stress", "plate with holes, plane, quadratic triangles"),
    ("j_frame_ops_cmass", "ladder frame, OpenSees consistent mass"),
    ("j_frame_own", "ladder frame, beams"),
    ("k_c3d8r_singularM", "bar, CalculiX C3D8R"),
];

fn main() {
    let chosen: Vec<PathBuf> = std::env::args().skip(1).map(PathBuf::from).collect();
    if !chosen.is_empty() {
        return chosen.iter().for_each(|folder| println!("{}", row(folder)));
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders = subfolders(&root.join("fixtures/models"));
    folders.push(root.join("fixtures/small/tet4"));
    folders.extend(subfolders(&root.join("../shared/models")));
    let mut table = String::from(
        "| model | pairs of M | not of K | speed, whole / median (m/s) | density, quartiles (kg/m^3) | found in the right order | M in random order | M reversed | two far nodes exchanged | two coupled nodes exchanged | largest undetected change | smallest detected change |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    folders.iter().for_each(|folder| table.push_str(&format!("{}\n", row(folder))));
    let path = root.join("evidence/pages/plausibility.md");
    let page = std::fs::read_to_string(&path).expect("the page");
    let (before, rest) = page.split_once("<!-- models -->\n").expect("a place for the table");
    let (_, after) = rest.split_once("<!-- end of models -->").expect("an end of the table");
    let page = format!("{before}<!-- models -->\n{table}<!-- end of models -->{after}");
    std::fs::write(&path, page).expect("written");
}

fn subfolders(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut folders: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    folders.sort();
    folders
}

fn read(folder: &Path) -> RawModel {
    let manifest = folder.join("model.toml");
    if manifest.exists() {
        return read_model(&read_manifest(manifest).expect("a manifest")).expect("a model");
    }
    let path = |name: &str| folder.join(name);
    let matrix = |name: &str| {
        [format!("{name}.mtx.gz"), format!("{name}.mtx")]
            .map(|n| path(&n))
            .into_iter()
            .find(|p| p.exists())
            .expect("a matrix")
    };
    let meta: serde_json::Value = std::fs::read_to_string(path("meta.json"))
        .map_or(serde_json::Value::Null, |text| serde_json::from_str(&text).expect("JSON"));
    let units = meta["units"].as_str().map(|units| units.split(", ").take(3).collect::<Vec<_>>().join(","));
    let files = ModelFiles::from_arguments(
        matrix("K"),
        matrix("M"),
        path("nodes.csv"),
        Some(path("dofs.csv")),
        units.as_deref(),
    );
    let files = files.expect("units");
    let plane = std::fs::read_to_string(path("dofs.csv"))
        .expect("labels")
        .lines()
        .skip(1)
        .all(|line| !line.ends_with(",3"));
    read_model(&ModelFiles { dimension: if plane { 2 } else { 3 }, ..files }).expect("a model")
}

/// The codes of what is told.
fn told(raw: RawModel) -> (BTreeSet<&'static str>, Option<Plausibility>) {
    let (diagnostics, facts) = match FeModel::from_raw(raw) {
        Ok(checked) => (checked.diagnostics, Some(checked.plausibility)),
        Err(error) => (error.into_diagnostics(), None),
    };
    (
        diagnostics.iter().map(|d| d.code()).filter(|code| JUDGING.contains(code)).map(Code::id).collect(),
        facts,
    )
}

fn codes(found: &BTreeSet<&'static str>) -> String {
    if found.is_empty() { "-".to_owned() } else { found.iter().copied().collect::<Vec<_>>().join(", ") }
}

/// The rows of each node in the matrices.
fn rows_of_nodes(raw: &RawModel) -> Vec<Vec<u32>> {
    let d = usize::from(raw.dimension);
    let Some(dofs) = &raw.dofs else {
        return (0..raw.nodes.len()).map(|i| (d * i..d * i + d).map(|row| row as u32).collect()).collect();
    };
    let mut rows: BTreeMap<i64, Vec<(u8, u32)>> = BTreeMap::new();
    for (row, label) in dofs.iter().enumerate() {
        rows.entry(label.node).or_default().push((label.direction, row as u32));
    }
    let sorted = |mut own: Vec<(u8, u32)>| {
        own.sort_unstable();
        own.into_iter().map(|(_, row)| row).collect()
    };
    rows.into_values().map(sorted).collect()
}

/// The model with the mass of each node at the place of another with as many rows, and by which part that
/// changes M.
fn moved(raw: &RawModel, rows: &[Vec<u32>], to: &[usize]) -> (RawModel, f64) {
    let mut place: Vec<u32> = (0..raw.mass.matrix.n_cols() as u32).collect();
    for (own, &other) in rows.iter().zip(to).filter(|(own, other)| own.len() == rows[**other].len()) {
        own.iter().zip(&rows[other]).for_each(|(&from, &at)| place[from as usize] = at);
    }
    let mut model = raw.clone();
    model.mass.matrix = raw.mass.matrix.permuted(&place);
    let (mut change, mut size) = (0.0, 0.0);
    for column in 0..place.len() {
        let (indices, values) = raw.mass.matrix.column(column);
        for (&row, &value) in indices.iter().zip(values) {
            change += (value - model.mass.matrix.get(row as usize, column)).powi(2);
            size += value * value;
        }
    }
    (model, (change / size).sqrt())
}

struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % n
    }
}

/// Messages about exchanges of two nodes, and the changes of M with and without a message.
#[derive(Default)]
struct Exchanges {
    tried: usize,
    told: BTreeMap<String, usize>,
    seen: Vec<f64>,
    unseen: Vec<f64>,
}

impl Exchanges {
    fn tries(&mut self, raw: &RawModel, rows: &[Vec<u32>], [a, b]: [usize; 2]) {
        let mut to: Vec<usize> = (0..rows.len()).collect();
        to.swap(a, b);
        let (model, change) = moved(raw, rows, &to);
        // Nodes with the same mass all around: nothing is wrong.
        if rows[a].len() != rows[b].len() || change < 1e-9 {
            return;
        }
        self.tried += 1;
        let found = told(model).0;
        if found.is_empty() { &mut self.unseen } else { &mut self.seen }.push(change);
        if !found.is_empty() {
            *self.told.entry(codes(&found)).or_default() += 1;
        }
    }

    fn text(&self) -> String {
        let told: Vec<String> = self.told.iter().map(|(codes, count)| format!("{codes} {count}")).collect();
        match self.tried {
            0 => "no change".to_owned(),
            tried => format!("{} of {tried}", if told.is_empty() { "0".to_owned() } else { told.join(", ") }),
        }
    }
}

fn row(folder: &Path) -> String {
    let folder_name = folder.file_name().expect("a folder").to_string_lossy().into_owned();
    let name =
        NAMES.iter().find(|(known, _)| *known == folder_name).map_or(folder_name.as_str(), |(_, name)| name);
    let raw = read(folder);
    let (right, facts) = told(raw.clone());
    let facts = facts.expect("a sound model");
    let (length, mass, time) = (
        raw.data.description.units.length.to_si(),
        raw.data.description.units.mass.to_si(),
        raw.data.description.units.time.to_si(),
    );
    let speed = facts.sound_speed.map_or("-".to_owned(), |s| {
        format!("{:.0} / {:.0}", s.whole * length / time, s.median * length / time)
    });
    let density = facts.densities.map_or("-".to_owned(), |d| {
        d.quartiles.map(|density| format!("{:.0}", density * mass / length.powi(3))).join(", ")
    });
    let rows = rows_of_nodes(&raw);
    let n = rows.len();
    let mut random = Random(1);
    let whole = |to: &[usize]| {
        let (model, change) = moved(&raw, &rows, to);
        if change < 1e-9 { "no change".to_owned() } else { codes(&told(model).0) }
    };
    let mut shuffled: Vec<usize> = (0..n).collect();
    // Only nodes with as many rows change places.
    for i in (1..n).rev() {
        let j = random.below(i + 1);
        if rows[shuffled[i]].len() == rows[i].len()
            && rows[shuffled[j]].len() == rows[i].len()
            && rows[j].len() == rows[i].len()
        {
            shuffled.swap(i, j);
        }
    }
    let reversed: Vec<usize> = (0..n).rev().collect();
    let reversed_alone: Vec<usize> =
        if reversed.iter().enumerate().all(|(i, &j)| rows[i].len() == rows[j].len()) {
            reversed
        } else {
            (0..n).collect()
        };
    let (mut far, mut near) = (Exchanges::default(), Exchanges::default());
    let vertex: BTreeMap<u32, usize> =
        rows.iter().enumerate().flat_map(|(i, own)| own.iter().map(move |&row| (row, i))).collect();
    for _ in 0..(CHECKED / n).clamp(5, EXCHANGES) {
        far.tries(&raw, &rows, [random.below(n), random.below(n)]);
        let a = random.below(n);
        let coupled = raw.stiffness.matrix.column(rows[a][0] as usize).0;
        near.tries(&raw, &rows, [a, vertex[&coupled[random.below(coupled.len())]]]);
    }
    let largest =
        |changes: &[&Vec<f64>]| changes.iter().flat_map(|c| c.iter()).fold(0.0f64, |m, &c| m.max(c));
    let passes = largest(&[&far.unseen, &near.unseen]);
    let least = far.seen.iter().chain(&near.seen).fold(f64::INFINITY, |m, &c| m.min(c));
    format!(
        "| {name} | {} | {} | {speed} | {density} | {} | {} | {} | {} | {} | {} | {} |",
        facts.mass_pairs,
        facts.foreign_pairs,
        codes(&right),
        whole(&shuffled),
        whole(&reversed_alone),
        far.text(),
        near.text(),
        if passes > 0.0 { format!("{passes:.1e}") } else { "-".to_owned() },
        if least.is_finite() { format!("{least:.1e}") } else { "-".to_owned() },
    )
}
