//! Columns of numbers over time, as multibody programs and spreadsheets write them.
//!
//! Fields are separated by semicolons, tabs, commas or blanks. Lines that begin with `#`, `%` or `!` are comments. The
//! column names are in the first line that is not a comment, if it has no number, or in the last comment before the
//! first row, if it has as many fields. A line below the names without any number holds units, which are not read.

use super::input_file::InputFile;
use super::last_field::LastFields;
use super::scanner::{BadLines, Line, Lines, Separator, excerpt, number, without_mark};
use crate::diagnostic::{Code, Diagnosed, Diagnostic};

/// Smallest number of rows.
const MIN_ROWS: usize = 2;

/// Distance of two rows, relative to the largest time of a table, below which they may differ by rounding only: times
/// that are summed over ten thousand steps have this error.
const ROUNDING_DISTANCE: f64 = 1e-12;

/// Smallest distance of rows within [`ROUNDING_DISTANCE`] of each other, relative to the usual distance of rows, that
/// is still accepted: dates in seconds may have rows every millisecond.
const MIN_ROW_DISTANCE: f64 = 1e-3;

/// Returns the first row whose time differs from the one before by rounding only; `None` if there is none. Between such
/// rows a history would change at an arbitrary rate.
///
/// * `times`: ascending.
pub fn closer_than_rounding(times: &[f64]) -> Option<usize> {
    let largest = times.iter().fold(0.0f64, |most, time| most.max(time.abs()));
    let mut apart: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let ulps = 4.0 * f64::EPSILON * largest;
    let is_close = |apart: f64, usual: f64| {
        apart <= ulps || (apart < ROUNDING_DISTANCE * largest && apart < MIN_ROW_DISTANCE * usual)
    };
    let shortest = apart.iter().copied().fold(f64::INFINITY, f64::min);
    if shortest >= ROUNDING_DISTANCE * largest {
        return None;
    }
    let middle = apart.len() / 2;
    let usual = *apart.select_nth_unstable_by(middle, f64::total_cmp).1;
    times.windows(2).position(|pair| is_close(pair[1] - pair[0], usual)).map(|row| row + 1)
}

/// Column of a file, by its name or its number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ColumnKey {
    /// Name in the file, with or without the unit in brackets after it.
    Name(String),
    /// Number, from 1.
    Number(usize),
}

/// Columns of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Ascending times, at least two.
    pub times: Vec<f64>,
    /// Values of every requested column, one for each time.
    pub columns: Vec<Vec<f64>>,
    /// Line numbers of the rows in the file, from 1.
    pub lines: Vec<usize>,
}

/// Reads the time column and other columns.
///
/// # Errors
/// FB215 for all columns that the file does not have. FB216 for rows that cannot be read (the first few, and the number
/// of others), for times that do not ascend, for fewer than two rows and for a file that may end within its last number.
pub fn read_series(file: &InputFile, time: &ColumnKey, wanted: &[ColumnKey]) -> Diagnosed<Series> {
    let Some(text) = without_mark(file.bytes()) else {
        let error = row_error(file, 1, "file is UTF-16".to_owned());
        return Err(vec![error.with_help("save it as UTF-8 or ASCII text")]);
    };
    let Some(layout) = Layout::of(text) else {
        return Err(vec![row_error(file, 1, "file has no rows".to_owned())]);
    };
    let places = layout.places(file, std::iter::once(time).chain(wanted))?;
    let mut reading = SeriesReader::new(file, &layout, places);
    let (mut fields, mut last) = (Vec::new(), LastFields::default());
    for row in layout.rows(text) {
        split_into(layout.separator, row.text, &mut fields);
        last.row(row.number, fields.last().copied().unwrap_or_default());
        if let Err(diagnostic) = reading.row(row.number, &fields) {
            reading.bad.add(diagnostic);
        }
    }
    let cut_off = last.cut_off(text, Code::SeriesRow).map(|cut_off| cut_off.in_file(file.path()));
    reading.finish().and_then(|series| cut_off.map_or(Ok(series), |cut_off| Err(vec![cut_off])))
}

