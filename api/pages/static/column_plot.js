// Any two columns of the samples against each other. The service thins what is seen of them and loses no extreme; a dot that
// stands for many is darker. The pointer tells the nearest sample, a drag chooses a rectangle; zoom: plane_gestures.js.
import { keep, kept } from "./address.js";
import { colour } from "./colours.js";
import { PlaneGestures } from "./plane_gestures.js";
import { chosenNow, chosenText, choose } from "./selection.js";

const SETTLED = 60; // ms without a further wheel or move, after which the samples of what is seen are asked for
const MARGIN = { left: 58, right: 10, top: 8, bottom: 36 };
const CELL = 4; // px, of the grid on which samples are thinned
const NEAR = 14; // px within which a sample is told
const minus = (text) => text.replaceAll("-", "−");
const told = (value) => minus(String(+value.toPrecision(4)));

function decode(buffer) {
  const [rows, points] = new Uint32Array(buffer, 0, 2);
  return Array.from({ length: rows }, (_, row) => new Float32Array(buffer, 8 + 4 * row * points, points));
}

function range(values) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  if (!(high > low)) [low, high] = Number.isFinite(low) ? [low - 0.5, low + 0.5] : [0, 1];
  const margin = 0.03 * (high - low);
  return [low - margin, high + margin];
}

function ticks([low, high], about) {
  const raw = (high - low) / about;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].find((part) => part * power >= raw * 0.999) * power;
  const found = [];
  for (let index = Math.ceil(low / step); index * step <= high; index += 1) found.push(index * step);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return found.map((value) => [value, minus(digits > 6 ? value.toPrecision(3) : value.toFixed(digits))]);
}

class ColumnPlot {
  constructor(panel) {
    this.panel = panel;
    this.canvas = panel.querySelector("canvas");
    this.frame = panel.querySelector("[data-choice-rectangle]");
    this.readout = panel.querySelector("[data-cursor]");
    this.choices = { x: panel.querySelector("[data-x]"), y: panel.querySelector("[data-y]") };
    for (const [axis, select] of Object.entries(this.choices)) {
      const wanted = kept(axis);
      if (wanted && ![...select.options].some((option) => option.value === wanted)) select.add(new Option(wanted.replace(/^column:/, ""), wanted));
      if (wanted) select.value = wanted;
      select.addEventListener("change", () => {
        keep(axis, select.value);
        this.whole = this.zoomed = null;
        this.fetch();
      });
    }
    panel.querySelector("[data-exchange]").addEventListener("click", () => {
      const { x, y } = this.choices;
      for (const [to, from] of [[x, y], [y, x]])
        if (![...to.options].some((option) => option.value === from.value)) to.add(new Option(from.selectedOptions[0].text, from.value));
      [x.value, y.value] = [y.value, x.value];
      keep("x", x.value);
      keep("y", y.value);
      const turned = (ranges) => ranges && { x: ranges.y, y: ranges.x };
      [this.whole, this.zoomed] = [turned(this.whole), turned(this.zoomed)];
      this.fetch();
    });
    this.gestures = new PlaneGestures(this.canvas, this);
    panel.querySelector("[data-whole-plot]").addEventListener("click", () => this.view(null));
    panel.querySelector("[data-choose-seen]").addEventListener("click", () => this.chosen(this.ranges));
    panel.querySelector("[data-further]").addEventListener("click", (event) => this.further(event.currentTarget));
    document.addEventListener("theme-changed", () => this.draw());
    document.addEventListener("samples-chosen", () => this.seen && this.drawnFor !== chosenText() && this.fetch());
    this.canvas.addEventListener("pointermove", (event) => this.move(event));
    this.canvas.addEventListener("pointerdown", (event) => this.down(event));
    this.canvas.addEventListener("pointerup", (event) => this.up(event));
    this.canvas.addEventListener("pointercancel", (event) => {
      this.gestures.up(event);
      this.let();
    });
    new ResizeObserver(() => this.seen && this.draw()).observe(this.canvas);
    // Nothing is fetched for a plot that nobody has scrolled to, but when the page is printed; printing waits for nothing but this.
    const watch = new IntersectionObserver((entries) => {
      if (!entries.some((entry) => entry.isIntersecting)) return;
      watch.disconnect();
      this.seen = true;
      this.fetch();
    }, { rootMargin: "200px" });
    watch.observe(panel);
    addEventListener("beforeprint", () => {
      if (this.x) return;
      watch.disconnect();
      this.seen = true;
      this.fetchNow();
    });
  }

