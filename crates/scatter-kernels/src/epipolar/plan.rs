//! A frame of `epipolar` as bytes: slices, lines, tasks and tables, in batches of slices whose rows fit one buffer.

use epipolar::baran::Bands;
use epipolar::geometry::{ColumnOrder, Epipole, FanPixels, Major, STEEPEST, SlicePlane, SliceSet};
use epipolar::rows::for_each_sun_line;
use glam::DVec2;
use scatter_core::{Setup, Window};

use super::factor_tables::{BAND_RATIO, FactorTables, TERMS};
use super::records::{EpipolarUniform, GROUPS_A_ROW, MOST_BANDS, SliceData, SliceLine, SliceTask};
use super::room::{CUTS_A_COLUMN, CUTS_A_ROW, RUN_BYTES, Room};
use super::settings::{COARSEST_SPACING, EpipolarSettings, FINEST_SPACING, LEAST_TOWARDS_LIGHT};
use super::slice_records::{FanColumns, border_bits, cut_tasks, fixed_border, largest_sine, too_near};
use crate::plan::{MOST_SIDE, TooLarge};

/// The plan of a frame. Buffers are reused: a frame of the same size and settings allocates nothing.
#[derive(Debug, Clone, Default)]
pub struct EpipolarPlan {
    slices: SliceSet,
    pixels: Vec<FanPixels>,
    records: Vec<SliceData>,
    lines: Vec<SliceLine>,
    tasks: Vec<SliceTask>,
    ranges: Vec<[i32; 2]>,
    factors: FactorTables,
    nodes: Vec<[i32; TERMS]>,
    uniforms: Vec<EpipolarUniform>,
    room: Room,
    size: [u32; 2],
    spacing: f64,
    has_maps: bool,
    has_fog: bool,
    channels: u32,
}

/// What a frame does, counted from the plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EpipolarCounts {
    /// Slices, each a workgroup of `rows`.
    pub slices: u64,
    /// Tasks, each a workgroup a channel of `sums`.
    pub tasks: u64,
    /// Batches.
    pub batches: u64,
    /// Texel columns of all lines: one or two loads each.
    pub texel_columns: u64,
    /// Questions that pixels ask of slices: two each.
    pub asks: u64,
    /// Global atomic additions: one an ask and channel.
    pub answer_atomics: u64,
    /// Workgroup atomic additions at the most: eight a run, task and channel, if rows were full.
    pub most_sum_atomics: u64,
    /// Bytes of the set-up that the CPU writes.
    pub written_bytes: u64,
    /// Bytes of all buffers.
    pub memory_bytes: u64,
}

impl EpipolarPlan {
    /// Plans a frame of a sun, seen by a perspective camera (the capabilities' part to check).
    ///
    /// # Errors
    ///
    /// What WebGPU's guaranteed limits do not hold: maps of more than 8192 texels a side, more than 131,072 slices (views of nearly
    /// half of all directions), more answers than theirs (4 bytes a pixel and channel).
    pub fn rebuild(&mut self, setup: &Setup<'_>, settings: &EpipolarSettings) -> Result<(), TooLarge> {
        let maps = setup.maps().projections();
        let side = setup.maps().largest_side();
        if side > MOST_SIDE {
            return Err(TooLarge {
                what: "a side of the shadow map",
                needed: side.into(),
                unit: "texels",
                limit: MOST_SIDE.into(),
                cure: "give a smaller map, or cut it into cascades",
            });
        }
        self.size = setup.size();
        self.has_maps = !maps.is_empty();
        self.has_fog = setup.medium().height_falloff().is_some();
        self.channels = if setup.medium().is_grey() { 1 } else { 3 };
        self.factors.rebuild(setup.medium(), setup.max_distance(), settings.factor_error);
        let [spacing, closest] = spacings(setup, settings);
        self.spacing = spacing;
        let nodes = self.factors.channels().iter().map(|table| table.nodes.len() as u64).sum();
        // Room for the slices of any direction of view: nothing is allocated when the camera turns.
        self.room = Room::of(self.size, maps, (closest, settings.batch_bytes), (self.channels, nodes))?;
        self.records.clear();
        self.lines.clear();
        self.tasks.clear();
        self.ranges.clear();
        self.uniforms.clear();
        if self.has_maps {
            self.lay(setup);
        } else {
            let uniform = self.uniform(setup, None);
            self.uniforms.push(uniform);
        }
        Ok(())
    }

