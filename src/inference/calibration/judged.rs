//! Whether known presses fit each other, and where more of them would tell most.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::{
    Calibration, ComparedPress, KnownPress, Least, PER_GAUGE, ReadingErrors, noise_of_mean,
};
use crate::inference::drawn::AsDrawn;
use crate::mesh::SurfacePoint;
use crate::uncertainty::Uncertainty;

/// Places that stand for all touches, and as many that may be pressed next.
const PLACES: usize = 96;
/// More presses than these are not looked for.
const MOST: usize = 12;
/// A press more is worth it where it takes this share off what is not known.
const WORTH: f64 = 0.05;

/// Weighted squares a channel beyond which a press does not fit the others: it was made otherwise than it says.
pub const MISFIT: f64 = 4.0;

/// How far off each press is from what all others foresee: weighted squares over the channels that read it, about one where
/// it fits. With fewer than two presses nothing is foreseen.
#[must_use]
pub fn misfits(
    drawn: &AsDrawn,
    known: &[KnownPress],
    noise: &[f64],
    off: &Uncertainty,
) -> Vec<f64> {
    let noise = &noise_of_mean(noise);
    let misfit = |k: usize| {
        let others: Vec<KnownPress> = (known.iter().enumerate())
            .filter(|(i, _)| *i != k)
            .map(|(_, other)| other.clone())
            .collect();
        misfit(drawn, &known[k], &others, noise, off)
    };
    (0..known.len()).map(|k| misfit(k).unwrap_or(1.0)).collect()
}

fn misfit(
    drawn: &AsDrawn,
    press: &KnownPress,
    others: &[KnownPress],
    noise: &[f64],
    off: &Uncertainty,
) -> Option<f64> {
    if others.is_empty() {
        return None;
    }
    let fitted = super::fitted(drawn, &others.iter().collect::<Vec<_>>(), noise, off);
    let (fit, relative) = (fitted.fit?, fitted.relative);
    let press = ComparedPress::new(drawn, press, &fitted.glued, off);
    let errors = ReadingErrors {
        relative,
        ..ReadingErrors::of_noises(noise)
    };
    let basis = basis(&press);
    let foreseen = press.expected() + &basis * &fit.found;
    let left = DVector::from_column_slice(&press.reading) - foreseen;
    let made = press.covariance(&errors, off.drift)?;
    let made = made.l() * made.l().transpose();
    let doubt = &basis * fit.normal.inverse() * basis.transpose();
    let read: Vec<usize> = (0..left.len()).filter(|&c| press.read[c]).collect();
    let among = DMatrix::from_fn(read.len(), read.len(), |i, j| {
        (&made + &doubt)[(read[i], read[j])]
    });
    let left = DVector::from_iterator(read.len(), read.iter().map(|&c| left[c]));
    let weighed = among.cholesky()?.solve(&left);
    Some(left.dot(&weighed) / read.len() as f64)
}

/// What each unknown says of each channel of a press: channels × unknowns.
fn basis(press: &ComparedPress) -> DMatrix<f64> {
    let channels = press.basis.len();
    let mut basis = DMatrix::zeros(channels, PER_GAUGE * channels + 1);
    for c in 0..channels {
        for (unknown, by) in press.unknowns(c) {
            basis[(c, unknown)] = by;
        }
    }
    basis
}

/// What is not known of readings yet, and what more presses would leave of that.
#[derive(Clone, Debug, PartialEq)]
pub struct PressOutlook {
    /// Standard deviation of a reading by what is not known of the gauges, over the reading (rms over the part): as it is,
    /// and after each press more.
    pub doubts: Vec<f64>,
    /// Where these are best made, one after another.
    pub places: Vec<SurfacePoint>,
}

impl PressOutlook {
    /// How many more presses are worth the trouble.
    #[must_use]
    pub fn worth(&self) -> usize {
        let steps = self.doubts.windows(2);
        steps.take_while(|w| w[1] < (1.0 - WORTH) * w[0]).count()
    }
}

