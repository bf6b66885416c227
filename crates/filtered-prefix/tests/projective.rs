//! Projective maps against what the scene really looks like: boards whose shadows are known without any map.

use filtered_prefix::projective::OwnMapSettings;
use filtered_prefix::{Basis, Fetch, FilteredPrefix, Options, Rectification, Storage, Weighting};
use glam::{DMat4, DVec3, DVec4};
use scatter_core::{
    Camera, DepthMap, Frame, Light, MapError, MapProjection, MapSource, Medium, Phase, RayLight, RenderError,
    RenderStats, ScatterImage, ShadowLayer, ShadowMap, VolumetricShadow,
};

/// Parallelograms: a corner and two edges.
struct Boards(Vec<[DVec3; 3]>);

/// Where rays end.
const END: f64 = 12.0;

impl Boards {
    /// Louvres above the ground.
    fn louvres() -> Self {
        let board = |k: i32| {
            let x = 0.9 * f64::from(k);
            [DVec3::new(x, 3.0, -6.0), DVec3::new(0.5, 0.1, 0.0), DVec3::new(0.0, 0.0, 14.0)]
        };
        Self((-5..=5).map(board).collect())
    }

    /// Where the line `origin + t·direction` meets each board.
    fn crossings(&self, origin: DVec3, direction: DVec3) -> impl Iterator<Item = f64> + '_ {
        self.0.iter().filter_map(move |[corner, a, b]| {
            let normal = a.cross(*b);
            let t = (corner - origin).dot(normal) / direction.dot(normal);
            let p = origin + t * direction - corner;
            let (aa, ab, bb, pa, pb) = (a.dot(*a), a.dot(*b), b.dot(*b), p.dot(*a), p.dot(*b));
            let det = aa * bb - ab * ab;
            let (u, v) = ((pa * bb - pb * ab) / det, (pb * aa - pa * ab) / det);
            ((0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v)).then_some(t)
        })
    }

    fn is_lit(&self, p: DVec3, light: &Light) -> bool {
        match light {
            Light::Directional(sun) => !self.crossings(p, -sun.direction()).any(|t| t > 0.0),
            _ => !self.crossings(p, light.position().unwrap() - p).any(|t| t > 0.0 && t < 1.0),
        }
    }

    /// Radiance of a pixel, from fifteen hundred shadow rays; one channel.
    fn radiance(&self, frame: &Frame<'_>, x: u32, y: u32) -> f64 {
        let (eye, ray) = (frame.camera().eye(), frame.camera().pixel_ray(x, y));
        let light = RayLight::new(frame.light(), frame.medium(), eye, &ray);
        let step = END / 1500.0;
        let lit = (0..1500).filter(|&k| {
            let t = step * (f64::from(k) + 0.5);
            self.is_lit(eye + ray.origin + ray.direction * t, frame.light())
        });
        lit.map(|k| light.interval(step * f64::from(k), step * f64::from(k + 1)).x).sum()
    }

    /// Radiance of all pixels.
    fn image(&self, frame: &Frame<'_>) -> Vec<f64> {
        let [width, height] = frame.size();
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
        pixels.map(|[x, y]| self.radiance(frame, x, y)).collect()
    }

    fn map(&self, projection: MapProjection) -> Vec<f32> {
        let [width, height] = projection.size();
        let texels = (0..height).flat_map(|row| (0..width).map(move |column| [column, row]));
        let depth = |[u, v]: [u32; 2]| {
            let (origin, step) = projection.light_ray(f64::from(u) + 0.5, f64::from(v) + 0.5).unwrap();
            self.crossings(origin, step).filter(|&t| t > 0.0).fold(f64::INFINITY, f64::min) as f32
        };
        texels.map(depth).collect()
    }
}

impl MapSource for Boards {
    fn depth_map(&self, _: &Camera, _: &mut Vec<f32>) -> Result<(), MapError> {
        unreachable!("nobody asks for it")
    }

    fn shadow_map(&self, _: &MapProjection, _: &mut Vec<f32>) -> Result<(), MapError> {
        unreachable!("nobody asks for it")
    }

