//! The URLs of the server.

use std::sync::Arc;

use axum::Router;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Request, State};
use axum::http::header::{
    CACHE_CONTROL, CONNECTION, CONTENT_SECURITY_POLICY, CONTENT_TYPE, COOKIE, HOST, ORIGIN, REFERRER_POLICY,
    SET_COOKIE, X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, Uri};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::get;

use crate::page::access::{Access, Claim, Refusal, Rights};
use crate::page::files;
use crate::page::hub::Hub;
use crate::page::places::Place;
use crate::page::socket::{self, LARGEST, Listener};

/// The content security policy: the page loads nothing from other servers, and has no inline scripts.
const POLICY: &str = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; connect-src 'self'; \
                      frame-ancestors 'none'; base-uri 'none'; form-action 'none'";
/// The place holder for the token in `index.html`.
const PLACE: &str = "{{token}}";
const COOKIE_NAME: &str = "token";

/// The state for every request.
#[derive(Clone)]
pub(crate) struct Site {
    pub(crate) access: Access,
    pub(crate) hub: Arc<Hub>,
    pub(crate) listener: Arc<Listener>,
}

pub(crate) fn router(site: Site) -> Router {
    let headers = middleware::map_response(with_headers);
    let access = middleware::from_fn_with_state(site.clone(), checked);
    Router::new().route("/ws", get(connect)).fallback(file).layer(access).layer(headers).with_state(site)
}

/// Passes on allowed requests and refuses the others.
async fn checked(State(site): State<Site>, mut request: Request, next: Next) -> Response {
    match rights(&site.access, request.headers(), request.uri()) {
        Ok(rights) => {
            if let Some(place) = request.extensions().get::<Arc<Place>>().filter(|_| rights == Rights::Write)
            {
                place.trust();
            }
            request.extensions_mut().insert(rights);
            next.run(request).await
        }
        // The connection is closed, so that refusals take no place.
        Err(refusal) => (StatusCode::FORBIDDEN, [(CONNECTION, "close")], refusal.text()).into_response(),
    }
}

fn rights(access: &Access, headers: &HeaderMap, uri: &Uri) -> Result<Rights, Refusal> {
    let text = |name: &HeaderName| headers.get(name).map(|value| value.to_str().unwrap_or_default());
    // Two `Host` headers would leave open which one counts.
    let host = Some(headers.get_all(HOST)).filter(|all| all.iter().count() == 1).and_then(|_| text(&HOST));
    let token = uri.query().and_then(token_of_query).or_else(|| {
        // The requests of other sites' pages have the cookie, too. So the cookie only opens files, and only on a server
        // for other machines.
        let is_file = uri.path() != "/ws" && !access.is_local();
        text(&COOKIE).filter(|_| is_file).and_then(token_of_cookies)
    });
    access.rights(Claim { host, origin: text(&ORIGIN), token })
}

fn token_of_query(query: &str) -> Option<&str> {
    query.split('&').find_map(|pair| pair.strip_prefix("token="))
}

fn token_of_cookies(cookies: &str) -> Option<&str> {
    cookies.split(';').find_map(|pair| pair.trim().strip_prefix("token="))
}

async fn connect(
    State(site): State<Site>,
    axum::Extension(rights): axum::Extension<Rights>,
    upgrade: WebSocketUpgrade,
) -> Response {
    let upgrade = upgrade.max_message_size(LARGEST).max_frame_size(LARGEST);
    upgrade.on_upgrade(move |socket| socket::serve(socket, rights == Rights::Write, site.hub, site.listener))
}

async fn file(State(site): State<Site>, method: Method, uri: Uri) -> Response {
    if method != Method::GET && method != Method::HEAD {
        return StatusCode::METHOD_NOT_ALLOWED.into_response();
    }
    match files::find(uri.path()) {
        Some((media, content)) if uri.path() == "/" => index(&site.access, media, content),
        Some((media, content)) => ([(CONTENT_TYPE, media)], content).into_response(),
        None => StatusCode::NOT_FOUND.into_response(),
    }
}

/// The page with its token. No page of another origin can read it.
fn index(access: &Access, media: &'static str, content: &[u8]) -> Response {
    let token = access.token().as_str();
    let text = String::from_utf8_lossy(content).replace(PLACE, token);
    let mut response = ([(CONTENT_TYPE, media)], text).into_response();
    let cookie = format!("{COOKIE_NAME}={token}; SameSite=Strict; HttpOnly; Path=/");
    if let Some(cookie) = HeaderValue::from_str(&cookie).ok().filter(|_| !access.is_local()) {
        response.headers_mut().insert(SET_COOKIE, cookie);
    }
    response
}

async fn with_headers(mut response: Response) -> Response {
    let headers = response.headers_mut();
    for (name, value) in [
        (CONTENT_SECURITY_POLICY, POLICY),
        (CACHE_CONTROL, "no-store"),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (REFERRER_POLICY, "no-referrer"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}
