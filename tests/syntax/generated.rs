//! Studies of every construct, made at random: printing and reading is the identity, and so is formatting.

use crate::shape;
use ident::syntax::{format, parse, print};
use proptest::prelude::*;
use proptest::sample::select;

fn name() -> impl Strategy<Value = String> {
    select(vec!["a", "wheel", "c_1", "Größe", "front", "table_guide", "i", "tyre", "x1", "points", "model_1"])
        .prop_map(str::to_owned)
}

fn index() -> impl Strategy<Value = String> {
    select(vec!["", "", "", "[1]", "[i]", "[i + 1]", "[2*i-1]", "[i, j]"]).prop_map(str::to_owned)
}

fn declared_name() -> impl Strategy<Value = String> {
    (name(), index()).prop_map(|(name, index)| format!("{name}{index}"))
}

fn path() -> impl Strategy<Value = String> {
    prop::collection::vec(declared_name(), 1..4).prop_map(|parts| parts.join("."))
}

fn number() -> impl Strategy<Value = String> {
    let digits = select(vec!["0", "12", "0.5", "1e-3", "180", "3.25e6", "7"]);
    let unit = select(vec!["", "", " mm", " kN*s/m", "kg", " m/s^2", " 1/s", " %", " N/(m*s)", " deg", "\u{b0}"]);
    (digits, unit).prop_map(|(digits, unit)| format!("{digits}{unit}"))
}

fn expression() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![number(), path()];
    leaf.prop_recursive(4, 24, 3, |inner| {
        let operator = select(vec![" + ", " - ", " * ", " / ", "*", "^", " < ", " >= ", " and ", " or ", "-", " -"]);
        prop_oneof![
            (inner.clone(), operator, inner.clone()).prop_map(|(a, o, b)| format!("({a}) {o} ({b})")),
            (inner.clone(), select(vec![" + ", " / ", " - "]), inner.clone())
                .prop_map(|(a, o, b)| format!("({a}){o}{b}")),
            inner.clone().prop_map(|a| format!("-{a}")),
            inner.clone().prop_map(|a| format!("( {a} )")),
            (select(vec!["sin", "max", "curve"]), prop::collection::vec(inner.clone(), 1..3))
                .prop_map(|(function, arguments)| format!("{function}({})", arguments.join(","))),
            (inner.clone(), inner.clone(), inner).prop_map(|(a, b, c)| format!("if {a} < 1 then {b} else {c}")),
        ]
    })
}

fn direction() -> impl Strategy<Value = String> {
    prop_oneof![
        select(vec!["x", "-z", "y"]).prop_map(str::to_owned),
        (expression(), expression()).prop_map(|(a, b)| format!("({a}, 0, {b})")),
    ]
}

fn value() -> impl Strategy<Value = String> {
    prop_oneof![
        4 => expression(),
        1 => Just("\"a text // with signs\"".to_owned()),
        1 => (expression(), expression()).prop_map(|(a, b)| format!("({a}, {b}, 1 m)")),
        1 => (number(), number()).prop_map(|(a, b)| format!("{a} .. {b}")),
        1 => prop::collection::vec(path(), 1..4).prop_map(|names| format!("{{ {} }}", names.join(", "))),
        1 => (path(), expression()).prop_map(|(key, value)| format!("{{ {key} = {value} }}")),
        1 => (path(), expression()).prop_map(|(key, value)| format!("rest {{ {key} = {value} }}")),
    ]
}

/// `{ key = value, .. }` on one line or several.
fn fields() -> impl Strategy<Value = String> {
    let entry = (path(), value()).prop_map(|(key, value)| format!("{key} = {value}"));
    (prop::collection::vec(entry, 0..4), select(vec![", ", "\n", "\n // remark\n", "  // behind\n\n\n"]))
        .prop_map(|(entries, separator)| format!("{{ {} }}", entries.join(separator)))
}

fn optional(strategy: impl Strategy<Value = String>) -> impl Strategy<Value = String> {
    prop::option::of(strategy).prop_map(Option::unwrap_or_default)
}

fn types() -> impl Strategy<Value = String> {
    select(vec!["1", "load", "load/rate^2", "1/time", "coordinate*time", "value / coordinate / time", "stiffness"])
        .prop_map(str::to_owned)
}

fn declared() -> impl Strategy<Value = String> {
    (name(), types(), optional(number().prop_map(|default| format!(" = {default}"))))
        .prop_map(|(name, kind, default)| format!("{name}: {kind}{default}"))
}

fn state() -> impl Strategy<Value = String> {
    (name(), types(), expression(), expression()).prop_map(|(name, kind, start, slope)| {
        // Half of them state their size.
        let nominal = if name.len() % 2 == 0 { format!(" nominal {start}") } else { String::new() };
        format!("state {name}: {kind} from {start}{nominal} {{ {name}' = {slope} }}")
    })
}

