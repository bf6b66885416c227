// Answers to an image: the unoccluded closed form times the share that the pixel's two slices found lit. Answers are left at 0
// for the next frame.

@group(0) @binding(16) var<storage, read_write> answers: array<u32>;

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= image_size()) {
        return;
    }
    let pixel = camera_pixel(id.xy);
    let ray = pixel_ray(pixel);
    let fog = fog_along(ray);
    let distance = ray_end(pixel);
    let walked = epipolar.walked;
    var light = vec3<f32>(0.0);
    if epipolar.reach.y == 0.0 {
        light = sun_interval(fog, 0.0, distance);
    } else if pixel.x >= walked.x && pixel.x < walked.y && pixel.y >= walked.z && pixel.y < walked.w {
        light = walked_light(pixel, fog, ray.stretch, distance / ray.stretch);
    } else {
        var shares = vec3<f32>(0.0);
        for (var channel = 0u; channel < 3u; channel++) {
            let own = select(0u, channel, epipolar.counts.x == 3u);
            shares[channel] = f32(answers[own * epipolar.counts.w + pixel.y * frame.image.x + pixel.x]) / f32(WHOLE);
        }
        light = sun_interval(fog, 0.0, distance) * shares;
    }
    // Every pixel that this one stands for was answered.
    let block = u32(frame.depth_more.y);
    for (var n = 0u; n < min(block * block, 16u); n++) {
        let other = min(id.xy * block + vec2<u32>(n % block, n / block), frame.image.xy - vec2<u32>(1u));
        for (var channel = 0u; channel < min(epipolar.counts.x, 3u); channel++) {
            answers[channel * epipolar.counts.w + other.y * frame.image.x + other.x] = 0u;
        }
    }
    light *= sun_scattering(image_direction(id.xy));
    write_pixel(id.xy, light * frame.strength.xyz, transmittance_to(fog, distance), distance);
}
