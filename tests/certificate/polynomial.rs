//! Polynomials with integer coefficients, their real roots, and the signs of others at these, without any rounding.

use num_bigint::{BigInt, Sign};
use num_integer::Integer;

/// Coefficients in ascending order, the last one not zero; none for zero.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Polynomial(Vec<BigInt>);

/// A root of a polynomial without multiple roots: the only one in (low, high], both over 2^bits.
#[derive(Clone, Debug)]
pub(crate) struct Root {
    of: Polynomial,
    low: BigInt,
    high: BigInt,
    bits: u32,
}

fn sign(number: &BigInt) -> i8 {
    match number.sign() {
        Sign::Minus => -1,
        Sign::NoSign => 0,
        Sign::Plus => 1,
    }
}

impl Polynomial {
    /// From coefficients in ascending order.
    pub(crate) fn new(mut coefficients: Vec<BigInt>) -> Self {
        while coefficients.last().is_some_and(|last| last.sign() == Sign::NoSign) {
            coefficients.pop();
        }
        Self(coefficients)
    }

    pub(crate) fn is_zero(&self) -> bool {
        self.0.is_empty()
    }

    fn degree(&self) -> usize {
        self.0.len().saturating_sub(1)
    }

    fn combined(&self, other: &Self, of_other: i8) -> Self {
        let length = self.0.len().max(other.0.len());
        let at = |of: &Self, k: usize| of.0.get(k).cloned().unwrap_or_default();
        Self::new((0..length).map(|k| at(self, k) + at(other, k) * of_other).collect())
    }

    pub(crate) fn plus(&self, other: &Self) -> Self {
        self.combined(other, 1)
    }

    pub(crate) fn minus(&self, other: &Self) -> Self {
        self.combined(other, -1)
    }

    pub(crate) fn times(&self, other: &Self) -> Self {
        if self.is_zero() || other.is_zero() {
            return Self(vec![]);
        }
        let mut product = vec![BigInt::default(); self.0.len() + other.0.len() - 1];
        for (i, a) in self.0.iter().enumerate() {
            for (j, b) in other.0.iter().enumerate() {
                product[i + j] += a * b;
            }
        }
        Self::new(product)
    }

    /// Its sign at `numerator` / 2^`bits`.
    pub(crate) fn sign_at(&self, numerator: &BigInt, bits: u32) -> i8 {
        let degree = self.degree();
        let value = self.0.iter().enumerate().rev().fold(BigInt::default(), |sum, (k, c)| {
            sum * numerator + (c << (bits as usize * (degree - k)))
        });
        sign(&value)
    }

    fn derivative(&self) -> Self {
        Self::new(self.0.iter().enumerate().skip(1).map(|(k, c)| c * k).collect())
    }

    /// Without the factor that its coefficients share.
    fn primitive(self) -> Self {
        let content = self.0.iter().fold(BigInt::default(), |gcd, c| gcd.gcd(c));
        if self.is_zero() { self } else { Self(self.0.iter().map(|c| c / &content).collect()) }
    }

    /// The remainder of a division of it, times a positive number.
    fn remainder(&self, divisor: &Self) -> Self {
        let lead = &divisor.0[divisor.degree()];
        let mut rest = self.clone();
        while !rest.is_zero() && rest.0.len() >= divisor.0.len() {
            let shift = rest.0.len() - divisor.0.len();
            let top = &rest.0[rest.degree()] * i32::from(sign(lead));
            let scale = BigInt::from(lead.magnitude().clone());
            let mut next: Vec<BigInt> = rest.0.iter().map(|c| c * &scale).collect();
            for (k, c) in divisor.0.iter().enumerate() {
                next[k + shift] -= &top * c;
            }
            rest = Self::new(next);
        }
        rest.primitive()
    }

    fn gcd(&self, other: &Self) -> Self {
        let (mut a, mut b) = (self.clone(), other.clone());
        while !b.is_zero() {
            let rest = a.remainder(&b);
            (a, b) = (b, rest);
        }
        a.primitive()
    }

    /// It over a divisor of it, times a number.
    fn quotient(&self, divisor: &Self) -> Self {
        let lead = &divisor.0[divisor.degree()];
        let mut rest = self.clone();
        let mut quotient = vec![BigInt::default(); self.0.len() - divisor.0.len() + 1];
        while !rest.is_zero() {
            let shift = rest.0.len() - divisor.0.len();
            let top = rest.0[rest.degree()].clone();
            let mut next: Vec<BigInt> = rest.0.iter().map(|c| c * lead).collect();
            for (k, c) in divisor.0.iter().enumerate() {
                next[k + shift] -= &top * c;
            }
            quotient.iter_mut().for_each(|c| *c *= lead);
            quotient[shift] += top;
            rest = Self::new(next);
        }
        Self::new(quotient).primitive()
    }

