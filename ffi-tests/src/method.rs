//! The methods under comparison, and the lists of peers that the library is judged against.

use crate::earlier;
use crate::library::Mode;
use crate::peers::{Candidates, Peer};

/// How to estimate the light that a point reflects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Another's method.
    Peer(Peer),
    /// A mode of the library.
    Library(Mode),
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

/// What a renderer may do without the library.
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

/// What a renderer may do in a room.
const PORTALS: [Peer; 2] = [Peer::Portals, Peer::Windows];

impl Method {
    /// Every peer, every mode of the library, and the limits; version 0.2 if it is there.
    pub fn all() -> impl Iterator<Item = Method> {
        let limits = [Limit::Sampled, Limit::Pooled].into_iter().map(Method::Limit);
        let peers = EXTENDED.each.iter().chain(&PORTALS).copied().map(Method::Peer);
        let modes = Mode::ALL.into_iter().filter(|mode| *mode != Mode::Earlier || earlier::version().is_some());
        peers.chain(modes.map(Method::Library)).chain(limits)
    }

    pub fn name(self) -> String {
        match self {
            Method::Peer(peer) => peer.name(),
            Method::Library(mode) => mode.name().into(),
            Method::Limit(Limit::Sampled) => "limit".into(),
            Method::Limit(Limit::Pooled) => "limit, pooled".into(),
        }
    }

    /// Whether its mean is the integral.
    pub fn is_unbiased(self) -> bool {
        match self {
            // Of light from elsewhere nothing counts.
            Method::Library(Mode::Complete) => false,
            Method::Peer(_) | Method::Library(_) => true,
            // It leaves out what lies in cells whose centre is dark.
            Method::Limit(_) => false,
        }
    }

    pub fn is_limit(self) -> bool {
        matches!(self, Method::Limit(_))
    }

    /// Whether it is what another is where no portals are.
    pub fn is_of_rooms(self) -> bool {
        match self {
            Method::Peer(peer) => PORTALS.contains(&peer),
            Method::Library(mode) => matches!(mode, Mode::Portals | Mode::Complete),
            Method::Limit(_) => false,
        }
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
    fn names_are_distinct() {
        let mut names: Vec<String> = Method::all().map(Method::name).collect();
        names.sort();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
    }
}
