//! Which pictures are made, and where in the scene's animation each of them is.

use crate::console::Verbosity;
use crate::failure::Failure;
use crate::options::ViewOptions;
use hither::{Scene, SceneIndex};
use std::ops::Range;

/// Pictures to make, in order; at least one.
#[derive(Clone, Debug)]
pub struct Timeline {
    /// Their numbers.
    pub frames: Range<u32>,
    /// Whether their numbers go into file names.
    pub numbered: bool,
    clock: Clock,
    animation: Option<usize>,
    source: String,
}

/// When a picture is.
#[derive(Clone, Copy, Debug)]
enum Clock {
    /// The scene stays as it is stored.
    Stopped,
    /// At this time, seconds.
    At(f64),
    /// At the picture's number divided by this rate, pictures a second.
    Rate(f64),
}

impl Timeline {
    /// What the options ask for of `scene`, called `source`.
    pub fn choose(
        scene: &Scene,
        source: &str,
        options: &ViewOptions,
        verbosity: Verbosity,
    ) -> Result<Timeline, Failure> {
        let animation = match &options.animation {
            Some(name) => Some(find(scene, source, name)?),
            None => (!scene.animations.is_empty()).then_some(0),
        };
        let clock = match (&options.frames, options.time, &options.animation) {
            (Some(_), ..) => Clock::Rate(options.fps),
            (None, Some(time), _) => Clock::At(time),
            // An animation that is asked for by name shows its beginning.
            (None, None, Some(_)) => Clock::At(0.0),
            (None, None, None) => Clock::Stopped,
        };
        if animation.is_none() && !matches!(clock, Clock::Stopped) {
            verbosity.warning(&format!("{source}: the scene has no animation; it stands still"));
        }
        let numbered = options.frames.is_some();
        let frames = options.frames.clone().unwrap_or(0..1);
        Ok(Timeline { frames, numbered, clock, animation, source: source.to_owned() })
    }

    /// Time of picture `frame` in the scene's animation, seconds; `None`: as the scene is stored.
    pub fn time(&self, frame: u32) -> Option<f64> {
        match self.clock {
            Clock::Stopped => None,
            Clock::At(time) => Some(time),
            Clock::Rate(rate) => Some(f64::from(frame) / rate),
        }
    }

    /// Poses an index for one of the pictures.
    pub fn pose(&self, index: &mut SceneIndex, frame: u32) -> Result<(), Failure> {
        if let (Some(animation), Some(time)) = (self.animation, self.time(frame)) {
            index.pose(animation, time);
            self.check_places(index.scene(), time)?;
        }
        Ok(())
    }

    /// Poses a scene that is not indexed yet for the first picture.
    pub fn pose_first(&self, scene: &mut Scene) -> Result<(), Failure> {
        self.pose_scene(scene, self.frames.start)
    }

    /// Poses a scene that is not indexed for one of the pictures.
    pub fn pose_scene(&self, scene: &mut Scene, frame: u32) -> Result<(), Failure> {
        if let (Some(animation), Some(time)) = (self.animation, self.time(frame)) {
            scene.pose(animation, time);
            self.check_places(scene, time)?;
        }
        Ok(())
    }

    /// Refuses places that are beyond all numbers, which scales on the way there can lead to.
    fn check_places(&self, scene: &Scene, time: f64) -> Result<(), Failure> {
        let group = scene.root_group();
        let Some(lost) = group.world_transforms().iter().position(|w| !w.is_finite()) else { return Ok(()) };
        Err(Failure::work(format!(
            "{}: node {lost} \"{}\": at {time} s its place in the world is not a finite number; choose another time",
            self.source, group.nodes[lost].name
        )))
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
