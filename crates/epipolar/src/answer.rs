//! One slice answers pixels: its light rays are rectified, and the lit part of each pixel's ray is summed.
//!
//! All stages of a slice run one after the other on the same few kilobytes, so that rectified rows never leave the
//! innermost caches; only shares come out.

use std::ops::Range;

use scatter_core::{Camera, Frame, Level, Light, MapProjection, ShadowLayer, ShadowMap};

use crate::asks::{Asks, OpenAsks};
use crate::epipole::Epipole;
use crate::extrema::Extrema;
use crate::integrand::{BandTables, Integrand};
use crate::integrate::{Integrator, IntegratorScratch, Problem, Queries, RunIndex, Runs, integrate};
use crate::map_line::{ColumnOrder, MapLine, turn};
use crate::row::{Cells, Row, Seen};
use crate::shares::EMPTY;
use crate::slice_plane::SlicePlane;
use crate::slices::{Major, Slice};
use crate::tables::{Table, Views, share_of};
use crate::tint::TintedRow;

/// Length of a view ray that never ends: far enough for any lamp, and its products stay within f32.
const FARTHEST: f64 = 1e18;

/// What all slices of a frame share.
pub struct Answerer<'a> {
    frame: &'a Frame<'a>,
    camera: &'a Camera,
    pub epipole: Epipole,
    integrand: &'a Integrand,
    extrema: &'a Extrema,
    integrator: Option<Integrator>,
    split_over: f32,
    cells: Cells,
    /// Sine of the angle to the light below which pixels are left to be walked; 0 leaves none.
    ring: f32,
    level: Level,
    /// Channels whose shares differ, 1 or 3.
    pub channels: usize,
    /// Distance of a lamp from the eye.
    lamp: Option<f64>,
    /// Where rays end that are longer.
    pub longest: f32,
}

/// How slices are to be summed.
#[derive(Debug, Clone, Copy)]
pub struct Manner {
    /// By which algorithm; `None` takes the fastest for each slice.
    pub integrator: Option<Integrator>,
    /// Columns that a texel may hide before it is cut exactly.
    pub split_over: f32,
    /// Where the cells of rows lie.
    pub cells: Cells,
    /// Sine of the angle to the light below which pixels are walked, ray by ray; 0 for none.
    pub ring: f32,
    /// With which instructions.
    pub level: Level,
}

/// Buffers of a worker for one slice.
#[derive(Debug, Default)]
pub struct SliceBuffers {
    row: Row,
    tinted: TintedRow,
    index: RunIndex,
    sines: Vec<f32>,
    cosines: Vec<f32>,
    views: Vec<f32>,
    /// The factors of each column of a band.
    view_terms: Vec<f32>,
    cone: Vec<f32>,
    lamp_prefix: Vec<f32>,
    prefix: Vec<f32>,
    band: BandBuffers,
    integrator: IntegratorScratch,
    pub counts: Counts,
}

/// Counts that do not depend on the machine.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counts {
    pub slices: u64,
    pub texels: u64,
    pub runs: u64,
    pub queries: u64,
}

impl SliceBuffers {
    /// Grows all buffers to what any slice of such a frame may need.
    pub fn reserve(&mut self, frame: &Frame<'_>, map_side: usize, asks: usize, integrand: &Integrand) {
        let (size, terms) = (frame.size(), integrand.lanes());
        let columns = size[0].max(size[1]) as usize;
        // Every texel column of up to five faces has two cells; around the epipole cells are split.
        let mut runs = 8 * map_side + 8 * columns + 64;
        self.row.clear(runs);
        if let Some(texture) = frame.texture() {
            let [width, height] = texture.projection().size();
            let side = width.max(height) as usize;
            self.tinted.reserve(runs, side);
            runs += 2 * side + 4;
        }
        let grow = |buffer: &mut Vec<f32>, length: usize| buffer.resize(length.max(buffer.len()), 0.0);
        for buffer in [&mut self.sines, &mut self.cosines, &mut self.views] {
            grow(buffer, columns);
        }
        grow(&mut self.prefix, (runs + 1) * terms);
        grow(&mut self.view_terms, columns * terms);
        let BandBuffers { ranks, ends, sums, wholes } = &mut self.band;
        if ranks.len() < asks {
            ranks.resize(asks, 0);
        }
        grow(wholes, asks);
        grow(ends, asks * terms);
        grow(sums, asks * terms);
        grow(&mut self.lamp_prefix, integrand.buffer_len());
        // A lamp without a cone must not shine through that of the frame before.
        self.cone.clear();
        self.cone.reserve(integrand.buffer_len());
        self.integrator.reserve(runs, columns, asks, terms);
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let floats = [
            &self.sines,
            &self.cosines,
            &self.views,
            &self.view_terms,
            &self.cone,
            &self.lamp_prefix,
            &self.prefix,
            &self.band.ends,
            &self.band.sums,
            &self.band.wholes,
        ];
        self.row.memory_bytes()
            + self.tinted.memory_bytes()
            + self.integrator.memory_bytes()
            + size_of::<RunIndex>()
            + 4 * self.band.ranks.capacity()
            + 4 * floats.iter().map(|buffer| buffer.capacity()).sum::<usize>()
    }
}

