//! From equations to programs.

use super::events::{Change, Events, When};
use super::expansion::Expansion;
use super::kernels::LANES;
use super::kinks::{Kinks, comparisons};
use super::model::{Derivative, DerivativeForm, Element, Layout, Model, Sources, StartProgram};
use super::program::{Line, Program};
use super::sweep::Sweep;
use crate::expression::{Binary, Entry, Graph, Node, Operation, Symbol};
use crate::linear::SparsityPattern;
use crate::mechanics::{StartEquation, System, Variable};
use crate::study::EventTrigger;
use std::collections::HashMap;

impl Model {
    /// Compiles a system. Symbols that are neither time, variable nor parameter evaluate to NaN.
    pub fn compile(system: &System) -> Model {
        Self::compile_with(system, DerivativeForm::Automatic)
    }

    /// As [`Model::compile`] with derivatives in the form asked for.
    pub fn compile_with(system: &System, form: DerivativeForm) -> Model {
        let variables: Vec<Variable> = system.states.iter().chain(&system.algebraic).cloned().collect();
        let (n, state_count, p) = (variables.len(), system.states.len(), system.parameters.len());
        let mut roots = Roots::of(system);
        let unknowns: Vec<Symbol> = variables.iter().map(|variable| variable.symbol).collect();
        let size = roots.graph.reachable(&[&roots.rates[..], &roots.outputs].concat()).len();
        let by_sweep = match form {
            DerivativeForm::Automatic => size * (n + p) > SYMBOLIC_LIMIT,
            DerivativeForm::Symbolic => false,
            DerivativeForm::Swept => true,
        };
        let mut symbolic = |of: &[Node], by: &[Symbol]| {
            if by_sweep { Vec::new() } else { roots.graph.jacobian(of, by) }
        };
        let jacobian = symbolic(&roots.rates, &unknowns);
        let parameter_derivative = symbolic(&roots.rates, &system.parameters);
        let output_by_state = symbolic(&roots.outputs, &unknowns);
        let output_by_parameter = symbolic(&roots.outputs, &system.parameters);
        let mut event_columns = [&unknowns[..], &system.parameters].concat();
        event_columns.push(system.time);
        let event_derivative = symbolic(&roots.events, &event_columns);
        let start_derivatives: Vec<Vec<Entry>> =
            roots.starts.iter().map(|values| roots.graph.jacobian(values, &system.parameters)).collect();

        let nodes_of = |entries: &[Entry]| entries.iter().map(|entry| entry.value).collect::<Vec<_>>();
        let output_derivatives: Vec<Node> = [nodes_of(&output_by_state), nodes_of(&output_by_parameter)].concat();
        let mut everything = [&roots.rates[..], &roots.outputs, &roots.probes, &output_derivatives].concat();
        everything.extend(nodes_of(&jacobian));
        everything.extend(&roots.events);
        everything.extend(roots.comparisons.iter().map(|(_, difference)| difference));
        everything.extend(nodes_of(&event_derivative));
        everything.extend(nodes_of(&parameter_derivative));
        everything.extend(roots.starts.iter().flatten());
        everything.extend(start_derivatives.iter().flat_map(|entries| nodes_of(entries)));

        let mut assembler = Assembler::new(&roots.graph, system, &unknowns, &everything);
        let mut prologue = assembler.program(&everything, Dependence::Parameters);
        let after_prologue = assembler.registers.clone();
        let forcing = assembler.program(&roots.rates, Dependence::Time);
        let rates = assembler.program(&roots.rates, Dependence::State);
        let rate_registers = assembler.registers_of(&roots.rates);
        prologue.extend(assembler.take_copies());
        let after_rates = assembler.registers.clone();

        let variable_columns: Vec<u32> = (0..n).map(|i| (assembler.layout.variables + i) as u32).collect();
        let parameter_columns: Vec<u32> = (0..p).map(|i| (assembler.layout.parameters + i) as u32).collect();
        let rate_programs = [&prologue, &forcing, &rates];
        let mut jacobian = if by_sweep {
            assembler.swept(&rate_programs, &variable_columns, &rate_registers)
        } else {
            let program = assembler.program(&nodes_of(&jacobian), Dependence::State);
            assembler.derivative(program, &jacobian)
        };
        let (pattern, diagonal) = iteration_pattern(n, state_count, &jacobian.elements);
        jacobian.place(|row, column| slot_in(&pattern, row, column));
        let jacobian_sources = Sources::new(&jacobian.elements, pattern.len(), state_count);
        let places = (&variable_columns[..], &rate_registers[..]);
        let sizes = (state_count, jacobian.elements.len());
        let expanded = |sweep| Expansion::new(sweep, assembler.next, places, sizes);
        let expansion = jacobian.sweep.as_ref().map(expanded);

        assembler.registers.clone_from(&after_rates);
        let mut parameter_derivative = if by_sweep {
            assembler.swept(&rate_programs, &parameter_columns, &rate_registers)
        } else {
            let program = assembler.program(&nodes_of(&parameter_derivative), Dependence::State);
            assembler.derivative(program, &parameter_derivative)
        };
        let places: Vec<(usize, usize)> =
            parameter_derivative.elements.iter().map(|entry| (entry.row as usize, entry.column as usize)).collect();
        let parameter_pattern = SparsityPattern::from_entries(n, p, &places);
        parameter_derivative.place(|row, column| slot_in(&parameter_pattern, row, column));
        let parameter_sources = Sources::new(&parameter_derivative.elements, parameter_pattern.len(), state_count);
        let dense = |rows: usize| move |row: usize, column: usize| column * rows + row;

        assembler.registers.clone_from(&after_prologue);
        let outputs = assembler.program(&roots.outputs, Dependence::State);
        let output_registers = assembler.registers_of(&roots.outputs);
        let m = roots.outputs.len();
        prologue.extend(assembler.take_copies());
        let output_programs = [&prologue, &outputs];
        let (mut output_by_state, mut output_by_parameter) = if by_sweep {
            let by_state = assembler.swept(&output_programs, &variable_columns, &output_registers);
            (by_state, assembler.swept(&output_programs, &parameter_columns, &output_registers))
        } else {
            let program = assembler.program(&output_derivatives, Dependence::State);
            let by_state = assembler.derivative(program, &output_by_state);
            (by_state, assembler.derivative(Program::default(), &output_by_parameter))
        };
        output_by_state.place(dense(m));
        output_by_parameter.place(dense(m));

        assembler.registers.clone_from(&after_rates);
        let program = assembler.program(&roots.events, Dependence::State);
        let registers = assembler.registers_of(&roots.events);
        let derivative = if by_sweep && !registers.is_empty() {
            let time = [assembler.layout.time as u32];
            let columns = [&variable_columns[..], &parameter_columns, &time].concat();
            assembler.swept(&[&prologue, &forcing, &rates, &program], &columns, &registers)
        } else {
            let program = assembler.program(&nodes_of(&event_derivative), Dependence::State);
            assembler.derivative(program, &event_derivative)
        };
        let events = events(system, program, registers, derivative);
        let kinks = assembler.kinks(&roots.comparisons, (&after_rates, &after_prologue), &rates);

        assembler.registers.clone_from(&after_rates);
        let probes = assembler.program(&roots.probes, Dependence::State);
        let probe_registers = assembler.registers_of(&roots.probes);

        let starts = (system.starts.iter().zip(&roots.starts).zip(&start_derivatives))
            .map(|((equations, values), entries)| {
                assembler.registers.clone_from(&after_prologue);
                assembler.start(equations, values, entries, state_count)
            })
            .collect();

        prologue.extend(assembler.take_copies());
        let constant_end = assembler.constants.len();
        let mut registers = assembler.constants;
        // Kernels read whole blocks: the last may reach beyond the last register.
        registers.resize(assembler.next + LANES, 0.0);
        debug_assert_eq!(p, system.parameter_names.len());
        Model {
            curves: system.graph.curves().to_vec(),
            state_count,
            constraint_names: system.constraint_names.clone(),
            parameter_names: system.parameter_names.clone(),
            output_names: system.outputs.iter().map(|output| output.name.clone()).collect(),
            probe_names: system.probes.iter().map(|probe| probe.name.clone()).collect(),
            differential: (0..n).map(|i| i < state_count).collect(),
            scale: variables.iter().map(|variable| variable.scale).collect(),
            variables,
            registers,
            layout: assembler.layout,
            constant_end,
            prologue,
            forcing,
            rates,
            rate_registers,
            kinks,
            jacobian,
            jacobian_sources,
            pattern,
            expansion,
            diagonal,
            parameter_derivative,
            parameter_pattern,
            parameter_sources,
            outputs,
            output_registers,
            output_by_state,
            output_by_parameter,
            events,
            probes,
            probe_registers,
            starts,
        }
    }
}