/// Returns true if the file has a column of this name, with or without a unit in brackets after it, or several.
pub fn has_column(file: &InputFile, name: &str) -> bool {
    let is_named = |column: &&[u8]| *column == name.as_bytes() || before_unit(column) == name.as_bytes();
    Layout::of(file.bytes()).is_some_and(|layout| layout.names.iter().any(is_named))
}

fn row_error(file: &InputFile, line: usize, message: String) -> Diagnostic {
    Diagnostic::new(Code::SeriesRow, message).in_file(file.path()).at_line(line)
}

/// Returns the separator of a line.
fn separator_of(line: &[u8]) -> Separator {
    match Separator::of(line) {
        // Commas between digits, in numbers separated by blanks, are decimal commas.
        Separator::Byte(b',')
            if Separator::Blanks.split(line).iter().all(|field| is_plain_or_with_decimal_comma(field)) =>
        {
            Separator::Blanks
        }
        separator => separator,
    }
}

/// Replaces `fields` by the fields of a line. A separator at the end of a line ends its last field.
fn split_into<'a>(separator: Separator, line: &'a [u8], fields: &mut Vec<&'a [u8]>) {
    separator.split_into(line, fields);
    fields.pop_if(|field| field.is_empty());
}

fn split(separator: Separator, line: &[u8]) -> Vec<&[u8]> {
    let mut fields = Vec::new();
    split_into(separator, line, &mut fields);
    fields
}

/// Returns true for a whole number, or a number with digits on both sides of its only comma.
fn is_plain_or_with_decimal_comma(field: &[u8]) -> bool {
    field.iter().all(u8::is_ascii_digit) && !field.is_empty() || has_decimal_comma(field)
}

fn has_decimal_comma(field: &[u8]) -> bool {
    let mut parts = field.split(|&byte| byte == b',');
    let (Some(whole), Some(fraction), None) = (parts.next(), parts.next(), parts.next()) else {
        return false;
    };
    whole.last().is_some_and(u8::is_ascii_digit)
        && fraction.first().is_some_and(u8::is_ascii_digit)
        && number(&[whole, b".", fraction].concat()).is_some()
}

fn is_comment(line: &[u8]) -> bool {
    matches!(line.first(), Some(b'#' | b'%' | b'!'))
}

/// Layout of the file: separator, number of fields, and names of the columns.
struct Layout<'f> {
    separator: Separator,
    fields: usize,
    names: Vec<&'f [u8]>,
    /// Line of the names, or the first row.
    line: usize,
    /// First line that may be a row.
    first_row: usize,
}

impl<'f> Layout<'f> {
    /// Detects the layout; `None` if all lines are comments.
    fn of(text: &'f [u8]) -> Option<Self> {
        let mut comment = None;
        // First line that is not a comment, and the last comment before it.
        let mut lines = Lines::of(text).filter_map(Line::content);
        let Line { number: line, text: first } = lines.by_ref().find(|line| {
            let found = is_comment(line.text);
            comment = if found { Some(line.text) } else { comment };
            !found
        })?;
        let separator = separator_of(first);
        let head = split(separator, first);
        let has_numbers =
            |fields: &[&[u8]]| fields.iter().any(|f| number(f).is_some() || has_decimal_comma(f));
        if has_numbers(&head) {
            let names = comment.and_then(|comment| names_in(comment, separator, head.len()));
            let names = names.unwrap_or_default();
            return Some(Self { separator, fields: head.len(), names, line, first_row: line });
        }
        // Rows show the separator more reliably than names, which may contain blanks.
        let below = lines.find(|line| !is_comment(line.text));
        let separator = below.map_or(separator, |below| match separator_of(below.text) {
            Separator::Byte(byte) if first.contains(&byte) => Separator::Byte(byte),
            _ => separator,
        });
        let head = split(separator, first);
        let units = below.filter(|below| !has_numbers(&split(separator, below.text)));
        let first_row = units.map_or(line, |units| units.number) + 1;
        Some(Self { separator, fields: head.len(), names: head, line, first_row })
    }

