//! Images of the simulator, with what satellites add.

use wake_physics::scattering::Polarization;
use wake_physics::{Scene, expected_intensity, turbulent};

use super::sea::{Echoes, Speckle, border, clutter, mottle, quick_look};
use super::source::{Draw, Sample, Source, Wake, direction};

/// Images of scenes drawn from a seed: the simulator's mean intensity behind a ship (Kelvin and turbulent wake, velocity
/// bunching) on a grid of half the pixels, times the edge of the turbulent wake, gusts, fronts; through speckle that is
/// correlated, with echoes displaced by the ship's speed, other ships, look-alikes, and a quick-look's grey.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Simulated {
    pub(crate) seed: u64,
    /// Rows and columns.
    pub(crate) size: usize,
    /// Whether the turbulent wake has its edge.
    pub(crate) edge: bool,
}

/// Fine pixels for one of the image, in each direction: cusp waves brighten a pixel that does not show them.
const FINE: usize = 2;
/// Contrast that counts as visible, in standard deviations of a pixel.
const VISIBLE: f32 = 0.3;

impl Source for Simulated {
    fn sample(&self, index: u64) -> Sample {
        let draw = &mut Draw::new(self.seed ^ 0x5151, index);
        let size = self.size;
        let speckle = Speckle::draw(draw);
        let mut mean = vec![1.0; size * size];
        mottle(&mut mean, size, draw);
        border(&mut mean, size, draw);
        let pass = Pass::draw(draw);
        let echoes = Echoes::upright(draw);
        let mut bright = vec![0.0; size * size];
        let mut wakes = Vec::new();
        for _ in 0..draw.one_of(&[0.15, 0.55, 0.22, 0.08]) {
            let ship = pass.ship(size, draw);
            if let Some(ratio) = pass.amplitude(&ship, size, self.edge) {
                let wake = apply(&mut mean, &ratio, &ship, &pass, size, &speckle);
                let shift = [0.0, pass.echo_shift(&ship)];
                if draw.chance(0.9) {
                    echoes.add(&mut bright, size, [wake.tip, shift], wake.axis_deg, draw);
                }
                wakes.push(wake);
            }
        }
        clutter(&mut bright, size, &echoes, draw);
        speckle.apply(&mut mean, size, draw);
        mean.iter_mut().zip(bright).for_each(|(m, b)| *m += b);
        let pixels = quick_look(mean, draw);
        turned(
            Sample {
                size,
                pixels,
                wakes,
            },
            draw,
        )
    }
}

/// Radar and sea of one image.
#[derive(Debug, Clone)]
struct Pass {
    scene: Scene,
    /// Pixels of the image \[m\].
    spacing: f64,
    /// Noise floor over the sea, of intensity.
    noise: f64,
    /// Response time of the scattering to divergence \[s\], and the wind's drift \[m/s\].
    edge: [f64; 2],
}

/// A ship of an image: its scene's ship, heading and place.
type Ship = wake_physics::scene::Ship;

impl Pass {
    fn draw(draw: &mut Draw) -> Self {
        let mut scene = Scene::default();
        let number = |draw: &mut Draw, low: f32, high: f32| f64::from(draw.between(low, high));
        let (frequency, slowest, fastest) = [
            (1.26e9, 95.0, 105.0),
            (3.2e9, 80.0, 90.0),
            (5.405e9, 105.0, 130.0),
            (9.65e9, 75.0, 100.0),
        ][draw.one_of(&[0.25, 0.1, 0.35, 0.3])];
        scene.radar.frequency = frequency;
        scene.radar.range_to_velocity = number(draw, slowest, fastest);
        scene.radar.incidence = number(draw, 20.0, 46.0);
        if draw.chance(0.35) {
            scene.radar.polarization = Polarization::HH;
        }
        scene.sea.wind_speed = number(draw, 2.8, 10.0);
        scene.sea.wind_toward = number(draw, 0.0, 360.0);
        scene.sea.fetch = f64::from(draw.scale(1e4, 2e5));
        let spacing = f64::from(draw.scale(4.0, 14.0));
        scene.radar.resolution = spacing * number(draw, 1.0, 2.0);
        scene.grid.spacing = spacing / FINE as f64;
        scene.model.tolerance = 0.02;
        Self {
            scene,
            spacing,
            noise: f64::from(draw.scale(0.02, 1.5)),
            edge: [
                f64::from(draw.scale(150.0, 1000.0)),
                0.01 + number(draw, 0.0, 0.02),
            ],
        }
    }