/// The expressions to compile, in a graph with nothing else.
struct Roots {
    graph: Graph,
    /// Rates, then constraints.
    rates: Vec<Node>,
    outputs: Vec<Node>,
    probes: Vec<Node>,
    /// Conditions and new values, event by event.
    events: Vec<Node>,
    /// Of the rates, each with the difference of its sides.
    comparisons: Vec<(Node, Node)>,
    /// Per experiment: the given start values, in state order.
    starts: Vec<Vec<Node>>,
}

impl Roots {
    fn of(system: &System) -> Self {
        let rates = system.rates.iter().chain(&system.constraints).copied();
        let values = |outputs: &[crate::mechanics::Output]| outputs.iter().map(|o| o.value).collect::<Vec<_>>();
        let given = |equations: &Vec<StartEquation>| {
            let value = |equation: &StartEquation| match equation {
                StartEquation::Value(node) => Some(*node),
                StartEquation::Equilibrium => None,
            };
            equations.iter().filter_map(value).collect::<Vec<_>>()
        };
        let events = system.events.iter().flat_map(|event| event.nodes()).collect();
        let mut groups = vec![rates.collect::<Vec<_>>(), values(&system.outputs), values(&system.probes), events];
        groups.extend(system.starts.iter().map(given));
        let (mut graph, nodes) = system.graph.extract(&groups.concat());
        let nodes = multiply_by_reciprocals(&mut graph, &nodes, &system.parameters);
        let nodes = balance_sums(&mut graph, &nodes);
        let mut rest = nodes.into_iter();
        let mut groups = groups.iter().map(|group| rest.by_ref().take(group.len()).collect::<Vec<_>>());
        let mut next = || groups.next().unwrap_or_default();
        let (rates, outputs, probes, events) = (next(), next(), next(), next());
        let starts = groups.collect();
        let comparisons = comparisons(&mut graph, &rates);
        Self { graph, rates, outputs, probes, events, comparisons, starts }
    }
}

