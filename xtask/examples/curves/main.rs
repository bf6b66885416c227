//! The tables of `crates/avsm/README.md`: what each kind of transmittance curve costs and how near it comes, on the captured
//! segments of the three built-in shots of smoke and hair.
//!
//! ```text
//! cargo run --release -p xtask --example curves -- quality
//! cargo run --release -p xtask --example curves -- speed
//! ```

mod kinds;
mod quality;
mod segments;
mod speed;

use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    match std::env::args().nth(1).as_deref() {
        Some("quality") => quality::print(),
        Some("speed") => speed::print(),
        _ => Err("give quality or speed".into()),
    }
}
