//! What a frame of exact min/max needs: layers as bytes, nodes, workgroups; and what it reads and writes, counted.

use scatter_core::{RayFan, Setup};

use crate::minmax::tree_layer::{FINEST, TreeLayer};
use crate::plan::{MOST_BINDING_BYTES, MOST_SIDE, TooLarge};

/// Bytes of a node: nearest and farthest depth.
const NODE_BYTES: u64 = 8;

/// Texels along a side of what one workgroup of `extrema_low` reads.
const TILE: u32 = 64;

/// Pixels along a side of a workgroup of `traverse`.
const PIXELS: u32 = 8;

/// The plan of a frame. Buffers are reused: a frame with as many maps as the last one allocates nothing.
#[derive(Debug, Clone, Default)]
pub struct MinMaxPlan {
    layers: Vec<TreeLayer>,
    node_count: u32,
    size: [u32; 2],
    largest: [u32; 2],
    texel_count: u64,
}

/// What the passes do in a frame, counted from the plan; of the traversal only what every ray does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Looks {
    /// Workgroups of `extrema_low`, `extrema_high` and `traverse`.
    pub workgroups: [u64; 3],
    /// Texels that the first pass loads: each once.
    pub texel_loads: u64,
    /// Bytes that the first two write.
    pub node_bytes: u64,
    /// Bytes of everything that the technique allocates for the frame, images and distances not counted.
    pub memory_bytes: u64,
}

impl MinMaxPlan {
    /// Plans a frame.
    ///
    /// # Errors
    ///
    /// Maps of more than 8192 texels a side, and trees of more than 128 MiB together: about 1 byte for a texel and a
    /// half, so that four cascades of 4096² fit and of 8192² do not.
    pub fn rebuild(&mut self, setup: &Setup<'_>) -> Result<(), TooLarge> {
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
        let maps = setup.maps().projections();
        let bytes: u64 = maps.iter().map(|map| NODE_BYTES * node_count(map.size())).sum();
        if bytes > MOST_BINDING_BYTES {
            return Err(TooLarge {
                what: "the min/max trees of the shadow maps",
                needed: bytes,
                unit: "bytes",
                limit: MOST_BINDING_BYTES,
                cure: "give smaller or fewer maps",
            });
        }
        let fan = RayFan::new(setup.camera());
        self.size = setup.size();
        self.layers.clear();
        (self.node_count, self.largest, self.texel_count) = (0, [0; 2], 0);
        for map in maps {
            let (layer, nodes) = TreeLayer::new(&fan, map, self.size, self.node_count);
            self.layers.push(layer);
            self.node_count += nodes;
            self.largest = [0, 1].map(|axis| self.largest[axis].max(map.size()[axis]));
            self.texel_count += map.size().map(u64::from).iter().product::<u64>();
        }
        Ok(())
    }

    /// The layers in their order; none of a light without maps.
    pub fn layers(&self) -> &[TreeLayer] {
        &self.layers
    }

    /// Bytes of the buffer of layers, at least one layer's: bindings are never empty.
    pub fn layer_bytes(&self) -> u64 {
        (self.layers.len().max(1) * size_of::<TreeLayer>()) as u64
    }

    /// Bytes of the buffer of nodes, at least one's.
    pub fn node_bytes(&self) -> u64 {
        NODE_BYTES * u64::from(self.node_count.max(1))
    }

    /// Workgroups of `extrema_low`; zeros where there is no map, as of `extrema_high`.
    pub fn extrema_low(&self) -> [u32; 3] {
        let [columns, rows] = self.largest.map(|n| n.div_ceil(TILE));
        [columns, rows, self.layers.len() as u32]
    }

    /// Workgroups of `extrema_high`.
    pub fn extrema_high(&self) -> [u32; 3] {
        let count = self.layers.len() as u32;
        [count, count.min(1), count.min(1)]
    }

    /// Workgroups of `traverse`.
    pub fn traverse(&self) -> [u32; 3] {
        let [columns, rows] = self.size.map(|n| n.div_ceil(PIXELS));
        [columns, rows, 1]
    }

    /// What the frame costs, as far as it is known before.
    pub fn looks(&self) -> Looks {
        let count = |groups: [u32; 3]| groups.map(u64::from).iter().product();
        Looks {
            workgroups: [count(self.extrema_low()), count(self.extrema_high()), count(self.traverse())],
            texel_loads: self.texel_count,
            node_bytes: NODE_BYTES * u64::from(self.node_count),
            memory_bytes: self.layer_bytes() + self.node_bytes(),
        }
    }
}

/// Nodes of the tree over a map.
fn node_count(size: [u32; 2]) -> u64 {
    let coarsest = size[0].max(size[1]).next_power_of_two().ilog2().max(FINEST);
    (FINEST..=coarsest)
        .map(|level| size.map(|n| u64::from(n.div_ceil(1 << level))).iter().product::<u64>())
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_core::{Camera, Light, MapKind, MapLayout, MapProjection, Medium, Phase};

    fn planned(camera: [u32; 2], side: u32, cascades: usize) -> Result<MinMaxPlan, TooLarge> {
        let camera = Camera::perspective([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 60.0, camera).unwrap();
        let down = [0.0, -1.0, 0.0];
        let sun = Light::directional(down, [1.0; 3]).unwrap();
        let map = MapProjection::orthographic([0.0; 3], down, [1.0, 0.0, 0.0], [1.0; 2], [side; 2]).unwrap();
        let layout = MapLayout::new(MapKind::Cascades, &vec![map; cascades]).unwrap();
        let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
        let mut plan = MinMaxPlan::default();
        plan.rebuild(&Setup::new(&camera, &sun, layout, &medium, 10.0).unwrap())?;
        Ok(plan)
    }

    /// 1/16 + 1/64 + … of the texels, 8 bytes each: 2/3 of a byte a texel.
    #[test]
    fn trees_take_two_thirds_of_a_byte_a_texel_and_fit_or_say_so() {
        for (camera, side, cascades) in [
            ([1920, 1080], 2048, 1),
            ([1920, 1080], 2048, 4),
            ([3840, 2160], 4096, 4),
            ([3840, 2160], 8192, 1),
        ] {
            let looks = planned(camera, side, cascades).unwrap().looks();
            let texels = u64::from(side).pow(2) * cascades as u64;
            println!("{camera:?}, {cascades} × {side}²: {looks:?}");
            assert_eq!(looks.texel_loads, texels);
            assert!(
                looks.node_bytes >= texels * 2 / 3 - 8 * cascades as u64
                    && looks.node_bytes <= texels * 2 / 3 + 64 * cascades as u64
            );
            assert!(looks.memory_bytes <= MOST_BINDING_BYTES);
            assert_eq!(looks.workgroups[0], texels / 4096);
            assert_eq!(
                looks.workgroups[2],
                u64::from(camera[0].div_ceil(8)) * u64::from(camera[1].div_ceil(8))
            );
        }
        let error = planned([3840, 2160], 8192, 4).unwrap_err();
        assert!(error.to_string().contains("trees") && error.to_string().contains("134217728"), "{error}");
        assert!(planned([3840, 2160], 8193, 1).unwrap_err().to_string().contains("8192 are possible"));
    }
}
