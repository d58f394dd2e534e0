//! Reader of the tables of a scene with the requirements for the body.

use super::read_columns::{finite, place_of, positive};
use super::read_values::{axes, list, mode_number, vector};
use super::requirements::{
    Attachment, AttachmentKind, Limits, MotionRange, Range, RecoveryLimit, RecoveryTolerance, Requirements,
    Tolerance,
};
use super::{Axes, PerQuantity};
use flexbody_base::text::walk::{TomlTable, Value, Walk, integer, real};
use flexbody_model::{DampingRatios, damping_bands};
use nalgebra::{Matrix3, Vector3};
use toml::de::DeValue;

/// Tables with their keys, also for the list of known tables.
pub(super) const TABLES: [(&str, &[&str]); 7] = [
    ("motion", &["angular_velocity", "angular_acceleration", "axes"]),
    ("attachment", &["kind", "inertia", "axes", "first_frequency"]),
    ("limits", &["deflection", "stress", "mode_stress", "mode"]),
    ("band", &["frequency"]),
    ("damping", &["ratio", "bands", "replace"]),
    ("tolerance", &["attitude", "deflection", "stress", "reaction", "recovery", "least_deflection"]),
    ("cost", &["multiplications"]),
];

const LIMITED_MODE: &[&str] = &["number", "amplitude"];

/// Reads the requirements. A result `None` comes with a diagnostic in `found`.
pub(super) fn requirements(walk: &mut Walk<'_>, top: &TomlTable) -> Option<Requirements> {
    let mut requirements = Requirements::default();
    let mut complete = true;
    for (name, keys) in TABLES {
        match walk.table(top, name) {
            Some((table, span)) => {
                walk.known_keys(table, &format!("[{name}]"), keys);
                let mut section = Section { walk, table, span };
                complete &= section.read(name, &mut requirements).is_some();
            }
            // The key exists but is no table; a diagnostic reports it.
            None => complete &= !top.contains_key(name),
        }
    }
    complete.then_some(requirements)
}

/// One of the tables, while it is read.
struct Section<'s, 'w> {
    walk: &'s mut Walk<'w>,
    table: &'s TomlTable<'s>,
    span: std::ops::Range<usize>,
}

impl Section<'_, '_> {
    fn read(&mut self, name: &str, requirements: &mut Requirements) -> Option<()> {
        match name {
            "motion" => requirements.motion = self.motion()?,
            "attachment" => requirements.attachment = self.attachment()?,
            "limits" => requirements.limits = limits(self.walk, self.table, &self.span)?,
            "band" => requirements.band = Some(positive(self.walk, self.table, "frequency", &self.span)?),
            "damping" => {
                let (ratios, replaces) =
                    (self.damping_ratios(), flag(self.walk, self.table, "replace", false));
                (requirements.damping, requirements.replaces_damping) = (Some(ratios?), replaces?);
            }
            "tolerance" => {
                requirements.recoveries = self.recoveries()?;
                requirements.tolerance = self.tolerance(!requirements.recoveries.is_empty())?;
            }
            _ => requirements.multiplications = Some(self.multiplications()?),
        }
        Some(())
    }

    /// Reads an optional positive number.
    fn optional(&mut self, key: &str) -> Option<Option<f64>> {
        if self.table.contains_key(key) {
            positive(self.walk, self.table, key, &self.span).map(Some)
        } else {
            Some(None)
        }
    }

    fn motion(&mut self) -> Option<MotionRange> {
        let [velocity, acceleration] =
            ["angular_velocity", "angular_acceleration"].map(|key| range(self.walk, self.table, key));
        let axes = turning_axes(self.walk, self.table);
        Some(MotionRange { angular_velocity: velocity?, angular_acceleration: acceleration?, axes: axes? })
    }

    fn attachment(&mut self) -> Option<Attachment> {
        let kind = kind(self.walk, self.table);
        let inertia = attached_inertia(self.walk, self.table);
        let first_frequency = self.optional("first_frequency");
        let axes = turning_axes(self.walk, self.table);
        Some(Attachment {
            kind: kind?,
            inertia: Matrix3::from_diagonal(&inertia?),
            axes: axes?,
            first_frequency: first_frequency?,
        })
    }

