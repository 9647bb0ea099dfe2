//! Reads `key=value&…` against the keys a world declares. Every mistake is one line that says what may
//! be written instead.

use hither::scene::Scene;
use std::fmt;

/// What is said about a world.
#[derive(Clone, Copy, Debug)]
pub struct WorldInfo {
    /// The name in a spec.
    pub name: &'static str,
    /// What there is to see, in a line.
    pub description: &'static str,
    /// The keys a spec may set.
    pub keys: &'static [KeyInfo],
    /// Generates it.
    pub(crate) make: fn(&Values) -> Scene,
}

/// A key that a spec may set to a number; a whole one unless its default is a [`KeyDefault::Fraction`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyInfo {
    /// The key's name.
    pub name: &'static str,
    /// What it changes, in a few words.
    pub description: &'static str,
    /// Smallest value.
    pub min: u64,
    /// Largest value.
    pub max: u64,
    /// The value where the key is left out.
    pub default: KeyDefault,
}

/// What a key is where a spec leaves it out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum KeyDefault {
    /// This number.
    Number(u64),
    /// This number, and the key takes fractions.
    Fraction(f64),
    /// The value of an earlier key.
    SameAs(&'static str),
}

/// Why a world cannot be generated.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WorldError {
    /// No world has that name.
    #[error("there is no world \"{name}\"; there are {known}")]
    UnknownWorld {
        /// The name that was asked for.
        name: String,
        /// The names there are.
        known: String,
    },
    /// The world has no such key.
    #[error("world {world} has no key \"{key}\"; {known}")]
    UnknownKey {
        /// The world.
        world: &'static str,
        /// The key that was set.
        key: String,
        /// The keys there are, with ranges and defaults.
        known: String,
    },
    /// The value is no such number, out of range, missing or given twice.
    #[error("world {world}: {key}={value} {fault}; {key} is {kind} from {min} to {max}")]
    BadValue {
        /// The world.
        world: &'static str,
        /// The key.
        key: &'static str,
        /// What was written.
        value: String,
        /// What is wrong with it.
        fault: &'static str,
        /// What it should be.
        kind: &'static str,
        /// Smallest value.
        min: u64,
        /// Largest value.
        max: u64,
    },
}

impl KeyInfo {
    fn takes_fractions(&self) -> bool {
        matches!(self.default, KeyDefault::Fraction(_))
    }

    /// What may be written for it.
    fn kind(&self) -> &'static str {
        if self.takes_fractions() { "a number" } else { "a whole number" }
    }

    fn read(&self, text: &str) -> Option<f64> {
        match self.takes_fractions() {
            true => text.parse().ok().filter(|number: &f64| !number.is_nan()),
            false => text.parse().ok().map(|number: u64| number as f64),
        }
    }
}

impl fmt::Display for KeyInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let any = if self.takes_fractions() { "any number from " } else { "" };
        write!(f, "{} ({any}{} to {}, default ", self.name, self.min, self.max)?;
        match self.default {
            KeyDefault::Number(n) => write!(f, "{n})"),
            KeyDefault::Fraction(number) => write!(f, "{number})"),
            KeyDefault::SameAs(other) => write!(f, "as {other})"),
        }
    }
}

/// Words that may be written for a key's values, from 0.
fn words(world: &str, key: &str) -> &'static [&'static str] {
    match (world, key) {
        ("toothpicks", "density") => crate::toothpicks::DENSITIES,
        _ => &[],
    }
}

pub(crate) fn unknown_world(name: &str, known: impl Iterator<Item = &'static str>) -> WorldError {
    WorldError::UnknownWorld { name: name.to_owned(), known: known.collect::<Vec<_>>().join(", ") }
}

/// A world's keys with their values, those left out filled in.
pub(crate) struct Values {
    keys: &'static [KeyInfo],
    values: Vec<f64>,
}

