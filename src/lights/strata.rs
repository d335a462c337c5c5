//! Structured importance sampling (Agarwal et al. 2003): a lat-long map as a few directional lights.
//!
//! The map is cut by brightness, from bright to dark (hierarchical thresholding, Section 3.1). Each connected component
//! of a layer gets lights in proportion to Gamma(L, dw) = L^a min(dw, dw0)^b (Eq. 14), those of the layers inside it
//! counted, placed farthest from one another (Gonzalez' traversal, which the paper takes for Hochbaum and Shmoys').
//! Each texel then belongs to the nearest light, and its energy is that light's. Where the paper leaves a choice: levels
//! are multiples of the solid-angle weighted deviation, neighbours share an edge and azimuth wraps; N_j is rounded, and
//! a component whose share of the energy is worth one light gets one; the first centre is the brightest texel; chords
//! within 1e-9 are equal, and the lowest texel wins.

use crate::blob::{Room, Size};
use crate::light::pixels::Rows;
use crate::lights::Map;
use crate::numeric::is_float;
use crate::sphere::latlong_solid_angle;
use crate::status::{Error, Result, Status};
use bytemuck::{Pod, Zeroable};
use core::f64::consts::PI;

/// What a stratification is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// Columns and rows of the map; at most 2^31 texels.
    pub width: u32,
    /// Rows, the first about +z.
    pub height: u32,
    /// Lights to place.
    pub count: u32,
    /// Layers of brightness, at least 1.
    pub levels: u32,
    /// The exponent of radiance, a.
    pub radiance_exponent: f64,
    /// The exponent of solid angle, b.
    pub angle_exponent: f64,
    /// The solid angle from which on size does not count, dw0.
    pub angle_limit: f64,
}

impl Config {
    /// The paper's choices (Section 3.1) for a map.
    pub fn new(width: u32, height: u32, count: u32) -> Config {
        Config { width, height, count, levels: 6, radiance_exponent: 1.0, angle_exponent: 0.25, angle_limit: 0.01 }
    }

    /// Texels of the map.
    pub fn texels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The most lights that there may be: the footnote rule may add to `count`, at most one for each texel.
    pub fn capacity(&self) -> usize {
        // At most `count` components of a layer are worth a light of their own, in each of the layers.
        let most = (self.count as usize).saturating_mul(self.levels as usize + 1);
        most.min(self.texels())
    }

    /// The bytes of the lights, and of the scratch memory; `None` if no memory is as long.
    pub fn size(&self) -> Option<Size> {
        let mut room = Room::new(&mut []);
        Strata::new(self, &mut room);
        Some(Size { bytes: self.capacity() * size_of::<Light>(), scratch: room.asked? })
    }

    /// Cuts a map into strata and writes each as a light; answers how many there are. `labels` may be empty, else it gets
    /// the number of the light of each texel. Memory is as long as [`Config::size`] says.
    ///
    /// # Errors
    /// Of a row; [`Status::Overflow`] if the light of a stratum is no float.
    pub fn lights_in(
        &self,
        map: &Map,
        rows: &Rows<'_>,
        memory: &mut [u8],
        lights: &mut [Light],
        labels: &mut [u32],
    ) -> core::result::Result<usize, Error> {
        let mut strata = Strata::new(self, &mut Room::new(memory));
        map.decode(rows, strata.luminance, strata.rgb)?;
        strata.stratify()?;
        strata.gather(|d| map.frame.to_world(d.map(|c| c as f32)), lights)?;
        for (label, number) in labels.iter_mut().zip(strata.component) {
            *label = if strata.count == 0 { 0 } else { *number };
        }
        Ok(strata.count)
    }

    /// Gamma of a luminous energy, as a share of the map's, and a solid angle: powers of energies leave the range of a
    /// double, powers of shares only where they do not matter.
    fn importance(&self, share: f64, angle: f64) -> f64 {
        power(share, self.radiance_exponent) * power(angle.min(self.angle_limit), self.angle_exponent)
    }
}

fn power(x: f64, exponent: f64) -> f64 {
    if exponent == 1.0 { x } else { libm::pow(x, exponent) }
}

/// A stratum as a directional light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Light {
    /// The direction towards the light: the centre of the stratum, unit length, world space.
    pub direction: [f32; 3],
    /// Radiance x solid angle, summed over the stratum: the irradiance on a surface that faces the light.
    pub rgb: [f32; 3],
    /// The luminance of `rgb`.
    pub luminance: f32,
    /// The solid angle of the stratum.
    pub solid_angle: f32,
    /// The largest angle from the centre to a texel's centre in the stratum, in radians.
    pub extent: f32,
}

