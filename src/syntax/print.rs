//! From the tree to text in canonical style: two blanks of indentation, one line where it fits.

use super::build_expression::{SIGN, precedence};
use super::tree::*;

/// Longer lines are broken into one entry per line.
const WIDTH: usize = 110;

/// The whole file. Reading the text again gives the same tree but for spans; comments other than `///` are not part
/// of the tree and are lost.
pub fn print(tree: &Tree) -> String {
    let mut text = String::new();
    let mut previous: Option<&Item> = None;
    for item in &tree.items {
        let printed = print_item(item);
        // Declarations of one kind that fit a line stand together; others are set apart.
        let related = previous.is_some_and(|previous| {
            std::mem::discriminant(&previous.kind) == std::mem::discriminant(&item.kind)
                && item.documentation.is_empty()
                && printed.lines().count() == 1
        });
        if previous.is_some() && !related {
            text.push('\n');
        }
        text += &printed;
        previous = Some(item);
    }
    text
}

/// One declaration with its documentation, ending with a line feed.
pub fn print_item(item: &Item) -> String {
    let mut text = documentation(&item.documentation);
    text += &kind(&item.kind);
    text.push('\n');
    text
}

fn documentation(documentation: &str) -> String {
    if documentation.is_empty() {
        return String::new();
    }
    documentation.split('\n').map(|line| format!("/// {line}").trim_end().to_owned() + "\n").collect()
}

fn kind(kind: &ItemKind) -> String {
    match kind {
        ItemKind::Study { name, title } => format!("study {}{}", name.text, optional_text(title)),
        ItemKind::Use { path } => format!("use \"{}\"", path.text),
        ItemKind::Gravity { value, direction } => {
            format!("gravity = {} along {}", print_expression(value), direction_text(direction))
        }
        ItemKind::Constant { name, value } => format!("constant {} = {}", name.text, print_expression(value)),
        ItemKind::Input { name, unit, title, fields } => {
            let head = format!("input {}{}{}", name.text, optional_unit(unit), optional_text(title));
            with_fields(&head, fields)
        }
        ItemKind::Body { name, fields, points } => body(name, fields, points),
        ItemKind::Joint { name, kind, axes, parent, child, fields } => {
            let axes = joint_axes(axes);
            let head = format!("joint {}: {}{axes} {} -> {}", name.text, kind.text, parent.text, child.text);
            with_fields(&head, fields)
        }
        ItemKind::Coupling { name, left, right } => {
            format!("coupling {}: {} = {}", name.text, print_expression(left), print_expression(right))
        }
        ItemKind::Element { role, name, law, place, fields } => {
            let head = format!("{} {}: {}{}", role_word(*role), name.text, law.text, place_text(place));
            with_fields(&head, fields)
        }
        ItemKind::Formula { name, value } => format!("signal {} = {}", name.text, print_expression(value)),
        ItemKind::Measure { name, unit, title, value, fields } => {
            let names = format!("measure {}{}{}", name.text, optional_unit(unit), optional_text(title));
            with_fields(&format!("{names} = {}", print_expression(value)), fields)
        }
        ItemKind::Group { name, members } => {
            braces(&format!("group {}", name.text), &names(members), ",", Layout::OneLineIfItFits)
        }
        ItemKind::Experiment { name, role, fields } => {
            let role = role.as_ref().map(|role| format!(" {}", role.text)).unwrap_or_default();
            braces(&format!("experiment {}{role}", name.text), &field_lines(fields), ",", Layout::OneLineIfItFits)
        }
        ItemKind::Manoeuvre { name, title, durations, fields } => {
            let mut lines = field_lines(fields);
            lines.extend(durations.iter().map(|duration| format!("for {}", print_expression(duration))));
            let head = format!("manoeuvre {}{}", name.text, optional_text(title));
            braces(&head, &lines, ",", Layout::OneLineIfItFits)
        }
        ItemKind::Criterion { name, unit, title, value, manoeuvre, fields } => {
            let names = format!("criterion {}{}{}", name.text, optional_unit(unit), optional_text(title));
            with_fields(&format!("{names} = {} in {}", print_expression(value), manoeuvre.text), fields)
        }
        ItemKind::Identify { lines, constraints } => identify(lines, constraints),
        ItemKind::Filter { lowpass, remove_mean } => filter(lowpass.as_ref(), *remove_mean),
        ItemKind::Solver { fields } => braces("solver", &field_lines(fields), ",", Layout::OneLineIfItFits),
        ItemKind::Variant { name, base, changes } => {
            let lines: Vec<String> = changes.iter().map(change).collect();
            braces(&format!("variant {} of {}", name.text, base.text), &lines, "", Layout::Lines)
        }
        ItemKind::Law(law) => law_text(law),
        ItemKind::Effect(effect) => effect_text(effect),
        ItemKind::Table(table) => table_text(table),
        ItemKind::Model(model) => model_text(model),
        ItemKind::Part { name, model, places, fields } => {
            let places = if places.is_empty() { String::new() } else { format!(" at {}", names(places).join(", ")) };
            with_fields(&format!("part {}: {}{places}", name.text, model.text), fields)
        }
        ItemKind::Family { variable, low, high, items } => {
            let range = format!("{} .. {}", print_expression(low), print_expression(high));
            braces(&format!("for {} in {range}", variable.text), &item_lines(items), "", Layout::Lines)
        }
    }
}