impl Values {
    pub(crate) fn parse(world: &WorldInfo, query: &str) -> Result<Values, WorldError> {
        let mut given: Vec<Option<f64>> = vec![None; world.keys.len()];
        for setting in query.split('&').filter(|s| !s.is_empty()) {
            let (key, value) = setting.split_once('=').unwrap_or((setting, ""));
            let at = world.keys.iter().position(|k| k.name == key).ok_or_else(|| unknown_key(world, key))?;
            let info = &world.keys[at];
            let wrong = |fault| WorldError::BadValue {
                world: world.name,
                key: info.name,
                value: value.to_owned(),
                fault,
                kind: info.kind(),
                min: info.min,
                max: info.max,
            };
            if given[at].is_some() {
                return Err(wrong("is the key's second value"));
            }
            let word = words(world.name, info.name).iter().position(|w| *w == value);
            let number = match word {
                Some(at) => at as f64,
                None => info.read(value).ok_or_else(|| {
                    wrong(if info.takes_fractions() { "is no number" } else { "is no whole number" })
                })?,
            };
            if !(info.min as f64..=info.max as f64).contains(&number) {
                return Err(wrong("is out of range"));
            }
            given[at] = Some(number);
        }
        let mut values: Vec<f64> = Vec::with_capacity(given.len());
        for (info, given) in world.keys.iter().zip(given) {
            values.push(given.unwrap_or_else(|| match info.default {
                KeyDefault::Number(n) => n as f64,
                KeyDefault::Fraction(number) => number,
                KeyDefault::SameAs(other) => value_of(world.keys, &values, other),
            }));
        }
        Ok(Values { keys: world.keys, values })
    }

    /// The value of a key that the world declares, a whole number.
    pub(crate) fn get(&self, key: &str) -> u64 {
        self.fraction(key) as u64
    }

    /// The value of a key that the world declares, whole or not.
    pub(crate) fn fraction(&self, key: &str) -> f64 {
        value_of(self.keys, &self.values, key)
    }
}

fn value_of(keys: &[KeyInfo], values: &[f64], key: &str) -> f64 {
    let at = keys.iter().position(|k| k.name == key);
    values[at.expect("a world reads only keys that it declares")]
}

fn unknown_key(world: &WorldInfo, key: &str) -> WorldError {
    let known = if world.keys.is_empty() {
        "it has none".to_owned()
    } else {
        let keys: Vec<String> = world.keys.iter().map(KeyInfo::to_string).collect();
        format!("it has {}", keys.join(", "))
    };
    WorldError::UnknownKey { world: world.name, key: key.to_owned(), known }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEYS: &[KeyInfo] = &[
        KeyInfo { name: "n", description: "", min: 1, max: 9, default: KeyDefault::Number(3) },
        KeyInfo { name: "nx", description: "", min: 1, max: 9, default: KeyDefault::SameAs("n") },
        KeyInfo { name: "pace", description: "", min: 0, max: 8, default: KeyDefault::Fraction(1.5) },
    ];
    const WORLD: WorldInfo = WorldInfo { name: "w", description: "", keys: KEYS, make: |_| Scene::default() };

    fn fault(query: &str) -> String {
        Values::parse(&WORLD, query).err().map(|e| e.to_string()).unwrap_or_default()
    }

    #[test]
    fn keys_left_out_take_defaults_or_follow_another_key() {
        let of = |query| Values::parse(&WORLD, query).map(|v| (v.get("n"), v.get("nx")));
        assert_eq!(of(""), Ok((3, 3)));
        assert_eq!(of("n=5"), Ok((5, 5)));
        assert_eq!(of("nx=2&n=7"), Ok((7, 2)));
        let pace = |query| Values::parse(&WORLD, query).map(|v| v.fraction("pace"));
        assert_eq!((pace(""), pace("pace=0.125"), pace("pace=3")), (Ok(1.5), Ok(0.125), Ok(3.0)));
    }

    #[test]
    fn mistakes_say_what_may_be_written() {
        assert_eq!(
            fault("m=2"),
            "world w has no key \"m\"; it has n (1 to 9, default 3), nx (1 to 9, default as n), pace (any number \
             from 0 to 8, default 1.5)"
        );
        assert_eq!(fault("n=0"), "world w: n=0 is out of range; n is a whole number from 1 to 9");
        assert_eq!(fault("n=1.5"), "world w: n=1.5 is no whole number; n is a whole number from 1 to 9");
        assert!(fault("n").contains("n= is no whole number"));
        assert!(fault("n=1&n=2").contains("second value"));
        assert!(fault("n=99999999999999999999999").contains("is no whole number"));
        for (value, what) in [("-0.125", "out of range"), ("inf", "out of range"), ("8.01", "out of range")] {
            assert!(fault(&format!("pace={value}")).contains(what), "{value}");
        }
        assert_eq!(fault("pace=NaN"), "world w: pace=NaN is no number; pace is a number from 0 to 8");
        assert!(fault("pace=").contains("is no number"));
    }
}
