//! Properties of rolling least squares: it agrees with a QR decomposition of every window on its own, however the rows are cut.

use crate::random::uniform_apart;
use faer::Mat;
use faer::linalg::solvers::SolveLstsq;
use proptest::prelude::*;
use tvident::Status;
use tvident::lanes::Elements;
use tvident::least_squares::HALF_OF_THE_DIGITS;
use tvident::least_squares::{Equations, Regressions, RollingLeastSquares};
use tvident::record::Samples;
use tvident::simd::Instructions;

#[derive(Clone, Debug, PartialEq)]
struct Everything {
    parameters: Vec<Vec<f64>>,
    errors: Vec<Vec<f64>>,
    covariances: Vec<Vec<f64>>,
    residuals: Vec<Vec<f64>>,
    condition: Vec<f64>,
    status: Vec<u16>,
}

struct Problem {
    regressors: Vec<Vec<f64>>,
    rhs: Vec<Vec<f64>>,
    window: usize,
}

fn solve_in_pieces(problem: &Problem, cuts: &[usize], instructions: Instructions) -> Everything {
    let (p, q, n) = (problem.regressors.len(), problem.rhs.len(), problem.rhs[0].len());
    let pairs: Vec<(usize, usize)> = (1..p).map(|i| (i - 1, i)).collect();
    let plan =
        RollingLeastSquares::new(problem.window, p, q, pairs.clone(), HALF_OF_THE_DIGITS, instructions).expect("valid");
    let columns: Vec<&[f64]> = problem.regressors.iter().chain(&problem.rhs).map(Vec::as_slice).collect();
    let columns: Vec<&dyn Samples> = columns.iter().map(|column| column as &dyn Samples).collect();
    let equations = Equations { columns, rows: 0..n, ..Equations::default() };
    let mut all = Everything {
        parameters: vec![vec![0.0; n]; p * q],
        errors: vec![vec![0.0; n]; p * q],
        covariances: vec![vec![0.0; n]; pairs.len() * q],
        residuals: vec![vec![0.0; n]; q],
        condition: vec![0.0; n],
        status: vec![0; n],
    };
    let mut scratch = plan.scratch();
    let mut bounds = vec![0, n];
    bounds.extend(cuts.iter().map(|cut| cut % n));
    bounds.sort_unstable();
    for piece in bounds.windows(2) {
        let rows = piece[0]..piece[1];
        let mut regressions = Regressions {
            elements: Elements { first: rows.start, step: 1 },
            parameters: all.parameters.iter_mut().map(|values| &mut values[rows.clone()]).collect(),
            errors: all.errors.iter_mut().map(|values| &mut values[rows.clone()]).collect(),
            covariances: all.covariances.iter_mut().map(|values| &mut values[rows.clone()]).collect(),
            residuals: all.residuals.iter_mut().map(|values| &mut values[rows.clone()]).collect(),
            deviations: Vec::new(),
            condition: &mut all.condition[rows.clone()],
            status: &mut all.status[rows.clone()],
            ..Regressions::default()
        };
        plan.solve(&equations, rows, &mut regressions, &mut scratch);
    }
    all
}

fn solve(problem: &Problem) -> Everything {
    solve_in_pieces(problem, &[], Instructions::current())
}

fn noise(seed: u64, n: usize) -> Vec<f64> {
    let mut uniform = uniform_apart(seed);
    (0..n).map(|_| uniform()).collect()
}

fn problem(seed: u64, n: usize, p: usize, q: usize, window: usize) -> Problem {
    let regressors: Vec<Vec<f64>> = (0..p)
        .map(|j| {
            noise(seed + j as u64, n)
                .into_iter()
                .map(|value| value * [1.0, 1e3, 1e6, 1e2, 1e5, 1e1, 1e4][j % 7])
                .collect()
        })
        .collect();
    let one_rhs = |s: usize| {
        let error = noise(seed + 100 + s as u64, n);
        (0..n).map(|i| regressors.iter().map(|column| column[i]).sum::<f64>() + error[i]).collect()
    };
    let rhs = (0..q).map(one_rhs).collect();
    Problem { regressors, rhs, window }
}

