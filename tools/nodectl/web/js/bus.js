// The page's knowledge of the bus: the nodes, their state, and the chosen node. Views listen to it.

export class Bus extends EventTarget {
  constructor(connection) {
    super();
    this.connection = connection;
    this.hello = null;
    this.status = null;
    this.nodes = new Map();
    this.chosen = null;
    // The node to choose again when it comes back.
    this.wanted = null;
    this.faults = [];
    connection.on("hello", (hello) => this.#greet(hello));
    connection.on("status", (status) => this.#update("status", status));
    connection.on("nodes", (message) => this.#takeNodes(message));
    connection.on("emcy", (emcy) => this.#takeFault({ ...emcy, kind: "emcy" }));
    connection.on("state", (state) => this.#takeState(state));
    connection.on("connected", () => this.#tell("connected"));
  }

  request(...what) {
    return this.connection.request(...what);
  }

  on(name, listener) {
    this.addEventListener(name, ({ detail }) => listener(detail));
  }

  /** The nodes in the order of their IDs. */
  list() {
    return [...this.nodes.values()].sort((a, b) => a.node - b.node);
  }

  /** The chosen node, which the views show. */
  node() {
    return this.nodes.get(this.chosen) ?? null;
  }

  choose(node) {
    if (!this.nodes.has(node)) return;
    this.wanted = node;
    if (node === this.chosen) return;
    this.chosen = node;
    this.#tell("chosen");
  }

  get writes() {
    return this.hello?.writes ?? false;
  }

  #greet(hello) {
    // A new run of the bus has a time axis of its own.
    if (this.hello && hello.t < (this.status?.t ?? 0)) this.#forgetTimes();
    this.#update("hello", hello);
  }

  #forgetTimes() {
    this.faults = [];
    this.#tell("restart");
  }

  #takeNodes({ all, nodes }) {
    if (all) this.nodes.clear();
    for (const node of nodes) this.nodes.set(node.node, node);
    const before = this.chosen;
    if (this.nodes.has(this.wanted)) this.chosen = this.wanted;
    else if (!this.nodes.has(before)) this.chosen = this.list()[0]?.node ?? null;
    this.wanted ??= this.chosen;
    this.#tell("nodes");
    if (this.chosen !== before) this.#tell("chosen");
  }

  #takeState(event) {
    this.#takeFault({ ...event, kind: "state", text: event.state, active: event.state === "initialising" });
  }

  #takeFault(fault) {
    this.faults.push(fault);
    if (this.faults.length > 500) this.faults.shift();
    this.#tell("fault", fault);
  }

  #update(name, value) {
    this[name] = value;
    this.#tell(name, value);
  }

  #tell(name, detail = null) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }
}
