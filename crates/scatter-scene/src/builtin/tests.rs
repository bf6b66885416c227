//! What every built-in shot promises: valid files, the same bytes everywhere, and light where it should be.

use super::{BuiltinShot, builtin_shots, builtin_variants};
use glam::{DMat4, DVec3, Vec3};

/// A triangle in world space, under the name of its mesh.
struct Named {
    name: String,
    corners: [DVec3; 3],
}

/// World triangles of a shot, read by the loaders' crates directly: independent of this crate's own loaders.
fn world_triangles(shot: &BuiltinShot) -> Vec<Named> {
    let mesh = shot.files().mesh;
    if mesh.name.ends_with(".obj") { obj_triangles(&mesh.bytes) } else { glb_triangles(&mesh.bytes) }
}

fn obj_triangles(bytes: &[u8]) -> Vec<Named> {
    let (models, _) =
        tobj::load_obj_buf(&mut &*bytes, &tobj::GPU_LOAD_OPTIONS, |_| Err(tobj::LoadError::GenericFailure))
            .expect("a valid OBJ file");
    let mut triangles = Vec::new();
    for model in &models {
        let corner = |index: u32| DVec3::from_slice(&model.mesh.positions[3 * index as usize..]);
        for indices in model.mesh.indices.chunks_exact(3) {
            let corners = [corner(indices[0]), corner(indices[1]), corner(indices[2])];
            triangles.push(Named { name: model.name.clone(), corners });
        }
    }
    triangles
}

fn glb_triangles(bytes: &[u8]) -> Vec<Named> {
    fn visit(node: &gltf::Node<'_>, world_from_parent: DMat4, blob: &[u8], triangles: &mut Vec<Named>) {
        let local = node.transform().matrix().map(|column| column.map(f64::from));
        let world_from_node = world_from_parent * DMat4::from_cols_array_2d(&local);
        if let Some(mesh) = node.mesh() {
            for primitive in mesh.primitives().filter(|p| p.mode() == gltf::mesh::Mode::Triangles) {
                let reader = primitive.reader(|_| Some(blob));
                let positions: Vec<DVec3> = reader
                    .read_positions()
                    .expect("positions")
                    .map(|p| world_from_node.transform_point3(Vec3::from(p).as_dvec3()))
                    .collect();
                let indices: Vec<u32> = reader.read_indices().expect("indices").into_u32().collect();
                assert_eq!(indices.len() % 3, 0);
                for indices in indices.chunks_exact(3) {
                    let corners = [0, 1, 2].map(|i| positions[indices[i] as usize]);
                    triangles.push(Named { name: mesh.name().unwrap_or_default().to_owned(), corners });
                }
            }
        }
        for child in node.children() {
            visit(&child, world_from_node, blob, triangles);
        }
    }
    // Validation knows no attributes of an application's own, which the specification allows.
    let has_own = bytes.windows(8).any(|text| text == b"_RADIUS\"");
    let read = if has_own { gltf::Gltf::from_slice_without_validation } else { gltf::Gltf::from_slice };
    let file = read(bytes).expect("a valid GLB file");
    let blob = file.blob.as_deref().expect("a binary chunk");
    let mut triangles = Vec::new();
    for node in file.scenes().flat_map(|scene| scene.nodes()) {
        visit(&node, DMat4::IDENTITY, blob, &mut triangles);
    }
    triangles
}

/// The shot file's table.
fn shot_table(shot: &BuiltinShot) -> toml::Table {
    shot.shot_text.parse().expect("valid TOML")
}

fn vector(table: &toml::Table, section: &str, key: &str) -> DVec3 {
    let numbers = table[section][key].as_array().expect("an array");
    DVec3::from_array([0, 1, 2].map(|i| numbers[i].as_float().expect("a float")))
}

