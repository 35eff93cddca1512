// The maps of the error: what is under the pointer, in both maps at once.

const panel = document.querySelector("[data-error-maps]");
const maps = [...(panel?.querySelectorAll("[data-cells]") ?? [])].map((figure) => ({ figure, of: figure.dataset.of, ...JSON.parse(figure.dataset.cells) }));
const readout = panel?.querySelector("[data-cell-readout]");
const minus = (value) => String(value).replace("-", "−");

function cellAt(map, event) {
  const box = map.figure.querySelector("svg").getBoundingClientRect();
  const [left, top, right, bottom] = map.box;
  const across = ((event.clientX - box.left) / box.width - left) / (right - left);
  const up = (bottom - (event.clientY - box.top) / box.height) / (bottom - top);
  if (across < 0 || across >= 1 || up < 0 || up >= 1) return null;
  return { column: Math.floor(across * (map.speed.length - 1)), row: Math.floor(up * (map.load.length - 1)) };
}

function outline(map, cell) {
  const svg = map.figure.querySelector("svg");
  svg.querySelector(".chosen-cell")?.remove();
  if (!cell) return;
  const { width, height } = svg.viewBox.baseVal;
  const [left, top, right, bottom] = map.box;
  const [wide, tall] = [((right - left) * width) / (map.speed.length - 1), ((bottom - top) * height) / (map.load.length - 1)];
  const rect = document.createElementNS("http://www.w3.org/2000/svg", "rect");
  const place = { x: left * width + cell.column * wide, y: bottom * height - (cell.row + 1) * tall, width: wide, height: tall, class: "chosen-cell" };
  for (const [name, value] of Object.entries(place)) rect.setAttribute(name, value);
  svg.append(rect);
}

function show(cell) {
  for (const map of maps) outline(map, cell);
  if (!cell) return;
  const { speed, load, units } = maps[0];
  const parts = [["speed", `${speed[cell.column]} to ${speed[cell.column + 1]} ${units[0]}`], ["load", `${load[cell.row]} to ${load[cell.row + 1]} ${units[1]}`]];
  for (const map of maps) {
    const index = cell.row * (map.speed.length - 1) + cell.column;
    const mean = map.mean[index];
    parts.push([map.of, `${mean === null ? "–" : `${mean} ${units[1]}`} (${map.count[index]} samples)`]);
  }
  readout.replaceChildren(
    ...parts.map(([name, value]) => {
      const span = document.createElement("span");
      const number = document.createElement("b");
      number.textContent = minus(value);
      span.append(`${name} `, number);
      return span;
    }),
  );
}

for (const map of maps) {
  map.figure.addEventListener("pointermove", (event) => show(cellAt(map, event)));
  map.figure.addEventListener("pointerleave", () => show(null));
}
