//! The elements of an XML file in their order, each with its attributes and the bytes between its tags.

use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

/// Element of an XML file.
pub(super) struct Element<'a> {
    pub name: String,
    /// Name of the enclosing element; empty for the outermost.
    pub parent: String,
    attributes: Vec<(String, String)>,
    /// Bytes between its tag and the next one.
    pub content: &'a [u8],
}

impl Element<'_> {
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    /// Returns an attribute as a whole number.
    pub(super) fn number(&self, name: &str) -> Option<u64> {
        self.attribute(name)?.trim().parse().ok()
    }
}

/// Reads the elements up to the end, or up to an element named `last`, whose content is the rest of the file.
///
/// # Errors
/// A description of the problem, if the text is not XML.
pub(super) fn elements<'a>(bytes: &'a [u8], last: &str) -> Result<Vec<Element<'a>>, String> {
    let mut reader = Reader::from_reader(bytes);
    let mut elements: Vec<Element<'a>> = Vec::new();
    // Indices of the elements that enclose the next one.
    let mut open: Vec<usize> = Vec::new();
    loop {
        let event = reader.read_event().map_err(|error| format!("file is not XML: {error}"))?;
        let begins = matches!(event, Event::Start(_));
        match event {
            Event::Start(tag) | Event::Empty(tag) => {
                let parent = open.last().map_or(String::new(), |outer| elements[*outer].name.clone());
                elements.push(element(&tag, parent)?);
            }
            Event::End(_) => {
                open.pop();
            }
            Event::Eof if open.is_empty() => return Ok(elements),
            Event::Eof => return Err("file ends within an element: it may be cut off".to_owned()),
            _ => {}
        }
        if let (true, Some(element)) = (begins, elements.last_mut()) {
            let begin = usize::try_from(reader.buffer_position()).unwrap_or(bytes.len());
            let rest = bytes.get(begin..).unwrap_or_default();
            if element.name == last {
                element.content = rest;
                return Ok(elements);
            }
            element.content = &rest[..memchr::memchr(b'<', rest).unwrap_or(rest.len())];
            open.push(elements.len() - 1);
        }
    }
}

fn element<'a>(tag: &BytesStart<'_>, parent: String) -> Result<Element<'a>, String> {
    let mut attributes = Vec::new();
    for attribute in tag.attributes() {
        let attribute = attribute.map_err(|error| format!("file is not XML: {error}"))?;
        let value = attribute.normalized_value(XmlVersion::default());
        let value = value.map_err(|error| format!("file is not XML: {error}"))?;
        attributes.push((attribute.key.as_ref().to_owned(), value.into_owned()));
    }
    Ok(Element { name: tag.name().as_ref().to_owned(), parent, attributes, content: &[] })
}
