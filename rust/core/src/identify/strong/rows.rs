//! Rows of the strong form, one per sample, from derivatives of local polynomials.

use crate::equation::motion::{Coefficient, Measured, Motion, Term};
use crate::equation::rows::{Regressor, Rows};
use crate::equation::terms::{BuiltInTerm, TermFunction, signs};
use crate::error::Error;
use crate::exec::stages::Stages;
use crate::identify::strong::beside_gaps::fit_whole;
use crate::lanes::output::Elements;
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::options::{Order, PolynomialOptions};
use crate::local_polynomials::plan::LocalPolynomials;
use crate::record::delayed::Delayed;
use crate::record::samples::{Samples, is_usable};

/// The angle and its derivatives, the torque without its lag, and what the polynomials say.
pub(crate) struct Differentiated {
    pub(crate) derivatives: [Vec<f64>; 3],
    pub(crate) torque: Vec<f64>,
    pub(crate) order: Vec<u8>,
    pub(crate) status: Vec<u16>,
}

pub(crate) fn differentiate(
    plan: &LocalPolynomials,
    motion: &Motion<'_>,
    (lag, filter_torque): (f64, bool),
    stages: &mut Stages<'_, '_>,
) -> Result<Differentiated, Error> {
    let samples = motion.angle.len();
    let mut found = Differentiated {
        derivatives: [(); 3].map(|()| vec![0.0; samples]),
        torque: vec![0.0; samples],
        order: vec![0; samples],
        status: vec![0; samples],
    };
    let workers = stages.workers;
    let elements = Elements { first: 0, step: 1 };
    stages.stage(|watch| {
        let estimates = Estimates {
            elements,
            derivatives: found.derivatives.iter_mut().map(Vec::as_mut_slice).collect(),
            order: &mut found.order,
            status: &mut found.status,
            sigma: &mut [],
        };
        plan.run(&[motion.angle], estimates, true, workers, watch)
    })?;
    let Differentiated { derivatives, order, status, .. } = &mut found;
    fit_whole(
        plan,
        &whole(motion.angle),
        derivatives,
        |_| true,
        stages,
        |sample, own_order, flags| {
            (order[sample], status[sample]) = (own_order, flags);
        },
    )?;
    take_measured(plan, &motion.measured, &mut found.derivatives, stages)?;
    let torque = Delayed::new(motion.torque, lag);
    torque.read(0, &mut found.torque);
    if filter_torque {
        smooth_torque(plan, &mut found, stages)?;
    }
    Ok(found)
}

/// Takes derivatives from the channel that measured the nearest one, smoothed as the angle is.
fn take_measured(
    plan: &LocalPolynomials,
    measured: &Measured<'_>,
    derivatives: &mut [Vec<f64>; 3],
    stages: &mut Stages<'_, '_>,
) -> Result<(), Error> {
    for (derivative, channel) in measured.channels.iter().enumerate().skip(1) {
        let Some(channel) = *channel else { continue };
        let samples = channel.len();
        let mut own = [(); 3].map(|()| vec![0.0; samples]);
        let (mut order, mut status) = (vec![0; samples], vec![0; samples]);
        let workers = stages.workers;
        stages.stage(|watch| {
            let estimates = Estimates {
                elements: Elements { first: 0, step: 1 },
                derivatives: own.iter_mut().map(Vec::as_mut_slice).collect(),
                order: &mut order,
                status: &mut status,
                sigma: &mut [],
            };
            plan.run(&[channel], estimates, true, workers, watch)
        })?;
        fit_whole(plan, &whole(channel), &mut own, |_| true, stages, |_, _, _| {})?;
        derivatives[derivative..].iter_mut().zip(own).for_each(|(column, own)| *column = own);
    }
    Ok(())
}

