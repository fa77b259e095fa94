//! A trained estimator as C99 source, for the board itself: tables in flash, a few numbers on the stack, no allocation
//! and nothing kept between two readings. The arithmetic is `learning::portable`'s, line by line.

use std::fmt::Write as _;
use std::path::Path;

use faer::Mat;

use super::{FileError, atomic};
use crate::learning::doubt::NEAR;
use crate::learning::kernel::Kernel;
use crate::learning::machine::{AnswerRule, Regression};
use crate::learning::portable::{Precision, answer, kept, trials};
use crate::learning::{Estimate, TouchEstimator};

/// Readings that are written along.
const TRIALS: usize = 64;
/// How far a board's answers may be from the program's (mm).
pub const AGREES_MM: f64 = 0.01;
/// The files.
pub const FILES: [&str; 3] = ["touch.h", "touch.c", "touch_test.c"];

/// An estimator ready to be written.
pub struct EstimatorSource<'a> {
    estimator: &'a TouchEstimator,
    pub precision: Precision,
    /// Readings with the answers of the program.
    trials: Vec<(Vec<f64>, Estimate)>,
    /// The farthest that the board's answers are from these (mm), as far as it is foreseen.
    pub off_mm: f64,
}

/// What a board has to have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Needs {
    /// Bytes of tables.
    pub flash: usize,
    /// Bytes on the stack, about.
    pub stack: usize,
    /// Additions, multiplications and comparisons for a reading, about.
    pub operations: usize,
    /// Exponentials, roots and the like.
    pub functions: usize,
}

impl<'a> EstimatorSource<'a> {
    /// In the precision that is asked for, or in single precision where its answers agree with the program's.
    #[must_use]
    pub fn new(estimator: &'a TouchEstimator, asked: Option<Precision>) -> Self {
        let readings = trials(estimator, TRIALS);
        let all: Vec<f64> = (0..estimator.channels())
            .flat_map(|c| readings.iter().map(move |r| r[c]))
            .collect();
        let x = crate::dataset::SignalMatrix::new(readings.len(), all);
        let answers = estimator.find(&x);
        let trials: Vec<(Vec<f64>, Estimate)> = readings.into_iter().zip(answers).collect();
        let off = |precision: Precision| {
            let apart = |(reading, right): &(Vec<f64>, Estimate)| {
                let found = answer(estimator, reading, precision);
                let squares = (0..3).map(|a| (found.place_mm[a] - right.place_mm[a]).powi(2));
                squares.sum::<f64>().sqrt()
            };
            trials.iter().map(apart).fold(0.0, f64::max)
        };
        let single = off(Precision::Single);
        let precision = asked.unwrap_or(if single < 0.5 * AGREES_MM {
            Precision::Single
        } else {
            Precision::Double
        });
        let off_mm = off(precision);
        Self {
            estimator,
            precision,
            trials,
            off_mm,
        }
    }

    /// What a board has to have.
    #[must_use]
    pub fn needs(&self) -> Needs {
        let bytes = self.precision.bytes();
        let e = self.estimator;
        let live = e.inputs.live().len();
        let machines = [Some(&e.place), e.force.as_ref().map(|f| &f.machine)];
        let machines = machines.into_iter().flatten();
        let table = |m: &Regression| {
            let outputs = match &m.by {
                AnswerRule::Kernel { weights, .. } => weights.ncols(),
                AnswerRule::Nearest { outputs, .. } => outputs.ncols(),
            };
            let points = m.points.nrows();
            let kernels = usize::from(matches!(m.by, AnswerRule::Kernel { .. }));
            (
                points * (live + outputs),
                points * (3 * live + 2 * outputs + 4),
                points * kernels,
            )
        };
        let (mut numbers, mut operations, mut functions) =
            (5 * live + e.doubt.off.len(), 8 * live, live);
        let mut most = 0;
        for machine in machines {
            let (n, o, f) = table(machine);
            (numbers, operations, functions) = (numbers + n, operations + o, functions + f);
            most = most.max(kept(machine));
        }
        Needs {
            flash: numbers * bytes,
            stack: (2 * live + 8) * bytes + most * (bytes + 2) + 64,
            operations,
            functions,
        }
    }

