//! Weights of the strategies that find the same path: the balance heuristic (Veach and Guibas 1995), carried along subpaths.
//!
//! A path x_0 (source) ... x_k, y_0 (sensor or eye) is cut between two neighbours: the photon brings the part before the cut, the eye path
//! the part behind it. With p(x) the density per area with which a subpath reaches a vertex, the density of one cut relative to its
//! neighbour's is the ratio of the two densities of the vertex between them, so the sum over all cuts on one side of a vertex follows from
//! that of the vertex before:
//!
//! others(x_i) = p'(x_i) / p(x_i) (cut(x_{i-1}, x_i) + others(x_{i-1})),
//!
//! with p' the density from the other side, and cut the number of samples of a strategy, 0 where it is impossible. The weights of all
//! strategies add up to 1 whatever the densities are, as long as all strategies use the same; so a photon's density on an opening is taken
//! as uniform, and Russian roulette is left out.
//!
//! The recursion is derived in docs/physics/measurement_equation.md#bidirectional-weights.

/// State of a subpath's strategies at a vertex.
#[derive(Clone, Copy, Debug)]
pub struct MisWeight {
    /// Density per m2 with which the subpath reached this vertex.
    pub density: f64,
    /// Number of samples of the strategy that cuts the edge to the vertex before.
    pub cut: f64,
    /// Sum of the strategies that cut farther back, over the density per sr with which the other side leaves this vertex for the one
    /// before.
    pub behind: f64,
}

impl MisWeight {
    /// Makes the state at the start of a subpath, or at a vertex before which no cut is possible.
    pub fn start(density: f64, cut: f64) -> Self {
        Self { density, cut, behind: 0.0 }
    }

    /// Returns the sum of the strategies with fewer vertices on this side relative to one that ends here: `density` per m2 with which the
    /// other side reaches this vertex, and `back` per sr with which it continues to the one before.
    pub fn others(&self, density: f64, back: f64) -> f64 {
        density / self.density * (self.cut + back * self.behind)
    }
}

/// Edge from one vertex of a subpath to the next, including reflections by mirrors.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Density per sr of the edge's direction.
    density: f64,
    /// Cosine of the angle between the edge and the normal where it starts.
    cosine: f64,
    /// Sum of the strategies that end before its start, over the start's density.
    back: f64,
    /// Number of samples of the strategy that cuts it.
    cut: f64,
    length: f64,
}

impl Edge {
    /// Makes the edge from a vertex into a direction of `density` per sr; `back` per sr as in [`MisWeight::others`].
    pub fn outgoing(weight: &MisWeight, density: f64, cosine: f64, back: f64, cut: f64) -> Self {
        Self { density, cosine, back: (weight.cut + back * weight.behind) / weight.density, cut, length: 0.0 }
    }

    /// Makes an edge after a vertex where no cut is possible.
    pub fn uncut() -> Self {
        Self { density: 1.0, cosine: 1.0, back: 0.0, cut: 0.0, length: 0.0 }
    }

    /// Extends the edge by `length` metres.
    pub fn extend(&mut self, length: f64) {
        self.length += length;
    }

    /// Marks a reflection by a mirror, which makes a connection impossible.
    pub fn turn(&mut self) {
        self.cut = 0.0;
    }

    /// Returns the state at the vertex at its end, where the edge arrives at this cosine.
    pub fn arrive(&self, cosine: f64) -> MisWeight {
        let per_squared = 1.0 / (self.length * self.length).max(f64::MIN_POSITIVE);
        MisWeight {
            density: (self.density * cosine * per_squared).max(f64::MIN_POSITIVE),
            cut: self.cut,
            behind: self.back * self.cosine * per_squared,
        }
    }
}
