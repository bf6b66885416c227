//! The second, independent way to say what smoke and hair leave of a light ray, for tests: chords by a quadratic, nearest
//! approaches by bisection, and passes by asking every segment of every strand. No code is shared with the first way.

use glam::DVec3;

use crate::scene::Scene;

/// A light by its place or its way.
#[derive(Debug, Clone, Copy)]
pub(crate) enum FarOrNear {
    Sun { travel: DVec3 },
    Lamp { position: DVec3 },
}

/// What is left of the light at `p`, world space.
pub(crate) fn transmittance(scene: &Scene, light: FarOrNear, p: DVec3) -> f64 {
    let (to_light, length) = match light {
        FarOrNear::Sun { travel } => (-travel, f64::INFINITY),
        FarOrNear::Lamp { position } => ((position - p).normalize(), position.distance(p)),
    };
    let mut depth = 0.0;
    for particle in &scene.particles {
        // |p + s·to_light − centre|² = r².
        let from_centre = p - particle.centre;
        let half_linear = from_centre.dot(to_light);
        let discriminant =
            half_linear * half_linear - from_centre.length_squared() + particle.radius * particle.radius;
        if discriminant > 0.0 {
            let root = discriminant.sqrt();
            let (near, far) = ((-half_linear - root).max(0.0), (-half_linear + root).min(length));
            depth += particle.density * (far - near).max(0.0);
        }
    }
    let mut left = (-depth).exp();
    for strand in scene.strands.iter() {
        // Of each segment that is near: number, distance, place along the ray as seen from the light, radius, opacity.
        let mut near = Vec::new();
        for (number, ends) in strand.windows(2).enumerate() {
            let radius = 0.5 * (ends[0].radius + ends[1].radius);
            let opacity = 0.5 * (ends[0].opacity + ends[1].opacity);
            // What lies farther away than its own length is not near.
            let middle = 0.5 * (ends[0].position + ends[1].position) - p;
            let across = (middle - to_light * middle.dot(to_light)).length();
            if across > 0.5 * ends[0].position.distance(ends[1].position) + radius {
                continue;
            }
            let at = |share: f64| {
                let q = ends[0].position + (ends[1].position - ends[0].position) * share - p;
                let towards = q.dot(to_light).min(length);
                ((q - to_light * towards).length(), -towards)
            };
            // The distance is convex along the segment.
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..100 {
                let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
                if at(a).0 <= at(b).0 { high = b } else { low = a }
            }
            let (distance, place) = at(0.5 * (low + high));
            if distance < radius {
                near.push((number, distance, place, radius, opacity));
            }
        }
        let mut passes: Vec<(f64, f64, f64)> = Vec::new();
        let mut index = 0;
        while index < near.len() {
            let mut best = near[index];
            while index + 1 < near.len() && near[index + 1].0 == near[index].0 + 1 {
                index += 1;
                if near[index].1 < best.1 {
                    best = near[index];
                }
            }
            passes.push((best.2, best.3, best.4));
            index += 1;
        }
        passes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut last = f64::NEG_INFINITY;
        for (place, radius, opacity) in passes {
            if place - last > 2.0 * radius {
                last = place;
                // Places are negative on the way from the light to the point.
                if place < 0.0 {
                    left *= 1.0 - opacity;
                }
            }
        }
    }
    left
}

/// Random smoke and hair around the origin.
pub(crate) fn random_occluders(random: &mut scatter_testing::Random, particles: u32, strands: u32) -> Scene {
    use super::{Particle, StrandVertex};
    let mut scene = Scene::default();
    for _ in 0..particles {
        scene.particles.push(Particle {
            centre: random.in_cube(3.0),
            radius: random.range(0.1, 1.2),
            density: random.range(0.1, 2.0),
        });
    }
    for _ in 0..strands {
        let (mut position, count) = (random.in_cube(3.0), 2 + random.index(5));
        let (radius, opacity) = (random.range(0.05, 0.3), random.range(0.1, 1.0));
        let vertices: Vec<StrandVertex> = (0..count)
            .map(|_| {
                position += random.in_cube(0.8);
                StrandVertex { position, radius, opacity }
            })
            .collect();
        scene.strands.push(vertices);
    }
    scene
}
