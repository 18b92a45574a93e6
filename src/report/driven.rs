//! What drives the axis, in the words and units of the record: a force along a linear axis, and a current where no torque constant is
//! given. The findings are of a torque in N.m, as the model is; here a report is converted to the quantity that the user logged.

use serde_json::Value;

use super::{Block, Cell, Drawing, Figure, Report, Table};
use crate::trace::AxisKind;

/// What a record calls the torque.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Driven {
    /// Rotary or linear: a torque or a force.
    pub motion: AxisKind,
    /// Unit that stands for N.m (or N) one to one, where the log is of a current, a voltage or a percentage.
    pub unit: Option<String>,
}

impl Driven {
    /// The blocks in these words.
    #[must_use]
    pub fn blocks(&self, mut blocks: Vec<Block>) -> Vec<Block> {
        if self.motion == AxisKind::Linear || self.unit.is_some() {
            blocks.iter_mut().for_each(|b| self.block(b));
        }
        blocks
    }

    /// The report in these words.
    #[must_use]
    pub fn report(&self, mut report: Report) -> Report {
        for section in &mut report.sections {
            self.text(&mut section.heading);
            section.blocks = self.blocks(std::mem::take(&mut section.blocks));
        }
        report
    }

    /// A result for programs, its units those of the log: keys and names are the contract's, and stay.
    #[must_use]
    pub fn units(&self, mut result: Value) -> Value {
        fn convert_units(driven: &Driven, value: &mut Value) {
            match value {
                Value::Object(fields) => {
                    for (key, field) in fields {
                        match field {
                            Value::String(unit) if key == "unit" => *unit = driven.convert(unit),
                            Value::String(unit) if key == "against_unit" => {
                                *unit = driven.convert(unit);
                                if driven.motion == AxisKind::Linear {
                                    *unit = unit.replacen("rad", "m", 1);
                                }
                            }
                            other => convert_units(driven, other),
                        }
                    }
                }
                Value::Array(all) => all.iter_mut().for_each(|v| convert_units(driven, v)),
                _ => {}
            }
        }
        if self.unit.is_some() || self.motion == AxisKind::Linear {
            convert_units(self, &mut result);
        }
        result
    }

    /// A sentence with the quantity and the units of the log.
    #[must_use]
    pub fn convert(&self, text: &str) -> String {
        let mut text = text.to_owned();
        if self.motion == AxisKind::Linear || self.unit.is_some() {
            self.text(&mut text);
        }
        text
    }

    fn block(&self, block: &mut Block) {
        match block {
            Block::Summary(v) => {
                self.text(&mut v.sentence);
                self.text(&mut v.detail);
                v.figures.iter_mut().for_each(|f| self.named(f));
            }
            Block::Paragraph(text) | Block::Warning(text) => self.text(text),
            Block::Steps(steps) => steps.iter_mut().for_each(|s| self.text(s)),
            Block::KeyValues(pairs) => pairs.iter_mut().for_each(|p| self.named(p)),
            Block::Table(table) => self.table(table),
            Block::Figure(figure) => self.figure(figure),
            Block::Figures(figures) => figures.iter_mut().for_each(|f| self.figure(f)),
            Block::Details(label, blocks) => {
                self.text(label);
                blocks.iter_mut().for_each(|b| self.block(b));
            }
        }
    }

    fn named(&self, (name, cell): &mut (String, Cell)) {
        self.text(name);
        self.cell(cell);
    }

    fn table(&self, table: &mut Table) {
        self.text(&mut table.caption);
        table.columns.iter_mut().for_each(|c| self.text(c));
        table.rows.iter_mut().flat_map(|r| &mut r.cells).for_each(|c| self.cell(c));
    }

    fn figure(&self, figure: &mut Figure) {
        self.text(&mut figure.caption);
        match &mut figure.drawing {
            Drawing::Chart(chart) => {
                self.text(&mut chart.title);
                for axis in [&mut chart.x, &mut chart.y] {
                    self.text(&mut axis.label);
                    self.text(&mut axis.unit);
                }
                chart.series.iter_mut().for_each(|s| self.text(&mut s.name));
            }
            Drawing::Polar(_) | Drawing::Chain(_) => {}
        }
    }

    fn cell(&self, cell: &mut Cell) {
        match cell {
            Cell::Text(text) | Cell::Number(_, _, text) | Cell::Estimate(_, _, text) => self.text(text),
            Cell::Empty | Cell::Link(..) | Cell::Count(_) | Cell::Percent(_) | Cell::Bar(_) => {}
        }
    }

    /// Word for word: names such as `load_motor.torque` and paths are words of their own, and stay.
    fn text(&self, text: &mut String) {
        let mut out = String::with_capacity(text.len());
        let mut rest = text.as_str();
        let of_a_word = |c: char| c.is_alphanumeric() || "._/·²³-`".contains(c);
        while !rest.is_empty() {
            let end = rest.find(|c| !of_a_word(c)).unwrap_or(rest.len());
            let (word, next) = rest.split_at(end);
            let stop = word.trim_end_matches('.').len();
            let (word, stops) = word.split_at(stop);
            match self.replacement(word) {
                Some(new) => out.push_str(&new),
                None => out.push_str(word),
            }
            out.push_str(stops);
            let between = next.find(of_a_word).unwrap_or(next.len());
            out.push_str(&next[..between]);
            rest = &next[between..];
        }
        *text = out;
    }