/// The layout of events whose conditions and new values stand in rows in the order of
/// [`crate::mechanics::Event::nodes`].
fn events(system: &System, program: Program, registers: Vec<u32>, derivative: Derivative) -> Events {
    let mut events = Events { program, registers, derivative, ..Events::default() };
    let mut rows = 0_u32..;
    for event in &system.events {
        let condition = match event.trigger {
            EventTrigger::Rises(_) => rows.next(),
            EventTrigger::Every(_) => None,
        };
        let changes: Vec<Change> =
            event.changes.iter().zip(&mut rows).map(|(&(state, _), row)| Change { state: state as u32, row }).collect();
        match (event.trigger, condition) {
            (EventTrigger::Every(period), _) => {
                events.clocks.push(changes);
                events.periods.push(period);
            }
            (EventTrigger::Rises(_), condition) => {
                events.whens.push(When { condition: condition.unwrap_or_default(), changes });
            }
        }
    }
    events
}

/// Divisions of varying values by what only parameters determine, as multiplications: the reciprocal is computed once
/// per parameter vector. Changes results by rounding.
fn multiply_by_reciprocals(graph: &mut Graph, roots: &[Node], parameters: &[Symbol]) -> Vec<Node> {
    let mut image: Vec<Node> = Vec::new();
    let mut is_fixed: Vec<bool> = Vec::new();
    let zero = graph.constant(0.0);
    let one = graph.constant(1.0);
    for node in graph.reachable(roots) {
        image.resize(node.index() + 1, zero);
        is_fixed.resize(node.index() + 1, false);
        let operation = graph.operation(node);
        let fixed = |child: Node| is_fixed[child.index()];
        let is_node_fixed = match operation {
            Operation::Constant(_) => true,
            Operation::Symbol(symbol) => parameters.contains(&symbol),
            Operation::Sample { .. } => false,
            _ => operation.children().all(fixed),
        };
        image[node.index()] = match operation {
            Operation::Binary(Binary::Divide, a, b) if fixed(b) && !fixed(a) => {
                let inverse = graph.divide(one, image[b.index()]);
                graph.multiply(image[a.index()], inverse)
            }
            _ => graph.rebuild(operation, |child| image[child.index()]),
        };
        is_fixed[node.index()] = is_node_fixed;
    }
    roots.iter().map(|root| image[root.index()]).collect()
}