  // The address of the samples of what is seen.
  address(chosen) {
    const cells = (pixels) => Math.round(Math.min(Math.max(pixels / CELL, 8), 400));
    const query = new URLSearchParams({ x: this.choices.x.value, y: this.choices.y.value, across: cells(this.canvas.clientWidth), up: cells(this.canvas.clientHeight) });
    if (chosen) query.set("chosen", chosen);
    for (const [axis, [low, high]] of Object.entries(this.zoomed ?? {})) {
      query.set(`${axis}_from`, low);
      query.set(`${axis}_to`, high);
    }
    return `${this.panel.dataset.columnPlot}&${query}`;
  }

  async fetch() {
    this.pending?.abort();
    this.pending = new AbortController();
    const chosen = chosenText();
    const { zoomed } = this;
    try {
      const response = await fetch(this.address(chosen), { signal: this.pending.signal, headers: { Accept: "application/json" } });
      if (!response.ok) throw new Error((await response.json()).detail);
      this.take(response.headers.get("X-Pairs"), await response.arrayBuffer(), zoomed, chosen);
    } catch (failure) {
      if (failure.name !== "AbortError") this.readout.textContent = failure.message;
    }
  }

  // Without leaving this event: bytes come as letters, for such a request gives no others.
  fetchNow() {
    this.pending?.abort();
    const chosen = chosenText();
    const request = new XMLHttpRequest();
    request.open("GET", this.address(chosen), false);
    request.overrideMimeType("text/plain; charset=x-user-defined");
    request.send();
    if (request.status !== 200) return;
    const bytes = Uint8Array.from(request.responseText, (letter) => letter.charCodeAt(0) & 0xff);
    this.take(request.getResponseHeader("X-Pairs"), bytes.buffer, this.zoomed, chosen);
  }

  take(head, buffer, zoomed, chosen) {
    this.told = JSON.parse(head);
    const [x, y, time, session, count, mark] = decode(buffer);
    if (!zoomed) this.whole = { x: range(x), y: range(y) };
    Object.assign(this, { x, y, time, session, count, mark, ranges: zoomed ?? this.whole, drawnFor: chosen });
    this.draw();
    this.canvas.dataset.fetched = this.canvas.dataset.seen;
    if (!x.length && zoomed) this.readout.textContent = "No sample lies in what is seen here.";
    else if (!x.length) this.readout.textContent = "No sample has both: one of these columns was not recorded.";
    this.panel.dataset.drawn = `${this.told.x.name} ${this.told.y.name}`;
  }

  async further(button) {
    button.disabled = true;
    try {
      const response = await fetch(this.panel.dataset.furtherColumns, { headers: { Accept: "application/json" } });
      const found = await response.json();
      if (!response.ok) throw new Error(found.detail);
      for (const select of Object.values(this.choices)) {
        const group = document.createElement("optgroup");
        group.label = "of the record";
        for (const { name, label } of found) if (![...select.options].some((option) => option.value === name)) group.append(new Option(label, name));
        select.append(group);
      }
      button.hidden = true;
      this.readout.textContent = `${found.length} columns of the record can be chosen now.`;
    } catch (failure) {
      button.disabled = false;
      this.readout.textContent = failure.message;
    }
  }

  // What is at hand is drawn at once; what is missing of it is asked for when it rests.
  view(ranges) {
    if (!this.whole || (!ranges && !this.zoomed)) return;
    this.pending?.abort(); // an answer under way would put back the ranges that it was asked for
    this.zoomed = ranges;
    this.ranges = ranges ?? this.whole;
    this.draw();
    clearTimeout(this.settling);
    this.settling = setTimeout(() => this.fetch(), SETTLED);
  }