    /// Returns the lines of the rows.
    fn rows(&self, text: &'f [u8]) -> impl Iterator<Item = Line<'f>> + use<'f> {
        let first = self.first_row;
        let is_row = move |line: &Line<'_>| line.number >= first && !is_comment(line.text);
        Lines::of(text).filter_map(Line::content).filter(is_row)
    }

    /// Returns the indices of the columns `keys`.
    fn places<'k>(
        &self,
        file: &InputFile,
        keys: impl Iterator<Item = &'k ColumnKey>,
    ) -> Diagnosed<Vec<usize>> {
        let (mut places, mut found) = (Vec::new(), Vec::new());
        for key in keys {
            match self.place(key) {
                Ok(place) => places.push(place),
                Err((message, help)) => {
                    let wrong = Diagnostic::new(Code::SeriesColumn, message).with_help(help);
                    found.push(wrong.in_file(file.path()).at_line(self.line));
                }
            }
        }
        found.dedup();
        if found.is_empty() { Ok(places) } else { Err(found) }
    }

    /// Returns the index of a column, or a message and a help.
    fn place(&self, key: &ColumnKey) -> Result<usize, (String, String)> {
        let name = match key {
            ColumnKey::Number(number) if (1..=self.fields).contains(number) => return Ok(number - 1),
            ColumnKey::Number(number) => {
                let message = format!("there is no column {number}: the file has {}", self.fields);
                return Err((message, self.all()));
            }
            ColumnKey::Name(name) => name.as_bytes(),
        };
        if self.names.is_empty() {
            let message = format!("there is no column `{}`: the columns have no names", excerpt(name));
            return Err((message, format!("give its number, 1 to {}", self.fields)));
        }
        // The whole name first, then the name without its unit: "Fx [N]" is found by "Fx".
        let whole = |column: &[u8]| column == name;
        let without_unit = |column: &[u8]| before_unit(column) == name;
        for matches in [&whole as &dyn Fn(&[u8]) -> bool, &without_unit] {
            let places: Vec<usize> = (0..self.names.len()).filter(|&at| matches(self.names[at])).collect();
            match places[..] {
                [place] => return Ok(place),
                [] => (),
                [first, second, ..] => {
                    let name = excerpt(name);
                    let message = format!("columns {} and {} are both named `{name}`", first + 1, second + 1);
                    return Err((message, "give the number of the column".to_owned()));
                }
            }
        }
        Err((format!("there is no column `{}`", excerpt(name)), self.nearest(name)))
    }

    /// Returns a help with the most similar name, and all names.
    fn nearest(&self, name: &[u8]) -> String {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).to_lowercase();
        let distance = |column: &&&[u8]| strsim::damerau_levenshtein(&text(name), &text(before_unit(column)));
        let near = |column: &&&[u8]| distance(column) <= 2 && distance(column) < before_unit(column).len();
        match self.names.iter().filter(near).min_by_key(distance) {
            Some(column) => format!("did you mean `{}`? {}", excerpt(column), self.all()),
            None => self.all(),
        }
    }

    /// Returns a help with all columns.
    fn all(&self) -> String {
        let names: Vec<String> = self.names.iter().map(|name| excerpt(name)).collect();
        if names.is_empty() {
            format!("use a number from 1 to {}", self.fields)
        } else {
            format!("use one of the columns {}", names.join(", "))
        }
    }
}

/// Returns the names in a comment, if it has as many fields as the rows.
fn names_in(comment: &[u8], of_rows: Separator, fields: usize) -> Option<Vec<&[u8]>> {
    let text = comment.trim_ascii_start();
    let begin = text.iter().position(|byte| !matches!(byte, b'#' | b'%' | b'!' | b' ' | b'\t'))?;
    let text = &text[begin..];
    let separators = [of_rows, separator_of(text), Separator::Blanks];
    separators.into_iter().map(|separator| split(separator, text)).find(|names| names.len() == fields)
}

