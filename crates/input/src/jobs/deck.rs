//! Keyword decks (`.inp`) of Abaqus and CalculiX: cards `*KEYWORD, PARAMETER=VALUE`, each with lines of data.

use crate::sets::comparable;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::memory::{left, refuse_beyond};
use flexbody_base::text::Compression;
use flexbody_base::text::compression::broken;
use flexbody_base::text::input_file::{InputFile, SeenFile};
use flexbody_base::text::scanner::{Line, Lines, excerpt, line_end};
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Depth of included files above which a file is taken to include itself.
const MAX_INCLUDE_DEPTH: usize = 20;

/// Largest number of included files, each counted as often as it is included.
const MAX_FILES: usize = 1000;

/// Number of bytes of a compressed deck that are unpacked at a time.
const PIECE_BYTES: usize = 1 << 26;

/// Largest length of the text of a compressed deck, in lengths of the file. Decks with a mesh have 3 to 10; a larger value
/// lets a damaged or malicious file take more memory.
const LARGEST_RATIO: u64 = 200;

/// Deck with all files that it includes.
pub(super) struct Deck {
    files: Vec<DeckFile>,
    cards: Vec<Card>,
}

/// File of a deck.
struct DeckFile {
    file: InputFile,
    /// Text of a compressed file.
    unpacked: Option<Vec<u8>>,
}

impl DeckFile {
    fn open(path: &Path) -> Result<Self, Diagnostic> {
        let file = InputFile::open(path)?;
        let compression = Compression::of(file.bytes());
        if compression == Compression::None {
            return Ok(Self { file, unpacked: None });
        }
        let longest = LARGEST_RATIO.saturating_mul(file.length()).max(PIECE_BYTES as u64);
        let mut text = Vec::new();
        let mut stream = compression.stream_of(&file);
        loop {
            // A small file may hold a large text, which grows piece by piece within the memory.
            let needed = (text.len() + PIECE_BYTES) as f64;
            let fits = refuse_beyond(left(), needed, "unpacking the deck", "use a larger machine");
            fits.map_err(|refused| refused.first_error().clone().in_file(path))?;
            let read = (&mut stream).take(PIECE_BYTES as u64).read_to_end(&mut text);
            if read.map_err(|error| broken(path, &error))? == 0 {
                break;
            }
            if text.len() as u64 > longest {
                let message = format!("the deck unpacks to more than {LARGEST_RATIO} times its size");
                let diagnostic = Diagnostic::new(Code::DeckSyntax, message).in_file(path);
                return Err(diagnostic.with_help("unpack it, and check its content"));
            }
        }
        drop(stream);
        Ok(Self { file, unpacked: Some(text) })
    }

    fn bytes(&self) -> &[u8] {
        self.unpacked.as_deref().unwrap_or_else(|| self.file.bytes())
    }

    fn path(&self) -> &Path {
        self.file.path()
    }
}

/// Keyword line and the lines of data below it.
#[derive(Debug, Clone)]
pub(super) struct Card {
    /// Keyword in upper case, without the asterisk and without blanks, which have no meaning.
    pub keyword: String,
    /// Keyword as written, in upper case, with single blanks between words.
    pub title: String,
    /// Parameter names in upper case, and values; empty for a parameter without a value.
    parameters: Vec<(String, String)>,
    file: usize,
    /// Line of the keyword, from 1.
    line: usize,
    data: Range<usize>,
    /// Line of the first byte of the data.
    first: usize,
}

impl Card {
    /// Returns the value of a parameter, without quotes; empty if it has none, `None` without the parameter.
    pub(super) fn parameter(&self, name: &str) -> Option<&str> {
        self.parameters.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    /// Returns the keyword line.
    pub(super) fn head(&self) -> String {
        let parameters = self.parameters.iter().map(|(name, value)| match value.as_str() {
            "" => format!(", {name}"),
            value => format!(", {name}={value}"),
        });
        format!("*{}{}\n", self.title, parameters.collect::<String>())
    }

    /// Returns the value of a parameter in the form in which names are compared.
    pub(super) fn name(&self, parameter: &str) -> Option<String> {
        self.parameter(parameter).map(comparable)
    }
}

impl Deck {
    /// Reads a deck and the files that it includes, compressed or not.
    ///
    /// # Errors
    /// FB101, FB106 for files that cannot be read; FB110 for lines of data before the first keyword, and for files that
    /// include themselves.
    pub(super) fn read(path: &Path) -> Diagnosed<Self> {
        let mut deck = Self { files: Vec::new(), cards: Vec::new() };
        deck.include(path, 0).map_err(|diagnostic| vec![diagnostic])?;
        Ok(deck)
    }

