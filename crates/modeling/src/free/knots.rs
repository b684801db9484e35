//! A knot vector, and the blossom that everything is computed with.

/// Highest degree that is read.
pub const MOST_DEGREE: usize = 25;

/// Why there is no such spline.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FreeError {
    /// Degree 0 or too high.
    #[error("degree {0}: splines of degree 1 to {MOST_DEGREE} are known")]
    Degree(usize),
    /// The numbers of knots, points and weights do not belong together.
    #[error("{what}: {got} where degree and control points want {want}")]
    Count {
        /// Which list.
        what: &'static str,
        /// Its length.
        got: usize,
        /// What it should be.
        want: usize,
    },
    /// A number that is NaN or infinite.
    #[error("{what} {index} is {value}, which is not a finite number")]
    NotFinite {
        /// Which list.
        what: &'static str,
        /// Index in it.
        index: usize,
        /// The number.
        value: f64,
    },
    /// Knots that go back.
    #[error("knot {index} is {value}, less than the one before it")]
    Decreasing {
        /// Index of the knot.
        index: usize,
        /// The knot.
        value: f64,
    },
    /// More equal knots than a spline can have.
    #[error("knot {value} is repeated {times} times, more than degree + 1")]
    Multiplicity {
        /// The knot.
        value: f64,
        /// How often it appears.
        times: usize,
    },
    /// First and last parameter are the same.
    #[error("the knots leave no domain: it begins and ends at {0}")]
    Empty(f64),
    /// A weight that is not positive.
    #[error("weight {index} is {value}: weights must be positive")]
    Weight {
        /// Index of the weight.
        index: usize,
        /// The weight.
        value: f64,
    },
    /// Not 2 or 3 coordinates.
    #[error("control points of {0} coordinates: a spline in space has 2 or 3")]
    Dimension(usize),
}

/// Degree and knots of one direction, valid.
#[derive(Clone, Debug, PartialEq)]
pub struct Knots {
    degree: usize,
    knots: Vec<f64>,
}

/// Numbers in a homogeneous point.
pub(super) type H = [f64; 4];

impl Knots {
    /// The knot vector of a spline with `points` control points: `points + degree + 1` knots that do not decrease.
    ///
    /// ```
    /// use ondelette_modeling::free::Knots;
    /// let knots = Knots::new(2, vec![0.0, 0.0, 0.0, 1.0, 3.0, 3.0, 3.0], 4)?;
    /// assert_eq!((knots.domain(), knots.breaks()), ([0.0, 3.0], vec![0.0, 1.0, 3.0]));
    /// # Ok::<(), ondelette_modeling::free::FreeError>(())
    /// ```
    ///
    /// # Errors
    /// [`FreeError`].
    pub fn new(degree: usize, knots: Vec<f64>, points: usize) -> Result<Knots, FreeError> {
        if !(1..=MOST_DEGREE).contains(&degree) {
            return Err(FreeError::Degree(degree));
        }
        if points <= degree {
            return Err(FreeError::Count { what: "control points", got: points, want: degree + 1 });
        }
        if knots.len() != points.saturating_add(degree + 1) {
            return Err(FreeError::Count { what: "knots", got: knots.len(), want: points.saturating_add(degree + 1) });
        }
        if let Some(index) = knots.iter().position(|k| !k.is_finite()) {
            return Err(FreeError::NotFinite { what: "knot", index, value: knots[index] });
        }
        if let Some(i) = knots.windows(2).position(|w| w[1] < w[0]) {
            return Err(FreeError::Decreasing { index: i + 1, value: knots[i + 1] });
        }
        let mut run = 1;
        for w in knots.windows(2) {
            run = if w[0] == w[1] { run + 1 } else { 1 };
            if run > degree + 1 {
                return Err(FreeError::Multiplicity { value: w[1], times: run });
            }
        }
        let out = Knots { degree, knots };
        let [a, b] = out.domain();
        if a < b && (b - a).is_finite() { Ok(out) } else { Err(FreeError::Empty(a)) }
    }

    /// Knots of Bezier pieces that meet at `breaks`: inner knots `degree` fold, end knots one more.
    ///
    /// # Errors
    /// [`FreeError`]: fewer than two breaks, or breaks that do not increase.
    pub fn bezier(degree: usize, breaks: &[f64]) -> Result<Knots, FreeError> {
        let mut knots: Vec<f64> = breaks.iter().flat_map(|&b| std::iter::repeat_n(b, degree)).collect();
        if let (Some(&a), Some(&b)) = (breaks.first(), breaks.last()) {
            knots.insert(0, a);
            knots.push(b);
        }
        Knots::new(degree, knots, (breaks.len().max(1) - 1) * degree + 1)
    }

    /// Degree.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// The knots, repeated as often as they count.
    pub fn values(&self) -> &[f64] {
        &self.knots
    }