/// Returns a name without the unit in brackets after it.
fn before_unit(name: &[u8]) -> &[u8] {
    let bracket = name.iter().position(|byte| matches!(byte, b'[' | b'('));
    let behind = matches!(name.last(), Some(b']' | b')'));
    match bracket {
        Some(at) if behind && at > 0 => name[..at].trim_ascii_end(),
        _ => name,
    }
}

/// Reader of rows.
struct SeriesReader<'r> {
    file: &'r InputFile,
    layout: &'r Layout<'r>,
    /// Index of the time column, then of the other columns.
    places: Vec<usize>,
    series: Series,
    bad: BadLines,
}

impl<'r> SeriesReader<'r> {
    fn new(file: &'r InputFile, layout: &'r Layout<'r>, places: Vec<usize>) -> Self {
        let columns = vec![Vec::new(); places.len() - 1];
        let series = Series { times: Vec::new(), columns, lines: Vec::new() };
        Self { file, layout, places, series, bad: BadLines::default() }
    }

    fn row(&mut self, line: usize, fields: &[&[u8]]) -> Result<(), Diagnostic> {
        if fields.len() != self.layout.fields {
            let count = match fields.len() {
                1 => "1 field".to_owned(),
                count => format!("{count} fields"),
            };
            let message = format!("row has {count}, the first line has {}", self.layout.fields);
            return Err(row_error(self.file, line, message));
        }
        let numbers: Vec<f64> = self
            .places
            .iter()
            .map(|&place| self.cell(line, place, fields[place]))
            .collect::<Result<_, _>>()?;
        let time = numbers[0];
        if let (Some(&before), Some(above)) = (self.series.times.last(), self.series.lines.last())
            && time <= before
        {
            let message = format!("time {time} does not increase: line {above} has {before}");
            let help = "write ascending times: keep one row for each instant, and one run in each file";
            return Err(row_error(self.file, line, message).with_help(help));
        }
        self.series.times.push(time);
        self.series.lines.push(line);
        self.series.columns.iter_mut().zip(&numbers[1..]).for_each(|(column, value)| column.push(*value));
        Ok(())
    }

    /// Returns the number in a field.
    fn cell(&self, line: usize, place: usize, field: &[u8]) -> Result<f64, Diagnostic> {
        let cell_error = |what: &str| {
            let column = match self.layout.names.get(place) {
                Some(name) => format!("`{}`", excerpt(name)),
                None => format!("{}", place + 1),
            };
            row_error(self.file, line, format!("`{}` in column {column} {what}", excerpt(field)))
        };
        match number(field) {
            Some(value) if value.is_finite() => Ok(value),
            Some(_) => Err(cell_error("is not a finite number")),
            None if has_decimal_comma(field) => {
                Err(cell_error("has a decimal comma").with_help("write numbers with decimal points"))
            }
            None => Err(cell_error("is not a number")),
        }
    }

    /// Returns the diagnostic for a row whose time differs from the one before by rounding only.
    fn too_close(&self, row: usize) -> Diagnostic {
        let Series { times, lines, .. } = &self.series;
        let [before, time] = [times[row - 1], times[row]];
        let message = format!(
            "time {time:?} differs from that of line {} ({before:?}) by rounding only: the history would change in no time between the two rows",
            lines[row - 1]
        );
        let help = "remove one of the two rows, or write a jump with rows that are further apart";
        row_error(self.file, lines[row], message).with_help(help)
    }

    fn finish(self) -> Diagnosed<Series> {
        if !self.bad.is_empty() {
            return Err(self.bad.into_diagnostics(Code::SeriesRow, "row"));
        }
        let rows = self.series.times.len();
        if rows < MIN_ROWS {
            let count = if rows == 0 { "no rows" } else { "only one row" };
            let message = format!("file has {count}, a history needs at least two");
            return Err(vec![Diagnostic::new(Code::SeriesRow, message).in_file(self.file.path())]);
        }
        match closer_than_rounding(&self.series.times) {
            Some(row) => Err(vec![self.too_close(row)]),
            None => Ok(self.series),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, time: &str, wanted: &[&str]) -> Diagnosed<Series> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.csv");
        std::fs::write(&path, text).expect("written");
        let key = |text: &&str| match text.parse() {
            Ok(number) => ColumnKey::Number(number),
            Err(_) => ColumnKey::Name((*text).to_owned()),
        };
        let keys: Vec<ColumnKey> = wanted.iter().map(key).collect();
        read_series(&InputFile::open(&path).expect("a file"), &key(&time), &keys)
    }

