//! Results for programs: a versioned envelope around the result types, documented in `docs/output.md`.
//!
//! The schema's text lies in `docs/schema/`; it is generated from the types and their documentation, and a test keeps
//! both equal.

use crate::analyse::{Courses, Cuts, Descents, Plan, Validity};
use crate::diagnose::Answer;
use crate::identify::Identification;
use schemars::{JsonSchema, Schema, generate::SchemaSettings, transform::Transform};
use serde::Serialize;
use serde_json::Value;

/// Name and version of the forms of output. The number grows when a field changes its meaning or disappears; new
/// fields may appear under the same number.
pub const DIAGNOSIS: &str = "ident.diagnosis/1";
pub const IDENTIFICATION: &str = "ident.identification/1";
pub const COMPARISON: &str = "ident.comparison/1";
pub const VALIDITY: &str = "ident.validity/1";
pub const PLAN: &str = "ident.plan/1";
pub const OPTIMISERS: &str = "ident.optimisers/1";
pub const CUTS: &str = "ident.cuts/1";
pub const GRADIENTS: &str = "ident.gradients/1";

/// Result of `ident diagnose`.
pub fn answer(answer: &Answer) -> Result<String, serde_json::Error> {
    envelope(DIAGNOSIS, answer)
}

/// Result of `ident fit`.
pub fn identification(identification: &Identification) -> Result<String, serde_json::Error> {
    envelope(IDENTIFICATION, identification)
}

/// Result of `ident compare`: one identification per variant.
pub fn comparison(variants: &[Identification]) -> Result<String, serde_json::Error> {
    envelope(COMPARISON, variants)
}

/// Result of `ident validate`.
pub fn validity(validity: &Validity) -> Result<String, serde_json::Error> {
    envelope(VALIDITY, validity)
}

/// Result of `ident plan`.
pub fn plan(plan: &Plan) -> Result<String, serde_json::Error> {
    envelope(PLAN, plan)
}

/// Result of `ident optimisers`.
pub fn courses(courses: &Courses) -> Result<String, serde_json::Error> {
    envelope(OPTIMISERS, courses)
}

/// Result of `ident cuts`.
pub fn cuts(cuts: &Cuts) -> Result<String, serde_json::Error> {
    envelope(CUTS, cuts)
}

/// Result of `ident gradients`.
pub fn descents(descents: &Descents) -> Result<String, serde_json::Error> {
    envelope(GRADIENTS, descents)
}

/// The JSON Schemas by name of output, ready to be written to `docs/schema/`.
pub fn schemas() -> Vec<(&'static str, Value)> {
    vec![
        (DIAGNOSIS, schema::<Answer>(DIAGNOSIS)),
        (IDENTIFICATION, schema::<Identification>(IDENTIFICATION)),
        (COMPARISON, schema::<Vec<Identification>>(COMPARISON)),
        (VALIDITY, schema::<Validity>(VALIDITY)),
        (PLAN, schema::<Plan>(PLAN)),
        (OPTIMISERS, schema::<Courses>(OPTIMISERS)),
        (CUTS, schema::<Cuts>(CUTS)),
        (GRADIENTS, schema::<Descents>(GRADIENTS)),
    ]
}

#[derive(Serialize)]
struct Envelope<'a, T: ?Sized> {
    schema: &'a str,
    tool: &'a str,
    version: &'a str,
    result: &'a T,
}

/// One line of JSON; numbers that are not finite become `null` (JSON knows none).
fn envelope<T: Serialize + ?Sized>(schema: &str, result: &T) -> Result<String, serde_json::Error> {
    let version = env!("CARGO_PKG_VERSION");
    serde_json::to_string(&Envelope { schema, tool: "ident", version, result })
}

fn schema<T: JsonSchema>(name: &'static str) -> Value {
    let settings = SchemaSettings::draft2020_12().for_serialize().with_transform(NumbersMayBeNull);
    let result = settings.into_generator().into_root_schema_for::<T>();
    let mut result = Value::from(result);
    let definitions = result.as_object_mut().and_then(|object| {
        object.remove("$schema");
        object.remove("$defs")
    });
    serde_json::json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": name,
        "type": "object",
        "properties": {
            "schema": { "const": name, "description": "Name and version of this form of output." },
            "tool": { "const": "ident" },
            "version": { "type": "string", "description": "Version of the tool that wrote this." },
            "result": result
        },
        "required": ["schema", "tool", "version", "result"],
        "additionalProperties": false,
        "$defs": definitions.unwrap_or_default()
    })
}

/// JSON has no NaN or infinity: every number may be `null`, meaning `not finite or not available`.
#[derive(Clone)]
struct NumbersMayBeNull;

impl Transform for NumbersMayBeNull {
    fn transform(&mut self, schema: &mut Schema) {
        if schema.get("type") == Some(&Value::from("number")) {
            schema.insert("type".into(), serde_json::json!(["number", "null"]));
        }
        schemars::transform::transform_subschemas(self, schema);
    }
}