    /// Number of control points.
    pub fn points(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// First and last parameter.
    pub fn domain(&self) -> [f64; 2] {
        [self.knots[self.degree], self.knots[self.points()]]
    }

    /// Different knots inside the domain, its ends included.
    pub fn breaks(&self) -> Vec<f64> {
        let mut out = self.knots[self.degree..=self.points()].to_vec();
        out.dedup();
        out
    }

    /// The last knot of each non-empty span inside the domain: what other methods call a span.
    pub fn spans(&self) -> Vec<usize> {
        (self.degree..self.points()).filter(|&i| self.knots[i] < self.knots[i + 1]).collect()
    }

    /// The span that holds `t`, the right one at a knot; the first or the last outside the domain.
    pub fn span(&self, t: f64) -> usize {
        let inner = &self.knots[self.degree..=self.points()];
        let mut i = self.degree + inner.partition_point(|&k| k <= t).clamp(1, inner.len() - 1) - 1;
        while self.knots[i] == self.knots[i + 1] && i > self.degree {
            i -= 1;
        }
        while self.knots[i] == self.knots[i + 1] {
            i += 1;
        }
        i
    }

    /// First and last parameter of a span.
    pub(super) fn ends(&self, span: usize) -> [f64; 2] {
        [self.knots[span], self.knots[span + 1]]
    }

    /// de Boor's algorithm on a span, a step per argument: a number mixes, `None` differentiates. What remains is a
    /// value of the blossom, divided by the falling factorial for derivatives.
    fn steps(&self, span: usize, d: &mut [H], argument: impl Fn(usize) -> Option<f64>) -> H {
        let p = self.degree;
        for r in 1..=p {
            let x = argument(r - 1);
            for j in (r..=p).rev() {
                let (a, b) = (self.knots[j + span - p], self.knots[j + 1 + span - r]);
                let (low, high) = (d[j - 1], d[j]);
                d[j] = match x {
                    Some(x) => {
                        let w = (x - a) / (b - a);
                        std::array::from_fn(|c| (1.0 - w) * low[c] + w * high[c])
                    }
                    None => std::array::from_fn(|c| (high[c] - low[c]) / (b - a)),
                };
            }
        }
        d[p]
    }

    /// The derivative of the given order of the piece on `span`, at `t`.
    pub(super) fn derivative(&self, span: usize, t: f64, order: usize, control: impl Fn(usize) -> H) -> H {
        if order > self.degree {
            return [0.0; 4];
        }
        let mut d = self.alive(span, control);
        let factor = (0..order).fold(1.0, |f, k| f * (self.degree - k) as f64);
        self.steps(span, &mut d, |r| (r >= order).then_some(t)).map(|x| x * factor)
    }

    /// The blossom of the piece on `span` at `degree` arguments.
    pub(super) fn blossom(&self, span: usize, arguments: &[f64], control: impl Fn(usize) -> H) -> H {
        let mut d = self.alive(span, control);
        self.steps(span, &mut d, |r| Some(arguments[r]))
    }

    fn alive(&self, span: usize, control: impl Fn(usize) -> H) -> [H; MOST_DEGREE + 1] {
        let mut d = [[0.0; 4]; MOST_DEGREE + 1];
        for (j, slot) in d.iter_mut().enumerate().take(self.degree + 1) {
            *slot = control(span - self.degree + j);
        }
        d
    }

    /// The blossom of the piece as a cubic, for degree 3 and below.
    pub(super) fn cubic_blossom(&self, span: usize, u: [f64; 3], control: impl Fn(usize) -> H) -> H {
        let [a, b, c] = u;
        let mean = |parts: [&[f64]; 3]| {
            let values = parts.map(|p| self.blossom(span, p, &control));
            std::array::from_fn(|k| values.iter().map(|v| v[k]).sum::<f64>() / 3.0)
        };
        match self.degree {
            1 => mean([&[a], &[b], &[c]]),
            2 => mean([&[a, b], &[b, c], &[a, c]]),
            _ => self.blossom(span, &u, control),
        }
    }

    /// Control points of the same spline on knots that include these.
    pub(super) fn refine(&self, finer: &Knots, control: impl Fn(usize) -> H) -> Vec<H> {
        let p = self.degree;
        (0..finer.points())
            .map(|j| {
                let support = &finer.knots[j..=j + p + 1];
                let piece = (0..=p).find(|&m| support[m] < support[m + 1]).unwrap_or(0);
                let middle = 0.5 * (support[piece] + support[piece + 1]);
                self.blossom(self.span(middle), &finer.knots[j + 1..=j + p], &control)
            })
            .collect()
    }

    /// These knots with one more.
    pub(super) fn with(&self, t: f64) -> Result<Knots, FreeError> {
        if !t.is_finite() {
            return Err(FreeError::NotFinite { what: "knot", index: 0, value: t });
        }
        let mut knots = self.knots.clone();
        let at = knots.partition_point(|&k| k <= t);
        knots.insert(at, t);
        Knots::new(self.degree, knots, self.points() + 1)
    }

    /// The knots of another length and place: parameters become `at + by * t`.
    ///
    /// # Errors
    /// The new knots are no knots (`by` not positive, or too small for their distances).
    pub fn moved(&self, at: f64, by: f64) -> Result<Knots, FreeError> {
        let knots = self.knots.iter().map(|k| at + by * k).collect();
        Knots::new(self.degree, knots, self.points())
    }
}
