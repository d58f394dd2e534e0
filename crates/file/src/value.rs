//! Values of the entries of the table, and the objects from which the writer takes them.

use faer::{Mat, MatRef};
use flexbody_body::flex_body::{
    FixedInterface, GeometricStiffness, Guarantee, Interface, InterfaceCoordinates, InterfaceRows,
    InternalRows, LumpedBody, NamedLoad, Parts, Recovery, RotatedStiffness, UnitLoad,
};
use flexbody_body::invariants::Invariants;
use flexbody_model::BodyNumber;
use nalgebra::{Matrix3, Vector3};

/// Value of one entry; arrays are row-major in the shape that the table states.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    Floats(Vec<f64>),
    Ints(Vec<i64>),
    Indices(Vec<i32>),
    Text(String),
    Int(i64),
    Float(f64),
    /// Attributes whose names are data.
    Named(Vec<(String, f64)>),
}

/// Object that the entries of one group describe: the body, and the part of it for groups with several instances.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub body: &'a Parts,
    pub lumped: Option<&'a LumpedBody>,
    pub interface: Option<&'a Interface>,
    /// Geometric stiffness or stiffness of inertia of a unit load.
    pub geometric_stiffness: Option<&'a GeometricStiffness<Mat<f64>>>,
    pub rotated: Option<&'a RotatedStiffness>,
    pub recovery: Option<&'a Recovery>,
    pub named_load: Option<&'a NamedLoad>,
}

impl<'a> View<'a> {
    /// Returns the invariants of the group: the exact ones, or those of its lumping scheme.
    pub(crate) fn invariants(&self) -> &'a Invariants {
        self.lumped.map_or(&self.body.invariants, |l| &l.invariants)
    }

    /// Returns the modes at the reference point of the group's interface.
    pub(crate) fn interface_rows(&self) -> Option<InterfaceRows> {
        let Parts { nodes, modes, dimension, .. } = self.body;
        let rotation = modes.rotation.as_ref().map(Mat::as_ref);
        self.interface?.rows(nodes, modes.shape.as_ref(), rotation, *dimension)
    }

    pub(crate) fn number(&self) -> Option<BodyNumber> {
        self.body.description.number
    }

    pub(crate) fn internal(&self) -> Option<&'a InternalRows> {
        self.body.modes.internal.as_ref()
    }

    pub(crate) fn guarantee(&self) -> Option<&'a Guarantee> {
        self.body.certificate.guarantee.as_ref()
    }

    pub(crate) fn fixed_interface(&self) -> Option<&'a FixedInterface> {
        self.body.certificate.fixed_interface.as_ref()
    }

    pub(crate) fn coordinates(&self) -> Option<&'a InterfaceCoordinates> {
        self.body.coordinates.as_ref()
    }

    pub(crate) fn interface(&self) -> Option<&'a Interface> {
        self.interface
    }

    pub(crate) fn lumped(&self) -> Option<&'a LumpedBody> {
        self.lumped
    }

    pub(crate) fn load(&self) -> Option<&'a GeometricStiffness<Mat<f64>>> {
        self.geometric_stiffness
    }

    pub(crate) fn rotated(&self) -> Option<&'a RotatedStiffness> {
        self.rotated
    }

    /// Returns the load that the group belongs to.
    pub(crate) fn unit_load(&self) -> Option<&'a UnitLoad> {
        self.geometric_stiffness.map(|own| &own.load).or(self.rotated.map(|own| &own.load))
    }

    pub(crate) fn recovery(&self) -> Option<&'a Recovery> {
        self.recovery
    }

    pub(crate) fn named_load(&self) -> Option<&'a NamedLoad> {
        self.named_load
    }

    /// Returns the node indices of the group's interface; none for other groups.
    pub(crate) fn interface_nodes(&self) -> &'a [usize] {
        self.interface.map_or(&[], |i| &i.nodes)
    }
}

/// Returns the components of shapes (3n x nf) at `nodes`, as an array (nf x nodes x 3).
pub(super) fn shape_rows(shape: &Mat<f64>, nodes: impl Iterator<Item = usize> + Clone) -> Value {
    let mut out = Vec::new();
    for j in 0..shape.ncols() {
        out.extend(nodes.clone().flat_map(|i| [0, 1, 2].map(|k| shape[(3 * i + k, j)])));
    }
    Value::Floats(out)
}

