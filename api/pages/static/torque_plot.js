// Measured and predicted torque over time with the error beneath. The browser holds only what it draws: every zoom asks the
// server for the least and greatest value per column of the visible range.
import { keep, kept } from "./address.js";
import { colour } from "./colours.js";
import { gestures } from "./plot_gestures.js";
import { chosenNow, chosenText, choose } from "./selection.js";

// start as float64, rows and points as uint32, then rows of float32, little-endian: time, then the named curves
function decode(buffer, names) {
  const view = new DataView(buffer);
  const start = view.getFloat64(0, true);
  const rows = view.getUint32(8, true);
  const points = view.getUint32(12, true);
  const columns = [];
  for (let row = 0; row < rows; row += 1) columns.push(new Float32Array(buffer, 16 + 4 * row * points, points));
  // uPlot breaks a line at null, not at NaN
  const broken = (column) => Array.from(column, (value) => (Number.isNaN(value) ? null : value));
  const signals = Object.fromEntries(names.map((name, index) => [name, broken(columns[index + 1])]));
  return { time: Float64Array.from(columns[0], (offset) => start + offset), signals };
}

// What each of the two plots draws, from behind to in front: curve, colour, dash.
const MODEL = [6, 3];
const OTHER = [2, 3];
const CURVES = {
  alone: { above: [["measured", "measured"], ["predicted", "predicted", MODEL]], beneath: [["error", "error"]] },
  beside: {
    above: [["measured", "measured"], ["predicted beside", "predicted-other", MODEL], ["predicted", "predicted", MODEL]],
    beneath: [["error beside", "before"], ["error", "error"]],
  },
  overlay: {
    above: [["measured overlay", "measured-other", OTHER], ["predicted overlay", "predicted-other", OTHER], ["measured", "measured"], ["predicted", "predicted", MODEL]],
    beneath: [["error overlay", "before", OTHER], ["error", "error"]],
  },
  // Colour says the model, dots say the other session.
  both: {
    above: [["measured overlay", "measured-other", OTHER], ["predicted overlay beside", "predicted-other", OTHER], ["predicted overlay", "predicted", OTHER],
      ["measured", "measured"], ["predicted beside", "predicted-other", MODEL], ["predicted", "predicted", MODEL]],
    beneath: [["error overlay beside", "before", OTHER], ["error overlay", "error", OTHER], ["error beside", "before"], ["error", "error"]],
  },
};

const SETTLED = 60; // ms without a further wheel or move, after which the range is asked for
const GUTTER = 56; // px of the vertical axis; equal in both plots, so that their time axes line up
const RIGHT = 12;
const NAMES = 22; // px at the top, where several sessions are named

class TorquePlot {
  constructor(panel) {
    this.panel = panel;
    this.link = panel.dataset.torquePlot;
    this.unit = panel.dataset.unit;
    this.overlaid = panel.querySelector("[data-overlay]");
    this.layOver(kept("overlay"));
    this.whole = null;
    this.range = null;
    this.pending = null;
    this.sessions = []; // [begin in s, file, own time there in s]; several stand end to end
    panel.querySelector("[data-whole]").addEventListener("click", () => this.show(null));
    panel.tabIndex = -1;
    new ResizeObserver(() => this.resize()).observe(panel);
    document.addEventListener("theme-changed", () => this.redraw());
    for (const name of ["above", "beneath"])
      panel.querySelector(`[data-${name}]`).addEventListener("dblclick", () => this.show(null));
    document.addEventListener("keydown", (event) => this.key(event));
    document.addEventListener("samples-chosen", () => this.drawnFor !== chosenText() && this.show(this.range));
    panel.querySelector("[data-choose-stretch]").addEventListener("click", () => this.chooseStretch());
    this.overlaid?.addEventListener("change", () => {
      keep("overlay", this.overlaid.value);
      this.layOver(this.overlaid.value);
      for (const plot of [this.above, this.beneath]) plot?.destroy();
      this.above = null;
      this.show(null);
    });
    this.show(null);
  }

