//! Access checks: the names by which the service may be called, and changes that web pages of other origins request.
//!
//! A web page in a browser on the same machine reaches a service on loopback. Its requests carry the host name of the page (`Host`)
//! if that name was made to point here, and otherwise say that they come from another origin (`Sec-Fetch-Site`, `Origin`). Both are
//! checked before anything else.

use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::uri::Authority;
use axum::http::{HeaderMap, Method, Uri, Version, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::http::problem::Problem;
use crate::http::problem_kind::ProblemKind;

/// Host names and origins that the service accepts.
#[derive(Clone, Debug)]
pub struct Access {
    /// Address on which the service listens.
    pub listen: SocketAddr,
    /// Host names, with or without a port, by which it may be called besides its address and localhost.
    pub allowed_hosts: Vec<String>,
    /// Origins of other web pages that may call it; `*` for all.
    pub cors_origins: Vec<String>,
}

impl Access {
    /// True if a client may call the service by this name; without a port, port 80 is meant.
    fn knows_host(&self, host: &Authority) -> bool {
        // when listening on all addresses of a machine, neither these addresses nor the port outside are known (a container's port
        // may be mapped to another one). Any address and localhost are accepted, since the browser has gone there itself; a name is
        // what its owner makes it
        let anywhere = self.listen.ip().is_unspecified();
        let name = host.host().trim_start_matches('[').trim_end_matches(']').trim_end_matches('.');
        let own_port = anywhere || host.port_u16().unwrap_or(80) == self.listen.port();
        let own_name = match name.parse::<IpAddr>() {
            Ok(address) => anywhere || address.is_loopback() || address == self.listen.ip(),
            Err(_) => name.eq_ignore_ascii_case("localhost"),
        };
        (own_name && own_port) || self.allowed_hosts.iter().any(|allowed| is_allowed(allowed, name, host.port_u16()))
    }

    /// True if a page of this origin may call the service.
    fn knows_origin(&self, origin: &str) -> bool {
        self.cors_origins.iter().any(|known| known == "*" || known.eq_ignore_ascii_case(origin))
    }
}

/// Checks that `host` can be one of [`Access::allowed_hosts`]; the error says how to write it.
pub fn check_allowed_host(host: &str) -> Result<(), String> {
    match host.parse::<Authority>() {
        // not repeated: it has a password
        Ok(name) if name.as_str().contains('@') => {
            Err("a host must not contain a user name or password: write host or host:port".into())
        }
        Ok(_) => Ok(()),
        Err(_) if host.contains('@') => Err("a host must be written as host or host:port".into()),
        Err(_) => Err(format!("{host:?} is not a valid host: write host or host:port, without scheme and path")),
    }
}

fn is_allowed(allowed: &str, name: &str, port: Option<u16>) -> bool {
    let Ok(allowed) = allowed.parse::<Authority>() else { return false };
    let same_name = allowed.host().trim_matches(['[', ']']).eq_ignore_ascii_case(name);
    same_name && allowed.port_u16().is_none_or(|allowed| port == Some(allowed))
}

/// Refuses requests for other hosts, and requests of web pages of other origins that would change something.
pub async fn check_access(State(access): State<Arc<Access>>, request: Request, next: Next) -> Response {
    let checked = check_host(&access, request.version(), request.uri(), request.headers())
        .and_then(|host| check_site(&access, request.method(), request.headers(), host.as_ref()));
    match checked {
        Ok(()) => next.run(request).await,
        Err(problem) => problem.into_response(),
    }
}

/// Returns the host that a request is for; refuses one by which the service may not be called.
fn check_host(access: &Access, version: Version, uri: &Uri, headers: &HeaderMap) -> Result<Option<Authority>, Problem> {
    let mut hosts = headers.get_all(header::HOST).iter();
    let host = match (hosts.next(), hosts.next()) {
        (_, Some(_)) => return Err(Problem::bad_request("the request has more than one Host header")),
        // HTTP/1.0 has no Host
        (None, None) if version < Version::HTTP_11 => None,
        (None, None) => return Err(Problem::bad_request("the header Host is missing, which HTTP/1.1 requires")),
        (Some(host), None) => Some(host),
    };
    let unreadable = || Problem::bad_request("Host must be a name or an address, with or without a port");
    let host = host.map(|host| Authority::try_from(host.as_bytes()).map_err(|_| unreadable())).transpose()?;
    // a whole address in the first line comes before Host (RFC 9112, 3.2.2)
    let host = uri.authority().cloned().or(host);
    match &host {
        Some(host) if host.as_str().contains('@') => Err(unreadable()),
        Some(host) if !access.knows_host(host) => Err(Problem::new(
            ProblemKind::UnknownHost,
            match access.listen {
                listen if listen.ip().is_unspecified() => format!(
                    "this service answers to its addresses and to localhost, not to {host}: to allow this name, add \
                     it to allowed_hosts in the configuration"
                ),
                listen => format!(
                    "this service answers to its own address and to localhost:{}, not to {host}: to allow this name, \
                     add it to allowed_hosts in the configuration",
                    listen.port()
                ),
            },
        )),
        _ => Ok(host),
    }
}

/// Refuses a request that would change something if a web page of another origin sends it that is not configured.
fn check_site(access: &Access, method: &Method, headers: &HeaderMap, host: Option<&Authority>) -> Result<(), Problem> {
    if matches!(*method, Method::GET | Method::HEAD | Method::OPTIONS) {
        return Ok(());
    }
    let text = |name: &str| headers.get(name).map(|value| value.to_str().unwrap_or("null"));
    let origin = text("origin");
    if origin.is_some_and(|origin| access.knows_origin(origin)) {
        return Ok(());
    }
    let from_elsewhere = match text("sec-fetch-site") {
        Some(site) => !matches!(site, "same-origin" | "none"),
        // browsers leave it out where the connection is not encrypted; programs send no Origin
        None => origin.is_some_and(|origin| {
            let page = origin.split_once("://").and_then(|(_, page)| page.parse::<Authority>().ok());
            page.as_ref() != host || page.is_none()
        }),
    };
    if from_elsewhere {
        return Err(Problem::new(
            ProblemKind::CrossSite,
            "the request comes from a web page of another origin: to allow it, add the origin to cors_origins in the \
             configuration",
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn access(listen: &str, allowed_hosts: &[&str]) -> Access {
        Access {
            listen: listen.parse().unwrap(),
            allowed_hosts: allowed_hosts.iter().map(|host| (*host).to_owned()).collect(),
            cors_origins: vec!["https://design.example".to_owned()],
        }
    }

    fn knows(access: &Access, host: &str) -> bool {
        access.knows_host(&host.parse().unwrap())
    }

    #[test]
    fn the_service_answers_to_its_own_names_only() {
        let local = access("127.0.0.1:8080", &["render.example", "other.example:8443"]);
        for host in [
            "127.0.0.1:8080",
            "localhost:8080",
            "LocalHost.:8080",
            "[::1]:8080",
            "render.example",
            "RENDER.example:99",
            "other.example:8443",
        ] {
            assert!(knows(&local, host), "{host}");
        }
        for host in [
            "127.0.0.1",
            "localhost:80",
            "evil.example",
            "evil.example:8080",
            "localhost.evil.example:8080",
            "other.example",
            "xrender.example",
            "192.0.2.1:8080",
        ] {
            assert!(!knows(&local, host), "{host}");
        }
        assert!(knows(&access("127.0.0.1:80", &[]), "localhost"));
        let beyond = access("192.0.2.1:8080", &[]);
        assert!(
            knows(&beyond, "192.0.2.1:8080") && knows(&beyond, "localhost:8080") && !knows(&beyond, "a.example:8080")
        );
        // a machine's addresses and ports are not known, and cannot be given to another one; its names are those that are named
        for listen in ["0.0.0.0:8080", "[::]:8080"] {
            let (unnamed, named) = (access(listen, &[]), access(listen, &["render.example"]));
            for host in ["127.0.0.1:8080", "192.0.2.1", "192.0.2.1:9000", "[2001:db8::1]:8080", "localhost:9000"] {
                assert!(knows(&unnamed, host) && knows(&named, host), "{host}");
            }
            for host in
                ["evil.example", "evil.example:8080", "1.2.3.evil.example", "localhost.evil.example", "render:8080"]
            {
                assert!(!knows(&unnamed, host) && !knows(&named, host), "{host}");
            }
            assert!(knows(&named, "render.example") && !knows(&unnamed, "render.example"));
        }
    }

    #[test]
    fn pages_elsewhere_change_nothing() {
        let access = access("127.0.0.1:8080", &[]);
        let host: Authority = "127.0.0.1:8080".parse().unwrap();
        let allowed = |method: Method, pairs: &[(&'static str, &'static str)]| {
            let headers = pairs.iter().map(|(name, value)| (name.parse().unwrap(), value.parse().unwrap()));
            check_site(&access, &method, &HeaderMap::from_iter(headers), Some(&host)).is_ok()
        };
        let cross = ("sec-fetch-site", "cross-site");
        assert!(allowed(Method::GET, &[cross]) && allowed(Method::OPTIONS, &[cross]));
        assert!(allowed(Method::POST, &[]));
        assert!(allowed(Method::POST, &[("sec-fetch-site", "same-origin"), ("origin", "http://127.0.0.1:8080")]));
        assert!(allowed(Method::POST, &[("sec-fetch-site", "none")]));
        assert!(allowed(Method::DELETE, &[cross, ("origin", "https://design.example")]));
        assert!(allowed(Method::POST, &[("origin", "http://127.0.0.1:8080")]));
        for refused in [
            &[cross][..],
            &[cross, ("origin", "https://evil.example")],
            &[("sec-fetch-site", "same-site"), ("origin", "http://127.0.0.1:9999")],
            &[("origin", "http://evil.example")],
            &[("origin", "null")],
        ] {
            assert!(!allowed(Method::POST, refused), "{refused:?}");
            assert!(!allowed(Method::DELETE, refused), "{refused:?}");
        }
    }
}
