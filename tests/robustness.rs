//! No text makes the tool panic, hang or fill the memory: words in any order, shipped studies with
//! pieces cut out, doubled and exchanged, texts built to be slow.

use ident::study::probe;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

/// For each of the two random tests; the number of texts tried depends on the machine, their order does not.
const TIME: Duration = Duration::from_secs(4);

fn shipped() -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut texts = Vec::new();
    for folder in ["studies/quarter_vehicle", "studies/drive_axis", "grammar/prelude", "tests/cases/syntax_good"] {
        let mut paths: Vec<_> =
            fs::read_dir(root.join(folder)).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
        paths.sort();
        let studies = paths.into_iter().filter(|path| path.extension().is_some_and(|extension| extension == "ident"));
        texts.extend(studies.map(|path| fs::read_to_string(path).expect("a study")));
    }
    texts
}

/// A whole number below `limit`.
fn below(random: &mut ChaCha8Rng, limit: usize) -> usize {
    (random.next_u64() % limit.max(1) as u64) as usize
}

/// Words, numbers with units and signs of a text, blanks included.
fn words(text: &str) -> Vec<&str> {
    let mut words = Vec::new();
    let mut start = 0;
    let sort = |sign: char| (sign.is_alphanumeric() || sign == '_', sign.is_whitespace());
    let signs: Vec<(usize, char)> = text.char_indices().collect();
    for pair in signs.windows(2) {
        if sort(pair[0].1) != sort(pair[1].1) || sort(pair[0].1) == (false, false) {
            words.push(&text[start..pair[1].0]);
            start = pair[1].0;
        }
    }
    words.push(&text[start..]);
    words
}

fn within(text: &str, limit: Duration) {
    let begin = Instant::now();
    probe(text);
    let took = begin.elapsed();
    assert!(took < limit, "{took:?} for {} bytes: {}", text.len(), text.chars().take(400).collect::<String>());
}

#[test]
fn mutated_studies_are_treated() {
    let texts = shipped();
    let all: Vec<&str> = texts.iter().flat_map(|text| words(text)).collect();
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let begin = Instant::now();
    let mut count = 0;
    while begin.elapsed() < TIME {
        let source = &texts[below(&mut random, texts.len())];
        let mut text: Vec<&str> = words(source);
        for _ in 0..=below(&mut random, 6) {
            let at = below(&mut random, text.len());
            let end = (at + 1 + below(&mut random, 12)).min(text.len());
            match below(&mut random, 5) {
                0 => drop(text.drain(at..end)),
                1 => text.insert(at, all[below(&mut random, all.len())]),
                2 => text[at] = all[below(&mut random, all.len())],
                3 => {
                    let piece: Vec<&str> = text[at..end].to_vec();
                    let to = below(&mut random, text.len());
                    text.splice(to..to, piece);
                }
                _ => text.insert(
                    at,
                    ["1e308", "{", "}", "(", "-", "0", ".", "[", "]", "\"", "///", "for i in 1 .. 9 {"]
                        [below(&mut random, 12)],
                ),
            }
        }
        within(&text.concat(), Duration::from_secs(10));
        count += 1;
    }
    assert!(count > 20, "only {count} texts in {TIME:?}");
}

#[test]
fn any_words_are_treated() {
    let texts = shipped();
    let all: Vec<&str> = texts.iter().flat_map(|text| words(text)).filter(|word| !word.trim().is_empty()).collect();
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let begin = Instant::now();
    let mut count = 0;
    while begin.elapsed() < TIME {
        let length = 1 + below(&mut random, 400);
        let mut text = String::new();
        for _ in 0..length {
            text += all[below(&mut random, all.len())];
            text += [" ", " ", "\n", ""][below(&mut random, 4)];
        }
        within(&text, Duration::from_secs(10));
        count += 1;
    }
    assert!(count > 20, "only {count} texts in {TIME:?}");
}

/// Large texts that multiply, nest or repeat themselves.
#[test]
fn hostile_texts_end_soon() {
    let repeated = |piece: &dyn Fn(usize) -> String| -> String {
        let mut text = String::from("study s\n");
        let mut at = 0;
        while text.len() < 100_000 {
            text += &piece(at);
            at += 1;
        }
        text
    };
    // Every level uses the next one ten times.
    let mut multiplying = String::from("study s\npart p: m0\nmodel m12 { }\n");
    for level in 0..12 {
        let parts: String = (0..10).map(|at| format!("  part p{at}: m{}\n", level + 1)).collect();
        multiplying += &format!("model m{level} {{\n{parts}}}\n");
    }
    let mut doubling = String::from("study s\nconstant c0 = 1\n");
    for level in 1..200 {
        doubling += &format!("constant c{level} = c{} + c{}\n", level - 1, level - 1);
    }
    doubling += "for i in 1 .. c60 { constant d[i] = 1 }\n";
    let texts = [
        multiplying,
        doubling,
        repeated(&|at| format!("force f{at}: sprin a{at} -> b{at} {{ stifness = c{at} }}\n")),
        repeated(&|at| format!("body b{at} {{ mass = m{at} }}\njoint j{at}: prismatic(z) ground -> b{at}\n")),
        repeated(&|at| format!("constant c{at} = c{} + 1\n", at + 1)),
        repeated(&|at| format!("for i in 1 .. 2000 {{ constant c{at}[i] = i }}\n")),
        repeated(&|at| format!("model m{at}(a: body) {{ param k: length }}\npart p{at}: m{at} at x{at} {{ j = 3 }}\n")),
        repeated(&|at| format!("table t{at}(x: length) -> force {{ points = ((0 m, 1 N), ({at} m, 2 N)) }}\n")),
        repeated(&|at| format!("variant v{at} of v{} {{ remove x{at} }}\n", at + 1)),
        repeated(&|at| format!("identify {{ c{at} in 1 .. 2 from 3 }}\n")),
        repeated(&|at| format!("law l{at}(x: coordinate) -> load {{ param a: lod\n = b{at} * x }}\n")),
        repeated(&|at| format!("measure m{at} [mn] = a{at}.position\n")),
        repeated(&|at| format!("signal s{at} = s{} + max(s{at}, 2 mm)\n", at / 2)),
        repeated(&|at| format!("experiment e{at} {{ data = \"a.csv\", start = rst, window = 3 s .. 2 s }}\n")),
    ];
    for text in texts {
        within(&text, Duration::from_secs(60));
    }
    // One of a megabyte.
    let mut large = String::from("study s\n");
    while large.len() < 1_000_000 {
        large += "force f: spring on guide { stiffness = 3 kN/m }\n";
    }
    within(&large, Duration::from_secs(60));
}