/// Smooths the torque with polynomials of the order that was chosen for the angle at each sample.
fn smooth_torque(
    plan: &LocalPolynomials,
    found: &mut Differentiated,
    stages: &mut Stages<'_, '_>,
) -> Result<(), Error> {
    let (samples, workers) = (found.torque.len(), stages.workers);
    let elements = Elements { first: 0, step: 1 };
    let recorded = found.torque.clone();
    let mut smoothed = [vec![0.0; samples]];
    let mut orders: Vec<u8> = found.order.clone();
    orders.sort_unstable();
    orders.dedup();
    for order in orders {
        let options =
            PolynomialOptions { order: Order::Fixed(order.into()), derivatives: vec![0], ..plan.options().clone() };
        let fixed = LocalPolynomials::new(options)?;
        stages.stage(|watch| {
            let estimates = Estimates {
                elements,
                derivatives: vec![&mut smoothed[0]],
                order: &mut [],
                status: &mut [],
                sigma: &mut [],
            };
            fixed.run(&[&recorded.as_slice()], estimates, true, workers, watch)
        })?;
        let orders_of_angle = &found.order;
        let is_own = |sample: usize| orders_of_angle[sample] == order;
        fit_whole(&fixed, &recorded, &mut smoothed, is_own, stages, |_, _, _| {})?;
        let own = found.torque.iter_mut().zip(&smoothed[0]).zip(&found.order);
        own.filter(|(_, one)| **one == order).for_each(|((torque, smooth), _)| *torque = *smooth);
    }
    Ok(())
}

/// One row a sample, with the weight of that sample.
pub(crate) fn rows(
    plan: &LocalPolynomials,
    motion: &Motion<'_>,
    (mask, weights): (Option<&[bool]>, Option<&[f64]>),
    linear: bool,
    differentiated: &Differentiated,
) -> Rows {
    let samples = motion.angle.len();
    let [angle, velocity, acceleration] = &differentiated.derivatives;
    let mut columns: Vec<Vec<f64>> = vec![acceleration.clone(), velocity.clone(), angle.clone()];
    for term in &motion.terms {
        columns.push(match *term {
            Term::BuiltIn(BuiltInTerm { function: TermFunction::One, .. }) => vec![1.0; samples],
            Term::BuiltIn(BuiltInTerm { function: TermFunction::OfAngle(function), .. }) => applied(*function, angle),
            Term::BuiltIn(BuiltInTerm { function: TermFunction::OfVelocity(function), .. }) => {
                applied(*function, velocity)
            }
            Term::BuiltIn(BuiltInTerm { function: TermFunction::Direction, .. }) => applied(signs, velocity),
            Term::Record(record) => whole(record),
        });
    }
    let mut rhs = differentiated.torque.clone();
    for (coefficient, column) in motion.coefficients.iter().zip(&columns) {
        match coefficient {
            Coefficient::Unknown => {}
            Coefficient::Number(number) => {
                rhs.iter_mut().zip(column).for_each(|(rhs, factor)| *rhs -= number * factor);
            }
            Coefficient::Record(record) => {
                let known = whole(*record).into_iter().zip(column);
                rhs.iter_mut().zip(known).for_each(|(rhs, (known, factor))| *rhs -= known * factor);
            }
        }
    }
    let before = plan.before_centre();
    let equations = before..(samples + before + 1).saturating_sub(plan.options().window_length).max(before);
    let usable: Vec<bool> = (0..samples)
        .map(|row| {
            equations.contains(&row)
                && mask.is_none_or(|mask| mask[row])
                && columns.iter().chain([&rhs]).all(|column| is_usable(column[row]))
        })
        .collect();
    for column in columns.iter_mut().chain([&mut rhs]) {
        column.iter_mut().zip(&usable).filter(|(_, usable)| !**usable).for_each(|(value, _)| *value = 0.0);
    }
    let companion = || if linear { vec![0.0; samples] } else { Vec::new() };
    let regressors =
        columns.into_iter().map(|value| Regressor { value, companion: companion(), noise: Default::default() });
    let mut rows = Rows {
        regressors: regressors.collect(),
        rhs,
        rhs_noise: Vec::new(),
        usable,
        jumps: Vec::new(),
        period: plan.options().delta,
        ..Rows::default()
    };
    if let Some(weights) = weights {
        rows.weigh(weights.iter().map(|weight| weight.sqrt()).collect());
    }
    rows
}

/// A function of a channel.
fn applied(function: fn(&mut [f64]), channel: &[f64]) -> Vec<f64> {
    let mut values = channel.to_vec();
    function(&mut values);
    values
}

fn whole(record: &dyn Samples) -> Vec<f64> {
    let mut values = vec![0.0; record.len()];
    record.read(0, &mut values);
    values
}
