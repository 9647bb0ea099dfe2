//! Which pictures are made, and where in the scene's animation each of them is.

use crate::console::Verbosity;
use crate::failure::Failure;
use crate::options::ViewOptions;
use hither::{Scene, SceneIndex};

/// Pictures to make, in order; at least one.
#[derive(Clone, Debug)]
pub struct Timeline {
    /// Number and time of each, seconds; `None`: as the scene is stored.
    pub frames: Vec<(u32, Option<f64>)>,
    /// Whether their numbers go into file names.
    pub numbered: bool,
    animation: Option<usize>,
}

impl Timeline {
    /// What the options ask for of `scene`, called `source`.
    pub fn choose(
        scene: &Scene,
        source: &str,
        options: &ViewOptions,
        verbosity: Verbosity,
    ) -> Result<Timeline, Failure> {
        let moves = options.time.is_some() || options.frames.is_some();
        let animation = match &options.animation {
            Some(name) => Some(find(scene, source, name)?),
            None => (!scene.animations.is_empty()).then_some(0),
        };
        if moves && animation.is_none() {
            verbosity.warning(&format!("{source}: the scene has no animation; it stands still"));
        }
        let frames = match &options.frames {
            Some(range) => range.clone().map(|f| (f, Some(f64::from(f) / options.fps))).collect(),
            // An animation that is asked for by name shows its beginning.
            None if options.animation.is_some() => vec![(0, Some(options.time.unwrap_or(0.0)))],
            None => vec![(0, options.time)],
        };
        Ok(Timeline { frames, numbered: options.frames.is_some(), animation })
    }

    /// Poses an index for one of the frames.
    pub fn pose(&self, index: &mut SceneIndex, time: Option<f64>) {
        if let (Some(animation), Some(time)) = (self.animation, time) {
            index.pose(animation, time);
        }
    }

    /// Poses a scene that is not indexed yet for the first frame.
    pub fn pose_first(&self, scene: &mut Scene) {
        if let (Some(animation), Some((_, Some(time)))) = (self.animation, self.frames.first()) {
            scene.pose(animation, *time);
        }
    }
}

fn find(scene: &Scene, source: &str, name: &str) -> Result<usize, Failure> {
    let by_name = scene.animations.iter().position(|a| a.name == name);
    let by_index = || name.parse().ok().filter(|&i: &usize| i < scene.animations.len());
    by_name.or_else(by_index).ok_or_else(|| {
        let names = scene.animations.iter().enumerate().map(|(i, a)| format!("{i} \"{}\"", a.name));
        let known = names.take(8).collect::<Vec<_>>().join(", ");
        let remedy =
            if known.is_empty() { "the scene has none".into() } else { format!("there are {known}") };
        Failure::work(format!("{source}: no animation \"{name}\"; {remedy}"))
    })
}