  // Another session from the same beginning; none if it is not among those that can be.
  layOver(file) {
    const can = [...(this.overlaid?.options ?? [])].some((option) => option.value === file);
    this.overlay = can ? file : "";
    if (this.overlaid) this.overlaid.value = this.overlay;
    const { beside } = this.panel.dataset;
    this.kind = this.overlay ? (beside ? "both" : "overlay") : beside ? "beside" : "alone";
    for (const key of this.panel.querySelectorAll("[data-overlay-key]")) key.hidden = !this.overlay;
  }

  // The stretch that is seen, of the session that its middle lies in; all of the only session.
  chooseStretch() {
    if (!this.range && this.sessions.length === 1) return choose({ session: this.sessions[0][1], ranges: {} });
    const [start, stop] = this.range ?? this.whole;
    const [begin, file, own] = this.sessions.findLast(([at]) => at <= (start + stop) / 2) ?? this.sessions[0];
    const place = this.sessions.findIndex((session) => session[1] === file);
    const end = this.sessions[place + 1]?.[0] ?? Infinity;
    const at = (time) => own + Math.min(Math.max(time, begin), end) - begin;
    choose({ session: file, ranges: { time: [at(start), at(stop)] } });
  }

  async show(range) {
    clearTimeout(this.settling);
    this.pending?.abort();
    this.pending = new AbortController();
    const width = Math.max(200, Math.round(this.panel.clientWidth * Math.min(devicePixelRatio, 2)));
    this.points = 2 * width;
    const query = new URLSearchParams({ points: this.points });
    if (range) {
      query.set("start", range[0]);
      query.set("stop", range[1]);
    }
    try {
      const begun = performance.now();
      if (this.overlay) query.set("overlay", this.overlay);
      const chosen = chosenText();
      if (chosen) query.set("chosen", chosen);
      const response = await fetch(`${this.link}&${query}`, { signal: this.pending.signal });
      if (!response.ok) throw new Error(`status ${response.status}`);
      this.data = decode(await response.arrayBuffer(), response.headers.get("X-Curves").split(","));
      this.drawnFor = chosen;
      const figure = (name) => Number(response.headers.get(name) ?? NaN);
      this.figures = { error: figure("X-Relative-Error"), rms: figure("X-Error-RMS") };
      this.sessions = JSON.parse(response.headers.get("X-Sessions") ?? "[]");
      this.range = range;
      if (!range) this.whole = [this.data.time[0], this.data.time.at(-1)];
      this.draw();
      this.panel.dataset.shownAfter = String(Math.round(performance.now() - begun));
    } catch (failure) {
      if (failure.name !== "AbortError") this.say(`The samples could not be fetched: ${failure.message}. Try again.`);
    }
  }

  // A range that is still moving: what is at hand is drawn at once, what is missing is asked for when it rests.
  move(range) {
    this.pending?.abort(); // an answer under way would put back the range that it was asked for
    this.range = range;
    for (const plot of [this.above, this.beneath]) plot.setScale("x", { min: range[0], max: range[1] });
    clearTimeout(this.settling);
    const [start, stop] = this.whole;
    const all = range[0] <= start && range[1] >= stop;
    this.settling = setTimeout(() => this.show(all ? null : range), SETTLED);
  }

  // Chosen samples are shaded over the whole height, so that a single one is seen too.
  drawChosen(plot) {
    const marks = this.data.signals.chosen;
    if (!marks) return;
    const { ctx, bbox } = plot;
    const { time } = this.data;
    const at = (index) => plot.valToPos(time[index], "x", true);
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.fillStyle = colour("choice-soft");
    for (let index = 0; index < marks.length; index += 1) {
      if (marks[index] === null) continue;
      let last = index;
      while (last + 1 < marks.length && marks[last + 1] !== null) last += 1;
      const left = at(index);
      ctx.fillRect(left, bbox.top, Math.max(at(Math.min(last + 1, marks.length - 1)) - left, 2), bbox.height);
      index = last;
    }
    ctx.restore();
  }