    /// Two equal rows in the formats of different programs.
    #[test]
    fn every_way_of_writing_is_understood() {
        for (text, time, value) in [
            ("t,x,F\n0,9,1.5\n0.5,9,-2e1\n", "t", "F"),
            ("\u{feff}t;x;F\r\n0;9;1.5\r\n0.5;9;-2.0E+01\r\n", "t", "F"),
            ("# made by a solver\n%\n! 3 columns\nt x F\n0 9 1.5\n  0.5\t9   -20\n", "t", "F"),
            ("\"t [s]\",\"x, far [m]\",\"F (N)\"\n0,9,1.5\n0.5,9,-20\n", "t", "F"),
            ("t [s];x;F\ns;m;N\n0;9;1.5\n0.5;9;-20;\n", "t [s]", "F"),
            ("0 9 1.5\n0.5 9 -2.0D+01\n", "1", "3"),
            ("# t, x, F\n0, 9, 1.5\n# between\n\n0.5, 9, -20\n", "t", "F"),
            ("#t x F\n0 9 1.5\n0.5 9 -20\n", "t", "F"),
            ("my time\tthe x\tF\n0\t9\t1.5\n0.5\t9\t-20\n", "my time", "F"),
            ("t,name,F\n0,ab,1.5\n0.5,\"c,d\",-20\n", "t", "F"),
        ] {
            let series =
                read(text, time, &[value, value]).unwrap_or_else(|found| panic!("{text}: {found:?}"));
            assert_eq!(series.times, [0.0, 0.5], "{text}");
            assert_eq!(series.columns, [[1.5, -20.0], [1.5, -20.0]], "{text}");
        }
    }

    #[test]
    fn what_is_wrong_is_told_where_it_stands() {
        for (text, time, value, line, message) in [
            ("t,Fx\n0,1\n1,2\n", "t", "fy", 1, "there is no column `fy`"),
            ("t,F,F\n0,1,2\n1,2,3\n", "t", "F", 1, "columns 2 and 3 are both named `F`"),
            ("t,F\n0,1\n1,2\n", "t", "3", 1, "there is no column 3: the file has 2"),
            ("0,1\n1,2\n", "1", "F", 1, "there is no column `F`: the columns have no names"),
            ("t;F\n0;1,5\n1;2,5\n", "t", "F", 2, "`1,5` in column `F` has a decimal comma"),
            ("t F\n0,0 1,5\n1,0 2,5\n", "t", "F", 2, "`0,0` in column `t` has a decimal comma"),
            ("t,F\n0,1,5\n1,2,5\n", "t", "F", 2, "row has 3 fields, the first line has 2"),
            ("t,F\n0,1\n\n1,x\n", "t", "F", 4, "`x` in column `F` is not a number"),
            ("t,F\n0,1\n1,NaN\n", "t", "F", 3, "`NaN` in column `F` is not a finite number"),
            ("t,F\n0,1\n1,-inf\n", "t", "F", 3, "`-inf` in column `F` is not a finite number"),
            ("t,F\n0,1\n1,\n", "t", "F", 3, "row has 1 field, the first line has 2"),
            (
                "#t x F\n0 9 1.5\n0.5 9 -20",
                "t",
                "F",
                3,
                "the file may end within its last number: unlike the others, the last line has no line end",
            ),
            ("t,F\n0,1\n1,2\n1,3\n", "t", "F", 4, "time 1 does not increase: line 3 has 1"),
        ] {
            let found = read(text, time, &[value]).expect_err(text);
            assert_eq!((found[0].line(), found[0].message()), (Some(line), message), "{text}");
        }
        for text in ["t,F\n", "t,F\n0,1\n", "# nothing\n"] {
            assert!(read(text, "t", &["F"]).is_err(), "{text}");
        }
    }
}
