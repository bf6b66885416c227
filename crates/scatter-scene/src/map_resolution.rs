//! How finely a light's shadows are sampled: texels a side, and for a sun how many maps of that size.

use scatter_core::{Light, MAX_CASCADES, ModelError};

/// Texels of a light's shadow maps.
///
/// A number alone is one map of so many texels a side: `2048.into()`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MapResolution {
    /// Texels along a side of each map (of a face, for a cube), ≥ 1.
    pub side: u32,
    /// Maps of a sun, 1 to [`MAX_CASCADES`]: each has `side`² texels; 1 is one map without cascades. Lamps have their
    /// own maps whatever it is.
    pub cascades: u32,
}

impl MapResolution {
    /// Several maps of `side`² texels for a sun.
    pub const fn cascaded(side: u32, cascades: u32) -> Self {
        Self { side, cascades }
    }

    /// One map with as many texels as all cascades together, to the nearest texel of its side.
    pub fn in_one_map(self) -> Self {
        let side = f64::from(self.side) * f64::from(self.cascades).sqrt();
        Self { side: side.round() as u32, cascades: 1 }
    }

    /// How many cascades the light has: none for a lamp, and for a sun with one map.
    pub fn cascades_of(self, light: &Light) -> Option<u32> {
        (self.cascades != 1 && matches!(light, Light::Directional(_))).then_some(self.cascades)
    }

    /// An error for a number of cascades that no set-up holds.
    pub(crate) fn checked(self) -> Result<Self, ModelError> {
        if (1..=MAX_CASCADES as u32).contains(&self.cascades) {
            return Ok(self);
        }
        let (field, value) = ("cascade count".to_string(), self.cascades.into());
        Err(ModelError::OutOfRange { field, value, range: "1 to 16 cascades" })
    }
}

impl From<u32> for MapResolution {
    fn from(side: u32) -> Self {
        Self { side, cascades: 1 }
    }
}

impl std::fmt::Display for MapResolution {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { side, cascades } = self;
        match cascades {
            1 => write!(f, "{side}x{side}"),
            _ => write!(f, "{cascades} cascades of {side}x{side}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_map_of_equal_texels_has_the_root_of_their_number_as_its_side() {
        assert_eq!(MapResolution::cascaded(2048, 4).in_one_map(), 4096.into());
        assert_eq!(MapResolution::cascaded(100, 3).in_one_map(), 173.into());
        assert_eq!(MapResolution::from(33).in_one_map(), 33.into());
    }
}
