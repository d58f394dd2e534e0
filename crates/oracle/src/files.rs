//! A model in other row orders and node numberings, and models as files.

use super::mesh::entries;
use super::random::Random;
use flexbody_linalg::CscMatrix;
use flexbody_model::{DofLabel, Nodes, RawMatrix, RawModel};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Order of the matrix rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DofOrder {
    NodeMajor,
    ComponentMajor,
    /// Random order from a seed.
    Shuffled(u64),
}

/// Node numbers and the order of the node table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Numbering {
    /// 1, 2, 3, ...
    Consecutive,
    /// Large numbers with gaps in random order, from a seed.
    Gaps(u64),
}

/// Entries of a symmetric matrix that a file holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Triangle {
    Lower,
    Upper,
    /// Both triangles, declared general.
    General,
}

/// Returns a model with its matrix rows and node table in another order; `raw` must be in the default order.
pub fn reordered(raw: &RawModel, order: DofOrder, numbering: Numbering) -> RawModel {
    assert!(raw.dofs.is_none(), "already labelled");
    let n = raw.nodes.len();
    // Old row of every new row; numbers of the nodes, and old node of every row of the table.
    let rows: Vec<usize> = match order {
        DofOrder::NodeMajor => (0..3 * n).collect(),
        DofOrder::ComponentMajor => (0..3 * n).map(|r| 3 * (r % n) + r / n).collect(),
        DofOrder::Shuffled(seed) => Random(seed).permutation(3 * n),
    };
    let (ids, table): (Vec<i64>, Vec<usize>) = match numbering {
        Numbering::Consecutive => (raw.nodes.ids.clone(), (0..n).collect()),
        Numbering::Gaps(seed) => {
            let mut random = Random(seed);
            let mut ids: Vec<i64> = (0..n as i64).map(|i| 1000 + 17 * i).collect();
            for id in &mut ids {
                *id += (random.next_u64() % 16) as i64;
            }
            let shuffled = random.permutation(n).into_iter().map(|i| ids[i]).collect();
            (shuffled, random.permutation(n))
        }
    };
    let mut inverse = vec![0u32; 3 * n];
    rows.iter().enumerate().for_each(|(new, &old)| inverse[old] = new as u32);
    let permuted = |m: &RawMatrix| {
        let moved: Vec<_> =
            entries(&m.matrix).map(|(r, c, v)| (inverse[r as usize], inverse[c as usize], v)).collect();
        RawMatrix { matrix: CscMatrix::from_triplets(3 * n, 3 * n, &moved), ..m.clone() }
    };
    let label = |&old: &usize| DofLabel { node: ids[old / 3], direction: (old % 3) as u8 + 1 };
    RawModel {
        stiffness: permuted(&raw.stiffness),
        mass: permuted(&raw.mass),
        nodes: Nodes {
            ids: table.iter().map(|&i| ids[i]).collect(),
            positions: table.iter().map(|&i| raw.nodes.positions[i]).collect(),
        },
        dofs: Some(rows.iter().map(label).collect()),
        ..raw.clone()
    }
}

/// Writes `K.mtx`, `M.mtx`, `nodes.csv`, `dofs.csv` (if rows are labelled) and `model.toml`. Returns the path of the
/// manifest.
pub fn write_model(folder: &Path, raw: &RawModel, triangle: Triangle) -> PathBuf {
    let save = |name: &str, text: String| std::fs::write(folder.join(name), text).expect("test folder");
    save("K.mtx", matrix_market(&raw.stiffness.matrix, triangle));
    save("M.mtx", matrix_market(&raw.mass.matrix, triangle));
    let mut nodes = "node,x,y,z\n".to_owned();
    for (id, [x, y, z]) in raw.nodes.ids.iter().zip(&raw.nodes.positions) {
        writeln!(nodes, "{id},{x:e},{y:e},{z:e}").expect("to a string");
    }
    save("nodes.csv", nodes);
    let mut manifest = format!("[model]\nname = \"{}\"\n", raw.data.description.name);
    if raw.data.description.units.stated {
        let (l, m, t) = (
            raw.data.description.units.length.name(),
            raw.data.description.units.mass.name(),
            raw.data.description.units.time.name(),
        );
        writeln!(manifest, "[model.units]\nlength = \"{l}\"\nmass = \"{m}\"\ntime = \"{t}\"")
            .expect("to a string");
    }
    manifest.push_str("[files]\nstiffness = \"K.mtx\"\nmass = \"M.mtx\"\nnodes = \"nodes.csv\"\n");
    if let Some(labels) = &raw.dofs {
        let mut dofs = "node,dir\n".to_owned();
        for label in labels {
            writeln!(dofs, "{},{}", label.node, label.direction).expect("to a string");
        }
        save("dofs.csv", dofs);
        manifest.push_str("dofs = \"dofs.csv\"\n");
    }
    save("model.toml", manifest);
    folder.join("model.toml")
}

/// Returns a matrix as Matrix Market text, with numbers that are read back bit by bit.
pub fn matrix_market(matrix: &CscMatrix, triangle: Triangle) -> String {
    let kept: Vec<_> = entries(matrix)
        .filter(|(r, c, _)| match triangle {
            Triangle::Lower => r >= c,
            Triangle::Upper => r <= c,
            Triangle::General => true,
        })
        .collect();
    let symmetry = if triangle == Triangle::General { "general" } else { "symmetric" };
    let mut text = format!("%%MatrixMarket matrix coordinate real {symmetry}\n");
    writeln!(text, "{} {} {}", matrix.n_rows(), matrix.n_cols(), kept.len()).expect("to a string");
    for (r, c, v) in kept {
        writeln!(text, "{} {} {v:e}", r + 1, c + 1).expect("to a string");
    }
    text
}
