//! Errors of the grammar in an engineer's words.

use super::grammar::Rule;
use super::scan::{Token, TokenKind};
use super::split::{KEYWORDS, comment_help};
use crate::diagnostics::{Code, Diagnostic, Span, similar_name};
use crate::quantities::Unit;
use pest::error::{Error, ErrorVariant, InputLocation};

/// An error and where it lies among the tokens of its declaration.
pub(super) struct Explained {
    pub diagnostic: Diagnostic,
    /// The token that could not be read; `None` at the end of the declaration.
    pub token: Option<usize>,
    /// The error is a closing brace that comes too early.
    pub at_closing: bool,
}

/// `offset`: where the declaration begins in the file.
pub(super) fn explain(file: u32, text: &str, tokens: &[Token], offset: usize, error: &Error<Rule>) -> Explained {
    let at = offset
        + match error.location {
            InputLocation::Pos(at) => at,
            InputLocation::Span((start, _)) => start,
        };
    let index = tokens.partition_point(|token| token.end <= at);
    let token = (index < tokens.len()).then_some(index);
    let context = Context { file, text, tokens, index };
    let mut token = token;
    let diagnostic = match &error.variant {
        ErrorVariant::ParsingError { positives, .. } => match context.missing_value(positives) {
            Some((diagnostic, culprit)) => {
                token = Some(culprit);
                diagnostic
            }
            None if context.statement_is_incomplete(positives) => {
                token = index.checked_sub(1);
                context.incomplete(positives)
            }
            None => context.unexpected(positives),
        },
        ErrorVariant::CustomError { .. } => {
            Diagnostic::error(Code::TOO_DEEP, "the declaration is nested too deeply to be read")
                .label(context.span(), "while reading this")
                .help("split long expressions with `let` or `constant`")
        }
    };
    let at_closing = token.is_some_and(|token| matches!(tokens[token].kind, TokenKind::Close(_)));
    Explained { diagnostic, token, at_closing }
}

struct Context<'a> {
    file: u32,
    text: &'a str,
    tokens: &'a [Token],
    /// The token that could not be read.
    index: usize,
}

/// Words that are no names (`reserved` in the grammar).
const NO_NAMES: [&str; 12] = ["if", "then", "else", "and", "or", "in", "from", "prior", "by", "of", "along", "on"];

