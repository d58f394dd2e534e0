//! Homogeneous cuboids of trilinear hexahedra. The consistent mass is a tensor product of the mass matrices of linear
//! bars, written here without any element code.

use flexbody_linalg::{CscMatrix, SymmetricMatrix};

/// Grid of nx x ny x nz elements over the box from `low` to `low` + `size`.
pub struct Cuboid {
    pub cells: [usize; 3],
    pub low: [f64; 3],
    pub size: [f64; 3],
    pub density: f64,
}

/// Returns the mass matrix of n linear bar elements over a length, by row: (column, value).
fn bar(n: usize, length: f64) -> Vec<Vec<(usize, f64)>> {
    let h = length / n as f64;
    (0..=n)
        .map(|i| {
            let inner = if i == 0 || i == n { 1.0 } else { 2.0 };
            let mut row = vec![(i, inner * h / 3.0)];
            if i > 0 {
                row.insert(0, (i - 1, h / 6.0));
            }
            if i < n {
                row.push((i + 1, h / 6.0));
            }
            row
        })
        .collect()
}

impl Cuboid {
    pub fn mass(&self) -> f64 {
        self.density * self.size.iter().product::<f64>()
    }

    fn index(&self, i: [usize; 3]) -> usize {
        (i[2] * (self.cells[1] + 1) + i[1]) * (self.cells[0] + 1) + i[0]
    }

    fn nodes(&self) -> impl Iterator<Item = [usize; 3]> + use<> {
        let [nx, ny, nz] = self.cells;
        (0..=nz).flat_map(move |z| (0..=ny).flat_map(move |y| (0..=nx).map(move |x| [x, y, z])))
    }

    pub fn positions(&self) -> Vec<[f64; 3]> {
        let at = |i: usize, k: usize| self.low[k] + self.size[k] * i as f64 / self.cells[k] as f64;
        self.nodes().map(|i| [at(i[0], 0), at(i[1], 1), at(i[2], 2)]).collect()
    }

    /// Returns the scalar mass matrix Ms, with M = Ms kron I3.
    pub fn scalar_mass(&self) -> SymmetricMatrix {
        let bars: [_; 3] = std::array::from_fn(|k| bar(self.cells[k], self.size[k]));
        let (mut col_ptr, mut row_idx, mut values) = (vec![0], Vec::new(), Vec::new());
        for i in self.nodes() {
            for &(z, mz) in &bars[2][i[2]] {
                for &(y, my) in &bars[1][i[1]] {
                    for &(x, mx) in &bars[0][i[0]] {
                        row_idx.push(self.index([x, y, z]) as u32);
                        values.push(self.density * mx * my * mz);
                    }
                }
            }
            col_ptr.push(row_idx.len());
        }
        let n = col_ptr.len() - 1;
        SymmetricMatrix::new(CscMatrix::from_parts(n, n, col_ptr, row_idx, values))
            .expect("symmetric by construction")
    }
}
