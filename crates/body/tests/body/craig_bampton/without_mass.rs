//! Interfaces without mass.

use super::{bracket, lowest};
use flexbody_body::basis::{BasisChoice, CraigBampton};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::verification::verify;
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, FeModel, RawModel};
use nalgebra::DMatrix;
use oracle::turning::dense;

/// Returns the flexible eigenvalues of a model with a diagonal mass: rows without mass follow the others
/// statically.
fn condensed_eigenvalues(raw: &RawModel) -> Vec<f64> {
    let (k, m) = (dense(&raw.stiffness.matrix), dense(&raw.mass.matrix));
    let (heavy, light): (Vec<usize>, Vec<usize>) = (0..k.nrows()).partition(|&i| m[(i, i)] > 0.0);
    let part = |rows: &[usize], columns: &[usize]| k.select_rows(rows).select_columns(columns);
    let follow = part(&light, &light).cholesky().expect("held by the others").solve(&part(&light, &heavy));
    let own = part(&heavy, &heavy) - part(&heavy, &light) * follow;
    let scaled = DMatrix::from_fn(heavy.len(), heavy.len(), |i, j| {
        own[(i, j)] / (m[(heavy[i], heavy[i])] * m[(heavy[j], heavy[j])]).sqrt()
    });
    let mut eigenvalues: Vec<f64> = scaled.symmetric_eigenvalues().iter().copied().collect();
    eigenvalues.sort_by(f64::total_cmp);
    eigenvalues.split_off(6)
}

/// Shapes without mass follow elastic forces statically: with all fixed-interface modes the body has all
/// modes of the model, although the shapes of interface rows without mass are removed.
#[test]
fn interfaces_without_mass_leave_all_modes() {
    for couplings in
        [[Coupling::Free, Coupling::Free], [Coupling::Averaging, Coupling::Free], [Coupling::Averaging; 2]]
    {
        let mut raw = bracket(couplings);
        let light: Vec<i64> = raw.data.interfaces.iter().flat_map(|set| set.nodes.clone()).collect();
        let rows = raw.stiffness.matrix.n_rows();
        let mass = |row: usize| {
            if light.contains(&(row as i64 / 3 + 1)) { 0.0 } else { 0.3 + 0.01 * (row / 3) as f64 }
        };
        let entries: Vec<(u32, u32, f64)> =
            (0..rows).filter(|&i| mass(i) > 0.0).map(|i| (i as u32, i as u32, mass(i))).collect();
        raw.mass.matrix = CscMatrix::from_triplets(rows, rows, &entries);
        let exact = condensed_eigenvalues(&raw);
        let model = FeModel::from_raw(raw).expect("a model").model;
        let modes = lowest(usize::MAX);
        let basis = BasisChoice::CraigBampton(CraigBampton);
        let settings = ConvertSettings { modes, basis, lumped: Vec::new(), ..ConvertSettings::default() };
        let body = convert(&model, &settings, &Context::QUIET).expect("a body").body;
        assert_eq!(body.n_modes(), exact.len(), "{couplings:?}");
        for (own, exact) in body.modes().eigenvalue.iter().zip(&exact) {
            assert!((own / exact - 1.0).abs() < 1e-8, "{couplings:?}: {own} {exact}");
        }
        verify(&body, &model).expect("identities");
    }
}