/// Returns the elements of a matrix, row by row.
pub(super) fn rows(m: MatRef<'_, f64>) -> impl Iterator<Item = f64> + '_ {
    (0..m.nrows()).flat_map(move |i| (0..m.ncols()).map(move |j| m[(i, j)]))
}

pub(super) fn matrix(m: MatRef<'_, f64>) -> Option<Value> {
    Some(Value::Floats(rows(m).collect()))
}

/// Returns indices of nodes as a value. No body has more than 2^31 nodes.
pub(super) fn indices(values: &[u32]) -> Value {
    Value::Indices(values.iter().map(|&i| i32::try_from(i).unwrap_or(i32::MAX)).collect())
}

/// Returns a list as JSON text; `None` for an empty list.
pub(super) fn json_list<T: serde::Serialize>(list: &[T]) -> Option<Value> {
    text(
        (!list.is_empty())
            .then(|| serde_json::to_string(list).expect("strings and finite numbers are valid JSON"))?,
    )
}

pub(super) fn text(value: impl Into<String>) -> Option<Value> {
    Some(Value::Text(value.into()))
}

/// Value of an entry of a file.
pub(super) struct ReadValue {
    pub value: Value,
    /// Last extent of a dataset; 0 for an attribute.
    pub columns: usize,
}

/// Makes functions that return the content of a value, which is of the kind of its row.
macro_rules! contents {
    ($($name:ident $kind:ident $type:ty,)*) => {
        impl ReadValue {
            $(pub(crate) fn $name(self) -> $type {
                match self.value {
                    Value::$kind(contents) => contents,
                    other => unreachable!("a row of the table reads {}, the scan gave {other:?}", stringify!($kind)),
                }
            })*
        }
    };
}
contents! {
    floats Floats Vec<f64>,
    ints Ints Vec<i64>,
    indices Indices Vec<i32>,
    text Text String,
    int Int i64,
    float Float f64,
    named Named Vec<(String, f64)>,
}

impl ReadValue {
    /// Parses the content from JSON text. `expected` describes the expected content in the message of the error.
    pub(crate) fn json<T: serde::de::DeserializeOwned>(self, expected: &str) -> Result<T, String> {
        serde_json::from_str(&self.text())
            .map_err(|e| format!("expected {expected}, found text that is not ({e})"))
    }

    /// Returns components of shapes (nf x nodes x 3) as a matrix (3n x nf): the inverse of [`shape_rows`].
    pub(crate) fn shapes(self, nf: usize) -> Mat<f64> {
        let values = self.floats();
        let rows = values.len() / nf;
        Mat::from_fn(rows, nf, |row, j| values[j * rows + row])
    }
}

/// Type that the file stores as one entry.
pub(super) trait Stored: Sized {
    /// Returns the value for the file; `None` if the file gets no entry.
    fn value(&self) -> Option<Value>;

    /// Converts the value of the file. The error names the expected value and the value found.
    fn take(read: ReadValue) -> Result<Self, String>;
}

impl<T: Stored> Stored for Option<T> {
    fn value(&self) -> Option<Value> {
        self.as_ref()?.value()
    }

    fn take(read: ReadValue) -> Result<Self, String> {
        T::take(read).map(Some)
    }
}

macro_rules! stored {
    ($type:ty, $own:ident => $value:expr, $read:ident => $take:expr) => {
        impl Stored for $type {
            fn value(&self) -> Option<Value> {
                let $own = self;
                Some($value)
            }

            fn take($read: ReadValue) -> Result<Self, String> {
                Ok($take)
            }
        }
    };
}
stored!(f64, own => Value::Float(*own), read => read.float());
stored!(String, own => Value::Text(own.clone()), read => read.text());
stored!(Vec<f64>, own => Value::Floats(own.clone()), read => read.floats());
stored!(Vec<i64>, own => Value::Ints(own.clone()), read => read.ints());
stored!(Vec<[i64; 2]>, own => Value::Ints(own.as_flattened().to_vec()), read => read.ints().as_chunks().0.to_vec());
stored!(Vec<[f64; 3]>, own => Value::Floats(own.as_flattened().to_vec()), read => read.floats().as_chunks().0.to_vec());
stored!([f64; 3], own => Value::Floats(own.to_vec()), read => Vector3::take(read)?.into());
stored!(Vector3<f64>, own => Value::Floats(own.as_slice().to_vec()), read => Self::from_column_slice(&read.floats()));
stored!(Matrix3<f64>, own => Value::Floats(own.transpose().as_slice().to_vec()), read => Self::from_row_slice(&read.floats()));
stored!(Mat<f64>, own => Value::Floats(rows(own.as_ref()).collect()), read => {
    let columns = read.columns;
    let values = read.floats();
    Self::from_fn(values.len() / columns, columns, |i, j| values[i * columns + j])
});
// Counts of objects in memory are far below 2^63.
stored!(usize, own => Value::Int(i64::try_from(*own).unwrap_or(i64::MAX)), read => {
    let value = read.int();
    Self::try_from(value).map_err(|_| format!("expected a count, found {value}"))?
});
