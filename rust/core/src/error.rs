//! Misuse of a call. What the data holds is never an error: see [`crate::status`].

use thiserror::Error;

/// Why a call was refused. Every message states the rule, the value that broke it and what would be right.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// A window of local polynomials holds fewer samples than the shortest that leaves a choice of order.
    #[error("window_length must be at least {least} samples; got {window_length}; give {least} or more")]
    WindowTooShort {
        /// What was asked for, samples.
        window_length: usize,
        /// The shortest allowed, samples.
        least: usize,
    },
    /// A window longer than the record.
    #[error(
        "window_length must be less than or equal to the length of the record; got {window_length} samples for a record of {samples}; \
         use a window of at most {samples} samples or a longer record"
    )]
    WindowTooLong {
        /// What was asked for, samples.
        window_length: usize,
        /// Length of the record, samples.
        samples: usize,
    },
    /// A record that holds less than what is to be learnt of it needs.
    #[error("a record must hold at least {least} samples for its noise to be known; got {samples}; record more")]
    RecordTooShort {
        /// Length of the record, samples.
        samples: usize,
        /// The shortest allowed, samples.
        least: usize,
    },
    /// A polynomial order beyond what double precision supports.
    #[error(
        "{name} must be at most {most}; got {order}; polynomials of a higher order do more harm than good: shorten the window"
    )]
    OrderTooHigh {
        /// The argument.
        name: &'static str,
        /// What was asked for.
        order: usize,
        /// The highest allowed.
        most: usize,
    },
    /// A polynomial that has no such derivative.
    #[error(
        "the order must be at least that of the derivative; got order {order} for derivative {derivative}; raise the order or ask for less"
    )]
    OrderTooLow {
        /// What was asked for.
        order: usize,
        /// The derivative.
        derivative: usize,
    },
    /// A polynomial of this order is not determined by a window of this length.
    #[error(
        "order must be less than window_length; got order {order} for a window of {window_length} samples; \
         lower the order or lengthen the window"
    )]
    OrderNotDetermined {
        /// What was asked for.
        order: usize,
        /// Length of the window, samples.
        window_length: usize,
    },
    /// Numbers of a part of a record that only the whole gives.
    #[error(
        "a part of a record in strong form gives what is windowed without lag, mask or filtered torque; got other unknowns or settings; identify the \
         whole record"
    )]
    OnlyOfWholeRecord,
    /// No regressors, or more than the kernels hold.
    #[error("the number of regressors must be between 1 and {most}; got {regressors}; drop or combine some")]
    Regressors {
        /// How many there are.
        regressors: usize,
        /// The most allowed.
        most: usize,
    },
    /// No row would be left to judge the fit by.
    #[error(
        "window must hold more rows than there are regressors; got {window} rows for {regressors} regressors; \
         use {} or more", .regressors + 1
    )]
    RowsTooFew {
        /// Rows in a window.
        window: usize,
        /// How many regressors there are.
        regressors: usize,
    },
    /// An exponent that makes no test function.
    #[error(
        "exponent must be between {least} and {most}; got {exponent}; with less the test function's second derivative jumps at its ends"
    )]
    Exponent {
        /// What was asked for.
        exponent: usize,
        /// The lowest allowed.
        least: usize,
        /// The highest allowed.
        most: usize,
    },
    /// A record that holds too few samples to choose anything by.
    #[error(
        "a record must hold at least {least} samples for windows of several test functions; got {samples}; \
         record longer, or give a shorter window_length"
    )]
    RecordTooShortForWindows {
        /// Length of the record, samples.
        samples: usize,
        /// The shortest allowed, samples.
        least: usize,
    },
    /// Channels, a mask or a known parameter of another length than the angle.
    #[error(
        "every channel must have as many samples as the angle; got {other} for an angle of {samples}; cut or resample one of them"
    )]
    LengthsDiffer {
        /// Samples of the angle.
        samples: usize,
        /// Samples of another channel.
        other: usize,
    },
    /// A sample rate that is no positive number.
    #[error("sample_rate must be positive and finite; got {sample_rate}; give the samples per second")]
    SampleRate {
        /// What was given.
        sample_rate: f64,
    },
    /// A term that has no such name.
    #[error("a term must be one of {known}; got {name:?}; use one of these")]
    NoSuchTerm {
        /// What was given.
        name: String,
        /// All names.
        known: String,
    },
    /// A call in which everything is known.
    #[error("at least one parameter must be unknown; all are given; let one be windowed or constant")]
    NothingUnknown,
    /// Something that only the weak form does.
    #[error("{what} needs the weak form; got the strong form; {cure}")]
    NeedsWeakForm {
        /// What was asked for.
        what: &'static str,
        /// What would be right.
        cure: &'static str,
    },
    /// Numbers at every so many samples, and that is none.
    #[error("step must be at least 1; got 0; give 1 for numbers at every sample")]
    StepTooSmall,
    /// Equations that do not determine what is constant.
    #[error("the record must determine what is constant; it does not; excite the system, or leave a parameter out")]
    NotDetermined,
    /// Something that needs more of a record than a stream ever holds.
    #[error("a stream holds no more than its windows need, and {what} needs more; got {what}; {cure}")]
    NotInAStream {
        /// What was asked for.
        what: &'static str,
        /// What would be right.
        cure: &'static str,
    },
    /// The work was cancelled by whoever watched it.
    #[error("the work was cancelled")]
    Cancelled,
    /// The system does not have the memory.
    #[error(
        "the work needs {bytes} bytes of memory more than there is; use a shorter record or window, or fewer workers"
    )]
    Memory {
        /// What was asked for.
        bytes: usize,
    },
    /// The system did not give the threads.
    #[error("could not start {threads} threads ({cause}); ask for fewer workers")]
    Threads {
        /// How many were wanted.
        threads: usize,
        /// What the system said.
        cause: String,
    },
}
