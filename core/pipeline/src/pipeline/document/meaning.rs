//! What a key is for, from the doc comments of the type that a table is read into.

use schemars::{JsonSchema, Schema};
use serde_json::Value;

/// The schema of a type, without references.
pub(in crate::pipeline) fn inline<T: JsonSchema>() -> Schema {
    let settings = schemars::generate::SchemaSettings::default().with(|settings| {
        settings.inline_subschemas = true;
        settings.meta_schema = None;
    });
    settings.into_generator().into_root_schema_for::<T>()
}

/// What a key means that a table of this type, or one within it, cannot do without: nothing where several of that name mean different things.
pub(super) fn of_missing<T: JsonSchema>(key: &str) -> Option<String> {
    let mut found = Vec::new();
    gather(inline::<T>().as_value(), key, &mut found);
    found.dedup();
    match &found[..] {
        [one] => Some(format!("`{key}`: {one}")),
        _ => None,
    }
}

fn gather(schema: &Value, key: &str, found: &mut Vec<String>) {
    match schema {
        Value::Object(entries) => {
            let is_required =
                entries.get("required").and_then(Value::as_array).is_some_and(|all| all.iter().any(|one| one == key));
            let about = entries.get("properties").and_then(|all| all.get(key)?.get("description")?.as_str());
            if let Some(about) = about.filter(|_| is_required) {
                // What follows the first paragraph is for who reads on.
                let first = about.split("\n\n").next().unwrap_or_default();
                found.push(first.split_whitespace().collect::<Vec<_>>().join(" "));
            }
            entries.values().for_each(|inner| gather(inner, key, found));
        }
        Value::Array(items) => items.iter().for_each(|inner| gather(inner, key, found)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::of_missing;

    #[derive(schemars::JsonSchema)]
    #[allow(dead_code, reason = "only its schema is of use")]
    struct Outer {
        /// Where it lies,
        /// in mm.
        ///
        /// More of it.
        z_mm: f64,
        /// Parts of it.
        parts: Vec<Inner>,
        /// A name that may be left out.
        name: Option<String>,
    }

    #[derive(schemars::JsonSchema)]
    #[allow(dead_code, reason = "only its schema is of use")]
    struct Inner {
        /// Weight, in kg.
        mass_kg: f64,
    }

    #[test]
    fn a_missing_key_is_explained_by_its_doc_comment() {
        assert_eq!(of_missing::<Outer>("z_mm").as_deref(), Some("`z_mm`: Where it lies, in mm."));
        assert_eq!(of_missing::<Outer>("mass_kg").as_deref(), Some("`mass_kg`: Weight, in kg."));
        assert_eq!(of_missing::<Outer>("name"), None);
    }
}
