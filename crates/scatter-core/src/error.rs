//! What can be wrong with a model's input: each variant names the field or the texel, its value and the cure.

/// Input that no model can be built from.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// A number outside of its range, or not finite.
    #[error("{field} is {value}; give {range}")]
    OutOfRange {
        /// Which field, in words: `medium.scattering[1]`.
        field: String,
        /// The value that was given.
        value: f64,
        /// What is accepted, in words: `a finite number ≥ 0`.
        range: &'static str,
    },
    /// A texel of a map that no engine can mean.
    #[error("{map}: texel ({x}, {y}) is {value}; give {range}")]
    BadTexel {
        /// Which map.
        map: &'static str,
        /// Column of the first such texel.
        x: u32,
        /// Row of the first such texel (cube faces and colours: counted down the flat array).
        y: u32,
        /// The value that was given.
        value: f64,
        /// What is accepted, in words.
        range: &'static str,
    },
    /// A buffer whose length does not fit its size.
    #[error("{buffer} holds {found} values; its size needs {expected}")]
    BufferLength {
        /// Which buffer.
        buffer: &'static str,
        /// Values that the size needs.
        expected: u64,
        /// Values that were given.
        found: u64,
    },
    /// A vector or matrix without a meaning: zero length, singular, NaN.
    #[error("{what}: {problem}; {cure}")]
    Degenerate {
        /// Which vector or matrix.
        what: &'static str,
        /// What is wrong with it.
        problem: &'static str,
        /// What to give instead.
        cure: &'static str,
    },
    /// Two parts of a frame that do not fit each other.
    #[error("{0}")]
    Mismatch(String),
}

/// `Ok(value)` if it is finite and `accept`s; otherwise the error that says so.
pub(crate) fn checked(
    field: &str,
    value: f64,
    accept: impl Fn(f64) -> bool,
    range: &'static str,
) -> Result<f64, ModelError> {
    if value.is_finite() && accept(value) {
        Ok(value)
    } else {
        Err(ModelError::OutOfRange { field: field.to_string(), value, range })
    }
}

/// The three channels of a non-negative colour.
pub(crate) fn checked_rgb(field: &str, rgb: [f64; 3]) -> Result<[f64; 3], ModelError> {
    for (channel, &value) in rgb.iter().enumerate() {
        if !(value.is_finite() && value >= 0.0) {
            let field = format!("{field}[{channel}]");
            return Err(ModelError::OutOfRange { field, value, range: "a finite number ≥ 0" });
        }
    }
    Ok(rgb)
}

/// A finite point.
pub(crate) fn checked_point(what: &'static str, p: [f64; 3]) -> Result<glam::DVec3, ModelError> {
    if p.iter().all(|c| c.is_finite()) {
        Ok(p.into())
    } else {
        Err(ModelError::Degenerate {
            what,
            problem: "a coordinate is NaN or infinite",
            cure: "give three finite numbers",
        })
    }
}

/// A unit vector along `v`, which must be finite and not zero.
pub(crate) fn checked_direction(what: &'static str, v: [f64; 3]) -> Result<glam::DVec3, ModelError> {
    let v = checked_point(what, v)?;
    // Scaled by its largest component first, so that 1e-200 and 1e200 are directions too.
    let largest = v.abs().max_element();
    if largest > 0.0 {
        Ok((v / largest).normalize())
    } else {
        Err(ModelError::Degenerate {
            what,
            problem: "the length is zero",
            cure: "give a vector that points somewhere",
        })
    }
}

/// `width × height` of an image or a map, both at least 1 and at most 65,536.
pub(crate) fn checked_size(what: &'static str, size: [u32; 2]) -> Result<usize, ModelError> {
    const LARGEST_SIDE: u32 = 1 << 16;
    for side in size {
        if !(1..=LARGEST_SIDE).contains(&side) {
            let field = format!("{what} size");
            return Err(ModelError::OutOfRange {
                field,
                value: side.into(),
                range: "1 to 65536 pixels a side",
            });
        }
    }
    Ok(size[0] as usize * size[1] as usize)
}

/// The length of a buffer against what its size needs.
pub(crate) fn checked_len(buffer: &'static str, found: usize, expected: usize) -> Result<(), ModelError> {
    if found == expected {
        Ok(())
    } else {
        Err(ModelError::BufferLength { buffer, expected: expected as u64, found: found as u64 })
    }
}

/// Every texel against `accept`; the error names the first that fails.
pub(crate) fn checked_texels(
    map: &'static str,
    texels: &[f32],
    width: u32,
    accept: impl Fn(f32) -> bool,
    range: &'static str,
) -> Result<(), ModelError> {
    match texels.iter().position(|&t| !accept(t)) {
        None => Ok(()),
        Some(index) => Err(ModelError::BadTexel {
            map,
            x: (index % width as usize) as u32,
            y: (index / width as usize) as u32,
            value: texels[index].into(),
            range,
        }),
    }
}