/// Where to press next with a force (N), for what that tells of all readings: greedily, among `places`, of which an even
/// share stands for the part.
#[must_use]
pub fn outlook(
    drawn: &AsDrawn,
    (known, calibration): (&[KnownPress], &Calibration),
    (noise, off): (&[f64], &Uncertainty),
    places: &[SurfacePoint],
    force: f64,
) -> PressOutlook {
    let noise = &noise_of_mean(noise);
    let errors = ReadingErrors {
        relative: calibration.relative,
        ..ReadingErrors::of_noises(noise)
    };
    let made = |at: SurfacePoint, force: f64| {
        let reading: Vec<f64> = drawn.slope(at, &calibration.glued).reading;
        let reading = reading.iter().map(|g| force * g).collect();
        let known = KnownPress { at, force, reading };
        ComparedPress::new(drawn, &known, &calibration.glued, off)
    };
    let share = places.len().div_ceil(PLACES).max(1);
    let candidates: Vec<SurfacePoint> = places.iter().copied().step_by(share).collect();
    let presses: Vec<ComparedPress> = candidates.iter().map(|&at| made(at, force)).collect();
    let of_readings: Vec<DMatrix<f64>> = presses.iter().map(basis).collect();
    let information: Vec<Option<DMatrix<f64>>> = presses
        .iter()
        .zip(&of_readings)
        .map(|(press, basis)| tells(press, basis, &errors, off.drift))
        .collect();
    let past: Vec<ComparedPress> = (known.iter())
        .map(|k| ComparedPress::new(drawn, k, &calibration.glued, off))
        .collect();
    let least = Least {
        presses: &past,
        noise,
        off,
    };
    let mut normal = DMatrix::from_diagonal(&least.prior());
    for press in &past {
        normal += tells(press, &basis(press), &errors, off.drift)
            .unwrap_or_else(|| DMatrix::zeros(normal.nrows(), normal.ncols()));
    }
    let doubt = |normal: &DMatrix<f64>| {
        let factor = normal.clone().cholesky();
        factor.map_or(f64::INFINITY, |f| doubt_of(&f, &presses, &of_readings))
    };
    let mut outlook = PressOutlook {
        doubts: vec![doubt(&normal)],
        places: Vec::new(),
    };
    for _ in 0..MOST {
        let after = |information: &DMatrix<f64>| doubt(&(&normal + information));
        let best = (information.iter().enumerate())
            .filter_map(|(k, information)| Some((k, after(information.as_ref()?))))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((k, left)) = best else {
            break;
        };
        if let Some(information) = &information[k] {
            normal += information;
        }
        outlook.doubts.push(left);
        outlook.places.push(candidates[k]);
    }
    outlook
}

/// What a press says of the unknowns: Bᵀ V⁻¹ B.
fn tells(
    press: &ComparedPress,
    basis: &DMatrix<f64>,
    errors: &ReadingErrors,
    drift: f64,
) -> Option<DMatrix<f64>> {
    let covariance = press.covariance(errors, drift)?;
    Some(basis.tr_mul(&covariance.solve(basis)))
}

/// Standard deviation of readings by what is not known, over the readings: rms over places.
fn doubt_of(normal: &Cholesky<f64, Dyn>, presses: &[ComparedPress], bases: &[DMatrix<f64>]) -> f64 {
    let of_place = |(press, basis): (&ComparedPress, &DMatrix<f64>)| {
        let reading: f64 = press.reading.iter().map(|x| x * x).sum();
        let solved = normal.solve(&basis.transpose());
        (basis * solved).trace() / reading.max(f64::MIN_POSITIVE)
    };
    let sum: f64 = presses.iter().zip(bases).map(of_place).sum();
    (sum / presses.len().max(1) as f64).sqrt()
}
