// One axis of the live page: its figures, and two strips of the last seconds: the position under which the planned one
// lies, and the current under which the predicted one lies, each with its limits.
import { colour } from "./colours.js";

const WINDOW = 12; // s of motion on the strips
const POINTS = 2500; // rows kept
const PEAK = 1.0; // s over which the share of a limit is the highest, so that it can be read
const MARGIN = 0.08; // of a strip's range, beyond its limits

export const fixed = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits).replace("-", "−") : "–");
export const set = (selector, words, within) => {
  const place = within.querySelector(selector);
  if (place && place.textContent !== words) place.textContent = words;
};
// the newest value that came; one that did not is null
const newest = (values) => values.findLast((value) => value !== null);
const given = (value) => (Number.isFinite(value) ? value : null);

const COLUMNS = ["time", "position", "current", "following", "planned", "predicted", "temperature"];

export class Axis {
  constructor(panel) {
    this.panel = panel;
    this.joint = panel.dataset.joint;
    const { followingLimit, currentLimit, temperatureLimit, low, high } = panel.dataset;
    this.limits = { following: +followingLimit, current: +currentLimit, temperature: temperatureLimit ? +temperatureLimit : Infinity };
    this.range = [+low, +high];
    this.gain = JSON.parse(panel.dataset.gain);
    this.units = { position: panel.dataset.unit, current: "A" };
    this.places = Object.fromEntries(["position", "current"].map((name) => [name, panel.querySelector(`[data-strip="${name}"]`)]));
    this.clear();
    this.build();
    const sized = new ResizeObserver(() => {
      for (const [name, plot] of Object.entries(this.plots)) plot.setSize(this.size(this.places[name]));
    });
    for (const place of Object.values(this.places)) sized.observe(place);
  }

  clear() {
    for (const name of COLUMNS) this[name] = [];
    this.torque = NaN;
    this.reach = 0; // A, the largest current so far: the strip's scale only grows
    this.begun = null; // s of the rig's clock at the first row: the strip counts from there
  }

  size(place) {
    return { width: Math.max(place.clientWidth, 100), height: Math.max(place.clientHeight, 60) };
  }

  // The range of a strip holds its limits as long as the curve would not become too small to be read.
  scale(name) {
    if (name === "position") {
      const margin = MARGIN * (this.range[1] - this.range[0]);
      return [this.range[0] - margin, this.range[1] + margin];
    }
    const most = Math.max(this.reach, 0.1 * this.limits.current);
    const end = most > 0.4 * this.limits.current ? this.limits.current : most;
    return [-end * (1 + MARGIN), end * (1 + MARGIN)];
  }

  limitsOf(name) {
    return name === "position" ? this.range : [-this.limits.current, this.limits.current];
  }

  drawLimits(plot, name) {
    const { ctx, bbox } = plot;
    const [low, high] = this.scale(name);
    ctx.save();
    ctx.strokeStyle = colour("fault", this.panel);
    ctx.lineWidth = 1.5 * devicePixelRatio;
    ctx.setLineDash([4 * devicePixelRatio, 3 * devicePixelRatio]);
    for (const limit of this.limitsOf(name)) {
      if (limit < low || limit > high) continue;
      const y = Math.round(plot.valToPos(limit, "y", true));
      ctx.beginPath();
      ctx.moveTo(bbox.left, y);
      ctx.lineTo(bbox.left + bbox.width, y);
      ctx.stroke();
    }
    ctx.restore();
  }

  build() {
    for (const plot of Object.values(this.plots ?? {})) plot.destroy();
    const strips = { position: ["planned", "position", "before", "position"], current: ["predicted", "current", "predicted", "current"] };
    this.plots = Object.fromEntries(Object.entries(strips).map(([name, roles]) => [name, this.strip(name, roles)]));
  }

