//! Texts of files as lines of a terminal and as markup of a page.

use maud::Render;

/// Returns a text from a file for one line of a terminal or a page. Characters that control a terminal or
/// change the direction of text are replaced.
pub(crate) fn plain(text: &str) -> String {
    let steers = |c: char| {
        c.is_control()
            || matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
    };
    text.chars().map(|c| if steers(c) { '\u{fffd}' } else { c }).collect()
}

/// User text, escaped, without control characters that change the direction of text.
pub(crate) struct Plain<'t>(pub &'t str);

impl Render for Plain<'_> {
    fn render_to(&self, buffer: &mut String) {
        plain(self.0).render_to(buffer);
    }
}

/// Returns a text with raised exponents: the 2 of `t mm^2`.
pub(crate) fn raised(text: &str) -> String {
    text.replace("^2", "\u{b2}").replace("^3", "\u{b3}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_steer_a_terminal() {
        assert_eq!(plain("a\u{1b}[31mb\n\u{202e}c"), "a\u{fffd}[31mb\u{fffd}\u{fffd}c");
        assert_eq!(plain("Kurbelgehäuse 日本"), "Kurbelgehäuse 日本");
    }
}
