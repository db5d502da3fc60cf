//! The one table of diagnostic codes.
//!
//! A code is one line-block of the table below, kept under the heading of the stage that reports it; its explanation
//! is what `ident explain` prints. To add a code, append a block to the stage's section.

use std::fmt;
use std::ops::Deref;

/// What kind of finding a diagnostic reports: a reference into the table, compared by its text (`E0201`).
#[derive(Clone, Copy)]
pub struct Code(&'static CodeEntry);

/// A row of the table.
pub struct CodeEntry {
    /// `E0201`
    pub text: &'static str,
    /// A few words, for lists.
    pub title: &'static str,
    /// What it means, why it matters, what to do about it; plain text with examples.
    pub explanation: &'static str,
}

impl Code {
    /// The code with this text, e.g. `E0201` (upper or lower case).
    pub fn find(text: &str) -> Option<Code> {
        Code::ALL.iter().copied().find(|code| code.text.eq_ignore_ascii_case(text))
    }
}

impl Deref for Code {
    type Target = CodeEntry;

    fn deref(&self) -> &CodeEntry {
        self.0
    }
}

impl PartialEq for Code {
    fn eq(&self, other: &Code) -> bool {
        self.text == other.text
    }
}

impl Eq for Code {}

impl fmt::Display for Code {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.text)
    }
}

impl fmt::Debug for Code {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.text)
    }
}

macro_rules! codes {
    ($( $name:ident $text:literal $title:literal $explanation:literal )*) => {
        impl Code {
            $(
                #[doc = concat!("`", $text, "`: ", $title, ".")]
                pub const $name: Code = Code(&CodeEntry { text: $text, title: $title, explanation: $explanation });
            )*

            /// Every code, in the order of the table.
            pub const ALL: &'static [Code] = &[$(Code::$name),*];
        }
    };
}

