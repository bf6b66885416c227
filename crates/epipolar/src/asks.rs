//! The pixels that ask one slice, column by column, and what they are told.

/// Pixels that ask, column by column, and what they are told.
#[derive(Debug, Default)]
pub struct Asks {
    /// Columns with pixels, each with the first of its pixels; one more behind the last.
    pub columns: Vec<AskColumn>,
    pub column_count: usize,
    /// Where the pixels' rays end.
    pub ends: Vec<f32>,
    pub count: usize,
    /// The light ray in which each ends, and the run that holds it.
    pub gammas: Vec<f32>,
    pub runs: Vec<u32>,
    /// Share of the unoccluded light that the slice finds, per channel.
    pub shares: [Vec<f32>; 3],
}

/// A column of which pixels ask.
#[derive(Debug, Clone, Copy, Default)]
pub struct AskColumn {
    /// From the first of the slice's.
    pub column: u32,
    /// Its first pixel.
    pub first: u32,
}

impl Asks {
    /// Forgets all pixels; room for `capacity` of them in `columns` columns.
    pub fn clear(&mut self, columns: usize, capacity: usize) {
        (self.count, self.column_count) = (0, 0);
        if self.columns.len() < columns + 1 {
            self.columns.resize(columns + 1, AskColumn::default());
        }
        if self.ends.len() < capacity {
            self.runs.resize(capacity, 0);
            for buffer in [&mut self.ends, &mut self.gammas].into_iter().chain(&mut self.shares) {
                buffer.resize(capacity, 0.0);
            }
        }
    }

    /// The pixels that are pushed next belong to a column, behind the one before.
    #[inline(always)]
    pub fn begin(&mut self, column: u32) {
        self.columns[self.column_count] = AskColumn { column, first: self.count as u32 };
        self.column_count += 1;
    }

    /// Adds a pixel whose ray ends at `end`.
    #[inline(always)]
    pub fn push(&mut self, end: f32) {
        self.ends[self.count] = end;
        self.count += 1;
    }

    /// Marks the end of the last column.
    pub fn finish(&mut self) {
        self.columns[self.column_count].first = self.count as u32;
    }

    /// A column and its pixels.
    #[inline(always)]
    pub fn column(&self, index: usize) -> (usize, std::ops::Range<usize>) {
        let [this, next] = [self.columns[index], self.columns[index + 1]];
        (this.column as usize, this.first as usize..next.first as usize)
    }

    /// The pixels of some columns that follow each other, one at least.
    #[inline(always)]
    pub fn pixels(&self, columns: &std::ops::Range<usize>) -> std::ops::Range<usize> {
        self.columns[columns.start].first as usize..self.columns[columns.end].first as usize
    }

    /// The answers, per channel.
    pub fn shares(&self, channel: usize) -> &[f32] {
        &self.shares[channel][..self.count]
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * (2 * self.columns.capacity() + 6 * self.ends.capacity())
    }
}
