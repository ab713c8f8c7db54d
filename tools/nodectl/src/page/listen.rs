//! The TCP port of the server, and its connections.

use std::io;
use std::net::{SocketAddr, TcpListener as StdListener};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use axum::{Extension, Router};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::time::{sleep, timeout};

use crate::page::access::{Access, Token};
use crate::page::hub::{FromPage, Hub};
use crate::page::places::{Place, Places};
use crate::page::routes::{Site, router};

/// The time-out for a request. A connection that sends nothing is closed then.
const PATIENCE: Duration = Duration::from_secs(5);
/// The time after which a connection is closed that is no WebSocket by then, whether it reads the answers or not.
const LONGEST: Duration = Duration::from_secs(30);
/// The number of ports that are tried when the first one is in use.
const PORTS: u16 = 20;

/// The options of the server.
#[derive(Clone, Debug)]
pub struct Options {
    /// Address and port; port 0 takes any free port.
    pub address: SocketAddr,
}

/// A server that runs until the process ends.
pub struct Server {
    /// The address that the server listens at.
    pub address: SocketAddr,
    /// The URL for a browser.
    pub url: String,
    /// The pages.
    pub hub: Arc<Hub>,
}

/// Starts the server on a thread of its own. `listener` is called with the actions of pages and must not block.
///
/// # Errors
/// Neither this port nor one of the next ports can be used.
pub fn start(options: &Options, listener: impl Fn(FromPage) + Send + Sync + 'static) -> io::Result<Server> {
    let socket = bind(options.address)?;
    socket.set_nonblocking(true)?;
    let (address, token) = (socket.local_addr()?, Token::random()?);
    let hub = Arc::new(Hub::default());
    let access = Access::new(address, token);
    let url = url(&access, address);
    let site = Site { access, hub: Arc::clone(&hub), listener: Arc::new(listener) };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let run = move || runtime.block_on(accept(socket, router(site)));
    thread::Builder::new().name("page".to_owned()).spawn(run)?;
    Ok(Server { address, url, hub })
}

/// The address, or the next free port after it.
fn bind(address: SocketAddr) -> io::Result<StdListener> {
    let ports = (address.port()..=address.port().saturating_add(PORTS - 1)).filter(|_| address.port() != 0);
    for port in ports {
        match StdListener::bind(SocketAddr::new(address.ip(), port)) {
            Err(error) if error.kind() == io::ErrorKind::AddrInUse => {}
            result => return result,
        }
    }
    if address.port() == 0 { StdListener::bind(address) } else { Err(io::ErrorKind::AddrInUse.into()) }
}

fn url(access: &Access, address: SocketAddr) -> String {
    if access.is_local() {
        return format!("http://{address}/");
    }
    format!("http://{address}/?token={}", access.token().as_str())
}

async fn accept(socket: StdListener, router: Router) {
    let Ok(listener) = TcpListener::from_std(socket) else { return };
    let places = Places::default();
    for number in 0.. {
        match listener.accept().await {
            Ok((stream, _)) => {
                let task = tokio::spawn(connection(stream, router.clone(), places.of(number)));
                places.enter(number, task.abort_handle());
            }
            // The host has no resources for another connection at the moment.
            Err(_) => sleep(Duration::from_millis(100)).await,
        }
    }
}

async fn connection(stream: TcpStream, router: Router, place: Place) {
    // An event is one small write that must be sent at once.
    let _ = stream.set_nodelay(true);
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(PATIENCE).max_buf_size(64 * 1024);
    let service = TowerToHyperService::new(router.layer(Extension(Arc::new(place))));
    // A failed connection concerns only its own client.
    let _ = timeout(LONGEST, http.serve_connection(TokioIo::new(stream), service).with_upgrades()).await;
}