    /// Reads one ratio, or ratios by frequency.
    fn damping_ratios(&mut self) -> Option<DampingRatios> {
        match (self.table.get("bands"), self.table.contains_key("ratio")) {
            (None, _) => positive(self.walk, self.table, "ratio", &self.span).map(DampingRatios::from),
            (Some(_), true) => {
                let message = "[damping] has both `ratio` and `bands`, expected one of them".to_owned();
                self.walk.wrong(self.span.clone(), message);
                None
            }
            (Some(value), false) => {
                let ratios = DampingRatios::new(damping_bands(self.walk, value)?);
                ratios.map_err(|problem| self.walk.wrong(value.span(), problem)).ok()
            }
        }
    }

    /// Reads the tolerances of all quantities; `with_recoveries` is true if recoveries have limits. They then stand for
    /// the stress that the elastic energy estimates, unless that has a tolerance too.
    fn tolerance(&mut self, with_recoveries: bool) -> Option<Tolerance> {
        let mut default = Tolerance::default().errors;
        if with_recoveries {
            (default.stress, default.recovery) = (f64::INFINITY, 1.0);
        }
        let mut or_default = |key, default| Some(self.optional(key)?.unwrap_or(default));
        let [attitude, deflection, stress, reaction] = [
            ("attitude", default.attitude),
            ("deflection", default.deflection),
            ("stress", default.stress),
            ("reaction", default.reaction),
        ]
        .map(|(key, default)| or_default(key, default));
        let least_deflection = self.optional("least_deflection");
        let (attitude, deflection) = (attitude?, deflection?);
        let (stress, reaction, recovery) = (stress?, reaction?, default.recovery);
        let errors = PerQuantity { attitude, deflection, stress, reaction, recovery };
        Some(Tolerance { errors, least_deflection: least_deflection? })
    }

    /// Reads the table `recovery`: a limit for each recovery, as a part of the largest value, as a text with a value and
    /// its unit, or as a table with `limit` and `static_columns`.
    fn recoveries(&mut self) -> Option<Vec<RecoveryTolerance>> {
        let Some((table, _)) = self.walk.table(self.table, "recovery") else {
            return (!self.table.contains_key("recovery")).then(Vec::new);
        };
        let mut all = Vec::new();
        let mut complete = true;
        for (name, value) in table {
            match self.recovery(name.get_ref(), value) {
                Some(one) => all.push(one),
                None => complete = false,
            }
        }
        complete.then_some(all)
    }

    fn recovery(&mut self, name: &str, value: &Value) -> Option<RecoveryTolerance> {
        const EXPECTED: &str = "a part of the largest value such as 0.01, or a value with the unit of the rows such as \"5 MPa\"";
        let (limit, static_columns) = match value.get_ref() {
            DeValue::Table(table) => {
                self.walk.known_keys(table, "[tolerance.recovery]", &["limit", "static_columns"]);
                let static_columns = flag(self.walk, table, "static_columns", true)?;
                let Some(limit) = table.get("limit") else {
                    self.walk.wrong(value.span(), format!("`{name}` has no `limit`: {EXPECTED}"));
                    return None;
                };
                (limit, static_columns)
            }
            _ => (value, true),
        };
        let found = match limit.get_ref() {
            DeValue::String(text) => absolute_limit(text),
            _ => real(limit).filter(|part| part.is_finite() && *part > 0.0).map(RecoveryLimit::Relative),
        };
        let Some(limit) = found else {
            self.walk.mistyped(name, limit, EXPECTED);
            return None;
        };
        Some(RecoveryTolerance { recovery: name.to_owned(), limit, static_columns })
    }

    fn multiplications(&mut self) -> Option<usize> {
        let value = self.table.get("multiplications");
        let count =
            value.and_then(integer).and_then(|count| usize::try_from(count).ok()).filter(|&count| count > 0);
        if count.is_none() {
            let message = "`multiplications` is not a positive whole number".to_owned();
            self.walk.wrong(place_of(self.table, "multiplications", &self.span), message);
        }
        count
    }
}

/// Reads `true` or `false`, or returns the `default` if the key is absent.
pub(super) fn flag(walk: &mut Walk<'_>, table: &TomlTable, key: &str, default: bool) -> Option<bool> {
    let Some(value) = table.get(key) else { return Some(default) };
    let DeValue::Boolean(flag) = value.get_ref() else {
        walk.mistyped(key, value, "true or false");
        return None;
    };
    Some(*flag)
}

