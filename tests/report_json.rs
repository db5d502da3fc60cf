//! JSON output: valid against its published schema, which is the one of the types; never an invalid number.
//!
//! `IDENT_WRITE_SCHEMAS=1` rewrites `docs/schema/` after a deliberate change of a result type.

mod synthetic;

use ident::report::json;
use serde_json::Value;

fn schema_file(name: &str) -> std::path::PathBuf {
    let file = format!("{}.schema.json", name.replace('/', "-"));
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/schema").join(file)
}

fn published(name: &str) -> Value {
    let path = schema_file(name);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).unwrap()
}

fn errors(name: &str, output: &Value) -> Vec<String> {
    let validator = jsonschema::validator_for(&published(name)).unwrap();
    validator.iter_errors(output).map(|error| format!("{}: {error}", error.instance_path())).collect()
}

#[test]
fn published_schemas_are_those_of_the_types() {
    for (name, schema) in json::schemas() {
        if std::env::var_os("IDENT_WRITE_SCHEMAS").is_some() {
            let text = serde_json::to_string_pretty(&schema).unwrap() + "\n";
            std::fs::write(schema_file(name), text).unwrap();
        }
        assert_eq!(
            published(name),
            schema,
            "docs/schema is out of date; IDENT_WRITE_SCHEMAS=1 cargo test --test report_json"
        );
    }
}

#[test]
fn output_is_valid_against_the_schema() {
    let answer = synthetic::quarter_vehicle();
    let outputs = [
        (json::DIAGNOSIS, json::answer(&answer).unwrap()),
        (json::DIAGNOSIS, json::answer(&synthetic::drive_axis()).unwrap()),
        (json::IDENTIFICATION, json::identification(&answer.base).unwrap()),
        (json::COMPARISON, json::comparison(&[answer.base, answer.extended]).unwrap()),
    ];
    for (name, text) in outputs {
        let output: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(output["schema"], name);
        assert_eq!(errors(name, &output), Vec::<String>::new());
    }
}

#[test]
fn the_schema_refuses_what_is_not_its_output() {
    let mut output: Value = serde_json::from_str(&json::answer(&synthetic::drive_axis()).unwrap()).unwrap();
    output["result"]["verdict"] = "guilty".into();
    output["result"]["base"].as_object_mut().unwrap().remove("bic");
    let found = errors(json::DIAGNOSIS, &output);
    assert_eq!(found.len(), 2, "{found:?}");
    output["schema"] = json::COMPARISON.into();
    assert!(!errors(json::DIAGNOSIS, &output).is_empty());
}

#[test]
fn numbers_that_are_not_finite_become_null() {
    let mut answer = synthetic::drive_axis();
    answer.base.bic = f64::NAN;
    answer.base.records[0].channels[0].simulated[7] = f64::INFINITY;
    answer.base.parameters[0].interval = None;
    let text = json::answer(&answer).unwrap();
    let output: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(output["result"]["base"]["bic"], Value::Null);
    assert_eq!(output["result"]["base"]["records"][0]["channels"][0]["simulated"][7], Value::Null);
    assert_eq!(errors(json::DIAGNOSIS, &output), Vec::<String>::new());
}

/// Every field that the schemas know is described in `docs/output.md`.
#[test]
fn every_field_is_documented() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/output.md");
    let text = std::fs::read_to_string(path).unwrap();
    let mut missing = Vec::new();
    for (name, schema) in json::schemas() {
        let definitions =
            schema["$defs"].as_object().unwrap().values().chain([&schema, &schema["properties"]["result"]]);
        for properties in definitions.filter_map(|definition| definition["properties"].as_object()) {
            missing.extend(
                properties.keys().filter(|field| !text.contains(&format!("`{field}`"))).map(|f| format!("{name}: {f}")),
            );
        }
    }
    assert!(missing.is_empty(), "not in docs/output.md: {missing:?}");
}