    fn cube_map(&self, _: [f64; 3], _: u32, _: &mut Vec<f32>) -> Result<(), MapError> {
        unreachable!("nobody asks for it")
    }

    fn clip_map(&self, clip: [[f64; 4]; 4], size: [u32; 2], out: &mut Vec<f32>) -> Result<(), MapError> {
        let clip = DMat4::from_cols_array_2d(&clip);
        let inverse = clip.inverse();
        out.clear();
        for row in 0..size[1] {
            for column in 0..size[0] {
                let place = |n: u32, of: u32| (f64::from(n) + 0.5) / f64::from(of) * 2.0 - 1.0;
                let (x, y) = (place(column, size[0]), -place(row, size[1]));
                // Two points of the texel's line, and its direction.
                let near = inverse * DVec4::new(x, y, 0.0, 1.0);
                let slope = inverse.z_axis;
                let direction = slope.truncate() * near.w - near.truncate() * slope.w;
                let origin = near.truncate() / near.w;
                let depths = self.crossings(origin, direction).filter_map(|t| {
                    let seen = clip * (origin + t * direction).extend(1.0);
                    (seen.w > 0.0 && seen.z <= seen.w).then(|| (seen.z / seen.w).max(0.0))
                });
                out.push(depths.fold(f64::INFINITY, f64::min) as f32);
            }
        }
        Ok(())
    }
}

/// A source that makes texels of one value.
struct Constant(f32, usize);

impl MapSource for Constant {
    fn depth_map(&self, _: &Camera, _: &mut Vec<f32>) -> Result<(), MapError> {
        Ok(())
    }

    fn shadow_map(&self, _: &MapProjection, _: &mut Vec<f32>) -> Result<(), MapError> {
        Ok(())
    }

    fn cube_map(&self, _: [f64; 3], _: u32, _: &mut Vec<f32>) -> Result<(), MapError> {
        Ok(())
    }

    fn clip_map(&self, _: [[f64; 4]; 4], size: [u32; 2], out: &mut Vec<f32>) -> Result<(), MapError> {
        out.clear();
        out.resize((size[0] * size[1]) as usize - self.1, self.0);
        Ok(())
    }
}

fn sun() -> Light {
    Light::directional([0.35, -1.0, -0.2], [1.0; 3]).unwrap()
}

fn lamp() -> Light {
    Light::spot([0.4, 7.0, -2.0], [0.0, -1.0, 0.05], [40.0; 3], 30.0, 50.0, 0.0).unwrap()
}

