//! Variables of Exodus II in classic netCDF.

use super::variables::{ExodusFile, NumberTable, wrong, wrong_layers};
use crate::classic_netcdf::ClassicNetcdf;
use flexbody_base::diagnostic::{Diagnosed, Diagnostic};

impl ExodusFile for ClassicNetcdf<'_> {
    fn has(&self, name: &str) -> bool {
        self.variable(name).is_some()
    }

    fn floats(&self, name: &str) -> Diagnosed<Vec<f64>> {
        let variable = self.variable(name).ok_or_else(|| missing(name))?;
        match variable.shape.len() {
            1 => self.numbers(variable).map_err(wrong),
            _ => Err(wrong(format!("`{name}` is not a list of numbers"))),
        }
    }

    fn whole_numbers(&self, name: &str) -> Diagnosed<Vec<i64>> {
        let whole = |value: f64| (value.fract() == 0.0 && value.abs() < 9e15).then_some(value as i64);
        let numbers: Option<Vec<i64>> = self.floats(name)?.into_iter().map(whole).collect();
        numbers.ok_or_else(|| wrong(format!("`{name}` has a number that is not whole")))
    }

    fn table(&self, name: &str) -> Diagnosed<NumberTable> {
        let variable = self.variable(name).ok_or_else(|| missing(name))?;
        let &[rows, columns] = variable.shape.as_slice() else {
            return Err(wrong(format!("`{name}` is not a table of numbers")));
        };
        let values = self.numbers(variable).map_err(wrong)?;
        Ok(NumberTable { rows, columns, values, is_single_precision: variable.is_single_precision() })
    }

    fn stacked(&self, name: &str, layers: usize) -> Diagnosed<NumberTable> {
        let variable = self.variable(name).ok_or_else(|| missing(name))?;
        let &[times, own, columns] = variable.shape.as_slice() else {
            return Err(wrong(wrong_layers(name, &variable.shape, layers)));
        };
        if own != layers {
            return Err(wrong(wrong_layers(name, &variable.shape, layers)));
        }
        let values = self.numbers(variable).map_err(wrong)?;
        let is_single_precision = variable.is_single_precision();
        Ok(NumberTable { rows: times * layers, columns, values, is_single_precision })
    }

    fn names(&self, name: &str) -> Diagnosed<Vec<String>> {
        let variable = self.variable(name).ok_or_else(|| missing(name))?;
        self.lines(variable).map_err(wrong)
    }

    fn element_type(&self, name: &str) -> String {
        self.variable(name).map_or(String::new(), |variable| variable.text("elem_type").to_owned())
    }
}

fn missing(name: &str) -> Vec<Diagnostic> {
    wrong(format!("file has no variable `{name}`"))
}