fn item_lines(items: &[Item]) -> Vec<String> {
    items.iter().map(print_item).collect()
}

fn table_text(table: &TableDeclaration) -> String {
    let arguments: Vec<String> = table.arguments.iter().map(declared).collect();
    let head = format!("table {}({}) -> {}", table.name.text, arguments.join(", "), type_text(&table.result));
    let mut lines = Vec::new();
    for (word, list) in [("points", &table.points), ("harmonics", &table.harmonics)] {
        let Some((tuples, _)) = list else { continue };
        let tuples: Vec<String> = tuples.iter().map(|entries| tuple(entries)).collect();
        let line = format!("{word} = ({})", tuples.join(", "));
        lines.push(if line.chars().count() < WIDTH {
            line
        } else {
            let tuples: String = tuples.iter().map(|entries| format!("  {entries},\n")).collect();
            format!("{word} = (\n{tuples})")
        });
    }
    lines.extend(field_lines(&table.fields));
    braces(&head, &lines, ",", Layout::OneLineIfItFits)
}

fn model_text(model: &ModelDeclaration) -> String {
    let port = |port: &Port| format!("{}{}: {}", documentation(&port.documentation), port.name.text, port.kind.text);
    let ports: Vec<String> = model.ports.iter().map(port).collect();
    let head = if ports.iter().any(|port| port.contains('\n')) {
        let lines: String = ports.iter().map(|port| format!("  {},\n", indented(port))).collect();
        format!("model {}(\n{}\n)", model.name.text, lines.trim_end().trim_end_matches(','))
    } else if ports.is_empty() {
        format!("model {}", model.name.text)
    } else {
        format!("model {}({})", model.name.text, ports.join(", "))
    };
    let mut lines: Vec<String> = model.parameters.iter().map(|parameter| statement("param", parameter)).collect();
    lines.extend(item_lines(&model.items));
    braces(&head, &lines, "", Layout::Lines)
}

fn optional_text(text: &Option<Name>) -> String {
    text.as_ref().map(|text| format!(" \"{}\"", text.text)).unwrap_or_default()
}

fn optional_unit(unit: &Option<Name>) -> String {
    unit.as_ref().map(|unit| format!(" [{}]", unit.text)).unwrap_or_default()
}

fn names(names: &[Name]) -> Vec<String> {
    names.iter().map(|name| name.text.clone()).collect()
}

fn role_word(role: ElementRole) -> &'static str {
    match role {
        ElementRole::Force => "force",
        ElementRole::Actuator => "actuator",
        ElementRole::Signal => "signal",
        ElementRole::Effect => "effect",
    }
}

fn place_text(place: &ElementPlace) -> String {
    match place {
        ElementPlace::Nowhere => String::new(),
        ElementPlace::On(name) => format!(" on {}", name.text),
        ElementPlace::Between { first, second, axis } => {
            let axis = match axis {
                None => String::new(),
                Some((PlaceAxis::Along, direction)) => format!(" along {}", direction_text(direction)),
                Some((PlaceAxis::About, direction)) => format!(" about {}", direction_text(direction)),
            };
            format!(" {} -> {}{axis}", first.text, second.text)
        }
    }
}

fn axis_text(axis: usize, negative: bool) -> String {
    let letter = ["x", "y", "z"].get(axis).copied().unwrap_or("z");
    if negative { format!("-{letter}") } else { letter.to_owned() }
}

