//! LuGre friction: bristles that bend before they slip.
//!
//! ż = v − σ0 |v| z / g(v), g = Fc + (Fs − Fc) exp(−(v/vs)²), F = σ0 z + σ1 ż + σ2 v (Canudas de Wit et al. 1995).
//! Explicit steps are unstable, so the bristle equation is solved in closed form over a step of constant speed.

/// Parameters, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LuGre {
    /// σ0, bristle stiffness, N/m.
    pub stiffness: f64,
    /// σ1, bristle damping, N·s/m.
    pub damping: f64,
    /// σ2, viscous friction, N·s/m.
    pub viscous: f64,
    /// Fc, Coulomb friction, N.
    pub coulomb: f64,
    /// Fs, breakaway, N.
    pub breakaway: f64,
    /// vs, Stribeck speed, m/s.
    pub stribeck: f64,
}

impl LuGre {
    /// Friction force at speed `v` (m/s) over `dt` seconds; moves the bristles `z` (m).
    pub fn force(&self, z: &mut f64, v: f64, dt: f64) -> f64 {
        let ratio = v / self.stribeck;
        // Beyond six Stribeck speeds the second term is below 10⁻¹⁵ of itself.
        let stribeck = if ratio.abs() > 6.0 { 0.0 } else { libm::exp(-ratio * ratio) };
        let g = self.coulomb + (self.breakaway - self.coulomb) * stribeck;
        let before = *z;
        if v != 0.0 {
            let settled = g * v.signum() / self.stiffness;
            *z = settled + (before - settled) * libm::exp(-self.stiffness * v.abs() * dt / g);
        }
        self.stiffness * *z + self.damping * (*z - before) / dt + self.viscous * v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reference() -> LuGre {
        LuGre {
            stiffness: 1e5,
            damping: 1e5f64.sqrt(),
            viscous: 0.4,
            coulomb: 1.0,
            breakaway: 1.5,
            stribeck: 1e-3,
        }
    }

    /// A body of 1 kg under a force given in time; its place at the times asked.
    fn simulate(force: impl Fn(f64, f64) -> f64, end: f64, mut seen: impl FnMut(f64, f64, f64)) {
        let (friction, dt) = (reference(), 2e-5);
        let (mut z, mut x, mut v) = (0.0, 0.0, 0.0);
        for step in 0..(end / dt) as u64 {
            let t = step as f64 * dt;
            let f = friction.force(&mut z, v, dt);
            v += (force(t, x) - f) * dt;
            x += v * dt;
            seen(t + dt, x, v);
        }
    }

    #[test]
    fn presliding_hysteresis_follows_the_reference_solution() {
        // Corners of the force in time; the reference was solved at a relative tolerance of 1e-9.
        let corners =
            [(0.0, 0.0), (10.0, 1.425), (15.0, 1.425), (35.0, -1.425), (40.0, -1.425), (60.0, 1.425)];
        let force = |t: f64, _| {
            let pair = corners.windows(2).find(|pair| t <= pair[1].0).unwrap_or(&corners[4..]);
            let share = (t - pair[0].0) / (pair[1].0 - pair[0].0);
            pair[0].1 + share * (pair[1].1 - pair[0].1)
        };
        let expected = [(10.0, 44.858), (15.0, 45.312), (35.0, -9.5635), (40.0, -10.0174)];
        let mut worst = 0.0f64;
        simulate(force, 40.001, |t, x, _| {
            if let Some((_, um)) = expected.iter().find(|(at, _)| (t - at).abs() < 1e-5) {
                worst = worst.max((x * 1e6 - um).abs() / 45.0);
            }
        });
        assert!(worst > 0.0 && worst < 0.005, "{worst}");
    }

    #[test]
    fn stick_and_slip_start_at_the_reference_times() {
        let mut slips = Vec::new();
        let (mut fastest, mut slipping) = (0.0f64, false);
        simulate(
            |t, x| 2.0 * (0.1 * t - x),
            28.0,
            |t, _, v| {
                fastest = fastest.max(v);
                if v > 0.05 && !slipping {
                    slips.push(t);
                    slipping = true;
                }
                slipping &= v > 0.01;
            },
        );
        assert_eq!(slips.len(), 4, "{slips:?}");
        for (slip, expected) in slips.iter().zip([7.45, 13.82, 20.18, 26.54]) {
            assert!((slip - expected).abs() < 0.3, "{slip} {expected}");
        }
        assert!((fastest / 0.36982 - 1.0).abs() < 0.005, "{fastest}");
    }
}
