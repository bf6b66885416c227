//! All rows, group by group: 1-model's extremes (MODEL.md), the numerical suite with published answers, the laws that
//! bind two images, what engines hand over, and the rules of the house.

mod bad_input;
mod conventions;
mod eyes_and_lights;
mod height_fog;
mod images_and_cameras;
mod laws;
mod maps;
mod media;
mod smoke;
mod suite_lamp;
mod suite_sun;

use super::row::{StressRow, Trial};
use crate::checks::HouseRule;

/// Every row in the order of the table.
pub fn all_rows() -> Vec<StressRow> {
    let house = HouseRule::ALL.map(|rule| StressRow {
        group: "house rules",
        name: rule.name().into(),
        trial: Trial::House(rule),
    });
    let groups = [
        suite_sun::rows(),
        suite_lamp::rows(),
        media::rows(),
        height_fog::rows(),
        eyes_and_lights::rows(),
        images_and_cameras::rows(),
        maps::rows(),
        smoke::rows(),
        conventions::rows(),
        laws::rows(),
        bad_input::rows(),
    ];
    groups.into_iter().flatten().chain(house).collect()
}
