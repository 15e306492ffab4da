//! Counter-based random numbers, Sobol replicates and warps.