/// Whether a triangle blocks the way from `origin` along `direction` (Möller and Trumbore, both sides).
fn is_blocked(triangles: &[Named], origin: DVec3, direction: DVec3) -> bool {
    triangles.iter().any(|Named { corners: [a, b, c], .. }| {
        let (ab, ac) = (*b - *a, *c - *a);
        let p = direction.cross(ac);
        let determinant = ab.dot(p);
        if determinant == 0.0 {
            return false;
        }
        let s = origin - *a;
        let u = s.dot(p) / determinant;
        let q = s.cross(ab);
        let v = direction.dot(q) / determinant;
        u >= 0.0 && v >= 0.0 && u + v <= 1.0 && ac.dot(q) / determinant > 0.0
    })
}

/// Asserts which points of a sunlit shot the sun reaches.
#[track_caller]
fn assert_sun(name: &str, lit: &[DVec3], dark: &[DVec3]) {
    let shot = BuiltinShot::find(name).unwrap();
    let triangles = world_triangles(shot);
    let dir_to_sun = -vector(&shot_table(shot), "light", "direction").normalize();
    for &p_world in lit {
        assert!(!is_blocked(&triangles, p_world, dir_to_sun), "{name}: {p_world} should be lit");
    }
    for &p_world in dark {
        assert!(is_blocked(&triangles, p_world, dir_to_sun), "{name}: {p_world} should be dark");
    }
}

