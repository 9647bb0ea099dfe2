//! Pictures of what is visible: ids and depth by the hierarchical z-buffer, shading afterwards.

mod blend;
mod frame;
mod shade;

pub use blend::{BlendedTriangles, Fragment};
pub use frame::{Complexity, Counters, Frame};
pub use shade::{
    COMPLEXITY_WHITE, ComplexityPanel, Image, Shader, Shading, complexity_image, complexity_panels, shade,
};

use crate::conventions::{View, ViewError};
use crate::index::SceneIndex;

/// How visibility is found. The pictures are the same to the last bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Algorithm {
    /// Hierarchical z-buffer [Greene 1995, ch. 3].
    #[default]
    Hzb,
    /// Plain z-buffer: every triangle in the view frustum is drawn.
    ZBuffer,
}

/// What may be chosen about a rendering.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RenderOptions {
    /// How visibility is found.
    pub algorithm: Algorithm,
    /// Worker threads; 0 means one for each core.
    pub threads: usize,
    /// Start from what was visible in this renderer's last frame [Greene 1995, §3.3.3].
    pub coherence: bool,
    /// Also record where the work was done ([`Complexity`]); slower.
    pub complexity: bool,
}

impl Default for RenderOptions {
    fn default() -> Self {
        RenderOptions { algorithm: Algorithm::Hzb, threads: 1, coherence: false, complexity: false }
    }
}

/// Draws frames and keeps what is worth keeping between them: buffers, and what was visible last.
#[derive(Debug, Default)]
pub struct Renderer {}

impl Renderer {
    /// A renderer that remembers nothing yet.
    pub fn new() -> Renderer {
        Renderer::default()
    }

    /// Draws one frame.
    pub fn render(
        &mut self,
        _index: &SceneIndex,
        view: &View,
        _options: &RenderOptions,
    ) -> Result<Frame, ViewError> {
        view.validate()?;
        Ok(Frame::empty(*view))
    }
}

/// Draws one frame from scratch.
pub fn render(index: &SceneIndex, view: &View, options: &RenderOptions) -> Result<Frame, ViewError> {
    Renderer::new().render(index, view, options)
}
