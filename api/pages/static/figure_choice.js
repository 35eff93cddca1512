// Figures in which samples are chosen: a press takes the cell or interval under it, a drag several. Each shows what was chosen
// in any picture: its own range as a frame, the samples as dots, as bars where it counts them or states their error, as a line
// where it draws what they do together.
import { choose, chosenNow } from "./selection.js";

const SVG = "http://www.w3.org/2000/svg";
const draw = (name, attributes, within) => {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  within.append(made);
  return made;
};

class Figure {
  constructor(svg) {
    this.svg = svg;
    this.axes = JSON.parse(svg.dataset.axes);
    this.grip = null;
    // Where neither axis has intervals nothing is chosen: the figure shows what is chosen elsewhere.
    if (!this.axes.x.edges.length && !this.axes.y.edges.length) return;
    svg.classList.add("choosable");
    svg.addEventListener("pointerdown", (event) => this.down(event));
    svg.addEventListener("pointermove", (event) => this.grip && this.frame(this.between(this.grip, this.cell(event) ?? this.grip)));
    svg.addEventListener("pointerup", (event) => this.up(event));
    svg.addEventListener("pointercancel", () => this.let());
  }

  place(axis, value) {
    const { ends, at } = this.axes[axis];
    const part = (Math.min(Math.max(value, ends[0]), ends[1]) - ends[0]) / (ends[1] - ends[0]);
    return at[0] + part * (at[1] - at[0]);
  }

  // number of the cell along each axis that has any; null outside
  cell(event) {
    const box = this.svg.getBoundingClientRect();
    const { width, height } = this.svg.viewBox.baseVal;
    const where = { x: ((event.clientX - box.left) / box.width) * width, y: ((event.clientY - box.top) / box.height) * height };
    const found = {};
    for (const axis of ["x", "y"]) {
      const { ends, at, edges } = this.axes[axis];
      const part = (where[axis] - at[0]) / (at[1] - at[0]);
      if (part < 0 || part > 1) return null;
      if (!edges.length) continue;
      const value = ends[0] + part * (ends[1] - ends[0]);
      const above = edges.findIndex((edge) => edge > value);
      found[axis] = Math.min(Math.max((above < 0 ? edges.length : above) - 1, 0), edges.length - 2);
    }
    return found;
  }

  between(first, last) {
    const ranges = {};
    for (const axis of Object.keys(first)) {
      const { column, edges } = this.axes[axis];
      ranges[column] = [edges[Math.min(first[axis], last[axis])], edges[Math.max(first[axis], last[axis]) + 1]];
    }
    return ranges;
  }

  down(event) {
    if (event.button !== 0) return;
    this.grip = this.cell(event);
    if (this.grip) this.svg.setPointerCapture(event.pointerId);
  }

  up(event) {
    if (!this.grip) return;
    const ranges = this.between(this.grip, this.cell(event) ?? this.grip);
    this.let();
    choose({ session: null, ranges });
  }

  let() {
    this.grip = null;
    this.show(this.found);
  }

  layer() {
    this.svg.querySelector(".choice-layer")?.remove();
    return draw("g", { class: "choice-layer" }, this.svg);
  }

  frame(ranges, layer = this.layer()) {
    const sides = {};
    for (const axis of ["x", "y"]) {
      const { column, ends } = this.axes[axis];
      const [low, high] = ranges[column] ?? ends;
      const [one, other] = [this.place(axis, low), this.place(axis, high)];
      sides[axis] = [Math.min(one, other), Math.max(Math.abs(other - one), 1.5)];
    }
    draw("rect", { class: "choice-frame", x: sides.x[0], y: sides.y[0], width: sides.x[1], height: sides.y[1] }, layer);
  }

  // found : what the service says of the choice; null while it is asked, or where nothing is chosen
  show(found) {
    this.found = found;
    const layer = this.layer();
    const { ranges } = chosenNow();
    const { x, y } = this.axes;
    if (found && y.column === null) this.bars(found.histogram, layer);
    else if (found?.[y.column]) this.line(found[y.column][x.column], found[y.column][y.column], layer);
    else if (found?.points[x.column] && found.points[y.column]) {
      const dots = found.points[x.column].map((value, index) => `M${this.place("x", value).toFixed(1)} ${this.place("y", found.points[y.column][index]).toFixed(1)}h0`);
      draw("path", { class: "choice-dots", d: dots.join("") }, layer);
    }
    if (ranges[x.column] || ranges[y.column]) this.frame(ranges, layer);
  }

  // broken where a value is missing
  line(along, upward, layer) {
    let pen = "M";
    const d = along.map((value, index) => {
      if (upward[index] === null) return (pen = "M"), "";
      const point = `${pen}${this.place("x", value).toFixed(1)} ${this.place("y", upward[index]).toFixed(1)}`;
      pen = "L";
      return point;
    });
    draw("path", { class: "choice-line", d: d.join("") }, layer);
  }

  bars(shares, layer) {
    const { edges } = this.axes.x;
    shares.forEach((share, bin) => {
      if (!share) return;
      const [left, right, top, zero] = [this.place("x", edges[bin]), this.place("x", edges[bin + 1]), this.place("y", share), this.place("y", 0)];
      draw("rect", { class: "choice-bar", x: left, y: top, width: Math.max(right - left - 0.6, 0.6), height: Math.max(zero - top, 1) }, layer);
    });
  }
}

// Bars of groups: beneath those of each group a thin one, of its chosen samples.
class Groups {
  constructor(svg) {
    this.svg = svg;
    this.groups = JSON.parse(svg.dataset.groups);
  }

  show(found) {
    this.svg.querySelector(".choice-layer")?.remove();
    if (!found) return;
    const layer = draw("g", { class: "choice-layer" }, this.svg);
    const { ends, at, rows } = this.groups;
    for (const [group, { error, words }] of Object.entries(found.payloads)) {
      if (rows[group] === undefined) continue;
      const width = Math.min((error - ends[0]) / (ends[1] - ends[0]), 1) * (at[1] - at[0]);
      draw("rect", { class: "choice-bar", x: at[0], y: rows[group], width: Math.max(width, 1), height: 6 }, layer);
      const outside = width < 0.6 * (at[1] - at[0]);
      const said = draw("text", { class: `choice-text${outside ? "" : " end"}`, x: at[0] + width + (outside ? 6 : 0), y: rows[group] + (outside ? 6.5 : 15) }, layer);
      said.textContent = words;
    }
  }
}

const shown = (selector, Kind) => [...document.querySelectorAll(selector)].map((svg) => new Kind(svg));
const figures = [...shown("svg[data-axes]", Figure), ...shown("svg[data-groups]", Groups)];
document.addEventListener("samples-chosen", (event) => figures.forEach((figure) => figure.show(event.detail)));
