//! A plane body with closed forms: a rectangle of bilinear elements in plane stress.

use flexbody_linalg::CscMatrix;
use flexbody_model::{Nodes, RawModel};
use nalgebra::{Matrix2, Vector2};

pub const LENGTH: f64 = 2.0;
pub const HEIGHT: f64 = 0.5;
pub const YOUNGS: f64 = 70e9;
pub const POISSON: f64 = 0.3;
pub const DENSITY: f64 = 2700.0;

/// Returns a rectangle of unit thickness of bilinear elements in plane stress, rotated by `angle` about the origin and
/// moved.
pub fn rectangle(columns: usize, rows: usize, angle: f64, origin: [f64; 2]) -> RawModel {
    let (a, b) = (LENGTH / columns as f64, HEIGHT / rows as f64);
    let node = |i: usize, j: usize| (j * (columns + 1) + i) as u32;
    let rotation = Matrix2::new(angle.cos(), -angle.sin(), angle.sin(), angle.cos());
    let turned = |x: f64, y: f64| rotation * Vector2::new(x, y) + Vector2::from(origin);
    let positions = (0..=rows)
        .flat_map(|j| (0..=columns).map(move |i| (i as f64 * a, j as f64 * b)))
        .map(|(x, y)| {
            let p = turned(x, y);
            [p.x, p.y, 0.0]
        })
        .collect();
    let (mut k, mut m) = (Vec::new(), Vec::new());
    for j in 0..rows {
        for i in 0..columns {
            let nodes = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            let mut stiffness = [[0.0f64; 8]; 8];
            let mut mass = [[0.0f64; 4]; 4];
            let g = 1.0 / 3f64.sqrt();
            for (xi, eta) in [(-g, -g), (g, -g), (g, g), (-g, g)] {
                let weight = 0.25 * a * b;
                let shape = corners.map(|(s, t)| 0.25 * (1.0 + s * xi) * (1.0 + t * eta));
                let slope = corners.map(|(s, t)| {
                    rotation
                        * Vector2::new(
                            0.25 * s * (1.0 + t * eta) * 2.0 / a,
                            0.25 * t * (1.0 + s * xi) * 2.0 / b,
                        )
                });
                let c = YOUNGS / (1.0 - POISSON * POISSON);
                for p in 0..4 {
                    for q in 0..4 {
                        mass[p][q] += weight * DENSITY * shape[p] * shape[q];
                        let (u, v) = (slope[p], slope[q]);
                        let shear = 0.5 * (1.0 - POISSON) * c;
                        for r in 0..2 {
                            for s in 0..2 {
                                let dilation = if r == s { c } else { POISSON * c };
                                let mut value = dilation * u[r] * v[s];
                                value += shear * u[1 - r] * v[1 - s];
                                stiffness[2 * p + r][2 * q + s] += weight * value;
                            }
                        }
                    }
                }
            }
            for p in 0..8 {
                for q in 0..8 {
                    let (r, s) = (2 * nodes[p / 2] + p as u32 % 2, 2 * nodes[q / 2] + q as u32 % 2);
                    k.push((r, s, stiffness[p][q]));
                    if p % 2 == q % 2 {
                        m.push((r, s, mass[p / 2][q / 2]));
                    }
                }
            }
        }
    }
    let count = (columns + 1) * (rows + 1);
    let matrix = |entries: &[(u32, u32, f64)]| {
        let a = CscMatrix::from_triplets(2 * count, 2 * count, entries);
        // The matrix is made exactly symmetric, as FE programs write it.
        let b: Vec<(u32, u32, f64)> = (0..2 * count as u32)
            .flat_map(|j| {
                let a = &a;
                (0..2 * count as u32).map(move |i| {
                    (i, j, 0.5 * (a.get(i as usize, j as usize) + a.get(j as usize, i as usize)))
                })
            })
            .filter(|(.., v)| *v != 0.0)
            .collect();
        CscMatrix::from_triplets(2 * count, 2 * count, &b)
    };
    let nodes = Nodes { ids: (1..=count as i64).collect(), positions };
    RawModel { dimension: 2, ..RawModel::in_memory("rectangle", matrix(&k), matrix(&m), nodes) }
}