/// Lends a frame of the boards, with a map of `side` texels a side that is fitted by hand.
fn with_frame<R>(
    light: &Light,
    target: [f64; 3],
    side: u32,
    visit: impl FnOnce(&Boards, &Frame<'_>) -> R,
) -> R {
    let boards = Boards::louvres();
    let size = [37, 23];
    let camera = Camera::perspective([0.3, 1.2, 5.0], target, [0.0, 1.0, 0.0], 55.0, size).unwrap();
    let depths = vec![END as f32; (size[0] * size[1]) as usize];
    let medium = Medium::homogeneous([0.06; 3], [0.0; 3], Phase::Isotropic).unwrap();
    let projection = match light {
        Light::Directional(sun) => {
            let forward = sun.direction();
            let origin = DVec3::new(0.0, 2.0, -2.0) - forward * 30.0;
            let up = [0.0, 0.0, -1.0];
            MapProjection::orthographic(origin.to_array(), forward.to_array(), up, [14.0; 2], [side; 2])
        }
        _ => {
            let tan = 50f64.to_radians().tan();
            let position = light.position().unwrap().to_array();
            MapProjection::perspective(position, [0.0, -1.0, 0.05], [0.0, 0.0, -1.0], tan, side)
        }
    };
    let projection = projection.unwrap();
    let texels = boards.map(projection);
    let layer = ShadowLayer::new(projection, &texels).unwrap();
    let shadow = match light {
        Light::Directional(_) => ShadowMap::Orthographic(layer),
        _ => ShadowMap::Perspective(layer),
    };
    let depth = DepthMap::new(&depths, size).unwrap();
    let frame = Frame::new(&camera, depth, light, &shadow, &medium, 50.0).unwrap();
    visit(&boards, &frame)
}

fn options(rectification: Option<Rectification>, side: u32) -> Options {
    let own_map = OwnMapSettings { columns: side, rows: side, splits: 4 };
    // Slices half a pixel apart; exact sums: what is left is the map's.
    let slices = Options { spacing: 0.5, target: None, tolerance: 1e-3, ..Options::default() };
    Options { rectification, own_map, ..slices }
}

fn render(frame: &Frame<'_>, options: Options) -> (ScatterImage, RenderStats) {
    let mut image = ScatterImage::new();
    let stats = FilteredPrefix::new(options).render(frame, &mut image).unwrap();
    (image, stats)
}

fn rel_rmse(image: &ScatterImage, truth: &[f64]) -> f64 {
    let squares: f64 = image
        .inscattered()
        .iter()
        .zip(truth)
        .map(|(found, truth)| (f64::from(found[0]) - truth).powi(2))
        .sum();
    let count = truth.len() as f64;
    (squares / count).sqrt() / (truth.iter().sum::<f64>() / count)
}

#[test]
fn rendered_maps_come_to_what_the_scene_looks_like() {
    for light in [sun(), lamp()] {
        with_frame(&light, [0.0, 1.4, 0.0], 48, |boards, frame| {
            let frame = &frame.with_map_source(boards);
            let truth = boards.image(frame);
            let error = |options| {
                let (image, stats) = render(frame, options);
                (rel_rmse(&image, &truth), stats)
            };
            let (given, _) = error(options(Some(Rectification::Resampled), 1));
            let found = [64, 256, 1024].map(|side| {
                let (own, stats) = error(options(Some(Rectification::Projective), side));
                assert!(stats.modelled.get("rows-of-a-projective-map").is_some());
                assert!(stats.stages.get("map").is_some());
                own
            });
            println!("given map of 48²: {given:.4}; projective of 64², 256², 1024²: {found:.4?}");
            // An edge is off by up to half a texel, so that four times as many texels a side divide the error by four, until slices
            // half a pixel apart are what is left; and 1024 texels a side are 21 times as fine as 48.
            assert!(found[1] < 0.6 * found[0] && found[2] < 0.6 * found[1], "{found:?}");
            assert!(found[2] < 0.25 * given, "{found:?}, {given}");
        });
    }
}

#[test]
fn without_a_source_the_given_map_is_resampled_into_it() {
    for light in [sun(), lamp()] {
        with_frame(&light, [0.0, 1.4, 0.0], 512, |boards, frame| {
            let (rows, _) = render(frame, options(Some(Rectification::Resampled), 1));
            let (own, stats) = render(frame, options(Some(Rectification::Projective), 1024));
            assert!(stats.modelled.iter().any(|(name, ())| name.contains("there is no source of maps")));
            let source = frame.with_map_source(boards);
            let (rendered, _) = render(&source, options(Some(Rectification::Projective), 1024));
            let truth = boards.image(frame);
            let [given, rendered, resampled] = [&rows, &rendered, &own].map(|image| rel_rmse(image, &truth));
            println!("given map {given:.5}, rendered {rendered:.5}, resampled {resampled:.5}");
            // Edges are displaced by the texels of the one and then by those of the other.
            assert!(resampled > 0.0 && resampled < given + rendered);
            // Who has not asked for it keeps the given map's own rows.
            let (auto, stats) = render(frame, options(None, 1024));
            assert_eq!(auto.inscattered(), rows.inscattered());
            assert!(stats.modelled.iter().any(|(name, ())| name.starts_with("rows-of-the-given-map")));
        });
    }
}

#[test]
fn where_view_rays_run_along_the_light_rows_are_resampled() {
    // Straight up into the light, and nearly.
    for (light, target) in [(sun(), [0.3 - 0.35, 2.2, 5.2]), (lamp(), [0.4, 7.0, -2.0])] {
        with_frame(&light, target, 64, |boards, frame| {
            let frame = &frame.with_map_source(boards);
            let (rows, _) = render(frame, options(Some(Rectification::Resampled), 1));
            for rectification in [None, Some(Rectification::Projective)] {
                let (own, stats) = render(frame, options(rectification, 256));
                assert_eq!(own.inscattered(), rows.inscattered());
                let note = "rows-of-the-given-map: the epipole is in or near the image";
                assert!(stats.modelled.get(note).is_some(), "{:?}", stats.modelled);
            }
        });
    }
}

#[test]
fn sources_that_make_no_map_are_errors() {
    with_frame(&sun(), [0.0, 1.4, 0.0], 16, |_, frame| {
        for (source, says) in
            [(Constant(f32::NAN, 0), "NaN"), (Constant(-1.0, 0), "-1"), (Constant(0.5, 3), "texels")]
        {
            let frame = frame.with_map_source(&source);
            let mut technique = FilteredPrefix::new(options(Some(Rectification::Projective), 64));
            match technique.render(&frame, &mut ScatterImage::new()) {
                Err(RenderError::Map(error)) => assert!(error.to_string().contains(says), "{error}"),
                other => panic!("{other:?}"),
            }
        }
    });
}

#[test]
fn threads_change_no_bit_of_a_projective_map() {
    let images = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            with_frame(&lamp(), [0.0, 1.4, 0.0], 16, |boards, frame| {
                render(&frame.with_map_source(boards), options(Some(Rectification::Projective), 128))
                    .0
                    .inscattered()
                    .to_vec()
            })
        })
    });
    assert_eq!(images[0], images[1]);
}

