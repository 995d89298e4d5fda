//! Numbers that look random and are the same for every run.

/// Uniform numbers between -0.5 and 0.5.
pub(crate) fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }
}

/// The same, far apart where seeds are neighbours.
pub(crate) fn uniform_apart(seed: u64) -> impl FnMut() -> f64 {
    uniform(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15))
}