  drawSessions(plot, named) {
    if (this.sessions.length < 2 || this.overlay) return;
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.strokeStyle = ctx.fillStyle = colour("ink-faint");
    ctx.textAlign = "left";
    ctx.font = `${11 * devicePixelRatio}px "Inter", system-ui, sans-serif`;
    ctx.setLineDash([2 * devicePixelRatio, 3 * devicePixelRatio]);
    this.sessions.forEach(([begin, file], index) => {
      const x = Math.round(plot.valToPos(begin, "x", true));
      if (x < bbox.left - 1 || x > bbox.left + bbox.width) return;
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      const next = this.sessions[index + 1] ? plot.valToPos(this.sessions[index + 1][0], "x", true) : bbox.left + bbox.width;
      const name = `${index + 1} · ${file.replace(/\.[^.]*$/, "")}`;
      const words = ctx.measureText(name).width < next - x - 8 ? name : String(index + 1);
      if (named) ctx.fillText(words, x + 4 * devicePixelRatio, bbox.top + 11 * devicePixelRatio);
    });
    ctx.restore();
  }

  say(words) {
    this.panel.querySelector("[data-cursor]").textContent = words;
  }

  draw() {
    const [start, stop] = this.range ?? this.whole;
    const short = (value) => String(+value.toPrecision(3));
    const { error, rms } = this.figures;
    const figures = this.range && Number.isFinite(error) ? `; this window: error ${short(100 * error)} %, ${short(rms)} ${this.unit} RMS` : "";
    this.panel.querySelector("[data-range]").textContent = `${start.toFixed(2)} to ${stop.toFixed(2)} s${figures}`.replaceAll("-", "−");
    if (this.above) {
      this.dashes();
      this.above.setData([this.data.time, ...this.series("above")], false);
      this.beneath.setData([this.data.time, ...this.series("beneath")], false);
      for (const plot of [this.above, this.beneath]) plot.batch(() => this.fit(plot, start, stop));
      return;
    }
    this.build();
    this.dashes();
    for (const plot of [this.above, this.beneath]) plot.batch(() => this.fit(plot, start, stop));
  }

  // A dash tells curves apart where samples are drawn. Where least and greatest values of many samples are, it cannot be
  // seen, and makes the browser half as slow again.
  dashes() {
    const samples = this.data.time.length < this.points;
    for (const plot of [this.above, this.beneath])
      for (const series of plot.series.slice(1)) series.dash = samples || this.overlay ? series.pattern : undefined;
  }

  fit(plot, start, stop) {
    plot.setScale("x", { min: start, max: stop });
    const drawn = plot.data.slice(1);
    let low = Infinity;
    let high = -Infinity;
    for (const values of drawn)
      for (const value of values) {
        if (value === null) continue;
        if (value < low) low = value;
        if (value > high) high = value;
      }
    if (plot === this.beneath) high = Math.max(Math.abs(low), Math.abs(high), 1e-9), low = -high;
    const margin = (high - low) * 0.05 || 1;
    // The names of the sessions stand above the curves.
    const room = plot === this.above && this.sessions.length > 1 && !this.overlay ? NAMES / plot.height : 0;
    plot.setScale("y", { min: low - margin, max: high + margin + (high - low) * room });
  }

  series(which) {
    return CURVES[this.kind][which].map(([name]) => this.data.signals[name] ?? []);
  }