    /// Returns the cards in the order of the deck. Data that continue in an included file, or after it, have a separate
    /// card with the keyword that they belong to.
    pub(super) fn cards(&self) -> &[Card] {
        &self.cards
    }

    /// Returns the files of the deck, the main one first.
    ///
    /// # Errors
    /// FB132 for files that changed while they were read.
    pub(super) fn seen(&self) -> Diagnosed<Vec<(&'static str, SeenFile)>> {
        let seen = |file: &DeckFile| Ok(("deck", file.file.seen()?));
        self.files.iter().map(seen).collect::<Result<_, Diagnostic>>().map_err(|diagnostic| vec![diagnostic])
    }

    /// Returns the text below a card as written, comments included, and the number of its first line.
    pub(super) fn text(&self, card: &Card) -> (usize, &[u8]) {
        (card.first, &self.files[card.file].bytes()[card.data.clone()])
    }

    /// Returns the lines of data of a card with their numbers, without comments and blank lines.
    pub(super) fn data<'d>(&'d self, card: &Card) -> impl Iterator<Item = (usize, &'d [u8])> + use<'d> {
        let (first, bytes) = self.text(card);
        let lines = Lines::below(bytes, first.saturating_sub(1));
        let is_data = |line: &Line<'_>| !line.text.starts_with(b"**");
        lines.filter_map(Line::content).filter(is_data).map(|line| (line.number, line.text))
    }

    /// Returns a diagnostic about a line of the file with the card.
    pub(super) fn at(&self, card: &Card, line: usize, code: Code, message: impl Into<String>) -> Diagnostic {
        Diagnostic::new(code, message).in_file(self.files[card.file].path()).at_line(line)
    }

    /// Returns the line of a card in the main file; `None` in an included file.
    pub(super) fn line(&self, card: &Card) -> Option<usize> {
        (card.file == 0).then_some(card.line)
    }

    /// Returns the path of the main file.
    pub(super) fn path(&self) -> &Path {
        self.files.first().map_or(Path::new(""), DeckFile::path)
    }

    /// Returns a diagnostic about a card.
    pub(super) fn about(&self, card: &Card, code: Code, message: impl Into<String>) -> Diagnostic {
        self.at(card, card.line, code, message)
    }

    fn include(&mut self, path: &Path, depth: usize) -> Result<(), Diagnostic> {
        let file = DeckFile::open(path)?;
        if depth > MAX_INCLUDE_DEPTH || self.files.len() >= MAX_FILES {
            let message = format!(
                "included files are nested more than {MAX_INCLUDE_DEPTH} levels deep, or are more than {MAX_FILES}"
            );
            return Err(Diagnostic::new(Code::DeckSyntax, message)
                .in_file(path)
                .with_help("remove the *INCLUDE with which a file includes itself"));
        }
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let at = self.files.len();
        self.files.push(file);
        let mut position = 0;
        let mut line = 1;
        while position < self.files[at].bytes().len() {
            let (card, end, after) = self.next_card(at, position, line)?;
            (position, line) = (end, after);
            let Some(card) = card else { continue };
            let more = self.more(&card, &folder);
            if card.keyword != "INCLUDE" {
                let mut card = card.clone();
                // Data of the file named in INPUT belong to the card, and name no further file.
                card.parameters.retain(|(name, _)| more.is_none() || name != "INPUT");
                self.cards.push(card);
            }
            if let Some(path) = more {
                let path = path?;
                self.include(&path, depth + 1).map_err(|diagnostic| match diagnostic.file() {
                    // A missing file is reported at the card that includes it.
                    Some(file) if file == path && diagnostic.code() == Code::FileUnreadable => self.about(
                        &card,
                        Code::FileUnreadable,
                        format!("{} is included: {}", path.display(), diagnostic.message()),
                    ),
                    _ => diagnostic,
                })?;
                if card.keyword == "INCLUDE" {
                    let rest = self.continued(&card);
                    self.cards.extend(rest);
                }
            }
        }
        Ok(())
    }

    /// Returns the file that a card names for more of the deck (*INCLUDE) or of its data; `None` if it names none.
    fn more(&self, card: &Card, folder: &Path) -> Option<Result<PathBuf, Diagnostic>> {
        match (card.keyword.as_str(), card.parameter("INPUT")) {
            ("INCLUDE" | "NODE" | "ELEMENT" | "NSET" | "ELSET", Some(name)) if !name.is_empty() => {
                Some(Ok(self.place_of(name, folder)))
            }
            ("INCLUDE", _) => Some(Err(self
                .about(card, Code::DeckSyntax, "*INCLUDE names no file")
                .with_help("write *INCLUDE, INPUT=FILE"))),
            _ => None,
        }
    }

    /// Returns the path of a file that a card names: relative to the folder of the job, in which programs run, else to
    /// that of the file with the card.
    fn place_of(&self, name: &str, folder: &Path) -> PathBuf {
        let main = self.files.first().and_then(|file| file.path().parent()).unwrap_or(folder);
        let upright = name.replace('\\', "/");
        let places = [main.join(name), folder.join(name), main.join(&upright), folder.join(&upright)];
        places.iter().find(|path| path.is_file()).unwrap_or(&places[0]).clone()
    }

    /// Returns the data below an *INCLUDE, if there are any, as a continuation of the last card of the included file.
    fn continued(&self, include: &Card) -> Option<Card> {
        self.data(include).next()?;
        let Card { file, line, ref data, first, .. } = *include;
        Some(Card { file, line, data: data.clone(), first, ..self.cards.last()?.clone() })
    }

    /// Returns the card that begins at a byte of a file (`None` if there are only comments), and the start of the next
    /// card.
    fn next_card(
        &self,
        at: usize,
        position: usize,
        line: usize,
    ) -> Result<(Option<Card>, usize, usize), Diagnostic> {
        let bytes = self.files[at].bytes();
        let (mut head, mut end, mut number) = (String::new(), position, line);
        if is_keyword(&bytes[position..]) {
            // A keyword line that ends with a comma continues.
            loop {
                let stop = line_end(bytes, end);
                let text = String::from_utf8_lossy(&bytes[end..stop]);
                head.push_str(text.trim());
                (end, number) = (stop.min(bytes.len()), number + 1);
                let continues = head.ends_with(',') && end < bytes.len() && !is_keyword(&bytes[end..]);
                if !continues {
                    break;
                }
            }
        }
        // Data extend to the next keyword line.
        let (data, first) = (end, number);
        while end < bytes.len() && !is_keyword(&bytes[end..]) {
            end = line_end(bytes, end);
            number += 1;
        }
        let card = |title: String, parameters| {
            let keyword = comparable(&title);
            Card { keyword, title, parameters, file: at, line, data: data..end, first }
        };
        if !head.is_empty() {
            let (title, parameters) = keyword(&head);
            return Ok((Some(card(title, parameters)), end, number));
        }
        let loose = card(String::new(), Vec::new());
        let stray = self.data(&loose).next();
        match (stray, self.cards.last()) {
            (None, _) => Ok((None, end, number)),
            // The first lines of an included file continue the card above its *INCLUDE.
            (Some(_), Some(before)) if position == 0 => {
                Ok((Some(Card { file: at, line, data: data..end, first, ..before.clone() }), end, number))
            }
            (Some((line, text)), _) => Err(Diagnostic::new(
                Code::DeckSyntax,
                format!("`{}` comes before the first keyword", excerpt(text)),
            )
            .in_file(self.files[at].path())
            .at_line(line)
            .with_help("begin the deck with a keyword line such as *NODE")),
        }
    }
}

/// Returns true when a line is a keyword line: it begins with a single asterisk, after any blanks.
fn is_keyword(line: &[u8]) -> bool {
    let start = line.iter().position(|b| !matches!(b, b' ' | b'\t')).unwrap_or(line.len());
    line.get(start) == Some(&b'*') && line.get(start + 1) != Some(&b'*')
}

/// Returns keyword and parameters of a keyword line.
fn keyword(line: &str) -> (String, Vec<(String, String)>) {
    let mut fields = line.trim_start_matches('*').split(',').map(str::trim);
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ").to_uppercase();
    let title = words(fields.next().unwrap_or_default());
    let parameters = fields.filter(|field| !field.is_empty()).map(|field| {
        let (name, value) = field.split_once('=').unwrap_or((field, ""));
        (comparable(name), value.trim().trim_matches('"').to_owned())
    });
    (title, parameters.collect())
}

/// Returns the trimmed fields of a line of data. A comma at the end of the line begins no field.
pub(super) fn fields(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.strip_suffix(b",").unwrap_or(line).split(|&b| b == b',').map(<[u8]>::trim_ascii)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn texts(deck: &Deck, card: &Card) -> Vec<(usize, String)> {
        deck.data(card).map(|(line, text)| (line, String::from_utf8_lossy(text).into_owned())).collect()
    }

    #[test]
    fn cards_have_their_parameters_and_data_and_included_files_go_on_with_them() {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("more.inp"), "3, 1, 0, 0\n** end\n*elset, elset=E\n7\n")
            .expect("written");
        let text = "** head\n*Heading\n a title\n*Solid  Section,\n elset = \"All of it\" , Material=STEEL\n,\n\
            *NODE\n1, 0, 0, 0\n*INCLUDE, INPUT=more.inp\n8\n*End Step\n";
        let path = folder.path().join("job.inp");
        fs::write(&path, text).expect("written");
        let deck = Deck::read(&path).expect("a deck");
        let keywords: Vec<&str> = deck.cards().iter().map(|card| card.keyword.as_str()).collect();
        assert_eq!(
            keywords,
            ["HEADING", "SOLIDSECTION", "NODE", "NODE", "ELSET", "ELSET", "ENDSTEP"],
            "data of the included file, and after it"
        );
        let [_, section, node, more, elset, rest, _] = deck.cards() else { panic!("seven cards") };
        assert_eq!(section.parameter("ELSET"), Some("All of it"));
        assert_eq!(section.name("MATERIAL").as_deref(), Some("STEEL"));
        assert_eq!(texts(&deck, node), [(8, "1, 0, 0, 0".to_owned())]);
        assert_eq!(texts(&deck, more), [(1, "3, 1, 0, 0".to_owned())]);
        assert_eq!(texts(&deck, elset), [(4, "7".to_owned())]);
        // Data below *INCLUDE continue the last card of the included file.
        assert_eq!(texts(&deck, rest), [(10, "8".to_owned())]);
    }

