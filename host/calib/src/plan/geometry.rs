//! Nearest points of the simple solids that stand for robot, bar and fixtures; metres.

use ballbar::Vector3;

type Point = Vector3<f64>;

/// A line from one point to another; with a radius, a capsule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// One end.
    pub from_m: Point,
    /// The other end.
    pub to_m: Point,
}

/// A round plate without thickness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Its middle.
    pub centre_m: Point,
    /// Unit vector across it.
    pub normal: Point,
    /// From the middle to the rim.
    pub radius_m: f64,
}

/// A convex solid without thickness: the solids of a scene are all points within some radius of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Core {
    /// Of a ball.
    Point(Point),
    /// Of a capsule.
    Segment(Segment),
    /// Of a plate.
    Disc(Disc),
    /// All that is not above this z.
    Below(f64),
}

impl Segment {
    /// The point at a share of the length.
    pub fn at(&self, share: f64) -> Point {
        self.from_m + (self.to_m - self.from_m) * share
    }

    fn nearest_to_point(&self, point_m: &Point) -> Point {
        let along_m = self.to_m - self.from_m;
        let square = along_m.norm_squared();
        let share = if square > 0.0 { ((point_m - self.from_m).dot(&along_m) / square).clamp(0.0, 1.0) } else { 0.0 };
        self.at(share)
    }

    /// Of this segment and of another (C. Ericson, "Real-Time Collision Detection", Morgan Kaufmann 2005, 5.1.9).
    fn nearest_to_segment(&self, other: &Self) -> (Point, Point) {
        let (d1, d2) = (self.to_m - self.from_m, other.to_m - other.from_m);
        let between = self.from_m - other.from_m;
        let (a, e, f) = (d1.norm_squared(), d2.norm_squared(), d2.dot(&between));
        if a <= 0.0 {
            return (self.from_m, other.nearest_to_point(&self.from_m));
        }
        if e <= 0.0 {
            return (self.nearest_to_point(&other.from_m), other.from_m);
        }
        let (b, c) = (d1.dot(&d2), d1.dot(&between));
        let denominator = a * e - b * b;
        let s = if denominator > 0.0 { ((b * f - c * e) / denominator).clamp(0.0, 1.0) } else { 0.0 };
        let t = (b * s + f) / e;
        let (s, t) = match t {
            t if t < 0.0 => ((-c / a).clamp(0.0, 1.0), 0.0),
            t if t > 1.0 => (((b - c) / a).clamp(0.0, 1.0), 1.0),
            t => (s, t),
        };
        (self.at(s), other.at(t))
    }

    /// Without a piece of some length at either end; what nothing would be left of is a point.
    fn without_ends(&self, from_m: f64, to_m: f64) -> Self {
        let length_m = (self.to_m - self.from_m).norm();
        if from_m + to_m >= length_m {
            let middle_m = self.at(if from_m + to_m > 0.0 { from_m / (from_m + to_m) } else { 0.5 });
            return Self { from_m: middle_m, to_m: middle_m };
        }
        Self { from_m: self.at(from_m / length_m), to_m: self.at(1.0 - to_m / length_m) }
    }

    fn lowest(&self) -> Point {
        if self.from_m.z < self.to_m.z { self.from_m } else { self.to_m }
    }
}

impl Disc {
    fn nearest_to_point(&self, point_m: &Point) -> Point {
        let off_m = point_m - self.centre_m;
        let flat_m = off_m - self.normal * off_m.dot(&self.normal);
        let from_axis_m = flat_m.norm();
        self.centre_m + if from_axis_m > self.radius_m { flat_m * (self.radius_m / from_axis_m) } else { flat_m }
    }

    /// Of the disc and of a segment, to rounding.
    ///
    /// With `h` the height above the disc's plane and `r` the distance from its axis, the distance's square is `h² + max(0, r − R)²`:
    /// convex along the segment, with a continuous slope, whose zero Newton's method finds in a few steps, kept between the ends that
    /// it is known to lie between.
    fn nearest_to_segment(&self, segment: &Segment) -> (Point, Point) {
        let point_m = segment.at(self.nearest_share(segment));
        (self.nearest_to_point(&point_m), point_m)
    }