/// FNV-1a, 64 bits.
fn fnv(parts: &[&[u8]]) -> u64 {
    parts
        .iter()
        .copied()
        .flatten()
        .fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[test]
fn fnv_knows_its_published_values() {
    assert_eq!(fnv(&[b""]), 0xcbf2_9ce4_8422_2325);
    assert_eq!(fnv(&[b"foo", b"bar"]), 0x8594_4171_f739_67e8);
}

#[test]
fn names_are_unique_and_every_shot_says_what_it_shows() {
    let all: Vec<_> = builtin_shots().iter().chain(builtin_variants()).collect();
    for (index, &shot) in all.iter().enumerate() {
        assert!(all[..index].iter().all(|other| other.name != shot.name));
        assert!(shot.shows.len() > 40, "{}: {}", shot.name, shot.shows);
        assert!(std::ptr::eq(BuiltinShot::find(shot.name).unwrap(), shot));
    }
    assert!(BuiltinShot::find("no such shot").is_none());
}

#[test]
fn bytes_are_the_same_at_every_call_and_as_pinned() {
    // A changed shot changes every figure quoted on it: change these lines knowingly.
    const PINNED: &[(&str, u64)] = &[
        ("nave", 0xcc55e3e435574265),
        ("grove", 0x09399f50f6fbd015),
        ("comb", 0xe940648b631ded62),
        ("lamp", 0x70ea196e9d58fb48),
        ("valley", 0x51bbd7d74738cfc1),
        ("arcade", 0xe09f2b48e3ed2321),
        ("beam", 0x6d66d3b81b89d572),
        ("stage", 0x2a8556ab233a812f),
        ("sunset", 0x628855302baa0588),
        ("haze", 0xdcb9397e0d06a129),
        ("grove-cards", 0x2973b2ea6a9abe4a),
        ("valley-mist", 0x3ee0ab5c5f433509),
        ("smoke", 0x3af75c971284483f),
        ("hair", 0x1595d489ecb50124),
        ("smoke-and-hair", 0x4a249f99c115dfe6),
    ];
    let found: Vec<(&str, u64)> = builtin_shots()
        .iter()
        .chain(builtin_variants())
        .map(|shot| {
            let (first, second) = (shot.files(), shot.files());
            assert!(first == second, "{} differs from call to call", shot.name);
            (shot.name, fnv(&[&first.mesh.bytes]))
        })
        .collect();
    let print: String = found.iter().map(|(name, hash)| format!("(\"{name}\", {hash:#018x}),\n")).collect();
    assert!(found == PINNED, "the shots' bytes are now\n{print}");
}

#[test]
fn every_shot_file_names_its_mesh_and_has_sane_numbers() {
    for shot in builtin_shots().iter().chain(builtin_variants()) {
        let table = shot_table(shot);
        assert_eq!(table["mesh"].as_str(), Some(shot.files().mesh.name.as_str()));
        assert_eq!(table["camera"]["resolution"].as_array().unwrap().len(), 2);
        assert_eq!(
            table["camera"]["resolution"]
                .as_array()
                .unwrap()
                .iter()
                .map(|n| n.as_integer())
                .collect::<Vec<_>>(),
            [Some(640), Some(480)]
        );
        let line_of_sight = vector(&table, "camera", "target") - vector(&table, "camera", "eye");
        assert!(line_of_sight.length() > 0.1, "{}", shot.name);
    }
}

#[test]
fn every_triangle_is_in_range_finite_and_has_three_corners() {
    for shot in builtin_shots().iter().chain(builtin_variants()) {
        let triangles = world_triangles(shot);
        assert!(!triangles.is_empty());
        for Named { name, corners: [a, b, c] } in &triangles {
            assert!((*a + *b + *c).is_finite(), "{}: {name}", shot.name);
            assert!(a != b && b != c && c != a, "{}: {name} has a triangle without area at {a}", shot.name);
        }
    }
}

#[test]
fn the_grove_has_over_300_000_leaf_triangles() {
    let triangles = world_triangles(BuiltinShot::find("grove").unwrap());
    let leaves = triangles.iter().filter(|triangle| triangle.name.starts_with("leaves")).count();
    assert!(leaves > 300_000, "{leaves}");
}

#[test]
fn the_sun_enters_the_nave_by_its_windows_alone() {
    // Straight down the light from the middle of a lancet (height 4.5 m) of the third bay, 3 m inside; and from
    // behind a pier between two bays. The vault's crown, the far aisle and the floor below a sill stay dark.
    let dir_from_sun = vector(&shot_table(BuiltinShot::find("nave").unwrap()), "light", "direction");
    let inside_window = |x: f64| DVec3::new(x, 4.5, 6.3) + dir_from_sun * (3.0 / dir_from_sun.z.abs());
    let lancet = -6.0 + 0.15 + 0.325;
    assert_sun(
        "nave",
        &[inside_window(lancet), inside_window(lancet + 0.1), inside_window(lancet + 4.0)],
        &[
            inside_window(-8.0),
            inside_window(-6.0),
            DVec3::new(0.0, 12.0, 0.0),
            DVec3::new(2.0, 1.0, -5.5),
            DVec3::new(lancet, 0.5, 5.5),
            DVec3::new(15.5, 5.0, 0.0),
        ],
    );
}

#[test]
fn light_falls_between_the_comb_s_slats() {
    // Below the roof the sheets repeat every quarter metre: over a stretch without a lost slat, some of eight points
    // a quarter metre are lit and most are dark.
    let shot = BuiltinShot::find("comb").unwrap();
    let triangles = world_triangles(shot);
    let dir_to_sun = -vector(&shot_table(shot), "light", "direction").normalize();
    let lit = (0..256)
        .filter(|&i| {
            let p_world = DVec3::new(-4.0 + 8.0 * f64::from(i) / 256.0, 2.0, 0.3);
            !is_blocked(&triangles, p_world, dir_to_sun)
        })
        .count();
    // 16 % between the slats, and the whole of a quarter metre where one in six is missing: 28 %.
    assert!((256 * 16 / 100..256 * 45 / 100).contains(&lit), "{lit} of 256 points are lit");
}

#[test]
fn the_lamp_shines_through_holes_and_not_through_brass() {
    let shot = BuiltinShot::find("lamp").unwrap();
    let triangles = world_triangles(shot);
    let lamp = vector(&shot_table(shot), "light", "position");
    let globe: Vec<Named> = triangles.into_iter().filter(|triangle| triangle.name == "globe").collect();
    // Share of the sphere: each hole spans 3/80 of a turn, and between two of the 48 steps from pole to pole the
    // sphere's area goes with the difference of cosines.
    let share: f64 = [(7, 10), (14, 17), (22, 26), (31, 34), (38, 41)]
        .iter()
        .map(|&(from, to)| {
            let height = |step: i32| -(std::f64::consts::PI * f64::from(step) / 48.0).cos();
            10.0 * 3.0 / 80.0 * (height(to) - height(from)) / 2.0
        })
        .sum();
    let mut random = super::random::Random::new(9);
    let count = 4000;
    let open = (0..count).filter(|_| !is_blocked(&globe, lamp, random.direction())).count();
    let found = open as f64 / f64::from(count);
    // Five standard deviations of the count, plus what flat facets and the shell's thickness take away.
    let tolerance = 5.0 * (share * (1.0 - share) / f64::from(count)).sqrt() + 0.01;
    assert!((found - share).abs() < tolerance, "open share {found}, expected {share}");
}

#[test]
fn the_valley_has_over_a_million_triangles_and_kilometres_of_air() {
    let shot = BuiltinShot::find("valley").unwrap();
    let triangles = world_triangles(shot);
    assert!(triangles.len() > 1_000_000, "{}", triangles.len());
    let xs = || triangles.iter().flat_map(|triangle| triangle.corners).map(|p| p.x);
    let width = xs().fold(f64::MIN, f64::max) - xs().fold(f64::MAX, f64::min);
    assert!(width > 1000.0, "{width}");
}

#[test]
fn the_sun_enters_the_arcade_between_its_columns() {
    // Columns stand every two metres from x = −16; 1 m further down the light than the middle of an opening, or of a
    // column. The back wall's foot and the vault stay dark.
    let dir_from_sun = vector(&shot_table(BuiltinShot::find("arcade").unwrap()), "light", "direction");
    let below = |x: f64| DVec3::new(x, 1.9, 2.45) + dir_from_sun / dir_from_sun.z.abs();
    assert_sun(
        "arcade",
        &[below(-1.0), below(-0.9), below(5.0)],
        &[below(0.0), below(4.0), DVec3::new(0.0, 0.5, -2.0), DVec3::new(-3.0, 4.4, 0.0)],
    );
}

#[test]
fn the_beam_reaches_the_plane_and_nothing_else_is_lit_in_view() {
    let shot = BuiltinShot::find("beam").unwrap();
    let dir_from_sun = vector(&shot_table(shot), "light", "direction");
    let hole = DVec3::new(-2.7, 6.0, 1.2);
    let on_plane = hole + dir_from_sun * (6.0 / -dir_from_sun.y) + DVec3::Y * 1e-6;
    let beside = DVec3::X * 0.4;
    assert_sun(
        "beam",
        &[on_plane, (hole + on_plane) / 2.0],
        &[on_plane + beside, on_plane - beside, DVec3::new(0.0, 1.0, -8.0), DVec3::new(9.0, 0.1, -15.0)],
    );
}

#[test]
fn the_beam_s_picture_shows_the_plane_alone() {
    // First hits of a grid of rays up to the image's border: with the plane everywhere, depth has no edge.
    let shot = BuiltinShot::find("beam").unwrap();
    let triangles = world_triangles(shot);
    let view = View::of(shot);
    let (plane, others): (Vec<Named>, Vec<Named>) =
        triangles.into_iter().partition(|triangle| triangle.name == "plane");
    for i in 0..=32 {
        for j in 0..=24 {
            let direction = view.ray(f64::from(i) / 16.0 - 1.0, f64::from(j) / 12.0 - 1.0);
            assert!(is_blocked(&plane, view.eye, direction), "the ray {direction} misses the plane");
            assert!(!is_blocked(&others, view.eye, direction), "the ray {direction} sees the plate");
        }
    }
}

#[test]
fn the_stage_s_whole_cone_falls_on_its_grille() {
    let shot = BuiltinShot::find("stage").unwrap();
    let table = shot_table(shot);
    let (lamp, axis) =
        (vector(&table, "light", "position"), vector(&table, "light", "direction").normalize());
    let outer = table["light"]["outer_cone_degrees"].as_float().unwrap().to_radians();
    let grille: Vec<Named> =
        world_triangles(shot).into_iter().filter(|triangle| triangle.name == "grille").collect();
    let corners = || grille.iter().flat_map(|triangle| triangle.corners);
    let low = corners().fold(DVec3::MAX, DVec3::min);
    let high = corners().fold(DVec3::MIN, DVec3::max);
    let mut random = super::random::Random::new(4);
    let (mut inside, mut open) = (0_u32, 0_u32);
    while inside < 2000 {
        let direction = random.direction();
        if direction.dot(axis) < outer.cos() {
            continue;
        }
        inside += 1;
        let p_world = lamp + direction * ((low.y - lamp.y) / direction.y);
        assert!(
            p_world.x > low.x && p_world.x < high.x && p_world.z > low.z && p_world.z < high.z,
            "light passes beside the grille at {p_world}"
        );
        open += u32::from(!is_blocked(&grille, lamp, direction));
    }
    // Straight down 0.14²/0.2² = 49 % would pass; at a slant the bars' height takes more.
    let share = f64::from(open) / f64::from(inside);
    assert!((0.2..0.49).contains(&share), "{share}");
}

#[test]
fn the_sunset_s_epipole_is_in_the_middle_tenth_of_the_picture() {
    let shot = BuiltinShot::find("sunset").unwrap();
    let dir_to_sun = -vector(&shot_table(shot), "light", "direction");
    let [x, y] = View::of(shot).project(dir_to_sun);
    // Half the image is 1 in both directions. Not the exact centre: nothing should fit it by luck.
    assert!(x.abs() < 0.1 && y.abs() < 0.1, "({x}, {y})");
    assert!(x.abs() > 0.005 && y.abs() > 0.005, "({x}, {y})");
}

#[test]
fn the_haze_has_two_components_and_coloured_extinction() {
    let table = shot_table(BuiltinShot::find("haze").unwrap());
    let components = table["medium"]["components"].as_array().unwrap();
    let phases: Vec<_> = components.iter().map(|component| component["phase"].as_str().unwrap()).collect();
    assert_eq!(phases, ["rayleigh", "henyey-greenstein"]);
    let rayleigh: Vec<f64> =
        components[0]["scattering"].as_array().unwrap().iter().map(|x| x.as_float().unwrap()).collect();
    // Rayleigh's law with the usual 680, 550 and 440 nm: blue over red is (680/440)⁴ = 5.7.
    assert!((rayleigh[2] / rayleigh[0] - 5.7).abs() < 0.05);
}

/// A shot's camera, put together here: right, up and forward, scaled so that the image's border is at 1.
struct View {
    eye: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
}

impl View {
    fn of(shot: &BuiltinShot) -> Self {
        let table = shot_table(shot);
        let eye = vector(&table, "camera", "eye");
        let forward = (vector(&table, "camera", "target") - eye).normalize();
        let right = forward.cross(vector(&table, "camera", "up")).normalize();
        let fov = table["camera"]["vertical_fov_degrees"].as_float().unwrap().to_radians();
        let half_height = (fov / 2.0).tan();
        let half_width = half_height * 640.0 / 480.0;
        Self { eye, right: right * half_width, up: right.cross(forward) * half_height, forward }
    }

    fn ray(&self, x: f64, y: f64) -> DVec3 {
        self.forward + x * self.right + y * self.up
    }

    fn project(&self, direction: DVec3) -> [f64; 2] {
        let depth = direction.dot(self.forward);
        [self.right, self.up].map(|side| direction.dot(side) / side.length_squared() / depth)
    }
}
