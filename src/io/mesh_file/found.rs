//! What a deck says of its part beside the mesh. It is offered to a project that leaves it out; a key that is given
//! comes first.

use crate::elasticity::Material;
use crate::plain::{self, quote};
use crate::project::{Masks, MaterialKeys, PartModel, Project, SupportKeys, Unit};

/// A pound-force on a square inch (Pa).
const PSI: f64 = 6_894.757_293_168;

/// A system of units that a file names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitSystem {
    pub length: Unit,
    /// Pa.
    pub stress: f64,
    /// Line that says so.
    pub line: usize,
}

impl UnitSystem {
    /// The system by the name that Ansys has for it.
    #[must_use]
    pub fn of_ansys(name: &str, line: usize) -> Option<Self> {
        let (length, stress) = match name.to_uppercase().as_str() {
            "SI" | "MKS" | "M" => (Unit::Metre, 1.0),
            "CGS" => (Unit::Centimetre, 0.1),
            "MPA" | "NMM" | "NMMTON" | "NMMDAT" | "MM" => (Unit::Millimetre, 1e6),
            "BIN" | "IN" => (Unit::Inch, PSI),
            _ => return None,
        };
        Some(Self {
            length,
            stress,
            line,
        })
    }
}

/// What a deck says, in its own units.
#[derive(Default)]
pub struct DeckSaid {
    pub system: Option<UnitSystem>,
    /// Young's modulus and Poisson's ratio.
    pub material: Option<[f64; 2]>,
    /// Of a shell.
    pub thickness: Option<f64>,
    /// On masks of the mesh.
    pub supports: Vec<SupportKeys>,
}

impl DeckSaid {
    /// The unit of stress (Pa) where lengths are in one of `scale` metres: the file's own, or that of newtons, or
    /// pounds, on its square.
    fn stress(&self, scale: f64) -> f64 {
        match self.system {
            Some(system) if system.length.metres() == scale => system.stress,
            _ if scale == Unit::Inch.metres() => PSI,
            _ => (1.0 / scale) * (1.0 / scale),
        }
    }

    fn material(&self, scale: f64, notes: &mut Vec<String>) -> Option<MaterialKeys> {
        /// Softer than rubber, and stiffer than diamond (Pa).
        const PLAUSIBLE: std::ops::RangeInclusive<f64> = 1e5..=2e12;
        let [modulus, poissons_ratio] = self.material?;
        let youngs_modulus = modulus * self.stress(scale);
        let material = Material {
            youngs_modulus,
            poissons_ratio,
        };
        let gpa = youngs_modulus / 1e9;
        if material.check().is_err() || !(1e-9..=1e6).contains(&gpa) {
            notes.push(format!(
                "the file's material is none (Young's modulus {gpa:e} GPa, Poisson's ratio {poissons_ratio}): it is not taken"
            ));
            return None;
        }
        if !PLAUSIBLE.contains(&youngs_modulus) {
            notes.push(format!(
                "the file's Young's modulus is {gpa:e} GPa in these units, which no material of parts has: its lengths or its stresses are in other units"
            ));
        }
        Some(MaterialKeys {
            youngs_modulus_gpa: gpa,
            poissons_ratio,
        })
    }

    /// The same in the units of a project. What holds no vertex of the part is noted.
    pub(super) fn found(
        self,
        scale: f64,
        masks: &Masks,
        solid: bool,
        notes: &mut Vec<String>,
    ) -> FoundDeck {
        let material = self.material(scale, notes);
        let (supports, lost): (Vec<_>, Vec<_>) = self.supports.into_iter().partition(|s| {
            let named = s.vertices.as_ref();
            named.is_some_and(|name| masks.contains_key(name))
        });
        if !lost.is_empty() {
            notes.push(format!(
                "left out, as no node of the part's surface is held by it: {} of the file",
                plain::count(lost.len(), "support")
            ));
        }
        FoundDeck {
            unit: self.system.map(|system| system.length),
            material,
            model: solid.then_some(PartModel::Solid),
            thickness_mm: self.thickness.map(|t| t * scale * 1e3),
            supports,
        }
    }
}

