//! A growing text with headings, wrapped paragraphs, lists and tables.

use super::Colour;
use super::table::Table;

/// Columns after which running text is wrapped.
const WIDTH: usize = 100;

pub struct Sheet {
    colour: Colour,
    text: String,
}

impl Sheet {
    pub fn new(colour: Colour) -> Sheet {
        Sheet { colour, text: String::new() }
    }

    pub fn finish(self) -> String {
        self.text
    }

    pub fn line(&mut self, line: &str) {
        self.text.push_str(line.trim_end());
        self.text.push('\n');
    }

    /// A section's head, set apart by an empty line.
    pub fn heading(&mut self, words: &str) {
        if !self.text.is_empty() {
            self.text.push('\n');
        }
        let emphasised = self.emphasised(words, "1");
        self.line(&emphasised);
    }

    /// A verdict or warning: emphasised by an ANSI colour code such as `1;32`.
    pub fn banner(&mut self, words: &str, code: &str) {
        let emphasised = self.emphasised(words, code);
        self.line(&emphasised);
    }

    pub fn paragraph(&mut self, words: &str, indent: usize) {
        self.wrapped(words, &" ".repeat(indent), indent);
    }

    pub fn item(&mut self, words: &str) {
        self.wrapped(words, "  - ", 4);
    }

    pub fn table(&mut self, table: &Table, indent: usize) {
        for line in table.lines(indent) {
            self.line(&line);
        }
    }

    fn wrapped(&mut self, words: &str, first: &str, indent: usize) {
        let mut line = first.to_string();
        let mut length = line.chars().count();
        let mut fresh = true;
        for word in words.split_whitespace() {
            let size = word.chars().count();
            if !fresh && length + 1 + size > WIDTH {
                self.line(&line);
                line = " ".repeat(indent);
                length = indent;
                fresh = true;
            }
            if !fresh {
                line.push(' ');
                length += 1;
            }
            line.push_str(word);
            length += size;
            fresh = false;
        }
        self.line(&line);
    }

    fn emphasised(&self, words: &str, code: &str) -> String {
        match self.colour {
            Colour::Always => format!("\u{1b}[{code}m{words}\u{1b}[0m"),
            Colour::Never => words.to_string(),
        }
    }
}
