//! Random rigid matrices of f32, inverted in f32, composed with every projection: the same camera to f32 rounding.

use glam::{DMat4, DVec3, Mat4};
use scatter_core::{Camera, Projection};

use crate::conventions::{Lens, Place, Random, lenses};

const SIZE: [u32; 2] = [63, 41];

/// f32's unit roundoff.
const U: f64 = 1.0 / 16_777_216.0;

/// A rotation of f32 made of a quaternion has entries right to 4 U (three products and sums of numbers ≤ 2), a cofactor
/// inverse adds three products of three factors and a division, 8 U, a parent's two more products 2·4 U; three such rows
/// make an angle. The projection's own numbers are right to 4 U (a tangent, a division, a difference). 16 U is what a row
/// then has at most, in the sum of all, and √3·16 U ≈ 28 U < 2⁻¹⁹ what three have.
const DIRECTION: f64 = 32.0 * U;

/// A translation is three products of such entries with the position: √3·16 U of its length, and as much again by the
/// inverse, here of the world's.
const POSITION: f64 = 64.0 * U;

/// Where the image point at these shares of width and height is seen: what is known without a matrix.
fn reference(place: &Place, lens: &Lens, [x, y]: [f64; 2]) -> (DVec3, DVec3) {
    let [right, up, forward] = place.axes(lens.left_handed);
    let [l, r, b, t] = lens.window;
    // Row 0 of Vulkan and OpenGL is at y = −1, which glam's OpenGL projections have at the bottom and its Vulkan ones,
    // with y down, on top.
    let y = if lens.name.contains("opengl") { 1.0 - y } else { y };
    let offset = right * (l + (r - l) * x) + up * (t + (b - t) * y);
    let eye = place.position.as_dvec3();
    if lens.parallel { (eye + offset, forward) } else { (eye, (forward + offset).normalize()) }
}

/// The largest errors so far: of directions \[radians\], and of starts as a share of eye's distance and window.
#[derive(Default)]
struct Worst {
    direction: f64,
    start: f64,
    cases: usize,
}

impl Worst {
    fn compare(&mut self, camera: &Camera, place: &Place, lens: &Lens, amplified: f64) {
        self.cases += 1;
        let parallel = camera.projection() == Projection::Orthographic;
        assert_eq!(parallel, lens.parallel, "{}", lens.name);
        for share in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.93, 0.81], [0.4, 0.5]] {
            let ray = camera.ray(share[0] * f64::from(SIZE[0]), share[1] * f64::from(SIZE[1]));
            let (start, direction) = reference(place, lens, share);
            let angle = ray.direction.cross(direction).length().atan2(ray.direction.dot(direction));
            self.direction = self.direction.max(angle / amplified);
            let size = place.position.as_dvec3().length()
                + if parallel { lens.window.iter().fold(0.0, |m, v| f64::max(m, v.abs())) } else { 0.0 };
            let off = (camera.eye() + ray.origin).distance(start) / size;
            self.start = self.start.max(off / amplified);
        }
    }

    fn judge(&self, what: &str) {
        println!(
            "{what}: {} cameras, directions {:.1} of {} roundings, starts {:.1} of {}",
            self.cases,
            self.direction / U,
            DIRECTION / U,
            self.start / U,
            POSITION / U
        );
        assert!(self.direction <= DIRECTION && self.start <= POSITION, "{what}");
    }
}

fn array(matrix: Mat4) -> [[f64; 4]; 4] {
    matrix.as_dmat4().to_cols_array_2d()
}

#[test]
fn view_and_projection_of_every_convention_give_the_camera_they_were_made_from() {
    let mut random = Random(1);
    let mut worst = Worst::default();
    for number in 0..4000 {
        let place = Place::random(&mut random);
        for lens in lenses(&mut random) {
            let view = array(place.view(number % 4, lens.left_handed));
            let clip = array(lens.matrix);
            let camera = Camera::from_matrices_in(view, clip, lens.space, SIZE)
                .unwrap_or_else(|error| panic!("{}: {error}", lens.name));
            worst.compare(&camera, &place, &lens, 1.0);
            if !lens.name.contains("vulkan") && !lens.name.contains("opengl") {
                let plain = Camera::from_matrices(view, clip, SIZE).unwrap();
                assert_eq!(plain, camera, "{}", lens.name);
            }
        }
    }
    worst.judge("view and projection apart");
}

/// One matrix for both: rows of a projection are sums of a view's, so what f32 rounds of a row is a share of its largest
/// summand, and an angle between rows that are not square to each other is amplified by the projection's condition.
#[test]
fn one_matrix_composed_in_f32_gives_the_same_perspective_camera() {
    let mut random = Random(2);
    let mut worst = Worst::default();
    for number in 0..4000 {
        let place = Place::random(&mut random);
        for lens in lenses(&mut random).into_iter().filter(|lens| !lens.parallel) {
            let composed = array(lens.matrix * place.view(number % 4, lens.left_handed));
            let camera =
                Camera::from_matrices_in(DMat4::IDENTITY.to_cols_array_2d(), composed, lens.space, SIZE)
                    .unwrap_or_else(|error| panic!("{}: {error}", lens.name));
            worst.compare(&camera, &place, &lens, condition(&lens));
        }
    }
    worst.judge("composed in f32");
}

/// Frobenius norms of x, y and w rows and of their inverse: at least 3, that of a rotation.
fn condition(lens: &Lens) -> f64 {
    let m = lens.matrix.as_dmat4();
    let rows = [0, 1, 3].map(|row| m.row(row).truncate());
    let rows = glam::DMat3::from_cols(rows[0], rows[1], rows[2]);
    let norm = |m: glam::DMat3| m.to_cols_array().iter().map(|v| v * v).sum::<f64>().sqrt();
    norm(rows) * norm(rows.inverse())
}
