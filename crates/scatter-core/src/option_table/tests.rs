//! Values, errors and defaults that follow from a table.

use super::*;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Order {
    Ascending,
    Descending,
}

impl Choice for Order {
    fn names() -> Vec<(&'static str, Self)> {
        vec![("up", Self::Ascending), ("down", Self::Descending)]
    }
}

#[derive(Debug, PartialEq)]
struct Options {
    share: f32,
    count: u32,
    seed: Option<u32>,
    order: Option<Order>,
}

impl Default for Options {
    fn default() -> Self {
        Self { share: 0.1, count: 3, seed: None, order: None }
    }
}

static TABLE: OptionTable<Options> = OptionTable {
    technique: "test",
    rows: &[
        option_row!("share", "a share", "", OptionRange::Real([0.0, 1.0]), share as f32),
        option_row!("count", "a count", "steps", OptionRange::Whole([1, 7]), count as u32),
        option_row!(
            "seed",
            "of the noise",
            "seed",
            OptionRange::WordOrWhole(&["off"], [0, u32::MAX as u64]),
            |options| options.seed.map_or(OptionValue::Word("off"), OptionValue::from),
            |options, value| options.seed = value.as_number().map(|seed| seed as u32)
        ),
        option_row!("order", "which way", Option<Order>, order),
    ],
};

#[test]
fn values_are_text_that_sets_the_same_options() {
    let options = Options { share: 0.7, count: 7, seed: Some(u32::MAX), order: Some(Order::Descending) };
    let values = TABLE.values(&options);
    assert_eq!(
        values.iter().map(|(_, value)| value.as_str()).collect::<Vec<_>>(),
        ["0.7", "7", "4294967295", "down"]
    );
    let mut again = Options::default();
    for (key, value) in &values {
        TABLE.set(&mut again, key, value).unwrap();
    }
    assert_eq!(again, options);
    assert_eq!(
        TABLE.list().iter().map(|info| info.default.to_string()).collect::<Vec<_>>(),
        ["0.1", "3", "off", "auto"]
    );
}

#[test]
fn errors_name_key_value_range_and_unit() {
    let message = |key: &str, value: &str| {
        let mut options = Options::default();
        let error = TABLE.set(&mut options, key, value).unwrap_err().to_string();
        assert_eq!(options, Options::default(), "a refused value changes nothing");
        error
    };
    assert_eq!(message("share", "1.01"), "test: option share is '1.01'; give a number from 0 to 1");
    assert_eq!(message("share", "NaN"), "test: option share is 'NaN'; give a number from 0 to 1");
    assert_eq!(message("count", "2.0"), "test: option count is '2.0'; give an integer from 1 to 7 [steps]");
    let seed = "test: option seed is '-1'; give off, or an integer from 0 to 4294967295 [seed]";
    assert_eq!(message("seed", "-1"), seed);
    assert_eq!(message("order", "left"), "test: option order is 'left'; give auto, up or down");
    assert_eq!(message("orders", "up"), "test has no option 'orders'; it has: share, count, seed, order");
}

#[test]
fn options_that_were_filled_in_by_hand_are_checked_too() {
    assert!(TABLE.check(&Options::default()).is_ok());
    let error = TABLE.check(&Options { count: 8, ..Options::default() }).unwrap_err().to_string();
    assert!(error.contains("count is '8'"), "{error}");
    assert!(TABLE.check(&Options { share: f32::NAN, ..Options::default() }).is_err());
}

#[test]
fn grids_are_three_integers_within_their_limits() {
    let range = OptionRange::Grid { most: 100, cells: 6000 };
    let grid = range.parse(" 10x20x30 ").unwrap();
    assert_eq!((grid, grid.to_string().as_str()), (OptionValue::Grid([10, 20, 30]), "10x20x30"));
    assert_eq!((grid.as_grid(), grid.as_number()), (Some([10, 20, 30]), None));
    for refused in ["10x20x31", "0x1x1", "101x1x1", "10x20", "1x1x1x1", "1.0x1x1", "-1x1x1", "x", "", "7"] {
        assert_eq!(range.parse(refused), None, "{refused}");
    }
    assert!(!range.contains(OptionValue::Number(7.0)) && !OptionRange::Real([0.0, 1e9]).contains(grid));
    assert_eq!((range.numbers(), range.words().len()), (None, 0));
    assert_eq!(range.to_string(), "a grid WxHxD, integers from 1 to 100, at most 6000 cells");
}
