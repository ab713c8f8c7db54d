//! The access rules: they depend on the `Host` of the request, the `Origin` of the asking page, and a token.
//!
//! A browser lets any page of any site send requests to this machine. Such a page cannot choose its `Origin` and cannot
//! read the answers of this server, so it does not know the token. An attacker may also point a name at this machine
//! (DNS rebinding). Then the `Host` shows the name instead of an IP address, and the request is refused.

use std::fmt::Write as _;
use std::net::{IpAddr, SocketAddr};

/// The token that lets a page write. Each start of the server has another token.
#[derive(Clone, PartialEq, Eq)]
pub struct Token(String);

/// The rights of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rights {
    Read,
    Write,
}

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    Host,
    Origin,
    Token,
}

/// The properties of a request that decide on its rights.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Claim<'a> {
    pub(crate) host: Option<&'a str>,
    pub(crate) origin: Option<&'a str>,
    pub(crate) token: Option<&'a str>,
}

/// The access rules of one server.
#[derive(Clone)]
pub(crate) struct Access {
    address: SocketAddr,
    token: Token,
}

impl Token {
    /// A token of 128 random bits.
    ///
    /// # Errors
    /// The system has no random numbers.
    pub fn random() -> std::io::Result<Token> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes).map_err(std::io::Error::other)?;
        let mut text = String::with_capacity(32);
        // Writing to a string cannot fail.
        for byte in bytes {
            let _ = write!(text, "{byte:02x}");
        }
        Ok(Token(text))
    }

    /// The text of the token in a URL.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Compares whole tokens, so that the time does not tell where the first difference is.
    fn is(&self, given: &str) -> bool {
        let differing = self.0.bytes().zip(given.bytes()).fold(0, |differing, (a, b)| differing | (a ^ b));
        self.0.len() == given.len() && differing == 0
    }
}

impl Access {
    pub(crate) fn new(address: SocketAddr, token: Token) -> Access {
        Access { address, token }
    }

    pub(crate) fn token(&self) -> &Token {
        &self.token
    }

    /// Whether only programs of this machine reach the server.
    pub(crate) fn is_local(&self) -> bool {
        self.address.ip().is_loopback()
    }

    /// The rights of a request. Without the token, local requests may read, and others may do nothing.
    pub(crate) fn rights(&self, claim: Claim) -> Result<Rights, Refusal> {
        let host = claim.host.filter(|host| self.is_ours(host)).ok_or(Refusal::Host)?;
        if claim.origin.is_some_and(|origin| origin.strip_prefix("http://") != Some(host)) {
            return Err(Refusal::Origin);
        }
        match claim.token {
            Some(token) if self.token.is(token) => Ok(Rights::Write),
            None | Some("") if self.is_local() => Ok(Rights::Read),
            _ => Err(Refusal::Token),
        }
    }

    /// Whether a `Host` is an IP address of this server, or `localhost` on this machine.
    fn is_ours(&self, host: &str) -> bool {
        let Some((name, port)) = host.rsplit_once(':') else { return false };
        if port.parse() != Ok(self.address.port()) {
            return false;
        }
        let ip = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
        match ip.parse::<IpAddr>() {
            Ok(ip) if self.is_local() => ip.is_loopback(),
            Ok(ip) => self.address.ip().is_unspecified() || ip == self.address.ip(),
            Err(_) => name == "localhost" && self.is_local(),
        }
    }
}

impl Refusal {
    /// The text of the answer.
    pub(crate) const fn text(self) -> &'static str {
        match self {
            Refusal::Host => "this server is asked for by its IP address and port",
            Refusal::Origin => "pages of other origins get nothing here",
            Refusal::Token => "the token is missing or wrong; the terminal shows the whole address",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn access(address: &str) -> Access {
        Access::new(address.parse().unwrap(), Token("0123456789abcdef0123456789abcdef".into()))
    }

    fn ask<'a>(host: &'a str, origin: Option<&'a str>, token: Option<&'a str>) -> Claim<'a> {
        Claim { host: Some(host), origin, token }
    }

    const TOKEN: Option<&str> = Some("0123456789abcdef0123456789abcdef");

    #[test]
    fn on_this_machine_anybody_reads_and_the_token_writes() {
        let access = access("127.0.0.1:8080");
        for host in ["127.0.0.1:8080", "localhost:8080", "[::1]:8080"] {
            assert_eq!(access.rights(ask(host, None, None)), Ok(Rights::Read), "{host}");
            let origin = format!("http://{host}");
            assert_eq!(access.rights(ask(host, Some(&origin), TOKEN)), Ok(Rights::Write), "{host}");
        }
        let wrong = Some("0123456789abcdef0123456789abcdee");
        assert_eq!(access.rights(ask("127.0.0.1:8080", None, wrong)), Err(Refusal::Token));
        assert_eq!(access.rights(ask("127.0.0.1:8080", None, Some("0"))), Err(Refusal::Token));
    }

    #[test]
    fn other_names_and_other_origins_are_refused_with_the_token_too() {
        let access = access("127.0.0.1:8080");
        for host in ["evil.example:8080", "127.0.0.1:80", "127.0.0.1", "192.168.1.2:8080", "localhost:80", ""]
        {
            assert_eq!(access.rights(ask(host, None, TOKEN)), Err(Refusal::Host), "{host}");
        }
        assert_eq!(access.rights(Claim { token: TOKEN, ..Claim::default() }), Err(Refusal::Host));
        for origin in [
            "http://evil.example",
            "https://127.0.0.1:8080",
            "http://127.0.0.1:8081",
            "null",
            "",
            "http://localhost:8080",
        ] {
            let claim = ask("127.0.0.1:8080", Some(origin), TOKEN);
            assert_eq!(access.rights(claim), Err(Refusal::Origin), "{origin}");
        }
    }

    #[test]
    fn from_elsewhere_nothing_goes_without_the_token() {
        for address in ["0.0.0.0:8080", "192.168.1.2:8080"] {
            let access = access(address);
            assert_eq!(access.rights(ask("192.168.1.2:8080", None, None)), Err(Refusal::Token));
            assert_eq!(access.rights(ask("192.168.1.2:8080", None, TOKEN)), Ok(Rights::Write));
            assert_eq!(access.rights(ask("board.local:8080", None, TOKEN)), Err(Refusal::Host));
        }
        assert_eq!(access("192.168.1.2:80").rights(ask("10.0.0.1:80", None, TOKEN)), Err(Refusal::Host));
    }

    #[test]
    fn a_token_is_not_had_twice() {
        let (one, two) = (Token::random().unwrap(), Token::random().unwrap());
        assert!(one != two && one.as_str().len() == 32);
    }
}
