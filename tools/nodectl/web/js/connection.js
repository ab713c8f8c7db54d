// One WebSocket to the server: requests with their answers, events, and a new connection when the old one is lost.

import { megabytes, sizeOf } from "./file.js";

const RETRY_MS = 1000;
const WENT_AWAY = "the server has gone away";

/** An answer with an error. `abort` is the SDO abort code where a node has refused. */
export class Refusal extends Error {
  constructor(message, abort = null) {
    super(message);
    this.abort = abort;
  }
}

export class Connection extends EventTarget {
  #socket = null;
  #open = new Map();
  #lastId = 0;
  #token;

  constructor(token) {
    super();
    this.#token = token;
    this.connected = false;
    // The bytes of the largest message that the server takes.
    this.largest = Infinity;
  }

  /** Connects, and connects again whenever the connection is lost. */
  start() {
    const url = new URL("ws", location.href);
    url.protocol = url.protocol.replace("http", "ws");
    url.search = new URLSearchParams({ token: this.#token });
    const socket = new WebSocket(url);
    socket.addEventListener("message", (message) => this.#receive(message.data));
    socket.addEventListener("close", () => this.#lost());
    this.#socket = socket;
  }

  /** Sends a request to the server. `onProgress` is called with each step. The promise fails with a `Refusal`. */
  request(what, keys = {}, onProgress = null) {
    if (!this.connected) return Promise.reject(new Refusal(WENT_AWAY));
    this.#lastId += 1;
    const id = this.#lastId;
    const message = JSON.stringify({ id, do: what, ...keys });
    // The server closes the connection of a page that sends a larger message.
    if (sizeOf(message) > this.largest) return Promise.reject(new Refusal(`the request is too large: the server takes ${megabytes(this.largest)}`));
    return new Promise((resolve, reject) => {
      this.#open.set(id, { resolve, reject, onProgress });
      this.#socket.send(message);
    });
  }

  /** Calls `listener` with each event of a name. */
  on(name, listener) {
    this.addEventListener(name, ({ detail }) => listener(detail));
  }

  #receive(data) {
    const message = JSON.parse(data);
    if (message.event) return this.#tell(message);
    const request = this.#open.get(message.id);
    if (!request) return;
    if (message.progress) return request.onProgress?.(message.progress);
    this.#open.delete(message.id);
    if (message.error == null) request.resolve(message.ok);
    else request.reject(new Refusal(message.error, message.abort));
  }

  #tell(message) {
    // The first message shows that the server has accepted the connection.
    const isFirst = message.event === "hello";
    if (isFirst) Object.assign(this, { connected: true, largest: message.largest });
    this.dispatchEvent(new CustomEvent(message.event, { detail: message }));
    if (isFirst) this.#tellConnected();
  }

  #lost() {
    for (const { reject } of this.#open.values()) reject(new Refusal(WENT_AWAY));
    this.#open.clear();
    if (this.connected) this.#disconnect();
    setTimeout(() => this.#again(), RETRY_MS);
  }

  /** A restarted server has another token. The page stays, and takes the token out of a new copy of itself. */
  async #again() {
    this.#token = (await newToken()) ?? this.#token;
    this.start();
  }

  #disconnect() {
    this.connected = false;
    this.#tellConnected();
  }

  #tellConnected() {
    this.dispatchEvent(new CustomEvent("connected", { detail: this.connected }));
  }
}

/** The token in a page. */
export function tokenOf(page) {
  return page.querySelector("meta[name=token]")?.content ?? "";
}

async function newToken() {
  try {
    const answer = await fetch(location.pathname + location.search);
    if (!answer.ok) return null;
    return tokenOf(new DOMParser().parseFromString(await answer.text(), "text/html"));
  } catch {
    return null;
  }
}
