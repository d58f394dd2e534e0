//! Stresses at nodes, from elements that K proves.

use crate::recovery::refuse_name;
use crate::wording::name_some;
use crate::{
    FeModel, ModelRecovery, NodalStress, Quantity, RecoveryOperator, RecoveryRow, STRAIN_NAMES, StressNodes,
};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;

impl FeModel {
    /// Adds a recovery for each request of stresses at nodes, after those of other operators.
    ///
    /// # Errors
    /// The errors of [`FeModel::proved_elements`]; [`RecoveryRows`](Code::RecoveryRows) for nodes of no element;
    /// [`ManifestSyntax`](Code::ManifestSyntax) for a name that is given twice.
    pub fn add_nodal_stresses(&mut self, asked: &[NodalStress]) -> Result<()> {
        let mut names = self.recoveries().iter().map(|recovery| recovery.name.clone()).collect();
        for NodalStress { name, nodes, path } in asked {
            refuse_name(name, &mut names)
                .map_err(|(code, message)| Diagnostic::new(code, format!("recovery {message}")))?;
            let operator =
                self.nodal_stress_rows(nodes).map_err(|error| error.about(format!("recovery `{name}`")))?;
            let recovery =
                ModelRecovery { name: name.clone(), operator, deformed_inertia: false, path: path.clone() };
            self.push_recovery(recovery);
        }
        Ok(())
    }

    fn nodal_stress_rows(&self, nodes: &StressNodes) -> Result<RecoveryOperator> {
        let elements = self.proved_elements()?;
        let wanted: Vec<i64> = match nodes {
            StressNodes::All => elements.deck_nodes().to_vec(),
            StressNodes::These(nodes) => nodes.clone(),
            StressNodes::Surface => {
                let Some(mesh) = self.mesh() else {
                    let message = "the surface of the model is not known";
                    let help = "name the deck in `mesh` of [files], or ask for stresses at all nodes (nodes)";
                    return Err(Diagnostic::new(Code::RecoveryRows, message).with_help(help).into());
                };
                let mut on_surface: Vec<i64> =
                    mesh.triangles().iter().flatten().map(|&node| self.nodes().ids[node as usize]).collect();
                on_surface.sort_unstable();
                on_surface.dedup();
                on_surface
            }
        };
        let stresses = elements.nodal_stresses(&wanted);
        let without: Vec<i64> = match nodes {
            StressNodes::These(nodes) => {
                let has = |node: &i64| stresses.places.binary_search_by_key(node, |place| place.0).is_ok();
                nodes.iter().copied().filter(|node| !has(node)).collect()
            }
            _ => Vec::new(),
        };
        if !without.is_empty() || stresses.places.is_empty() {
            let message = format!("no element has the nodes {}", name_some(&without));
            let help = "name nodes of elements";
            return Err(Diagnostic::new(Code::RecoveryRows, message).with_help(help).into());
        }
        let unit = self.units().stress_name();
        let place = |(at, &(node, material)): (usize, &(i64, &str))| {
            let shares = |other: Option<&(i64, &str)>| other.is_some_and(|other| other.0 == node);
            let before = at.checked_sub(1).and_then(|at| stresses.places.get(at));
            let is_shared = shares(before) || shares(stresses.places.get(at + 1));
            let name = if is_shared { format!("{node} {material}") } else { node.to_string() };
            STRAIN_NAMES.map(|component| RecoveryRow {
                name: format!("{name} {component}"),
                quantity: Quantity::Stress,
                component: component.to_owned(),
                unit: unit.clone(),
                node: Some(node),
                element: None,
            })
        };
        let labels = stresses.places.iter().enumerate().flat_map(place).collect();
        Ok(RecoveryOperator::Rows { transposed: stresses.transposed, labels, offset: None })
    }
}
