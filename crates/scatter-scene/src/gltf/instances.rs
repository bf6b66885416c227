//! EXT_mesh_gpu_instancing: one node that draws its mesh many times.
//!
//! Source: the extension's README: an instance's matrix is T·R·S of its attributes, applied before the node's own.
//! Custom attributes (`_ID`) are not read. Departure: quaternions are normalised in f64.

use glam::{DMat4, DQuat, DVec3, DVec4};
use serde_json::Value;

use super::accessor::{Elements, ROTATION, vec3};
use super::container::Buffers;
use super::document::Document;
use super::nodes::node_place;
use crate::error::{Checked, Fault};

const NAME: &str = "EXT_mesh_gpu_instancing";

/// Where the instances of a node stand: one instance for a node without the extension.
pub(super) struct Instances<'a> {
    count: u64,
    translation: Option<Elements<'a, 3>>,
    rotation: Option<Elements<'a, 4>>,
    scale: Option<Elements<'a, 3>>,
    place: String,
}

impl<'a> Instances<'a> {
    pub(super) fn open(
        document: &Document,
        buffers: &'a Buffers<'_>,
        node_idx: usize,
    ) -> Checked<Option<Self>> {
        let root = &document.root;
        let extensions = root.nodes[node_idx].extensions.as_ref();
        let Some(extension) = extensions.and_then(|extensions| extensions.others.get(NAME)) else {
            return Ok(None);
        };
        let place = format!("{}.{NAME}", node_place(root, node_idx));
        let fault = |problem: &str| Fault::invalid(place.as_str(), problem, "export the file again");
        let attributes = &extension["attributes"];
        let accessor = |name: &str| match &attributes[name] {
            Value::Null => Ok(None),
            value => match value.as_u64() {
                Some(idx) => Ok(Some(idx as usize)),
                None => Err(fault(&format!("{name} is no accessor's index"))),
            },
        };
        let open3 = |name: &'static str| match accessor(name)? {
            Some(idx) => Ok(Some(Elements::<3>::open(root, buffers, idx, &vec3("TRANSLATION or SCALE is"))?)),
            None => Ok(None),
        };
        let (translation, scale) = (open3("TRANSLATION")?, open3("SCALE")?);
        let rotation = match accessor("ROTATION")? {
            Some(idx) => Some(Elements::<4>::open(root, buffers, idx, &ROTATION)?),
            None => None,
        };
        let counts = [
            translation.as_ref().map(Elements::count),
            rotation.as_ref().map(Elements::count),
            scale.as_ref().map(Elements::count),
        ];
        let mut given = counts.into_iter().flatten();
        let count = match given.next() {
            Some(count) => count,
            // Only attributes of an application's own: any of them tells how many.
            None => {
                match attributes.as_object().and_then(|map| map.values().next()).and_then(Value::as_u64) {
                    Some(idx) => super::accessor::accessor(root, idx as usize)?.count.0,
                    None => return Err(fault("it has no attributes")),
                }
            }
        };
        if given.any(|other| other != count) {
            return Err(fault("its attributes differ in their counts"));
        }
        Ok(Some(Self { count, translation, rotation, scale, place }))
    }

    pub(super) fn count(&self) -> u64 {
        self.count
    }

    /// The matrix of instance `idx < count`, to be applied before the node's.
    pub(super) fn node_from_instance(&self, idx: u64) -> Checked<DMat4> {
        let vector = |elements: &Option<Elements<'_, 3>>, default| {
            elements.as_ref().map_or(default, |elements| DVec3::from_array(elements.get(idx)))
        };
        let rotation = self.rotation.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |elements| elements.get(idx));
        let largest = DVec4::from_array(rotation).abs().max_element();
        let translation = vector(&self.translation, DVec3::ZERO);
        let scale = vector(&self.scale, DVec3::ONE);
        let is_finite =
            rotation.iter().all(|v| v.is_finite()) && translation.is_finite() && scale.is_finite();
        if !(is_finite && largest > 0.0) {
            let problem = format!("instance {idx} has a zero quaternion or numbers that are not finite");
            return Err(Fault::invalid(self.place.as_str(), problem, "export the file again"));
        }
        let rotation = (DQuat::from_array(rotation) * (1.0 / largest)).normalize();
        Ok(DMat4::from_scale_rotation_translation(scale, rotation, translation))
    }
}