impl<'a> Answerer<'a> {
    /// For a frame and its factors; `channels` (1 or 3) have shares of their own.
    pub fn new(
        frame: &'a Frame<'a>,
        epipole: Epipole,
        integrand: &'a Integrand,
        extrema: &'a Extrema,
        manner: Manner,
        channels: usize,
    ) -> Self {
        let camera = frame.camera();
        let lamp = frame.light().position().map(|position| (position - camera.eye()).length());
        let longest = if lamp.is_some() { FARTHEST } else { integrand.longest() };
        Self {
            frame,
            camera,
            epipole,
            integrand,
            extrema,
            integrator: manner.integrator,
            split_over: manner.split_over,
            cells: manner.cells,
            ring: manner.ring,
            level: manner.level,
            channels,
            lamp,
            longest: longest.min(frame.max_distance()) as f32,
        }
    }

    /// Answers all of `asks`, whose columns count from `columns[0]`.
    #[inline(always)]
    pub fn answer(
        &self,
        slice: &Slice,
        (major, fan_ascending): (Major, bool),
        columns: [u32; 2],
        asks: &mut Asks,
        buffers: &mut SliceBuffers,
    ) {
        let order = ColumnOrder { columns, ascending: fan_ascending == self.epipole.outward };
        let plane = SlicePlane::new(self.camera, &self.epipole, slice, major);
        let count = order.count();
        plane.angles(columns[0], &mut buffers.sines[..count], &mut buffers.cosines[..count]);
        self.view_coordinates(count, buffers);
        let spot = match self.frame.light() {
            Light::Spot(spot) => Some(spot),
            Light::Directional(_) | Light::Point(_) => None,
        };
        self.integrand.fill_cone(spot, &plane, &mut buffers.cone);
        let reach = self.place(asks, buffers);
        self.rectify(&plane, order, reach, buffers);
        let texture = self.frame.texture();
        if let Some(texture) = texture {
            let line = self.line(texture.projection(), &plane, order, f64::from(reach));
            buffers.tinted.fill(&buffers.row, line.as_ref(), texture);
        }
        let starts = if texture.is_some() { buffers.tinted.starts() } else { buffers.row.starts() };
        buffers.index.fill(starts, reach, asks.len());
        let (gammas, runs) = asks.gammas_and_runs();
        buffers.index.find(starts, gammas, runs);
        buffers.counts.slices += 1;
        buffers.counts.queries += asks.len() as u64;
        buffers.counts.runs += starts.len() as u64 - 1;
        for factors in 0..self.integrand.channels() {
            self.sum_bands(factors, order, asks, buffers);
        }
        if self.ring > 0.0 {
            for channel in 0..self.channels {
                let (columns, shares) = asks.shares_mut(channel);
                for (share, &column) in shares.iter_mut().zip(columns) {
                    *share = if buffers.sines[column as usize] < self.ring { EMPTY } else { *share };
                }
            }
        }
    }

    /// The factors' coordinate of each view ray: 1/sin β for a sun, β for a lamp.
    #[inline(always)]
    fn view_coordinates(&self, count: usize, buffers: &mut SliceBuffers) {
        let views = &mut buffers.views[..count];
        if self.lamp.is_none() {
            for (view, sine) in views.iter_mut().zip(&buffers.sines) {
                *view = 1.0 / sine;
            }
        } else {
            for (view, (sine, cosine)) in views.iter_mut().zip(buffers.sines.iter().zip(&buffers.cosines)) {
                *view = sine.atan2(*cosine);
            }
        }
    }