    /// The replacement of a word or a unit, where there is one.
    fn replacement(&self, word: &str) -> Option<String> {
        if self.motion == AxisKind::Linear {
            for (rotary, linear) in
                [("torque", "force"), ("torques", "forces"), ("Torque", "Force"), ("Torques", "Forces")]
            {
                if word == rotary {
                    return Some(linear.to_owned());
                }
            }
            if matches!(word, "N.m" | "N·m") {
                return Some(self.unit.clone().unwrap_or_else(|| "N".to_owned()));
            }
        }
        let unit = self.unit.as_deref()?;
        let typeset = word.contains(['·', '²', '³']);
        let plain = word.replace('·', ".").replace('²', "2").replace('³', "3");
        let new = match self.motion {
            AxisKind::Rotary if plain == "kg.m2" => format!("{unit}.s2/rad"),
            AxisKind::Rotary => {
                let per = plain.strip_prefix("N.m").filter(|p| p.is_empty() || p.starts_with(['.', '/']))?;
                format!("{unit}{per}")
            }
            AxisKind::Linear if plain == "kg" => format!("{unit}.s2/m"),
            AxisKind::Linear => {
                let per = plain.strip_prefix('N').filter(|p| p.is_empty() || p.starts_with(['.', '/']))?;
                format!("{unit}{per}")
            }
        };
        Some(if typeset { new.replace(".s", "·s").replace("s2", "s²") } else { new })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn converted(motion: AxisKind, unit: Option<&str>, text: &str) -> String {
        let driven = Driven { motion, unit: unit.map(str::to_owned) };
        match driven.blocks(vec![Block::Paragraph(text.to_owned())]).remove(0) {
            Block::Paragraph(text) => text,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_result_for_programs_has_the_units_of_the_log_and_the_names_of_the_contract() {
        let driven = Driven { motion: AxisKind::Rotary, unit: Some("A".into()) };
        let result = serde_json::json!({ "closure_of": "torque", "all": [{ "name": "K", "unit": "N.m/rad" }, { "unit": "rad/s" }] });
        let own = serde_json::json!({ "closure_of": "torque", "all": [{ "name": "K", "unit": "A/rad" }, { "unit": "rad/s" }] });
        assert_eq!(driven.units(result.clone()), own);
        assert_eq!(Driven { motion: AxisKind::Rotary, unit: None }.units(result.clone()), result);
        let linear = Driven { motion: AxisKind::Linear, unit: None };
        let curve = serde_json::json!({ "unit": "N.m", "against_unit": "rad/s" });
        assert_eq!(linear.units(curve), serde_json::json!({ "unit": "N", "against_unit": "m/s" }));
    }

    #[test]
    fn a_linear_axis_is_driven_by_a_force_and_names_of_parameters_stay() {
        assert_eq!(
            converted(
                AxisKind::Linear,
                None,
                "Torque: 3 N of torque; load_motor.torque, the torques. See torque.csv, `torque`."
            ),
            "Force: 3 N of force; load_motor.torque, the forces. See torque.csv, `torque`."
        );
        assert_eq!(converted(AxisKind::Rotary, None, "the torque in N.m"), "the torque in N.m");
    }

    #[test]
    fn a_current_without_a_torque_constant_keeps_its_unit() {
        let amperes = |text| converted(AxisKind::Rotary, Some("A"), text);
        assert_eq!(
            amperes("0.3 N.m, I1 [kg.m2], B [N·m·s/rad]; 2 N.m/rad."),
            "0.3 A, I1 [A.s2/rad], B [A·s/rad]; 2 A/rad."
        );
        assert_eq!(amperes("I2 [kg·m²] and K in N.m/rad3"), "I2 [A·s²/rad] and K in A/rad3");
        assert_eq!(converted(AxisKind::Linear, Some("V"), "95 kg, 2 N.s/m, 3 N"), "95 V.s2/m, 2 V.s/m, 3 V");
    }

    #[test]
    fn tables_figures_and_folded_blocks_are_reached() {
        let driven = Driven { motion: AxisKind::Linear, unit: Some("A".into()) };
        let mut table = Table::new("rms torque", ["mass [kg]"]);
        table.row(vec![Cell::Estimate(1.0, 0.1, "kg".into())]);
        let chart = super::super::Chart::new(
            "torque",
            super::super::Axis::linear("time", "s"),
            super::super::Axis::linear("torque", "N"),
        );
        let blocks = vec![Block::Details(
            "the torque".into(),
            vec![Block::Table(table), Block::figure(Figure::new(chart, "a torque"))],
        )];
        let text = format!("{:?}", driven.blocks(blocks));
        assert!(!text.contains("torque") && !text.contains("kg") && text.contains("A.s2/m"), "{text}");
    }
}