/// RMS of a series' ringing at one plane, of the unoccluded light: 1/(π·√M) (README, "What the bases miss").
fn ringing(count: u32) -> f64 {
    1.0 / (std::f64::consts::PI * f64::from(count).sqrt())
}

#[test]
fn one_fetch_a_pixel_misses_what_the_map_and_the_basis_miss() {
    for light in [sun(), lamp()] {
        with_frame(&light, [0.0, 1.4, 0.0], 48, |boards, frame| {
            let frame = &frame.with_map_source(boards);
            let truth = boards.image(frame);
            let [width, height] = frame.size();
            let unoccluded: f64 = (0..height)
                .flat_map(|y| (0..width).map(move |x| (x, y)))
                .map(|(x, y)| {
                    let (eye, ray) = (frame.camera().eye(), frame.camera().pixel_ray(x, y));
                    RayLight::new(frame.light(), frame.medium(), eye, &ray).interval(0.0, END).x
                })
                .sum();
            let over_mean = unoccluded / truth.iter().sum::<f64>();
            let exact = rel_rmse(&render(frame, options(Some(Rectification::Projective), 512)).0, &truth);
            let fetch = |basis, coefficients, fetch, storage| {
                let own = options(Some(Rectification::Projective), 512);
                let own = Options { basis, coefficients, fetch, storage, certified: false, ..own };
                let (image, stats) = render(frame, own);
                let references = stats.counts.get("reference rays").unwrap();
                // Two numbers beside: what is lit for all view rays of the row, and what is in doubt.
                let bytes = (u64::from(coefficients) + 2) * references * storage.bytes() as u64;
                assert_eq!(stats.counts.get("bytes a texel"), Some(bytes));
                let whole = 512 * 512 * bytes;
                assert_eq!(stats.counts.get("bytes of a whole map"), Some(whole));
                // A strip's rows are all that is kept, beside 8 bytes a texel of the projective map and 4 a pixel: 4 rows at least, a
                // MiB or what is asked for, by each thread.
                let kept = (4 * 512 * bytes).max(1 << 20) + 4096;
                let threads = std::thread::available_parallelism().map_or(1, |count| count.get() as u64);
                let beside = 8 * 512 * 512 + 4 * u64::from(width * height) + (64 << 10);
                assert!(stats.memory_bytes <= threads * kept + beside, "{}", stats.memory_bytes);
                rel_rmse(&image, &truth)
            };
            for count in [8, 32, 128] {
                let found = fetch(Basis::Fourier, count, Fetch::Bilinear, Storage::F32);
                // What f32 rows miss, half a texel's weights, and the ringing of louvres that nearly are one plane.
                let allowed = exact + ringing(count) * over_mean + 1.0 / 512.0;
                println!("exact rows {exact:.4}, series of {count}: {found:.4} of {allowed:.4}");
                assert!(found < allowed);
            }
            let series =
                [Fetch::Bilinear, Fetch::Nearest].map(|way| fetch(Basis::Fourier, 32, way, Storage::F32));
            let [half, byte] =
                [Storage::F16, Storage::U8].map(|s| fetch(Basis::Fourier, 32, Fetch::Bilinear, s));
            let moments = [4, 6, 8].map(|count| fetch(Basis::Moments, count, Fetch::Bilinear, Storage::F32));
            println!(
                "bilinear, nearest {series:.4?}; f16 {half:.4}, u8 {byte:.4}; 4, 6, 8 moments {moments:.4?}"
            );
            // A coefficient of a byte is off by 1/255 at most: all 32 by 0.0084 (16 orders, each √2·2/c_k).
            assert!(
                (byte - series[0]).abs() < 0.0084 * over_mean && (half - series[0]).abs() < 0.001 * over_mean
            );
            assert!(moments[1] < exact + ringing(32) * over_mean + 1.0 / 512.0);
        });
    }
}

