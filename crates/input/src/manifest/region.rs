//! The regions that select the nodes of an interface: `box`, `cylinder`, `plane`, `nearest`.

use super::{ManifestWalk, TomlTable, Value, integer, real};
use crate::region::Region;
use flexbody_base::diagnostic::Code;
use std::ops::Range;
use toml::de::DeValue;

pub(super) const BOX: &[&str] = &["min", "max"];
pub(super) const CYLINDER: &[&str] = &["from", "to", "radius"];
pub(super) const PLANE: &[&str] = &["point", "normal", "within"];
pub(super) const NEAREST: &[&str] = &["point", "count"];

impl ManifestWalk<'_, '_> {
    /// Reads the region of the key `key`.
    pub(super) fn region(&mut self, key: &str, value: &Value, dimension: usize) -> Option<Region> {
        let DeValue::Table(table) = value.get_ref() else {
            self.mistyped(key, value, "a table");
            return None;
        };
        let span = value.span();
        let known = match key {
            "box" => BOX,
            "cylinder" => CYLINDER,
            "plane" => PLANE,
            _ => NEAREST,
        };
        self.known_keys(table, &format!("`{key}`"), known);
        let region = match key {
            "box" => Region::Box {
                min: self.place(table, key, "min", &span, dimension)?,
                max: self.place(table, key, "max", &span, dimension)?,
            },
            "cylinder" => Region::Cylinder {
                from: self.place(table, key, "from", &span, dimension)?,
                to: self.place(table, key, "to", &span, dimension)?,
                radius: self.radius(table, &span)?,
            },
            "plane" => Region::Plane {
                point: self.place(table, key, "point", &span, dimension)?,
                normal: self.place(table, key, "normal", &span, dimension)?,
                within: self.length(table, key, "within", &span)?,
            },
            _ => Region::Nearest {
                point: self.place(table, key, "point", &span, dimension)?,
                count: self.count(table)?,
            },
        };
        self.sensible(key, &region, span)
    }

    fn place(
        &mut self,
        table: &TomlTable,
        region: &str,
        key: &str,
        span: &Range<usize>,
        dimension: usize,
    ) -> Option<[f64; 3]> {
        match table.get(key) {
            Some(value) => self.point(key, value, dimension),
            None => self.missing_key(region, key, span),
        }
    }

    fn missing_key<T>(&mut self, region: &str, key: &str, span: &Range<usize>) -> Option<T> {
        self.complain(Code::ManifestSyntax, span.clone(), format!("key `{key}` is missing in `{region}`"));
        None
    }

    fn length(&mut self, table: &TomlTable, region: &str, key: &str, span: &Range<usize>) -> Option<f64> {
        let Some(value) = table.get(key) else { return self.missing_key(region, key, span) };
        let length = real(value).filter(|length| length.is_finite() && *length >= 0.0);
        if length.is_none() {
            self.mistyped(key, value, "a length that is not negative");
        }
        length
    }

    /// Reads the largest distance, or a list of the smallest and the largest.
    fn radius(&mut self, table: &TomlTable, span: &Range<usize>) -> Option<[f64; 2]> {
        let Some(value) = table.get("radius") else { return self.missing_key("cylinder", "radius", span) };
        let given: Option<Vec<f64>> = match value.get_ref() {
            DeValue::Array(list) => list.iter().map(real).collect(),
            _ => real(value).map(|radius| vec![0.0, radius]),
        };
        match given.as_deref() {
            Some(&[least, largest]) if 0.0 <= least && least <= largest && largest.is_finite() => {
                Some([least, largest])
            }
            _ => {
                self.mistyped("radius", value, "a radius, or the least and the largest");
                None
            }
        }
    }

    fn count(&mut self, table: &TomlTable) -> Option<usize> {
        let Some(value) = table.get("count") else { return Some(1) };
        let count = integer(value).filter(|count| *count > 0);
        if count.is_none() {
            self.mistyped("count", value, "a number of nodes");
        }
        count.map(|count| count as usize)
    }

    /// Returns the region unless it is empty by definition.
    fn sensible(&mut self, key: &str, region: &Region, span: Range<usize>) -> Option<Region> {
        let message = match region {
            Region::Box { min, max } if (0..3).any(|k| min[k] > max[k]) => "`min` lies beyond `max`",
            Region::Cylinder { from, to, .. } if from == to => {
                "`from` and `to` are one point: there is no axis"
            }
            Region::Plane { normal, .. } if normal.iter().all(|x| *x == 0.0) => "`normal` is zero",
            _ => return Some(*region),
        };
        self.complain(Code::ManifestSyntax, span, format!("{message} in `{key}`"));
        None
    }
}
