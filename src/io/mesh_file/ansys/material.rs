//! Materials of a deck: constants, and tables by temperature.

use std::collections::BTreeMap;

use super::command::{DeckCommand, Parameters};
use crate::io::mesh_file::unread::Unread;

/// Ansys' own Poisson's ratio, where a material has none.
const POISSONS_RATIO: f64 = 0.3;
/// Slots of a table of temperatures that can be meant.
const SLOTS: usize = 1000;

/// A temperature, where one is known, and the value there.
type TemperatureValue = (Option<f64>, f64);

/// Materials by number.
#[derive(Default)]
pub struct Materials {
    /// The table of temperatures that values are given for next.
    temperatures: Vec<Option<f64>>,
    /// By number and label: EX and the like.
    values: BTreeMap<(u64, String), Vec<TemperatureValue>>,
    /// The temperature of the part.
    reference: f64,
}

/// What is read of a material: what makes it elastic.
fn is_elastic(label: &str) -> bool {
    ["EX", "EY", "EZ", "PRXY", "NUXY"].contains(&label)
}

/// Where the fields of a command begin: written by CDWRITE, it has a release and a count first.
fn start(command: &DeckCommand) -> usize {
    if command.label(0).starts_with('R') && command.field(0).contains('.') {
        2
    } else {
        0
    }
}

impl Materials {
    /// MP,Lab,MAT,C0,C1,…: a polynomial of the temperature.
    ///
    /// # Errors
    /// A message naming the line.
    pub fn constant(
        &mut self,
        command: &DeckCommand,
        known: &Parameters,
        unread: &mut Unread,
    ) -> Result<(), String> {
        let label = command.label(0);
        if !is_elastic(&label) {
            unread.add(&format!("MP,{label}"), command.line);
            return Ok(());
        }
        let number = known.whole(command, 1)?.unwrap_or(1);
        let mut value = 0.0;
        for power in 0..5_i32 {
            let coefficient = known.number(command, 2 + power as usize)?;
            value += coefficient.unwrap_or(0.0) * self.reference.powi(power);
        }
        self.values.insert((number, label), vec![(None, value)]);
        Ok(())
    }

    /// MPTEMP,SLOC,T1,…: temperatures that values follow for; without fields the table is emptied.
    ///
    /// # Errors
    /// A message naming the line.
    pub fn temperatures(
        &mut self,
        command: &DeckCommand,
        known: &Parameters,
    ) -> Result<(), String> {
        let first = start(command);
        if command.fields() == 1 && command.field(0).is_empty() {
            self.temperatures.clear();
            return Ok(());
        }
        let slot = known.whole(command, first)?.unwrap_or(1);
        for (at, temperature) in slots(slot).zip(following(command, known, first + 1)?) {
            if at >= self.temperatures.len() {
                self.temperatures.resize(at + 1, None);
            }
            self.temperatures[at] = Some(temperature);
        }
        Ok(())
    }

    /// MPDATA,Lab,MAT,SLOC,C1,…: values at these temperatures.
    ///
    /// # Errors
    /// A message naming the line.
    pub fn data(
        &mut self,
        command: &DeckCommand,
        known: &Parameters,
        unread: &mut Unread,
    ) -> Result<(), String> {
        let first = start(command);
        let label = command.label(first);
        if !is_elastic(&label) {
            unread.add(&format!("MPDATA,{label}"), command.line);
            return Ok(());
        }
        let number = known.whole(command, first + 1)?.unwrap_or(1);
        let slot = known.whole(command, first + 2)?.unwrap_or(1);
        let values = following(command, known, first + 3)?;
        let entries = self.values.entry((number, label)).or_default();
        if slot <= 1 {
            entries.clear();
        }
        for (at, value) in slots(slot).zip(values) {
            entries.push((self.temperatures.get(at).copied().flatten(), value));
        }
        Ok(())
    }

    /// TREF: the temperature that the part has.
    ///
    /// # Errors
    /// A message naming the line.
    pub fn reference(&mut self, command: &DeckCommand, known: &Parameters) -> Result<(), String> {
        self.reference = known.number(command, 0)?.unwrap_or(0.0);
        Ok(())
    }

    /// Young's modulus and Poisson's ratio of a material, at the part's temperature; nothing where it has none or is
    /// not the same in all directions. What is worth a word is noted.
    pub fn elastic(&self, number: u64, notes: &mut Vec<String>) -> Option<[f64; 2]> {
        let value = |label: &str| self.value(number, label);
        let Some(modulus) = value("EX") else {
            notes.push(format!(
                "the file has no material that is read (MP,EX of material {number}): the project's is taken"
            ));
            return None;
        };
        if ["EY", "EZ"]
            .iter()
            .any(|label| value(label).is_some_and(|e| e != modulus))
        {
            notes.push(format!(
                "material {number} is not the same in all directions, which is not computed: the project's is taken"
            ));
            return None;
        }
        let ratio = value("PRXY").or_else(|| value("NUXY"));
        if ratio.is_none() {
            notes.push(format!(
                "material {number} has no Poisson's ratio (PRXY or NUXY): it is taken as {POISSONS_RATIO}, as Ansys does"
            ));
        }
        if self
            .values
            .get(&(number, "EX".to_owned()))
            .is_some_and(|table| table.len() > 1)
        {
            notes.push(format!(
                "material {number} is a table by temperature: its values at {} (TREF) are taken",
                self.reference
            ));
        }
        Some([modulus, ratio.unwrap_or(POISSONS_RATIO)])
    }

