//! The WebSocket of one page.

use std::sync::Arc;
use std::time::Duration;

use axum::body::Bytes;
use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use tokio::time::{Instant, sleep_until, timeout};

use crate::page::hub::{FromPage, Hub, Next, Outbox, PageId};
use crate::page::pace::Pace;

/// The largest message of a page: a firmware image in base64, or the configuration of a large device.
pub(crate) const LARGEST: usize = 2 * 1024 * 1024;
/// The period of pings to a page that sends nothing.
const PING: Duration = Duration::from_secs(10);
/// The time-out for a page that sends nothing, and for a page that accepts nothing.
const PATIENCE: Duration = Duration::from_secs(30);

/// The receiver of the pages' actions.
pub(crate) type Listener = dyn Fn(FromPage) + Send + Sync;

/// Serves a page until it disconnects or is disconnected.
pub(crate) async fn serve(mut socket: WebSocket, writes: bool, hub: Arc<Hub>, listener: Arc<Listener>) {
    let code = match hub.enter(writes) {
        Some((page, outbox)) => {
            listener(FromPage::Came { page, writes });
            let code = converse(&mut socket, page, &outbox, &*listener).await;
            hub.leave(page);
            listener(FromPage::Left { page });
            code
        }
        None => Some(close_code::AGAIN),
    };
    if let Some(code) = code {
        let farewell = Message::Close(Some(CloseFrame { code, reason: "".into() }));
        // A lost page needs no close frame.
        let _ = timeout(PING, socket.send(farewell)).await;
    }
}

/// Transfers messages in both directions. Returns the code to close the connection with; `None` when it is closed
/// already.
async fn converse(socket: &mut WebSocket, page: PageId, outbox: &Outbox, listener: &Listener) -> Option<u16> {
    let mut pace = Pace::new(Instant::now());
    let mut heard = Instant::now();
    let mut ping = heard + PING;
    loop {
        let open_at = pace.next();
        let message = async {
            sleep_until(open_at).await;
            socket.recv().await
        };
        tokio::select! {
            message = message => {
                heard = Instant::now();
                pace.count(heard);
                match message {
                    Some(Ok(Message::Text(text))) => listener(FromPage::Said { page, text: text.to_string() }),
                    // An empty text is no message of the protocol, so that the service answers with an error.
                    Some(Ok(Message::Binary(_))) => listener(FromPage::Said { page, text: String::new() }),
                    Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                    Some(Ok(Message::Close(_)) | Err(_)) | None => return None,
                }
            }
            next = outbox.next() => match next {
                Next::Text(text) => send(socket, Message::Text(text.into())).await?,
                Next::Close => return Some(close_code::POLICY),
            },
            () = sleep_until(ping) => {
                if heard.elapsed() > PATIENCE {
                    return Some(close_code::AWAY);
                }
                ping = Instant::now() + PING;
                send(socket, Message::Ping(Bytes::new())).await?;
            }
        }
    }
}

/// Sends a message; `None` when the page does not accept it in time.
async fn send(socket: &mut WebSocket, message: Message) -> Option<()> {
    timeout(PATIENCE, socket.send(message)).await.ok()?.ok()
}
