// Zoom and pan of a plot over time: the wheel and two fingers zoom about where they are; a drag pans what is zoomed, and
// chooses a stretch of what is not, or with the shift key held.

const WHEEL = 0.0018; // part of the range for each unit of the wheel, as an exponent
const NARROWEST = 1e-3; // s

// view : { range() -> [start, stop], whole() -> [start, stop], show([start, stop]), plots() -> those that share the cursor }
export function gestures(plot, view) {
  const over = plot.over;
  const fingers = new Map();
  let grip = null; // what a drag or a pinch began with
  over.style.touchAction = "pan-y";
  const at = (event) => plot.posToVal(event.clientX - over.getBoundingClientRect().left, "x");
  const zoomed = () => {
    const [range, whole] = [view.range(), view.whole()];
    return range[1] - range[0] < 0.999 * (whole[1] - whole[0]);
  };
  const show = (start, stop) => {
    const [first, last] = view.whole();
    const span = Math.min(Math.max(stop - start, NARROWEST), last - first);
    const begin = Math.min(Math.max(start, first), last - span);
    view.show([begin, begin + span]);
  };

  over.addEventListener(
    "wheel",
    (event) => {
      if (event.deltaY > 0 && !zoomed()) return; // the page scrolls on
      event.preventDefault();
      const [start, stop] = view.range();
      const about = at(event);
      const factor = Math.exp(WHEEL * Math.max(-400, Math.min(400, event.deltaY)));
      show(about - (about - start) * factor, about + (stop - about) * factor);
    },
    { passive: false },
  );

  const held = () => [...fingers.values()].map((event) => event.clientX);
  const take = () => {
    const where = held();
    grip = { range: view.range(), middle: where.reduce((sum, x) => sum + x, 0) / where.length, apart: where.length > 1 ? Math.abs(where[0] - where[1]) : 0 };
  };
  over.addEventListener(
    "pointerdown",
    (event) => {
      if (event.button !== 0) return;
      const pans = (zoomed() && !event.shiftKey) || event.pointerType === "touch";
      for (const each of view.plots()) each.cursor.drag.x = !pans; // plots that share a cursor choose a stretch together
      if (!pans) return;
      fingers.set(event.pointerId, event);
      over.setPointerCapture(event.pointerId);
      take();
    },
    { capture: true },
  );
  over.addEventListener("pointermove", (event) => {
    if (!fingers.has(event.pointerId)) return;
    fingers.set(event.pointerId, event);
    const where = held();
    const [start, stop] = grip.range;
    const box = over.getBoundingClientRect();
    const perPixel = (stop - start) / box.width;
    const apart = where.length > 1 ? Math.max(Math.abs(where[0] - where[1]), 8) : 0;
    const factor = apart && grip.apart ? grip.apart / apart : 1;
    const middle = where.reduce((sum, x) => sum + x, 0) / where.length;
    const about = start + (grip.middle - box.left) * perPixel;
    const begin = about - (middle - box.left) * perPixel * factor;
    show(begin, begin + (stop - start) * factor);
  });
  const release = (event) => {
    fingers.delete(event.pointerId);
    if (fingers.size) take();
  };
  over.addEventListener("pointerup", release);
  over.addEventListener("pointercancel", release);
}
