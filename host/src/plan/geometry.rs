//! Distances between the simple solids that stand for robot, bar and fixtures; metres.

use ballbar::Vector3;

/// A line from one point to another; with a radius, a capsule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// One end.
    pub from_m: Vector3<f64>,
    /// The other end.
    pub to_m: Vector3<f64>,
}

/// A round plate without thickness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Its middle.
    pub centre_m: Vector3<f64>,
    /// Unit vector across it.
    pub normal: Vector3<f64>,
    /// From the middle to the rim.
    pub radius_m: f64,
}

impl Segment {
    /// The point at a share of the way.
    pub fn at(&self, share: f64) -> Vector3<f64> {
        self.from_m + (self.to_m - self.from_m) * share
    }

    /// Distance to a point.
    pub fn distance_to_point(&self, point_m: &Vector3<f64>) -> f64 {
        let along_m = self.to_m - self.from_m;
        let square = along_m.norm_squared();
        let share = if square > 0.0 { ((point_m - self.from_m).dot(&along_m) / square).clamp(0.0, 1.0) } else { 0.0 };
        (self.at(share) - point_m).norm()
    }

    /// Distance to another segment (C. Ericson, "Real-Time Collision Detection", Morgan Kaufmann 2005, 5.1.9).
    pub fn distance_to_segment(&self, other: &Self) -> f64 {
        let (d1, d2) = (self.to_m - self.from_m, other.to_m - other.from_m);
        let between = self.from_m - other.from_m;
        let (a, e, f) = (d1.norm_squared(), d2.norm_squared(), d2.dot(&between));
        if a <= 0.0 {
            return other.distance_to_point(&self.from_m);
        }
        if e <= 0.0 {
            return self.distance_to_point(&other.from_m);
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
        (self.at(s) - other.at(t)).norm()
    }
}

impl Disc {
    /// Distance to a point.
    pub fn distance_to_point(&self, point_m: &Vector3<f64>) -> f64 {
        let off_m = point_m - self.centre_m;
        let height_m = off_m.dot(&self.normal);
        let beyond_m = ((off_m - self.normal * height_m).norm() - self.radius_m).max(0.0);
        (height_m * height_m + beyond_m * beyond_m).sqrt()
    }

    /// No more than the distance to a segment, and quicker: the distance of a ball about the disc.
    pub fn least_distance_to_segment(&self, segment: &Segment) -> f64 {
        segment.distance_to_point(&self.centre_m) - self.radius_m
    }

    /// Distance to a segment, to rounding.
    ///
    /// With `h` the height above the disc's plane and `r` the distance from its axis, the square is `h² + max(0, r − R)²`: convex along
    /// the segment, with a continuous slope, whose zero Newton's method finds in a few steps, kept between the ends it is known to
    /// lie between.
    pub fn distance_to_segment(&self, segment: &Segment) -> f64 {
        const STEPS: usize = 40;
        const TOLERANCE: f64 = 1e-10;
        let (from_m, along_m) = (segment.from_m - self.centre_m, segment.to_m - segment.from_m);
        let (from_height_m, climb_m) = (from_m.dot(&self.normal), along_m.dot(&self.normal));
        let (from_flat_m, flat_m) = (from_m - self.normal * from_height_m, along_m - self.normal * climb_m);
        let flat_square = flat_m.norm_squared();
        // At a share of the way: the distance's square, and half of its first and second derivatives.
        let at = |share: f64| {
            let (height_m, flat_from_axis_m) = (from_height_m + climb_m * share, from_flat_m + flat_m * share);
            let from_axis_m = flat_from_axis_m.norm();
            let beyond_m = from_axis_m - self.radius_m;
            let (square, slope, curvature) = (height_m * height_m, height_m * climb_m, climb_m * climb_m);
            if beyond_m <= 0.0 {
                return (square, slope, curvature);
            }
            let outward_m = flat_from_axis_m.dot(&flat_m) / from_axis_m;
            let turning = (flat_square - outward_m * outward_m).max(0.0) * beyond_m / from_axis_m;
            (square + beyond_m * beyond_m, slope + beyond_m * outward_m, curvature + outward_m * outward_m + turning)
        };
        let (mut low, mut high) = (0.0, 1.0);
        let (start, end) = (at(low), at(high));
        if start.1 >= 0.0 {
            return start.0.sqrt();
        }
        if end.1 <= 0.0 {
            return end.0.sqrt();
        }
        let mut share = start.1 / (start.1 - end.1);
        let mut here = at(share);
        for _ in 0..STEPS {
            if here.1 == 0.0 || high - low < TOLERANCE {
                break;
            }
            if here.1 < 0.0 {
                low = share;
            } else {
                high = share;
            }
            let newton = share - here.1 / here.2;
            let next = if newton > low && newton < high { newton } else { (low + high) / 2.0 };
            let step = (next - share).abs();
            share = next;
            here = at(share);
            if step < TOLERANCE {
                break;
            }
        }
        here.0.sqrt()
    }

    /// The lowest z of the rim.
    pub fn lowest_z_m(&self) -> f64 {
        self.centre_m.z - self.radius_m * (1.0 - self.normal.z * self.normal.z).max(0.0).sqrt()
    }
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
            let to_b = shares().map(|share| b.distance_to_point(&a.at(share))).fold(f64::INFINITY, f64::min);
            let to_disc = shares().map(|share| disc.distance_to_point(&a.at(share))).fold(f64::INFINITY, f64::min);
            assert!((a.distance_to_segment(&b) - to_b).abs() < 5e-3 && a.distance_to_segment(&b) <= to_b + 1e-12);
            assert!((disc.distance_to_segment(&a) - to_disc).abs() < 5e-3 && disc.distance_to_segment(&a) <= to_disc + 1e-12);
            assert!(disc.least_distance_to_segment(&a) <= disc.distance_to_segment(&a));
            assert!((a.distance_to_segment(&b) - b.distance_to_segment(&a)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_line_through_a_disc_or_along_it_has_its_distance() {
        let disc = Disc { centre_m: Vector3::new(0.1, 0.0, 0.0), normal: Vector3::z(), radius_m: 0.4 };
        let distance = |from: [f64; 3], to: [f64; 3]| {
            disc.distance_to_segment(&Segment { from_m: Vector3::from(from), to_m: Vector3::from(to) })
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
        let point = Segment { from_m: Vector3::x(), to_m: Vector3::x() };
        let line = Segment { from_m: Vector3::zeros(), to_m: Vector3::y() };
        assert_eq!(point.distance_to_segment(&line), 1.0);
        assert_eq!(line.distance_to_segment(&point), 1.0);
        assert_eq!(point.distance_to_segment(&point), 0.0);
    }
}
