//! Rows and asks of many slices as flat arrays: tasks of at most [`COLUMNS`] columns, asks sorted by chunks of runs.

use bytemuck::{Pod, Zeroable};

/// Runs that a workgroup holds at once: `CHUNK` of the shaders.
pub const CHUNK: u32 = 128;

/// Most columns of a task: its sums fit the 16,384 bytes of workgroup memory that WebGPU guarantees.
pub const COLUMNS: u32 = 640;

/// A workgroup's share of a slice; the mirror of `Task` in `in_slice.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct Task {
    /// The row's first run in `lit_columns`.
    pub first_run: u32,
    /// How many, ≥ 1.
    pub run_count: u32,
    /// The row's first prefix: one more than runs.
    pub first_prefix: u32,
    /// The task's first chunk in `chunk_starts`: one more than chunks.
    pub first_chunk: u32,
    /// The first column, counted from the light.
    pub first_column: u32,
    /// How many, 1 to [`COLUMNS`].
    pub column_count: u32,
    /// The task's first ask.
    pub first_ask: u32,
    /// How many.
    pub ask_count: u32,
}

/// A view ray that asks what it sees lit; the mirror of `Ask`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct Ask {
    /// Its column, counted from the task's first.
    pub rank: u32,
    /// The run in which its ray ends.
    pub run: u32,
    /// Where its answer goes.
    pub answer: u32,
    /// Unused.
    pub padding: u32,
    /// The prefix up to its end: between those of the run's start and end.
    pub end: [i32; 4],
}

/// Everything that the two passes read. Buffers are reused.
#[derive(Debug, Clone, Default)]
pub struct InSlice {
    /// A workgroup each.
    pub tasks: Vec<Task>,
    /// Columns that see each run lit, counted from the light, row after row.
    pub lit_columns: Vec<u32>,
    /// Prefixes of each row: at each run's start, and at the last one's end.
    pub prefixes: Vec<[i32; 4]>,
    /// Task after task, sorted by chunks.
    pub asks: Vec<Ask>,
    /// The first ask of each chunk of each task, and the one after the last.
    pub chunk_starts: Vec<u32>,
}

impl InSlice {
    /// Forgets all slices, and keeps the memory.
    pub fn clear(&mut self) {
        self.tasks.clear();
        self.lit_columns.clear();
        self.prefixes.clear();
        self.asks.clear();
        self.chunk_starts.clear();
    }

    /// Adds a slice: a row of runs, at least one, with one prefix more, and its rays as (column, run, prefix at the end).
    /// Answers have the order of `rays` behind those of earlier slices. O(rays · (tasks + chunks)).
    pub fn push(&mut self, lit_columns: &[u32], prefixes: &[[i32; 4]], rays: &[(u32, u32, [i32; 4])]) {
        debug_assert!(!lit_columns.is_empty() && prefixes.len() == lit_columns.len() + 1, "a row has runs");
        debug_assert!(
            rays.iter().all(|&(_, run, _)| (run as usize) < lit_columns.len()),
            "a ray ends in a run"
        );
        let (first_run, first_prefix) = (self.lit_columns.len() as u32, self.prefixes.len() as u32);
        let first_answer = self.asks.len() as u32;
        self.lit_columns.extend_from_slice(lit_columns);
        self.prefixes.extend_from_slice(prefixes);
        let columns = rays.iter().map(|&(column, ..)| column + 1).max().unwrap_or(0);
        for first_column in (0..columns).step_by(COLUMNS as usize) {
            let column_count = COLUMNS.min(columns - first_column);
            let mine = |column: u32| (first_column..first_column + column_count).contains(&column);
            let Some(last_run) = rays.iter().filter(|ray| mine(ray.0)).map(|ray| ray.1).max() else {
                continue;
            };
            let (first_ask, first_chunk) = (self.asks.len() as u32, self.chunk_starts.len() as u32);
            for chunk in 0..=last_run / CHUNK {
                self.chunk_starts.push(self.asks.len() as u32);
                let asked = rays.iter().enumerate().filter(|(_, ray)| mine(ray.0) && ray.1 / CHUNK == chunk);
                self.asks.extend(asked.map(|(index, &(column, run, end))| Ask {
                    rank: column - first_column,
                    run,
                    answer: first_answer + index as u32,
                    padding: 0,
                    end,
                }));
            }
            self.chunk_starts.push(self.asks.len() as u32);
            self.tasks.push(Task {
                first_run,
                run_count: last_run + 1,
                first_prefix,
                first_chunk,
                first_column,
                column_count,
                first_ask,
                ask_count: self.asks.len() as u32 - first_ask,
            });
        }
    }

    /// Bytes that the passes read and write: tasks, runs, prefixes, asks, chunks, answers.
    pub fn bytes(&self) -> u64 {
        let count = |n: usize, bytes: usize| (n * bytes) as u64;
        count(self.tasks.len(), size_of::<Task>())
            + count(self.lit_columns.len() + self.chunk_starts.len(), 4)
            + count(self.prefixes.len() + self.asks.len(), 16)
            + count(self.asks.len(), size_of::<Ask>())
    }

    /// Atomic additions of the sweep at most: eight a run and task.
    pub fn atomics(&self) -> u64 {
        self.tasks.iter().map(|task| 8 * u64::from(task.run_count)).sum()
    }
}
