//! Job scripts: what carries a study's units to machines is an engine that people have.

use std::fmt::Write as _;

/// An engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// `HyperQueue`: a task array.
    HyperQueue,
    /// Slurm: a job array.
    Slurm,
    /// GNU parallel, on this machine.
    Parallel,
}

/// What a unit may take, as far as that is foreseen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitLimits {
    /// Units of the study.
    pub units: usize,
    /// Units that one task runs one after another: those that share a simulation, or as many as are worth a start.
    pub together: usize,
    /// Of a task.
    pub minutes: u32,
    /// Of a task (GB).
    pub memory_gb: u32,
    /// Threads of a task.
    pub threads: u32,
}

/// A script and the command that hands it in.
#[derive(Clone, Debug, PartialEq)]
pub struct JobScript {
    /// Name of its file, in the study's folder.
    pub name: &'static str,
    /// Its text.
    pub text: String,
    /// What hands it in, from the study's folder.
    pub command: String,
}

impl UnitLimits {
    fn tasks(&self) -> usize {
        self.units.div_ceil(self.together.max(1)).max(1)
    }

    /// The script for an engine; `program` is what runs `hapdef`.
    #[must_use]
    pub fn script(&self, engine: Engine, program: &str) -> JobScript {
        let mut text = String::from("#!/bin/sh\n");
        let last = self.tasks() - 1;
        let (minutes, memory, threads) = (self.minutes, self.memory_gb, self.threads);
        let task = match engine {
            Engine::HyperQueue => {
                let _ = write!(
                    text,
                    "#HQ --name hapdef-study\n#HQ --array 0-{last}\n#HQ --cpus {threads}\n#HQ --time-limit {minutes}min\n#HQ --crash-limit 5\n#HQ --stdout logs/%{{TASK_ID}}.out\n#HQ --stderr logs/%{{TASK_ID}}.err\n"
                );
                "$HQ_TASK_ID"
            }
            Engine::Slurm => {
                let _ = write!(
                    text,
                    "#SBATCH --job-name=hapdef-study\n#SBATCH --array=0-{last}\n#SBATCH --cpus-per-task={threads}\n#SBATCH --mem={memory}G\n#SBATCH --time={minutes}\n#SBATCH --requeue\n#SBATCH --output=logs/%a.out\n#SBATCH --error=logs/%a.err\n"
                );
                "$SLURM_ARRAY_TASK_ID"
            }
            Engine::Parallel => "$1",
        };
        let n = self.together.max(1);
        let _ = write!(
            text,
            "# Each task runs {n} units. Whoever runs one again writes the same bytes.\nfirst=$(({task} * {n}))\nlast=$((first + {}))\n[ \"$last\" -ge {} ] && last={}\nexec {program} study run . --units \"$first-$last\" --threads {threads} --memory-gb {memory}\n",
            n - 1,
            self.units,
            self.units.saturating_sub(1)
        );
        let (name, command) = match engine {
            Engine::HyperQueue => ("study.hq.sh", "hq submit ./study.hq.sh".to_owned()),
            Engine::Slurm => ("study.slurm.sh", "sbatch study.slurm.sh".to_owned()),
            Engine::Parallel => (
                "study.parallel.sh",
                format!(
                    "seq 0 {last} | parallel --retries 3 --joblog logs/jobs --timeout {} sh study.parallel.sh",
                    60 * minutes
                ),
            ),
        };
        JobScript {
            name,
            text,
            command,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const JOB: UnitLimits = UnitLimits {
        units: 25,
        together: 10,
        minutes: 30,
        memory_gb: 4,
        threads: 2,
    };

    #[test]
    fn tasks_cover_every_unit_once() {
        let script = JOB.script(Engine::Slurm, "hapdef");
        assert!(script.text.contains("--array=0-2") && script.text.contains("--mem=4G"));
        assert!(script.text.contains("first=$(($SLURM_ARRAY_TASK_ID * 10))"));
        assert!(script.text.contains("-ge 25 ] && last=24"));
        let script = JOB.script(Engine::HyperQueue, "hapdef");
        assert!(
            script.text.contains("#HQ --array 0-2")
                && script.text.contains("#HQ --time-limit 30min")
        );
        let script = JOB.script(Engine::Parallel, "hapdef");
        assert!(script.command.starts_with("seq 0 2 | parallel"));
    }
}
