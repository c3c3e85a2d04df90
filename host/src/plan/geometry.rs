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
        height_m.hypot(beyond_m)
    }

    /// Distance to a segment, to a micrometre. The distance of a convex body is a convex function along a line, so that its least
    /// value is found by golden section.
    pub fn distance_to_segment(&self, segment: &Segment) -> f64 {
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        const STEPS: usize = 30;
        let distance = |share: f64| self.distance_to_point(&segment.at(share));
        let (mut low, mut high) = (0.0, 1.0);
        let (mut inner_low, mut inner_high) = (1.0 - GOLDEN, GOLDEN);
        let (mut at_low, mut at_high) = (distance(inner_low), distance(inner_high));
        for _ in 0..STEPS {
            if at_low < at_high {
                (high, inner_high, at_high) = (inner_high, inner_low, at_low);
                inner_low = high - GOLDEN * (high - low);
                at_low = distance(inner_low);
            } else {
                (low, inner_low, at_low) = (inner_low, inner_high, at_high);
                inner_high = low + GOLDEN * (high - low);
                at_high = distance(inner_high);
            }
        }
        at_low.min(at_high).min(distance(0.0)).min(distance(1.0))
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
            assert!((disc.distance_to_segment(&a) - to_disc).abs() < 5e-3 && disc.distance_to_segment(&a) <= to_disc + 2e-6);
            assert!((a.distance_to_segment(&b) - b.distance_to_segment(&a)).abs() < 1e-12);
        }
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