/// Sums of many terms as trees instead of chains: their additions no longer wait for each other. Changes results by
/// rounding.
fn balance_sums(graph: &mut Graph, roots: &[Node]) -> Vec<Node> {
    let nodes = graph.reachable(roots);
    let mut uses = vec![0_u32; graph.len()];
    let is_sum = |operation| matches!(operation, Operation::Binary(Binary::Add | Binary::Subtract, ..));
    let mut in_sum = vec![false; graph.len()];
    for &node in &nodes {
        let operation = graph.operation(node);
        for child in operation.children() {
            uses[child.index()] += 1;
            in_sum[child.index()] |= is_sum(operation);
        }
    }
    roots.iter().for_each(|root| uses[root.index()] += 1);
    let belongs: Vec<bool> = uses.iter().zip(&in_sum).map(|(uses, in_sum)| *uses == 1 && *in_sum).collect();
    let mut image = vec![graph.constant(0.0); graph.len()];
    for node in nodes {
        let operation = graph.operation(node);
        if is_sum(operation) && belongs[node.index()] {
            continue;
        }
        image[node.index()] = if is_sum(operation) {
            let mut terms = [Vec::new(), Vec::new()];
            let mut open = vec![(node, false)];
            while let Some((node, negative)) = open.pop() {
                match graph.operation(node) {
                    Operation::Binary(sign @ (Binary::Add | Binary::Subtract), a, b) => {
                        for (child, negative) in [(b, negative ^ (sign == Binary::Subtract)), (a, negative)] {
                            let is_inner = belongs[child.index()] && is_sum(graph.operation(child));
                            if is_inner {
                                open.push((child, negative));
                            } else {
                                terms[usize::from(negative)].push(image[child.index()]);
                            }
                        }
                    }
                    _ => terms[usize::from(negative)].push(image[node.index()]),
                }
            }
            let [positive, negative] = terms.map(|terms| balanced_sum(graph, terms));
            match (positive, negative) {
                (Some(positive), Some(negative)) => graph.subtract(positive, negative),
                (Some(sum), None) => sum,
                (None, Some(negative)) => graph.negate(negative),
                (None, None) => graph.constant(0.0),
            }
        } else {
            graph.rebuild(operation, |child| image[child.index()])
        };
    }
    roots.iter().map(|root| image[root.index()]).collect()
}

fn balanced_sum(graph: &mut Graph, mut terms: Vec<Node>) -> Option<Node> {
    while terms.len() > 1 {
        terms = terms.chunks(2).map(|pair| if let [a, b] = *pair { graph.add(a, b) } else { pair[0] }).collect();
    }
    terms.pop()
}

/// What a node's value depends on at most.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Dependence {
    Parameters,
    Time,
    State,
}

/// Symbolic derivatives grow with the number of columns times the length of the program; from this product on,
/// derivatives are swept through the linearised program instead: slower to evaluate, but compiled in an instant.
const SYMBOLIC_LIMIT: usize = 400_000;

const UNASSIGNED: u32 = u32::MAX;

/// Assigns registers to nodes while programs are written.
pub(super) struct Assembler<'a> {
    pub(super) graph: &'a Graph,
    pub(super) dependence: Vec<Dependence>,
    /// Register per node of the graph, `UNASSIGNED` where not computed yet.
    pub(super) registers: Vec<u32>,
    pub(super) next: usize,
    /// Copies of what only parameters determine.
    pub(super) copies: Vec<Vec<Line>>,
    layout: Layout,
    /// Initial content of the first registers.
    constants: Vec<f64>,
}

impl<'a> Assembler<'a> {
    /// Places constants, parameters, time and variables in the first registers.
    fn new(graph: &'a Graph, system: &System, unknowns: &[Symbol], everything: &[Node]) -> Self {
        let p = system.parameters.len();
        let layout = Layout { parameters: 0, time: p, variables: p + 1 };
        let mut place: HashMap<Symbol, (usize, Dependence)> = HashMap::new();
        place.extend(system.parameters.iter().enumerate().map(|(i, &s)| (s, (i, Dependence::Parameters))));
        place.insert(system.time, (layout.time, Dependence::Time));
        place.extend(unknowns.iter().enumerate().map(|(i, &s)| (s, (layout.variables + i, Dependence::State))));
        let mut assembler = Self {
            graph,
            dependence: vec![Dependence::Parameters; graph.len()],
            registers: vec![UNASSIGNED; graph.len()],
            next: 0,
            copies: Vec::new(),
            layout,
            constants: vec![0.0; layout.variables + unknowns.len()],
        };
        for node in graph.reachable(everything) {
            let (register, dependence) = match graph.operation(node) {
                Operation::Constant(bits) => assembler.constant(f64::from_bits(bits)),
                Operation::Symbol(symbol) => match place.get(&symbol) {
                    Some(&(register, dependence)) => (register as u32, dependence),
                    None => assembler.constant(f64::NAN),
                },
                operation => {
                    let children = operation.children().map(|child| assembler.dependence[child.index()]);
                    let own = if matches!(operation, Operation::Sample { .. }) {
                        Dependence::Time
                    } else {
                        Dependence::Parameters
                    };
                    (UNASSIGNED, children.fold(own, Dependence::max))
                }
            };
            assembler.registers[node.index()] = register;
            assembler.dependence[node.index()] = dependence;
        }
        assembler.next = assembler.constants.len();
        assembler
    }