  strip(name, [, , beneath, above]) {
    const font = '11px "Inter", system-ui, sans-serif';
    const axis = { font, labelFont: font, ticks: { show: false }, stroke: colour("ink-soft", this.panel), grid: { stroke: colour("grid", this.panel), width: 1 } };
    return new uPlot(
      {
        ...this.size(this.places[name]),
        padding: [6, 6, 0, 0],
        legend: { show: false },
        cursor: { show: false },
        scales: { x: { time: false }, y: { range: () => this.scale(name) } },
        series: [
          {},
          { stroke: colour(beneath, this.panel), width: name === "position" ? 4.5 : 2.5, dash: name === "position" ? [10, 4] : [6, 3], alpha: 0.75, points: { show: false } },
          { stroke: colour(above, this.panel), width: 1.5, points: { show: false } },
        ],
        axes: [
          { ...axis, size: 20, gap: 2, space: 60, values: (_, ticks) => ticks.map((tick) => `${+tick.toPrecision(6)} s`) },
          { ...axis, size: 38, gap: 3, space: 22, label: `${name}, ${this.units[name]}`, labelSize: 14, labelGap: 0, values: (_, ticks) => ticks.map((tick) => String(+tick.toPrecision(6)).replace("-", "−")) },
        ],
        hooks: { draw: [(plot) => this.drawLimits(plot, name)] },
      },
      this.data(name),
      this.places[name],
    );
  }

  data(name) {
    return name === "position" ? [this.time, this.planned, this.position] : [this.time, this.predicted, this.current];
  }

  // rows : name -> values of this axis; torque : of the newest row
  take(rows, torque) {
    this.begun ??= rows.time[0];
    this.torque = torque;
    for (let row = 0; row < rows.time.length; row += 1) {
      this.time.push(rows.time[row] - this.begun);
      for (const name of COLUMNS.slice(1)) this[name].push(given(rows[name][row]));
      const most = Math.max(Math.abs(given(rows.current[row]) ?? 0), Math.abs(given(rows.predicted[row]) ?? 0));
      if (most > this.reach) this.reach = 1.1 * most;
    }
    const oldest = this.time.at(-1) - WINDOW;
    let cut = Math.max(0, this.time.length - POINTS);
    while (cut < this.time.length && this.time[cut] < oldest) cut += 1;
    if (cut) for (const name of COLUMNS) this[name].splice(0, cut);
  }

  draw() {
    for (const [name, plot] of Object.entries(this.plots)) plot.setData(this.data(name));
  }

  // The limit that this axis came nearest to within the last second: its share, and the value in words.
  nearest() {
    const small = this.panel.dataset.small;
    const kinds = [
      ["following", "following error", 1000, small],
      ["current", "current", 1, "A"],
      ["temperature", "temperature", 1, "°C"],
    ];
    const first = this.time.findLastIndex((time) => time < this.time.at(-1) - PEAK) + 1;
    let worst = { share: -1, joint: this.joint, words: "" };
    for (const [name, words, factor, unit] of kinds) {
      let most = 0;
      for (let row = first; row < this.time.length; row += 1) most = Math.max(most, Math.abs(this[name][row] ?? 0));
      const limit = this.limits[name];
      if (most / limit > worst.share)
        worst = { share: most / limit, joint: this.joint, words: `${words} ${+(most * factor).toPrecision(3)} of ${+(limit * factor).toPrecision(3)} ${unit}` };
    }
    return worst;
  }

  say() {
    const following = newest(this.following);
    set("[data-position]", fixed(newest(this.position), 3), this.panel);
    set("[data-current]", fixed(newest(this.current), 2), this.panel);
    set("[data-torque]", fixed(this.torque, Math.abs(this.torque) >= 100 ? 0 : 1), this.panel);
    set("[data-following]", fixed(following * 1000, Math.abs(following) >= 0.01 ? 1 : 2), this.panel);
    set("[data-temperature]", fixed(newest(this.temperature), 0), this.panel);
    const near = Math.abs(following) > 0.7 * this.limits.following;
    this.panel.querySelector("[data-following]").parentElement.classList.toggle("near", near);
  }
}