/// Reads a positive value with a unit, separated by a blank.
fn absolute_limit(text: &str) -> Option<RecoveryLimit> {
    let (value, unit) = text.trim().split_once(char::is_whitespace)?;
    let value = value.parse().ok().filter(|value: &f64| value.is_finite() && *value > 0.0)?;
    let unit = unit.trim();
    (!unit.is_empty()).then(|| RecoveryLimit::Absolute { value, unit: unit.to_owned() })
}

/// Reads axes that turn with the body.
fn turning_axes(walk: &mut Walk<'_>, table: &TomlTable) -> Option<Axes> {
    axes(walk, table, &[Axes::Model, Axes::Body], Axes::Model)
}

/// Reads a number that is not negative, or three of them.
fn range(walk: &mut Walk<'_>, table: &TomlTable, key: &str) -> Option<Option<Range>> {
    let Some(value) = table.get(key) else { return Some(None) };
    if let DeValue::Array(_) = value.get_ref() {
        let components = vector(walk, key, value)?;
        return Some(Some(Range::Axes(not_negative(walk, key, value, components)?)));
    }
    let length = number(walk, key, value, "a number or a list of three")?;
    not_negative(walk, key, value, Vector3::repeat(length)).map(|_| Some(Range::Any(length)))
}

fn attached_inertia(walk: &mut Walk<'_>, table: &TomlTable) -> Option<Vector3<f64>> {
    let Some(value) = table.get("inertia") else { return Some(Vector3::zeros()) };
    let inertia = match value.get_ref() {
        DeValue::Array(_) => vector(walk, "inertia", value)?,
        _ => Vector3::repeat(number(walk, "inertia", value, "a number or a list of three")?),
    };
    not_negative(walk, "inertia", value, inertia)
}

fn number(walk: &mut Walk<'_>, key: &str, value: &Value, expected: &str) -> Option<f64> {
    let number = real(value).filter(|number| number.is_finite());
    if number.is_none() {
        walk.mistyped(key, value, expected);
    }
    number
}

fn not_negative(
    walk: &mut Walk<'_>,
    key: &str,
    value: &Value,
    components: Vector3<f64>,
) -> Option<Vector3<f64>> {
    if components.iter().any(|component| *component < 0.0) {
        walk.wrong(value.span(), format!("`{key}` is negative, but it is a magnitude"));
        return None;
    }
    Some(components)
}

fn kind(walk: &mut Walk<'_>, table: &TomlTable) -> Option<AttachmentKind> {
    let Some(value) = table.get("kind") else { return Some(AttachmentKind::default()) };
    let known = match value.get_ref() {
        DeValue::String(text) => text.parse().ok(),
        _ => None,
    };
    if known.is_none() {
        walk.mistyped("kind", value, "\"free\", \"soft\" or \"stiff\"");
    }
    known
}

fn limits(walk: &mut Walk<'_>, table: &TomlTable, span: &std::ops::Range<usize>) -> Option<Limits> {
    let mut optional = |key: &str| {
        if table.contains_key(key) { positive(walk, table, key, span).map(Some) } else { Some(None) }
    };
    let (deflection, stress) = (optional("deflection"), optional("stress"));
    let mode_stress: Option<Option<Vec<f64>>> = match table.get("mode_stress") {
        None => Some(None),
        Some(value) => {
            let list: Option<Vec<f64>> = match value.get_ref() {
                DeValue::Array(list) => {
                    list.iter().map(|item| real(item).filter(|v| v.is_finite() && *v >= 0.0)).collect()
                }
                _ => None,
            };
            if list.is_none() {
                walk.wrong(value.span(), "`mode_stress` is not a list of numbers from 0".to_owned());
            }
            list.map(Some)
        }
    };
    let modes = list(walk, table, "mode", |walk, table, span| {
        walk.known_keys(table, "[[limits.mode]]", LIMITED_MODE);
        let number = mode_number(walk, table, &span, "[[limits.mode]]");
        let amplitude = finite(walk, table, "amplitude", &span).filter(|amplitude| *amplitude >= 0.0);
        if amplitude.is_none() && table.contains_key("amplitude") {
            walk.wrong(span, "`amplitude` is negative, but it is a magnitude".to_owned());
        }
        Some((number?, amplitude?))
    });
    let stress = match (stress?, mode_stress?) {
        (Some(limit), Some(modes)) => Some((limit, modes)),
        (None, None) => None,
        _ => {
            walk.wrong(span.clone(), "`stress` and `mode_stress` must be given together".to_owned());
            return None;
        }
    };
    Some(Limits { deflection: deflection?, stress, modes: modes? })
}
