//! Which channel of a file a name of the configuration means.

use runout_core::fault::known_names;

use crate::channel::Channel;

/// The channel that a name means below a group, both levels separated by `/` or `.`.
///
/// A path of a channel comes first, then one in the group, then a name that only one channel of the group has; without a group, that only
/// one channel of the file has.
///
/// # Errors
/// What was expected and found, where no channel or several fit.
pub(crate) fn find(channels: &[Channel], group: &str, name: &str) -> Result<usize, String> {
    let paths: Vec<String> = channels.iter().map(Channel::path).collect();
    let below = if group.is_empty() { name.to_owned() } else { format!("{group}/{name}") };
    // A name without levels is that of a channel in the group.
    let whole = (group.is_empty() || name.contains(['/', '.'])).then_some(name);
    for wanted in std::iter::once(below.as_str()).chain(whole) {
        for same in [|a: &str, b: &str| a == b, |a: &str, b: &str| plain(a) == plain(b)] {
            let mut found = (0..channels.len()).filter(|index| same(&paths[*index], wanted));
            match (found.next(), found.next()) {
                (Some(one), None) => return Ok(one),
                (Some(one), Some(other)) => return Err(several(name, &[&paths[one], &paths[other]])),
                (None, _) => {}
            }
        }
    }
    let inside = |channel: &Channel| {
        let (of_channel, wanted) = (plain(&channel.group), plain(group));
        group.is_empty() || of_channel == wanted || of_channel.starts_with(&format!("{wanted}/"))
    };
    let of_group: Vec<usize> = (0..channels.len()).filter(|index| inside(&channels[*index])).collect();
    let named: Vec<usize> =
        of_group.iter().copied().filter(|index| plain(&channels[*index].name) == plain(name)).collect();
    match named[..] {
        [one] => Ok(one),
        [] if of_group.is_empty() => {
            let mut groups: Vec<&str> = channels.iter().map(|channel| channel.group.as_str()).collect();
            groups.dedup();
            Err(format!("expected a group `{group}`, found none of that name; {}", known_names(group, groups)))
        }
        [] => {
            let known = of_group.iter().map(|index| channels[*index].name.as_str());
            let of = if group.is_empty() { String::new() } else { format!(" in `{group}`") };
            Err(format!("expected a channel `{name}`{of}, found none of that name; {}", known_names(name, known)))
        }
        _ => Err(several(name, &named.iter().map(|index| paths[*index].as_str()).collect::<Vec<_>>())),
    }
}

fn several(name: &str, paths: &[&str]) -> String {
    format!(
        "`{name}` is the name of several channels: {}; name the group too, or name the groups by `setups`",
        paths.join(", ")
    )
}

/// A path with one kind of separators and without blanks, which do not distinguish channels: `a.b[:, 3]` is `a/b[:,3]`.
fn plain(path: &str) -> String {
    path.trim_start_matches('/')
        .chars()
        .filter(|character| *character != ' ')
        .map(|character| if character == '.' { '/' } else { character })
        .collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;
    use crate::channel::Kind;

    fn channels(paths: &[(&str, &str)]) -> Vec<Channel> {
        paths.iter().map(|(group, name)| Channel::new(*group, *name, Kind::F64, 1)).collect()
    }

    #[test]
    fn names_are_found_below_their_group() {
        let all =
            channels(&[("Run 0", "X1"), ("Run 0", "Displ. X2"), ("Run 1", "X1"), ("s/deep", "y[:,1]"), ("", "X1")]);
        assert_eq!(find(&all, "Run 1", "X1"), Ok(2));
        assert_eq!(find(&all, "", "Run 0/X1"), Ok(0));
        assert_eq!(find(&all, "", "X1"), Ok(4));
        assert_eq!(find(&all, "Run 0", "Displ. X2"), Ok(1));
        assert_eq!(find(&all, "", "s.deep.y[:, 1]"), Ok(3));
        assert_eq!(find(&all, "s", "y[:, 1]"), Ok(3));
    }

    #[test]
    fn what_is_missing_or_ambiguous_is_said() {
        let all = channels(&[("a", "X"), ("b", "X"), ("b", "Y")]);
        assert!(find(&all, "", "X").unwrap_err().contains("several channels: a/X, b/X"));
        assert!(find(&all, "c", "X").unwrap_err().contains("expected a group `c`"));
        assert!(find(&all, "b", "Z").unwrap_err().contains("in `b`, found none of that name; known: `X`, `Y`"));
    }
}