fn direction_text(direction: &Direction) -> String {
    match &direction.kind {
        DirectionKind::Axis { axis, negative } => axis_text(*axis, *negative),
        DirectionKind::Vector(components) => tuple(components),
        DirectionKind::OfBody { path, negative } => format!("{}{}", if *negative { "-" } else { "" }, path.text),
    }
}

fn joint_axes(axes: &[JointAxis]) -> String {
    match axes {
        [] => String::new(),
        [JointAxis { motion: None, direction: Direction { kind: DirectionKind::Vector(components), .. } }] => {
            tuple(components)
        }
        _ => {
            let texts: Vec<String> = axes
                .iter()
                .map(|axis| {
                    let motion = axis.motion.as_ref().map(|motion| format!("{} ", motion.text)).unwrap_or_default();
                    format!("{motion}{}", direction_text(&axis.direction))
                })
                .collect();
            format!("({})", texts.join(", "))
        }
    }
}

fn tuple(components: &[Expression]) -> String {
    format!("({})", components.iter().map(print_expression).collect::<Vec<_>>().join(", "))
}

// ---- braces ----

#[derive(Clone, Copy, PartialEq)]
enum Layout {
    OneLineIfItFits,
    Lines,
}

/// `head { entry, entry }`, or one entry per line.
fn braces(head: &str, entries: &[String], separator: &str, layout: Layout) -> String {
    let gap = if head.is_empty() { "" } else { " " };
    if entries.is_empty() {
        return format!("{head}{gap}{{ }}");
    }
    let line = format!("{head}{gap}{{ {} }}", entries.join(&format!("{separator} ")));
    if layout == Layout::OneLineIfItFits && line.chars().count() <= WIDTH && !line.contains('\n') {
        return line;
    }
    let lines: String = entries.iter().map(|entry| format!("  {}\n", indented(entry))).collect();
    format!("{head}{gap}{{\n{lines}}}")
}

fn indented(text: &str) -> String {
    text.trim_end().replace('\n', "\n  ")
}

fn with_fields(head: &str, fields: &[Field]) -> String {
    if fields.is_empty() { head.to_owned() } else { braces(head, &field_lines(fields), ",", Layout::OneLineIfItFits) }
}

fn field_lines(fields: &[Field]) -> Vec<String> {
    fields.iter().map(field).collect()
}

fn field(field: &Field) -> String {
    format!("{} = {}", field.key.text, value(&field.value))
}

fn value(value: &Value) -> String {
    match value {
        Value::Expression(expression) => print_expression(expression),
        Value::Text(text) => format!("\"{}\"", text.text),
        Value::Tuple(components, _) => tuple(components),
        Value::Range(low, high) => format!("{} .. {}", print_expression(low), print_expression(high)),
        Value::Block { word, fields, .. } => {
            let head = word.as_ref().map_or("", |word| word.text.as_str());
            braces(head, &field_lines(fields), ",", Layout::OneLineIfItFits)
        }
        Value::List(members, _) => braces("", &names(members), ",", Layout::OneLineIfItFits),
    }
}

fn body(name: &Name, fields: &[Field], points: &[Field]) -> String {
    let mut lines = field_lines(fields);
    lines.extend(points.iter().map(|point| format!("point {}", field(point))));
    braces(&format!("body {}", name.text), &lines, ",", Layout::OneLineIfItFits)
}

fn identify(lines: &[IdentifyLine], constraints: &[Expression]) -> String {
    let constraints = constraints.iter().map(|constraint| format!("constrain {}", print_expression(constraint)));
    let lines: Vec<String> = lines.iter().map(identify_line).chain(constraints).collect();
    let layout = if lines.len() > 1 { Layout::Lines } else { Layout::OneLineIfItFits };
    braces("identify", &lines, "", layout)
}

fn identify_line(line: &IdentifyLine) -> String {
    let (lower, upper) = (print_expression(&line.lower), print_expression(&line.upper));
    let prior = line
        .prior
        .as_ref()
        .map(|(mean, deviation)| format!(" prior {} +- {}", print_expression(mean), print_expression(deviation)));
    let start = print_expression(&line.start);
    let own = if line.per_experiment { " per experiment" } else { "" };
    format!("{} in {lower} .. {upper} from {start}{}{own}", line.target.text, prior.unwrap_or_default())
}

