// Zoom and pan of a plot of one column over another: the wheel and two fingers zoom about where they are, over an axis along
// that axis alone; a drag pans what is zoomed, unless the shift key is held; keys do both while the plot has the focus.

const WHEEL = 0.0018; // part of the range for each unit of the wheel, as an exponent
const NARROWEST = 1e-7; // of the whole range
const KEY_STEP = 0.25; // of the range that is seen
const KEYS = { ArrowLeft: ["x", -1], ArrowRight: ["x", 1], ArrowDown: ["y", -1], ArrowUp: ["y", 1] };

// plot : { ranges, whole, zoomed (as { x: [low, high], y: [low, high] }), at(event) -> pixels, value(axis, pixel),
//          axesAt(pixels) -> axes under them, let() ends a choice that had begun, view(ranges or null for the whole) }
export class PlaneGestures {
  constructor(canvas, plot) {
    this.plot = plot;
    this.canvas = canvas;
    this.fingers = new Map();
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("dblclick", () => plot.view(null));
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  // Ranges within the whole; null where they are all of it.
  inside(ranges) {
    const { whole } = this.plot;
    const kept = {};
    for (const [axis, [low, high]] of Object.entries(ranges)) {
      const [least, greatest] = whole[axis];
      const span = Math.min(Math.max(high - low, NARROWEST * (greatest - least)), greatest - least);
      const begin = Math.min(Math.max(low, least), greatest - span);
      kept[axis] = [begin, begin + span];
    }
    const all = Object.entries(kept).every(([axis, [low, high]]) => high - low > 0.999 * (whole[axis][1] - whole[axis][0]));
    return all ? null : kept;
  }

  about(axes, places, factor, ranges = this.plot.ranges) {
    const zoomed = { ...ranges };
    for (const axis of axes) {
      const [low, high] = ranges[axis];
      const middle = places[axis];
      zoomed[axis] = [middle - (middle - low) * factor, middle + (high - middle) * factor];
    }
    this.plot.view(this.inside(zoomed));
  }

  wheel(event) {
    const { plot } = this;
    if (!plot.ranges || (event.deltaY > 0 && !plot.zoomed)) return; // the page scrolls on
    event.preventDefault();
    const pixels = plot.at(event);
    const places = { x: plot.value("x", pixels[0]), y: plot.value("y", pixels[1]) };
    this.about(plot.axesAt(pixels), places, Math.exp(WHEEL * Math.max(-400, Math.min(400, event.deltaY))));
  }

  key(event) {
    const { plot } = this;
    if (!plot.ranges || event.ctrlKey || event.metaKey || event.altKey) return;
    const { x, y } = plot.ranges;
    if (event.key === "+" || event.key === "-") {
      this.about(["x", "y"], { x: (x[0] + x[1]) / 2, y: (y[0] + y[1]) / 2 }, event.key === "+" ? 0.5 : 2);
    } else if (event.key === "0") plot.view(null);
    else if (KEYS[event.key] && plot.zoomed) {
      const [axis, sign] = KEYS[event.key];
      const step = sign * KEY_STEP * (plot.ranges[axis][1] - plot.ranges[axis][0]);
      plot.view(this.inside({ ...plot.ranges, [axis]: plot.ranges[axis].map((end) => end + step) }));
    } else return;
    event.preventDefault();
    event.stopPropagation(); // the keys of the torque over time
  }

  held() {
    const places = [...this.fingers.values()];
    const middle = [0, 1].map((at) => places.reduce((sum, place) => sum + place[at], 0) / places.length);
    const apart = places.length > 1 ? Math.max(Math.hypot(places[0][0] - places[1][0], places[0][1] - places[1][1]), 8) : 0;
    return { middle, apart };
  }

  take() {
    const { middle, apart } = this.held();
    const { plot } = this;
    this.grip = { apart, pixels: middle, ranges: plot.ranges, places: { x: plot.value("x", middle[0]), y: plot.value("y", middle[1]) } };
  }

  // Whether a pointer that goes down pans or zooms; if not, it chooses.
  down(event) {
    const touch = event.pointerType === "touch";
    if (!touch && (!this.plot.zoomed || event.shiftKey)) return false;
    this.fingers.set(event.pointerId, this.plot.at(event));
    if (touch && this.fingers.size === 1 && !this.plot.zoomed) return false; // one finger chooses until a second comes
    this.plot.let();
    this.take();
    return true;
  }

  // Whether a pointer that moves pans or zooms.
  move(event) {
    if (this.fingers.has(event.pointerId)) this.fingers.set(event.pointerId, this.plot.at(event));
    if (!this.grip) return false;
    if (!this.fingers.has(event.pointerId)) return true;
    const { middle, apart } = this.held();
    const factor = apart && this.grip.apart ? this.grip.apart / apart : 1;
    const { width, height } = this.plot.area();
    const ranges = {};
    for (const [axis, at, pixels, sign] of [["x", 0, width, -1], ["y", 1, height, 1]]) {
      const [low, high] = this.grip.ranges[axis];
      const shift = (sign * (middle[at] - this.grip.pixels[at]) * (high - low) * factor) / pixels;
      const place = this.grip.places[axis];
      ranges[axis] = [place - (place - low) * factor + shift, place + (high - place) * factor + shift];
    }
    this.plot.view(this.inside(ranges));
    return true;
  }

  // Whether the pointer that is let go of panned or zoomed.
  up(event) {
    const panned = Boolean(this.grip);
    this.fingers.delete(event.pointerId);
    if (!this.fingers.size) this.grip = null;
    else if (this.grip) this.take();
    return panned;
  }
}
