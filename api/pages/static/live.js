// Live samples: the service sends blocks of float32 at about 20 Hz over one WebSocket, already thinned; the status is text.
// The figures are set at 5 Hz so that they can be read; the strip is drawn once per frame at most.

const WINDOW = 12; // s of motion on the strip
const POINTS = 4000; // rows kept for each axis
const READABLE = 200; // ms between changes of a figure
const root = document.querySelector("[data-live]");
const panels = [...root.querySelectorAll("[data-axis]")];
const cycle = Number(root.dataset.cycle);
const set = (selector, words, within = root) => {
  const place = within.querySelector(selector);
  if (place.textContent !== words) place.textContent = words;
};
const fixed = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits).replace("-", "−") : "–");
const colour = (role) => {
  const probe = document.createElement("span");
  probe.style.color = `var(--${role})`;
  root.append(probe);
  const resolved = getComputedStyle(probe).color;
  probe.remove();
  return resolved;
};

// the newest value that came; one that did not is null
const newest = (values) => values.findLast((value) => value !== null);

if (panels.length > 1) root.classList.add("many-axes");

class Axis {
  constructor(panel) {
    this.panel = panel;
    this.place = panel.querySelector("[data-strip]");
    this.clear();
    this.build();
    new ResizeObserver(() => this.plot.setSize(this.size())).observe(this.place);
  }

  clear() {
    this.time = [];
    this.position = [];
    this.current = [];
    this.following = NaN;
    this.begun = null; // s of the rig's clock at the first row: the strip counts from there
  }

  size() {
    return { width: Math.max(this.place.clientWidth, 100), height: Math.max(this.place.clientHeight, 100) };
  }

  build() {
    this.plot?.destroy();
    const font = '13px "Inter", system-ui, sans-serif';
    const axis = { font, labelFont: font, ticks: { show: false }, stroke: colour("ink-soft"), grid: { stroke: colour("grid"), width: 1 } };
    const minus = (_, ticks) => ticks.map((tick) => String(+tick.toPrecision(6)).replace("-", "−"));
    this.plot = new uPlot(
      {
        ...this.size(),
        padding: [8, 4, 0, 4],
        legend: { show: false },
        cursor: { show: false },
        scales: { x: { time: false }, y: {}, current: {} },
        series: [
          {},
          { stroke: colour("position"), width: 2, points: { show: false }, scale: "y" },
          { stroke: colour("current"), width: 1.3, points: { show: false }, scale: "current" },
        ],
        axes: [
          { ...axis, size: 26, space: 80, values: (_, ticks) => ticks.map((tick) => `${+tick.toPrecision(6)} s`) },
          { ...axis, size: 52, scale: "y", stroke: colour("position"), values: minus },
          { ...axis, size: 52, scale: "current", side: 1, stroke: colour("current"), grid: { show: false }, values: minus },
        ],
      },
      [this.time, this.position, this.current],
      this.place,
    );
  }

  take(time, position, command, following) {
    this.begun ??= time[0];
    const given = (value) => (Number.isFinite(value) ? value : null);
    for (let row = 0; row < time.length; row += 1) {
      this.time.push(time[row] - this.begun);
      this.position.push(given(position[row]));
      this.current.push(given(command[row]));
    }
    for (let row = time.length - 1; row >= 0; row -= 1)
      if (Number.isFinite(following[row])) {
        this.following = following[row];
        break;
      }
    const oldest = this.time.at(-1) - WINDOW;
    let cut = Math.max(0, this.time.length - POINTS);
    while (cut < this.time.length && this.time[cut] < oldest) cut += 1;
    if (cut) for (const values of [this.time, this.position, this.current]) values.splice(0, cut);
  }

  draw() {
    this.plot.setData([this.time, this.position, this.current]);
  }

  say() {
    set("[data-position]", fixed(newest(this.position), 3), this.panel);
    set("[data-current]", fixed(newest(this.current), 2), this.panel);
    set("[data-following]", fixed(this.following * 1000, 2), this.panel);
    const near = Math.abs(this.following) > 0.7 * Number(this.panel.dataset.followingLimit);
    this.panel.querySelector("[data-following]").parentElement.classList.toggle("near", near);
  }
}

const axes = panels.map((panel) => new Axis(panel));
document.addEventListener("theme-changed", () => axes.forEach((axis) => axis.build()));

let dirty = false;
let saidAt = 0;
let session = null;

function frame(now) {
  if (dirty) {
    axes.forEach((axis) => axis.draw());
    dirty = false;
  }
  if (now - saidAt > READABLE) {
    axes.forEach((axis) => axis.say());
    saidAt = now;
  }
  requestAnimationFrame(frame);
}
requestAnimationFrame(frame);

