// Live samples: the service sends blocks of float32 at about 20 Hz over one WebSocket, already thinned; the status is text.
// The figures are set at 5 Hz so that they can be read; the strips are drawn once per frame at most.
import { Axis, fixed, set } from "./live_axis.js";

const READABLE = 200; // ms between changes of a figure
const NEAR = 0.7; // share of a limit from which on it is shown as a warning
const RESTLESS = 0.1; // of the cycle: SYNC jitter that is worth an operator's look
const root = document.querySelector("[data-live]");
const cycle = Number(root.dataset.cycle);
const STATES = JSON.parse(root.dataset.states);
const axes = [...root.querySelectorAll("[data-axis]")].map((panel) => new Axis(panel));
document.addEventListener("theme-changed", () => axes.forEach((axis) => axis.build()));

let dirty = false;
let saidAt = 0;
let session = null;

function sayWorst() {
  const worst = axes.filter((axis) => axis.time.length).map((axis) => axis.nearest()).sort((one, other) => other.share - one.share)[0];
  if (!worst) return;
  set("[data-worst-joint]", axes.length > 1 ? worst.joint : "", root);
  set("[data-worst-share]", `${fixed(100 * worst.share, 0)} %`, root);
  set("[data-worst-words]", worst.words, root);
  root.querySelector("[data-worst]").classList.toggle("near", worst.share > NEAR);
}

function frame(now) {
  if (dirty) axes.forEach((axis) => axis.draw());
  if (dirty && now - saidAt > READABLE) {
    axes.forEach((axis) => axis.say());
    sayWorst();
    root.querySelector("[data-predicted]").hidden = !axes.some((axis) => axis.predicted.some((value) => value !== null));
    saidAt = now;
  }
  dirty = false;
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
  const currents = axes.map((_, index) => column(1 + count + index).at(-1));
  const groups = ["position", "current", "following", "planned", "predicted", "temperature"];
  axes.forEach((axis, index) => {
    const given = Object.fromEntries(groups.map((name, group) => [name, column(1 + group * count + index)]));
    axis.take({ time, ...given }, axis.gain.reduce((sum, gain, other) => sum + (gain ? gain * currents[other] : 0), 0));
  });
  dirty = true;
}

function sayBus(figures, elapsed) {
  const { sync_jitter: jitter, missing, rows } = figures;
  set("[data-jitter]", jitter == null ? "–" : fixed(jitter * 1e6, jitter < 1e-5 ? 1 : 0), root);
  set("[data-missing]", String(missing), root);
  set("[data-rows]", String(elapsed ? Math.round(elapsed / cycle) : rows).replace(/^\d{5,}$/, (count) => count.replace(/\B(?=(\d{3})+$)/g, "\u202f")), root);
  root.querySelector('[data-bus="jitter"]').classList.toggle("wrong", jitter > RESTLESS * cycle);
  root.querySelector('[data-bus="missing"]').classList.toggle("wrong", missing > 0);
}

function sayEvents(events) {
  root.querySelector("[data-events-panel]").hidden = !events.length;
  root.querySelector("[data-events]").replaceChildren(
    ...events.toReversed().slice(0, 8).map((event) => {
      const item = document.createElement("li");
      const time = document.createElement("span");
      const words = document.createElement("span");
      time.className = "small faint";
      time.textContent = event.time.slice(11, 19);
      words.className = `state ${STATES[event.state]?.kind ?? "good"}`;
      // What is advised for the command line has its own way on the page (api/pages/session_words.py does alike).
      words.textContent = event.words.split("; ").filter((part) => !part.includes("`coulomb ")).join("; ");
      item.append(time, words);
      return item;
    }),
  );
}

let told = null; // state of the session as this page has said it
function takeStatus(status) {
  const now = status.session;
  const something = Boolean(now) && (STATES[now.state].moves || axes.some((axis) => axis.time.length));
  const idle = root.querySelector("[data-idle]");
  if (idle) idle.hidden = Boolean(now) || something;
  // Empty figures would only look broken: they appear with the first samples.
  for (const part of root.querySelectorAll("[data-seen]")) part.hidden = !something;
  const name = now ? `${now.experiment}/${now.id}` : null;
  if (session && name && session !== name) axes.forEach((axis) => axis.clear());
  session = name ?? session;
  const words = STATES[now?.state ?? ""];
  const place = document.querySelector("[data-live-state]");
  place.className = `state ${words.kind}`;
  if (place.textContent !== words.long) place.textContent = words.long;
  set("[data-live-words]", now ? `${now.experiment_name}, ${now.id}` : "", document);
  // The bar of the page says the same at the same moment.
  document.dispatchEvent(new CustomEvent("rig-told", { detail: { rig: root.dataset.rig, ...words } }));
  const changed = told !== null && told !== `${name}: ${now?.state}`;
  told = `${name}: ${now?.state}`;
  if (changed) document.dispatchEvent(new CustomEvent("session-moved"));
  if (!now) return;
  const running = now.state === "running" && now.fraction > 0;
  root.querySelector("[data-left-place]").hidden = !running && now.state !== "done";
  set("[data-left]", running ? fixed((now.elapsed * (1 - now.fraction)) / now.fraction, 0) : now.state === "done" ? "0" : "–", root);
  if (status.figures) sayBus(status.figures, now.elapsed);
  sayEvents(now.events);
}

// Samples come by one way and answers by another: each may break alone, and either is told until it is back.
const silent = new Set();
function tellLost(way, lost) {
  if (lost) silent.add(way);
  else silent.delete(way);
  root.querySelector("[data-lost]").hidden = silent.size === 0;
}
document.addEventListener("connection-lost", () => tellLost("answers", true));
document.addEventListener("connection-back", () => tellLost("answers", false));

let wait = 250; // ms until the next attempt to come back
function connect() {
  const address = new URL(root.dataset.live, location.href);
  address.protocol = address.protocol.replace("http", "ws");
  const socket = new WebSocket(address);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => {
    wait = 250;
    tellLost("samples", false);
  };
  socket.onmessage = ({ data }) => (typeof data === "string" ? takeStatus(JSON.parse(data)) : takeBlock(data));
  // A broken line is not told to a socket until much later; the browser knows at once.
  const offline = () => socket.close();
  addEventListener("offline", offline, { once: true });
  socket.onclose = () => {
    removeEventListener("offline", offline);
    document.dispatchEvent(new CustomEvent("rig-told", { detail: null }));
    tellLost("samples", true);
    setTimeout(connect, wait);
    wait = Math.min(wait * 2, 4000);
  };
}
connect();
