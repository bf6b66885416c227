//! For the report: what is left of the light over depth, on the light ray that crosses most smoke and hair of a shot, by the
//! adaptive curve of its texel and by the uncompressed one.

use anyhow::Context;
use scatter::avsm::{AvsmCurve, CurveMaps, Options, TransmittanceCurve, UncompressedCurve};
use scatter_core::{RenderError, TranslucentCapture, TranslucentSegment};
use scatter_scene::Shot;
use scatter_validate::StagedShot;
use scatter_validate::plot::{DepthCurve, TransmittancePlot};
use scatter_validate::report::Section;

/// The section's heading.
pub const HEADING: &str = "Light over depth";

/// Texels along the longer side of the map that the light ray is chosen from, and of the shadow map.
const SIDE: u32 = 64;
/// Places between the first and the last depth of a curve.
const PLACES: u32 = 600;

/// Whether anything in the shot dims light rather than ends it.
pub fn has_occluders(shot: &Shot) -> bool {
    !shot.scene.particles.is_empty() || !shot.scene.strands.is_empty()
}

/// The plot of a shot; `None` where the light's map meets none of its smoke and hair.
pub fn plot(shot: &Shot) -> anyhow::Result<Option<TransmittancePlot>> {
    let staged = StagedShot::new(shot.clone(), SIDE)?;
    let Some(source) = staged.caster().occluders() else { return Ok(None) };
    let projections = staged.with_frame(0, staged.camera(), |frame| {
        let mut maps = CurveMaps::new();
        maps.build(frame, &Options { curves: SIDE, ..Options::default() })?;
        Ok::<_, RenderError>(maps.layers().iter().map(|layer| *layer.projection()).collect::<Vec<_>>())
    })?;
    let mut longest: Vec<TranslucentSegment> = Vec::new();
    for projection in projections.with_context(|| shot.name.clone())? {
        let mut capture = TranslucentCapture::new();
        let layer = capture.capture(source, &projection, TranslucentCapture::DEFAULT_LIMIT)?;
        let lists = layer.offsets().windows(2).map(|pair| pair[0] as usize..pair[1] as usize);
        if let Some(list) = lists.max_by_key(|list| list.len()).filter(|list| list.len() > longest.len()) {
            longest = layer.segments()[list].to_vec();
        }
    }
    Ok((!longest.is_empty()).then(|| plot_of(&shot.name, &longest)))
}

/// Both curves of a texel's segments.
fn plot_of(name: &str, segments: &[TranslucentSegment]) -> TransmittancePlot {
    let mut exact = UncompressedCurve::default();
    segments.iter().for_each(|segment| exact.insert(segment));
    exact.finish();
    let ends = segments.iter().flat_map(|segment| [segment.entry, segment.exit]).map(f64::from);
    let (near, far) = ends.fold((f64::INFINITY, 0.0f64), |(near, far), z| (near.min(z), far.max(z)));
    let margin = (0.05 * (far - near)).max(1e-3 * far);
    let depths = [(near - margin).max(0.0), far + margin];
    let mut curves = vec![DepthCurve {
        name: format!("uncompressed: {} segments, {} nodes", segments.len(), exact.nodes().len()),
        line: sampled(&exact, depths),
        nodes: Vec::new(),
    }];
    fn adaptive<const N: usize>(segments: &[TranslucentSegment], depths: [f64; 2]) -> DepthCurve {
        let mut curve = AvsmCurve::<N>::default();
        segments.iter().for_each(|segment| curve.insert(segment));
        let nodes = curve.nodes().map(|node| [node.depth.into(), (-f64::from(node.optical_depth)).exp()]);
        DepthCurve { name: format!("{N} nodes"), line: sampled(&curve, depths), nodes: nodes.collect() }
    }
    curves.push(adaptive::<4>(segments, depths));
    curves.push(adaptive::<8>(segments, depths));
    TransmittancePlot { title: name.into(), depths, curves }
}

fn sampled(curve: &impl TransmittanceCurve, [from, to]: [f64; 2]) -> Vec<[f64; 2]> {
    let at = |n: u32| from + (to - from) * (f64::from(n) / f64::from(PLACES));
    (0..=PLACES).map(at).map(|depth| [depth, curve.transmittance(depth)]).collect()
}

/// The section of all plots.
pub fn section(plots: Vec<TransmittancePlot>) -> Section {
    let introduction = "Of each shot the light ray that crosses most smoke and hair: what is left of its light, by all segments \
                        and by adaptive curves of 4 and 8 nodes, which were compressed while the segments came.";
    Section::Transmittance(introduction.into(), plots)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_holds_the_truth_and_two_compressed_curves() {
        let hair = |n: u16| TranslucentSegment::hair(1.0 + 0.05 * f32::from(n), 0.1);
        let segments: Vec<_> = (0..40).map(hair).collect();
        let plot = plot_of("hair", &segments);
        assert_eq!(plot.curves.len(), 3);
        assert_eq!([plot.curves[1].nodes.len(), plot.curves[2].nodes.len()], [4, 8]);
        for curve in &plot.curves {
            // 0.9⁴⁰, in f32 optical depths.
            let last = curve.line.last().unwrap()[1];
            assert!((last - 0.9f64.powi(40)).abs() < 1e-5 && curve.line[0][1] == 1.0, "{}", curve.name);
        }
    }
}