    /// What is too large of a frame, without planning it.
    pub fn check(setup: &Setup<'_>, settings: &EpipolarSettings) -> Result<(), TooLarge> {
        let channels = if setup.medium().is_grey() { 1 } else { 3 };
        let [_, closest] = spacings(setup, settings);
        Room::of(setup.size(), setup.maps().projections(), (closest, settings.batch_bytes), (channels, 0))
            .map(drop)
    }

    /// Distributes slices, and writes what the passes read of them.
    fn lay(&mut self, setup: &Setup<'_>) {
        let camera = setup.camera();
        let epipole = Epipole::new(camera, setup.light());
        self.slices.distribute(&epipole, self.size, self.spacing);
        self.pixels.resize_with(self.slices.fans.len().max(self.pixels.len()), FanPixels::default);
        let bands = Bands::cover(camera, &epipole, &self.slices, BAND_RATIO, STEEPEST);
        // Octaves from the smallest 1/sin β on, in all frames alike.
        // In fog all columns are one band.
        let octaves = if self.has_fog { 1 } else { bands.count.clamp(1, MOST_BANDS as u32) };
        let bits = border_bits(self.size);
        let shared = self.uniform(setup, Some((&epipole, bands.lowest, bits)));
        let longest = self.longest(setup);
        let inward = !epipole.outward;
        let most_runs = (self.room.rows / RUN_BYTES) as u32;
        let mut next_run = 0;
        let mut batch = shared;
        for (index, fan) in self.slices.fans.iter().enumerate() {
            let pixels = &mut self.pixels[index];
            pixels.find(&epipole, self.size, fan, &self.slices.slices);
            let breadth = f64::from(if fan.major == Major::X { self.size[1] } else { self.size[0] });
            let columns = FanColumns { fan, pixels, breadth };
            let first_range = self.ranges.len() as u32;
            if fan.ascending {
                self.ranges.extend_from_slice(&pixels.ranges);
            } else {
                self.ranges.extend(pixels.ranges.iter().rev());
            }
            let order = ColumnOrder { columns: pixels.columns, ascending: fan.ascending == epipole.outward };
            let mut border = None;
            for (number, slice) in self.slices.slices[fan.first..][..fan.count].iter().enumerate() {
                let plane = SlicePlane::new(camera, &epipole, slice, fan.major);
                let line = columns.line_of(slice);
                let mut record = columns.record(&plane, number, first_range);
                border = Some(fixed_border(line, bits, border));
                record.border = border.unwrap_or_default();
                let inside = columns.inside(line, 2.0 * self.spacing + 2.0);
                record.first_line = self.lines.len() as u32;
                record.room = 2 + CUTS_A_ROW + CUTS_A_COLUMN * record.column_count;
                if inside[0] < inside[1] {
                    // A little farther: γ is an f32.
                    let reach = longest * largest_sine(&plane, columns.first(), inside) * (1.0 + 1e-5);
                    for_each_sun_line(
                        setup.maps().projections().len(),
                        |layer| &setup.maps().projections()[layer],
                        camera.eye(),
                        (&plane, order),
                        reach,
                        |layer, line| {
                            record.room += 2 * line.columns + 1;
                            self.lines.push(SliceLine::new(layer, &line));
                        },
                    );
                }
                record.line_count = self.lines.len() as u32 - record.first_line;
                // A number before the runs, and an end behind them.
                let needed = record.room + 2;
                if next_run + needed > most_runs {
                    let first = [self.records.len() as u32, self.tasks.len() as u32];
                    batch = closed(batch, first);
                    self.uniforms.push(batch);
                    batch.batch = [first[0], 0, first[1], 0];
                    next_run = 0;
                }
                record.first_run = next_run;
                next_run += needed;
                let slice = self.records.len() as u32;
                let plane = (&plane, columns.first(), record.column_count);
                cut_tasks(plane, inside, (bands.lowest, octaves), inward, |task| {
                    self.tasks.push(SliceTask { slice, ..task });
                });
                self.records.push(record);
            }
        }
        self.uniforms.push(closed(batch, [self.records.len() as u32, self.tasks.len() as u32]));
    }