    /// A property at the part's temperature: between two of its table in proportion, beyond its ends as there.
    fn value(&self, number: u64, label: &str) -> Option<f64> {
        let mut table = self.values.get(&(number, label.to_owned()))?.clone();
        table.sort_by(|a, b| a.0.unwrap_or(0.0).total_cmp(&b.0.unwrap_or(0.0)));
        let above = table.partition_point(|(t, _)| t.unwrap_or(0.0) < self.reference);
        let (Some(low), Some(high)) = (table.get(above.saturating_sub(1)), table.get(above)) else {
            return table.last().map(|(_, value)| *value);
        };
        let (from, to) = (low.0.unwrap_or(0.0), high.0.unwrap_or(0.0));
        if to <= from {
            return Some(high.1);
        }
        let part = ((self.reference - from) / (to - from)).clamp(0.0, 1.0);
        Some(low.1 + part * (high.1 - low.1))
    }
}

/// Places in a table from a slot on, which is counted from one.
fn slots(first: u64) -> std::ops::Range<usize> {
    let first = usize::try_from(first.max(1) - 1).unwrap_or(SLOTS);
    first..SLOTS.max(first)
}

/// The numbers from field `k` on.
fn following(command: &DeckCommand, known: &Parameters, k: usize) -> Result<Vec<f64>, String> {
    let mut values = Vec::new();
    for k in k..command.fields() {
        values.extend(known.number(command, k)?);
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::super::command::{Statement, statements};
    use super::*;

    fn materials(lines: &[&str]) -> (Materials, Unread) {
        let (mut all, known) = (Materials::default(), Parameters::default());
        let mut unread = Unread::default();
        for line in lines {
            let Some(Statement::Command(command)) = statements(line, 1).pop() else {
                panic!("{line}");
            };
            match command.key() {
                "MP" => all.constant(&command, &known, &mut unread),
                "MPTE" => all.temperatures(&command, &known),
                "MPDA" => all.data(&command, &known, &mut unread),
                _ => all.reference(&command, &known),
            }
            .unwrap();
        }
        (all, unread)
    }

    #[test]
    fn constants_are_read_in_both_ways() {
        let mut notes = Vec::new();
        let (all, unread) = materials(&[
            "MP,DENS,1,930,\t! kg m^-3",
            "MP,EX,1,1700000000,\t! Pa",
            "MP,NUXY,1,0.394,",
        ]);
        assert_eq!(all.elastic(1, &mut notes), Some([1.7e9, 0.394]));
        assert_eq!(unread.listed(), "“MP,DENS” (line 1)");
        let (all, _) = materials(&[
            "MPTEMP,R5.0, 1, 1,  0.00000000    ,",
            "MPDATA,R5.0, 1,EX  ,       2, 1,  1700000000.00    ,",
            "MPDATA,R5.0, 1,PRXY,       2, 1, 0.394000000    ,",
        ]);
        assert_eq!(all.elastic(2, &mut notes), Some([1.7e9, 0.394]));
        assert!(notes.is_empty(), "{notes:?}");
        assert_eq!(all.elastic(1, &mut notes), None);
        assert!(notes[0].contains("MP,EX"), "{notes:?}");
    }

    #[test]
    fn tables_are_read_at_the_temperature_of_the_part() {
        let table = [
            "MPTEMP",
            "MPTEMP,1,0,100,200",
            "MPDATA,EX,1,1,3e9,2e9,1e9",
            "MPDATA,PRXY,1,1,0.3,0.4,0.4",
        ];
        for (reference, modulus) in [("-40", 3e9), ("50", 2.5e9), ("100", 2e9), ("900", 1e9)] {
            let tref = format!("TREF,{reference}");
            let lines: Vec<&str> = table.iter().copied().chain([tref.as_str()]).collect();
            let (all, _) = materials(&lines);
            let mut notes = Vec::new();
            let found = all.elastic(1, &mut notes).unwrap();
            assert_eq!(found[0], modulus, "{reference}");
            assert!(notes[0].contains("table"), "{notes:?}");
        }
    }

    #[test]
    fn what_is_not_isotropic_is_not_taken() {
        let mut notes = Vec::new();
        let (all, _) = materials(&["MP,EX,1,2e9", "MP,EY,1,3e9", "MP,EX,2,2e9", "MP,EY,2,2e9"]);
        assert_eq!(all.elastic(1, &mut notes), None);
        assert_eq!(all.elastic(2, &mut notes), Some([2e9, 0.3]));
        assert_eq!(notes.len(), 2, "{notes:?}");
    }
}