    /// Finds the light ray in which each pixel's ray ends; returns the farthest one.
    #[inline(always)]
    fn place(&self, asks: &mut Asks, buffers: &SliceBuffers) -> f32 {
        let (columns, ends, gammas) = asks.ends_and_gammas();
        let (sines, cosines) = (&buffers.sines[..], &buffers.cosines[..]);
        let places = gammas.iter_mut().zip(columns.iter().zip(ends));
        match self.lamp {
            None => {
                for (gamma, (&column, &end)) in places {
                    *gamma = end * sines[column as usize];
                }
            }
            Some(distance) => {
                let distance = distance as f32;
                for (gamma, (&column, &end)) in places {
                    let (sine, cosine) = (sines[column as usize], cosines[column as usize]);
                    *gamma = turn(distance - end * cosine, end * sine);
                }
            }
        }
        // Light rays are ≥ 0: their bits are in the same order, and integers have a vector maximum that needs no order.
        f32::from_bits(gammas.iter().fold(0, |most, gamma| most.max(gamma.to_bits())))
    }

    /// Rectifies the light rays of a slice up to `reach`.
    #[inline(always)]
    fn rectify(&self, plane: &SlicePlane, order: ColumnOrder, reach: f32, buffers: &mut SliceBuffers) {
        let columns = order.count() as u32;
        let seen = Seen { cells: self.cells, columns, split_over: self.split_over };
        let reach = f64::from(reach);
        let row = &mut buffers.row;
        row.clear(0);
        row.push(0.0, columns);
        let mut append = |line: MapLine, layer: &ShadowLayer<'_>, index: usize| {
            let extrema = self.extrema.layer(index);
            let read = row.append(self.level, &line, layer.texels(), extrema, seen);
            buffers.counts.texels += u64::from(read);
            // Outside of the map nothing is shadowed.
            row.push(line.gamma.at(line.length), columns);
        };
        match self.frame.shadow() {
            ShadowMap::Orthographic(layer) | ShadowMap::Perspective(layer) => {
                if let Some(line) = self.line(layer.projection(), plane, order, reach) {
                    append(line, layer, 0);
                }
            }
            ShadowMap::Cube(cube) => {
                let mut faces: [_; 6] = std::array::from_fn(|face| {
                    let line = self.line(cube.face(face).projection(), plane, order, reach);
                    line.map(|line| (line.gamma.at(0.0), face, line))
                });
                // In the order of γ; `None` first.
                faces.sort_unstable_by(|a, b| {
                    let start =
                        |face: &Option<(f32, usize, MapLine)>| face.as_ref().map_or(-1.0, |face| face.0);
                    start(a).total_cmp(&start(b))
                });
                let mut covered = -1.0;
                for (_, face, line) in faces.into_iter().flatten() {
                    // Along the edge between two faces both have the same light rays.
                    let end = line.gamma.at(line.length);
                    if end > covered {
                        append(line, &cube.face(face), face);
                        covered = end;
                    }
                }
            }
            ShadowMap::Unshadowed | ShadowMap::Faces(_) | ShadowMap::Cascades(_) => {}
        }
        row.finish();
    }

    /// The slice's line through a map of the light.
    #[inline(always)]
    fn line(
        &self,
        projection: &MapProjection,
        plane: &SlicePlane,
        order: ColumnOrder,
        reach: f64,
    ) -> Option<MapLine> {
        match self.lamp {
            None => MapLine::sun(projection, self.camera.eye(), plane, order, reach),
            Some(distance) => MapLine::lamp(projection, plane, order, distance, reach),
        }
    }

    /// Sums what has the same factors, band by band: columns of one band follow each other.
    #[inline(always)]
    fn sum_bands(&self, factors: usize, order: ColumnOrder, asks: &mut Asks, buffers: &mut SliceBuffers) {
        // Colours of glass share the factors of grey media.
        let channels = if self.integrand.channels() == 1 { 0..self.channels } else { factors..factors + 1 };
        let mut first = 0;
        while first < asks.len() {
            let column = asks.columns()[first] as usize;
            let views = &buffers.views[..order.count()];
            let (band, [from, to]) = self.integrand.band_of(factors, views[column]);
            let beyond = |&view: &f32| !(view >= from && view < to);
            let end = views[column..].iter().position(beyond).map_or(views.len(), |width| column + width);
            // A view that is not a number is in a band of its own.
            let end = end.max(column + 1);
            let last = first + asks.columns()[first..].partition_point(|&column| (column as usize) < end);
            let mut prefix = std::mem::take(&mut buffers.lamp_prefix);
            let (tables, lanes) = self.integrand.tables(factors, band, &buffers.cone, &mut prefix);
            let (asked, channels) = (first..last, channels.clone());
            match lanes {
                1 => self.sum_band::<1>(&tables, asked, channels, order, asks, buffers),
                2 => self.sum_band::<2>(&tables, asked, channels, order, asks, buffers),
                4 => self.sum_band::<4>(&tables, asked, channels, order, asks, buffers),
                _ => self.sum_band::<8>(&tables, asked, channels, order, asks, buffers),
            }
            buffers.lamp_prefix = prefix;
            first = last;
        }
    }

    /// Sums the asks `range`, whose columns are of one band, for some channels.
    #[inline(always)]
    fn sum_band<const N: usize>(
        &self,
        tables: &BandTables<'_>,
        range: Range<usize>,
        channels: Range<usize>,
        order: ColumnOrder,
        asks: &mut Asks,
        buffers: &mut SliceBuffers,
    ) {
        let glass = self.frame.texture().map(|_| &buffers.tinted);
        let (starts, lit) = match glass {
            Some(tinted) => (tinted.starts(), tinted.lit()),
            None => (buffers.row.starts(), buffers.row.lit()),
        };
        let OpenAsks { columns, gammas, runs: ask_runs, shares } = asks.open(range);
        let count = columns.len();
        let runs = ask_runs.iter().fold(0, |a, &b| a.max(b)) as usize + 1;
        // ∫Γ up to the starts of runs, and up to the ends of the pixels' rays.
        let table = Table::<N>::new(tables.prefix, 0.0, tables.per_gamma);
        let prefix = &mut buffers.prefix.as_chunks_mut::<N>().0[..=runs];
        table.read(&starts[..=runs], prefix);
        let BandBuffers { ranks, ends, sums, wholes } = &mut buffers.band;
        let (ends, sums) =
            (&mut ends.as_chunks_mut::<N>().0[..count], &mut sums.as_chunks_mut::<N>().0[..count]);
        table.read(gammas, ends);
        // B of the columns.
        let [from, to] = [columns[0], columns[count - 1]];
        let views = &mut buffers.view_terms.as_chunks_mut::<N>().0[..=(to - from) as usize];
        let weights = Table::<N>::new(tables.weights, tables.first_view as f32, tables.per_view);
        weights.read(&buffers.views[from as usize..][..views.len()], views);
        let views = Views { terms: views, first: from };
        let wholes = &mut wholes[..count];
        sums.copy_from_slice(ends);
        views.weigh(columns, sums, wholes);

        let ranks = &mut ranks[..count];
        for (rank, &column) in ranks.iter_mut().zip(columns) {
            *rank = order.rank(order.columns[0] + column);
        }
        let [a, b] = [ranks[0], ranks[count - 1]];
        let integrator = self.integrator.unwrap_or_else(|| Integrator::fastest_for(count, runs));
        for channel in channels {
            let problem = Problem {
                runs: Runs {
                    lit: &lit[..runs],
                    prefix,
                    tint: glass.map(|tinted| &tinted.tint(channel)[..runs]),
                    columns: [a.min(b), a.max(b) + 1],
                },
                queries: Queries { ranks, runs: ask_runs },
                ends,
                ascending: order.ascending,
            };
            integrate(integrator, &problem, &mut buffers.integrator, sums);
            let shares = &mut shares[channel][..count];
            views.weigh(columns, sums, shares);
            // Glass may brighten.
            let brightest = if glass.is_some() { f32::MAX } else { 1.0 };
            share_of(wholes, brightest, shares);
        }
    }
}

/// What a band's asks are answered with: a number each, or one a term.
#[derive(Debug, Default)]
struct BandBuffers {
    /// Column, counted from the light.
    ranks: Vec<u32>,
    /// `∫Γ` up to the end of its ray, the lit part of it, and the whole one weighed by the column's B.
    ends: Vec<f32>,
    sums: Vec<f32>,
    wholes: Vec<f32>,
}
