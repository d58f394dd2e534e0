//! Data elements of a MAT-file: a tag with type and number of bytes, and the bytes.

use super::HELP;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::memory::{left, refuse_beyond};
use std::io::{ErrorKind, Read};

pub(crate) type Found<T> = std::result::Result<T, Diagnostic>;

/// Byte order of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    Little,
    Big,
}

impl Order {
    /// Returns the byte order of a file of version 5 that begins with `head`; `None` for other files.
    pub(super) fn of(head: &[u8]) -> Option<Self> {
        match head.get(124..128)? {
            b"\x00\x01IM" => Some(Self::Little),
            b"\x01\x00MI" => Some(Self::Big),
            _ => None,
        }
    }

    /// Returns the bytes as a number, without regard to a sign.
    fn digits(self, bytes: &[u8]) -> u64 {
        let append = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        match self {
            Self::Little => bytes.iter().rev().fold(0, append),
            Self::Big => bytes.iter().fold(0, append),
        }
    }

    /// Returns two whole numbers of four bytes.
    pub(super) fn two(self, bytes: &[u8; 8]) -> [u32; 2] {
        [self.digits(&bytes[..4]) as u32, self.digits(&bytes[4..]) as u32]
    }
}

/// Consecutive elements of a variable.
pub(super) struct Elements<'a> {
    stream: Box<dyn Read + 'a>,
    order: Order,
}

impl<'a> Elements<'a> {
    /// Returns the elements in the body of a variable.
    pub(super) fn of(body: &'a [u8], compressed: bool, order: Order) -> Found<Self> {
        let mut elements = Self { stream: Box::new(body), order };
        if compressed {
            elements.stream = Box::new(flate2::read::ZlibDecoder::new(body));
            // Packed bytes hold a variable with its tag.
            elements.take(8)?;
        }
        Ok(elements)
    }

    /// Returns the next element.
    ///
    /// # Errors
    /// FB103 for damaged packed bytes, FB304 if the variable ends within the element or the element has more than
    /// `most` bytes, FB601.
    pub(super) fn next(&mut self, most: u64) -> Found<Numbers> {
        let tag: [u8; 8] = self.take(8)?.try_into().expect("eight bytes were read");
        let [kind, length] = self.order.two(&tag);
        // An element of up to four bytes is stored in the tag itself.
        if kind >> 16 != 0 {
            let bytes = tag[4..].get(..(kind >> 16) as usize).ok_or_else(|| {
                Diagnostic::new(
                    Code::MatrixSyntax,
                    "an element that is stored in its tag is longer than 4 bytes",
                )
                .with_help(HELP)
            })?;
            return Ok(Numbers { kind: kind & 0xffff, bytes: bytes.to_vec(), order: self.order });
        }
        if u64::from(length) > most {
            let message = format!("a variable has {length} bytes, but its extents allow at most {most}");
            return Err(Diagnostic::new(Code::MatrixCount, message).with_help(HELP));
        }
        let what = "reading a variable";
        refuse_beyond(left(), f64::from(length), what, "use a larger machine")
            .map_err(|error| error.first_error().clone())?;
        let bytes = self.take(u64::from(length))?;
        let padding = u64::from(length).next_multiple_of(8) - u64::from(length);
        // The padding of the last element of a file may be missing.
        self.read(padding)?;
        Ok(Numbers { kind, bytes, order: self.order })
    }

    /// Reads to the end, where the checksum of packed bytes is verified.
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

    /// Returns the next `length` bytes, or fewer at the end.
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

/// Content of an element: numbers of one type, or text.
pub(super) struct Numbers {
    kind: u32,
    pub bytes: Vec<u8>,
    order: Order,
}

impl Numbers {
    /// Returns the bytes per number; `None` if the element holds no numbers.
    fn width(&self) -> Option<usize> {
        Some(match self.kind {
            1 | 2 => 1,
            3 | 4 => 2,
            5..=7 => 4,
            9 | 12 | 13 => 8,
            _ => return None,
        })
    }

    /// Returns the number of numbers.
    pub(super) fn len(&self) -> usize {
        self.width().map_or(0, |width| self.bytes.len() / width)
    }

    fn is_real(&self) -> bool {
        matches!(self.kind, 7 | 9)
    }

    /// Returns true when the type of the numbers is an integer.
    pub(super) fn is_whole(&self) -> bool {
        self.width().is_some() && !self.is_real()
    }

    /// Returns the k-th number if it is an integer that fits into i64.
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

    /// Returns the k-th number.
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
