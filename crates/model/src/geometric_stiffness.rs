//! Geometric stiffness given by the user: matrices of the stiffness due to the stress under unit loads.

use crate::wording::name_some;
use crate::{NodeSet, RawMatrix};
use flexbody_base::diagnostic::{Code, Diagnostic};
use nalgebra::Matrix3;

/// Kind of load that stresses the body.
#[derive(Debug, Clone, PartialEq, Eq, strum::IntoStaticStr, strum::VariantNames)]
#[strum(serialize_all = "snake_case")]
pub enum LoadKind {
    /// Inertia forces -M a of a unit acceleration a of the origin of the frame along an axis. Gravity g
    /// counts as an acceleration -g.
    Acceleration,
    /// Inertia forces -M (alpha x x) of a unit angular acceleration about an axis through the origin of the
    /// frame.
    AngularAcceleration,
    /// Centrifugal forces: K(w) = sum_{k <= l} w_k w_l K_kl, from -M (w x (w x x)) about the origin of the
    /// frame.
    Spin,
    /// Unit force along an axis at the named interface.
    Force(String),
    /// Unit moment about an axis at the named interface.
    Moment(String),
    /// Unit of a load known by its name only.
    #[strum(serialize = "load")]
    Named(String),
}

impl LoadKind {
    /// Names of the kinds in manifests and files; [`LoadKind::Named`] is `load`.
    pub const NAMES: &'static [&'static str] = <Self as strum::VariantNames>::VARIANTS;

    /// Axes of the components of [`LoadKind::Spin`].
    pub const SPIN: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];

    /// Returns the name of the kind.
    pub fn name(&self) -> &'static str {
        self.into()
    }

    /// Returns the names of the components in their order: three axes, or six products of spin rates. A
    /// named load has one component without a name.
    pub fn components(&self) -> &'static [&'static str] {
        match self {
            Self::Spin => &["xx", "yy", "zz", "xy", "yz", "xz"],
            Self::Named(_) => &[""],
            _ => &["x", "y", "z"],
        }
    }

    /// Returns the components that a body of the given dimension has: in the plane along x and y, about z.
    pub fn of_dimension(&self, dimension: usize) -> &'static [usize] {
        match (dimension, self) {
            (_, Self::Named(_)) => &[0],
            (2, Self::Spin | Self::AngularAcceleration | Self::Moment(_)) => &[2],
            (2, _) => &[0, 1],
            (_, Self::Spin) => &[0, 1, 2, 3, 4, 5],
            _ => &[0, 1, 2],
        }
    }

    /// Returns the interface that the load acts at.
    pub fn interface(&self) -> Option<&str> {
        match self {
            Self::Force(interface) | Self::Moment(interface) => Some(interface),
            _ => None,
        }
    }
}

/// Unit load.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnitLoad {
    /// Kind of the load.
    pub kind: LoadKind,
    /// Index into [`LoadKind::components`].
    pub component: usize,
}