    fn ship(&self, size: usize, draw: &mut Draw) -> Ship {
        let length = f64::from(draw.scale(30.0, 350.0));
        let half = 0.5 * (size as f64 - 1.0) * self.spacing;
        let heading = f64::from(draw.between(0.0, 360.0));
        // Most of the wake in the image: ahead of its middle.
        let ahead = f64::from(draw.between(-0.3, 0.95)) * half;
        let aside = f64::from(draw.between(-0.7, 0.7)) * half;
        let (sin, cos) = heading.to_radians().sin_cos();
        Ship {
            length,
            beam: length / f64::from(draw.between(5.0, 8.0)),
            draft: length / f64::from(draw.between(16.0, 30.0)),
            speed: f64::from(draw.between(2.0, 14.0)),
            heading,
            position: [
                (ahead * sin + aside * cos).clamp(-half, half),
                (ahead * cos - aside * sin).clamp(-half, half),
            ],
            ..Ship::default()
        }
    }

    /// Rows by which the echo is displaced: along the flight by R/V times the speed toward the radar.
    fn echo_shift(&self, ship: &Ship) -> f32 {
        let toward = -ship.speed
            * ship.heading.to_radians().sin()
            * self.scene.radar.incidence.to_radians().sin();
        // Larger azimuth is a smaller row.
        (-self.scene.radar.range_to_velocity * toward / self.spacing) as f32
    }

    /// Amplitude with the wake over amplitude without; `None` where physics refuses the scene.
    fn amplitude(&self, ship: &Ship, size: usize, edge: bool) -> Option<Vec<f32>> {
        let mut scene = self.scene.clone();
        (scene.grid.rows, scene.grid.columns) = (size * FINE, size * FINE);
        scene.ships = vec![ship.clone()];
        let field = expected_intensity(&scene).ok()?;
        let mut sorted: Vec<f32> = field.values.iter().step_by(7).copied().collect();
        let middle = sorted.len() / 2;
        let sea = *sorted.select_nth_unstable_by(middle, f32::total_cmp).1;
        if !(sea.is_finite() && sea > 0.0) {
            return None;
        }
        let fine = size * FINE;
        let mut amplitude = Vec::with_capacity(size * size);
        for row in 0..size {
            for column in 0..size {
                let lines = (0..FINE)
                    .map(|k| &field.values[(row * FINE + k) * fine + column * FINE..][..FINE]);
                let sum: f32 = lines.map(|line| line.iter().sum::<f32>()).sum();
                let mut ratio = f64::from(sum / (sea * (FINE * FINE) as f32));
                if edge {
                    ratio *= self.edge_factor(ship, self.place(row, column, size));
                }
                amplitude
                    .push((((ratio + self.noise) / (1.0 + self.noise)).max(0.0).sqrt()) as f32);
            }
        }
        Some(amplitude)
    }

    /// Ground range and azimuth of a pixel \[m\]; the origin lies where the fine grid has it, between four pixels.
    fn place(&self, row: usize, column: usize, size: usize) -> [f64; 2] {
        let off = 0.5 * (FINE as f64 - 1.0) / FINE as f64;
        let half = (size / 2) as f64;
        [
            (column as f64 + off - half) * self.spacing,
            (half - row as f64 - off) * self.spacing,
        ]
    }

    /// Brightening where the surface current of the turbulent wake converges, darkening where it diverges: the wind's
    /// drift is missing in the wake.
    ///
    /// ```text
    /// exp(−T div),   div = (V/W) z exp(−z²/2) exp(−t/τ),   z = η/W,   V = c · wind from port to starboard
    /// ```
    ///
    /// with d the distance astern, t = d/U, η to starboard, W the width of the wake; |T div| ≤ 1.2, τ = 400 s: chosen.
    fn edge_factor(&self, ship: &Ship, [x, y]: [f64; 2]) -> f64 {
        let (sin, cos) = ship.heading.to_radians().sin_cos();
        let (dx, dy) = (x - ship.position[0], y - ship.position[1]);
        let astern = -(dx * sin + dy * cos) - 0.5 * ship.length;
        if astern <= 0.0 {
            return 1.0;
        }
        let starboard = dx * cos - dy * sin;
        let width = turbulent::width(ship.beam, astern);
        let z = starboard / width;
        let [response, drift] = self.edge;
        let wind = self.scene.sea.wind_speed
            * (self.scene.sea.wind_toward - ship.heading)
                .to_radians()
                .sin();
        let age = astern / ship.speed.max(0.1);
        let divergence = drift * wind / width * z * (-0.5 * z * z).exp() * (-age / 400.0).exp();
        (-response * divergence).clamp(-1.2, 1.2).exp()
    }
}