  area() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    return { width: width - MARGIN.left - MARGIN.right, height: height - MARGIN.top - MARGIN.bottom };
  }

  // The axes that a gesture there is of: both in the plot, one over its labels.
  axesAt([across, down]) {
    if (across < MARGIN.left) return ["y"];
    return down > MARGIN.top + this.area().height ? ["x"] : ["x", "y"];
  }

  pixel(axis, value) {
    const [low, high] = this.ranges[axis];
    const part = (value - low) / (high - low);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    return axis === "x" ? MARGIN.left + part * (width - MARGIN.left - MARGIN.right) : height - MARGIN.bottom - part * (height - MARGIN.top - MARGIN.bottom);
  }

  value(axis, pixel) {
    const [low, high] = this.ranges[axis];
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const part = axis === "x" ? (pixel - MARGIN.left) / (width - MARGIN.left - MARGIN.right) : (height - MARGIN.bottom - pixel) / (height - MARGIN.top - MARGIN.bottom);
    return low + Math.min(Math.max(part, 0), 1) * (high - low);
  }

  draw() {
    if (!this.x) return;
    const { canvas } = this;
    const { clientWidth: width, clientHeight: height } = canvas;
    const scale = Math.min(devicePixelRatio, 2);
    [canvas.width, canvas.height] = [width * scale, height * scale];
    const ctx = canvas.getContext("2d");
    ctx.scale(scale, scale);
    ctx.font = '11px "Inter", system-ui, sans-serif';
    const [right, bottom] = [width - MARGIN.right, height - MARGIN.bottom];
    const colours = { grid: colour("grid"), ink: colour("ink-soft"), dots: colour("error"), choice: colour("choice") };
    ctx.strokeStyle = colours.grid;
    ctx.fillStyle = colours.ink;
    ctx.lineWidth = 1;
    ctx.textAlign = "center";
    for (const [value, words] of ticks(this.ranges.x, width / 90)) {
      const at = Math.round(this.pixel("x", value)) + 0.5;
      ctx.beginPath(); ctx.moveTo(at, MARGIN.top); ctx.lineTo(at, bottom); ctx.stroke();
      ctx.fillText(words, at, bottom + 14);
    }
    ctx.textAlign = "right";
    for (const [value, words] of ticks(this.ranges.y, height / 45)) {
      const at = Math.round(this.pixel("y", value)) + 0.5;
      ctx.beginPath(); ctx.moveTo(MARGIN.left, at); ctx.lineTo(right, at); ctx.stroke();
      ctx.fillText(words, MARGIN.left - 6, at + 4);
    }
    ctx.textAlign = "center";
    const named = ({ label, unit }) => (unit ? `${label}, ${unit}` : label);
    ctx.fillText(named(this.told.x), (MARGIN.left + right) / 2, height - 4);
    ctx.save();
    ctx.translate(11, (MARGIN.top + bottom) / 2);
    ctx.rotate(-Math.PI / 2);
    ctx.fillText(named(this.told.y), 0, 0);
    ctx.restore();
    ctx.save();
    ctx.beginPath();
    ctx.rect(MARGIN.left, MARGIN.top, right - MARGIN.left, bottom - MARGIN.top);
    ctx.clip();
    const most = Math.log1p(this.count.reduce((most, each) => Math.max(most, each), 1));
    for (const wanted of [0, 1]) {
      ctx.fillStyle = wanted ? colours.choice : colours.dots;
      for (let index = 0; index < this.x.length; index += 1) {
        if (this.mark[index] !== wanted) continue;
        ctx.globalAlpha = wanted ? 0.9 : 0.3 + 0.7 * (Math.log1p(this.count[index]) / most);
        ctx.fillRect(this.pixel("x", this.x[index]) - 1.25, this.pixel("y", this.y[index]) - 1.25, 2.5, 2.5);
      }
    }
    ctx.restore();
    canvas.dataset.seen = [...this.ranges.x, ...this.ranges.y].join(" ");
    canvas.classList.toggle("zoomed", Boolean(this.zoomed));
    for (const part of ["whole-plot", "choose-seen"]) this.panel.querySelector(`[data-${part}]`).hidden = !this.zoomed;
    const words = `${named(this.told.y)} over ${named(this.told.x)}, ${this.told.samples} samples`;
    canvas.setAttribute("aria-label", words);
    const grouped = (count) => (count < 1e4 ? String(count) : count.toLocaleString("en").replaceAll(",", "\u202f"));
    const { seen, samples } = this.told;
    this.panel.querySelector("[data-samples]").textContent = `${seen < samples ? `${grouped(seen)} of ` : ""}${grouped(samples)} samples`;
    const { ranges } = chosenNow();
    const [own, other] = [ranges[this.told.x.name], ranges[this.told.y.name]];
    if (own || other) this.outline(own ?? this.ranges.x, other ?? this.ranges.y);
    else this.frame.hidden = true;
  }

  outline([low, high], [least, greatest]) {
    const inside = (axis, value) => this.pixel(axis, Math.min(Math.max(value, this.ranges[axis][0]), this.ranges[axis][1]));
    const [left, right] = [inside("x", low), inside("x", high)];
    const [top, bottom] = [inside("y", greatest), inside("y", least)];
    this.frame.hidden = false;
    Object.assign(this.frame.style, { left: `${left}px`, top: `${top}px`, width: `${Math.max(right - left, 1)}px`, height: `${Math.max(bottom - top, 1)}px` });
  }

  at(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  down(event) {
    if (event.button !== 0 || !this.x) return;
    this.canvas.setPointerCapture(event.pointerId);
    if (!this.gestures.down(event)) this.grip = this.at(event);
  }

  move(event) {
    if (!this.x || this.gestures.move(event)) return;
    if (this.grip) {
      const { x, y } = this.rectangle(event);
      this.outline(x, y);
    } else this.tell(event);
  }

  rectangle(event) {
    const [one, other] = [this.grip, this.at(event)];
    const sorted = (axis, place) => [this.value(axis, one[place]), this.value(axis, other[place])].sort((a, b) => a - b);
    return { x: sorted("x", 0), y: sorted("y", 1) };
  }

  up(event) {
    if (this.gestures.up(event) || !this.grip) return;
    const [one, other] = [this.grip, this.at(event)];
    const rectangle = this.rectangle(event);
    this.let();
    if (Math.hypot(one[0] - other[0], one[1] - other[1]) < 6) return this.tell(event);
    this.chosen(rectangle);
  }

  chosen({ x, y }) {
    const [along, upward] = [this.told.x.name, this.told.y.name];
    choose({ session: null, ranges: along === upward ? { [along]: x } : { [along]: x, [upward]: y } });
  }

  let() {
    this.grip = null;
    this.draw();
  }

  tell(event) {
    const [across, down] = this.at(event);
    let [nearest, least] = [-1, NEAR ** 2];
    for (let index = 0; index < this.x.length; index += 1) {
      const far = (this.pixel("x", this.x[index]) - across) ** 2 + (this.pixel("y", this.y[index]) - down) ** 2;
      if (far < least) [nearest, least] = [index, far];
    }
    if (nearest < 0) return;
    const value = ({ label, unit }, number) => [label, `${told(number)}${unit ? ` ${unit}` : ""}`];
    const parts = [value(this.told.x, this.x[nearest]), value(this.told.y, this.y[nearest]), ["at", `${this.time[nearest].toFixed(3)} s`], ["of", this.told.files[this.session[nearest]]]];
    if (this.count[nearest] > 1) parts.push(["one of", `${this.count[nearest]} here`]);
    this.readout.replaceChildren(...parts.map(([name, words]) => {
      const span = document.createElement("span");
      const bold = document.createElement("b");
      bold.textContent = words;
      span.append(`${name} `, bold);
      return span;
    }));
  }
}

for (const panel of document.querySelectorAll("[data-column-plot]")) new ColumnPlot(panel);