    fn nearest_share(&self, segment: &Segment) -> f64 {
        const STEPS: usize = 40;
        const TOLERANCE: f64 = 1e-10;
        let (from_m, along_m) = (segment.from_m - self.centre_m, segment.to_m - segment.from_m);
        let (from_height_m, climb_m) = (from_m.dot(&self.normal), along_m.dot(&self.normal));
        let (from_flat_m, flat_m) = (from_m - self.normal * from_height_m, along_m - self.normal * climb_m);
        let flat_square = flat_m.norm_squared();
        // Half of the first and second derivatives of the distance's square at a share of the length.
        let at = |share: f64| {
            let flat_from_axis_m = from_flat_m + flat_m * share;
            let from_axis_m = flat_from_axis_m.norm();
            let beyond_m = from_axis_m - self.radius_m;
            let (slope, curvature) = ((from_height_m + climb_m * share) * climb_m, climb_m * climb_m);
            if beyond_m <= 0.0 {
                return (slope, curvature);
            }
            let outward_m = flat_from_axis_m.dot(&flat_m) / from_axis_m;
            let turning = (flat_square - outward_m * outward_m).max(0.0) * beyond_m / from_axis_m;
            (slope + beyond_m * outward_m, curvature + outward_m * outward_m + turning)
        };
        let (mut low, mut high) = (0.0, 1.0);
        let (start, end) = (at(low).0, at(high).0);
        if start >= 0.0 {
            return low;
        }
        if end <= 0.0 {
            return high;
        }
        let mut share = start / (start - end);
        for _ in 0..STEPS {
            let (slope, curvature) = at(share);
            if slope == 0.0 || high - low < TOLERANCE {
                break;
            }
            if slope < 0.0 {
                low = share;
            } else {
                high = share;
            }
            let newton = share - slope / curvature;
            let next = if newton > low && newton < high { newton } else { (low + high) / 2.0 };
            let step = (next - share).abs();
            share = next;
            if step < TOLERANCE {
                break;
            }
        }
        share
    }

    /// Of this disc and of another: each is projected onto the other in turn, until no plane between them could show them to be nearer
    /// by more than a micrometre.
    ///
    /// Projecting in turn is gradient descent on half of the distance's square, which creeps where discs all but touch: 570 µm too much
    /// after 200 steps, of 3,000 random pairs. With Nesterov's momentum, dropped where it points uphill (O'Donoghue and Candès 2015), the
    /// worst of the same pairs was off by less than a nanometre, and the mean pair took 7 steps instead of 17.
    fn nearest_to_disc(&self, other: &Self) -> (Point, Point) {
        const STEPS: usize = 200;
        const TOLERANCE_M: f64 = 1e-6;
        let mut mine_m = self.centre_m;
        let mut theirs_m = other.nearest_to_point(&mine_m);
        let (mut ahead_m, mut momentum) = (mine_m, 1.0_f64);
        for _ in 0..STEPS {
            let before_m = mine_m;
            mine_m = self.nearest_to_point(&other.nearest_to_point(&ahead_m));
            theirs_m = other.nearest_to_point(&mine_m);
            let between_m = theirs_m - mine_m;
            let distance_m = between_m.norm();
            let Some(towards) = between_m.try_normalize(TOLERANCE_M) else { break };
            let apart_m = -other.farthest_m(&-towards) - self.farthest_m(&towards);
            if distance_m - apart_m < TOLERANCE_M {
                break;
            }
            if (ahead_m - mine_m).dot(&(mine_m - before_m)) > 0.0 {
                momentum = 1.0;
            }
            let next = (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt()) / 2.0;
            ahead_m = mine_m + (mine_m - before_m) * ((momentum - 1.0) / next);
            momentum = next;
        }
        (mine_m, theirs_m)
    }

    /// How far the disc reaches in a direction, from the origin.
    fn farthest_m(&self, towards: &Point) -> f64 {
        self.centre_m.dot(towards) + self.radius_m * sine(towards.dot(&self.normal))
    }

    fn lowest(&self) -> Point {
        let down = Vector3::z() * -1.0;
        let flat = down - self.normal * down.dot(&self.normal);
        self.centre_m + flat.try_normalize(1e-12).unwrap_or_else(Vector3::zeros) * self.radius_m
    }
}