    #[test]
    fn decks_that_make_no_sense_are_refused_where_they_do_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("job.inp");
        for (text, line, part) in [
            ("1, 2, 3\n*NODE\n", 1, "before the first keyword"),
            ("*INCLUDE\n", 1, "names no file"),
            ("*NODE\n1,0,0,0\n*INCLUDE, INPUT=not_there.inp\n", 3, "not_there.inp is included"),
        ] {
            fs::write(&path, text).expect("written");
            let found = Deck::read(&path).err().expect("refused");
            assert_eq!(found[0].line(), Some(line), "{text}");
            assert!(found[0].message().contains(part), "{}", found[0].message());
        }
        fs::write(&path, "*INCLUDE, INPUT=job.inp\n").expect("written");
        assert!(Deck::read(&path).err().expect("refused")[0].message().contains("levels deep"));
    }

    #[test]
    fn packed_decks_are_unpacked_within_limits() {
        use std::io::Write;
        let folder = tempfile::tempdir().expect("a folder");
        let packed = |name: &str, text: &[u8]| {
            let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
            packer.write_all(text).expect("packed");
            let bytes = packer.finish().expect("packed");
            let path = folder.path().join(name);
            fs::write(&path, &bytes).expect("written");
            (path, bytes)
        };
        let (path, bytes) = packed("job.inp.gz", b"*NODE\n1, 0, 0, 0\n*END STEP\n");
        let deck = Deck::read(&path).expect("a deck");
        assert_eq!(texts(&deck, &deck.cards()[0]), [(2, "1, 0, 0, 0".to_owned())]);
        fs::write(&path, &bytes[..bytes.len() - 12]).expect("written");
        assert_eq!(Deck::read(&path).err().expect("refused")[0].code(), Code::FileCompressionBroken);
        let (path, _) = packed("bomb.inp.gz", &vec![b'\n'; PIECE_BYTES + (1 << 20)]);
        let refused = Deck::read(&path).err().expect("refused");
        assert!(refused[0].message().contains("more than 200 times its size"), "{}", refused[0].message());
    }
}
