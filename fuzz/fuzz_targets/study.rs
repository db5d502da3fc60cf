#![no_main]

use libfuzzer_sys::fuzz_target;

// The same function that `tests/robustness.rs` feeds with mutated studies.
fuzz_target!(|text: &str| {
    if text.len() <= 1 << 20 {
        ident::study::probe(text);
    }
});