    /// The polynomial with the same roots, each of them once.
    fn square_free(&self) -> Self {
        self.quotient(&self.gcd(&self.derivative()))
    }

    /// Sturm's sequence.
    fn chain(&self) -> Vec<Self> {
        let mut chain = vec![self.clone(), self.derivative()];
        while !chain[chain.len() - 1].is_zero() {
            let rest = chain[chain.len() - 2].remainder(&chain[chain.len() - 1]);
            chain.push(Self(vec![]).minus(&rest));
        }
        chain.pop();
        chain
    }

    /// Its roots in (0, 1\], not for zero.
    pub(crate) fn roots(&self) -> Vec<Root> {
        if self.degree() == 0 {
            return vec![];
        }
        let of = self.square_free();
        let chain = of.chain();
        let mut roots = vec![];
        let mut open = vec![(BigInt::from(0), BigInt::from(1), 0)];
        while let Some((low, high, bits)) = open.pop() {
            match count(&chain, &low, &high, bits) {
                0 => {}
                1 => roots.push(Root { of: of.clone(), low, high, bits }),
                _ => {
                    let middle: BigInt = &low + &high;
                    open.push((low * 2, middle.clone(), bits + 1));
                    open.push((middle, high * 2, bits + 1));
                }
            }
        }
        roots
    }
}

fn variations(chain: &[Polynomial], numerator: &BigInt, bits: u32) -> usize {
    let signs: Vec<i8> =
        chain.iter().map(|p| p.sign_at(numerator, bits)).filter(|sign| *sign != 0).collect();
    signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
}

/// Number of roots in (low, high] of the polynomial of this chain.
fn count(chain: &[Polynomial], low: &BigInt, high: &BigInt, bits: u32) -> usize {
    variations(chain, low, bits) - variations(chain, high, bits)
}

impl Root {
    /// The sign of a polynomial there.
    pub(crate) fn sign(&mut self, polynomial: &Polynomial) -> i8 {
        if polynomial.is_zero() {
            return 0;
        }
        let common = self.of.gcd(polynomial);
        if common.degree() > 0 && count(&common.chain(), &self.low, &self.high, self.bits) > 0 {
            return 0;
        }
        if polynomial.degree() == 0 {
            return sign(&polynomial.0[0]);
        }
        let chain = polynomial.square_free().chain();
        while count(&chain, &self.low, &self.high, self.bits) > 0 {
            self.halve();
        }
        polynomial.sign_at(&self.high, self.bits)
    }

    fn halve(&mut self) {
        let middle: BigInt = &self.low + &self.high;
        self.bits += 1;
        let at_middle = self.of.sign_at(&middle, self.bits);
        let high: BigInt = &self.high * 2;
        let at_high = self.of.sign_at(&high, self.bits);
        // One root and no double one: it is where the sign changes, or where it is zero.
        let is_above = at_middle != 0 && (at_high == 0 || at_middle != at_high);
        (self.low, self.high) = if is_above { (middle, high) } else { (&self.low * 2, middle) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polynomial(coefficients: &[i64]) -> Polynomial {
        Polynomial::new(coefficients.iter().map(|c| BigInt::from(*c)).collect())
    }

    #[test]
    fn signs_at_roots_are_exact() {
        // (2 t - 1)^2 (3 t - 1): two roots; t = 1/3 and 1/2.
        let cubic = polynomial(&[-1, 2]).times(&polynomial(&[-1, 2])).times(&polynomial(&[-1, 3]));
        let mut roots = cubic.roots();
        assert_eq!(roots.len(), 2);
        let near_half = polynomial(&[-499_999_999, 1_000_000_000]);
        let third = polynomial(&[-1, 3]);
        let mut signs: Vec<_> =
            roots.iter_mut().map(|root| (root.sign(&near_half), root.sign(&third))).collect();
        signs.sort_unstable();
        assert_eq!(signs, [(-1, 0), (1, 1)]);
        // The root sqrt(1/2) against fractions on both sides of it.
        let mut root = polynomial(&[-1, 0, 2]).roots().remove(0);
        assert_eq!(root.sign(&polynomial(&[-707_106_781, 1_000_000_000])), 1);
        assert_eq!(root.sign(&polynomial(&[-707_106_782, 1_000_000_000])), -1);
        assert_eq!(root.sign(&polynomial(&[-1, 0, 4, 0, -2])), 1);
        assert_eq!(root.sign(&polynomial(&[-1, 0, 4, 0, -4])), 0);
        assert!(polynomial(&[0, 1]).roots().is_empty(), "0 is left out");
        assert_eq!(polynomial(&[-1, 1]).roots().len(), 1, "1 is not");
    }
}
