//! Pictures of what is visible: ids and depth by the hierarchical z-buffer, shading afterwards.

mod blend;
mod coherence;
mod frame;
mod queue;
mod shade;
mod walk;
mod windows;

pub use blend::{BlendedTriangles, Fragment};
pub use coherence::Coherence;
pub use frame::{Complexity, Counters, Frame};
pub(crate) use shade::Window;
pub use shade::{
    COMPLEXITY_WHITE, ComplexityPanel, Image, Shader, Shading, complexity_image, complexity_panels, shade,
};

use crate::conventions::{View, ViewError};
use crate::index::SceneIndex;
use crate::raster::{TILE, Target};
use fearless_simd::Level;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::Mutex;
use windows::Shares;

/// How visibility is found. The pictures are the same to the last bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Algorithm {
    /// Hierarchical z-buffer [Greene 1995, ch. 3].
    #[default]
    Hzb,
    /// Plain z-buffer: every triangle in the view frustum is drawn.
    ZBuffer,
}

/// What the hierarchical z-buffer asks of a box before it opens it. The pictures are the same to the last bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BoxTest {
    /// Whether its rectangle on the screen is hidden at its nearest depth: "fast" [Greene 1995, §3.3.2].
    #[default]
    Rectangle,
    /// Of what that leaves, also whether its outline is: "definitive". It opens 1 to 2 % fewer boxes and, with
    /// sixteen of them tested at a time before, costs more than it saves.
    Definitive,
}

/// What may be chosen about a rendering.
#[derive(Clone, Copy, Debug)]
pub struct RenderOptions {
    /// How visibility is found.
    pub algorithm: Algorithm,
    /// What is asked of a box.
    pub box_test: BoxTest,
    /// Worker threads; 0 means one for each core.
    pub threads: usize,
    /// Start from what was visible in this renderer's last frame [Greene 1995, §3.3.3].
    pub coherence: Coherence,
    /// Also record where the work was done ([`Complexity`]); slower.
    pub complexity: bool,
    /// Width of the windows the image is cut into, pixels, a multiple of 16; 0 chooses it from `threads`.
    pub window_width: u32,
    /// Instruction set; the best that the machine has by default.
    pub level: Level,
}

impl Default for RenderOptions {
    fn default() -> Self {
        RenderOptions {
            algorithm: Algorithm::Hzb,
            box_test: BoxTest::Rectangle,
            threads: 1,
            coherence: Coherence::Never,
            complexity: false,
            window_width: 0,
            level: Level::new(),
        }
    }
}

/// Draws frames and keeps what is worth keeping between them: buffers, workers, and what was visible last.
#[derive(Debug, Default)]
pub struct Renderer {
    spare: Vec<Target>,
    /// All but the thread that asks for a frame: starting them takes as long as drawing a small one.
    workers: Option<ThreadPool>,
    memories: Vec<walk::Memory>,
    shares: Shares,
    /// Which index and which windows `memories` speak of.
    remembered: (u64, Vec<u32>),
}

impl Renderer {
    /// A renderer that remembers nothing yet.
    pub fn new() -> Renderer {
        Renderer::default()
    }

    /// Draws one frame. Give it back with [`Renderer::recycle`] to save the next one its allocations.
    pub fn render(
        &mut self,
        index: &SceneIndex,
        view: &View,
        options: &RenderOptions,
    ) -> Result<Frame, ViewError> {
        view.validate()?;
        let threads = match options.threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            n => n,
        };
        let columns = match options.window_width {
            0 => self.shares.columns(view.width, threads),
            width => windows::equal(view.width, width.next_multiple_of(TILE)),
        };
        let mut windows = self.take_windows(view, &columns);
        for window in &mut windows {
            window.record_visits(options.complexity);
        }
        self.prepare_workers(threads);
        let draw = |(window, memory, done): Work| {
            let how = (options.algorithm, options.box_test);
            *done = walk::draw_window(options.level, index, view, how, window, memory);
        };
        let plain = options.algorithm == Algorithm::ZBuffer;
        self.prepare_memories(if plain { Coherence::Never } else { options.coherence }, index, &columns);
        let memories = self.memories.iter_mut().map(Some).chain(std::iter::repeat_with(|| None));
        let mut done = vec![Counters::default(); windows.len()];
        let work = windows.iter_mut().zip(memories).zip(&mut done);
        let work = work.map(|((window, memory), done)| (window, memory, done));
        match &self.workers {
            Some(workers) => in_parallel(workers, work, draw),
            None => work.for_each(draw),
        }
        self.shares.learn(view.width, threads, &columns, &done);
        let mut counters = Counters::default();
        done.into_iter().for_each(|of_window| counters += of_window);
        let mut frame = Frame { view: *view, counters, complexity: None, windows, columns };
        if options.complexity {
            frame.gather_complexity();
        }
        Ok(frame)
    }

    /// Takes a frame's buffers back for the next one.
    pub fn recycle(&mut self, frame: Frame) {
        self.spare = frame.windows;
    }

    /// As many workers as `threads` needs beside the one that asks; none where the system gives none.
    fn prepare_workers(&mut self, threads: usize) {
        if self.workers.as_ref().map_or(1, |w| w.current_num_threads() + 1) != threads {
            self.workers = match threads {
                1 => None,
                n => ThreadPoolBuilder::new().num_threads(n - 1).build().ok(),
            };
        }
    }

    /// One memory a window if the frame may be coherent, none otherwise.
    fn prepare_memories(&mut self, coherence: Coherence, index: &SceneIndex, columns: &[u32]) {
        if coherence == Coherence::Never {
            self.memories.clear();
            return;
        }
        if self.memories.len() != columns.len()
            || self.remembered.0 != index.serial
            || self.remembered.1 != columns
        {
            self.memories.clear();
            self.memories.resize_with(columns.len(), walk::Memory::default);
            self.remembered = (index.serial, columns.to_vec());
        }
        for memory in &mut self.memories {
            memory.always = coherence == Coherence::Always;
        }
    }

    fn take_windows(&mut self, view: &View, columns: &[u32]) -> Vec<Target> {
        let ends = columns.iter().skip(1).copied().chain([view.width]);
        let wanted = || columns.iter().zip(ends.clone()).map(|(&from, to)| (from, to - from));
        let mut windows = std::mem::take(&mut self.spare);
        windows.truncate(columns.len());
        for (window, (left, width)) in windows.iter_mut().zip(wanted()) {
            window.reshape(left, 0, width, view.height);
        }
        let more = wanted().skip(windows.len());
        windows.extend(more.map(|(left, width)| Target::new(left, 0, width, view.height)));
        windows
    }
}

/// Draws one frame from scratch.
pub fn render(index: &SceneIndex, view: &View, options: &RenderOptions) -> Result<Frame, ViewError> {
    Renderer::new().render(index, view, options)
}

/// A window to be drawn, what it showed last time, and what is done for it.
type Work<'a> = (&'a mut Target, Option<&'a mut walk::Memory>, &'a mut Counters);

/// All workers, and this thread with them, take the next window until none is left.
fn in_parallel<'a>(
    workers: &ThreadPool,
    work: impl Iterator<Item = Work<'a>> + Send,
    draw: impl Fn(Work) + Sync,
) {
    let queue = Mutex::new(work);
    let take = || queue.lock().expect("no worker panics while it holds the lock").next();
    let work = || {
        while let Some(window) = take() {
            draw(window);
        }
    };
    workers.in_place_scope(|scope| {
        for _ in 0..workers.current_num_threads() {
            scope.spawn(|_| work());
        }
        work();
    });
}