fn law() -> impl Strategy<Value = String> {
    let parameters = prop::collection::vec(declared(), 0..3);
    (name(), prop::collection::vec(declared(), 0..3), types(), parameters, state(), expression(), expression())
        .prop_map(|(name, ports, result, parameters, state, bound, value)| {
            let parameters: String = parameters.iter().map(|line| format!("  /// What.\n  param {line}\n")).collect();
            format!(
                "law {name}({}) -> {result} {{\n{parameters} let q = {bound}\n {state}\n = {value}\n}}",
                ports.join(", ")
            )
        })
}

fn effect() -> impl Strategy<Value = String> {
    (name(), declared(), name(), number(), state(), expression(), expression()).prop_map(
        |(name, amplitude, shape, limit, state, added, replaced)| {
            format!(
                "effect {name} at any joint, force where translational {{\n amplitude {amplitude} one_sided\n \
                 shape {shape}: rate in 0.1 .. {limit} of rate finite neutral 1\n{state}\n adds {added}\n \
                 replaces load by {replaced}\n}}"
            )
        },
    )
}

fn identify() -> impl Strategy<Value = String> {
    let line = (path(), number(), number(), number(), prop::option::of((number(), number()))).prop_map(
        |(target, low, high, start, prior)| {
            let prior = prior.map(|(mean, spread)| format!(" prior {mean} +- {spread}")).unwrap_or_default();
            format!("{target} in {low}..{high} from -{start}{prior}")
        },
    );
    prop::collection::vec(line, 0..4).prop_map(|lines| format!("identify {{ {} }}", lines.join("\n")))
}

fn table() -> impl Strategy<Value = String> {
    let point = (number(), number()).prop_map(|(x, y)| format!("(-{x}, {y})"));
    let word = select(vec!["points", "harmonics"]);
    (name(), declared(), types(), prop::collection::vec(point, 1..12), select(vec![", ", ",\n"]), word).prop_map(
        |(name, argument, result, points, separator, word)| {
            let points = points.join(separator);
            format!("table {name}({argument}) -> {result} {{ {word} = ({points})\n interpolation = linear }}")
        },
    )
}

/// What may stand in models and families too.
fn element() -> impl Strategy<Value = String> {
    let titled = select(vec!["", " [mm]", " [kN*s/m] \"title\"", " \"title\""]);
    let role = select(vec!["force", "actuator", "signal"]);
    let place = prop_oneof![
        Just(String::new()),
        path().prop_map(|joint| format!(" on {joint}")),
        (path(), path()).prop_map(|(a, b)| format!(" {a} -> {b}")),
        (path(), path(), direction()).prop_map(|(a, b, along)| format!(" {a} -> {b} along {along}")),
    ];
    let body = (declared_name(), expression(), name(), expression()).prop_map(|(name, mass, point, height)| {
        format!("body {name} {{ mass = {mass}, point {point} = (0 m, {height}, 0 m)\n inertia = 1 kg*m^2 }}")
    });
    let joint = (declared_name(), direction(), path(), path(), optional(fields())).prop_map(
        |(name, axis, parent, child, fields)| {
            let axis = if axis.starts_with('(') { axis } else { format!("(shift {axis} , turn {axis}, -y)") };
            format!("joint {name}: custom{axis} {parent} -> {child} {fields}")
        },
    );
    prop_oneof![
        (declared_name(), expression()).prop_map(|(name, value)| format!("constant {name} = {value}")),
        body,
        joint,
        (declared_name(), expression(), expression())
            .prop_map(|(name, left, right)| format!("coupling {name}: {left} = {right}")),
        (role, declared_name(), name(), place, optional(fields()))
            .prop_map(|(role, name, law, place, fields)| format!("{role} {name}: {law}{place} {fields}")),
        (declared_name(), expression()).prop_map(|(name, value)| format!("signal {name} = {value}")),
        (declared_name(), name(), path()).prop_map(|(name, effect, at)| format!("effect {name}: {effect} on {at}")),
        (declared_name(), titled, expression(), optional(fields()))
            .prop_map(|(name, title, value, fields)| format!("measure {name}{title} = {value} {fields}")),
        (declared_name(), name(), prop::collection::vec(path(), 0..3), optional(fields())).prop_map(
            |(name, model, places, fields)| {
                let at = if places.is_empty() { String::new() } else { format!(" at {}", places.join(", ")) };
                format!("part {name}: {model}{at} {fields}")
            }
        ),
        identify(),
    ]
}

fn lines(items: Vec<String>) -> String {
    items.join("\n")
}

