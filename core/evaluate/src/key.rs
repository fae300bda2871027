//! The standards' values that a result opens with: what a drawing or a data sheet asks for first. Values of a domain of its own say of
//! themselves that they are such ([`Value::key`](crate::Value::key)).

/// In the order in which they are given; every name of a group of motion values stands for the first direction of it that there is.
const GROUPS: [&[&str]; 13] = [
    &["RONt"],
    &["CYLt"],
    &["STRt"],
    &["Sq"],
    &["Sz"],
    &["synchronous-radial-rotating", "synchronous-radial-along", "synchronous-radial-x", "synchronous-radial-y"],
    &["asynchronous-radial-rotating", "asynchronous-radial-along", "asynchronous-radial-x", "asynchronous-radial-y"],
    &["synchronous-axial"],
    &["asynchronous-axial"],
    &["synchronous-tilt-rotating", "synchronous-tilt-along", "residual-synchronous-tilt-rotating"],
    &["asynchronous-tilt-rotating", "asynchronous-tilt-along"],
    &["total-run-out"],
    &["Ra"],
];

/// Those of these symbols that the result opens with, the first to be given first.
#[must_use]
pub fn key_symbols<'a>(symbols: &[&'a str]) -> Vec<&'a str> {
    let first = |group: &&[&str]| group.iter().find_map(|name| symbols.iter().find(|symbol| *symbol == name).copied());
    GROUPS.iter().filter_map(first).collect()
}

#[cfg(test)]
mod tests {
    use super::key_symbols;

    #[test]
    fn of_motion_the_rotating_direction_comes_before_the_fixed_ones() {
        let symbols = ["Ra", "synchronous-radial-x", "synchronous-radial-rotating", "RONq", "RONt"];
        assert_eq!(key_symbols(&symbols), ["RONt", "synchronous-radial-rotating", "Ra"]);
        assert_eq!(key_symbols(&["synchronous-radial-y"]), ["synchronous-radial-y"]);
        assert!(key_symbols(&["RONq"]).is_empty());
    }
}