codes! {
    // ---- E01xx: the text cannot be read (syntax) ----

    UNEXPECTED_TEXT "E0101" "unexpected text"
    "The text does not follow the grammar at the marked place. The message says what could stand there.\n\
     A declaration starts with its keyword and ends at the end of its line or with its closing brace:\n\
     \n    body wheel { mass = 45 kg }\n"

    UNKNOWN_KEYWORD "E0102" "unknown declaration"
    "A declaration must start with one of the keywords of the language (`body`, `joint`, `force`, `measure`, ...).\n"

    UNCLOSED "E0103" "missing closing brace"
    "A brace, parenthesis, bracket or quotation mark is opened but never closed. Reading goes on at the next\n\
     declaration that starts at the beginning of a line.\n"

    TOO_DEEP "E0104" "nested too deeply or too large"
    "Expressions and blocks may be nested up to a fixed depth, and files up to a fixed size; generated text that\n\
     exceeds it is refused instead of exhausting the memory. Split the expression with `let`, the file with `use`.\n"

    NOT_YET "E0105" "not yet part of the language"
    "The construct is reserved: it is planned but this version does not read it.\n"

    BAD_NUMBER "E0106" "not a number"
    "Numbers are written like `12`, `0.5`, `1.2e-3`, followed by their unit: `12 kN/m`.\n"

    REPEATED_CLAUSE "E0107" "written twice"
    "A clause that may stand once is written twice, e.g. two `lowpass` designs in one filter.\n"

    // ---- E02xx: names, quantities, dimensions, structure of the study ----

    UNKNOWN_NAME "E0201" "unknown name"
    "The name is not declared in the study, its `use`d files or the prelude. Declarations may stand in any order;\n\
     a similar name is suggested where there is one.\n"

    UNKNOWN_UNIT "E0202" "unknown unit"
    "The unit is not known. Units are symbols of the SI with prefixes (`kN`, `mm`, `ms`), some common others\n\
     (`bar`, `rpm`, `deg`, `km/h`, `g0`), and products and powers of them: `kN*s/m`, `N*m/rad`, `m/s^2`.\n"

    DIMENSION_MISMATCH "E0203" "dimensions do not agree"
    "Only quantities of the same dimension can be added, compared or assigned. Both places are marked.\n"

    // ---- E03xx: mechanics ----

    UNCONNECTED_BODY "E0301" "body is not connected to ground"
    "Every body needs a chain of joints that leads to `ground`; otherwise its motion has no coordinates. A body that may move\n\
     along one axis only needs `joint guide: prismatic(z) ground -> body`.\n"

    CLOSED_LOOP "E0302" "joints close a loop"
    "The joint connects two bodies that other joints connect already. Joints must form a tree.\n"

    NO_INERTIA "E0303" "joint moves no inertia"
    "The acceleration of a coordinate is its load divided by the inertia that moves with it. A joint whose outer bodies have no\n\
     mass (prismatic) or no moment of inertia about its axis (revolute) has no determined acceleration.\n"

    COINCIDENT_POINTS "E0304" "force element without direction"
    "A force element between two points acts along the line that joins them. Points that coincide in the reference configuration\n\
     have no such line: name a direction with `along z`, or choose points that are apart.\n"

    ACCELERATION_IN_LOAD "E0305" "load depends on an acceleration"
    "Accelerations follow from the loads, so that a load may not depend on one directly. What is accelerated is mass or inertia\n\
     of a body; a controller that feeds back a measured acceleration sees it through a sensor, a law with a state.\n"

    UNKNOWN_START "E0306" "start value is not determined"
    "A start value may depend on parameters, inputs, and states whose own start value is given; not on itself, and not on a state\n\
     that follows from equilibrium.\n"

    UNKNOWN_QUANTITY "E0307" "quantity that nothing defines"
    "An expression mentions a quantity that is neither the time, a state, a parameter, nor the motion of an element of the study.\n"

    FORCE_ON_FIXED_JOINT "E0308" "force on a joint that cannot move"
    "A force element on a joint acts along or about the joint's axis. A fixed joint has none.\n"

    // ---- E04xx: data files and signals ----

    DATA_FILE_UNREADABLE "E0401" "data file cannot be read"
    "The measured data are CSV text: one head line with `name [unit]` per column, then one line per sample. The file is\n\
     missing, may not be read, or is no text. Paths are relative to the study's file, or to `--data DIR`.\n"

    DATA_EMPTY "E0402" "data file without samples"
    "The file holds no head line or no line of numbers below it.\n"

    DATA_NOT_A_NUMBER "E0403" "cell is not a number"
    "Every cell of a used column must hold a number, with decimal point, or decimal comma where columns are separated by\n\
     semicolons or tabs. No value is made up for an empty or unreadable cell: mend or cut the record.\n"

    DATA_NOT_FINITE "E0404" "sample is NaN or infinite"
    "A used column holds `NaN` or an infinite value. Samples are never skipped or replaced: mend the record, or choose a\n\
     `window` without the gap and cut the file there.\n"

    DATA_COLUMN_MISSING "E0405" "column is missing"
    "The experiment needs a column that the data file does not have. Columns are found by the name of the input or measure,\n\
     or by the experiment's `columns = { name = \"head in the file\" }`.\n"

    DATA_TIME_ORDER "E0406" "time does not increase"
    "The time column must grow from line to line. Repeated or backward stamps mean lost or doubled lines, or two records\n\
     written into one file.\n"

    DATA_NOT_UNIFORM "E0407" "samples are not equidistant"
    "Filters and spectra need equidistant samples. Small jitter of the stamps (5 % of a step) is accepted; a gap or a\n\
     changing rate is not: resample the record, or cut it at the gap.\n"

    DATA_CONSTANT "E0408" "channel is constant"
    "A measured channel that never changes holds no information to compare with: a dead sensor, a wrong column, or a\n\
     window in which nothing happens.\n"

    DATA_TOO_SHORT "E0409" "too few samples"
    "The record, or the part of it inside the `window`, has too few samples for what is asked of it.\n"

    DATA_UNIT "E0410" "unit of a column does not fit"
    "The head of a column names its unit: `force [kN]`. It is converted to the unit of the study; it must measure the same\n\
     kind of quantity, and it must be there unless the quantity is dimensionless.\n"

    DATA_LAYOUT "E0411" "table is not rectangular or its head is unclear"
    "Every line needs as many cells as the head has columns, and every head its own name.\n"

    FILTER_IMPOSSIBLE "E0412" "filter cannot be designed"
    "A low-pass is given by its pass edge, stop edge and the attenuations there: pass below stop, stop below half the\n\
     sampling rate, pass-band drop below stop-band attenuation.\n"

    // ---- E05xx: simulation ----

    // ---- E06xx: fit and diagnosis ----

    // ---- E07xx: command line ----

    CANNOT_READ_FILE "E0701" "file cannot be read"
    "The file does not exist, may not be read, or is not UTF-8 text. The message names the reason given by the system.\n"
}

#[cfg(test)]
mod tests {
    use super::Code;

    #[test]
    fn codes_are_unique_well_formed_and_explained() {
        let mut texts: Vec<&str> = Code::ALL.iter().map(|code| code.text).collect();
        texts.sort_unstable();
        texts.dedup();
        assert_eq!(texts.len(), Code::ALL.len(), "a code is used twice");
        for code in Code::ALL {
            let digits = code.text.strip_prefix('E').expect("codes start with E");
            assert!(digits.len() == 4 && digits.bytes().all(|byte| byte.is_ascii_digit()), "{code}");
            assert!(!code.title.is_empty() && code.title.len() < 60, "{code}");
            assert!(code.explanation.len() > 40 && code.explanation.ends_with('\n'), "{code}");
        }
    }

    #[test]
    fn find_ignores_case_and_knows_its_limits() {
        assert_eq!(Code::find("e0201"), Some(Code::UNKNOWN_NAME));
        assert_eq!(Code::find("E9999"), None);
    }
}