    /// What all batches share.
    fn uniform(&mut self, setup: &Setup<'_>, slices: Option<(&Epipole, f64, u32)>) -> EpipolarUniform {
        let mut uniform: EpipolarUniform = bytemuck::Zeroable::zeroed();
        let [width, height] = self.size;
        let channels = self.channels;
        let Some((epipole, lowest, bits)) = slices else {
            uniform.counts = [channels, 0, 0, width * height];
            return uniform;
        };
        uniform.counts = [channels, bits, u32::from(!epipole.outward), width * height];
        uniform.walked = too_near(epipole, self.size);
        uniform.reach = [self.longest(setup) as f32, 1.0, 0.0, 0.0];
        self.nodes.clear();
        for (channel, table) in self.factors.channels().iter().enumerate() {
            uniform.tables[channel] = [self.nodes.len() as u32, table.intervals(), table.bits, 0];
            uniform.units[channel] = table.units;
            self.nodes.extend_from_slice(&table.nodes);
            for band in 0..MOST_BANDS {
                let start = lowest * BAND_RATIO.powi(band as i32);
                let places = f64::from(table.intervals() << table.bits);
                uniform.bands[channel][band] = [
                    (places * start / table.length) as f32,
                    start as f32,
                    (2.0 / (start * (BAND_RATIO - 1.0))) as f32,
                    0.0,
                ];
            }
        }
        uniform
    }

    /// Where rays end that are longer. In fog nothing is negligible at a distance that would be the same for all rays.
    fn longest(&self, setup: &Setup<'_>) -> f64 {
        let farthest = setup.max_distance().min(f64::from(crate::FARTHEST));
        if self.has_fog { farthest } else { self.factors.longest().min(farthest) }
    }

    /// Bytes of the buffers.
    pub fn room(&self) -> &Room {
        &self.room
    }

    /// Whether slices are integrated at all: without maps everything is lit.
    pub fn has_slices(&self) -> bool {
        self.has_maps
    }

    /// Whether view rays visit their runs (height fog) instead of being summed.
    pub fn has_fog(&self) -> bool {
        self.has_fog
    }

    /// Distance of the slices \[pixels\].
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// The slices in their order.
    pub fn slices(&self) -> &[SliceData] {
        &self.records
    }

    /// Their lines.
    pub fn lines(&self) -> &[SliceLine] {
        &self.lines
    }

    /// Their tasks.
    pub fn tasks(&self) -> &[SliceTask] {
        &self.tasks
    }

    /// Per fan and column, from the epipole on, the fan's first pixel and the one behind its last.
    pub fn ranges(&self) -> &[[i32; 2]] {
        &self.ranges
    }

    /// The tables of all channels.
    pub fn nodes(&self) -> &[[i32; TERMS]] {
        &self.nodes
    }

    /// One a batch.
    pub fn uniforms(&self) -> &[EpipolarUniform] {
        &self.uniforms
    }

    /// The bound of the factorisation's error.
    pub fn factor_bound(&self) -> f64 {
        self.factors.channels().iter().map(|table| table.bound()).fold(0.0, f64::max)
    }