/// What a light gathers.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
struct Gathered {
    rgb: [f64; 3],
    luminance: f64,
    solid_angle: f64,
    chord: f64,
}

/// A ball of directions.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
struct Ball {
    centre: [f64; 3],
    /// No member is farther from the centre.
    radius: f64,
    /// The largest squared chord from a member to the nearest light.
    farthest: f64,
}

/// Members in a ball.
const GROUP: usize = 256;
/// Texels of a map are walked in blocks of this many rows and columns.
const BLOCK: u32 = 16;
/// Chords that differ by less are equal.
const TIE: f64 = 1e-9;
const NO_TEXEL: u32 = u32::MAX;

/// A stratification in progress, in memory that is as long as [`Config::size`] says.
pub struct Strata<'a> {
    config: Config,
    /// Of each texel, finite and not negative.
    pub luminance: &'a mut [f64],
    rgb: &'a mut [[f32; 3]],
    gathered: &'a mut [Gathered],
    /// The texels of the centres, in the order in which they were found.
    pub centres: &'a mut [u32],
    /// How many centres there are: 0 for a black map.
    pub count: usize,
    /// For each row: sine and cosine of the polar angle, and the solid angle of a texel.
    rows: &'a mut [[f64; 3]],
    /// For each column: cosine and sine of the azimuth.
    columns: &'a mut [[f64; 2]],
    /// For each texel: the component that it belongs to, as its first texel; in the end the number of the nearest centre.
    pub component: &'a mut [u32],
    /// Texels, component by component, near ones close together.
    members: &'a mut [u32],
    /// For each member: the squared chord to the nearest centre.
    distance: &'a mut [f64],
    /// For each texel that is a component's first: the range of its members.
    start: &'a mut [u32],
    /// For each group of members: a ball around them, and the largest distance among them.
    balls: &'a mut [Ball],
    /// For each texel: whether it is a centre.
    is_centre: &'a mut [u8],
    /// The sum of luminance x solid angle.
    energy: f64,
}