  build() {
    const sync = uPlot.sync(this.link);
    const make = (which, words) => {
      const place = this.panel.querySelector(`[data-${which}]`);
      place.replaceChildren();
      const font = '11px "Inter", system-ui, sans-serif';
      const axis = { stroke: colour("ink-soft"), grid: { stroke: colour("grid"), width: 1 }, ticks: { show: false }, font, labelFont: font };
      return new uPlot(
        {
          width: place.clientWidth,
          height: place.clientHeight,
          padding: [8, RIGHT, 0, 0],
          legend: { show: false },
          cursor: { sync: { key: sync.key, setSeries: false }, drag: { x: true, y: false, setScale: false, dist: 6 }, points: { show: false } },
          scales: { x: { time: false, auto: false }, y: { auto: false } },
          series: [{}, ...CURVES[this.kind][which].map(([, role, pattern]) => ({
            stroke: colour(role),
            width: role === "measured" ? 1.6 : 1.2,
            pattern,
            points: { show: false },
            spanGaps: false,
          }))],
          axes: [
            { ...axis, size: 22, label: which === "beneath" ? "time, s" : undefined, labelSize: 17, gap: 3, space: 70 },
            { ...axis, size: GUTTER - 18, label: `${words}, ${this.unit}`, labelSize: 18, gap: 4, space: which === "above" ? 34 : 16,
              values: (_, ticks) => ticks.map((tick) => String(+tick.toPrecision(6)).replace("-", "−")) },
          ],
          hooks: {
            setSelect: [(plot) => {
              if (plot.select.width < 6) return;
              const start = plot.posToVal(plot.select.left, "x");
              const stop = plot.posToVal(plot.select.left + plot.select.width, "x");
              plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
              this.show([start, stop]);
            }],
            setCursor: [(plot) => which === "above" && this.readout(plot)],
            drawAxes: [(plot) => this.drawChosen(plot)],
            draw: [(plot) => this.drawSessions(plot, which === "above")],
          },
        },
        [this.data.time, ...this.series(which)],
        place,
      );
    };
    this.above = make("above", this.unit === "N" ? "force" : "torque");
    this.beneath = make("beneath", "error");
    for (const plot of [this.above, this.beneath])
      gestures(plot, { range: () => this.range ?? this.whole, whole: () => this.whole, show: (range) => this.move(range), plots: () => [this.above, this.beneath] });
    sync.sub(this.above);
    sync.sub(this.beneath);
  }

  readout(plot) {
    const index = plot.cursor.idx;
    if (index == null) return;
    const signals = this.data.signals;
    const show = (value) => (Number.isFinite(value) ? value.toFixed(2).replace("-", "−") : "–");
    const named = { measured: "measured", predicted: "model", error: "error", "error beside": "error of the model beside",
      "measured overlay": "other session, measured", "error overlay": "its error", "error overlay beside": "its error, model beside" };
    const parts = [["time", `${this.data.time[index].toFixed(3)} s`]];
    for (const [name, words] of Object.entries(named))
      if (signals[name]) parts.push([words, `${show(signals[name][index])} ${this.unit}`]);
    this.panel.querySelector("[data-cursor]").replaceChildren(
      ...parts.map(([name, value]) => {
        const span = document.createElement("span");
        const number = document.createElement("b");
        number.textContent = value;
        span.append(`${name} `, number);
        return span;
      }),
    );
  }

  key(event) {
    if (localStorage.getItem("single-keys") === "off") return;
    if (!this.whole || event.ctrlKey || event.metaKey || event.target.closest("input, select, textarea, button, a")) return;
    const [start, stop] = this.range ?? this.whole;
    const span = stop - start;
    const moves = { ArrowLeft: [-span / 4, -span / 4], ArrowRight: [span / 4, span / 4], "+": [span / 4, -span / 4], "-": [-span / 2, span / 2] };
    const move = moves[event.key];
    if (!move) return;
    event.preventDefault();
    const next = [Math.max(start + move[0], this.whole[0]), Math.min(stop + move[1], this.whole[1])];
    const all = next[0] <= this.whole[0] && next[1] >= this.whole[1];
    if (next[1] - next[0] > 1e-3) this.show(all ? null : next);
  }

  resize() {
    if (!this.above) return;
    for (const [plot, name] of [[this.above, "above"], [this.beneath, "beneath"]]) {
      const place = this.panel.querySelector(`[data-${name}]`);
      if (Math.abs(plot.width - place.clientWidth) > 1) plot.setSize({ width: place.clientWidth, height: place.clientHeight });
    }
    clearTimeout(this.refetch);
    this.refetch = setTimeout(() => this.show(this.range), 200);
  }

  redraw() {
    if (!this.data) return;
    this.above?.destroy();
    this.beneath?.destroy();
    this.above = null;
    this.draw();
  }
}

for (const panel of document.querySelectorAll("[data-torque-plot]")) new TorquePlot(panel);