    /// Workgroups of `rows` and of `sums` of a batch; zeros of one that the frame does not have.
    pub fn groups(&self, batch: usize) -> [[u32; 3]; 2] {
        let Some(uniform) = self.uniforms.get(batch).filter(|_| self.has_maps) else { return [[0; 3]; 2] };
        let groups =
            |count: u32, channels: u32| [count.min(GROUPS_A_ROW), count.div_ceil(GROUPS_A_ROW), channels];
        [groups(uniform.batch[1], 1), groups(uniform.batch[3], if self.has_fog { 1 } else { self.channels })]
    }

    /// What the frame does, as far as it is known before.
    pub fn counts(&self) -> EpipolarCounts {
        let channels = u64::from(self.channels);
        let pixels = self.size.map(u64::from).iter().product::<u64>();
        let asks = if self.has_maps { 2 * pixels } else { 0 };
        let full: u64 = self.tasks.iter().map(|task| u64::from(self.records[task.slice as usize].room)).sum();
        let written = size_of_val(&self.records[..])
            + size_of_val(&self.lines[..])
            + size_of_val(&self.tasks[..])
            + size_of_val(&self.ranges[..])
            + size_of_val(&self.nodes[..])
            + size_of_val(&self.uniforms[..]);
        EpipolarCounts {
            slices: self.records.len() as u64,
            tasks: self.tasks.len() as u64,
            batches: if self.has_maps { self.uniforms.len() as u64 } else { 0 },
            texel_columns: self.lines.iter().map(|line| u64::from(line.columns)).sum(),
            asks,
            answer_atomics: asks * channels,
            most_sum_atomics: if self.has_fog { 0 } else { 8 * full * channels },
            written_bytes: written as u64,
            memory_bytes: self.room.bytes(),
        }
    }
}

/// A batch that ends before a slice and a task.
fn closed(mut uniform: EpipolarUniform, [slice, task]: [u32; 2]) -> EpipolarUniform {
    uniform.batch[1] = slice - uniform.batch[0];
    uniform.batch[3] = task - uniform.batch[2];
    uniform
}

/// Pictures from the middle, along either axis, within which a light before the camera has all of its effect on the spacing, and
/// from which on it has none.
const NEAR_PICTURE: [f64; 2] = [0.25, 1.25];

/// What is left of the spacing: the settings' share with the light in the middle of the picture, 1 far beside it or behind.
fn share_towards_light(setup: &Setup<'_>, share: f64) -> f64 {
    let epipole = Epipole::new(setup.camera(), setup.light());
    let size = DVec2::from(setup.size().map(f64::from));
    let [near, far] = NEAR_PICTURE.map(|pictures| pictures * epipole.image.z);
    let from_middle = (epipole.towards(0.5 * size) / size).abs().max_element();
    if !epipole.outward || from_middle >= far {
        return 1.0;
    }
    share + (1.0 - share) * ((from_middle - near) / (far - near)).max(0.0)
}

/// The spacing of a frame, and the closest that one with these settings has in any direction of view: shares of what it is far
/// from the light, as far as there may be so many slices.
fn spacings(setup: &Setup<'_>, settings: &EpipolarSettings) -> [f64; 2] {
    let elsewhere = spacing_elsewhere(setup, settings);
    let possible = Room::closest_slices(setup.size()).min(elsewhere);
    let share = settings.towards_light.clamp(LEAST_TOWARDS_LIGHT, 1.0);
    [share_towards_light(setup, share), share].map(|share| (share * elsewhere).max(possible))
}

