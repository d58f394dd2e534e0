//! Variables of an Exodus file by their names, in either form of netCDF.

use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};

const HELP: &str =
    "give an Exodus mesh in netCDF-4 or classic netCDF, or a table with the columns node, x, y, z";

/// Variables of a file, by their names.
pub(super) trait ExodusFile {
    /// Returns true if there is a variable of this name.
    fn has(&self, name: &str) -> bool;

    /// Returns the numbers of a variable with one extent.
    fn floats(&self, name: &str) -> Diagnosed<Vec<f64>>;

    /// Returns the whole numbers of a variable with one extent.
    fn whole_numbers(&self, name: &str) -> Diagnosed<Vec<i64>>;

    /// Returns a variable with two extents.
    fn table(&self, name: &str) -> Diagnosed<NumberTable>;

    /// Returns a variable with three extents, of which the second is `layers`, as a table: each row of each layer in turn.
    fn stacked(&self, name: &str, layers: usize) -> Diagnosed<NumberTable>;

    /// Returns a list of texts.
    fn names(&self, name: &str) -> Diagnosed<Vec<String>>;

    /// Returns the attribute `elem_type` of a variable; empty without one.
    fn element_type(&self, name: &str) -> String;
}

/// Numbers in rows.
pub(super) struct NumberTable {
    pub rows: usize,
    pub columns: usize,
    /// Values row by row.
    pub values: Vec<f64>,
    pub is_single_precision: bool,
}

/// Returns the error about a variable whose extents are not times, variables and nodes.
pub(super) fn wrong_layers(name: &str, extents: &[impl ToString], layers: usize) -> String {
    let extents: Vec<String> = extents.iter().map(ToString::to_string).collect();
    format!("`{name}` has the extents {}, expected times x {layers} variables x nodes", extents.join(" x "))
}

/// Returns FB115 about a file that is no mesh of Exodus.
pub(super) fn wrong(message: String) -> Vec<Diagnostic> {
    vec![Diagnostic::new(Code::NodeFileSyntax, message).with_help(HELP)]
}
