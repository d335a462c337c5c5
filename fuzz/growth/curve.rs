//! A curve: the work of a function at growing sizes of one input, beside what its header states.

/// How much more than stated the work may grow from a size to the next, which is at least four times as large. A quadratic part of
/// linear work is then seen if it does a third of the work.
pub const SLACK: f64 = 1.3;

/// Instructions or bytes at a size.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub size: f64,
    /// The stated function there.
    pub stated: f64,
    pub measured: f64,
}

/// The places of one function and one input.
#[derive(Debug)]
pub struct Curve {
    pub function: String,
    pub input: String,
    /// Whether most of the work may be another input's.
    pub is_bound: bool,
    pub places: Vec<Place>,
}

impl Curve {
    /// The exponents of the size with which work and statement grow between the two largest sizes.
    pub fn exponents(&self) -> (f64, f64) {
        let [.., before, last] = &self.places[..] else { return (f64::NAN, f64::NAN) };
        let exponent = |grown: f64| grown.ln() / (last.size / before.size).ln();
        (exponent(last.measured / before.measured), exponent(last.stated / before.stated))
    }

    /// The growth of the work over that of the statement, at the step where it is largest.
    pub fn excess(&self) -> f64 {
        let steps = self.places.windows(2);
        steps.map(|pair| pair[1].measured / pair[0].measured / (pair[1].stated / pair[0].stated)).fold(0.0, f64::max)
    }

    /// What is wrong.
    pub fn fault(&self) -> Option<String> {
        let name = format!("{} by {}", self.function, self.input);
        let [first, .., last] = &self.places[..] else { return Some(format!("{name}: fewer than two sizes")) };
        let (stated, measured) = (last.stated / first.stated, last.measured / first.measured);
        if self.places.iter().any(|place| place.measured < 1.0) {
            Some(format!("{name}: nothing is counted: {:?}", self.places))
        } else if self.excess() > SLACK {
            Some(format!("{name}: grows {:.2} times as much as stated at a step: {:?}", self.excess(), self.places))
        } else if !self.is_bound && stated >= 4.0 && measured < 2.0 {
            Some(format!("{name}: does not grow, {:?}: the input is no work", self.places))
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(stated: impl Fn(f64) -> f64, measured: impl Fn(f64) -> f64) -> Curve {
        let place = |size: f64| Place { size, stated: stated(size), measured: measured(size) };
        Curve {
            function: "f".into(),
            input: "n".into(),
            is_bound: false,
            places: [16.0, 64.0, 256.0, 1024.0].map(place).to_vec(),
        }
    }

    #[test]
    fn what_is_stated_passes() {
        assert_eq!(curve(|n| n, |n| 500.0 + 10.0 * n).fault(), None);
        assert_eq!(curve(|n| n * n, |n| 3.0 * n * n + 100.0 * n).fault(), None);
        assert_eq!(curve(|_| 1.0, |n| 1000.0 + n / 10.0).fault(), None);
    }

    /// The smallest faults that are seen.
    #[test]
    fn more_than_stated_fails() {
        let quadratic = |share: f64| move |n: f64| (1.0 - share) * n / 1024.0 + share * (n / 1024.0).powi(2);
        assert!(curve(|n| n, quadratic(0.33)).fault().is_some());
        assert!(curve(|n| n, |n| n * n.log2().powi(2)).fault().is_some());
        assert!(curve(|_| 1.0, |n| 1000.0 + n).fault().is_some());
        assert!(curve(|n| n, |n| 1e6 + n).fault().is_some(), "an input that makes no work");
    }
}