/// Of an angle whose cosine is given.
pub(super) fn sine(cosine: f64) -> f64 {
    (1.0 - cosine * cosine).max(0.0).sqrt()
}

impl Core {
    /// The point of this one and that of another that are nearest to one another.
    pub fn nearest(&self, other: &Self) -> (Point, Point) {
        let swapped = |(a, b): (Point, Point)| (b, a);
        match (self, other) {
            (Self::Below(z_m), other) => {
                let lowest_m = other.lowest();
                (Vector3::new(lowest_m.x, lowest_m.y, z_m.min(lowest_m.z)), lowest_m)
            }
            (Self::Point(a), Self::Point(b)) => (*a, *b),
            (Self::Point(a), Self::Segment(b)) => (*a, b.nearest_to_point(a)),
            (Self::Point(a), Self::Disc(b)) => (*a, b.nearest_to_point(a)),
            (Self::Segment(a), Self::Segment(b)) => a.nearest_to_segment(b),
            (Self::Disc(a), Self::Segment(b)) => a.nearest_to_segment(b),
            (Self::Disc(a), Self::Disc(b)) => a.nearest_to_disc(b),
            (_, Self::Below(_)) | (Self::Segment(_), _) | (Self::Disc(_), _) => swapped(other.nearest(self)),
        }
    }

    /// Distance to another.
    pub fn distance_m(&self, other: &Self) -> f64 {
        match (self, other) {
            // Below the surface it is negative, so that deeper is worse.
            (Self::Below(z_m), solid) | (solid, Self::Below(z_m)) => solid.lowest().z - z_m,
            _ => {
                let (a, b) = self.nearest(other);
                (a - b).norm()
            }
        }
    }

    /// A segment without a piece of some length at some of its ends; other cores as they are.
    pub(super) fn without_ends(&self, is_cut: [bool; 2], piece_m: f64) -> Self {
        match self {
            Self::Segment(segment) if is_cut != [false; 2] => {
                let [from_m, to_m] = is_cut.map(|is_cut| if is_cut { piece_m } else { 0.0 });
                Self::Segment(segment.without_ends(from_m, to_m))
            }
            core => *core,
        }
    }

    /// The ends of a segment.
    pub(super) fn ends(&self) -> Option<[Self; 2]> {
        match self {
            Self::Segment(Segment { from_m, to_m }) => Some([Self::Point(*from_m), Self::Point(*to_m)]),
            _ => None,
        }
    }

    /// Centre and radius of a ball about it; infinite about a half space.
    pub(super) fn ball(&self) -> (Point, f64) {
        match self {
            Self::Point(centre_m) => (*centre_m, 0.0),
            Self::Segment(Segment { from_m, to_m }) => ((from_m + to_m) / 2.0, (to_m - from_m).norm() / 2.0),
            Self::Disc(disc) => (disc.centre_m, disc.radius_m),
            Self::Below(_) => (Vector3::zeros(), f64::INFINITY),
        }
    }

    fn lowest(&self) -> Point {
        match self {
            Self::Point(centre_m) => *centre_m,
            Self::Segment(segment) => segment.lowest(),
            Self::Disc(disc) => disc.lowest(),
            Self::Below(_) => Vector3::new(0.0, 0.0, f64::NEG_INFINITY),
        }
    }
}

/// The disc that carries some points at `height_m` behind them; `side` says where before is.
pub(super) fn carrier(points_m: &[Vector3<f64>], side: Vector3<f64>, height_m: f64, rim_m: f64) -> Disc {
    let centre_m = points_m.iter().sum::<Vector3<f64>>() / points_m.len() as f64;
    let normal = plane_normal(points_m).map_or(side, |normal| if normal.dot(&side) < 0.0 { -normal } else { normal });
    let widest_m = points_m.iter().map(|point_m| (point_m - centre_m).norm()).fold(0.0, f64::max);
    Disc { centre_m: centre_m - normal * height_m, normal, radius_m: widest_m + rim_m }
}

/// From the tool's origin to its spheres; along its z when they are about it.
pub(super) fn outward(spheres_tool_m: &[Vector3<f64>]) -> Vector3<f64> {
    let sum_m = spheres_tool_m.iter().sum::<Vector3<f64>>();
    sum_m.try_normalize(1e-9).unwrap_or(Vector3::z())
}

