//! Elements of the deck, proved by the stiffness of the model.

use crate::wording::name_some;
use crate::{DofLabel, FeModel};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::numbers::significant;
use flexbody_elements::{NodeDirection, ProvedElements, Refusal, prove};
use std::sync::Arc;

/// Help where the deck and the matrices disagree.
const DIFFERENT: &str = "write K again with the deck as it is now, or give the deck that K was written with; what was changed in one of the two changes every stress";

/// Help for elements whose volume is negative.
const INVERTED: &str =
    "give the nodes of each element in the order of its type, and the positions that K was written with";

/// Help where the elements are not known.
const UNKNOWN: &str = "stress and its stiffness can come from the FE program itself: `flexbody shapes`, and [[geometric_stiffness]] of the manifest";

impl FeModel {
    /// Returns the elements of the deck, proved: their assembled stiffness is K, entry by entry. They are proved once.
    ///
    /// # Errors
    /// [`ElementsUnproved`](Code::ElementsUnproved) if the elements are not known or their stiffness is not K, with every
    /// reason.
    pub fn proved_elements(&self) -> Result<Arc<ProvedElements>> {
        let proof = self.proved.get_or_init(|| self.prove_elements().map(Arc::new));
        proof.clone().map_err(Error::new)
    }

    /// Returns true if the deck describes all elements, springs and constraints in a way that K may prove. Nothing is
    /// assembled.
    pub fn describes_elements(&self) -> bool {
        self.dimension() == 3 && self.data.elements.as_ref().is_some_and(|elements| elements.may_be_proved())
    }

    fn prove_elements(&self) -> std::result::Result<ProvedElements, Vec<Diagnostic>> {
        let unproved = |message: String| Diagnostic::new(Code::ElementsUnproved, message);
        let Some(described) = &self.data.elements else {
            let message = "the elements of the model are not known: neither a deck with sections and materials nor [[elements]] is given";
            return Err(vec![unproved(message.to_owned()).with_help(UNKNOWN)]);
        };
        if self.dimension() != 3 {
            let message = "elements of a plane model are not proved";
            return Err(vec![unproved(message.to_owned()).with_help(UNKNOWN)]);
        }
        let label = |row| {
            let DofLabel { node, direction } = self.label(row);
            (node, direction)
        };
        let labels: Vec<NodeDirection> = (0..self.rows.len()).map(label).collect();
        let proved = prove(described.as_ref().clone(), &self.stiffness, &labels, self.digits);
        proved.map_err(|refusals| {
            let refusal = |refusal: &Refusal| {
                let (message, line, help) = in_words(refusal);
                let diagnostic = unproved(message).in_file(&described.path).with_help(help);
                match line {
                    Some(line) => diagnostic.at_line(line),
                    None => diagnostic,
                }
            };
            refusals.iter().map(refusal).collect()
        })
    }
}

/// Returns a reason in words, the line of the deck that it is about, and the help.
fn in_words(refusal: &Refusal) -> (String, Option<usize>, &'static str) {
    let elements = |kind: &str, ids: &[i64]| {
        let plural = if ids.len() == 1 { "" } else { "s" };
        format!("{} element{plural} of type {kind} ({})", ids.len(), name_some(ids))
    };
    match refusal {
        Refusal::NotDescribed(part) => (part.what.clone(), part.line, UNKNOWN),
        Refusal::UnknownType { kind, nodes, count } => {
            let message = format!(
                "{count} elements of type {kind} with {nodes} nodes have no formulation that K can prove"
            );
            (message, None, UNKNOWN)
        }
        Refusal::Degenerate { kind, ids } => {
            let message =
                format!("{}: inverted, or on the axis of a cylindrical orientation", elements(kind, ids));
            (message, None, INVERTED)
        }
        Refusal::WithoutRow(missing) => {
            let name = |(node, direction): &NodeDirection| {
                DofLabel { node: *node, direction: *direction }.to_string()
            };
            let names: Vec<String> = missing.iter().map(name).collect();
            let message = format!(
                "{} degrees of freedom of elements have neither a row in K nor an equation in the deck: {}",
                missing.len(),
                name_some(&names)
            );
            (message, None, UNKNOWN)
        }
        Refusal::Differs { kind, material, ids, of, formulation, largest } => {
            let which = if ids.len() == *of && *of > 1 {
                format!("all {of} elements of type {kind}")
            } else {
                elements(kind, ids)
            };
            let message = format!(
                "the stiffness of {which} of material `{material}` is not that in K ({formulation}): entries differ by up to {} of their row sums",
                significant(*largest, 3)
            );
            (message, None, DIFFERENT)
        }
        Refusal::Unexplained { entries, at, largest } => {
            let [from, to] = at.map(|(node, direction)| DofLabel { node, direction }.to_string());
            let message = format!(
                "entries of K that are not the sum of the elements around them: {entries}; largest difference {} of the row sums, between {from} and {to}; an element, a spring or a constraint is missing in the deck",
                significant(*largest, 3)
            );
            (message, None, DIFFERENT)
        }
    }
}