impl Context<'_> {
    /// Text of the token so many places from the unexpected one; empty outside of the declaration.
    fn word(&self, places: isize) -> &str {
        let index = self.index.checked_add_signed(places);
        index.and_then(|index| self.tokens.get(index)).map_or("", |token| token.text(self.text))
    }

    fn kind(&self, places: isize) -> Option<TokenKind> {
        let index = self.index.checked_add_signed(places)?;
        self.tokens.get(index).map(|token| token.kind)
    }

    fn span_of(&self, places: isize) -> Span {
        let index = self.index.checked_add_signed(places);
        let range = match index.and_then(|index| self.tokens.get(index)) {
            Some(token) => token.range(),
            None => {
                let end = self.tokens.last().map_or(0, |token| token.end);
                end..end
            }
        };
        Span { file: self.file, start: range.start as u32, end: range.end as u32 }
    }

    fn span(&self) -> Span {
        self.span_of(0)
    }

    fn found(&self) -> String {
        match self.kind(0) {
            None => "the end of the declaration".to_owned(),
            Some(TokenKind::Documentation) => "a `///` line".to_owned(),
            Some(_) => format!("`{}`", self.word(0)),
        }
    }

    fn unexpected(&self, rules: &[Rule]) -> Diagnostic {
        if let Some(diagnostic) = self.special(rules) {
            return diagnostic;
        }
        let expected = expectation(rules);
        let message = format!("expected {expected}, found {}", self.found());
        let diagnostic = Diagnostic::error(Code::UNEXPECTED_TEXT, message).label(self.span(), self.short_label(rules));
        match self.help(rules) {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        }
    }

    fn short_label(&self, rules: &[Rule]) -> String {
        match (self.kind(-1), rules) {
            (Some(TokenKind::Word), rules) if rules.contains(&Rule::equals) => {
                format!("expected `=` after `{}`", self.word(-1))
            }
            _ => "not expected here".to_owned(),
        }
    }

    /// Errors that deserve a message of their own.
    fn special(&self, rules: &[Rule]) -> Option<Diagnostic> {
        self.bad_number()
            .or_else(|| self.spaced_unit(0))
            .or_else(|| self.spaced_unit(-1))
            .or_else(|| self.misspelt_word(rules))
    }

    /// `12 kN m`: the parts of a unit are joined by signs. The word may have been taken for the key of a further entry.
    fn spaced_unit(&self, places: isize) -> Option<Diagnostic> {
        if self.kind(places) != Some(TokenKind::Word) || self.first_on_line(places) || self.word(places + 1) == "=" {
            return None;
        }
        let before = &self.tokens[..self.index.checked_add_signed(places)?];
        let number = before.iter().rposition(|token| token.kind == TokenKind::Number)?;
        let unit = self.text.get(before[number].end..before.last()?.end)?.trim();
        let joined = format!("{unit}*{}", self.word(places));
        if unit.contains('\n') || Unit::parse(unit).is_err() || Unit::parse(&joined).is_err() {
            return None;
        }
        let start = before.get(number + 1)?.start as u32;
        let message = format!("the unit `{unit} {}` contains a blank", self.word(places));
        let diagnostic = Diagnostic::error(Code::SPACED_UNIT, message)
            .label(Span { start, ..self.span_of(places) }, "a unit is one word")
            .help(format!("write `{joined}`"));
        Some(diagnostic)
    }

    /// `mass =` with nothing behind it: the value is missing at the end of its line, and the first word of the next
    /// line was taken for it. Also returns the token that lacks its value.
    fn missing_value(&self, rules: &[Rule]) -> Option<(Diagnostic, usize)> {
        let next_line_was_taken = matches!(self.word(0), "=" | "in" | ":")
            && self.kind(-1) == Some(TokenKind::Word)
            && self.first_on_line(-1);
        let places = if next_line_was_taken && needs_value(self.word(-2)) {
            -2
        } else if rules.iter().any(|rule| begins_value(*rule))
            && needs_value(self.word(-1))
            && !self.begins_like_value()
        {
            -1
        } else {
            return None;
        };
        let (sign, before) = (self.word(places), self.word(places - 1));
        let message = match (sign, before) {
            ("=", key) if self.kind(places - 1) == Some(TokenKind::Word) => format!("`{key}` has no value"),
            (".", ".") => "the upper end of the range is missing".to_owned(),
            ("-", "+") => "the standard deviation after `+-` is missing".to_owned(),
            (sign, _) => format!("the value after `{sign}` is missing"),
        };
        let diagnostic = Diagnostic::error(Code::UNEXPECTED_TEXT, message)
            .label(self.span_of(places), "expected a value behind this");
        Some((diagnostic, self.index.checked_add_signed(places)?))
    }

    /// The line, or what the braces contain, ended too early.
    fn statement_is_incomplete(&self, rules: &[Rule]) -> bool {
        let ended = self.first_on_line(0) || matches!(self.kind(0), None | Some(TokenKind::Close(_)));
        let complete = [Rule::close_brace, Rule::close_paren, Rule::close_bracket, Rule::EOI];
        ended && self.index > 0 && !rules.iter().any(|rule| complete.contains(rule))
    }

    fn incomplete(&self, rules: &[Rule]) -> Diagnostic {
        if let Some(diagnostic) = self.spaced_unit(-1) {
            return diagnostic;
        }
        let end = self.span_of(-1).end;
        // A unit is several tokens: `kN/m`, not its last one.
        let head = &self.text[..end as usize];
        let of_unit = |letter: &char| letter.is_alphanumeric() || "/*^_°%.".contains(*letter);
        let length: usize = head.chars().rev().take_while(of_unit).map(char::len_utf8).sum();
        let before = if self.kind(-1) == Some(TokenKind::Word) { &head[head.len() - length..] } else { self.word(-1) };
        let message = format!("expected {} after `{before}`", expectation(rules));
        let finding = Diagnostic::error(Code::UNEXPECTED_TEXT, message)
            .label(Span { file: self.file, start: end, end }, "something is missing here");
        match self.help(rules) {
            Some(help) => finding.help(help),
            None => finding,
        }
    }

    fn first_on_line(&self, places: isize) -> bool {
        let index = self.index.checked_add_signed(places);
        index.and_then(|index| self.tokens.get(index)).is_some_and(|token| token.first_on_line)
    }

    fn begins_like_value(&self) -> bool {
        let ends = matches!(self.kind(0), None | Some(TokenKind::Close(_)));
        !ends && !matches!(self.word(0), "," | "from" | "prior" | "in" | "then" | "else" | "by")
    }

    fn bad_number(&self) -> Option<Diagnostic> {
        let number = |message: String, places: isize, help: String| {
            Some(Diagnostic::error(Code::BAD_NUMBER, message).label(self.span_of(places), "not a number").help(help))
        };
        let adjacent = |places: isize| self.touches(places);
        if self.word(0) == "." && self.kind(1) == Some(TokenKind::Number) && adjacent(1) {
            return number(
                format!("`.{}` lacks the digit before the point", self.word(1)),
                0,
                format!("write `0.{}`", self.word(1)),
            );
        }
        if self.word(0) == "." && self.kind(-1) == Some(TokenKind::Number) && adjacent(0) {
            return number(
                format!("`{}.` lacks the digit after the point", self.word(-1)),
                0,
                format!("write `{}.0`", self.word(-1)),
            );
        }
        if self.word(0) == ","
            && self.kind(-1) == Some(TokenKind::Number)
            && self.kind(1) == Some(TokenKind::Number)
            && adjacent(1)
        {
            let (whole, decimals) = (self.word(-1), self.word(1));
            return number(format!("`{whole},{decimals}` is not a number"), 0, format!("write `{whole}.{decimals}`"));
        }
        None
    }

    /// Whether the token so many places on follows its predecessor without a blank.
    fn touches(&self, places: isize) -> bool {
        self.span_of(places).start == self.span_of(places - 1).end
    }

    /// A word where only certain words can stand, and one of them is similar.
    fn misspelt_word(&self, rules: &[Rule]) -> Option<Diagnostic> {
        if self.kind(0) != Some(TokenKind::Word) {
            return None;
        }
        let similar = similar_name(self.word(0), rules.iter().flat_map(|rule| keywords(*rule)))?;
        if similar == self.word(0) {
            return None;
        }
        let message = format!("expected {}, found `{}`", expectation(rules), self.word(0));
        let diagnostic = Diagnostic::error(Code::UNEXPECTED_TEXT, message).label(self.span(), "not expected here");
        Some(diagnostic.suggest(Some(similar)))
    }

    /// A name that was taken for part of a unit, since no blank stands before its sign: `500 N/m*spring.elongation`.
    fn product_in_unit(&self) -> Option<String> {
        let before = self.tokens.get(..self.index)?;
        let number = before.iter().rposition(|token| token.kind == TokenKind::Number)?;
        let written = self.text.get(before[number].end..before.last()?.end)?;
        let (unit, name) = written.trim_start().rsplit_once(['*', '/'])?;
        let sign = &written[written.len() - name.len() - 1..written.len() - name.len()];
        let is_unit = !written.trim_start().contains(char::is_whitespace) && Unit::parse(unit).is_ok();
        is_unit.then(|| {
            format!("`{name}` was read as part of the unit; blanks set a product apart: `{unit} {sign} {name}`")
        })
    }

    fn help(&self, rules: &[Rule]) -> Option<String> {
        let found = self.word(0);
        let operator = rules.contains(&Rule::multiply);
        if let Some(help) = (found == ".").then(|| self.product_in_unit()).flatten() {
            return Some(help);
        }
        let help = match found {
            "*" if self.word(-1) == "*" => "powers are written `x^2`".to_owned(),
            "=" if operator && (self.word(1) == "=" || self.word(-1) == "=") => {
                "there is no test for equality; compare with `<`, `<=`, `>` or `>=`".to_owned()
            }
            "=" if self.word(-1) == "=" => "a field is written `key = value`, with one `=`".to_owned(),
            _ if self.word(-1) == "for" && self.word(1) == "in" => {
                "`for` repeats whole declarations (bodies, joints, forces); entries of one are written one by one"
                    .to_owned()
            }
            ":" if rules.contains(&Rule::equals) => "write `=` instead of `:`".to_owned(),
            "=" if rules.contains(&Rule::colon) => "write `:` instead of `=`".to_owned(),
            ";" => "declarations and fields end with their line, or with a comma within braces".to_owned(),
            "'" => "texts stand in double quotes: \"...\"".to_owned(),
            "&" | "|" => "conditions are joined by `and` and `or`".to_owned(),
            "!" => "there is no `!`; turn the comparison round".to_owned(),
            "+" if self.word(1) == "-" => "to add a negative number write `a + -b` or `a - b`".to_owned(),
            _ if operator && self.kind(-1) == Some(TokenKind::Word) && self.kind(0) == Some(TokenKind::Open(b'(')) => {
                "the parenthesis of a function follows its name without a blank; a product needs `*`".to_owned()
            }
            _ if operator && self.kind(0) == Some(TokenKind::Open(b'(')) => "a product needs `*`".to_owned(),
            _ if rules.contains(&Rule::equals)
                && begins_field_value(self.kind(0))
                && self.kind(-1) == Some(TokenKind::Word) =>
            {
                format!("write `{} = {}`", self.word(-1), self.value_on_line())
            }
            _ if rules.contains(&Rule::range_dots) && found == "." => "a range is written `1 s .. 10 s`".to_owned(),
            "(" if rules.contains(&Rule::written_unit) => "units stand in square brackets: `[mm]`".to_owned(),
            _ if self.kind(0) == Some(TokenKind::Number)
                && self.word(-1) == ","
                && self.kind(-2) == Some(TokenKind::Number) =>
            {
                decimal_comma(self.word(-2), found)
            }
            _ if rules.contains(&Rule::range_dots) && found == "from" => {
                "bounds are written with two points: `10 .. 40 kN/m`".to_owned()
            }
            _ if rules.contains(&Rule::range_dots) && matches!(found, "to" | "-") => {
                "a range is written `1 s .. 10 s`".to_owned()
            }
            _ if rules.contains(&Rule::arrow) => {
                "two bodies or points are joined by `->`: `wheel -> chassis`".to_owned()
            }
            _ if self.kind(0) == Some(TokenKind::Documentation) => {
                "`///` describes the declaration below it; remarks start with `//`".to_owned()
            }
            _ if NO_NAMES.contains(&found) && expectation(rules).contains("a name") => {
                format!(
                    "`{found}` joins parts of declarations and expressions and is no name; choose another, such as `{found}_1`"
                )
            }
            _ if KEYWORDS.contains(&found) && self.tokens.get(self.index).is_some_and(|token| token.first_on_line) => {
                format!("is the declaration before `{found}` complete?")
            }
            _ => return comment_help(found).map(str::to_owned),
        };
        Some(help)
    }

    /// The rest of the line from the unexpected token on, without what closes it.
    fn value_on_line(&self) -> String {
        let start = self.span().start as usize;
        let rest = self.text[start..].lines().next().unwrap_or_default();
        let end = rest.find([',', '}', '{']).unwrap_or(rest.len());
        rest[..end].trim_end().to_owned()
    }
}