    /// Writes header, source and a program that tries it on readings with known answers.
    ///
    /// # Errors
    /// [`FileError`] naming the file that could not be written.
    pub fn write(&self, folder: &Path, about: &str) -> Result<(), FileError> {
        let texts = [self.header(about), self.body(about), self.test()];
        for (name, text) in FILES.into_iter().zip(texts) {
            atomic::write(&folder.join(name), text.as_bytes())?;
        }
        Ok(())
    }

    fn header(&self, about: &str) -> String {
        let real = self.real();
        format!(
            "/* {about} */\n#ifndef HAPDEF_TOUCH_H\n#define HAPDEF_TOUCH_H\n\n#define TOUCH_CHANNELS {}\n#define TOUCH_KNOWS_FORCE {}\n\ntypedef {real} touch_real;\n\ntypedef struct {{\n  touch_real place_mm[3];\n  touch_real radius_mm; /* nine of ten true places lie within it */\n  touch_real force_n;   /* 0 where TOUCH_KNOWS_FORCE is 0 */\n}} touch_answer;\n\n#ifdef __cplusplus\nextern \"C\" {{\n#endif\n\n/* Readings in the unit that was learned from. Needs no memory beside the stack and may be called from anywhere. */\nvoid touch_find(const touch_real reading[TOUCH_CHANNELS], touch_answer *answer);\n\n#ifdef __cplusplus\n}}\n#endif\n\n#endif\n",
            self.estimator.channels(),
            u8::from(self.estimator.force.is_some()),
        )
    }

