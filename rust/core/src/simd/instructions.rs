//! The instruction sets that a processor has, and the one that is used.

use std::sync::atomic::{AtomicU8, Ordering};

/// A family of vector instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Instructions {
    /// One number at a time: runs anywhere.
    Scalar = 1,
    /// 128 bits, 64-bit Arm.
    Neon = 2,
    /// 256 bits with fused multiply-add, x86-64.
    Avx2 = 3,
    /// 512 bits, x86-64.
    Avx512 = 4,
}

impl Instructions {
    const ALL: [Self; 4] = [Self::Avx512, Self::Avx2, Self::Neon, Self::Scalar];

    /// The instruction sets that this processor can run, the fastest first.
    #[must_use]
    pub fn available() -> Vec<Self> {
        Self::ALL.into_iter().filter(|instructions| instructions.runs_here()).collect()
    }

    /// The instruction set that the next call uses: the fastest that this processor has, unless [`Instructions::force`] chose another.
    #[must_use]
    pub fn current() -> Self {
        let forced = FORCED.load(Ordering::Relaxed);
        Self::ALL.into_iter().find(|&one| one as u8 == forced || forced == 0 && one.runs_here()).unwrap_or(Self::Scalar)
    }

    /// Uses these instructions in every later call of this process, or the fastest again after `None`. Meant for tests.
    ///
    /// Returns whether this processor can run them; where it cannot, nothing changes.
    pub fn force(choice: Option<Self>) -> bool {
        let possible = choice.is_none_or(Self::runs_here);
        if possible {
            FORCED.store(choice.map_or(0, |instructions| instructions as u8), Ordering::Relaxed);
        }
        possible
    }

    #[cfg(target_arch = "x86_64")]
    fn runs_here(self) -> bool {
        match self {
            Self::Scalar => true,
            Self::Neon => false,
            Self::Avx2 => pulp::x86::V3::is_available(),
            Self::Avx512 => pulp::x86::V4::is_available(),
        }
    }

    #[cfg(target_arch = "aarch64")]
    fn runs_here(self) -> bool {
        match self {
            Self::Scalar => true,
            Self::Neon => pulp::aarch64::Neon::is_available(),
            Self::Avx2 | Self::Avx512 => false,
        }
    }

    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    fn runs_here(self) -> bool {
        self == Self::Scalar
    }

    /// Numbers worked on side by side.
    #[must_use]
    pub fn lanes(self) -> usize {
        match self {
            Self::Scalar => 1,
            Self::Neon => 2,
            Self::Avx2 => 4,
            Self::Avx512 => 8,
        }
    }
}

/// Zero, or the instruction set that every call must use.
static FORCED: AtomicU8 = AtomicU8::new(0);
