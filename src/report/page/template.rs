//! The page's template and assets; the only file that names minijinja.

use minijinja::{AutoEscape, Environment, context, value::Serde};
use serde::Serialize;

const TEMPLATES: [(&str, &str); 8] = [
    ("layout.html", include_str!("layout.html")),
    ("titled.html", include_str!("titled.html")),
    ("parts.html", include_str!("parts.html")),
    ("answer.html", include_str!("answer.html")),
    ("fit.html", include_str!("fit.html")),
    ("comparison.html", include_str!("comparison.html")),
    ("plan.html", include_str!("plan.html")),
    ("validity.html", include_str!("validity.html")),
];
const STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("histories.js");
const UPLOT_STYLE: &str = include_str!("vendor/uplot/uPlot.min.css");
const UPLOT_SCRIPT: &str = include_str!("vendor/uplot/uPlot.iife.min.js");
const UPLOT_LICENCE: &str = include_str!("vendor/uplot/LICENSE");

/// The embedded template could not be rendered.
#[derive(Debug)]
pub struct RenderError {
    message: String,
}

impl std::fmt::Display for RenderError {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(formatter, "the page could not be rendered: {}", self.message)
    }
}

impl std::error::Error for RenderError {}

impl From<minijinja::Error> for RenderError {
    fn from(error: minijinja::Error) -> RenderError {
        RenderError { message: format!("{error:#}") }
    }
}

/// Renders `name` with `page`; `histories` is the JSON text from which the script draws.
pub fn render(name: &str, page: &impl Serialize, histories: &str) -> Result<String, RenderError> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    for (template, text) in TEMPLATES {
        environment.add_template(template, text)?;
    }
    // The head comment names the project's address; pages carry the licence text instead.
    let uplot = UPLOT_SCRIPT.split_once("*/").map_or(UPLOT_SCRIPT, |(_, script)| script);
    let rendered = environment.get_template(name)?.render(context! {
        page => Serde(page),
        // Text inside a script element ends at the first `</`.
        histories => histories.replace('<', "\\u003c"),
        style => STYLE,
        script => SCRIPT,
        uplot_style => UPLOT_STYLE,
        uplot,
        uplot_licence => UPLOT_LICENCE,
        version => env!("CARGO_PKG_VERSION"),
    })?;
    Ok(rendered)
}