fn filter(lowpass: Option<&Lowpass>, remove_mean: bool) -> String {
    let mut lines = Vec::new();
    if let Some(design) = lowpass {
        let direction = if design.single_pass { "single_pass" } else { "zero_phase" };
        let edge = |at: &Expression, by: &Expression| format!("{} ({})", print_expression(at), print_expression(by));
        let pass = edge(&design.pass, &design.pass_drop);
        let stop = edge(&design.stop, &design.stop_attenuation);
        lines.push(format!("lowpass butterworth pass {pass} stop {stop} {direction}"));
    }
    if remove_mean {
        lines.push("remove_mean".to_owned());
    }
    braces("filter", &lines, ",", Layout::OneLineIfItFits)
}

fn change(change: &Change) -> String {
    match change {
        Change::Add(item) if matches!(item.kind, ItemKind::Identify { .. }) => print_item(item),
        Change::Add(item) => documentation(&item.documentation) + "add " + &kind(&item.kind),
        Change::Remove(name) => format!("remove {}", name.text),
        Change::Replace(item) => documentation(&item.documentation) + "replace " + &kind(&item.kind),
    }
}

// ---- laws and effects ----

fn law_text(law: &LawDeclaration) -> String {
    let ports: Vec<String> = law.ports.iter().map(declared).collect();
    let head = if law.ports.iter().any(|port| !port.documentation.is_empty()) {
        let ports: String = ports.iter().map(|port| format!("  {},\n", indented(port))).collect();
        format!("law {}(\n{}\n)", law.name.text, ports.trim_end().trim_end_matches(','))
    } else {
        format!("law {}({})", law.name.text, ports.join(", "))
    };
    let mut lines: Vec<String> = law.parameters.iter().map(|parameter| statement("param", parameter)).collect();
    lines.extend(law.bindings.iter().map(binding));
    lines.extend(law.states.iter().map(state));
    lines.extend(law.events.iter().map(event));
    lines.push(format!("= {}", print_expression(&law.value)));
    braces(&format!("{head} -> {}", type_text(&law.result)), &lines, "", Layout::Lines)
}

fn effect_text(effect: &EffectDeclaration) -> String {
    let restriction = effect.restriction.as_ref().map(|name| format!(" where {}", name.text)).unwrap_or_default();
    let places = names(&effect.places).join(", ");
    let mut lines: Vec<String> = effect.amplitudes.iter().map(|declared| statement("amplitude", declared)).collect();
    lines.extend(effect.shapes.iter().map(|declared| statement("shape", declared)));
    lines.extend(effect.bindings.iter().map(binding));
    lines.extend(effect.states.iter().map(state));
    lines.extend(effect.actions.iter().map(|action| match action {
        EffectAction::Adds(value) => format!("adds {}", print_expression(value)),
        EffectAction::Replaces(name, value) => format!("replaces {} by {}", name.text, print_expression(value)),
    }));
    braces(&format!("effect {} at any {places}{restriction}", effect.name.text), &lines, "", Layout::Lines)
}

fn statement(word: &str, declaration: &Declared) -> String {
    documentation(&declaration.documentation) + word + " " + &declared_line(declaration)
}

fn declared(declaration: &Declared) -> String {
    documentation(&declaration.documentation) + &declared_line(declaration)
}

fn declared_line(declared: &Declared) -> String {
    let mut text = declared.name.text.clone();
    if let Some(kind) = &declared.kind {
        text += &format!(": {}", type_text(kind));
    }
    if let Some(default) = &declared.default {
        text += &format!(" = {}", print_expression(default));
    }
    if let Some((low, high)) = &declared.range {
        text += &format!(" in {} .. {}", print_expression(low), print_expression(high));
    }
    if let Some(quantity) = &declared.range_of {
        text += &format!(" of {}", quantity.text);
    }
    for flag in &declared.flags {
        text += &format!(" {}", flag.text);
    }
    if let Some(neutral) = &declared.neutral {
        text += &format!(" neutral {}", print_expression(neutral));
    }
    text
}

fn type_text(kind: &TypeExpression) -> String {
    let mut text = String::new();
    for (name, exponent) in &kind.factors {
        match (text.is_empty(), *exponent > 0) {
            (true, true) => {}
            (true, false) => text += "1/",
            (false, true) => text += "*",
            (false, false) => text += "/",
        }
        text += &name.text;
        if exponent.unsigned_abs() != 1 {
            text += &format!("^{}", exponent.unsigned_abs());
        }
    }
    if text.is_empty() { "1".to_owned() } else { text }
}