/// Unit normal of the plane through the points that span the largest triangle; `None` when they are in one line.
fn plane_normal(points_m: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let (first_m, others_m) = points_m.split_first()?;
    let mut largest = Vector3::zeros();
    for (i, a_m) in others_m.iter().enumerate() {
        for b_m in &others_m[..i] {
            let across = (a_m - first_m).cross(&(b_m - first_m));
            if across.norm() > largest.norm() {
                largest = across;
            }
        }
    }
    largest.try_normalize(1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn distances_are_the_least_over_many_points() {
        const POINTS: usize = 400;
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for _ in 0..60 {
            let mut point = || Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
            let a = Segment { from_m: point(), to_m: point() };
            let b = Segment { from_m: point(), to_m: point() };
            let disc = Disc { centre_m: point(), normal: point().normalize(), radius_m: 0.4 };
            let shares = || (0..=POINTS).map(|i| i as f64 / POINTS as f64);
            let least =
                |other: Core| shares().map(|share| Core::Point(a.at(share)).distance_m(&other)).fold(f64::INFINITY, f64::min);
            for other in [Core::Segment(b), Core::Disc(disc)] {
                let (found, least) = (Core::Segment(a).distance_m(&other), least(other));
                assert!((found - least).abs() < 5e-3 && found <= least + 1e-12, "{found} {least}");
                assert!((found - other.distance_m(&Core::Segment(a))).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn discs_are_as_far_apart_as_their_nearest_points() {
        const POINTS: usize = 2000;
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for _ in 0..40 {
            let mut point = || Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
            let a = Disc { centre_m: point(), normal: point().normalize(), radius_m: 0.4 };
            let b = Disc { centre_m: point(), normal: point().normalize(), radius_m: 0.3 };
            let found = Core::Disc(a).distance_m(&Core::Disc(b));
            let any = |disc: &Disc, rng: &mut ChaCha8Rng| {
                let towards = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
                disc.nearest_to_point(&(disc.centre_m + towards))
            };
            let least = (0..POINTS)
                .map(|_| b.nearest_to_point(&any(&a, &mut rng)))
                .map(|point| Core::Disc(a).distance_m(&Core::Point(point)));
            let least = least.fold(f64::INFINITY, f64::min);
            assert!(found <= least + 2e-6 && found > least - 0.02, "{found} {least}");
        }
    }

    #[test]
    fn a_line_through_a_disc_or_along_it_has_its_distance() {
        let disc = Core::Disc(Disc { centre_m: Vector3::new(0.1, 0.0, 0.0), normal: Vector3::z(), radius_m: 0.4 });
        let distance = |from: [f64; 3], to: [f64; 3]| {
            disc.distance_m(&Core::Segment(Segment { from_m: Vector3::from(from), to_m: Vector3::from(to) }))
        };
        assert!(distance([0.3, 0.1, -1.0], [0.2, 0.0, 2.0]) < 1e-9);
        assert!((distance([-2.0, 0.0, 0.3], [2.0, 0.0, 0.3]) - 0.3).abs() < 1e-12);
        assert!((distance([0.1, 0.5, -1.0], [0.1, 0.5, 1.0]) - 0.1).abs() < 1e-9);
        assert!((distance([0.1, 0.0, 0.2], [0.1, 0.0, 0.2]) - 0.2).abs() < 1e-12);
        // In the disc's plane, towards its rim and through its axis.
        assert!((distance([1.0, 0.0, 0.0], [0.7, 0.0, 0.0]) - 0.2).abs() < 1e-12);
        assert!(distance([1.0, 0.0, 0.0], [0.1, 0.0, 0.0]) < 1e-9);
    }

    #[test]
    fn segments_without_length_are_points() {
        let point = Core::Segment(Segment { from_m: Vector3::x(), to_m: Vector3::x() });
        let line = Core::Segment(Segment { from_m: Vector3::zeros(), to_m: Vector3::y() });
        assert_eq!(point.distance_m(&line), 1.0);
        assert_eq!(line.distance_m(&point), 1.0);
        assert_eq!(point.distance_m(&point), 0.0);
    }
}
