//! The methods under comparison, and the lists of peers that the library is judged against.

use crate::earlier;
use crate::library::Mode;
use crate::lightonly::LightOnly;
use crate::peers::{Candidates, Peer};

/// How to estimate the light that a point reflects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Another's method.
    Peer(Peer),
    /// A mode of the library.
    Library(Mode),
    /// A technique that knows nothing but the light, and MIS with the BRDF.
    Light(LightOnly),
    /// A yardstick that no renderer could pay for.
    Limit(Limit),
}

/// What light and BRDF allow if visibility is not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// The product from all cells of a fine grid.
    Sampled,
    /// Picks from a pool of its samples.
    Pooled,
}

/// A list of peers.
pub struct Peers {
    pub name: &'static str,
    pub each: &'static [Peer],
}

/// The peers of version 0.1, which its claims were made against.
pub const FIRST: Peers = Peers {
    name: "version 0.1",
    each: &[
        Peer::Environment,
        Peer::Brdf,
        Peer::MisBalance,
        Peer::MisPower,
        Peer::MisCompensated,
        Peer::Ris(8, Candidates::Plain),
        Peer::Ris(32, Candidates::Plain),
        Peer::Pool(4, Candidates::Plain),
        Peer::Pool(8, Candidates::Plain),
        Peer::Structured,
    ],
};

/// These, and resampling from compensated candidates.
pub const EXTENDED: Peers = Peers {
    name: "extended",
    each: &[
        Peer::Environment,
        Peer::Brdf,
        Peer::MisBalance,
        Peer::MisPower,
        Peer::MisCompensated,
        Peer::Ris(8, Candidates::Plain),
        Peer::Ris(32, Candidates::Plain),
        Peer::Pool(4, Candidates::Plain),
        Peer::Pool(8, Candidates::Plain),
        Peer::Structured,
        Peer::Ris(8, Candidates::Compensated),
        Peer::Ris(32, Candidates::Compensated),
        Peer::Pool(4, Candidates::Compensated),
        Peer::Pool(8, Candidates::Compensated),
    ],
};

/// The lists that gains are stated against.
pub const LISTS: [Peers; 2] = [FIRST, EXTENDED];

impl Method {
    /// Every peer, every mode of the library, and the limits; version 0.2 if it is there.
    pub fn all() -> impl Iterator<Item = Method> {
        let limits = [Limit::Sampled, Limit::Pooled].into_iter().map(Method::Limit);
        let peers = EXTENDED.each.iter().copied().map(Method::Peer);
        let modes = Mode::ALL.into_iter().filter(|mode| *mode != Mode::Earlier || earlier::is_there());
        peers.chain(modes.map(Method::Library)).chain(limits)
    }

    pub fn name(self) -> String {
        match self {
            Method::Peer(peer) => peer.name(),
            Method::Library(mode) => mode.name().into(),
            Method::Light(light) => light.name(),
            Method::Limit(Limit::Sampled) => "limit".into(),
            Method::Limit(Limit::Pooled) => "limit, pooled".into(),
        }
    }

    /// Whether its mean is the integral.
    pub fn is_unbiased(self) -> bool {
        match self {
            Method::Peer(_) | Method::Library(_) | Method::Light(_) => true,
            // It leaves out what lies in cells whose centre is dark.
            Method::Limit(_) => false,
        }
    }

    pub fn is_peer(self) -> bool {
        matches!(self, Method::Peer(_))
    }

    pub fn is_limit(self) -> bool {
        matches!(self, Method::Limit(_))
    }

    /// The mode, of a method of the library.
    pub fn mode(self) -> Option<Mode> {
        if let Method::Library(mode) = self { Some(mode) } else { None }
    }
}

impl From<Peer> for Method {
    fn from(peer: Peer) -> Method {
        Method::Peer(peer)
    }
}

impl From<Mode> for Method {
    fn from(mode: Mode) -> Method {
        Method::Library(mode)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_distinct_and_the_first_list_is_part_of_the_other() {
        let mut names: Vec<String> = Method::all().map(Method::name).collect();
        names.sort();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
        assert!(FIRST.each.iter().all(|peer| EXTENDED.each.contains(peer)));
    }
}
