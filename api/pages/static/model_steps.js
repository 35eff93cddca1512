// What is missing, from the keyboard: choose with the arrows, add, undo, redo.

const typing = (target) => target.closest("input, select, textarea, [contenteditable]");

function candidates() {
  return [...document.querySelectorAll("[data-candidate]")];
}

function choose(step) {
  const items = candidates();
  if (!items.length) return;
  const now = items.findIndex((item) => item.classList.contains("selected"));
  const next = Math.min(Math.max(now + step, 0), items.length - 1);
  if (next !== now) items[next].querySelector("[data-select]").click();
}

function press(selector) {
  const button = document.querySelector(selector);
  if (button && !button.disabled) button.click();
  return Boolean(button);
}

document.addEventListener("click", (event) => {
  const link = event.target.closest("[data-select]");
  if (!link) return;
  for (const item of candidates()) item.classList.toggle("selected", item.contains(link));
});

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || typing(event.target)) return;
  if (localStorage.getItem("single-keys") === "off") return;
  if (document.querySelector("[data-steps].htmx-request, [data-steps] .htmx-request")) return;
  const key = event.key.toLowerCase();
  if (key === "arrowdown" || key === "j") choose(1);
  else if (key === "arrowup" || key === "k") choose(-1);
  else if (key === "enter" && !event.target.closest("button, a")) press(".candidate.selected button");
  else if (["a", "u", "r"].includes(key)) press(`[data-key="${key}"]`);
  else return;
  event.preventDefault();
});
