// Any two columns of the samples against each other. The service thins them and loses no extreme; a dot that stands for many
// is darker. The pointer tells the nearest sample, a drag chooses a rectangle.
import { keep, kept } from "./address.js";
import { colour } from "./colours.js";
import { chosenNow, chosenText, choose } from "./selection.js";

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
      this.fetch();
    });
    panel.querySelector("[data-further]").addEventListener("click", (event) => this.further(event.currentTarget));
    document.addEventListener("theme-changed", () => this.draw());
    document.addEventListener("samples-chosen", () => this.seen && this.drawnFor !== chosenText() && this.fetch());
    this.canvas.addEventListener("pointermove", (event) => this.move(event));
    this.canvas.addEventListener("pointerdown", (event) => this.down(event));
    this.canvas.addEventListener("pointerup", (event) => this.up(event));
    this.canvas.addEventListener("pointercancel", () => this.let());
    new ResizeObserver(() => this.seen && this.draw()).observe(this.canvas);
    // Nothing is fetched for a plot that nobody has scrolled to.
    new IntersectionObserver((entries, watch) => {
      if (!entries.some((entry) => entry.isIntersecting)) return;
      watch.disconnect();
      this.seen = true;
      this.fetch();
    }, { rootMargin: "200px" }).observe(panel);
  }

  async fetch() {
    this.pending?.abort();
    this.pending = new AbortController();
    const chosen = chosenText();
    const cells = (pixels) => Math.round(Math.min(Math.max(pixels / CELL, 8), 400));
    const query = new URLSearchParams({ x: this.choices.x.value, y: this.choices.y.value, across: cells(this.canvas.clientWidth), up: cells(this.canvas.clientHeight) });
    if (chosen) query.set("chosen", chosen);
    try {
      const response = await fetch(`${this.panel.dataset.columnPlot}&${query}`, { signal: this.pending.signal, headers: { Accept: "application/json" } });
      if (!response.ok) throw new Error((await response.json()).detail);
      this.told = JSON.parse(response.headers.get("X-Pairs"));
      const [x, y, time, session, count, mark] = decode(await response.arrayBuffer());
      Object.assign(this, { x, y, time, session, count, mark, ranges: { x: range(x), y: range(y) }, drawnFor: chosen });
      this.draw();
      if (!x.length) this.readout.textContent = "No sample has both: one of these columns was not recorded.";
      this.panel.dataset.drawn = `${this.told.x.name} ${this.told.y.name}`;
    } catch (failure) {
      if (failure.name !== "AbortError") this.readout.textContent = failure.message;
    }
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
    const most = Math.log1p(this.count.reduce((most, each) => Math.max(most, each), 1));
    for (const wanted of [0, 1]) {
      ctx.fillStyle = wanted ? colours.choice : colours.dots;
      for (let index = 0; index < this.x.length; index += 1) {
        if (this.mark[index] !== wanted) continue;
        ctx.globalAlpha = wanted ? 0.9 : 0.3 + 0.7 * (Math.log1p(this.count[index]) / most);
        ctx.fillRect(this.pixel("x", this.x[index]) - 1.25, this.pixel("y", this.y[index]) - 1.25, 2.5, 2.5);
      }
    }
    ctx.globalAlpha = 1;
    const words = `${named(this.told.y)} over ${named(this.told.x)}, ${this.told.samples} samples`;
    canvas.setAttribute("aria-label", words);
    this.panel.querySelector("[data-samples]").textContent = `${this.told.samples.toLocaleString("en").replaceAll(",", " ")} samples`;
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
    this.grip = this.at(event);
    this.canvas.setPointerCapture(event.pointerId);
  }

  move(event) {
    if (!this.x) return;
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
    if (!this.grip) return;
    const [one, other] = [this.grip, this.at(event)];
    const rectangle = this.rectangle(event);
    this.let();
    if (Math.hypot(one[0] - other[0], one[1] - other[1]) < 6) return this.tell(event);
    choose({ session: null, ranges: this.told.x.name === this.told.y.name ? { [this.told.x.name]: rectangle.x } : { [this.told.x.name]: rectangle.x, [this.told.y.name]: rectangle.y } });
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
