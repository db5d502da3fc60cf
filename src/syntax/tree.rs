//! The tree of a study's text: what was written, nothing resolved. Every part carries its span.

use crate::diagnostics::Span;

/// One file.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Tree {
    pub items: Vec<Item>,
}

/// An identifier or a dotted path where it was written; indices contain no blanks: `wheel[i+1].force`.
#[derive(Clone, Debug, PartialEq)]
pub struct Name {
    pub text: String,
    pub span: Span,
}

/// A declaration with the `///` lines above it.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    pub documentation: String,
    pub kind: ItemKind,
    pub span: Span,
}

#[derive(Clone, Debug, PartialEq)]
pub enum ItemKind {
    /// `study NAME "title"`
    Study { name: Name, title: Option<Name> },
    /// `use "file.ident"`
    Use { path: Name },
    /// `gravity = 9.81 m/s^2 along -z`
    Gravity { value: Expression, direction: Direction },
    /// `constant NAME = expression`: a named number used in several places.
    Constant { name: Name, value: Expression },
    /// `input NAME [unit] "title" { interpolation = hold }`
    Input { name: Name, unit: Option<Name>, title: Option<Name>, fields: Vec<Field> },
    /// `body NAME { mass = .., centre_of_gravity = (..), inertia = (..), point tip = (..) }`
    Body { name: Name, fields: Vec<Field>, points: Vec<Field> },
    /// `joint NAME: prismatic(z) PARENT -> CHILD { fields }`; attachments are bodies or points (`ground`, `arm.tip`).
    Joint { name: Name, kind: Name, axes: Vec<JointAxis>, parent: Name, child: Name, fields: Vec<Field> },
    /// `coupling NAME: LEFT = RIGHT`: a relation of positions that always holds.
    Coupling { name: Name, left: Expression, right: Expression },
    /// `force|actuator|signal NAME: LAW [on JOINT | A -> B [along z]] { fields }`
    /// and `effect NAME: EFFECT on PLACE { fields }`.
    Element { role: ElementRole, name: Name, law: Name, place: ElementPlace, fields: Vec<Field> },
    /// `signal NAME = expression`: a formula.
    Formula { name: Name, value: Expression },
    /// `measure NAME [unit] "title" = expression { fields }`
    Measure { name: Name, unit: Option<Name>, title: Option<Name>, value: Expression, fields: Vec<Field> },
    /// `group NAME { member, member }`
    Group { name: Name, members: Vec<Name> },
    /// `experiment NAME [estimation|validation|test] { fields }`; `start` and `window` are fields.
    Experiment { name: Name, role: Option<Name>, fields: Vec<Field> },
    /// `manoeuvre NAME "title" { u = 60 mm * smoothstep((t - 1 s) / 20 ms), for 4 s, start = equilibrium }`: what the
    /// model is used for, without a measurement.
    Manoeuvre { name: Name, title: Option<Name>, durations: Vec<Expression>, fields: Vec<Field> },
    /// `criterion NAME [unit] "title" = max(tyre.force) in MANOEUVRE { below = 12 kN, confidence = 99 % }`
    Criterion {
        name: Name,
        unit: Option<Name>,
        title: Option<Name>,
        value: Expression,
        manoeuvre: Name,
        fields: Vec<Field>,
    },
    /// `identify { lines, constrain d_r >= d_c }`
    Identify { lines: Vec<IdentifyLine>, constraints: Vec<Expression> },
    /// `filter { lowpass butterworth pass 5 Hz (2 dB) stop 7 Hz (20 dB) zero_phase, remove_mean }`
    Filter { lowpass: Option<Lowpass>, remove_mean: bool },
    /// `solver { tolerance = 1e-6, method = bdf }`
    Solver { fields: Vec<Field> },
    /// `variant NAME of BASE { changes }`
    Variant { name: Name, base: Name, changes: Vec<Change> },
    /// `law NAME(port: type, ...) -> type { ... }`
    Law(LawDeclaration),
    /// `effect NAME at any joint, force { ... }`
    Effect(EffectDeclaration),
    /// `table NAME(argument: type) -> type { points = .., interpolation = .., extrapolation = .. }`
    Table(TableDeclaration),
    /// `model NAME(port: body, ...) { param .. declarations }`
    Model(ModelDeclaration),
    /// `part NAME: MODEL at PLACE, PLACE { fields }`: a use of a model; the places bind its ports in their order.
    Part { name: Name, model: Name, places: Vec<Name>, fields: Vec<Field> },
    /// `for VARIABLE in LOW .. HIGH { declarations }`: an index family.
    Family { variable: Name, low: Expression, high: Expression, items: Vec<Item> },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ElementRole {
    Force,
    Actuator,
    Signal,
    Effect,
}

#[derive(Clone, Debug, PartialEq)]
pub enum ElementPlace {
    /// Signals stand nowhere.
    Nowhere,
    /// `on NAME`
    On(Name),
    /// `A -> B [along z | about z]`
    Between { first: Name, second: Name, axis: Option<(PlaceAxis, Direction)> },
}

/// One of the axes of a joint: `z`, `turn z`, `shift (0, 0.6, 0.8)`.
#[derive(Clone, Debug, PartialEq)]
pub struct JointAxis {
    pub motion: Option<Name>,
    pub direction: Direction,
}

/// How a force element uses its direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaceAxis {
    Along,
    About,
}