/// Multiplies a mean with the change that a wake makes, and says where it is.
fn apply(
    mean: &mut [f32],
    ratio: &[f32],
    ship: &Ship,
    pass: &Pass,
    size: usize,
    speckle: &Speckle,
) -> Wake {
    let heading = ship.heading.to_radians();
    let stern =
        [0, 1].map(|a| ship.position[a] - 0.5 * ship.length * [heading.sin(), heading.cos()][a]);
    let half = (size / 2) as f64;
    let off = 0.5 * (FINE as f64 - 1.0) / FINE as f64;
    let tip = [
        stern[0] / pass.spacing + half - off,
        half - stern[1] / pass.spacing - off,
    ]
    .map(|x| x as f32);
    let axis_deg = (ship.heading + 180.0).rem_euclid(360.0) as f32;
    let [right, down] = direction(axis_deg);
    let (mut power, mut whole, mut reach) = (0.0, 0.0, 0.0f32);
    // Power by the angle off the axis, in degrees.
    let mut opened = [0.0f32; 21];
    for (i, m) in mean.iter_mut().enumerate() {
        let (x, y) = ((i % size) as f32 - tip[0], (i / size) as f32 - tip[1]);
        let along = x * right + y * down;
        let z = (ratio[i] - 1.0) / speckle.spread;
        let seen = *m > 0.0 && along > 0.0;
        *m *= ratio[i];
        if !seen {
            continue;
        }
        // What makes a line: crests beside it are many, but weak and wide.
        let across = y * right - x * down;
        if across.abs() < 6.0 + 0.05 * along {
            power += z * z;
        }
        if across.abs() < 12.0 + 0.36 * along {
            whole += z * z;
            opened[across.abs().atan2(along).to_degrees().min(20.0) as usize] += z * z;
        }
        if z.abs() > VISIBLE && across.abs() < 12.0 + 0.1 * along {
            reach = reach.max(along);
        }
    }
    // The edges lie where nine tenths of the power lie between them.
    let mut inside = 0.0;
    let edge = opened.iter().position(|share| {
        inside += share;
        inside >= 0.9 * whole
    });
    Wake {
        tip,
        axis_deg,
        half_angle_deg: edge.unwrap_or(0) as f32 + 0.5,
        length: reach.max(20.0),
        snr: (power / speckle.correlated_pixels()).sqrt(),
    }
}

