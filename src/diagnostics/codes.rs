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
     declaration that starts at the beginning of a line.\n\
     Close it where it belongs; `ident fmt` then shows by the indentation what belongs together.\n"

    TOO_DEEP "E0104" "nested too deeply or too large"
    "Expressions and blocks may be nested up to a fixed depth, and files up to a fixed size; generated text that\n\
     exceeds it is refused instead of exhausting the memory. Split the expression with `let`, the file with `use`.\n"

    NOT_YET "E0105" "not yet part of the language"
    "The construct is reserved: it is planned but this version does not read it.\n\
     Write what it stands for by hand, e.g. an `end_stop` for a contact.\n"

    BAD_NUMBER "E0106" "not a number"
    "Numbers are written like `12`, `0.5`, `1.2e-3`, followed by their unit: `12 kN/m`.\n"

    REPEATED_CLAUSE "E0107" "written twice"
    "A clause that may stand once is written twice, e.g. two `lowpass` designs in one filter.\n"

    SPACED_UNIT "E0108" "unit with a blank"
    "A unit is one word whose parts are joined by signs: `12 N*m`, not `12 N m`; `3 m/s^2`, not `3 m / s^2`. What follows a blank\n\
     is arithmetic or another entry.\n"

    // ---- E02xx: names, quantities, dimensions, structure of the study ----

    UNKNOWN_NAME "E0201" "unknown name"
    "The name is not declared in the study, its `use`d files or the prelude. Declarations may stand in any order;\n\
     a similar name is suggested where there is one.\n"

    UNKNOWN_UNIT "E0202" "unknown unit"
    "The unit is not known. Units are symbols of the SI with prefixes (`kN`, `mm`, `ms`), some common others\n\
     (`bar`, `rpm`, `deg`, `km/h`, `g0`), and products and powers of them: `kN*s/m`, `N*m/rad`, `m/s^2`.\n"

    DIMENSION_MISMATCH "E0203" "dimensions do not agree"
    "Only quantities of the same dimension can be added, compared or assigned. Both places are marked.\n\
     `3 kN + 2 mm` has no meaning. Where a factor is missing, write it: `force + stiffness * 2 mm`; where only the unit is missing,\n\
     write it: `stiffness = 180 kN/m`.\n"

    DUPLICATE_NAME "E0204" "declared twice"
    "Every name is declared once, and every field given once. Everything that an expression can mention shares one\n\
     namespace. In a variant, `replace` exchanges a declaration and `identify` an earlier line for the same target.\n"

    CYCLIC_DEFINITION "E0205" "circular definition"
    "A value depends on itself. The note names the way round. In a machine such a circle is always broken by something\n\
     that stores: a mass, a filter, an actuator's lag; give one member a law with a state, e.g. `pt1`.\n"

    NOT_IDENTIFIED "E0206" "name without a value"
    "A free name in an expression is a parameter and must be identified:\n\
     \n    identify { c_strut in 10 .. 40 kN/m from 22 kN/m }\n\
     \nor a constant: `constant c_strut = 22 kN/m`.\n"

    UNKNOWN_FIELD "E0207" "unknown field"
    "The element, law or effect has no field of this name, or the place provides the quantity by itself (`x`, `v` and\n\
     `inertia` of a law on a joint). The note lists the fields there are.\n"

    MISSING_FIELD "E0208" "missing field"
    "A port, parameter or field without default is not given. Nothing is assumed in its place.\n\
     Add the field, e.g. `stiffness = 180 kN/m`; the help names it.\n"

    WRONG_VALUE "E0209" "value of the wrong sort"
    "The value does not suit: a text where a number is needed, a word that is not one of the choices, a number outside\n\
     of what makes sense (a negative mass, a standard deviation of zero).\n\
     The note lists the choices; `start = equilibrium`, `mass = 45 kg`.\n"

    NOT_CONSTANT "E0210" "not a constant"
    "Masses, positions and start values may depend on parameters but not on time or motion. Bounds, windows and edges\n\
     of filters are plain numbers.\n\
     Write the number with its unit, `window = 1 s .. 10 s`, or give the quantity a name in `identify`.\n"

    WRONG_PLACE "E0211" "law or effect at a wrong place"
    "Laws that give a force do not suit a revolute joint, an effect stands only on the kinds of places it declares, and\n\
     fixed joints carry no elements. Laws written with `coordinate`, `rate` and `load` serve translation and rotation.\n"

    FREQUENCY_UNIT "E0212" "frequency or angular velocity"
    "Frequencies count periods (Hz), angular velocities count angle (rad/s, rpm); both are 1/s but differ by 2 pi. A\n\
     parameter declared as one of them does not take the unit of the other: 1 Hz = 6.283 rad/s.\n\
     Write `frequency = 5 Hz`, `speed = 31.4 rad/s` or `speed = 300 rpm`.\n"

    WRONG_ARGUMENTS "E0213" "wrong number of arguments"
    "The function takes another number of arguments.\n\
     `max(a, b)` has two, `sqrt(a)` one; nest for more: `max(a, max(b, c))`.\n"

    CONDITION "E0214" "condition expected"
    "Between `if` and `then`, and on both sides of `and` and `or`, stands a comparison: `if x > 0 mm then ..`. Conditions are not\n\
     chained: `0 mm < x and x < 5 mm` instead of `0 mm < x < 5 mm`.\n"

    NOT_A_VALUE "E0215" "not a value"
    "The name stands for a body, joint or element. Its quantities are values: `slide.position`, `tyre.force`,\n\
     `arm.tip.velocity.x`.\n"

    NOT_AN_INPUT "E0216" "past or rate not known"
    "`delayed` and `derivative` need a function of time and inputs only: the past of states is not kept. A lag or a\n\
     transport delay of other signals is a law with states.\n"

    INVALID_DECLARATION "E0217" "law or effect declared wrongly"
    "A law or effect needs what diagnosis and checking rely on: types for amplitudes and shapes, a range for every shape,\n\
     at least one amplitude and one action, ports that the places really have.\n\
     Write e.g. `amplitude F: load` and `shape creep: rate in 0.001 .. 0.1 of rate`.\n"

    OVERRIDES_PRELUDE "E0218" "replaces the prelude's"
    "A law or effect of the study has the name of one that ships with the tool, and is used instead of it.\n\
     Rename yours if both are wanted: `law my_spring(x: coordinate) -> load { .. }`.\n"

    UNIT_AS_NAME "E0219" "unit without number"
    "A unit follows its number on the same line: `3 kN/m`. Where a name is scaled by a unit, the unit has its own number:\n\
     `factor * 1 kN/m`.\n"

    EXPONENT "E0220" "exponent"
    "An exponent is a plain number. Of a quantity with a dimension only powers with a proper dimension exist: `x^2`, `(x*y)^0.5`\n\
     where it works out; else divide first by a reference: `(v / (1 m/s))^1.7`.\n"

    PRODUCT "E0221" "product without sign"
    "The word behind a number is its unit. A product has its sign: `2 * c_strut`, not `2 c_strut`.\n"

    SAME_BODY "E0222" "both ends on one body"
    "A joint or force element acts between two different bodies (or a body and ground).\n\
     Name the other body: `force tyre: spring table -> wheel { .. }`.\n"

    IMPOSSIBLE_INERTIA "E0223" "impossible inertia"
    "Each principal moment of inertia of a body is at most the sum of the other two (equal for a flat plate). Moments that violate\n\
     this have a wrong unit, a wrong order, or belong to another point than the centre of gravity.\n\
     \n    inertia = (0.2 kg*m^2, 0.3 kg*m^2, 0.4 kg*m^2)\n"

    MISSING_INERTIA "E0224" "inertia missing"
    "A revolute joint can turn this body, so its moment of inertia about the centre of gravity counts: `inertia = 2 kg*m^2`\n\
     (the same about all axes) or `inertia = (Ixx, Iyy, Izz)`. A point mass has `inertia = 0 kg*m^2`.\n"

    AXIS "E0226" "axis or direction"
    "Prismatic and revolute joints have an axis, `prismatic(z)` or `revolute((0, 0.6, 0.8))`; fixed joints have none. A\n\
     direction is not the zero vector.\n"

    BARE_ANGLE "E0227" "angle without unit"
    "Angles are dimensionless with rad = 1, so that `sin(30)` is the sine of 30 rad, nearly five turns. Write `sin(30 deg)`.\n"

    NOT_FINITE "E0228" "value that does not exist"
    "The expression is a constant without finite value: a division by zero, the root of a negative number, the logarithm of zero.\n\
     Inside a law the cause may be a field given as zero: `knee = 0 m/s` where the law divides by it.\n"

    BOUNDS "E0230" "bounds out of order"
    "A range runs from the smaller to the larger value, and a start value lies inside its bounds.\n\
     Write `c in 10 .. 40 kN/m from 22 kN/m`.\n"

    IDENTIFY_TARGET "E0231" "cannot be identified"
    "Identified is either a free name used in the study, or a number that the study holds fixed, by its path: `tyre.stiffness`,\n\
     `wheel.mass`, `shaker.compression.slope`. A field that is given by an expression has no number to replace.\n"

    UNUSED_PARAMETER "E0232" "parameter without influence"
    "Nothing that is simulated or measured depends on the parameter, so the data cannot tell its value.\n\
     Use it in the model (`stiffness = c_strut`) or remove its line.\n"

    MISSING_START "E0233" "start not stated"
    "An experiment says how it starts: `start = equilibrium`, `start = rest`, or either with given values,\n\
     `start = rest { slide.velocity = 6 mm/s }`. Start values may be parameters.\n"

    FILTER_DESIGN "E0234" "filter cannot be designed"
    "A low-pass filter passes below and stops above: the pass edge lies below the stop edge, and the largest drop in the\n\
     pass band (dB) below the smallest attenuation in the stop band (dB).\n\
     Write e.g. `lowpass butterworth pass 5 Hz (2 dB) stop 7 Hz (20 dB) zero_phase`.\n"

    NO_STUDY "E0235" "no study declared"
    "The file with the model begins with `study NAME \"title\"`.\n"

    LEFT_OUT "E0236" "parameter left out in a variant"
    "The variant removes what the parameter acts on; it is not identified in this variant.\n\
     Nothing has to be done; `replace` instead of `remove` keeps the parameter in use.\n"

    UNUSED_DECLARATION "E0237" "without use"
    "Something is declared that nothing depends on.\n\
     Use it, e.g. `command = u`, or remove it.\n"

    PRIOR_OUTSIDE "E0238" "prior outside of the bounds"
    "What is known beforehand contradicts the bounds: the fit will end at a bound, and its intervals mean nothing there.\n\
     Correct whichever is wrong:\n\
     \n    identify { c in 10 .. 40 kN/m from 22 kN/m prior 20 +- 3 kN/m }\n"

    REACHES_ZERO "E0239" "mass can become zero"
    "The bounds of a mass include zero. A search that tries it finds equations without solution; a lower bound above zero costs\n\
     nothing: `m in 0.5 .. 20 kg from 5 kg`.\n"

    RECURSIVE_MODEL "E0241" "model contains itself"
    "A model may use other models as parts, but not itself, neither directly nor through others. What repeats is a family:\n\
     \n    for i in 1 .. 4 { part link[i]: segment at node[i] }\n"

    PORTS "E0242" "ports of a model"
    "The places behind `at` bind the ports of the model in their order, one each, and each of the declared kind: `point` takes a\n\
     body, a point of a body or `ground`; `body` a body or `ground`; `joint`, `force` and `signal` elements of that sort.\n\
     \n    model corner(carrier: point) { .. }\n    part left: corner at chassis.left { .. }\n"

    FAMILY_RANGE "E0243" "range of a family"
    "A family runs over whole numbers from the smaller to the larger, both included, that are known before the simulation:\n\
     numbers, constants, arguments of the model. Its size is limited.\n\
     \n    for i in 1 .. count { body wheel[i] { mass = 40 kg } }\n"

    INDEX "E0244" "index of a name"
    "An index is a whole number, made of numbers, loop variables and constants by + - * /: `wheel[i+1]`. A unit in brackets is\n\
     set apart by a blank: `measure z [mm]`.\n"

    FAMILY_NAME "E0245" "members of a family share a name"
    "What a family declares bears its variable, so that every member has a name of its own: `body wheel[i] { .. }`. Within the\n\
     family, `wheel[i]` is this member, `wheel[i+1]` the next one.\n"

    NOT_REPEATABLE "E0246" "cannot be repeated"
    "Models and families contain what can stand in a machine several times: bodies, joints, forces, signals, constants, measures,\n\
     groups, criteria, parts, families, identified parameters; families also inputs, experiments and manoeuvres, each with the\n\
     index in its name. Variants, laws and the like stand outside, and what a model is fed with comes in by its ports.\n\
     \n\
     \x20   model corner(carrier: point, command: signal) { .. }\n\
     \x20   input u [mm]\n\
     \x20   part left: corner at chassis.left, u\n"

    OUTSIDE_OF_MODEL "E0247" "not known in the model"
    "A model sees its own declarations, its ports and parameters, `ground`, `t`, `pi` and the constants of the study. Everything\n\
     else is handed in where the model is used, so that it can be used several times:\n\
     \n    model strut(upper: point, lower: point) { param stiffness: stiffness  force spring: .. }\n\
     \n    part front: strut at chassis.front, axle { stiffness = c_front }\n"

    DOTTED_NAME "E0248" "name with a dot"
    "Dots lead from a part to what it contains: `front.spring`. A declaration may bear such a name only where it adds to a part\n\
     of the study, as variants do: `add force front.stop: end_stop ..`.\n"

    TOO_LARGE "E0249" "study too large"
    "Models and families make more declarations than can be treated.\n\
     Reduce the limits of `for i in 1 .. n`; a long flexible part is better an elastic body than a chain of rigid ones.\n"

    TABLE_POINTS "E0251" "points of a table"
    "A table has at least two points with one argument and one value each, the arguments growing from point to point. A bare\n\
     number takes the unit of the first point that has one:\n\
     \n    points = ((-0.5 m/s, 2.1 kN), (0, 0), (0.5, -1.2))\n"

    TABLE_FILE "E0252" "file of a table"
    "The file of a table has a head with the names and units of two columns, the argument first, and below it one point per\n\
     line. Further columns are refused: it is not guessed which one is meant.\n\
     \n    v [m/s],F [kN]\n    -0.5,2.1\n    0,0\n"

    TABLE_FORM "E0253" "form of a table"
    "A table is a function of one argument, or of two over a grid. It says how it goes between its points and beyond them:\n\
     \n    table curve(v: rate) -> load {\n      points = ((-1 m/s, 3 kN), (1 m/s, -2 kN))\n      interpolation = monotone\n\
     \x20     extrapolation = linear\n    }\n\
     \n`linear`: straight lines; `monotone`: smooth and without overshoot; `cubic`: smooth, for curves without corners. Beyond the\n\
     points: `constant`, `linear` with the slope at the end, or `error`.\n"

    SAME_DATA "E0257" "held-out data are not held out"
    "An experiment of the role `validation` or `test` judges the model on data that the fit has not seen. It shares its samples with\n\
     an experiment of another role; give it another record, or `window`s that do not overlap:\n\
     \n    experiment fit_1 estimation { data = \"a.csv\", window = 0 s .. 10 s, start = rest }\n\
     \x20   experiment check_1 validation { data = \"a.csv\", window = 10 s .. 20 s, start = rest }\n"

    MODE_FILE "E0260" "file of modes"
    "An elastic body takes its modes from a CSV file: one head line with the columns and their units, then one line per mode.\n\
     Needed are `frequency [Hz]`, the integrals of the shape over the mass `participation_x [kg]` .. `_z` and `moment_x [kg*m]` .. `_z`,\n\
     `damping [1]` unless the body says `damping_ratio`, and per frame six columns. All for a modal mass of 1 kg:\n\
     \n\
     \x20   mode,frequency [Hz],damping [1],participation_x [kg],..,moment_z [kg*m],tip.shift_x,..,tip.turn_z [rad/m]\n\
     \x20   1,12.5,0.01,0,..,0.3,0,..,2.1\n"

    MODE_FRAME "E0261" "frame without mode shapes"
    "What stands on an elastic body moves with its modes. For every point of the body that a joint, a force or a measure uses, the\n\
     file of modes has the columns `tip.shift_x`, `tip.shift_y`, `tip.shift_z`, `tip.turn_x [rad/m]`, `tip.turn_y [rad/m]`, `tip.turn_z [rad/m]`\n\
     (zeros where a mode does not move it). The body by itself (`beam`) is the undeformed frame in which the modes are given.\n"

    EVENT_CONDITION "E0258" "condition of an event"
    "An event happens at the instant at which its condition becomes true, found as the zero of a function. That needs\n\
     comparisons of quantities that change, joined by `and` and `or`.\n\
     Write the comparison itself: `when x < 0 mm and v < 0 m/s { .. }`.\n"

    EVENT_PERIOD "E0259" "period of an event"
    "`every PERIOD { .. }` acts at all multiples of a time that is known before the simulation: a positive number with a\n\
     unit of time. It can neither be identified nor change.\n\
     Write `every 1 ms { .. }`, or bind the law's parameter to a number.\n"

    NOMINAL_SIZE "E0265" "nominal size of a state"
    "`nominal` says how large a state usually is; near zero its error is measured by that. Without it the size follows from the\n\
     unit, which is far off for concentrations of 1e-20 or pressures of 1e7 in SI units. It is known before the simulation: a\n\
     positive number of the state's dimension, neither identified nor changing.\n\
     Write `state z: ratio from 0 nominal 1e-20 { .. }`.\n"

    EVENT_TARGET "E0262" "not changed by events"
    "An event changes states of its own law, and at a joint or force element the rate `v` (by an impulse along the element).\n\
     Positions follow from rates; ports and parameters are given from outside.\n\
     Declare a state and change that: `state z: coordinate from 0 m`, `when x < 0 m { z := x }`.\n"

    COUPLING "E0263" "coupling of other things than positions or rates"
    "A coupling is an equation between positions that holds at all times: positions of joints and points, elongations, modes, numbers,\n\
     parameters, inputs and the time. Or it is one between their rates, each with a factor that depends on positions at most:\n\
     rolling without slip. What follows from loads or states of laws is no part of it - slip, friction and elasticity are force\n\
     elements - and where nothing moves there is nothing to couple.\n\
     \n\
     \x20   coupling gears: motor.position = 4.5 * wheel.position\n\
     \x20   coupling spindle: carriage.position = 5 mm / (2 * pi) * screw.position\n\
     \x20   coupling rolling: wheel.velocity.x = radius * axle.velocity\n"

    // ---- E03xx: mechanics ----

    UNCONNECTED_BODY "E0301" "body is not connected to ground"
    "Every body needs a chain of joints that leads to `ground`; otherwise its motion has no coordinates. A body that may move\n\
     along one axis only needs `joint guide: prismatic(z) ground -> body`.\n"

    CLOSED_LOOP "E0302" "joint cannot close its loop"
    "Joints form loops; the tool lets all but one of them carry bodies and turns the last into constraints. Joints whose motion is\n\
     prescribed and those that shift between two turns are kept, then those that carry force elements, then those with the least\n\
     freedom; among equals the last one declared closes the loop. A joint that shifts between two turns cannot be the one that\n\
     closes, nor can a force element stand on an axis whose coordinate the positions of the bodies do not tell.\n\
     List the shifts of such a joint before its turns, or let the element act between the bodies:\n\
     \n\
     \x20   joint slot: axes(shift x, turn z, turn y) arm.tip -> slider\n"

    NO_INERTIA "E0303" "joint moves no inertia"
    "The acceleration of a coordinate is its load divided by the inertia that moves with it. A joint whose outer bodies have no\n\
     mass (prismatic) or no moment of inertia about its axis (revolute) has no determined acceleration.\n\
     Give the outer body `mass = .. kg` (and `inertia`), or weld it with a `fixed` joint.\n"

    COINCIDENT_POINTS "E0304" "force element without direction"
    "A force element between two points acts along the line that joins them. Points that coincide in the reference configuration\n\
     have no such line: name a direction with `along z`, or choose points that are apart.\n"

    ACCELERATION_IN_LOAD "E0305" "load depends on an acceleration"
    "Accelerations follow from the loads, so that a load may not depend on one directly. What is accelerated is mass or inertia\n\
     of a body; a controller that feeds back a measured acceleration sees it through a sensor, a law with a state.\n\
     \n\
     \x20   measure a [m/s^2] = guide.acceleration { lag = 1 ms }\n"

    UNKNOWN_START "E0306" "start value is not determined"
    "A start value may depend on parameters, inputs, and states whose own start value is given; not on itself, and not on a state\n\
     that follows from equilibrium.\n\
     \n\
     \x20   start = rest { slide.velocity = 6 mm/s, strut.z = 0 mm }\n"

    UNKNOWN_QUANTITY "E0307" "quantity that nothing defines"
    "An expression mentions a quantity that is neither the time, a state, a parameter, nor the motion of an element of the study.\n\
     Declare it, or correct its name: `guide.position`, `tyre.force`.\n"

    FORCE_ON_FIXED_JOINT "E0308" "force on a joint that cannot move"
    "A force element on a joint acts along or about the joint's axis. A fixed joint has none.\n\
     Let it stand on a joint that moves, or between two bodies: `force f: spring a -> b { .. }`.\n"

    REDUNDANT_CONSTRAINT "E0309" "constraint holds what others hold already"
    "A closed loop of revolute joints in space is held several times over: in a planar four-bar linkage each joint keeps the bodies in\n\
     their plane. The motion is not affected, but the reactions in these directions cannot be determined by mechanics of rigid\n\
     bodies (in the real machine they depend on clearances and flexibility). The tool drops such constraints, says so, and names the\n\
     joint that would do without them.\n\
     Nothing has to be done unless reactions are wanted; then use `spherical` or `cylindrical` joints where the machine has play.\n"

    CANNOT_MOVE "E0310" "mechanism cannot move"
    "The loops take away as many freedoms as the joints give. Count: every body has six, a joint takes those it does not leave free.\n\
     Remove a joint, or exchange one for a kind with more freedom (`spherical` for `revolute`).\n"

    CANNOT_ASSEMBLE "E0311" "loop cannot be assembled"
    "Near the start no position of the bodies closes all loops. Either a length is wrong (the sides of a four-bar that is too long to\n\
     reach), or the start is too far away: give the joints' positions in `start`.\n"

    MODE_NORMALISATION "E0313" "modes are too large"
    "Modes are scaled so that each has a modal mass of 1 kg: the integral of the squared shape over the mass. Then the part of the\n\
     mass that a mode can take along, `participation^2 / 1 kg`, is never more than the body's mass, likewise for its moments of\n\
     inertia, and all modes together take no more than there is. Otherwise no body has these modes: the shapes are scaled otherwise\n\
     (to a largest deflection of 1, or for other units), or `mass` and `inertia` of the body do not belong to them.\n\
     Divide every shape by the root of its modal mass in kg.\n"

    MOTIONS_CONTRADICT "E0314" "prescribed motions contradict each other"
    "Every prescribed motion takes one freedom of the mechanism. Where loops hold it already - two driven cranks of one four-bar\n\
     linkage - the motions would have to fit each other exactly, which no joint without play does.\n\
     Prescribe only as many motions as the mechanism has freedoms, or let one of them act through an elastic element:\n\
     \n\
     \x20   joint drive: revolute(y) ground -> crank { motion = 2 rad/s * t }\n\
     \x20   force servo: spring_damper on rocker_hinge { stiffness = 20 kN*m/rad, damping = 100 N*m*s/rad }\n"

    SEVERAL_POSITIONS "E0315" "loops that can be assembled in several ways"
    "A four-bar linkage stands elbow up or elbow down. Where the drawn position (all coordinates zero) or the start is near one of\n\
     them, that one is meant. Here it is far from both, so that the tool had to choose, and says so.\n\
     Give the coordinate of one of the joints roughly; it is moved to where the loops close:\n\
     \n\
     \x20   start = rest { elbow.position = 70 deg }\n"

    IMPACT_IN_LOOP "E0312" "impulse without effect"
    "An event that changes the rate of a force element does so by an impulse, which changes all velocities that it reaches; closing\n\
     joints answer with impulses of their own. Here they and the prescribed motions determine the rate of the element: nothing\n\
     can change it.\n\
     Let the drive yield: `joint motor: revolute(y) ground -> crank` with a spring `force servo: spring_damper on motor { .. }`\n\
     instead of `motion = ..`, or model the contact as a stiff spring with damping.\n"

    ELASTIC_TURNS_FAST "E0316" "elastic body turns fast"
    "Modes describe small deformations of a body at rest. In a body that turns, centrifugal forces pull it straight and make it\n\
     stiffer (a rotor blade) or bend it further and make it softer; both grow with the square of the speed and are left out here.\n\
     At a fifth of the lowest circular frequency they change the stiffness by some percent.\n\
     Build such a body from several rigid ones with bending springs, which knows all of this, or simulate slower runs:\n\
     \n\
     \x20   for i in 1 .. 16 { joint bend[i]: revolute(z) link[i].tip -> link[i + 1] }\n\
     \x20   for i in 1 .. 16 { force bending[i]: spring on bend[i] { stiffness = 320 N*m/rad } }\n"

    LOOP_BRANCHES "E0317" "loop could go on in two ways"
    "A parallelogram that stretches out flat can leave that position as a parallelogram or crossed, a crank as long as its rod can\n\
     turn on or stay on its other side: the constraints of the loop depend on each other there, and hold nothing back. The simulation\n\
     passes the position with the speed that it has; the machine may do otherwise. At the start itself nothing but the start values\n\
     of the other joints decides.\n\
     Let the model decide as the machine does:\n\
     \n\
     \x20   coupling same: crank_1.position = crank_2.position\n"

    START_MOVED "E0318" "start that the loops do not allow"
    "A start may state more coordinates than a mechanism has freedoms, to say which way it stands: the first ones are kept, the others are\n\
     moved to where the loops close. Here one is moved far, or a velocity is another one: the loops do not allow both, or hold this\n\
     coordinate altogether.\n\
     State as many coordinates as `ident check` counts freedoms, and those that matter first:\n\
     \n\
     \x20   start = rest { crank.position = 10 deg, crank.velocity = 20 rad/s }\n"

    // ---- E04xx: data files and signals ----

    DATA_FILE_UNREADABLE "E0401" "data file cannot be read"
    "The measured data are CSV text: one head line with `name [unit]` per column, then one line per sample. The file is\n\
     missing, may not be read, or is no text. Paths are relative to the study's file, or to `--data DIR`.\n"

    DATA_EMPTY "E0402" "data file without samples"
    "The file holds no head line or no line of numbers below it.\n\
     \n\
     \x20   t [s],u [mm],z [mm]\n\
     \x20   0.000,0.0,1.2\n\
     \x20   0.001,0.1,1.2\n"

    DATA_NOT_A_NUMBER "E0403" "cell is not a number"
    "Every cell of a used column must hold a number, with decimal point, or decimal comma where columns are separated by\n\
     semicolons or tabs. No value is made up for an empty or unreadable cell: mend or cut the record.\n\
     Write `1.5` or `1.5e-3`, without unit and without separators of thousands.\n"

    DATA_NOT_FINITE "E0404" "sample is NaN or infinite"
    "A used column holds `NaN` or an infinite value. Samples are never skipped or replaced: mend the record, or choose a\n\
     `window` without the gap and cut the file there.\n"

    DATA_COLUMN_MISSING "E0405" "column is missing"
    "The experiment needs a column that the data file does not have. Columns are found by the name of the input or measure,\n\
     or by the experiment's `columns = { name = \"head in the file\" }`.\n"

    DATA_TIME_ORDER "E0406" "time does not increase"
    "The time column must grow from line to line. Repeated or backward stamps mean lost or doubled lines, or two records\n\
     written into one file.\n\
     Remove doubled lines; write joined records as separate files with an `experiment` each.\n"

    DATA_NOT_UNIFORM "E0407" "samples are not equidistant"
    "Filters and spectra need equidistant samples. Small jitter of the stamps (5 % of a step) is accepted; a gap or a\n\
     changing rate is not: resample the record, or cut it at the gap.\n\
     Cut at the gap by `window = 0 s .. 12 s`.\n"

    DATA_CONSTANT "E0408" "channel is constant"
    "A measured channel that never changes holds no information to compare with: a dead sensor, a wrong column, or a\n\
     window in which nothing happens.\n\
     Choose the column by `columns = { z = \"other head\" }`, or leave the channel out by `measures = { .. }`.\n"

    DATA_TOO_SHORT "E0409" "too few samples"
    "The record, or the part of it inside the `window`, has too few samples for what is asked of it.\n"

    DATA_UNIT "E0410" "unit of a column does not fit"
    "The head of a column names its unit: `force [kN]`. It is converted to the unit of the study; it must measure the same\n\
     kind of quantity, and it must be there unless the quantity is dimensionless.\n"

    DATA_LAYOUT "E0411" "table is not rectangular or its head is unclear"
    "Every line needs as many cells as the head has columns, and every head its own name.\n\
     Mend the line, or give doubled heads different names: `acc_1 [m/s^2],acc_2 [m/s^2]`.\n"

    FILTER_IMPOSSIBLE "E0412" "filter cannot be designed"
    "A low-pass is given by its pass edge, stop edge and the attenuations there: pass below stop, stop below half the\n\
     sampling rate, pass-band drop below stop-band attenuation.\n\
     Write e.g. `pass 5 Hz (2 dB) stop 7 Hz (20 dB)` for a record at 100 Hz.\n"

    // ---- E05xx: simulation ----

    NO_ESTIMATION_RECORD "E0501" "no record to fit"
    "Parameters are fitted to experiments of the role `estimation`; the study has none. Give an experiment that role, or\n\
     declare one.\n"

    SIMULATION_FAILED "E0502" "simulation failed"
    "The integration could not go on. The message names the time, the cause and the state to blame; typical causes are a\n\
     start value far from reality, a law that jumps, a wrong sign, or a motion without equilibrium.\n\
     `ident simulate --set \"c=20\"` tries other values; `start = equilibrium` begins at rest under load.\n"

    // ---- E06xx: fit and diagnosis ----

    NO_INFLUENCE "E0602" "parameter without influence"
    "No path leads from the parameter to any measured channel, so that no data can determine it. Measure something that\n\
     depends on it, or hold it fixed.\n\
     Add a `measure` that sees it, or replace its name by a number.\n"

    FIT_FAILED "E0601" "fit cannot begin"
    "The model cannot be simulated at the start values of the parameters, or the bounds contradict each other. The message\n\
     names the first simulation that failed.\n\
     Try `ident simulate` at the start values first; move `from ..` nearer to the real value.\n"

    // ---- E07xx: command line ----

    CANNOT_READ_FILE "E0701" "file cannot be read"
    "The file does not exist, may not be read, or is not UTF-8 text. The message names the reason given by the system.\n\
     Paths in `use \"part.ident\"` are relative to the file that contains them.\n"
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