/// `x`, `-z`, `(0, 0.6, 0.8)`, or `bogie.y`.
#[derive(Clone, Debug, PartialEq)]
pub struct Direction {
    pub kind: DirectionKind,
    pub span: Span,
}

#[derive(Clone, Debug, PartialEq)]
pub enum DirectionKind {
    /// Axis 0, 1, 2 and whether it is negated.
    Axis {
        axis: usize,
        negative: bool,
    },
    Vector(Vec<Expression>),
    /// Axis of a body, which turns with it.
    OfBody {
        path: Name,
        negative: bool,
    },
}

/// `key = value` inside braces.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    pub key: Name,
    pub value: Value,
    pub span: Span,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Expression(Expression),
    /// `"text"`
    Text(Name),
    /// `(a, b, c)`
    Tuple(Vec<Expression>, Span),
    /// `1 s .. 10 s`
    Range(Expression, Expression),
    /// `{ key = value, .. }`; also `WORD { .. }` as in `start = rest { slide.velocity = v0 }` (word in front).
    Block {
        word: Option<Name>,
        fields: Vec<Field>,
        span: Span,
    },
    /// `{ a, b }`: a list of names.
    List(Vec<Name>, Span),
}

/// `TARGET in LOWER .. UPPER [unit] from START [unit] [prior MEAN +- SD [unit]]`. A bound written as a bare number
/// takes the unit of the bound after it (`10 .. 40 kN/m`).
#[derive(Clone, Debug, PartialEq)]
pub struct IdentifyLine {
    /// A parameter name, or the path of a number that the study holds fixed (`tyre.stiffness`).
    pub target: Name,
    pub lower: Expression,
    pub upper: Expression,
    pub start: Expression,
    pub prior: Option<(Expression, Expression)>,
    /// `per experiment`: a value of its own in each.
    pub per_experiment: bool,
    pub span: Span,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Lowpass {
    pub pass: Expression,
    pub pass_drop: Expression,
    pub stop: Expression,
    pub stop_attenuation: Expression,
    /// `single_pass` instead of `zero_phase`: attenuations refer to one of the two passes.
    pub single_pass: bool,
    pub span: Span,
}

/// A change of a variant.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// `add DECLARATION`, or `identify { .. }` as it stands
    Add(Box<Item>),
    /// `remove NAME`
    Remove(Name),
    /// `replace DECLARATION`: the element of the same name is exchanged
    Replace(Box<Item>),
}

/// `name: type [= default] [in low .. high]`
#[derive(Clone, Debug, PartialEq)]
pub struct Declared {
    pub documentation: String,
    pub name: Name,
    pub kind: Option<TypeExpression>,
    pub default: Option<Expression>,
    pub range: Option<(Expression, Expression)>,
    /// `of rate`: the range is relative to the place's typical magnitude of this quantity.
    pub range_of: Option<Name>,
    /// Words after the declaration: `one_sided`, `finite`, `unnamed`, `periodic`.
    pub flags: Vec<Name>,
    /// `neutral 1`
    pub neutral: Option<Expression>,
    pub span: Span,
}

/// `load/rate^2`, `force`, `1`, `ratio`.
#[derive(Clone, Debug, PartialEq)]
pub struct TypeExpression {
    /// (type name, exponent); `1` is the empty product.
    pub factors: Vec<(Name, i8)>,
    pub span: Span,
}