/// Optical depths of the longest ray, as in the paper's Fig. 3, and what average visibility may be off by at the most, of the
/// unoccluded light: `max over v of (1 − e^{−τv})/(1 − e^{−τ}) − v`.
#[test]
fn a_map_of_one_row_has_no_second_one_to_blend_with() {
    for light in [sun(), lamp()] {
        with_frame(&light, [0.0, 1.4, 0.0], 48, |boards, frame| {
            let frame = &frame.with_map_source(boards);
            let fetch = |fetch, columns, rows| {
                let own_map = OwnMapSettings { columns, rows, splits: 4 };
                let own = options(Some(Rectification::Projective), 48);
                let (image, stats) = render(frame, Options { fetch, own_map, certified: false, ..own });
                assert_eq!(stats.counts.get("walked pixels"), Some(0));
                image.inscattered().iter().map(|rgb| f64::from(rgb[0])).collect::<Vec<_>>()
            };
            let nearest = fetch(Fetch::Nearest, 2048, 1);
            let bilinear = fetch(Fetch::Bilinear, 2048, 1);
            let mean = nearest.iter().sum::<f64>() / nearest.len() as f64;
            let off = bilinear.iter().zip(&nearest).map(|(a, b)| (a - b).abs()).sum::<f64>();
            let off = off / nearest.len() as f64 / mean;
            println!("one row: bilinear and nearest fetches are {off:.1e} apart");
            // They differ by half a texel along the row, of which a split has 512: about that part of the light.
            assert!(off < 2.0 / 512.0);
            // One column, and one texel, have a mean all the same.
            for (columns, rows) in [(4, 64), (4, 1)] {
                assert!(fetch(Fetch::Bilinear, columns, rows).iter().all(|value| value.is_finite()));
            }
        });
    }
}

#[test]
fn reference_rays_mend_what_average_visibility_misses_in_thick_media() {
    let depths = [0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0];
    let mut curve = Vec::new();
    for tau in depths {
        with_frame(&sun(), [0.0, 1.4, 0.0], 512, |_, frame| {
            let medium = Medium::homogeneous([tau / END; 3], [0.0; 3], Phase::Isotropic).unwrap();
            let (camera, light) = (frame.camera(), frame.light());
            let frame = Frame::new(camera, frame.depth(), light, frame.shadow(), &medium, 50.0).unwrap();
            let own = options(Some(Rectification::Resampled), 1);
            let (exact, _) = render(&frame, own);
            let truth: Vec<f64> = exact.inscattered().iter().map(|rgb| f64::from(rgb[0])).collect();
            // A series long enough for its ringing to be the same small part of both.
            let filtered = Options { basis: Basis::Fourier, coefficients: 128, certified: false, ..own };
            let [average, reference] = [Weighting::Average, Weighting::Reference].map(|weighting| {
                rel_rmse(&render(&frame, Options { weighting: Some(weighting), ..filtered }).0, &truth)
            });
            println!("optical depth {tau}: average {average:.4}, reference {reference:.4}");
            curve.push([average, reference]);
        });
    }
    let ringing = curve[0][1];
    // Where light is thin both are the series' own error; from an optical depth of 1 on average visibility is off by far more, and
    // the reference rays are not.
    assert!((curve[0][0] - ringing).abs() < 0.02 * ringing + 0.01 / 8.0);
    assert!(curve.windows(2).all(|pair| pair[1][0] > 0.9 * pair[0][0]));
    assert!(curve[4..].iter().all(|[average, reference]| average > &(2.0 * reference)), "{curve:?}");
}