// header: rows, columns (uint32), time origin (float64), axes (uint32), 4 bytes of padding; then float32 columns
function takeBlock(buffer) {
  const view = new DataView(buffer);
  const rows = view.getUint32(0, true);
  const origin = view.getFloat64(8, true);
  const count = view.getUint32(16, true);
  const column = (index) => new Float32Array(buffer, 24 + 4 * index * rows, rows);
  const time = Array.from(column(0), (offset) => origin + offset);
  axes.forEach((axis, index) => axis.take(time, column(1 + index), column(1 + count + index), column(1 + 2 * count + index)));
  dirty = true;
}

const WORDS = {
  new: ["idle", "Being prepared"],
  checked: ["good", "Checked"],
  "payload confirmed": ["good", "Payload confirmed"],
  armed: ["warn", "Armed: the next step moves the robot"],
  running: ["warn", "The robot moves"],
  done: ["good", "Done: the plan was driven to its end"],
  aborted: ["warn", "Stopped"],
  faulted: ["fault", "A fault ended the session"],
};

function takeStatus(status) {
  const now = status.session;
  const state = root.ownerDocument.querySelector("[data-live-state]");
  // Empty figures would only look broken: they appear with the first session.
  const something = Boolean(now) || axes.some((axis) => axis.time.length);
  root.querySelector("[data-idle]").hidden = something;
  for (const part of root.querySelectorAll("[data-seen]")) part.hidden = !something;
  if (!now) {
    state.className = "state idle";
    state.textContent = "Nothing moves";
    return;
  }
  if (session && session !== `${now.experiment}/${now.id}`) axes.forEach((axis) => axis.clear());
  session = `${now.experiment}/${now.id}`;
  const [kind, words] = WORDS[now.state] ?? ["idle", now.state];
  state.className = `state ${kind}`;
  state.textContent = words;
  root.ownerDocument.querySelector("[data-live-words]").textContent = `${now.experiment}, ${now.id}`;
  const running = now.state === "running" && now.fraction > 0;
  set("[data-left]", running ? fixed((now.elapsed * (1 - now.fraction)) / now.fraction, 0) : now.state === "done" ? "0" : "–");
  const figures = status.figures;
  if (figures) {
    set("[data-jitter]", figures.sync_jitter == null ? "–" : fixed(figures.sync_jitter * 1e6, figures.sync_jitter < 1e-5 ? 1 : 0));
    set("[data-missing]", String(figures.missing));
    set("[data-rows]", String(now.elapsed ? Math.round(now.elapsed / cycle) : figures.rows).replace(/\B(?=(\d{3})+$)/g, "\u202f"));
  }
  const ended = ["aborted", "faulted"].includes(now.state);
  const fault = root.querySelector("[data-fault]");
  fault.hidden = !ended;
  if (ended) {
    fault.className = `message ${now.state === "faulted" ? "fault" : "warn"}`;
    set("[data-fault-title]", now.state === "faulted" ? "A fault ended the session." : "The session was stopped.");
    set("[data-fault-words]", now.reason);
    set("[data-fault-todo]", now.state === "faulted" ? "What was measured is kept. Remove the cause at the machine, then prepare the session again." : "What was measured is kept.");
  }
  const events = root.querySelector("[data-events]");
  root.querySelector("[data-events-panel]").hidden = !now.events.length;
  events.replaceChildren(
    ...now.events.toReversed().slice(0, 8).map((event) => {
      const item = document.createElement("li");
      const time = document.createElement("span");
      const words = document.createElement("span");
      time.className = "small faint";
      time.textContent = event.time.slice(11, 19);
      words.className = `state ${{ faulted: "fault", aborted: "warn" }[event.state] ?? "good"}`;
      words.textContent = event.words;
      item.append(time, words);
      return item;
    }),
  );
}

let wait = 250; // ms until the next attempt to come back
function connect() {
  const address = new URL(root.dataset.live, location.href);
  address.protocol = address.protocol.replace("http", "ws");
  const socket = new WebSocket(address);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => {
    wait = 250;
    root.querySelector("[data-lost]").hidden = true;
  };
  socket.onmessage = ({ data }) => (typeof data === "string" ? takeStatus(JSON.parse(data)) : takeBlock(data));
  // A broken line is not told to a socket until much later; the browser knows at once.
  const offline = () => socket.close();
  addEventListener("offline", offline, { once: true });
  socket.onclose = () => {
    removeEventListener("offline", offline);
    root.querySelector("[data-lost]").hidden = false;
    setTimeout(connect, wait);
    wait = Math.min(wait * 2, 4000);
  };
}
connect();