    fn constant(&mut self, value: f64) -> (u32, Dependence) {
        self.constants.push(value);
        (self.constants.len() as u32 - 1, Dependence::Parameters)
    }

    fn registers_of(&self, nodes: &[Node]) -> Vec<u32> {
        nodes.iter().map(|node| self.registers[node.index()]).collect()
    }

    /// A program for what `roots` need, as far as it depends on at most `limit` and is not computed yet.
    fn program(&mut self, roots: &[Node], limit: Dependence) -> Program {
        let missing: Vec<Node> = self
            .graph
            .reachable(roots)
            .into_iter()
            .filter(|node| self.registers[node.index()] == UNASSIGNED && self.dependence[node.index()] <= limit)
            .collect();
        Program::new(self.schedule(&missing, limit > Dependence::Parameters))
    }

    fn derivative(&self, program: Program, entries: &[Entry]) -> Derivative {
        let elements = entries
            .iter()
            .map(|entry| Element {
                row: entry.row as u32,
                column: entry.column as u32,
                register: self.registers[entry.value.index()],
                slot: 0,
            })
            .collect();
        Derivative { program, sweep: None, elements }
    }

    /// Comparisons that depend on variables; registers of the nodes after the rates and after the prologue.
    fn kinks(
        &mut self,
        comparisons: &[(Node, Node)],
        (after_rates, after_prologue): (&[u32], &[u32]),
        rates: &Program,
    ) -> Kinks {
        let of_variables = |(node, _): &&(Node, Node)| self.dependence[node.index()] == Dependence::State;
        let (nodes, differences): (Vec<Node>, Vec<Node>) = comparisons.iter().filter(of_variables).copied().unzip();
        self.registers.copy_from_slice(after_prologue);
        let program = self.program(&differences, Dependence::State);
        let comparisons: Vec<u32> = nodes.iter().map(|node| after_rates[node.index()]).collect();
        let held_rates = if comparisons.is_empty() { Program::default() } else { rates.without(&comparisons) };
        Kinks { program, differences: self.registers_of(&differences), held_rates, comparisons }
    }

    /// d(`rows`)/d(`columns`) through programs already assembled.
    fn swept(&mut self, programs: &[&Program], columns: &[u32], rows: &[u32]) -> Derivative {
        let count = self.next;
        let (sweep, elements) = Sweep::new(programs, count, columns, rows, &mut self.next);
        Derivative { program: Program::default(), sweep: Some(sweep), elements }
    }

    fn start(
        &mut self,
        equations: &[StartEquation],
        values: &[Node],
        entries: &[Entry],
        state_count: usize,
    ) -> StartProgram {
        let mut needed = values.to_vec();
        needed.extend(entries.iter().map(|entry| entry.value));
        let program = self.program(&needed, Dependence::Time);
        let mut given = values.iter().enumerate();
        let mut state_of_value = Vec::new();
        let mut registers = vec![None; state_count];
        for (state, equation) in equations.iter().enumerate() {
            if matches!(equation, StartEquation::Value(_))
                && let Some((_, value)) = given.next()
            {
                registers[state] = Some(self.registers[value.index()]);
                state_of_value.push(state);
            }
        }
        let in_states: Vec<Entry> =
            entries.iter().map(|entry| Entry { row: state_of_value[entry.row], ..*entry }).collect();
        let mut derivative = self.derivative(Program::default(), &in_states);
        derivative.place(|row, column| column * state_count + row);
        StartProgram { program, values: registers, elements: derivative.elements }
    }
}

/// Pattern of the iteration matrix and the slots of the differential variables' diagonal.
fn iteration_pattern(n: usize, state_count: usize, jacobian: &[Element]) -> (SparsityPattern, Vec<u32>) {
    let mut places: Vec<(usize, usize)> =
        jacobian.iter().map(|entry| (entry.row as usize, entry.column as usize)).collect();
    places.extend((0..state_count).map(|i| (i, i)));
    let pattern = SparsityPattern::from_entries(n, n, &places);
    let diagonal = (0..state_count).map(|i| slot_in(&pattern, i, i) as u32).collect();
    (pattern, diagonal)
}

/// Index of an element that the pattern contains.
fn slot_in(pattern: &SparsityPattern, row: usize, column: usize) -> usize {
    let start = pattern.starts[column];
    let rows = &pattern.rows[start..pattern.starts[column + 1]];
    start + rows.partition_point(|&other| other < row)
}
