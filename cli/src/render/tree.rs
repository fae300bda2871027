//! Any JSON value as indented text: keys, then what is below them.

use serde_json::Value;

use super::page::Page;

/// The text of a value.
#[must_use]
pub fn text(value: &Value) -> String {
    let mut page = Page::default();
    for line in lines(value) {
        page.line(line);
    }
    page.into_text()
}

fn lines(value: &Value) -> Vec<String> {
    match value {
        Value::Object(entries) => {
            let width = entries.keys().map(|key| key.chars().count()).max().unwrap_or(0);
            let filled = entries.iter().filter(|(_, value)| !is_empty(value));
            filled
                .flat_map(|(key, value)| match inline(value) {
                    Some(short) => vec![format!("{key:<width$}  {short}")],
                    None => std::iter::once(key.clone()).chain(indented(value, "  ", "  ")).collect(),
                })
                .collect()
        }
        Value::Array(items) => items.iter().flat_map(|item| indented(item, "- ", "  ")).collect(),
        other => inline(other).into_iter().collect(),
    }
}

fn indented(value: &Value, first: &str, further: &str) -> Vec<String> {
    let lead = |(index, line): (usize, String)| format!("{}{line}", if index == 0 { first } else { further });
    lines(value).into_iter().enumerate().map(lead).collect()
}

fn is_empty(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::Array(items) => items.is_empty(),
        Value::Object(entries) => entries.is_empty(),
        _ => false,
    }
}

/// Values that fit on the line of their key: scalars, and lists of them.
fn inline(value: &Value) -> Option<String> {
    match value {
        Value::Object(_) => None,
        Value::Array(items) if items.iter().any(|item| matches!(item, Value::Object(_) | Value::Array(_))) => None,
        Value::Array(items) => Some(items.iter().filter_map(inline).collect::<Vec<_>>().join(", ")),
        Value::String(text) if text.contains('\n') => Some(format!("{} lines", text.lines().count())),
        Value::String(text) => Some(text.clone()),
        other => Some(other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::text;

    #[test]
    fn nested_values_are_indented() {
        let value = json!({ "format": "runout-measurement", "setups": [{ "id": "a", "sizes": [1, 2] }], "none": null });
        assert_eq!(text(&value), "format  runout-measurement\nsetups\n  - id     a\n    sizes  1, 2\n");
    }
}
