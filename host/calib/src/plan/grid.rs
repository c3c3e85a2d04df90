//! The points to measure at: crossings of latitudes and longitudes on the hemisphere about a chuck (the paper's Fig. 2).

use std::f64::consts::TAU;

use ballbar::Vector3;

/// Which circles cross.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Grid {
    /// Elevations of the bar above the table, radians, ascending.
    pub latitudes_rad: Vec<f64>,
    /// How many longitudes, evenly around from the base's x towards its y.
    pub longitudes: usize,
}

/// One point of the hemisphere.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Crossing {
    /// Elevation of the bar, radians.
    pub latitude_rad: f64,
    /// Azimuth of the bar, radians.
    pub longitude_rad: f64,
}

impl Grid {
    /// The latitudes given, in degrees, and as many longitudes as give `points` crossings or a few more.
    pub fn of(latitudes_deg: &[f64], points: usize) -> Self {
        Self {
            latitudes_rad: latitudes_deg.iter().copied().map(f64::to_radians).collect(),
            longitudes: points.div_ceil(latitudes_deg.len().max(1)).max(1),
        }
    }

    /// Crossings with longitudes between those of the grid: halfway, then at the quarters, then at the eighths.
    pub fn between(&self) -> Vec<Vec<Crossing>> {
        const DENSER: [usize; 3] = [2, 4, 8];
        let denser = |times: usize| {
            let finer = Self { latitudes_rad: self.latitudes_rad.clone(), longitudes: self.longitudes * times };
            let step_rad = TAU / finer.longitudes as f64;
            let is_new = |crossing: &Crossing| (crossing.longitude_rad / step_rad).round() as usize % 2 == 1;
            finer.crossings().into_iter().filter(is_new).collect()
        };
        DENSER.map(denser).to_vec()
    }

    /// The crossings, latitude by latitude, to and fro.
    pub fn crossings(&self) -> Vec<Crossing> {
        let mut crossings = Vec::with_capacity(self.latitudes_rad.len() * self.longitudes);
        for (line, &latitude_rad) in self.latitudes_rad.iter().enumerate() {
            // All longitudes meet at the pole.
            let is_pole = latitude_rad.cos() < 1e-9;
            let mut around: Vec<usize> = (0..if is_pole { 1 } else { self.longitudes }).collect();
            if line % 2 == 1 {
                around.reverse();
            }
            let longitude = |i: usize| TAU * i as f64 / self.longitudes as f64;
            crossings.extend(around.into_iter().map(|i| Crossing { latitude_rad, longitude_rad: longitude(i) }));
        }
        crossings
    }
}

impl Crossing {
    /// From chuck to sphere, base frame.
    pub fn along_bar(&self) -> Vector3<f64> {
        let ((sin_lat, cos_lat), (sin_lon, cos_lon)) = (self.latitude_rad.sin_cos(), self.longitude_rad.sin_cos());
        Vector3::new(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pole_is_one_point() {
        let grid = Grid::of(&[45.0, 90.0], 8);
        assert_eq!(grid.crossings().len(), 5);
        assert_eq!(grid.between().iter().map(Vec::len).collect::<Vec<_>>(), [4, 8, 16]);
    }

    #[test]
    fn crossings_are_distinct_and_as_many_as_asked_for() {
        let crossings = Grid::of(&[15.0, 30.0, 45.0, 60.0, 75.0], 90).crossings();
        assert_eq!(crossings.len(), 90);
        let grid = Grid::of(&[15.0, 30.0, 45.0, 60.0, 75.0], 90);
        assert_eq!(grid.between().iter().map(Vec::len).collect::<Vec<_>>(), [90, 180, 360]);
        let crossings: Vec<Crossing> = crossings.into_iter().chain(grid.between().into_iter().flatten()).collect();
        for (i, a) in crossings.iter().enumerate() {
            assert!((a.along_bar().norm() - 1.0).abs() < 1e-15 && a.along_bar().z > 0.2);
            assert!(crossings[..i].iter().all(|b| (a.along_bar() - b.along_bar()).norm() > 1e-3));
        }
    }
}