/// The image as other geometries have it: mirrored, or with rows and columns exchanged.
fn turned(sample: Sample, draw: &mut Draw) -> Sample {
    let size = sample.size;
    let [exchange, left_right] = [draw.chance(0.5), draw.chance(0.5)];
    let last = size as f32 - 1.0;
    let mut pixels = sample.pixels;
    let mut wakes = sample.wakes;
    if exchange {
        pixels = (0..size * size)
            .map(|i| pixels[i % size * size + i / size])
            .collect();
        for wake in &mut wakes {
            wake.tip.reverse();
            // Right becomes down: the angle from up becomes that from left, the other way round.
            wake.axis_deg = (270.0 - wake.axis_deg).rem_euclid(360.0);
        }
    }
    if left_right {
        pixels.chunks_exact_mut(size).for_each(<[f32]>::reverse);
        for wake in &mut wakes {
            wake.tip[0] = last - wake.tip[0];
            wake.axis_deg = (-wake.axis_deg).rem_euclid(360.0);
        }
    }
    Sample {
        size,
        pixels,
        wakes,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pass() -> Pass {
        let mut scene = Scene::default();
        (scene.sea.wind_speed, scene.sea.wind_toward) = (5.0, 90.0);
        (scene.radar.incidence, scene.radar.range_to_velocity) = (30.0, 100.0);
        (scene.grid.spacing, scene.model.tolerance) = (5.0, 0.02);
        Pass {
            scene,
            spacing: 10.0,
            noise: 0.0,
            edge: [400.0, 0.03],
        }
    }

    fn ship(heading: f64, speed: f64) -> Ship {
        Ship {
            length: 100.0,
            beam: 16.0,
            draft: 6.0,
            speed,
            heading,
            position: [0.0, 0.0],
            ..Ship::default()
        }
    }

    /// A ship that moves away from the radar at 10 m/s sin 30° = 5 m/s appears 500 m back along the flight: 50 rows down.
    #[test]
    fn a_receding_ship_appears_further_down() {
        assert!((pass().echo_shift(&ship(90.0, 10.0)) - 50.0).abs() < 1e-3);
        assert!((pass().echo_shift(&ship(270.0, 10.0)) + 50.0).abs() < 1e-3);
        assert!(pass().echo_shift(&ship(0.0, 10.0)).abs() < 1e-3);
    }

    /// Bright where the wind comes from, dark on the other side; at one width off the axis the exponent is
    /// T c W₁₀/W · e^{−½}, less what has decayed.
    #[test]
    fn the_edge_is_bright_upwind() {
        let (pass, ship) = (pass(), ship(0.0, 10.0));
        let astern = 300.0;
        let width = turbulent::width(16.0, astern);
        let at = |x: f64| pass.edge_factor(&ship, [x, -50.0 - astern]).ln();
        let expected =
            400.0 * 0.03 * 5.0 / width * (-0.5f64).exp() * (-astern / 10.0 / 400.0).exp();
        // Wind toward starboard comes from port.
        assert!((at(-width) - expected).abs() < 1e-12 && (at(width) + expected).abs() < 1e-12);
        assert!(at(0.0).abs() < 1e-12 && pass.edge_factor(&ship, [5.0, 60.0]) > 0.999_999);
    }

    /// The dark line of the turbulent wake lies on the ray of the label, for headings in every quarter.
    #[test]
    fn the_dark_line_lies_on_the_ray() {
        let (pass, size) = (pass(), 192);
        let speckle = Speckle {
            spread: 0.2,
            filter: [0.0; 2],
        };
        for heading in [20.0, 115.0, 200.0, 290.0] {
            let ship = ship(heading, 6.0);
            let ratio = pass.amplitude(&ship, size, false).expect("a scene");
            let wake = apply(
                &mut vec![1.0; size * size],
                &ratio,
                &ship,
                &pass,
                size,
                &speckle,
            );
            let [right, down] = wake.direction();
            let mean = |across: i32| {
                let at = |along: i32| {
                    let [x, y] = wake.at(along as f32);
                    let (x, y) = (
                        (x - across as f32 * down).round(),
                        (y + across as f32 * right).round(),
                    );
                    ratio[y as usize * size + x as usize]
                };
                (20..70).map(at).sum::<f32>()
            };
            let darkest = (-12..=12)
                .min_by(|&a, &b| mean(a).total_cmp(&mean(b)))
                .expect("a profile");
            // Velocity bunching moves the line by less than its width, 3 pixels.
            assert!(darkest.abs() <= 3, "{heading}: {darkest}");
        }
    }

    #[test]
    fn an_image_follows_from_seed_and_number() {
        let source = Simulated {
            seed: 5,
            size: 64,
            edge: true,
        };
        assert_eq!(source.sample(3), source.sample(3));
        assert_ne!(source.sample(3).pixels, source.sample(4).pixels);
    }

    /// Turned images keep their labels: the pixel of a tip is the same one.
    #[test]
    fn a_turned_image_has_turned_labels() {
        let size = 32;
        for seed in 0..8 {
            let mut pixels = vec![0.0; size * size];
            (pixels[5 * size + 9], pixels[5 * size + 12]) = (200.0, 100.0);
            let wake = Wake {
                tip: [9.0, 5.0],
                axis_deg: 90.0,
                half_angle_deg: 1.0,
                length: 3.0,
                snr: 9.0,
            };
            let turned = turned(
                Sample {
                    size,
                    pixels,
                    wakes: vec![wake],
                },
                &mut Draw::new(seed, 1),
            );
            let grey =
                |[x, y]: [f32; 2]| turned.pixels[y.round() as usize * size + x.round() as usize];
            let wake = turned.wakes[0];
            assert!(
                grey(wake.tip) > 150.0 && (grey(wake.at(3.0)) - 100.0).abs() < 1.0,
                "{wake:?}"
            );
        }
    }
}
