//! Text in aligned columns.

/// Which side a column's cells lean to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lean {
    Left,
    Right,
}

/// Rows of cells under a head; widths follow the content.
#[derive(Clone, Debug)]
pub struct Table {
    head: Vec<String>,
    lean: Vec<Lean>,
    rows: Vec<Vec<String>>,
}

impl Table {
    pub fn new(columns: &[(&str, Lean)]) -> Table {
        Table {
            head: columns.iter().map(|column| column.0.to_string()).collect(),
            lean: columns.iter().map(|column| column.1).collect(),
            rows: Vec::new(),
        }
    }

    pub fn row(&mut self, cells: Vec<String>) {
        self.rows.push(cells);
    }

    /// The lines, indented, columns two spaces apart; columns without any content are left out.
    pub fn lines(&self, indent: usize) -> Vec<String> {
        let filled = |column: usize| self.rows.iter().any(|row| row.get(column).is_some_and(|cell| !cell.is_empty()));
        let columns: Vec<usize> = (0..self.head.len()).filter(|column| filled(*column)).collect();
        let width = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column)).chain([&self.head[column]]);
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = columns.iter().map(|column| width(*column)).collect();
        let line = |cells: &[String]| {
            let mut text = " ".repeat(indent);
            for (column, width) in columns.iter().zip(&widths) {
                let cell = cells.get(*column).map_or("", String::as_str);
                match self.lean[*column] {
                    Lean::Left => text.push_str(&format!("{cell:<width$}  ")),
                    Lean::Right => text.push_str(&format!("{cell:>width$}  ")),
                }
            }
            text.trim_end().to_string()
        };
        let head = self.head.iter().any(|cell| !cell.is_empty()).then(|| line(&self.head));
        head.into_iter().chain(self.rows.iter().map(|row| line(row))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_aligned_and_empty_ones_left_out() {
        let mut table = Table::new(&[("name", Lean::Left), ("value", Lean::Right), ("remark", Lean::Left)]);
        table.row(vec!["mass".into(), "95.1".into(), String::new()]);
        table.row(vec!["f".into(), "203".into(), String::new()]);
        assert_eq!(table.lines(2), ["  name  value", "  mass   95.1", "  f       203"]);
    }
}
