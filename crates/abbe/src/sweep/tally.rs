//! Many numbers in four.

/// Mean, root mean square and extent of numbers that were not kept.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Tally {
    count: u64,
    sum: f64,
    squares: f64,
    most: f64,
}

impl Tally {
    pub(crate) fn add(&mut self, value: f64) {
        self.count += 1;
        self.sum += value;
        self.squares += value * value;
        self.most = self.most.max(value.abs());
    }

    /// What there is to say of numbers, if there were any.
    pub(crate) fn figures(&self) -> Option<Figures> {
        if self.count == 0 {
            return None;
        }
        let count = self.count as f64;
        let mean = self.sum / count;
        let square = self.squares / count;
        let scatter = (square - mean * mean).max(0.0).sqrt();
        Some(Figures { mean, rms: square.sqrt(), scatter, most: self.most })
    }
}

/// What is told of many numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Figures {
    pub(crate) mean: f64,
    /// About zero.
    pub(crate) rms: f64,
    /// About the mean.
    pub(crate) scatter: f64,
    /// The farthest from zero, without its sign.
    pub(crate) most: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_those_of_the_numbers() {
        assert_eq!(Tally::default().figures(), None);
        let mut tally = Tally::default();
        for value in [1.0, -7.0, 1.0, -7.0] {
            tally.add(value);
        }
        assert_eq!(tally.figures(), Some(Figures { mean: -3.0, rms: 5.0, scatter: 4.0, most: 7.0 }));
    }
}