impl<'a> Strata<'a> {
    /// None yet.
    pub fn new(config: &Config, room: &mut Room<'a>) -> Strata<'a> {
        let (texels, capacity) = (config.texels(), config.capacity());
        Strata {
            config: *config,
            luminance: room.take(texels),
            rgb: room.take(texels),
            gathered: room.take(capacity),
            centres: room.take(capacity),
            count: 0,
            rows: room.take(config.height as usize),
            columns: room.take(config.width as usize),
            component: room.take(texels),
            members: room.take(texels),
            distance: room.take(texels),
            start: room.take(texels),
            balls: room.take(texels.div_ceil(GROUP) + 1),
            is_centre: room.take(texels),
            energy: 0.0,
        }
    }

    /// Places the lights of a map of luminance.
    ///
    /// # Errors
    /// [`Status::InvalidArgument`] for a config that is none.
    pub fn stratify(&mut self) -> Result<()> {
        let Config { width, height, count, levels, radiance_exponent, angle_exponent, angle_limit } = self.config;
        let texels = self.config.texels();
        let sound_map = width > 0 && height > 0 && texels < NO_TEXEL as usize && self.luminance.len() == texels;
        let in_range = |exponent: f64| (0.0..f64::INFINITY).contains(&exponent);
        let sound_metric =
            angle_limit > 0.0 && [angle_limit, radiance_exponent, angle_exponent].map(in_range) == [true; 3];
        if !(sound_map && sound_metric && levels > 0) {
            return Err(Status::InvalidArgument);
        }
        let deviation = self.prepare();
        if self.energy > 0.0 && count > 0 {
            for level in (0..levels).rev() {
                self.layer(if level == 0 { -1.0 } else { f64::from(level) * deviation });
            }
            self.label();
        }
        Ok(())
    }

    /// Sums the light of the map over the strata.
    ///
    /// # Errors
    /// [`Status::Overflow`] if the light of a stratum is no float; no light is written then.
    fn gather(&mut self, to_world: impl Fn([f64; 3]) -> [f32; 3], lights: &mut [Light]) -> Result<()> {
        let gathered = core::mem::take(&mut self.gathered).get_mut(..self.count).unwrap_or_default();
        gathered.fill(Gathered::default());
        for (texel, (colour, &label)) in self.rgb.iter().zip(self.component.iter()).enumerate() {
            let Some(sum) = gathered.get_mut(label as usize) else { continue };
            let dw = self.solid_angle(texel);
            for (sum, channel) in sum.rgb.iter_mut().zip(colour) {
                *sum += f64::from(*channel) * dw;
            }
            sum.luminance += at(self.luminance, texel) * dw;
            sum.solid_angle += dw;
            let centre = at(self.centres, label as usize);
            sum.chord = sum.chord.max(between(self.direction(centre), self.direction(texel as u32)));
        }
        let fits = |sum: &Gathered| sum.rgb.iter().chain([&sum.luminance]).all(|value| is_float(*value));
        if !gathered.iter().all(fits) {
            return Err(Status::Overflow);
        }
        for ((light, sum), &centre) in lights.iter_mut().zip(gathered.iter()).zip(self.centres.iter()) {
            let half_chord = 0.5 * libm::sqrt(sum.chord);
            *light = Light {
                direction: to_world(self.direction(centre)),
                rgb: sum.rgb.map(|channel| channel as f32),
                luminance: sum.luminance as f32,
                solid_angle: sum.solid_angle as f32,
                extent: 2.0 * libm::asin(if half_chord < 1.0 { half_chord } else { 1.0 }) as f32,
            };
        }
        Ok(())
    }

    /// Fills the tables; returns the solid-angle weighted deviation of luminance.
    fn prepare(&mut self) -> f64 {
        let Config { width, height, .. } = self.config;
        for (y, row) in self.rows.iter_mut().take(height as usize).enumerate() {
            let theta = PI * (y as f64 + 0.5) / f64::from(height);
            *row = [libm::sin(theta), libm::cos(theta), latlong_solid_angle(width, height, y as u32)];
        }
        for (x, column) in self.columns.iter_mut().take(width as usize).enumerate() {
            let phi = 2.0 * PI * (x as f64 + 0.5) / f64::from(width);
            *column = [libm::cos(phi), libm::sin(phi)];
        }
        self.is_centre.fill(0);
        let (mut energy, mut angle) = (0.0, 0.0);
        for texel in 0..self.luminance.len() {
            let dw = self.solid_angle(texel);
            energy += at(self.luminance, texel) * dw;
            angle += dw;
        }
        let mean = energy / angle;
        let mut squares = 0.0;
        for texel in 0..self.luminance.len() {
            let difference = at(self.luminance, texel) - mean;
            squares += difference * difference * self.solid_angle(texel);
        }
        self.energy = energy;
        libm::sqrt(squares / angle)
    }

    fn solid_angle(&self, texel: usize) -> f64 {
        at(self.rows, texel / self.config.width.max(1) as usize)[2]
    }

    /// The direction of a texel's centre.
    fn direction(&self, texel: u32) -> [f64; 3] {
        // A width of 0 was refused; said again, it leaves no panic path.
        let width = self.config.width.max(1);
        let ([sine, cosine, _], [x, y]) =
            (at(self.rows, (texel / width) as usize), at(self.columns, (texel % width) as usize));
        [sine * x, sine * y, cosine]
    }

    /// Gives lights to the components of what is brighter than a threshold.
    fn layer(&mut self, threshold: f64) {
        self.find_components(threshold);
        self.sort();
        for texel in 0..self.config.texels() as u32 {
            if self.component(texel) == texel {
                self.place(texel);
            }
        }
    }

    fn component(&self, texel: u32) -> u32 {
        self.component.get(texel as usize).copied().unwrap_or(NO_TEXEL)
    }

    /// Labels every bright texel with the first texel of its component; union-find over left and upper neighbours.
    fn find_components(&mut self, threshold: f64) {
        let Config { width, height, .. } = self.config;
        for ((texel, label), &value) in (0..).zip(self.component.iter_mut()).zip(self.luminance.iter()) {
            *label = if value > threshold { texel } else { NO_TEXEL };
        }
        for texel in 0..width * height {
            if self.component(texel) != NO_TEXEL {
                // The last column touches the first one.
                let right = if (texel + 1) % width.max(1) > 0 { texel + 1 } else { texel + 1 - width };
                self.join(texel, right);
                self.join(texel, if texel < width * (height - 1) { texel + width } else { texel });
            }
        }
        for texel in 0..width * height {
            if self.component(texel) != NO_TEXEL {
                let root = self.root(texel);
                put(self.component, texel, root);
            }
        }
    }

    /// Joins two texels' components if both are bright: the root is the first texel.
    fn join(&mut self, a: u32, b: u32) {
        if self.component(b) == NO_TEXEL {
            return;
        }
        let (a, b) = (self.root(a), self.root(b));
        put(self.component, a.max(b), a.min(b));
    }

    fn root(&mut self, texel: u32) -> u32 {
        let mut texel = texel;
        loop {
            let parent = self.component(texel);
            if parent == texel || parent == NO_TEXEL {
                return texel;
            }
            // Halving the path keeps later ones short.
            let grandparent = self.component(parent);
            put(self.component, texel, grandparent);
            texel = grandparent;
        }
    }

    /// Sorts the texels by component, block by block of the map within each.
    fn sort(&mut self) {
        let texels = self.config.texels();
        self.start.fill(0);
        for texel in 0..texels as u32 {
            if let Some(size) = self.start.get_mut(self.component(texel) as usize) {
                *size += 1;
            }
        }
        let mut sum = 0;
        for slot in self.start.iter_mut().take(texels) {
            let size = *slot;
            *slot = sum;
            sum += size;
        }
        let Config { width, height, .. } = self.config;
        let (across, down) = (width.div_ceil(BLOCK).max(1), height.div_ceil(BLOCK));
        for block in 0..across * down {
            let (x0, y0) = (block % across * BLOCK, block / across * BLOCK);
            for y in y0..(y0 + BLOCK).min(height) {
                for x in x0..(x0 + BLOCK).min(width) {
                    self.push_member(y * width + x);
                }
            }
        }
    }

    /// Appends a texel to its component; `start` then points behind it.
    fn push_member(&mut self, texel: u32) {
        let component = self.component(texel);
        if let Some(end) = self.start.get_mut(component as usize) {
            put(self.members, *end, texel);
            *end += 1;
        }
    }

    /// The members of a component as a range: after `sort`, `start` of a component is its end.
    fn range(&self, component: u32) -> (usize, usize) {
        let [before, end] =
            [component.wrapping_sub(1), component].map(|component| at(self.start, component as usize) as usize);
        (before, end)
    }

    /// Gives a component the lights that it lacks.
    fn place(&mut self, component: u32) {
        let (first, end) = self.range(component);
        let (mut energy, mut angle, mut nested) = (0.0, 0.0, 0usize);
        for index in first..end {
            let texel = at(self.members, index) as usize;
            let dw = self.solid_angle(texel);
            energy += at(self.luminance, texel) * dw;
            angle += dw;
            nested += usize::from(at(self.is_centre, texel));
        }
        let wanted = self.lights(energy, angle);
        let added = wanted.saturating_sub(nested).min(end - first - nested);
        if added == 0 {
            return;
        }
        self.enclose(first, end);
        let rest = if nested == 0 {
            let brightest = self.brightest(first, end);
            self.add(brightest);
            self.approach(first, end, brightest);
            added - 1
        } else {
            self.settle(first, end, Some(component));
            added
        };
        for _ in 0..rest {
            let farthest = self.farthest(first, end);
            self.add(farthest);
            self.approach(first, end, farthest);
        }
    }

    /// The lights that a component of an energy and a solid angle should have.
    fn lights(&self, energy: f64, angle: f64) -> usize {
        let n = f64::from(self.config.count);
        let share = energy / self.energy;
        let whole = self.config.importance(1.0, 4.0 * PI);
        let rounded = libm::floor(n * self.config.importance(share, angle) / whole + 0.5);
        if rounded < 1.0 { usize::from(n * share >= 1.0) } else { rounded as usize }
    }

    fn add(&mut self, texel: u32) {
        if let (Some(slot), Some(mark)) = (self.centres.get_mut(self.count), self.is_centre.get_mut(texel as usize)) {
            (*slot, *mark) = (texel, 1);
            self.count += 1;
        }
    }

    fn brightest(&self, first: usize, end: usize) -> u32 {
        let mut best = (NO_TEXEL, -1.0);
        for index in first..end {
            let texel = at(self.members, index);
            let value = at(self.luminance, texel as usize);
            if value > best.1 || value == best.1 && texel < best.0 {
                best = (texel, value);
            }
        }
        best.0
    }

    /// Puts balls around the groups of members; no centre is near yet.
    fn enclose(&mut self, first: usize, end: usize) {
        for (number, (group, last)) in groups(first, end).enumerate() {
            let mut sum = [0.0; 3];
            for index in group..last {
                let d = self.direction(at(self.members, index));
                sum = [sum[0] + d[0], sum[1] + d[1], sum[2] + d[2]];
            }
            let centre = sum.map(|s| s / (last - group) as f64);
            let squared =
                (group..last).fold(0.0f64, |most, i| most.max(between(centre, self.direction(at(self.members, i)))));
            self.distance.get_mut(group..last).unwrap_or_default().fill(f64::INFINITY);
            let ball = Ball { centre, radius: libm::sqrt(squared), farthest: f64::INFINITY };
            put(self.balls, number as u32, ball);
        }
    }

    /// Notes in the ball of a group how far its members are from the nearest centre.
    fn note_farthest(&mut self, number: usize, group: usize, last: usize) {
        let distances = self.distance.get(group..last).unwrap_or(&[]);
        let farthest = distances.iter().fold(0.0f64, |farthest, &d| farthest.max(d));
        put(self.balls, number as u32, Ball { farthest, ..at(self.balls, number) });
    }

    /// Tells the members of a new centre. A group is left out if the centre is too far from its ball to be the nearest
    /// of any member.
    fn approach(&mut self, first: usize, end: usize, texel: u32) {
        let centre = self.direction(texel);
        for (number, (group, last)) in groups(first, end).enumerate() {
            let ball = at(self.balls, number);
            let gap = libm::sqrt(between(centre, ball.centre)) - ball.radius;
            if gap <= 0.0 || gap * gap <= ball.farthest * (1.0 + 1e-9) {
                self.approach_group(group, last, centre, None);
                self.note_farthest(number, group, last);
            }
        }
    }

    /// The member farthest from all centres; of equal ones the first texel.
    fn farthest(&self, first: usize, end: usize) -> u32 {
        let balls = self.balls.get(..(end - first).div_ceil(GROUP)).unwrap_or(&[]);
        let chord = libm::sqrt(balls.iter().fold(0.0f64, |largest, ball| largest.max(ball.farthest)));
        let bound = (chord - TIE).max(0.0);
        let is_far = |distance: f64| distance >= bound * bound;
        let far = groups(first, end).zip(balls).filter(|(_, ball)| is_far(ball.farthest));
        far.flat_map(|((group, last), _)| group..last)
            .filter(|&index| self.distance.get(index).is_some_and(|&distance| is_far(distance)))
            .map(|index| at(self.members, index))
            .filter(|&texel| self.is_centre.get(texel as usize) == Some(&0))
            .fold(NO_TEXEL, u32::min)
    }

    /// Writes the number of the nearest centre for each texel. The first of equal ones wins.
    fn label(&mut self) {
        // After the last layer all texels are one component: its members are all texels, block by block.
        let end = self.config.texels();
        self.enclose(0, end);
        self.settle(0, end, None);
    }

    /// Finds the nearest centre for each member, of those in a component; or of all, and labels members by it. For a group only those are tried
    /// that can be nearest to any of its members.
    fn settle(&mut self, first: usize, end: usize, component: Option<u32>) {
        for (number, (group, last)) in groups(first, end).enumerate() {
            let ball = at(self.balls, number);
            let away = |this: &Self, index: usize| {
                let centre = at(this.centres, index);
                let direction = this.direction(centre);
                component
                    .is_none_or(|of| this.component(centre) == of)
                    .then(|| (direction, between(ball.centre, direction)))
            };
            let nearest = (0..self.count).filter_map(|index| away(self, index));
            let nearest = nearest.fold(f64::INFINITY, |nearest, (_, squared)| nearest.min(squared));
            let reach = libm::sqrt(nearest) + 2.0 * ball.radius + TIE;
            for index in 0..self.count {
                if let Some((direction, _)) = away(self, index).filter(|(_, squared)| *squared <= reach * reach) {
                    self.approach_group(group, last, direction, component.is_none().then_some(index as u32));
                }
            }
            self.note_farthest(number, group, last);
        }
    }

    /// Tells the members of a group of a centre; those to which it is the nearest so far get its label, if it has one.
    fn approach_group(&mut self, group: usize, last: usize, centre: [f64; 3], label: Option<u32>) {
        for index in group..last {
            let texel = at(self.members, index);
            let squared = between(centre, self.direction(texel));
            if let Some(slot) = self.distance.get_mut(index).filter(|slot| squared < **slot) {
                *slot = squared;
                label.into_iter().for_each(|label| put(self.component, texel, label));
            }
        }
    }
}

/// The squared distance of two points.
fn between(a: [f64; 3], b: [f64; 3]) -> f64 {
    let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
}

/// Members in groups: where each begins and ends.
fn groups(first: usize, end: usize) -> impl Iterator<Item = (usize, usize)> {
    (first..end).step_by(GROUP).map(move |group| (group, (group + GROUP).min(end)))
}

/// An element; 0 if there is none.
fn at<T: Copy + Default>(of: &[T], index: usize) -> T {
    of.get(index).copied().unwrap_or_default()
}

/// Writes an element, if there is one.
fn put<T>(out: &mut [T], index: u32, value: T) {
    if let Some(slot) = out.get_mut(index as usize) {
        *slot = value;
    }
}