    fn real(&self) -> &'static str {
        match self.precision {
            Precision::Single => "float",
            Precision::Double => "double",
        }
    }

    /// A number as C has it, to the last bit.
    fn number(&self, value: f64) -> String {
        match self.precision {
            Precision::Single => format!("{:e}f", value as f32),
            Precision::Double => format!("{value:e}"),
        }
    }

    fn table(&self, text: &mut String, name: &str, values: impl Iterator<Item = f64>) {
        let all: Vec<String> = values.map(|v| self.number(v)).collect();
        let _ = write!(text, "static const touch_real {name}[{}] = {{", all.len());
        for row in all.chunks(8) {
            let _ = write!(text, "\n  {},", row.join(", "));
        }
        text.push_str("\n};\n");
    }

    fn body(&self, about: &str) -> String {
        let e = self.estimator;
        let (live, inputs, frame) = (e.inputs.live(), &e.inputs, &e.frame);
        let f = match self.precision {
            Precision::Single => "f",
            Precision::Double => "",
        };
        let mut text = format!(
            "/* {about} */\n#include \"touch.h\"\n\n#include <math.h>\n\n#define LIVE {}\n#define NEAR {NEAR}\n\n",
            live.len()
        );
        let _ = write!(text, "static const unsigned short live[LIVE] = {{");
        for c in &live {
            let _ = write!(text, "{c}, ");
        }
        text.push_str("};\n");
        let of = |values: &[f64]| live.iter().map(|&c| values[c]).collect::<Vec<_>>();
        for (name, values) in [
            ("middle", of(&inputs.middle)),
            ("spread", of(&inputs.spread)),
            ("mean", of(&inputs.standard.mean)),
            ("deviation", of(&inputs.standard.deviation)),
        ] {
            self.table(&mut text, name, values.into_iter());
        }
        self.table(&mut text, "off", e.doubt.off.iter().copied());
        self.machine(&mut text, "place", &e.place, f);
        if let Some(force) = &e.force {
            self.machine(&mut text, "force", &force.machine, f);
        }
        let _ = write!(
            text,
            "\nvoid touch_find(const touch_real reading[TOUCH_CHANNELS], touch_answer *answer) {{\n  touch_real features[LIVE], out[3] = {{0, 0, 0}};\n  touch_real near_squared[PLACE_KEPT], sum = 0, first, strange;\n  unsigned short near_number[PLACE_KEPT];\n  int i, found, taken;\n  for (i = 0; i < LIVE; i++) {{\n    touch_real bent = asinh{f}((reading[live[i]] - middle[i]) / spread[i]);\n    features[i] = (bent - mean[i]) / deviation[i];\n  }}\n  found = place_run(features, out, near_squared, near_number);\n"
        );
        for a in 0..3 {
            let _ = writeln!(text, "  sum = 0;");
            for (k, axis) in frame.axes.iter().enumerate() {
                let _ = writeln!(text, "  sum += out[{k}] * {};", self.number(axis[a]));
            }
            let _ = writeln!(
                text,
                "  answer->place_mm[{a}] = {} + {} * sum;",
                self.number(frame.middle[a]),
                self.number(frame.size)
            );
        }
        let _ = write!(
            text,
            "  taken = found < NEAR ? found : NEAR;\n  sum = 0;\n  for (i = 0; i < taken; i++) sum += off[near_number[i]];\n  first = sqrt{f}(near_squared[0]);\n  strange = first / {};\n  if (strange < 1) strange = 1;\n  answer->radius_mm = sqrt{f}(sum / taken) * strange * {};\n",
            self.number(e.doubt.usual.max(f64::from(f32::MIN_POSITIVE))),
            self.number(e.doubt.factor * frame.size)
        );
        match &e.force {
            None => text.push_str("  answer->force_n = 0;\n}\n"),
            Some(force) => {
                let _ = write!(
                    text,
                    "  {{\n    touch_real squared[FORCE_KEPT];\n    unsigned short number[FORCE_KEPT];\n    force_run(features, out, squared, number);\n  }}\n  answer->force_n = {} + {} * out[0];\n  if (answer->force_n < 0) answer->force_n = 0;\n}}\n",
                    self.number(force.scale.middle),
                    self.number(force.scale.size)
                );
            }
        }
        text
    }

    /// The tables of a machine and the function that runs it.
    fn machine(&self, text: &mut String, name: &str, machine: &Regression, f: &str) {
        let rows = |m: &Mat<f64>| -> Vec<f64> {
            m.row_iter()
                .flat_map(|r| r.iter().copied().collect::<Vec<_>>())
                .collect()
        };
        let upper = name.to_uppercase();
        let (points, outputs) = match &machine.by {
            AnswerRule::Kernel { weights, .. } => (machine.points.nrows(), weights.ncols()),
            AnswerRule::Nearest { outputs, .. } => (machine.points.nrows(), outputs.ncols()),
        };
        let _ = write!(
            text,
            "\n#define {upper}_POINTS {points}\n#define {upper}_OUTPUTS {outputs}\n#define {upper}_KEPT {}\n",
            kept(machine)
        );
        self.table(
            text,
            &format!("{name}_lengths"),
            machine.lengths.iter().copied(),
        );
        self.table(
            text,
            &format!("{name}_points"),
            rows(&machine.points).into_iter(),
        );
        match &machine.by {
            AnswerRule::Kernel { weights, bias, .. } => {
                self.table(text, &format!("{name}_weights"), rows(weights).into_iter());
                self.table(text, &format!("{name}_bias"), bias.iter().copied());
            }
            AnswerRule::Nearest { outputs, .. } => {
                self.table(text, &format!("{name}_known"), rows(outputs).into_iter());
            }
        }
        let _ = write!(
            text,
            "\n/* The outputs for some features, and the known touches near by, nearest first: how many. */\nstatic int {name}_run(const touch_real features[LIVE], touch_real *out, touch_real *near_squared, unsigned short *near_number) {{\n  touch_real asked[LIVE];\n  int i, j, k, found = 0;\n  for (j = 0; j < LIVE; j++) asked[j] = features[j] / {name}_lengths[j];\n"
        );
        if let AnswerRule::Kernel { .. } = machine.by {
            let _ = writeln!(
                text,
                "  for (k = 0; k < {upper}_OUTPUTS; k++) out[k] = {name}_bias[k];"
            );
        }
        let _ = write!(
            text,
            "  for (i = 0; i < {upper}_POINTS; i++) {{\n    const touch_real *point = {name}_points + (long)i * LIVE;\n    touch_real squared = 0;\n    for (j = 0; j < LIVE; j++) {{\n      touch_real apart = asked[j] - point[j];\n      squared += apart * apart;\n    }}\n    if (found < {upper}_KEPT || squared < near_squared[found - 1]) {{\n      k = found < {upper}_KEPT ? found++ : found - 1;\n      for (; k > 0 && near_squared[k - 1] > squared; k--) {{\n        near_squared[k] = near_squared[k - 1];\n        near_number[k] = near_number[k - 1];\n      }}\n      near_squared[k] = squared;\n      near_number[k] = (unsigned short)i;\n    }}\n"
        );
        match &machine.by {
            AnswerRule::Kernel { kernel, .. } => {
                let value = match kernel {
                    Kernel::Gaussian => format!("exp{f}({} * squared)", self.number(-0.5)),
                    Kernel::Matern => format!("(1 + r + r * r / 3) * exp{f}(-r)"),
                };
                if *kernel == Kernel::Matern {
                    let _ = write!(text, "    {{\n      touch_real r = sqrt{f}(5 * squared);\n");
                } else {
                    let _ = writeln!(text, "    {{");
                }
                let _ = write!(
                    text,
                    "      touch_real value = {value};\n      for (k = 0; k < {upper}_OUTPUTS; k++) out[k] += value * {name}_weights[(long)i * {upper}_OUTPUTS + k];\n    }}\n  }}\n"
                );
            }
            AnswerRule::Nearest { count, .. } => {
                let count = (*count).min(machine.points.nrows());
                let least = self.number(1e-12);
                let _ = write!(
                    text,
                    "  }}\n  for (k = 0; k < {upper}_OUTPUTS; k++) {{\n    touch_real sum = 0, total = 0;\n    for (i = 0; i < {count}; i++) {{\n      touch_real apart = sqrt{f}(near_squared[i]);\n      touch_real weight = 1 / (apart > {least} ? apart : {least});\n      total += weight;\n      sum += weight * {name}_known[(long)near_number[i] * {upper}_OUTPUTS + k];\n    }}\n    out[k] = sum / total;\n  }}\n"
                );
            }
        }
        text.push_str("  return found;\n}\n");
    }

    /// A program that says how far the answers are from those of the program (mm), and ends with 1 where that is too much.
    fn test(&self) -> String {
        let channels = self.estimator.channels();
        let mut text = format!(
            "/* Tries touch.c on readings with known answers: cc touch_test.c touch.c -lm && ./a.out */\n#include \"touch.h\"\n\n#include <math.h>\n#include <stdio.h>\n\n#define TRIALS {}\n\n",
            self.trials.len()
        );
        let readings = self.trials.iter().flat_map(|t| t.0.clone());
        self.table(&mut text, "readings", readings);
        let _ = write!(
            text,
            "static const double answers[{}] = {{",
            5 * self.trials.len()
        );
        for (_, a) in &self.trials {
            let [x, y, z] = a.place_mm;
            let force = a.force_n.unwrap_or(0.0);
            let _ = write!(
                text,
                "\n  {x:e}, {y:e}, {z:e}, {:e}, {force:e},",
                a.radius_mm
            );
        }
        let _ = write!(
            text,
            "\n}};\n\nint main(void) {{\n  double worst = 0, radius = 0, force = 0;\n  int i, a;\n  for (i = 0; i < TRIALS; i++) {{\n    const double *right = answers + 5 * i;\n    double squares = 0, apart;\n    touch_answer found;\n    touch_find(readings + {channels} * i, &found);\n    for (a = 0; a < 3; a++) squares += (found.place_mm[a] - right[a]) * (found.place_mm[a] - right[a]);\n    if (!(squares <= worst * worst)) worst = sqrt(squares);\n    apart = fabs(found.radius_mm - right[3]);\n    if (!(apart <= radius)) radius = apart;\n    apart = fabs(found.force_n - right[4]);\n    if (!(apart <= force)) force = apart;\n  }}\n  printf(\"%d readings: places off by %.2e mm at most, radii by %.2e mm, forces by %.2e N\\n\", TRIALS, worst, radius, force);\n  return worst <= {AGREES_MM:e} ? 0 : 1;\n}}\n"
        );
        text
    }
}