/// Signs and words that a value must follow.
fn needs_value(text: &str) -> bool {
    matches!(
        text,
        "=" | "+" | "-" | "*" | "/" | "^" | "<" | ">" | "." | "from" | "prior" | "adds" | "by" | "if" | "then" | "else"
    )
}

fn begins_field_value(kind: Option<TokenKind>) -> bool {
    matches!(kind, Some(TokenKind::Number | TokenKind::Word | TokenKind::Text { .. }))
}

fn begins_value(rule: Rule) -> bool {
    matches!(rule, Rule::value | Rule::expression | Rule::quantity | Rule::number | Rule::reference | Rule::text)
}

/// What could have stood at the place of the error: "`:` or `=`".
fn expectation(rules: &[Rule]) -> String {
    let mut words: Vec<(u8, String)> = rules.iter().filter_map(|rule| description(*rule)).collect();
    words.sort();
    words.dedup();
    // Operators may follow every expression, commas every entry; they are worth naming only where nothing else can
    // stand. Names and parentheses are expressions.
    let has = |rank: u8| rules.iter().filter_map(|rule| description(*rule)).any(|(other, _)| other == rank);
    let (value, entry) = (has(VALUE_RANK), has(ENTRY_RANK));
    words.retain(|(rank, word)| {
        let covered = (value && matches!(rank, 2 | 3)) || (entry && word == "`,`") || word == "`point`";
        !covered
    });
    if words.iter().any(|(rank, _)| *rank < OPERATOR_RANK) {
        words.retain(|(rank, _)| *rank < OPERATOR_RANK);
    }
    let words: Vec<String> = words.into_iter().map(|(_, word)| word).collect();
    match words.as_slice() {
        [] => "something else".to_owned(),
        [only] => only.clone(),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}

const VALUE_RANK: u8 = 4;
const ENTRY_RANK: u8 = 5;
const OPERATOR_RANK: u8 = 9;

/// How a rule is called in messages, and its rank in the list.
fn description(rule: Rule) -> Option<(u8, String)> {
    if let Some(word) = keyword(rule) {
        return Some((1, format!("`{word}`")));
    }
    let (rank, text) = match rule {
        Rule::equals => (0, "`=`"),
        Rule::colon => (0, "`:`"),
        Rule::arrow => (0, "`->`"),
        Rule::range_dots => (0, "`..`"),
        Rule::plus_minus => (0, "`+-`"),
        Rule::joint_axes | Rule::open_paren => (2, "`(`"),
        Rule::name | Rule::path | Rule::removed | Rule::declared_name | Rule::declared | Rule::member => (3, "a name"),
        Rule::derivative => (3, "a derivative `z'`"),
        Rule::text => (3, "a text in quotes"),
        Rule::written_unit | Rule::open_bracket => (3, "a unit in brackets"),
        Rule::written_unit_inside => (3, "a unit"),
        Rule::type_expression | Rule::type_factor | Rule::type_name => (3, "a type"),
        Rule::type_one => return None,
        Rule::axis | Rule::direction | Rule::body_axis | Rule::joint_axis | Rule::joint_motion => {
            (3, "an axis `x`, `y`, `z`")
        }
        Rule::declaration | Rule::changed => (3, "a declaration (`force`, `signal`, `effect`, ...)"),
        Rule::value | Rule::range => (VALUE_RANK, "a value"),
        Rule::expression
        | Rule::quantity
        | Rule::number
        | Rule::reference
        | Rule::call
        | Rule::choice
        | Rule::parenthesis
        | Rule::callee => (VALUE_RANK, "an expression"),
        Rule::sign | Rule::block | Rule::named_block | Rule::block_name | Rule::documentation | Rule::unit => {
            return None;
        }
        Rule::documentation_line | Rule::if_word => return None,
        Rule::field => (ENTRY_RANK, "a field `key = value`"),
        Rule::port => (3, "a port `name: body`"),
        Rule::table_point => (3, "a point `(1 m/s, 2 kN)`"),
        Rule::points => (ENTRY_RANK, "`points`"),
        Rule::model_statement => (ENTRY_RANK, "`param` or a declaration"),
        Rule::member_declaration => (ENTRY_RANK, "a declaration"),
        Rule::point => (ENTRY_RANK, "`point`"),
        Rule::entry => (ENTRY_RANK, "an entry"),
        Rule::duration => (ENTRY_RANK, "`for` with a duration"),
        Rule::identify_line => (ENTRY_RANK, "a line `name in 1 N .. 2 N from 1.5 N`"),
        Rule::lowpass => (ENTRY_RANK, "`lowpass`"),
        Rule::change => (ENTRY_RANK, "`add`, `remove`, `replace` or `identify`"),
        Rule::law_statement => (ENTRY_RANK, "`param`, `let`, `state` or `= value`"),
        Rule::effect_statement => (ENTRY_RANK, "`amplitude`, `shape`, `let`, `state`, `adds` or `replaces`"),
        Rule::comma => (6, "`,`"),
        Rule::fields | Rule::open_brace => (7, "`{`"),
        Rule::close_brace => (8, "`}`"),
        Rule::close_paren => (8, "`)`"),
        Rule::close_bracket => (8, "`]`"),
        Rule::EOI => (8, "the end of the declaration"),
        Rule::power
        | Rule::multiply
        | Rule::divide
        | Rule::add
        | Rule::subtract
        | Rule::less
        | Rule::less_equal
        | Rule::greater
        | Rule::greater_equal
        | Rule::both
        | Rule::either => (OPERATOR_RANK, "an operator"),
        _ => return None,
    };
    Some((rank, text.to_owned()))
}

/// The keywords with which a rule may begin.
fn keywords(rule: Rule) -> Vec<&'static str> {
    match rule {
        Rule::change => vec!["add", "remove", "replace", "identify"],
        Rule::law_statement => vec!["param", "let", "state"],
        Rule::effect_statement => vec!["amplitude", "shape", "let", "state", "adds", "replaces"],
        Rule::lowpass => vec!["lowpass"],
        Rule::changed | Rule::declaration | Rule::member_declaration => KEYWORDS.to_vec(),
        Rule::model_statement => KEYWORDS.into_iter().chain(["param"]).collect(),
        Rule::flag => vec!["one_sided", "finite", "unnamed", "periodic"],
        _ => keyword(rule).into_iter().collect(),
    }
}

