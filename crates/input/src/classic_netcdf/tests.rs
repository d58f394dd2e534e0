//! Files of classic netCDF: those of the library, and those that it writes rarely.

use super::{ClassicNetcdf, is_classic};
use std::path::Path;

fn answers(name: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/small/answers").join(name);
    std::fs::read(path).expect("a file")
}

/// Returns a file of version 1 with the unlimited dimension `t`, a dimension `x` of three, and variables of 16-bit numbers
/// along both; `records` is the number of records that the header states.
fn of_short_numbers(variables: &[&str], records: u32, values: &[i16]) -> Vec<u8> {
    let mut file = b"CDF\x01".to_vec();
    let word = |file: &mut Vec<u8>, number: u32| file.extend(number.to_be_bytes());
    let name = |file: &mut Vec<u8>, name: &str| {
        word(file, name.len() as u32);
        file.extend(name.bytes().chain([0; 3]).take(name.len().next_multiple_of(4)));
    };
    word(&mut file, records);
    [10, 2].into_iter().for_each(|number| word(&mut file, number));
    name(&mut file, "t");
    word(&mut file, 0);
    name(&mut file, "x");
    word(&mut file, 3);
    // No attributes of the file; one of text, and one of a number.
    [0, 0, 11, variables.len() as u32].into_iter().for_each(|number| word(&mut file, number));
    let header = file.len() + variables.len() * 80;
    for (at, variable) in variables.iter().enumerate() {
        name(&mut file, variable);
        [2, 0, 1, 12, 2].into_iter().for_each(|number| word(&mut file, number));
        name(&mut file, "unit");
        [2, 2].into_iter().for_each(|number| word(&mut file, number));
        file.extend(b"mm\0\0");
        name(&mut file, "top");
        [3, 1, 0x0007_0000].into_iter().for_each(|number| word(&mut file, number));
        [3, 8, (header + 8 * at) as u32].into_iter().for_each(|number| word(&mut file, number));
    }
    assert_eq!(file.len(), header);
    file.extend(values.iter().flat_map(|value| value.to_be_bytes()));
    file
}

fn numbers(bytes: &[u8], name: &str) -> Result<Vec<f64>, String> {
    let file = ClassicNetcdf::open(bytes)?;
    let variable = file.variable(name).ok_or("no such variable")?;
    file.numbers(variable)
}

#[test]
fn records_of_several_variables_are_padded_and_those_of_one_are_not() {
    let alone = of_short_numbers(&["a"], 2, &[1, -2, 3, 4, 5, 6]);
    assert_eq!(numbers(&alone, "a").expect("numbers"), [1.0, -2.0, 3.0, 4.0, 5.0, 6.0]);
    let both = of_short_numbers(&["a", "b"], 2, &[1, 2, 3, 0, 7, 8, 9, 0, 4, 5, 6, 0, 10, 11, 12]);
    assert_eq!(numbers(&both, "a").expect("numbers"), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!(numbers(&both, "b").expect("numbers"), [7.0, 8.0, 9.0, 10.0, 11.0, 12.0]);
    let file = ClassicNetcdf::open(&both).expect("a file");
    let variable = file.variable("b").expect("a variable");
    assert_eq!(
        (variable.shape.as_slice(), variable.text("unit"), variable.text("top")),
        (&[2, 3][..], "mm", "")
    );
}

/// Variables that lie at one place are read as often as the file has bytes for them.
#[test]
fn variables_have_no_more_bytes_than_their_file() {
    let bytes = of_short_numbers(&["a", "b"], 2, &[1, 2, 3, 0, 7, 8, 9, 0, 4, 5, 6, 0, 10, 11, 12]);
    let file = ClassicNetcdf::open(&bytes).expect("a file");
    let numbers = |_| file.numbers(file.variable("a").expect("a variable"));
    let refused = (0..bytes.len()).map(numbers).position(|read| read.is_err()).expect("refused");
    assert_eq!(refused, bytes.len() / 12);
    let message = numbers(0).expect_err("refused");
    assert!(message.contains("`a` lies where other variables lie"), "{message}");
}

/// A program that ended while it wrote has left the number of records open.
#[test]
fn records_that_are_not_counted_are_those_in_the_file() {
    let open = of_short_numbers(&["a"], u32::MAX, &[1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(numbers(&open, "a").expect("numbers"), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
}

#[test]
fn false_headers_are_described() {
    let sound = of_short_numbers(&["a"], 2, &[1, 2, 3, 4, 5, 6]);
    let at = |place: usize, value: u8| {
        let mut changed = sound.clone();
        changed[place] = value;
        changed
    };
    for (bytes, part) in [
        (at(3, 9), "does not begin like classic netCDF"),
        (at(11, 7), "the tag 7 of a list, expected 10"),
        (at(7, 3), "the file ends before the values of `a` do"),
        (at(4, 0x7f), "the file ends before the values of `a` do"),
        (at(75, 9), "variable `a` has no dimension 9"),
        (at(75, 0), "has its records not in its first dimension"),
        (at(127, 99), "the type 99"),
        (sound[..40].to_vec(), "the header ends before its entries do"),
        (sound[..sound.len() - 1].to_vec(), "the file ends before the values"),
    ] {
        let found = numbers(&bytes, "a").expect_err(part);
        assert!(found.contains(part), "{part}: {found}");
    }
}

#[test]
fn damaged_files_end_without_a_panic() {
    for name in ["classic.e", "offset64.e", "data64.e"] {
        let whole = answers(name);
        assert!(is_classic(&whole));
        let read = |bytes: &[u8]| {
            let Ok(file) = ClassicNetcdf::open(bytes) else { return };
            for variable in &file.variables {
                let _ = (file.numbers(variable), file.lines(variable));
            }
        };
        for at in 0..whole.len() {
            read(&whole[..at]);
            for value in [0, 1, 0x7f, 0xff, whole[at].wrapping_add(1)] {
                let mut changed = whole.clone();
                changed[at] = value;
                read(&changed);
            }
        }
    }
}