impl UnitLoad {
    /// Returns the name of the component; empty for a named load.
    pub fn axis(&self) -> &'static str {
        self.kind.components().get(self.component).copied().unwrap_or("")
    }

    /// Returns the name in files, such as `spin_xx`, `acceleration_x`, `force_z_tip` (interface `tip`),
    /// `load_pretension`.
    pub fn label(&self) -> String {
        let axis = self.axis();
        match &self.kind {
            LoadKind::Force(at) | LoadKind::Moment(at) => format!("{}_{axis}_{at}", self.kind.name()),
            LoadKind::Named(name) => format!("{}_{name}", self.kind.name()),
            _ => format!("{}_{axis}", self.kind.name()),
        }
    }

    /// Returns the name of the step of an FE program with the static response to the load: `spin xy`, `tip Fz`, `tip Mx`
    /// (interface `tip`), the name of a named load.
    pub fn step(&self) -> String {
        let axis = self.axis();
        match &self.kind {
            LoadKind::Force(at) => format!("{at} F{axis}"),
            LoadKind::Moment(at) => format!("{at} M{axis}"),
            LoadKind::Named(name) => name.clone(),
            kind => format!("{} {axis}", kind.name().replace('_', " ")),
        }
    }

    /// Returns the unit forces and moments at an interface, in the order of the components of a static column.
    pub fn at_interface(name: &str) -> [Self; 6] {
        std::array::from_fn(|k| Self {
            kind: if k < 3 { LoadKind::Force(name.to_owned()) } else { LoadKind::Moment(name.to_owned()) },
            component: k % 3,
        })
    }

    /// Returns the load with the name `label`; the inverse of [`UnitLoad::label`].
    pub fn from_label(label: &str) -> Option<Self> {
        let split = |kind: &&'static str| Some((*kind, label.strip_prefix(*kind)?.strip_prefix('_')?));
        let (kind, rest) = LoadKind::NAMES.iter().find_map(split)?;
        let at_interface = || rest.split_once('_').filter(|(_, interface)| !interface.is_empty());
        let (kind, axis) = match kind {
            "acceleration" => (LoadKind::Acceleration, rest),
            "angular_acceleration" => (LoadKind::AngularAcceleration, rest),
            "spin" => (LoadKind::Spin, rest),
            "force" => at_interface().map(|(axis, at)| (LoadKind::Force(at.to_owned()), axis))?,
            "moment" => at_interface().map(|(axis, at)| (LoadKind::Moment(at.to_owned()), axis))?,
            _ if rest.is_empty() => return None,
            _ => (LoadKind::Named(rest.to_owned()), ""),
        };
        let component = kind.components().iter().position(|known| *known == axis)?;
        Some(Self { kind, component })
    }

    /// Returns this load (component a, axes of the model) in units of the loads of its kind along other
    /// axes, the columns of `axes`: v_a = sum_i A_ai v_i' for vectors, w_a w_b = sum_ij A_ai A_bj w_i' w_j'
    /// for spin. A named load does not change.
    ///
    /// # Panics
    /// When the component does not belong to the kind.
    pub fn along(&self, axes: &Matrix3<f64>) -> Vec<f64> {
        let component = self.component;
        match self.kind {
            LoadKind::Named(_) => vec![1.0],
            LoadKind::Spin => {
                let (a, b) = LoadKind::SPIN[component];
                let product = |i: usize, j: usize| axes[(a, i)] * axes[(b, j)];
                let coefficient = |&(i, j): &(usize, usize)| {
                    if i == j { product(i, i) } else { product(i, j) + product(j, i) }
                };
                LoadKind::SPIN.iter().map(coefficient).collect()
            }
            _ => axes.row(component).iter().copied().collect(),
        }
    }
}

impl std::fmt::Display for UnitLoad {
    /// Formats the load as `spin xx`, `force x at interface tip`, `load pretension`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kind = self.kind.name().replace('_', " ");
        match &self.kind {
            LoadKind::Named(name) => write!(f, "{kind} `{name}`"),
            LoadKind::Force(at) | LoadKind::Moment(at) => write!(f, "{kind} {} at `{at}`", self.axis()),
            _ => write!(f, "{kind} {}", self.axis()),
        }
    }
}

/// Stiffness due to the stress of a unit load. `K` is the type of the matrix: a path, a matrix as read, the
/// checked matrix, or its reduced form.
#[derive(Debug, Clone, PartialEq)]
pub struct GeometricStiffness<K> {
    /// Unit load; its components are along the axes of the model, for a reduced matrix along those of the
    /// body.
    pub load: UnitLoad,
    /// K_geo, symmetric, with the rows of K and M. Unit: that of K over that of the load.
    pub matrix: K,
}

/// Longest name of a load in bytes, since the name becomes a group name in the file.
const MAX_NAME_BYTES: usize = 200;

