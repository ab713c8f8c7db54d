//! A motor that follows its ramps exactly: positions in increments, velocities in increments per second.

/// The motor at one moment.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Motor {
    pub(crate) position: f64,
    pub(crate) velocity: f64,
}

/// The limits of a motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ramp {
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
    pub(crate) deceleration: f64,
}

impl Motor {
    /// Moves for `seconds` towards a velocity.
    pub(crate) fn turn(&mut self, target: f64, ramp: Ramp, seconds: f64) {
        let is_slower = target.abs() < self.velocity.abs() || target * self.velocity < 0.0;
        let step = if is_slower { ramp.deceleration } else { ramp.acceleration } * seconds;
        self.velocity += (target - self.velocity).clamp(-step, step);
        self.position += self.velocity * seconds;
    }

    /// Moves for `seconds` towards a position. Returns whether the motor is there.
    pub(crate) fn approach(&mut self, target: f64, ramp: Ramp, seconds: f64) -> bool {
        let way = target - self.position;
        // The velocity from which the motor can stop at the target.
        let most = (2.0 * ramp.deceleration * way.abs()).sqrt().min(ramp.velocity);
        self.turn(most.copysign(way), ramp, seconds);
        let is_there = (target - self.position).abs() <= (self.velocity * seconds).abs().max(1.0);
        if is_there && self.velocity.abs() <= 2.0 * ramp.deceleration * seconds {
            (self.position, self.velocity) = (target, 0.0);
        }
        self.position.to_bits() == target.to_bits()
    }
}
