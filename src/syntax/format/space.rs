//! Where blanks stand.

use super::token::{Kind, Token};

/// A line that ends with this is not complete.
pub(super) fn ends_open(kind: Kind, text: &str) -> bool {
    kind == Kind::Joining || kind == Kind::Sign && !matches!(text, "," | "'" | "°")
}

/// A line that begins with this belongs to the one before.
pub(super) fn goes_on(first: &Token<'_>) -> bool {
    match first.kind {
        Kind::Joining => !matches!(first.text.as_str(), "for" | "adds" | "if" | "when" | "every"),
        Kind::Sign => first.text != "=",
        Kind::Word => matches!(first.text.as_str(), "at" | "where") && !first.is_followed_by('='),
        _ => false,
    }
}

/// What decides about blanks beside the neighbouring tokens.
#[derive(Default)]
pub(super) struct Spacing {
    /// Within a type (`load/rate^2`), where `*` and `/` stand close.
    in_type: bool,
    /// The sign read last belongs to what follows.
    is_prefix: bool,
}

impl Spacing {
    /// Whether a blank stands before the token.
    pub fn blank(&self, before: Option<(Kind, &str)>, token: &Token<'_>) -> bool {
        let Some((kind, text)) = before else { return false };
        let own = token.text.as_str();
        if self.is_prefix || text == "(" || matches!(own, "," | ":" | ")" | "^") || text == "^" {
            return false;
        }
        if self.in_type && (matches!(own, "*" | "/") || matches!(text, "*" | "/")) {
            return false;
        }
        if own == "(" {
            return !(token.touches && kind == Kind::Word);
        }
        true
    }

    /// Takes notice of a token that has been written.
    pub fn note(&mut self, before: Option<(Kind, &str)>, token: &Token<'_>) {
        let after_operand = before.is_some_and(|(kind, text)| {
            // The motions of a joint are followed by their axis: `turn -z`.
            !matches!(text, "shift" | "turn") && matches!(kind, Kind::Word | Kind::Number | Kind::Text)
                || kind == Kind::Close && text == ")"
        });
        self.is_prefix = token.text == "-" && !after_operand;
        match token.text.as_str() {
            ":" | "->" => self.in_type = true,
            "," | "(" | ")" | "=" | "{" | "}" => self.in_type = false,
            _ if token.kind == Kind::Joining => self.in_type = false,
            _ => {}
        }
    }
}
