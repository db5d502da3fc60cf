//! Structure of a sparse matrix.

/// Compressed sparse columns: rows of column j are `rows[starts[j]..starts[j + 1]]`, ascending.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SparsityPattern {
    pub row_count: usize,
    pub column_count: usize,
    /// Length `column_count + 1`.
    pub starts: Vec<usize>,
    pub rows: Vec<usize>,
}

impl SparsityPattern {
    /// From (row, column) pairs in any order; repeated pairs count once.
    pub fn from_entries(row_count: usize, column_count: usize, entries: &[(usize, usize)]) -> Self {
        let mut columns = vec![Vec::new(); column_count];
        for &(row, column) in entries {
            columns[column].push(row);
        }
        let mut starts = vec![0];
        let mut rows = Vec::new();
        for mut column in columns {
            column.sort_unstable();
            column.dedup();
            rows.extend(column);
            starts.push(rows.len());
        }
        Self { row_count, column_count, starts, rows }
    }

    /// (row, column) of every entry, in the order of the values.
    pub fn entries(&self) -> impl Iterator<Item = (usize, usize)> {
        let column_of = self.starts.windows(2).enumerate().flat_map(|(j, w)| std::iter::repeat_n(j, w[1] - w[0]));
        self.rows.iter().copied().zip(column_of)
    }

    pub fn len(&self) -> usize {
        self.rows.len()
    }

    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
}