/// Errors of a solution by orthogonal transformations: condition number times rounding times the square root of the rows, with room.
fn tolerance(condition: f64, rows: usize) -> f64 {
    30.0 * condition * f64::EPSILON * (rows as f64).sqrt()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: ProptestConfig::default().cases / 4, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_window_is_as_if_solved_alone(seed in 0_u64..1 << 40, p in 1_usize..=8, q in 1_usize..=3, w in 2_usize..80, more in 0_usize..200) {
        let w = w + p;
        let problem = problem(seed, w + more, p, q, w);
        let (found, n) = (solve(&problem), w + more);
        for i in 0..n {
            let rows = i.saturating_sub(w / 2)..(i + w - w / 2).min(n);
            let count = rows.len();
            let status = found.status[i];
            prop_assert_eq!(status & Status::EDGE.bits() != 0, count < w);
            if 2 * count < w || count <= p {
                prop_assert!(status & Status::INVALID.bits() != 0);
                prop_assert!(found.parameters[0][i].is_nan());
                continue;
            }
            let a = Mat::from_fn(count, p, |r, j| problem.regressors[j][rows.start + r]);
            let b = Mat::from_fn(count, q, |r, s| problem.rhs[s][rows.start + r]);
            let expected = a.qr().solve_lstsq(&b);
            let residual = &b - &a * expected.subrows(0, p);
            let norms: Vec<f64> = (0..p).map(|j| a.col(j).norm_l2()).collect();
            let scaled = Mat::from_fn(count, p, |r, j| a[(r, j)] / norms[j]);
            let singular = scaled.singular_values().expect("converges");
            let condition = (p as f64).sqrt() * singular.iter().map(|s| s.powi(-2)).sum::<f64>().sqrt();
            let allowed = tolerance(condition, count);
            prop_assert!((found.condition[i] / condition - 1.0).abs() < allowed, "{} {condition}", found.condition[i]);
            for s in 0..q {
                let size = (0..p).map(|j| (expected[(j, s)] * norms[j]).abs()).sum::<f64>() + b.col(s).norm_l2();
                for j in 0..p {
                    let error = (found.parameters[j * q + s][i] - expected[(j, s)]).abs() * norms[j];
                    prop_assert!(error < allowed * size, "row {i}, parameter {j}: {error} of {size}");
                }
                let rss = residual.col(s).squared_norm_l2();
                let error = (found.residuals[s][i].sqrt() - rss.sqrt()).abs();
                prop_assert!(error <= allowed * size, "row {i}: {error} of {size}");
            }
        }
    }

    #[test]
    fn any_cutting_gives_the_same_bits(
        seed in 0_u64..1 << 40, p in 1_usize..=5, w in 6_usize..60, more in 0_usize..1500, cuts in prop::collection::vec(any::<usize>(), 0..6),
    ) {
        let problem = problem(seed, w + more, p, 1, w);
        let whole = solve(&problem);
        let cut = solve_in_pieces(&problem, &cuts, Instructions::current());
        prop_assert_eq!(format!("{whole:?}"), format!("{cut:?}"));
    }

    #[test]
    fn every_path_gives_the_same_numbers(seed in 0_u64..1 << 40, p in 1_usize..=5, w in 8_usize..60, more in 0_usize..400) {
        let problem = problem(seed, w + more, p, 1, w);
        let fastest = solve(&problem);
        for instructions in Instructions::available() {
            let other = solve_in_pieces(&problem, &[], instructions);
            prop_assert_eq!(&fastest.status, &other.status);
            for i in (0..w + more).filter(|&i| fastest.status[i] & Status::INVALID.bits() == 0) {
                let allowed = tolerance(fastest.condition[i], w) * 10.0;
                for j in 0..p {
                    let (a, b) = (fastest.parameters[j][i], other.parameters[j][i]);
                    prop_assert!((a - b).abs() <= allowed * a.abs().max(1.0), "{instructions:?}: {a} {b}");
                }
            }
        }
    }
}

#[test]
fn a_glitch_leaves_with_its_row() {
    let clean = problem(1, 3000, 3, 1, 100);
    let mut dirty = problem(1, 3000, 3, 1, 100);
    dirty.rhs[0][1500] = 1e12;
    dirty.regressors[1][1500] = -1e13;
    let (found, expected) = (solve(&dirty), solve(&clean));
    for i in (0..3000_usize).filter(|i| i.abs_diff(1500) > 51) {
        for j in 0..3 {
            assert_eq!(found.parameters[j][i], expected.parameters[j][i], "row {i}");
            assert_eq!(found.errors[j][i], expected.errors[j][i], "row {i}");
        }
    }
}

#[test]
fn dependent_and_missing_regressors_are_flagged() {
    let mut twins = problem(1, 300, 2, 1, 50);
    twins.regressors[1] = twins.regressors[0].iter().map(|value| 3.0 * value).collect();
    let mut nothing = problem(1, 300, 2, 1, 50);
    nothing.regressors[0].fill(0.0);
    let mut almost = problem(1, 300, 2, 1, 50);
    almost.regressors[1] = almost.regressors[0].iter().enumerate().map(|(i, v)| v + 1e-10 * (i % 3) as f64).collect();
    for problem in [&twins, &nothing] {
        let found = solve(problem);
        for i in 0..300 {
            let flags = Status::INVALID | Status::RANK_DEFICIENT;
            assert_eq!(found.status[i] & flags.bits(), flags.bits());
            assert!(found.parameters[0][i].is_nan() && found.parameters[1][i].is_nan());
            assert!(found.errors[0][i].is_nan());
            assert_eq!(found.condition[i], f64::INFINITY);
        }
    }
    let found = solve(&almost);
    assert!(found.status.iter().all(|&status| status & Status::ILL_CONDITIONED.bits() != 0));
    assert!(found.condition.iter().all(|&condition| condition > 1e8));
}

#[test]
fn windows_longer_than_a_segment_are_the_same_least_squares() {
    let problem = problem(5, 12_000, 3, 1, 5001);
    let found = solve(&problem);
    for i in [2500, 4000, 6000, 9499] {
        let a = Mat::from_fn(5001, 3, |r, j| problem.regressors[j][i - 2500 + r]);
        let b = Mat::from_fn(5001, 1, |r, _| problem.rhs[0][i - 2500 + r]);
        let expected = a.qr().solve_lstsq(&b);
        for j in 0..3 {
            let error = (found.parameters[j][i] - expected[(j, 0)]).abs() * a.col(j).norm_l2();
            assert!(error < tolerance(found.condition[i], 5001) * b.norm_l2(), "row {i}, parameter {j}: {error}");
        }
    }
}