/// View rays of which some run nearly along the light, through a thick medium: no one reference ray stands for all of a row.
#[test]
fn fetches_hold_where_view_rays_come_near_the_light() {
    with_frame(&sun(), [0.2, 2.9, 2.4], 512, |_, frame| {
        let (camera, light) = (frame.camera(), frame.light());
        let medium = Medium::homogeneous([2.0 / END; 3], [0.0; 3], Phase::Isotropic).unwrap();
        let frame = Frame::new(camera, frame.depth(), light, frame.shadow(), &medium, 50.0).unwrap();
        let given = options(Some(Rectification::Resampled), 512);
        let truth: Vec<f64> =
            render(&frame, given).0.inscattered().iter().map(|rgb| f64::from(rgb[0])).collect();
        let fetched = Options { basis: Basis::Fourier, coefficients: 128, certified: false, ..given };
        let (image, stats) = render(&frame, Options { fetch: Fetch::Bilinear, ..fetched });
        let off = rel_rmse(&image, &truth);
        println!("fetched {off:.4}, {:?} reference rays", stats.counts.get("reference rays"));
        assert!(stats.modelled.get("rows-of-a-projective-map: resampled from the given one").is_some());
        // Weights blended over steps of one optical depth miss 1/48 of a ray's light at the most; ringing and the map's texels are far
        // below. With one reference a row it is 0.036.
        assert!(off < 1.0 / 48.0, "{off}");
    });
}

/// A given map that holds a part of what the view rays cross: behind it all is lit, and a fetched mean says so.
#[test]
fn what_lies_behind_the_given_map_is_lit_however_rows_are_asked() {
    with_frame(&sun(), [0.0, 1.4, 0.0], 16, |boards, frame| {
        let Light::Directional(sun) = frame.light() else { unreachable!("a sun") };
        let forward = sun.direction();
        let origin = DVec3::new(0.0, 2.0, 3.5) - forward * 30.0;
        let up = [0.0, 0.0, -1.0];
        // Of the twelve units of a view ray it ends after some four.
        let half = [14.0, 3.0];
        let projection =
            MapProjection::orthographic(origin.to_array(), forward.to_array(), up, half, [512; 2]).unwrap();
        let texels = boards.map(projection);
        let shadow = ShadowMap::Orthographic(ShadowLayer::new(projection, &texels).unwrap());
        let frame =
            Frame::new(frame.camera(), frame.depth(), frame.light(), &shadow, frame.medium(), 50.0).unwrap();
        let given = options(Some(Rectification::Resampled), 512);
        let (rows, _) = render(&frame, given);
        let truth: Vec<f64> = rows.inscattered().iter().map(|rgb| f64::from(rgb[0])).collect();
        let (own, _) = render(&frame, options(Some(Rectification::Projective), 512));
        let fetched = Options { basis: Basis::Fourier, coefficients: 128, certified: false, ..given };
        let (fetched, _) = render(&frame, Options { fetch: Fetch::Bilinear, ..fetched });
        let [own, fetched] = [own, fetched].map(|image| rel_rmse(&image, &truth));
        println!("own map {own:.4}, fetched {fetched:.4}");
        // Texels of both, as where the map holds all; and the ringing of 128 coefficients.
        assert!(own < 0.02 && fetched < own + ringing(128) + 0.01, "{own} {fetched}");
    });
}
