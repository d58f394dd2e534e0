//! Data elements of a MAT-file: a tag with type and number of bytes, and the bytes.

use super::HELP;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::memory::{left, refuse_beyond};
use std::io::{ErrorKind, Read};

pub(crate) type Found<T> = std::result::Result<T, Diagnostic>;

/// Order of the bytes of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    Little,
    Big,
}

impl Order {
    /// That of a file of version 5 that begins with `head`.
    pub(super) fn of(head: &[u8]) -> Option<Self> {
        match head.get(124..128)? {
            b"\x00\x01IM" => Some(Self::Little),
            b"\x01\x00MI" => Some(Self::Big),
            _ => None,
        }
    }

    /// The number that these bytes are, without regard to a sign.
    fn digits(self, bytes: &[u8]) -> u64 {
        let append = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        match self {
            Self::Little => bytes.iter().rev().fold(0, append),
            Self::Big => bytes.iter().fold(0, append),
        }
    }

    /// Two whole numbers of four bytes.
    pub(super) fn two(self, bytes: &[u8; 8]) -> [u32; 2] {
        [self.digits(&bytes[..4]) as u32, self.digits(&bytes[4..]) as u32]
    }
}

/// The elements that a variable consists of, one after the other.
pub(super) struct Elements<'a> {
    stream: Box<dyn Read + 'a>,
    order: Order,
}

impl<'a> Elements<'a> {
    /// Those in `body`, which is that of a variable.
    pub(super) fn of(body: &'a [u8], compressed: bool, order: Order) -> Found<Self> {
        let mut elements = Self { stream: Box::new(body), order };
        if compressed {
            elements.stream = Box::new(flate2::read::ZlibDecoder::new(body));
            // What is packed is a variable with its tag.
            elements.take(8)?;
        }
        Ok(elements)
    }

    /// The next element.
    ///
    /// # Errors
    /// FB103 for damaged packed bytes, FB304 where the variable ends within it or the element has more than `most`
    /// bytes, FB601.
    pub(super) fn next(&mut self, most: u64) -> Found<Numbers> {
        let tag: [u8; 8] = self.take(8)?.try_into().expect("eight bytes were read");
        let [kind, length] = self.order.two(&tag);
        // Up to four bytes stand in the tag itself.
        if kind >> 16 != 0 {
            let bytes = tag[4..].get(..(kind >> 16) as usize).ok_or_else(|| {
                Diagnostic::new(Code::MatrixSyntax, "an element within its tag is longer than that")
                    .with_help(HELP)
            })?;
            return Ok(Numbers { kind: kind & 0xffff, bytes: bytes.to_vec(), order: self.order });
        }
        if u64::from(length) > most {
            let message = format!("a variable has {length} bytes where its extents leave {most} at the most");
            return Err(Diagnostic::new(Code::MatrixCount, message).with_help(HELP));
        }
        let what = "reading a variable";
        refuse_beyond(left(), f64::from(length), what, "use a larger machine")
            .map_err(|error| error.first_error().clone())?;
        let bytes = self.take(u64::from(length))?;
        let padding = u64::from(length).next_multiple_of(8) - u64::from(length);
        // The last element of a file may lack it.
        self.read(padding)?;
        Ok(Numbers { kind, bytes, order: self.order })
    }

    /// Goes to the end, where the checksum of packed bytes stands.
    pub(super) fn finish(mut self) -> Found<()> {
        std::io::copy(&mut self.stream, &mut std::io::sink()).map_err(damaged).map(|_| ())
    }

    fn take(&mut self, length: u64) -> Found<Vec<u8>> {
        let bytes = self.read(length)?;
        if bytes.len() as u64 == length {
            return Ok(bytes);
        }
        let message = "a variable ends within its data: the file may be cut off";
        Err(Diagnostic::new(Code::MatrixCount, message).with_help(HELP))
    }

    /// So many bytes, or those that there are.
    fn read(&mut self, length: u64) -> Found<Vec<u8>> {
        let mut bytes = Vec::new();
        self.stream.by_ref().take(length).read_to_end(&mut bytes).map_err(damaged)?;
        Ok(bytes)
    }
}

fn damaged(error: std::io::Error) -> Diagnostic {
    let message = match error.kind() {
        ErrorKind::UnexpectedEof => "a compressed variable ends before its data do".to_owned(),
        _ => format!("a compressed variable is damaged: {error}"),
    };
    Diagnostic::new(Code::FileCompressionBroken, message).with_help(HELP)
}

/// The contents of an element: numbers of one type, or text.
pub(super) struct Numbers {
    kind: u32,
    pub bytes: Vec<u8>,
    order: Order,
}

impl Numbers {
    /// Bytes of a number; `None` where the element is none of numbers.
    fn width(&self) -> Option<usize> {
        Some(match self.kind {
            1 | 2 => 1,
            3 | 4 => 2,
            5..=7 => 4,
            9 | 12 | 13 => 8,
            _ => return None,
        })
    }

    /// How many numbers there are.
    pub(super) fn len(&self) -> usize {
        self.width().map_or(0, |width| self.bytes.len() / width)
    }

    fn is_real(&self) -> bool {
        matches!(self.kind, 7 | 9)
    }

    /// Whether every number is a whole one by its type.
    pub(super) fn is_whole(&self) -> bool {
        self.width().is_some() && !self.is_real()
    }

    /// The k-th number, if it is a whole one that fits.
    pub(super) fn whole(&self, k: usize) -> Option<i64> {
        if !self.is_whole() {
            return None;
        }
        let width = self.width()?;
        let number = self.order.digits(self.bytes.get(k * width..(k + 1) * width)?);
        let unused = 64 - 8 * width as u32;
        match self.kind {
            2 | 4 | 6 | 13 => i64::try_from(number).ok(),
            _ => Some(((number << unused) as i64) >> unused),
        }
    }

    /// The k-th number.
    pub(super) fn real(&self, k: usize) -> Option<f64> {
        let digits = |width: usize| Some(self.order.digits(self.bytes.get(k * width..(k + 1) * width)?));
        match self.kind {
            7 => Some(f64::from(f32::from_bits(digits(4)? as u32))),
            9 => Some(f64::from_bits(digits(8)?)),
            13 => Some(digits(8)? as f64),
            _ => self.whole(k).map(|number| number as f64),
        }
    }
}
