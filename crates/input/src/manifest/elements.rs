//! The tables `[[elements]]`.

use super::{ManifestWalk, TomlTable};
use crate::element_source::{ANISOTROPIC_CONSTANTS, ElementSource, anisotropic};
use flexbody_base::diagnostic::Code;
use flexbody_base::text::walk::{Value, real};
use flexbody_elements::Elasticity;
use std::ops::Range;
use std::path::Path;

pub(super) const ELEMENTS: &[&str] =
    &["file", "set", "kind", "youngs_modulus", "poisson_ratio", "elasticity"];

impl ManifestWalk<'_, '_> {
    /// Reads the files of elements. Entries with errors are left out; the errors are in `found`.
    pub(super) fn elements(&mut self, top: &TomlTable) -> Vec<ElementSource> {
        let tables = self.tables(top, "elements").unwrap_or_default();
        tables.into_iter().filter_map(|(table, span)| self.one_of_elements(table, span)).collect()
    }

    fn one_of_elements(&mut self, table: &TomlTable, span: Range<usize>) -> Option<ElementSource> {
        self.known_keys(table, "[[elements]]", ELEMENTS);
        if !table.contains_key("file") {
            self.complain(Code::ManifestSyntax, span.clone(), "elements have no key `file`".to_owned());
        }
        let (file, set) = (self.string(table, "file"), self.string(table, "set"));
        let kind = self.string(table, "kind").map(|kind| kind.to_uppercase());
        let is_isotropic = table.contains_key("youngs_modulus") || table.contains_key("poisson_ratio");
        let elasticity = match (is_isotropic, table.get("elasticity")) {
            (true, Some(_)) => {
                let message = "[[elements]] has both `youngs_modulus`, `poisson_ratio` and `elasticity`";
                self.complain(Code::ManifestSyntax, span, message.to_owned());
                return None;
            }
            (true, None) => Some(self.isotropic(table, span)?),
            (false, Some(value)) => Some(self.anisotropic(value)?),
            (false, None) => None,
        };
        let folder = self.path.parent().unwrap_or(Path::new(""));
        Some(ElementSource { path: folder.join(file?), set, kind, elasticity })
    }

    fn isotropic(&mut self, table: &TomlTable, span: Range<usize>) -> Option<Elasticity> {
        let youngs = self.number(table, "youngs_modulus", &span);
        let (youngs, poisson) = (youngs, self.number(table, "poisson_ratio", &span));
        let (youngs, poisson) = (youngs?, poisson?);
        let elasticity = Elasticity::isotropic(youngs, poisson);
        if elasticity.is_none() {
            let message = format!(
                "`youngs_modulus` is {youngs} and `poisson_ratio` {poisson}, expected E > 0 and -1 < nu < 0.5"
            );
            self.complain(Code::ManifestSyntax, span, message);
        }
        elasticity
    }

    fn anisotropic(&mut self, value: &Value) -> Option<Elasticity> {
        let numbers =
            value.get_ref().as_array().map(|all| all.iter().map(real).collect::<Option<Vec<f64>>>());
        let Some(Some(numbers)) = numbers
            .filter(|numbers| numbers.as_ref().is_some_and(|numbers| numbers.len() == ANISOTROPIC_CONSTANTS))
        else {
            let message =
                format!("`elasticity` must be {ANISOTROPIC_CONSTANTS} numbers: D1111, D1122, D2222, ...");
            self.complain(Code::ManifestSyntax, value.span(), message);
            return None;
        };
        let elasticity = anisotropic(&numbers);
        if elasticity.is_none() {
            let message = "`elasticity` is not positive definite".to_owned();
            self.complain(Code::ManifestSyntax, value.span(), message);
        }
        elasticity
    }
}
