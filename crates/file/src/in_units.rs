//! Conversion of a body to other units: every entry of the table in its unit.

use super::draft::Draft;
use super::schema::TABLE;
use super::units::UnitChange;
use super::value::{ReadValue, Value};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::FlexBody;

/// Returns `body` with every number in `units`. Modes stay mass-normalised: their shapes change with the unit of mass.
/// Geometric stiffness of a load known by its name only keeps the unit of its load, and rows of recoveries keep theirs.
///
/// # Errors
/// The errors of [`FlexBody::new`], if numbers leave the range of double precision.
pub fn in_units(body: &FlexBody, units: &UnitSystem) -> Result<FlexBody> {
    let change = UnitChange::between(body.units(), units);
    let mut draft = Draft::new(units.clone(), body.parts().storage, body.groups());
    let mut problems = Vec::new();
    for group in TABLE {
        for (at, (name, view)) in group.instances(body.parts()).into_iter().enumerate() {
            problems.extend(draft.begin(group.per, at, &name.unwrap_or_default()).err());
            for item in group.entries() {
                let Some(put) = item.put else { continue };
                let Some(mut value) = item.value(&view) else { continue };
                match &mut value {
                    Value::Floats(values) => item.units.convert(change, &view, values),
                    Value::Float(value) => {
                        item.units.convert(change, &view, std::slice::from_mut(value));
                    }
                    Value::Ints(_) | Value::Indices(_) | Value::Text(_) | Value::Int(_) | Value::Named(_) => {
                    }
                }
                let columns = item.dims(&view).last().copied().unwrap_or(0);
                problems.extend(put(&mut draft, ReadValue { value, columns }).err());
            }
        }
    }
    let parts = draft.finish(&mut problems);
    if problems.is_empty() {
        FlexBody::new(parts)
    } else {
        let diagnostics = problems.into_iter().map(|problem| Diagnostic::new(Code::BodySchema, problem));
        Err(Error::new(diagnostics.collect()))
    }
}