/// The keyword a rule stands for.
fn keyword(rule: Rule) -> Option<&'static str> {
    Some(match rule {
        Rule::on_word | Rule::place_on => "on",
        Rule::along_word => "along",
        Rule::about_word => "about",
        Rule::of_word => "of",
        Rule::in_word | Rule::limits => "in",
        Rule::for_word => "for",
        Rule::per_word | Rule::per_experiment => "per",
        Rule::constrain_word | Rule::constrain => "constrain",
        Rule::from_word => "from",
        Rule::nominal_word => "nominal",
        Rule::prior_word => "prior",
        Rule::at_word => "at",
        Rule::any_word => "any",
        Rule::where_word => "where",
        Rule::param_word => "param",
        Rule::let_word => "let",
        Rule::state_word => "state",
        Rule::amplitude_word => "amplitude",
        Rule::shape_word => "shape",
        Rule::adds_word => "adds",
        Rule::replaces_word => "replaces",
        Rule::by_word => "by",
        Rule::neutral_word => "neutral",
        Rule::flag => "one_sided",
        Rule::then_word => "then",
        Rule::else_word => "else",
        Rule::lowpass_word => "lowpass",
        Rule::butterworth_word => "butterworth",
        Rule::pass_word => "pass",
        Rule::stop_word => "stop",
        Rule::zero_phase => "zero_phase",
        Rule::single_pass => "single_pass",
        Rule::remove_mean => "remove_mean",
        Rule::add_word => "add",
        Rule::remove_word => "remove",
        Rule::replace_word => "replace",
        Rule::identify_word => "identify",
        _ => return None,
    })
}

fn decimal_comma(whole: &str, decimals: &str) -> String {
    format!("numbers have a decimal point: `{whole}.{decimals}`")
}
