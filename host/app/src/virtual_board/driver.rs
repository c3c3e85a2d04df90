//! Driving a plant that a thread owns: orders go in, where the robot is comes out.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};

use ballbar::JointVector;

use super::plant::Plant;
use super::script::{AttachedBar, Script, Station};
use crate::robot_link::JointSpeed;

/// What a plant's robot, or the hand that attaches the bar, is to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Go there, and count as busy for some time after.
    Move {
        /// Encoder outputs, radians or metres.
        q: JointVector<f64>,
        /// The highest speed of the joints.
        speed: JointSpeed,
        /// How long the robot counts as busy after it has arrived, seconds: at [`super::Pace::Free`] time runs fast for so long.
        dwell_s: f64,
        /// What the bar measures too much there, metres.
        length_error_m: f64,
    },
    /// Attach another bar where the robot stands.
    Attach {
        /// The bar.
        bar: AttachedBar,
        /// What it measures too much there, metres.
        length_error_m: f64,
    },
    /// The bar comes off, at once.
    Detach,
    /// Stop on the way.
    Halt,
}

/// How a driven robot stands.
#[derive(Clone, Copy, Debug)]
pub struct Stance {
    /// Whether it has orders that it has not carried out.
    pub is_moving: bool,
    /// Encoder outputs as the servos hold them, radians or metres.
    pub q: JointVector<f64>,
    /// The bar that is attached.
    pub bar: Option<AttachedBar>,
    /// Orders begun so far.
    orders: u64,
}

/// The end of whoever drives.
#[derive(Debug)]
pub struct Driver {
    orders: Sender<Order>,
    given: u64,
    stance: Arc<Mutex<Stance>>,
}

/// The end of the plant's thread.
#[derive(Debug)]
pub struct Driven {
    orders: Receiver<Order>,
    stance: Arc<Mutex<Stance>>,
}

/// Time that attaching a bar keeps the robot busy, seconds.
const ATTACHING_S: f64 = 0.1;

/// Both ends.
pub fn driver() -> (Driver, Driven) {
    let (sender, receiver) = channel();
    let start = Stance { is_moving: false, q: JointVector::zero(), bar: None, orders: 0 };
    let stance = Arc::new(Mutex::new(start));
    (Driver { orders: sender, given: 0, stance: Arc::clone(&stance) }, Driven { orders: receiver, stance })
}

impl Driver {
    /// Gives an order, which takes the place of those that wait; a move under way is finished first, unless it is halted.
    pub fn give(&mut self, order: Order) {
        self.given += 1;
        // Without the plant there is nothing to drive.
        let _ = self.orders.send(order);
    }

    /// Where the robot is.
    pub fn stance(&self) -> Stance {
        let stance = *self.stance.lock().unwrap_or_else(PoisonError::into_inner);
        Stance { is_moving: stance.is_moving || stance.orders < self.given, ..stance }
    }
}

impl Driven {
    /// Lets the plant begin what was ordered, and tells where its robot is. To be called often.
    pub fn attend(&self, plant: &mut Plant) {
        let mut begun = 0;
        while let Ok(order) = self.orders.try_recv() {
            begin(order, plant);
            begun += 1;
        }
        let (q, bar) = plant.stance();
        let mut stance = self.stance.lock().unwrap_or_else(PoisonError::into_inner);
        *stance = Stance { is_moving: plant.is_moving(), q, bar, orders: stance.orders + begun };
    }
}

fn begin(order: Order, plant: &mut Plant) {
    let (q, bar) = plant.stance();
    let (station, speed) = match order {
        Order::Move { q, speed, dwell_s, length_error_m } => (Station { q, bar, dwell_s, length_error_m }, speed),
        Order::Attach { bar, length_error_m } => {
            (Station { q, bar: Some(bar), dwell_s: ATTACHING_S, length_error_m }, JointSpeed::default())
        }
        Order::Detach => return plant.drop_bar(),
        Order::Halt => return plant.halt(),
    };
    plant.play(Script { stations: vec![station], speed });
}
