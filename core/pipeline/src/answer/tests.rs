#![allow(clippy::unwrap_used, reason = "tests")]

use super::{Answer, Judgement, MOST_KEY_VALUES};
use crate::summary::{Summary, Value};

fn named(symbol: &str, value: f64, std: f64) -> Value {
    Value::new(symbol, value, std, "um", "")
}

#[test]
fn a_domain_names_its_key_values_and_the_standards_follow() {
    let values = vec![named("Sq", 0.5, 0.1).of("map"), named("other", 1.0, 0.1), named("EX0C", 23.0, 0.2).key()];
    let answer = Answer::of(&Summary { values, ..Summary::default() }, None);
    let symbols: Vec<&str> = answer.key_values.iter().map(|value| &*value.symbol).collect();
    assert_eq!(symbols, ["EX0C", "Sq"]);
    assert_eq!(answer.verdict.judgement, Judgement::Open);
    assert!(answer.contradictions.is_empty() && answer.steps.is_empty());
}

#[test]
fn many_parts_are_lowest_median_and_highest_each_with_its_own_uncertainty() {
    let of = |parts: usize| {
        let values = (0..parts).map(|part| named("range", part as f64, 1.0 + part as f64).key().of(format!("P{part}")));
        Answer::of(&Summary { values: values.collect(), ..Summary::default() }, None).key_values
    };
    let few = of(3);
    assert_eq!((few.len(), few[0].numbers.len(), &*few[0].of), (3, 1, "P0"));
    let many = of(8);
    assert_eq!((many.len(), &*many[0].of), (1, "8 parts"));
    let numbers: Vec<(f64, f64)> = many[0].numbers.iter().map(|one| (one.value, one.std.unwrap())).collect();
    assert_eq!(numbers, [(0.0, 1.0), (3.0, 4.0), (7.0, 8.0)]);
}

#[test]
fn key_values_are_few_and_in_a_unit_that_suits_them() {
    let values = (0..30).map(|index| named(&format!("value-{index}"), 0.0125, 0.001).key()).collect();
    let key_values = Answer::of(&Summary { values, ..Summary::default() }, None).key_values;
    assert_eq!(key_values.len(), MOST_KEY_VALUES);
    let first = &key_values[0];
    assert_eq!((&*first.unit, first.numbers[0].value, first.numbers[0].std), ("nm", 12.5, Some(1.0)));
}

#[test]
fn what_the_data_refute_is_marked_at_its_number_and_said_once() {
    let by = |said: &str| Some(said.to_owned());
    let values = vec![
        named("a", 1.0, 0.1).key().refuted_by(by("the residual is 9 times the noise")),
        named("b", 1.0, 0.1).key().refuted_by(by("s1: the residual is 9 times the noise")),
        named("c", 1.0, 0.1).key(),
    ];
    let answer = Answer::of(&Summary { values, ..Summary::default() }, None);
    assert_eq!(answer.verdict.sentence, "The data contradict the ± of 2 of 3 values.");
    assert_eq!(answer.verdict.judgement, Judgement::Bad);
    assert_eq!(answer.contradictions, ["the residual is 9 times the noise"]);
    assert_eq!(answer.key_values.iter().map(|value| value.is_refuted).collect::<Vec<_>>(), [true, true, false]);
}