fn declaration() -> impl Strategy<Value = String> {
    let family = (name(), number(), prop::collection::vec(element(), 0..3))
        .prop_map(|(variable, high, items)| format!("for {variable} in 1..{high} {{\n{}\n}}", lines(items)));
    let family = family.boxed();
    let inner = prop_oneof![4 => element(), 1 => family.clone()];
    let model = (
        name(),
        prop::collection::vec((name(), select(vec!["point", "joint"])), 0..3),
        declared(),
        prop::collection::vec(inner, 0..3),
    )
        .prop_map(|(name, ports, parameter, items)| {
            let ports: Vec<String> = ports.into_iter().map(|(port, kind)| format!("{port}: {kind}")).collect();
            let ports = if ports.is_empty() { String::new() } else { format!("({})", ports.join(", ")) };
            format!("model {name}{ports} {{\n param {parameter}\n{}\n}}", lines(items))
        });
    let change = prop_oneof![
        element().prop_map(|item| if item.starts_with("identify") { item } else { format!("add {item}") }),
        path().prop_map(|name| format!("remove {name}")),
        (declared_name(), expression()).prop_map(|(name, value)| format!("replace constant {name} = {value}")),
    ];
    prop_oneof![
        6 => element(),
        1 => family,
        1 => model,
        1 => law(),
        1 => effect(),
        1 => table(),
        1 => (name(), name()).prop_map(|(name, file)| format!("study {name} \"t\"\nuse \"{file}.ident\"")),
        1 => (expression(), direction()).prop_map(|(value, along)| format!("gravity = {value} along {along}")),
        1 => (declared_name(), optional(fields())).prop_map(|(name, fields)| format!("input {name} [mm] \"t\" {fields}")),
        1 => (declared_name(), prop::collection::vec(path(), 0..3))
            .prop_map(|(name, members)| format!("group {name} {{ {} }}", members.join(", "))),
        1 => (name(), fields()).prop_map(|(name, fields)| format!("experiment {name} validation {fields}")),
        1 => (name(), path(), expression(), number())
            .prop_map(|(name, input, value, time)| format!("manoeuvre {name} \"m\" {{ {input} = {value}, for {time} }}")),
        1 => (declared_name(), expression(), name(), optional(fields()))
            .prop_map(|(name, value, run, fields)| format!("criterion {name} [N] = max({value}) in {run} {fields}")),
        1 => (number(), number()).prop_map(|(pass, stop)| {
            format!("filter {{ lowpass butterworth pass {pass}(2 dB) stop {stop} (20 dB) single_pass\n remove_mean }}")
        }),
        1 => fields().prop_map(|fields| format!("solver {fields}")),
        1 => (name(), name(), prop::collection::vec(change, 0..4))
            .prop_map(|(name, base, changes)| format!("variant {name} of {base} {{\n{}\n}}", lines(changes))),
    ]
}

/// Declarations with documentation, remarks and empty lines between them.
fn study() -> impl Strategy<Value = String> {
    let before =
        select(vec!["", "", "\n\n\n", "// remark\n", "/// What it is.\n", "\t  // shifted\n\n", "//// four\n"]);
    let behind = select(vec!["", "", "  // behind", "   "]);
    let item = (before, declaration(), behind).prop_map(|(before, item, behind)| format!("{before}{item}{behind}"));
    prop::collection::vec(item, 1..6).prop_map(lines)
}

fn remarks(text: &str) -> Vec<String> {
    let quoted = |line: &str, at: usize| line[..at].matches('"').count() % 2 == 1;
    let of_line = |line: &str| {
        let start = line.match_indices("//").map(|(at, _)| at).find(|at| !quoted(line, *at))?;
        Some(line[start..].trim_end().to_owned())
    };
    text.lines().filter_map(of_line).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn every_construct_is_printed_and_formatted_as_it_reads(text in study()) {
        let (tree, findings) = parse(0, &text);
        // Only depth is beyond the grammar that the generator follows.
        prop_assert!(findings.is_empty(), "{:?}\n{}", findings, text);
        let printed = print(&tree);
        let (again, findings) = parse(0, &printed);
        prop_assert!(findings.is_empty(), "{:?}\n{}", findings, printed);
        prop_assert_eq!(shape(&tree), shape(&again), "{}", printed);

        let formatted = format(0, &text);
        prop_assert!(formatted.is_ok(), "{:?}\n{}", formatted, text);
        let formatted = formatted.unwrap_or_default();
        let (again, findings) = parse(0, &formatted);
        prop_assert!(findings.is_empty(), "{:?}\n{}", findings, formatted);
        prop_assert_eq!(shape(&tree), shape(&again), "{}", formatted);
        prop_assert_eq!(format(0, &formatted), Ok(formatted.clone()), "{}", text);
        prop_assert_eq!(remarks(&text), remarks(&formatted));
        prop_assert!(!formatted.contains("\n\n\n") && !formatted.contains(" \n") && !formatted.contains('\t'));
    }
}
