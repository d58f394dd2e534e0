//! Checks of the shapes of datasets against the table.

use super::item::Extent;
use flexbody_base::hdf5_file::{self as hdf5_file, Array, Element, Stored, elements};
use hdf5_metno as hdf5;

/// Extents known so far; the first dataset with an extent determines its size.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sizes {
    nodes: Option<usize>,
    modes: Option<usize>,
    pub interface_nodes: Option<usize>,
    pub internal_rows: Option<usize>,
    coordinates: Option<usize>,
    triangles: Option<usize>,
    edges: Option<usize>,
    pub recovery_rows: Option<usize>,
    pub loaded_interfaces: Option<usize>,
}

/// Reads a dataset of the stated shape, with its extents. Returns `None` if there is no such dataset.
pub(super) fn dataset<T: Element>(
    place: &hdf5::Group,
    name: &str,
    shape: &[Extent],
    sizes: &mut Sizes,
    stored: &mut Stored,
) -> Result<Option<Array<T>>, String> {
    hdf5_file::dataset(place, name, stored, |dims| sizes.fit(shape, dims))
}

impl Sizes {
    /// Checks `dims` against the table and the known extents, and records new extents. Returns the number of elements.
    fn fit(&mut self, shape: &[Extent], dims: &[usize]) -> Result<usize, String> {
        let mut learnt = *self;
        let fits = shape.len() == dims.len()
            && shape.iter().zip(dims).all(|(extent, &size)| size > 0 && learnt.fits(*extent, size));
        if !fits {
            let expected: Vec<_> = shape.iter().map(|e| self.show(*e)).collect();
            return Err(format!("expected shape [{}], found {dims:?}", expected.join(", ")));
        }
        let elements = elements(dims)?;
        *self = learnt;
        Ok(elements)
    }

    fn fits(&mut self, extent: Extent, size: usize) -> bool {
        match extent {
            Extent::Fixed(expected) => size == expected,
            Extent::Nodes => size == *self.nodes.get_or_insert(size),
            Extent::Modes => size == *self.modes.get_or_insert(size),
            Extent::ThreeModes => size.is_multiple_of(3) && size / 3 == *self.modes.get_or_insert(size / 3),
            Extent::InterfaceNodes => size == *self.interface_nodes.get_or_insert(size),
            Extent::InternalRows => size == *self.internal_rows.get_or_insert(size),
            Extent::Coordinates => size == *self.coordinates.get_or_insert(size),
            Extent::Triangles => size == *self.triangles.get_or_insert(size),
            Extent::Edges => size == *self.edges.get_or_insert(size),
            Extent::RecoveryRows => size == *self.recovery_rows.get_or_insert(size),
            Extent::LoadedInterfaces => size == *self.loaded_interfaces.get_or_insert(size),
        }
    }

    /// Returns the size of an extent; 0 if no dataset with this extent was read.
    pub(super) fn of(&self, extent: Extent) -> usize {
        let known = match extent {
            Extent::Fixed(size) => Some(size),
            Extent::Nodes => self.nodes,
            Extent::Modes => self.modes,
            Extent::ThreeModes => self.modes.map(|nf| 3 * nf),
            Extent::InterfaceNodes => self.interface_nodes,
            Extent::InternalRows => self.internal_rows,
            Extent::Coordinates => self.coordinates,
            Extent::Triangles => self.triangles,
            Extent::Edges => self.edges,
            Extent::RecoveryRows => self.recovery_rows,
            Extent::LoadedInterfaces => self.loaded_interfaces,
        };
        known.unwrap_or(0)
    }

    fn show(&self, extent: Extent) -> String {
        let known = |name: &str, size: Option<usize>| match size {
            Some(size) => format!("{name} = {size}"),
            None => name.to_owned(),
        };
        match extent {
            Extent::Fixed(size) => size.to_string(),
            Extent::Nodes => known("n", self.nodes),
            Extent::Modes => known("nf", self.modes),
            Extent::ThreeModes => known("3 nf", self.modes.map(|nf| 3 * nf)),
            Extent::InterfaceNodes => known("k", self.interface_nodes),
            Extent::InternalRows => known("m", self.internal_rows),
            Extent::Coordinates => known("nc", self.coordinates),
            Extent::Triangles => known("nt", self.triangles),
            Extent::Edges => known("ne", self.edges),
            Extent::RecoveryRows => known("r", self.recovery_rows),
            Extent::LoadedInterfaces => known("ni", self.loaded_interfaces),
        }
    }
}

/// Returns the index of a row-major position as text, for instance `[2, 0, 5]`.
pub(super) fn index(mut position: usize, dims: &[usize]) -> String {
    let mut index: Vec<usize> = dims
        .iter()
        .rev()
        .map(|&d| {
            let i = position % d;
            position /= d;
            i
        })
        .collect();
    index.reverse();
    format!("{index:?}")
}