/// The spacing of a frame that looks elsewhere: that of the settings, or less where the view is wide.
fn spacing_elsewhere(setup: &Setup<'_>, settings: &EpipolarSettings) -> f64 {
    let Window { left, right, bottom, top } = setup.camera().window();
    let [width, height] = setup.size().map(f64::from);
    // Pixels a radian in the middle of the image, along the coarser axis.
    let per_radian = (width / (right - left).abs()).min(height / (top - bottom).abs());
    let spacing = settings.spacing.clamp(FINEST_SPACING, COARSEST_SPACING);
    spacing.min(per_radian / settings.fewest_slices.max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::MOST_BINDING_BYTES;
    use scatter_core::{Camera, Light, MapKind, MapLayout, MapProjection, Medium, Phase, Quality};

    fn planned(
        size: [u32; 2],
        maps: (u32, usize),
        sigma: [f64; 3],
        settings: EpipolarSettings,
    ) -> Result<EpipolarPlan, TooLarge> {
        looking([0.3, -0.2, -1.0], size, maps, sigma, settings)
    }

    /// The light comes from (−0.3, 1, 0.4).
    fn looking(
        target: [f64; 3],
        size: [u32; 2],
        (side, cascades): (u32, usize),
        sigma: [f64; 3],
        settings: EpipolarSettings,
    ) -> Result<EpipolarPlan, TooLarge> {
        let camera = Camera::perspective([0.0; 3], target, [0.0, 0.1, 1.0], 60.0, size).unwrap();
        let travel = [0.3, -1.0, -0.4];
        let sun = Light::directional(travel, [1.0; 3]).unwrap();
        let maps: Vec<_> = (1..=cascades)
            .map(|n| {
                let half = 10.0 * 3f64.powi(n as i32);
                MapProjection::orthographic([0.0, 50.0, 0.0], travel, [1.0, 0.0, 0.0], [half; 2], [side; 2])
                    .unwrap()
            })
            .collect();
        let layout = MapLayout::new(MapKind::Cascades, &maps).unwrap();
        let medium = Medium::homogeneous(sigma, [0.0; 3], Phase::Isotropic).unwrap();
        let mut plan = EpipolarPlan::default();
        plan.rebuild(&Setup::new(&camera, &sun, layout, &medium, 200.0).unwrap(), &settings)?;
        Ok(plan)
    }

    /// What a plan counts, and that its lists keep to the room that any frame of the size has.
    #[test]
    fn plans_keep_to_their_room_up_to_4k_or_say_what_is_too_large() {
        for (size, maps, level) in [
            ([160, 120], (512, 1), Quality::Film),
            ([1920, 1080], (2048, 1), Quality::Game),
            ([1920, 1080], (2048, 4), Quality::Game),
            ([1920, 1080], (2048, 1), Quality::Film),
            ([3840, 2160], (4096, 4), Quality::Game),
            ([3840, 2160], (8192, 1), Quality::Film),
        ] {
            let plan = planned(size, maps, [0.01; 3], EpipolarSettings::for_quality(level, size)).unwrap();
            let (counts, room) = (plan.counts(), *plan.room());
            println!("{size:?}, {} × {}², {level}: {counts:?}", maps.1, maps.0);
            for (name, bytes, room) in [
                ("slices", size_of_val(plan.slices()), room.slices),
                ("lines", size_of_val(plan.lines()), room.lines),
                ("tasks", size_of_val(plan.tasks()), room.tasks),
                ("ranges", size_of_val(plan.ranges()), room.ranges),
                ("nodes", size_of_val(plan.nodes()), room.nodes),
                ("uniforms", size_of_val(plan.uniforms()), room.uniforms),
            ] {
                assert!(bytes as u64 <= room && room <= MOST_BINDING_BYTES, "{name}: {bytes} of {room}");
            }
            let rows = |slice: &SliceData| u64::from(slice.first_run + slice.room + 2) * RUN_BYTES;
            assert!(plan.slices().iter().map(rows).max() <= Some(room.rows), "rows");
            let tasks: u32 = plan.uniforms().iter().map(|uniform| uniform.batch[3]).sum();
            assert_eq!(tasks as usize, plan.tasks().len());
        }
        // 4 bytes a pixel and channel.
        let rgb = [0.01, 0.02, 0.03];
        let settings = EpipolarSettings::default();
        let said = planned([8192, 8192], (64, 1), rgb, settings).unwrap_err().to_string();
        assert!(said.contains("answers") && said.contains("134217728"), "{said}");
        let many = EpipolarSettings { fewest_slices: 1e6, ..settings };
        let said = planned([64, 64], (64, 1), rgb, many).unwrap_err().to_string();
        assert!(said.contains("epipolar slices"), "{said}");
        let said = planned([64, 64], (8193, 1), rgb, settings).unwrap_err().to_string();
        assert!(said.contains("8192 are possible"), "{said}");
    }

    /// Towards the light slices stand closer, in room that any direction of view has: nothing grows when the camera turns. Where
    /// so many slices are not possible they stand as close as they can.
    #[test]
    fn towards_the_light_slices_stand_closer_in_the_same_room() {
        let settings = |level, size| EpipolarSettings::for_quality(level, size);
        let size = [1280, 960];
        let game = settings(Quality::Game, size);
        let of = |target| looking(target, size, (64, 1), [0.01; 3], game).unwrap();
        // Into the light; 40.5 degrees beside it; across; away from it.
        let views = [[-0.3, 1.0, 0.4], [0.5, 1.0, 0.4], [1.0, 0.3, 0.0], [0.3, -1.0, -0.4]].map(of);
        let spacings = views.each_ref().map(EpipolarPlan::spacing);
        println!("{spacings:?}");
        // 0.45 of half a pixel; and the light 0.54124 pictures beside the middle: 0.5·(0.45 + 0.55·0.29124).
        assert!((spacings[0] - 0.225).abs() < 1e-12 && (spacings[1] - 0.305_090_6).abs() < 1e-6);
        assert_eq!(spacings[2..], [0.5, 0.5]);
        assert!(views.iter().all(|view| view.room() == views[0].room()));
        let huge = [7680, 4320];
        let film = settings(Quality::Film, huge);
        let there = looking([-0.3, 1.0, 0.4], huge, (64, 1), [0.01; 3], film).unwrap().spacing();
        // The sides, 24,000 pixels, over 131,072 slices less those that fans add.
        assert!((there - 0.183_17).abs() < 1e-5, "{there}");
    }

    /// Every column of a slice that pixels can be in is in one task, in its own band.
    #[test]
    fn tasks_cover_the_columns_of_their_slices_once() {
        let plan = planned([97, 61], (64, 1), [0.01; 3], EpipolarSettings::default()).unwrap();
        let lowest = plan.uniforms()[0].bands[0][0][1];
        let mut covered = vec![Vec::new(); plan.slices().len()];
        for task in plan.tasks() {
            let slice = &plan.slices()[task.slice as usize];
            for rank in task.first_rank..task.first_rank + task.column_count {
                let k = if plan.uniforms()[0].counts[2] == 1 { slice.column_count - 1 - rank } else { rank };
                covered[task.slice as usize].push(k);
                let ray = [0, 1].map(|n| slice.view_ray[n] + slice.view_ray[n + 2] * k as f32);
                let octave = (ray[0].hypot(ray[1]) / ray[0] / lowest).log2();
                // A column on a border may be in either.
                assert!((octave - task.band as f32 - 0.5).abs() <= 0.5 + 1e-3, "{octave}, {task:?}");
            }
        }
        for (columns, slice) in covered.iter_mut().zip(plan.slices()) {
            columns.sort_unstable();
            assert!(columns.windows(2).all(|pair| pair[1] == pair[0] + 1), "{columns:?}");
            for k in 0..slice.column_count {
                let minor = f64::from(slice.border[0] + slice.border[1] * k as i32)
                    / f64::from(1u32 << plan.uniforms()[0].counts[1]);
                let breadth = if slice.flags & 4 == 0 { 61.0 } else { 97.0 };
                let is_inside = minor > -1.5 && minor < breadth + 0.5;
                assert!(!is_inside || columns.contains(&k), "column {k} of {slice:?}");
            }
        }
    }
}
