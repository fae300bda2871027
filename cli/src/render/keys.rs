//! The keys of a configuration, from its JSON Schema: one declaration feeds schema and help.

use serde_json::Value;

use super::page::Page;

/// Keys with type, default and description; those of inner tables by their path.
#[must_use]
pub(crate) fn text(schema: &Value) -> String {
    let mut page = Page::default();
    add(&mut page, schema, "");
    let text = page.into_text();
    if text.is_empty() { "  no keys\n".into() } else { text }
}

fn add(page: &mut Page, schema: &Value, prefix: &str) {
    let required: Vec<&str> = schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    for (key, property) in schema["properties"].as_object().into_iter().flatten() {
        let path = format!("{prefix}{key}");
        let property = unwrapped(property);
        let rule = match &property["default"] {
            _ if required.contains(&&**key) => "required".into(),
            Value::Null => "optional".into(),
            default => format!("default {default}"),
        };
        page.line(format_args!("  {path}: {}, {rule}", kind(property)));
        for line in description(property).lines().map(str::trim) {
            page.line(format_args!("      {line}"));
        }
        if property["type"] == "array" {
            below(page, unwrapped(&property["items"]), &format!("{path}[]."));
        } else {
            below(page, property, &format!("{path}."));
        }
    }
}

/// Inner tables, and each variant of those that come in several.
fn below(page: &mut Page, schema: &Value, prefix: &str) {
    add(page, schema, prefix);
    for variant in alternatives(schema) {
        if variant["properties"].is_object() {
            let about = description(variant).lines().next().unwrap_or_default().to_owned();
            page.line(format_args!("    one of the forms of {}: {about}", prefix.trim_end_matches('.')));
            add(page, variant, prefix);
        }
    }
}

/// An optional value is written as a choice between it and null: the value is what a reader wants.
fn unwrapped(schema: &Value) -> &Value {
    match &alternatives(schema)[..] {
        [one] => one,
        _ => schema,
    }
}

fn alternatives(schema: &Value) -> Vec<&Value> {
    let choices = ["anyOf", "oneOf"].iter().filter_map(|key| schema[*key].as_array()).flatten();
    choices.filter(|choice| choice["type"] != "null").collect()
}

fn description(schema: &Value) -> &str {
    schema["description"].as_str().unwrap_or_default()
}

fn kind(schema: &Value) -> String {
    if let Some(values) = schema["enum"].as_array() {
        return join(values.iter().filter(|value| !value.is_null()).map(Value::to_string));
    }
    if !schema["const"].is_null() {
        return schema["const"].to_string();
    }
    let choices = alternatives(schema);
    if !choices.is_empty() {
        return join(choices.into_iter().map(kind));
    }
    let word = |name: &str| match name {
        "array" => match unwrapped(&schema["items"]) {
            items if items.is_object() => format!("list of {}", kind(items)),
            _ => "list".into(),
        },
        "object" => "table".into(),
        "boolean" => "true or false".into(),
        other => other.to_owned(),
    };
    match &schema["type"] {
        Value::String(name) => word(name),
        Value::Array(names) => join(names.iter().filter_map(Value::as_str).filter(|name| *name != "null").map(word)),
        _ => "value".into(),
    }
}

fn join(words: impl Iterator<Item = String>) -> String {
    let mut distinct: Vec<String> = Vec::new();
    for word in words {
        if !distinct.contains(&word) {
            distinct.push(word);
        }
    }
    distinct.join(" or ")
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::text;

    #[test]
    fn keys_carry_type_rule_and_description() {
        let schema = json!({
            "required": ["cutoff_hz"],
            "properties": {
                "cutoff_hz": { "type": "number", "description": "Where it is down by 3 dB." },
                "edges": { "default": "reflect", "oneOf": [{ "const": "reflect" }, { "const": "hold" }] },
                "lines": { "type": "array", "items": { "type": "object", "properties": { "upr": { "type": ["number", "null"] } } } },
            },
        });
        let expected = "  cutoff_hz: number, required\n      Where it is down by 3 dB.\n  edges: \"reflect\" or \"hold\", default \
                        \"reflect\"\n  lines: list of table, optional\n  lines[].upr: number, optional\n";
        assert_eq!(text(&schema), expected);
    }
}