/// What a deck says, in the terms of a project.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FoundDeck {
    /// Of its lengths.
    pub unit: Option<Unit>,
    pub material: Option<MaterialKeys>,
    pub model: Option<PartModel>,
    /// Of a shell.
    pub thickness_mm: Option<f64>,
    /// On groups of the mesh.
    pub supports: Vec<SupportKeys>,
}

impl FoundDeck {
    /// Answers the keys that a project leaves out (`is_given` knows the others, as `table.key`); what was taken, as a
    /// sentence without a stop.
    pub fn answer(&self, project: &mut Project, is_given: impl Fn(&str) -> bool) -> Option<String> {
        if let Some(model) = self.model
            && !is_given("part.model")
        {
            project.part.model = model;
        }
        let mut taken = Vec::new();
        if let Some(unit) = self.unit
            && project.part.unit.is_none()
        {
            project.part.unit = Some(unit);
            taken.push(format!("the unit ({})", unit.name()));
        }
        if let Some(thickness) = self.thickness_mm
            && !is_given("part.thickness_mm")
        {
            project.part.thickness_mm = thickness;
            taken.push(format!("the thickness ({thickness} mm)"));
        }
        taken.extend(self.answer_material(project, &is_given));
        if project.supports.is_empty() && !self.supports.is_empty() {
            project.supports.clone_from(&self.supports);
            let names: Vec<String> = (self.supports.iter())
                .filter_map(|s| s.vertices.as_deref().map(quote))
                .collect();
            taken.push(format!("what is held ({})", names.join(", ")));
        }
        (!taken.is_empty()).then(|| format!("taken from the mesh file: {}", taken.join(", ")))
    }

    fn answer_material(
        &self,
        project: &mut Project,
        is_given: impl Fn(&str) -> bool,
    ) -> Option<String> {
        let own = self.material.as_ref()?;
        let mut taken = Vec::new();
        if !is_given("material.youngs_modulus_gpa") {
            project.material.youngs_modulus_gpa = own.youngs_modulus_gpa;
            taken.push(format!("{} GPa", own.youngs_modulus_gpa));
        }
        if !is_given("material.poissons_ratio") {
            project.material.poissons_ratio = own.poissons_ratio;
            taken.push(format!("Poisson's ratio {}", own.poissons_ratio));
        }
        (!taken.is_empty()).then(|| format!("the material ({})", taken.join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stresses_follow_lengths() {
        let said = |system| DeckSaid {
            system,
            material: Some([1700.0, 0.4]),
            ..DeckSaid::default()
        };
        let gpa = |said: DeckSaid, unit: Unit| {
            let mut notes = Vec::new();
            let found = said.material(unit.metres(), &mut notes).unwrap();
            (found.youngs_modulus_gpa, notes.len())
        };
        let si = UnitSystem::of_ansys("mks", 3);
        assert_eq!(gpa(said(None), Unit::Millimetre), (1.7, 0));
        assert_eq!(
            gpa(said(UnitSystem::of_ansys("NMM", 1)), Unit::Millimetre),
            (1.7, 0)
        );
        // Megapascals in a file that says pascals.
        assert_eq!(gpa(said(si), Unit::Metre), (1.7e-6, 1));
        assert!(UnitSystem::of_ansys("BFT", 1).is_none());
    }

    #[test]
    fn a_given_key_comes_first() {
        let found = FoundDeck {
            unit: Some(Unit::Metre),
            material: Some(MaterialKeys {
                youngs_modulus_gpa: 3.0,
                poissons_ratio: 0.4,
            }),
            model: Some(PartModel::Solid),
            ..FoundDeck::default()
        };
        let mut project = Project::around("part.dat", Some(Unit::Centimetre));
        let said = found.answer(&mut project, |key| key == "material.youngs_modulus_gpa");
        assert_eq!(project.part.unit, Some(Unit::Centimetre));
        assert_eq!(project.part.model, PartModel::Solid);
        assert_eq!(project.material.youngs_modulus_gpa, 1.7);
        assert_eq!(project.material.poissons_ratio, 0.4);
        assert!(said.unwrap().contains("0.4"));
        assert_eq!(FoundDeck::default().answer(&mut project, |_| false), None);
    }
}
