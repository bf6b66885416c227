//! Every projection that `glam` makes, with the numbers that it was made from; random rigid transforms in f32.

use glam::camera::{lh, rh};
use glam::{DQuat, DVec3, Mat4, Quat, Vec3};
use scatter_core::ClipSpace;

/// A generator of 2³² states and more is all that tests need (SplitMix64; Steele et al. 2014).
pub struct Random(pub u64);

impl Random {
    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ (z >> 31)) as f64 / 2f64.powi(64)
    }

    /// In [low, high).
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// As [`Self::range`], in f32.
    pub fn single(&mut self, low: f64, high: f64) -> f32 {
        self.range(low, high) as f32
    }
}

/// A camera's or a lamp's place: what an engine stores of it, in f32.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    pub rotation: Quat,
    pub position: Vec3,
}

impl Place {
    /// Up to 10⁴ units from the origin, any rotation.
    pub fn random(random: &mut Random) -> Self {
        let rotation = loop {
            let q = Quat::from_array(std::array::from_fn(|_| random.single(-1.0, 1.0)));
            if (0.1..=1.0).contains(&q.length_squared()) {
                break q.normalize();
            }
        };
        let reach = 10f64.powf(random.range(-1.0, 4.0));
        Self { rotation, position: Vec3::from_array(std::array::from_fn(|_| random.single(-reach, reach))) }
    }

    /// The view, by one of the ways of engines.
    pub fn view(&self, way: u32, left_handed: bool) -> Mat4 {
        let world_from_view = Mat4::from_rotation_translation(self.rotation, self.position);
        match way {
            0 => world_from_view.inverse(),
            // A child of a parent.
            1 => {
                let parent = Mat4::from_rotation_translation(Quat::from_rotation_y(0.7), 0.3 * self.position);
                (parent * (parent.inverse() * world_from_view)).inverse()
            }
            2 => world_from_view.inverse().inverse().inverse(),
            _ => {
                let (ahead, up) = (self.rotation * Vec3::NEG_Z, self.rotation * Vec3::Y);
                if left_handed {
                    lh::view::look_to_mat4(self.position, -ahead, up)
                } else {
                    rh::view::look_to_mat4(self.position, ahead, up)
                }
            }
        }
    }

    /// Right, up and forward, from the quaternion in f64.
    pub fn axes(&self, left_handed: bool) -> [DVec3; 3] {
        let q: DQuat = self.rotation.as_dquat().normalize();
        [q * DVec3::X, q * DVec3::Y, q * if left_handed { DVec3::Z } else { DVec3::NEG_Z }]
    }
}

/// A projection in f32 with what it is.
#[derive(Debug, Clone, Copy)]
pub struct Lens {
    pub name: &'static str,
    pub matrix: Mat4,
    pub space: ClipSpace,
    pub left_handed: bool,
    pub parallel: bool,
    /// Left, right, bottom, top at distance 1 (perspective) or in world units.
    pub window: [f64; 4],
    pub near: f64,
    /// Or ∞.
    pub far: f64,
}

/// All conventions: OpenGL, Direct3D (wgpu, Metal) and Vulkan, both hands, forward and reversed z, finite and infinite,
/// perspective, off-centre and parallel.
pub fn lenses(random: &mut Random) -> Vec<Lens> {
    let (fov, aspect) = (random.single(0.1, 2.4), random.single(0.4, 2.5));
    let (near, far) = (random.single(0.05, 0.5), random.single(50.0, 2000.0));
    let [l, b] = [random.single(-0.9, 0.3), random.single(-0.9, 0.3)];
    let [r, t] = [l + random.single(0.2, 1.0), b + random.single(0.2, 1.0)];
    let size = random.single(2.0, 60.0);
    let tan = (0.5 * f64::from(fov)).tan();
    let centred = [-tan * f64::from(aspect), tan * f64::from(aspect), -tan, tan];
    let off = [l, r, b, t].map(f64::from);
    let frustum = [l * near, r * near, b * near, t * near];
    // glam 0.34's left-handed frusta have the off-centre terms of right-handed ones: x = (2·X + (r + l)·Z)/(r − l) is −1 at
    // X = −r for Z = 1, so that they show the window mirrored about the axis.
    let frustum_window =
        |left_handed: bool| if left_handed { [-off[1], -off[0], -off[3], -off[2]] } else { off };
    let wide = [l * size, r * size, b * size, t * size];
    // Its Vulkan orthographics turn y over but not the offset: y = −(2·Y + t + b)/(t − b) is −1, row 0, at Y = −b.
    let whole = wide.map(f64::from);
    let parallel_window =
        |y_down: bool| if y_down { [whole[0], whole[1], -whole[3], -whole[2]] } else { whole };
    let mut all = Vec::new();
    macro_rules! api {
        ($hand:ident, $left_handed:literal, $api:ident, $space:expr, infinite: [$($infinite:ident $to:expr),*]) => {{
            use glam::camera::$hand::proj::$api as api;
            let mut add = |name, matrix, space, parallel, window, far: f32| all.push(Lens {
                name, matrix, space, parallel, window, left_handed: $left_handed, near: near.into(), far: far.into(),
            });
            let space: ClipSpace = $space;
            let parallel = parallel_window(space == ClipSpace::VULKAN);
            add(concat!(stringify!($hand), " ", stringify!($api), " perspective"), api::perspective(fov, aspect, near, far), space, false, centred, far);
            let [l, r, b, t] = frustum;
            add(concat!(stringify!($hand), " ", stringify!($api), " frustum"), api::frustum(l, r, b, t, near, far), space, false, frustum_window($left_handed), far);
            let [l, r, b, t] = wide;
            add(concat!(stringify!($hand), " ", stringify!($api), " orthographic"), api::orthographic(l, r, b, t, near, far), space, true, parallel, far);
            let reversed = api::orthographic(l, r, b, t, far, near);
            add(concat!(stringify!($hand), " ", stringify!($api), " orthographic, reversed"), reversed, space.reversed(), true, parallel, far);
            $(add(concat!(stringify!($hand), " ", stringify!($api), " ", stringify!($infinite)), api::$infinite(fov, aspect, near), $to, false, centred, f32::INFINITY);)*
        }};
    }
    let (wgpu, vulkan) = (ClipSpace::WGPU, ClipSpace::VULKAN);
    api!(rh, false, directx, wgpu, infinite: [perspective_infinite wgpu, perspective_infinite_reverse wgpu.reversed()]);
    api!(lh, true, directx, wgpu, infinite: [perspective_infinite wgpu, perspective_infinite_reverse wgpu.reversed()]);
    api!(rh, false, vulkan, vulkan, infinite: [perspective_infinite vulkan, perspective_infinite_reverse vulkan.reversed()]);
    api!(lh, true, vulkan, vulkan, infinite: [perspective_infinite vulkan, perspective_infinite_reverse vulkan.reversed()]);
    api!(rh, false, opengl, ClipSpace::OPENGL, infinite: []);
    api!(lh, true, opengl, ClipSpace::OPENGL, infinite: []);
    // Reversed and finite: the near plane at 1, the far plane at 0, as a z row of its own.
    for lens in all.clone() {
        if !lens.parallel && lens.far.is_finite() && lens.space != ClipSpace::OPENGL {
            let mut matrix = lens.matrix;
            let forward = if lens.left_handed { 1.0 } else { -1.0 };
            matrix.z_axis.z = -forward * near / (far - near);
            matrix.w_axis.z = near * far / (far - near);
            all.push(Lens { matrix, space: lens.space.reversed(), ..lens });
        }
    }
    all
}