/// `state z: type from INITIAL { z' = EXPRESSION }` is one state with one derivative; several `state` lines make
/// several states, each derivative may mention all of them. Without braces the state changes at events only.
#[derive(Clone, Debug, PartialEq)]
pub struct StateDeclaration {
    pub name: Name,
    pub kind: Option<TypeExpression>,
    pub initial: Expression,
    /// Typical size of the state, which its error is measured by near zero.
    pub nominal: Option<Expression>,
    /// None: the state keeps its value between events.
    pub derivative: Option<Expression>,
    pub span: Span,
}

/// What changes states at instants: `when CONDITION { z := EXPRESSION }`, `every PERIOD { z := EXPRESSION }`.
/// Expressions take the values before.
#[derive(Clone, Debug, PartialEq)]
pub struct EventDeclaration {
    pub trigger: Trigger,
    /// The condition or the period.
    pub expression: Expression,
    pub changes: Vec<(Name, Expression)>,
    pub span: Span,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trigger {
    /// The instant at which a condition becomes true.
    When,
    /// Multiples of a period.
    Every,
}

#[derive(Clone, Debug, PartialEq)]
pub struct LawDeclaration {
    pub name: Name,
    pub ports: Vec<Declared>,
    /// What the law returns.
    pub result: TypeExpression,
    /// `param a: type = default, b: type`
    pub parameters: Vec<Declared>,
    /// `let name = expression`
    pub bindings: Vec<(Name, Expression)>,
    pub states: Vec<StateDeclaration>,
    pub events: Vec<EventDeclaration>,
    /// `= expression`
    pub value: Expression,
}

/// A characteristic curve.
#[derive(Clone, Debug, PartialEq)]
pub struct TableDeclaration {
    pub name: Name,
    /// One in a sound study.
    pub arguments: Vec<Declared>,
    pub result: TypeExpression,
    /// `points = ((x, y), ...)`: the pairs, and where they stand.
    pub points: Option<(Vec<Vec<Expression>>, Span)>,
    /// `harmonics = ((order or period, amplitude, phase), ...)`, and where they stand.
    pub harmonics: Option<(Vec<Vec<Expression>>, Span)>,
    pub fields: Vec<Field>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct ModelDeclaration {
    pub name: Name,
    pub ports: Vec<Port>,
    pub parameters: Vec<Declared>,
    pub items: Vec<Item>,
}

/// What a model is joined to: `frame: body`.
#[derive(Clone, Debug, PartialEq)]
pub struct Port {
    pub documentation: String,
    pub name: Name,
    /// `body`, `point`, `joint`, `force`, `signal`
    pub kind: Name,
}

#[derive(Clone, Debug, PartialEq)]
pub struct EffectDeclaration {
    pub name: Name,
    /// `at any joint, force`
    pub places: Vec<Name>,
    /// `where translational`, `where length`: motion or dimension the place must have.
    pub restriction: Option<Name>,
    pub amplitudes: Vec<Declared>,
    pub shapes: Vec<Declared>,
    pub bindings: Vec<(Name, Expression)>,
    pub states: Vec<StateDeclaration>,
    pub actions: Vec<EffectAction>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum EffectAction {
    /// `adds EXPRESSION`: to the load (joint, force, actuator) or to the value (input, measure, signal)
    Adds(Expression),
    /// `replaces NAME by EXPRESSION`; the name is a port of the place: `x`, `v`, `load`, `value`, `u`, `y`, `command`.
    Replaces(Name, Expression),
}

#[derive(Clone, Debug, PartialEq)]
pub struct Expression {
    pub kind: ExpressionKind,
    pub span: Span,
}

#[derive(Clone, Debug, PartialEq)]
pub enum ExpressionKind {
    /// A number with its unit as written (`None`: dimensionless).
    Number {
        value: f64,
        unit: Option<Name>,
    },
    /// `c_strut`, `tyre.force`, `arm.tip.position.z`, `t`
    Path(Name),
    Negate(Box<Expression>),
    Binary {
        operator: Operator,
        left: Box<Expression>,
        right: Box<Expression>,
    },
    Call {
        function: Name,
        arguments: Vec<Expression>,
    },
    /// `if CONDITION then A else B`
    If {
        condition: Box<Expression>,
        then: Box<Expression>,
        otherwise: Box<Expression>,
    },
    /// Stands where the parser recovered; the diagnostic is already reported.
    Invalid,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    And,
    Or,
}