/// Adds errors about the loads by themselves.
pub(crate) fn check_loads(
    given: &[GeometricStiffness<RawMatrix>],
    interfaces: &[NodeSet],
    dimension: usize,
    diagnostics: &mut Vec<Diagnostic>,
) {
    for (i, GeometricStiffness { load, matrix }) in given.iter().enumerate() {
        let mut complain =
            |code, message: String| diagnostics.push(Diagnostic::new(code, message).in_file(&matrix.path));
        let (kind, name) = (&load.kind, load.to_string());
        if !kind.of_dimension(dimension).contains(&load.component) {
            let have: Vec<&str> =
                kind.of_dimension(dimension).iter().map(|&c| kind.components()[c]).collect();
            let have = have.join(", ");
            complain(
                Code::ManifestSyntax,
                format!(
                    "geometric stiffness is given for {name}; a body of dimension {dimension} has {have}"
                ),
            );
        } else if matches!(kind, LoadKind::Named(name) if name.is_empty() || name.len() > MAX_NAME_BYTES || name.contains('\0'))
        {
            let message =
                "a load of geometric stiffness has no name, or one that is too long or has a NUL in it";
            complain(Code::ManifestSyntax, message.to_owned());
        } else if given[..i].iter().any(|other| other.load == *load) {
            complain(Code::ManifestSyntax, format!("geometric stiffness for {name} is given twice"));
        } else if let Some(at) = kind.interface()
            && interfaces.iter().all(|set| set.name != at)
        {
            let known: Vec<&String> = interfaces.iter().map(|set| &set.name).collect();
            let known = if known.is_empty() { "none".to_owned() } else { name_some(&known) };
            let message =
                format!("geometric stiffness is given for {name}; interfaces of the model: {known}");
            let complaint = Diagnostic::new(Code::InterfaceNode, message).in_file(&matrix.path);
            diagnostics.push(complaint.with_help("name an [[interface]] of the manifest"));
        }
    }
}

/// Returns a note about each kind of load with only some components given.
pub(crate) fn missing_components<K>(given: &[GeometricStiffness<K>], dimension: usize) -> Option<Diagnostic> {
    let loads: Vec<&UnitLoad> = given.iter().map(|one| &one.load).collect();
    let mut missing: Vec<UnitLoad> = Vec::new();
    for kind in loads.iter().map(|load| &load.kind) {
        for &component in kind.of_dimension(dimension) {
            let load = UnitLoad { kind: kind.clone(), component };
            if !loads.contains(&&load) && !missing.contains(&load) {
                missing.push(load);
            }
        }
    }
    (!missing.is_empty()).then(|| {
        let message = format!("geometric stiffness is taken as zero for {}", name_some(&missing));
        Diagnostic::new(Code::GeometricStiffnessPartial, message)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_name_every_load_and_nothing_else() {
        let text = |s: &str| s.to_owned();
        for kind in [
            LoadKind::Acceleration,
            LoadKind::AngularAcceleration,
            LoadKind::Spin,
            LoadKind::Force(text("a_b")),
            LoadKind::Moment(text("x")),
            LoadKind::Named(text("spin_xx")),
        ] {
            for component in 0..kind.components().len() {
                let load = UnitLoad { kind: kind.clone(), component };
                assert_eq!(UnitLoad::from_label(&load.label()), Some(load));
            }
        }
        for label in
            ["", "spin", "spin_", "spin_x", "acceleration_xx", "force_x", "force_x_", "force_w_a", "load_"]
        {
            assert_eq!(UnitLoad::from_label(label), None, "{label}");
        }
    }

    #[test]
    fn spin_rates_of_turned_axes_give_the_same_products() {
        let axes = nalgebra::Rotation3::from_euler_angles(0.4, -1.1, 2.0);
        let turned = nalgebra::Vector3::new(0.3, -0.7, 1.9);
        let spin = axes * turned;
        for (component, (a, b)) in LoadKind::SPIN.into_iter().enumerate() {
            let along = UnitLoad { kind: LoadKind::Spin, component }.along(axes.matrix());
            let sum: f64 =
                along.iter().zip(LoadKind::SPIN).map(|(c, (i, j))| c * turned[i] * turned[j]).sum();
            assert!((sum - spin[a] * spin[b]).abs() < 1e-14, "{component}");
        }
    }
}