fn binding((name, value): &(Name, Expression)) -> String {
    format!("let {} = {}", name.text, print_expression(value))
}

fn state(state: &StateDeclaration) -> String {
    let kind = state.kind.as_ref().map(|kind| format!(": {}", type_text(kind))).unwrap_or_default();
    let (name, initial) = (&state.name.text, print_expression(&state.initial));
    let derivative = state.derivative.as_ref().map(|value| format!(" {{ {name}' = {} }}", print_expression(value)));
    let nominal = state.nominal.as_ref().map(|value| format!(" nominal {}", print_expression(value)));
    format!("state {name}{kind} from {initial}{}{}", nominal.unwrap_or_default(), derivative.unwrap_or_default())
}

fn event(event: &EventDeclaration) -> String {
    let word = match event.trigger {
        Trigger::When => "when",
        Trigger::Every => "every",
    };
    let change = |(name, value): &(Name, Expression)| format!("{} := {}", name.text, print_expression(value));
    let changes: Vec<String> = event.changes.iter().map(change).collect();
    let inside = if changes.is_empty() { String::new() } else { format!(" {} ", changes.join(", ")) };
    format!("{word} {} {{{inside}}}", print_expression(&event.expression))
}

// ---- expressions ----

/// Binds stronger than every operator.
const ATOM: u8 = 8;

/// An expression with the parentheses it needs and no others.
pub fn print_expression(expression: &Expression) -> String {
    match &expression.kind {
        ExpressionKind::Number { value, unit } => number(*value, unit.as_ref()),
        ExpressionKind::Path(name) => name.text.clone(),
        ExpressionKind::Negate(operand) => format!("-{}", operand_text(operand, SIGN)),
        ExpressionKind::Binary { operator, left, right } => binary(*operator, left, right),
        ExpressionKind::Call { function, arguments } => format!("{}{}", function.text, tuple(arguments)),
        ExpressionKind::If { condition, then, otherwise } => format!(
            "if {} then {} else {}",
            print_expression(condition),
            print_expression(then),
            print_expression(otherwise)
        ),
        ExpressionKind::Invalid => "invalid".to_owned(),
    }
}

fn binary(operator: Operator, left: &Expression, right: &Expression) -> String {
    let strength = precedence(operator);
    if operator == Operator::Power {
        // Groups to the right; a unit would take the exponent; the sign of an exponent needs no parentheses.
        let base = match &left.kind {
            ExpressionKind::Number { unit: Some(_), .. } => format!("({})", print_expression(left)),
            _ => operand_text(left, strength + 1),
        };
        return format!("{base}^{}", operand_text(right, SIGN));
    }
    let (left, right) = (operand_text(left, strength), operand_text(right, strength + 1));
    format!("{left} {} {right}", operator_text(operator))
}

/// The operand in parentheses if it binds less strongly than `strength`.
fn operand_text(operand: &Expression, strength: u8) -> String {
    let own = match &operand.kind {
        ExpressionKind::Binary { operator, .. } => precedence(*operator),
        ExpressionKind::Negate(_) => SIGN,
        ExpressionKind::Number { value, .. } if value.is_sign_negative() => SIGN,
        ExpressionKind::If { .. } => 0,
        _ => ATOM,
    };
    let text = print_expression(operand);
    if own < strength { format!("({text})") } else { text }
}

fn operator_text(operator: Operator) -> &'static str {
    match operator {
        Operator::Add => "+",
        Operator::Subtract => "-",
        Operator::Multiply => "*",
        Operator::Divide => "/",
        Operator::Power => "^",
        Operator::Less => "<",
        Operator::LessEqual => "<=",
        Operator::Greater => ">",
        Operator::GreaterEqual => ">=",
        Operator::And => "and",
        Operator::Or => "or",
    }
}

/// The shortest decimal number that reads as the same value.
fn number(value: f64, unit: Option<&Name>) -> String {
    let magnitude = value.abs();
    let plain = value == 0.0 || (1e-4..1e7).contains(&magnitude);
    let digits = if plain { format!("{value}") } else { format!("{value:e}") };
    match unit {
        Some(unit) => format!("{digits} {}", unit.text),
        None => digits,
    }
}
