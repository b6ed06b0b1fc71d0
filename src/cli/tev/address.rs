//! Where tev listens.

use std::fmt;
use std::io;
use std::net::{Ipv6Addr, TcpStream, ToSocketAddrs};
use std::str::FromStr;
use std::time::Duration;

/// Where tev listens if it is told nothing else.
const USUAL_PORT: u16 = 14158;
/// How long one address of a host may take to answer.
const ANSWER: Duration = Duration::from_secs(5);

/// A host by name or number, and a port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    host: String,
    port: u16,
}

impl Address {
    /// tev's own default: this machine.
    pub const USUAL: &'static str = "127.0.0.1:14158";

    /// Connects to the first of the host's addresses that takes it.
    pub fn connect(&self) -> io::Result<TcpStream> {
        let mut failed = io::Error::new(io::ErrorKind::NotFound, "the host has no address");
        for address in (&self.host[..], self.port).to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, ANSWER) {
                Ok(stream) => return Ok(stream),
                Err(error) => failed = error,
            }
        }
        Err(failed)
    }
}

/// `HOST:PORT` or `HOST`; a numerical IPv6 host with a port is in brackets.
impl FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = if text.parse::<Ipv6Addr>().is_ok() {
            Some((text, None))
        } else if let Some(rest) = text.strip_prefix('[') {
            let inside = rest.split_once(']');
            inside.and_then(|(host, rest)| match rest {
                "" => Some((host, None)),
                _ => Some((host, Some(rest.strip_prefix(':')?))),
            })
        } else {
            let colon = text.split_once(':');
            Some(colon.map_or((text, None), |(host, port)| (host, Some(port))))
        };
        let parsed = parts.and_then(|(host, port)| {
            let port = port.map_or(Some(USUAL_PORT), |port| port.parse().ok())?;
            let is_host = !host.is_empty() && !host.contains(['/', '[', ']', ' ']);
            let host = host.to_owned();
            (is_host && port != 0).then_some(Self { host, port })
        });
        parsed.ok_or_else(|| {
            format!(
                "expected HOST:PORT or HOST, like {}, with a port from 1 to 65535",
                Self::USUAL
            )
        })
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { host, port } = self;
        if host.contains(':') {
            write!(f, "[{host}]:{port}")
        } else {
            write!(f, "{host}:{port}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_a_host_and_perhaps_a_port() {
        for (text, full) in [
            (Address::USUAL, Address::USUAL),
            ("wall", "wall:14158"),
            ("wall.studio.example:80", "wall.studio.example:80"),
            ("::1", "[::1]:14158"),
            ("[::1]", "[::1]:14158"),
            ("[fe80::2]:65535", "[fe80::2]:65535"),
        ] {
            let address: Address = text.parse().unwrap();
            assert_eq!(address.to_string(), full);
            assert_eq!(full.parse(), Ok(address));
        }
        for bad in [
            "",
            ":",
            ":14158",
            "wall:",
            "wall:0",
            "wall:65536",
            "wall:-1",
            "wall:http",
            "a:1:2",
            "[::1",
            "[::1]1",
            "[]:1",
            "../scene.toml",
            "a b",
        ] {
            assert!(bad.parse::<Address>().is_err(), "{bad}");
        }
    }
}
