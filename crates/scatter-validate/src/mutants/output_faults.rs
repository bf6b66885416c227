//! Faults that show in the image: a correct one is spoiled.

use scatter_core::ScatterImage;

use super::fault::Fault;

/// Spoils the image of frame number `frame`.
pub fn spoil(fault: Fault, frame: usize, image: &mut ScatterImage) {
    let [width, height] = image.size().map(|side| side as usize);
    let pixels = image.pixels_mut().0;
    let middle = height / 2 * width + width / 2;
    match fault {
        Fault::OnePixelBrighter => pixels[middle] = pixels[middle].map(|value| 1.01 * value),
        Fault::NanInOnePixel => pixels[middle][1] = f32::NAN,
        Fault::OneBitByThreads if rayon::current_num_threads() > 1 => {
            pixels[middle][2] = f32::from_bits(pixels[middle][2].to_bits() ^ 1);
        }
        Fault::AllocatesEveryFrame => {
            // Kept from the optimiser, which may drop an allocation that nobody looks at.
            std::hint::black_box(vec![0u8; frame]);
        }
        Fault::OneColumnShifted => {
            for row in pixels.chunks_mut(width) {
                row[width / 2] = row[width / 2 - 1];
            }
        }
        Fault::WidthAndHeightSwapped => {
            let right = pixels.to_vec();
            for (index, pixel) in right.into_iter().enumerate() {
                pixels[index % width * height + index / width] = pixel;
            }
        }
        Fault::RowZeroAtTheBottom => {
            let right = pixels.to_vec();
            for (row, from) in pixels.chunks_mut(width).zip(right.chunks(width).rev()) {
                row.copy_from_slice(from);
            }
        }
        Fault::PhaseNotNormalised => every(pixels, |value| value * 4.0 * std::f32::consts::PI),
        Fault::SrgbInsteadOfLinear => every(pixels, encoded),
        Fault::ChannelsCollapsed => pixels.iter_mut().for_each(|pixel| *pixel = [pixel[0]; 3]),
        _ => {}
    }
}

fn every(pixels: &mut [[f32; 3]], change: impl Fn(f32) -> f32) {
    pixels.iter_mut().flatten().for_each(|value| *value = change(*value));
}

/// The transfer function of IEC 61966-2-1.
fn encoded(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}
